"""Payloads of streams from the numbers in them, and how two of them differ."""

from amaranth.lib import data

from hdl.fp.format import FloatFormat
from sim.model.fp.format import decode
from sim.model.fp.order import order_key


def leaves(layout: data.Layout, fmt: FloatFormat, prefix: str = "", offset: int = 0):
    """Name, offset and width of each number in a layout; floats are whole. `v0.x` is x in v0."""
    for name, field in layout:
        at = offset + field.offset
        if isinstance(field.shape, data.Layout) and field.shape != fmt.layout:
            yield from leaves(field.shape, fmt, f"{prefix}{name}.", at)
        else:
            yield f"{prefix}{name}", at, field.width


def pack(layout: data.Layout, fmt: FloatFormat, columns: dict) -> list[int]:
    """Payloads of a layout from a column of numbers for each of its leaves."""
    places = list(leaves(layout, fmt))
    assert {name for name, _, _ in places} == set(columns)
    rows = [0] * len(next(iter(columns.values())))
    for name, offset, width in places:
        for row, value in enumerate(map(int, columns[name])):
            assert 0 <= value < 1 << width, f"{name} = {value} does not fit {width} bits"
            rows[row] |= value << offset
    return rows


def unpack(layout: data.Layout, bits: int) -> dict[str, int]:
    """The fields of a payload, each as a number."""
    return {name: bits >> f.offset & (1 << f.width) - 1 for name, f in layout}


def difference(fmt: FloatFormat, layout: data.Layout, got: int, want: int) -> str:
    """The first number in which payloads differ: raw bits, and of a float ulps and values."""
    for name, offset, width in leaves(layout, fmt):
        a, b = (bits >> offset & (1 << width) - 1 for bits in (got, want))
        if a != b:
            return (
                f"{name}: {float_difference(fmt, a, b)}"
                if width == fmt.bits
                else (f"{name}: {a:x}, not {b:x}")
            )
    return f"{got:x}, not {want:x}"


def float_difference(fmt: FloatFormat, got: int, want: int) -> str:
    """Two bit patterns, the ulps between them, and their values."""
    digits = -(-fmt.bits // 4)
    ulps = int(order_key(fmt, got) - order_key(fmt, want))
    return (
        f"{got:0{digits}x}, not {want:0{digits}x}: {ulps:+} ulp, "
        f"{decode(fmt, got):.9g}, not {decode(fmt, want):.9g}"
    )
