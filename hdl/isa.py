"""The instruction set of the update processor: 32 bits an instruction.

=======  ======================  ==============================================================
opcode   operands                effect
=======  ======================  ==============================================================
LOAD     v, vertex               vertex register v <- vertex of that index
MERGE3   b, v0, v1, v2           box register b <- smallest box that holds three vertices
MERGE2   b, b0, b1, axis         bounds of the next node <- (b0 on axis, b1 on axis);
                                 b <- smallest box that holds both
NODE     node                    the next node is that of this index
=======  ======================  ==============================================================

An instruction reads its registers before it writes one, so b may be one of its operands. The
effect of a program is that of its instructions one after the other. After each MERGE2 the next
node is the following one. A stream has a length; it needs no end mark. (Woop, Marmitt,
Slusallek 2006, as in the lecture: load vertex, merge 3 vertices, merge 2 boxes.)
"""

from amaranth.lib import data, enum

INSTRUCTION_BITS = 32
REGISTER_BITS = 6
VERTEX_BITS = 24
NODE_BITS = 28


class Opcode(enum.Enum, shape=2):
    """What an instruction does; its lowest two bits."""

    LOAD = 0
    MERGE3 = 1
    MERGE2 = 2
    NODE = 3


LAYOUTS = {
    Opcode.LOAD: data.StructLayout({"opcode": Opcode, "v": REGISTER_BITS, "vertex": VERTEX_BITS}),
    Opcode.MERGE3: data.StructLayout({
        "opcode": Opcode,
        "b": REGISTER_BITS,
        "v0": REGISTER_BITS,
        "v1": REGISTER_BITS,
        "v2": REGISTER_BITS,
    }),
    Opcode.MERGE2: data.StructLayout({
        "opcode": Opcode,
        "b": REGISTER_BITS,
        "b0": REGISTER_BITS,
        "b1": REGISTER_BITS,
        "axis": 2,
    }),
    Opcode.NODE: data.StructLayout({"opcode": Opcode, "node": NODE_BITS}),
}
"""Fields of each instruction. Bits above the last field are zero."""
