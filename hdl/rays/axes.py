"""Values on the three axes, together or one after the other."""

from collections.abc import Iterable, Mapping

from amaranth import *
from amaranth.hdl import ValueLike
from amaranth.lib import data

from hdl.fp.format import FloatFormat
from hdl.rays.delay import Pipeline, Timed
from hdl.rays.packet import AXES


def pick(axis: ValueLike, values: Iterable[data.View]) -> data.View:
    """Of three floats that of an axis."""
    values = list(values)
    return data.View(values[0].shape(), Array(x.as_value() for x in values)[Value.cast(axis)])


def turn(point: data.View | Mapping[str, data.View], axis: ValueLike, to: str) -> data.View:
    """A coordinate of a point in the space in which `axis` is z."""
    axis, after = Value.cast(axis), AXES.index(to) + 1
    x = Mux(axis == 2, point[AXES[(after + 2) % 3]], point[AXES[(after + 1) % 3]])
    return data.View(point[to].shape(), Mux(axis == 0, point[AXES[after % 3]], x))


def vector(p: Pipeline, fmt: FloatFormat, x: Timed, cycle: int) -> dict[str, data.View]:
    """A float of which one axis comes a cycle, on all axes, in the cycle of the last one."""
    last = Timed(x.name, p.at(x, cycle), cycle)
    return {
        a: data.View(fmt.layout, Value.cast(p.at(last, cycle + wait)))
        for a, wait in zip(AXES, (2, 1, 0), strict=True)
    }
