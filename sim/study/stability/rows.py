"""A row of the study: one thing tried, what each system made of it, and a verdict."""

from collections.abc import Callable

import numpy as np

from sim.errors import InputError
from sim.study.stability.tracers import Make

Counts = dict[str, int]
Judge = Callable[[Counts], tuple[bool, str]]
"""From our counts to whether they are as they must be, and the verdict."""


def row(
    name: str,
    cases: int,
    makers: dict[str, Make],
    measure: Callable[[Make], Counts],
    judge: Judge,
    shown: tuple[str, ...] = (),
) -> dict:
    """A row, for JSON.

    Parameters
    ----------
    name : str
    cases : int
        Rays, or whatever else is counted.
    makers : dict
        Of sim.study.stability.tracers.systems.
    measure : callable
        Counts of what one system does wrong, by name.
    judge : callable
        Takes the counts of ours.
    shown : tuple of str
        Which counts the table shows, all if it is empty.

    Returns
    -------
    dict
        name, cases, found (a dict of counts by system, or {"refused": why}), shown, verdict, and
        ok: False where something is wrong that must not be.
    """
    found: dict[str, dict] = {}
    for system, make in makers.items():
        try:
            found[system] = measure(make)
        except InputError as error:
            found[system] = {"refused": str(error)}
    ours = found["ours"]
    ok, verdict = (True, "refused") if "refused" in ours else judge(ours)
    return {
        "name": name,
        "cases": cases,
        "found": found,
        "shown": list(shown),
        "verdict": verdict,
        "ok": ok,
    }


def none(what: str) -> Judge:
    """All counts have to be 0: the verdict is "0 lost" or "3 lost", if lost is what they are."""

    def judge(ours: Counts) -> tuple[bool, str]:
        wrong = sum(ours.values())
        return wrong == 0, f"{wrong} {what}"

    return judge


def power(number: float) -> str:
    """A power of ten, short: 1e3, 1e-18."""
    return f"1e{round(np.log10(number))}"
