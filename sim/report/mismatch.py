"""Words of the Verilog's memory that are not the model's."""

import numpy as np

from hdl import records
from sim.compiler import fields
from sim.compiler.image import Image
from sim.model.fp.format import decode
from sim.model.fp.order import order_key

SHOWN = 10
"""Mismatches that a report describes."""
BOUNDS = ("left lo", "left hi", "right lo", "right hi")


def mismatches(expected: np.ndarray, found: np.ndarray) -> np.ndarray:
    """Addresses at which two memories of words (n, limbs) differ."""
    return np.flatnonzero((expected != found).any(axis=1))


def describe_all(
    image: Image, frame: int, expected: np.ndarray, found: np.ndarray
) -> tuple[int, list[str]]:
    """Number of words that differ in a frame, and a line on each of the first."""
    wrong = mismatches(expected, found)
    lines = [
        f"frame {frame}, {describe(image, address, expected[address], found[address])}"
        for address in wrong[:SHOWN].tolist()
    ]
    return len(wrong), lines


def describe(image: Image, address: int, expected: np.ndarray, found: np.ndarray) -> str:
    """One line on a word (limbs,) that differs: raw bits, and for a bound ulps and values."""
    region = next(name for name, at in image.regions.items() if address in at)
    if region != "node":
        word = address - image.regions[region].start
        return f"{region} word {word} was written: {_hex(found)}"
    fmt = image.config.fmt
    node = f"node {address - image.nodes_at}"
    for name, (_, field) in zip(BOUNDS, records.bounds(fmt), strict=True):
        want, got = (int(fields.get(word[None], field)[0]) for word in (expected, found))
        if want != got:
            ulps = int(order_key(fmt, got) - order_key(fmt, want))
            digits = -(-fmt.bits // 4)
            return (
                f"{node}, {name}: {got:0{digits}x}, not {want:0{digits}x}: {ulps:+} ulp, "
                f"{decode(fmt, got):.9g}, not {decode(fmt, want):.9g}"
            )
    return f"{node}, link: {_hex(found)}, not {_hex(expected)}"


def _hex(word: np.ndarray) -> str:
    return "".join(f"{limb:08x}" for limb in word[::-1].tolist())
