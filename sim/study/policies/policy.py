"""The names of policies."""

import math

from sim.errors import InputError

POLICIES = (
    "every",
    "every-2",
    "stale-2",
    "moved-0",
    "moved-0.01",
    "moved-0.03",
    "rebuild-1",
    "rebuild-4",
    "sah-1.1",
    "sah-1.3",
)
"""Those that a study compares, the reference first."""

LEAST = {"every": 1, "stale": 1, "moved": 0, "rebuild": 1, "sah": 1}
"""Each kind of policy, and the least number that goes with it."""

COUNTED = ("every", "stale", "rebuild")
"""Kinds whose number is one of frames."""


def parse(policy: str) -> tuple[str, float]:
    """Kind and number of a policy: ("moved", 0.01) of "moved-0.01"; "every" is "every-1".

    Raises
    ------
    InputError
        There is no such policy.
    """
    kind, _, text = ("every-1" if policy == "every" else policy).partition("-")
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    whole = kind not in COUNTED or number.is_integer()
    if kind not in LEAST or not (math.isfinite(number) and number >= LEAST[kind] and whole):
        raise InputError(
            f"no policy {policy}: give every, every-K, stale-K or rebuild-K with K frames from 1 "
            f"on, moved-E with a distance from 0 on, or sah-F with a ratio from 1 on"
        )
    return kind, number
