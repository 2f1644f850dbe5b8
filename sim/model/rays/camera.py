"""Model of hdl.rays.camera: the rays of a pinhole camera, in packets of 2 x 2 pixels."""

from dataclasses import dataclass

import numpy as np

from hdl.fp.format import FloatFormat
from sim.model.fp.add import add
from sim.model.fp.format import decode, encode
from sim.model.fp.mul import mul
from sim.model.fp.round import elementwise, overflow_bits


@dataclass(frozen=True)
class Rays:
    """Rays in the order of packets, four a packet; all numbers are bit patterns.

    Attributes
    ----------
    origins, directions : (n, 3) int64
    t_min, t_max : (n,) int64
        Of a ray beyond the image +inf and -inf.
    pixels : (n,) int64
        Row times width plus column, or -1 beyond the image.
    overflow : bool
        Of a camera: finite numbers became infinite on the way to a direction.
    """

    origins: np.ndarray
    directions: np.ndarray
    t_min: np.ndarray
    t_max: np.ndarray
    pixels: np.ndarray
    overflow: bool = False


overflowed = elementwise(overflow_bits)


def camera(
    fmt: FloatFormat,
    origin: np.ndarray,
    corner: np.ndarray,
    right: np.ndarray,
    down: np.ndarray,
    width: int,
    height: int,
    t_min: int,
    t_max: int,
    top: int = 0,
) -> Rays:
    """Rays of an image, or of its rows from `top` on. Numbers are bit patterns, but sizes are not.

    The direction at column x, row y is (corner + x * right) + y * down, each operation rounded to
    nearest. Packets go along rows of 2 x 2 pixels, and so do the rays of a packet.

    Parameters
    ----------
    fmt : FloatFormat
    origin, corner, right, down : (3,) int64
        Of the camera; the direction of the first pixel, and what it changes by a pixel.
    width, height : int
        Pixels, at least 1.
    t_min, t_max : int
    top : int
        Even, and less than height.

    Raises
    ------
    ValueError
        The format does not hold each column and row, or there is none, or no packet begins at top.
    """
    columns, rows = np.arange(-(-width // 2) * 2), np.arange(-(-height // 2) * 2)
    for name, size, numbers in (("width", width, columns), ("height", height, rows)):
        if size < 1 or (decode(fmt, encode(fmt, numbers)) != numbers).any():
            raise ValueError(f"{name} {size} does not go with format {fmt}")
    if top % 2 or not 0 <= top < height:
        raise ValueError(f"row {top} of {height} does not begin a row of packets")
    rows = rows[top:]
    # Axes: row of packets, column of packets, row in the packet, column in the packet.
    y = np.broadcast_to(rows.reshape(-1, 1, 2, 1), (len(rows) // 2, len(columns) // 2, 2, 2))
    x = np.broadcast_to(columns.reshape(1, -1, 1, 2), y.shape)
    x, y = x.ravel(), y.ravel()
    columns, rows = encode(fmt, x)[:, None], encode(fmt, y)[:, None]
    across, downward = mul(fmt, columns, right), mul(fmt, rows, down)
    in_row = add(fmt, corner, across)
    directions = add(fmt, in_row, downward)
    overflow = any(
        overflowed(fmt, *operation).any()
        for operation in (
            (across, columns, right),
            (downward, rows, down),
            (in_row, corner, across),
            (directions, in_row, downward),
        )
    )
    inside = (x < width) & (y < height)
    return Rays(
        origins=np.broadcast_to(np.asarray(origin, np.int64), directions.shape),
        directions=directions,
        t_min=np.where(inside, t_min, encode(fmt, np.inf)),
        t_max=np.where(inside, t_max, encode(fmt, -np.inf)),
        pixels=np.where(inside, y * width + x, -1),
        overflow=overflow,
    )
