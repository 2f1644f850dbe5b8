"""What is known of a packet of rays, and how its parts are laid out."""

from amaranth.lib import data
from amaranth.utils import bits_for

from hdl import records
from hdl.config import Config
from hdl.fp.format import FloatFormat, power_of_two
from hdl.isa import NODE_BITS

RAYS = 4
"""Rays of a packet: 2 x 2 pixels, in the order of rows."""

AXES = "xyz"

NO_TRIANGLE = (1 << NODE_BITS) - 1
"""The triangle of a ray that hits nothing: above all others."""

MARGIN_ULPS = 32
"""Half ulps of the largest distance that boxes grow by.

More than the triangle test's rounding moves a point by (sim.model.rays.setup says how much), so
that every ray that hits a triangle enters the boxes around it, and the order of traversal never
changes a hit.
"""


def margin(fmt: FloatFormat) -> data.Const:
    """By how much boxes grow at distance 1: MARGIN_ULPS half ulps. A power of two."""
    return power_of_two(fmt, MARGIN_ULPS.bit_length() - 1 - (fmt.man_bits + 1))


INSTANCE_ULPS = 28, 40
"""Half ulps by which a ray may miss what it hits in the frame of an instance: times the norm of its
matrix, and by themselves. sim.model.rays.transform says where they come from."""


def instance_margin(fmt: FloatFormat, norm: float, inverse_norm: float) -> float:
    """By how much boxes have to grow at distance 1, that rays which hit an instance reach its leaf.

    The margin of a scene is at least this of each of its instances, and `margin`. So the order of
    traversal never changes a hit, if no coordinate of the world or of an object is beyond [-1, 1].

    Parameters
    ----------
    fmt : FloatFormat
    norm, inverse_norm : float
        Largest row sums of magnitudes of the 3 x 3 matrix in the rows of the instance, and of its
        inverse.
    """
    of_norm, constant = INSTANCE_ULPS
    return 2.0 ** -(fmt.man_bits + 1) * inverse_norm * (of_norm * norm + constant)


def packet_bits(config: Config) -> int:
    """Bits of the number of a packet under way."""
    return bits_for(config.packets - 1)


def level(config: Config) -> dict[str, int]:
    """A field, where there are instances: 0 in the world, 1 in an object."""
    return {"level": 1} if config.instances else {}


def numbered(config: Config, fields: dict) -> data.StructLayout:
    """Something of one ray of a packet."""
    return data.StructLayout({"packet": packet_bits(config), "number": range(RAYS), **fields})


def pixel_bits(fmt: FloatFormat) -> int:
    """Bits of a column or row: of no more numbers than the format holds exactly."""
    return min(fmt.man_bits + 1, fmt.bias + 1, 16)


def ray(fmt: FloatFormat) -> data.StructLayout:
    """A ray: points origin + t * direction with t_min <= t <= t_max.

    Directions have any length. A ray with t_min above t_max is not there.
    """
    return data.StructLayout({
        "origin": records.vertex(fmt),
        "direction": records.vertex(fmt),
        "t_min": fmt.layout,
        "t_max": fmt.layout,
    })


def ray_word(fmt: FloatFormat) -> data.StructLayout:
    """Half a ray in memory, a word in its lowest bits: origin and t_min, direction and t_max."""
    return data.StructLayout({"point": records.vertex(fmt), "t": fmt.layout})


def slab_ray(fmt: FloatFormat) -> data.StructLayout:
    """A ray on one axis, as planes meet it.

    above, below : the origin plus and minus the margin
    inverse_down, inverse_up : one over the direction, rounded down and up
    negative : sign of the direction
    """
    return data.StructLayout({
        "above": fmt.layout,
        "below": fmt.layout,
        "inverse_down": fmt.layout,
        "inverse_up": fmt.layout,
        "negative": 1,
    })


def sheared_ray(fmt: FloatFormat) -> data.StructLayout:
    """A ray as triangles meet it.

    axis : z of the sheared space, 0 to 2; x and y are the two that follow it
    shear : factors of x, y and z
    t_min : of the ray
    """
    return data.StructLayout({
        "origin": records.vertex(fmt),
        "axis": 2,
        "shear": records.vertex(fmt),
        "t_min": fmt.layout,
    })


def interval(fmt: FloatFormat) -> data.StructLayout:
    """The part of a ray that is in question. Empty where near is above far."""
    return data.StructLayout({"near": fmt.layout, "far": fmt.layout})


def hit(config: Config) -> data.StructLayout:
    """The first hit of a ray, one word in memory, in its lowest bits.

    u and v weigh the triangle's vertices 1 and 2. `instance`, where there are such, is the leaf
    through which the ray entered an object; NO_TRIANGLE for a triangle of the world. Without a
    hit: t_max, 0, 0, NO_TRIANGLE, NO_TRIANGLE.
    """
    return data.StructLayout({
        **dict.fromkeys(("t", "u", "v"), config.fmt.layout),
        "triangle": NODE_BITS,
        **({"instance": NODE_BITS} if config.instances else {}),
    })
