"""Records in memory: what the bits of a word mean.

A memory word has 128 bits, or the next multiple that holds a node of a wider format.
"""

from amaranth.lib import data

from hdl.config import Config
from hdl.fp.format import FloatFormat
from hdl.isa import INSTRUCTION_BITS, NODE_BITS

INDEX_BITS = 32


def bound_bytes(fmt: FloatFormat) -> int:
    """Bytes that the four bounds of a node take: the update processor writes these only."""
    return -(-4 * fmt.bits // 8)


def word_bits(fmt: FloatFormat) -> int:
    """Bits of a memory word: four bounds and a link of 32 bits, in whole multiples of 128."""
    return -(-(8 * bound_bytes(fmt) + 32) // 128) * 128


def instructions_per_word(fmt: FloatFormat) -> int:
    return word_bits(fmt) // INSTRUCTION_BITS


def bounds(fmt: FloatFormat) -> data.StructLayout:
    """Intervals of the two children of a node on its axis."""
    return data.StructLayout({
        "left_lo": fmt.layout,
        "left_hi": fmt.layout,
        "right_lo": fmt.layout,
        "right_hi": fmt.layout,
    })


def node(fmt: FloatFormat) -> data.FlexibleLayout:
    """One word: bounds in the lowest bytes, the link in the highest 32 bits.

    The pointer is the left child: a node, or a triangle where left_is_leaf. An inner right child
    is the node before this one; a right leaf is the triangle after the left one. A node with one
    leaf has it on the left.
    """
    link = word_bits(fmt) - 32
    return data.FlexibleLayout(
        word_bits(fmt),
        {
            "bounds": data.Field(bounds(fmt), 0),
            "axis": data.Field(2, link),
            "left_is_leaf": data.Field(1, link + 2),
            "right_is_leaf": data.Field(1, link + 3),
            "pointer": data.Field(NODE_BITS, link + 4),
        },
    )


def vertex(fmt: FloatFormat) -> data.StructLayout:
    """A point, one a word, in its lowest bits."""
    return data.StructLayout({"x": fmt.layout, "y": fmt.layout, "z": fmt.layout})


def box(fmt: FloatFormat) -> data.StructLayout:
    """An axis-aligned box, as a box register holds it: never in memory."""
    return data.StructLayout({"lo": vertex(fmt), "hi": vertex(fmt)})


TRIANGLE = data.StructLayout({
    **dict.fromkeys(("v0", "v1", "v2"), INDEX_BITS),
    "is_instance": 1,
})
"""A leaf, one a word, in its lowest bits: vertex indices of a triangle; or those of the rows x, y
and z of an instance. A machine without instances does not look at `is_instance`."""


def row(fmt: FloatFormat) -> data.FlexibleLayout:
    """A row of an instance's matrix, a word in the table of vertices.

    Points of the world go into the frame of the object: its row k makes coordinate k,
    x * px + y * py + z * pz + offset. `root` is that of the object's tree, a node; it counts in
    row x alone.
    """
    numbers = dict.fromkeys(("x", "y", "z", "offset"), fmt.layout)
    return data.FlexibleLayout(
        word_bits(fmt),
        {
            **{
                name: data.Field(shape, k * fmt.bits)
                for k, (name, shape) in enumerate(numbers.items())
            },
            "root": data.Field(NODE_BITS, word_bits(fmt) - NODE_BITS),
        },
    )


def scene(config: Config) -> data.StructLayout:
    """Where the records of a scene lie: the first of each kind; and the root, a node.

    margin : by how much boxes grow as rays see them, times 1 + the largest coordinate of the ray's
        origin; at least hdl.rays.packet.margin, which is what rounding asks for. More is for bounds
        that are older than the vertices.
    """
    return data.StructLayout({
        **dict.fromkeys(("vertices", "triangles", "nodes"), config.address_bits),
        "root": config.pointer_bits,
        "margin": config.fmt.layout,
    })
