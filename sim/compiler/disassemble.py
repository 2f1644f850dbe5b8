"""Instructions as text."""

from collections.abc import Iterator

import numpy as np

from hdl.isa import LAYOUTS, Opcode
from sim.compiler import fields

TEMPLATES = {
    Opcode.LOAD: "LOAD   v{v}, {vertex}",
    Opcode.MERGE3: "MERGE3 b{b}, v{v0}, v{v1}, v{v2}",
    Opcode.MERGE2: "MERGE2 b{b}, b{b0}, b{b1}, {axis}",
    Opcode.NODE: "NODE   {node}",
}
AXES = np.array(["x", "y", "z", "?"])


def disassemble(instructions: np.ndarray) -> Iterator[str]:
    """One line for each of the instructions (n,) uint32."""
    words = np.asarray(instructions, np.uint32).reshape(-1, 1)
    columns = {
        opcode: {name: fields.get(words, field) for name, field in layout if name != "opcode"}
        for opcode, layout in LAYOUTS.items()
    }
    columns[Opcode.MERGE2]["axis"] = AXES[columns[Opcode.MERGE2]["axis"]]
    for index, opcode in enumerate(fields.get(words, LAYOUTS[Opcode.LOAD]["opcode"]).tolist()):
        operands = {name: column[index] for name, column in columns[Opcode(opcode)].items()}
        yield TEMPLATES[Opcode(opcode)].format(**operands)


def assemble(lines) -> np.ndarray:
    """The instructions (n,) uint32 of lines that `disassemble` gives."""
    words = []
    for line in lines:
        name, *operands = line.replace(",", " ").split()
        layout = LAYOUTS[Opcode[name]]
        word = np.zeros((1, 1), np.uint32)
        names = [name for name, _ in layout if name != "opcode"]
        values = [Opcode[name].value] + [
            "xyz?".index(text) if field == "axis" else int(text.lstrip("vb"))
            for field, text in zip(names, operands, strict=True)
        ]
        for field, value in zip(["opcode", *names], values, strict=True):
            fields.put(word, layout[field], [value])
        words.append(word[0, 0])
    return np.array(words, np.uint32)
