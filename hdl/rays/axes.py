"""Values on the three axes, together or one after the other."""

from collections.abc import Sequence

from amaranth import *
from amaranth.lib import data

from hdl.rays.delay import Pipeline, Timed
from hdl.rays.packet import AXES


def pick(axis: Value, values: Sequence[data.View]) -> data.View:
    """Of three floats that of an axis."""
    return data.View(values[0].shape(), Array(x.as_value() for x in values)[axis])


def turn(point: data.View, axis: Value, to: str) -> data.View:
    """A coordinate of a point in the space in which `axis` is z."""
    after = AXES.index(to) + 1
    x = Mux(axis == 2, point[AXES[(after + 2) % 3]], point[AXES[(after + 1) % 3]])
    return data.View(point[to].shape(), Mux(axis == 0, point[AXES[after % 3]], x))


def vector(p: Pipeline, x: Timed, cycle: int) -> dict[str, data.View]:
    """A value of which one axis comes a cycle, on all axes, in the cycle of the last one."""
    last = Timed(x.name, p.at(x, cycle), cycle)
    return {a: p.at(last, cycle + wait) for a, wait in zip(AXES, (2, 1, 0), strict=True)}
