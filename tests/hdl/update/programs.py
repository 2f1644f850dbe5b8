"""Random legal programs for the update processor, and a memory that holds them."""

from dataclasses import dataclass

import numpy as np
from hypothesis import strategies as st

from hdl import records
from hdl.config import Config
from hdl.isa import LAYOUTS, Opcode
from sim.compiler import fields
from sim.model.fp.format import encode
from tests.hdl.fp.operands import specials, weighted

L, M3, M2, N = Opcode.LOAD, Opcode.MERGE3, Opcode.MERGE2, Opcode.NODE
MIXES = {
    "all": [L, L, L, M3, M3, M2, M2, M2, N],
    "loads": [*[L] * 14, M3, M2],
    "leaves": [L, *[M3] * 8, M2],
    "nodes": [*[M2] * 24, M3, N, L],
}
"""How often each opcode comes: a mix of its own for each cause of a stall."""

CHOICES = st.tuples(*[st.integers(0, 63)] * 5)
"""Numbers from which `legal` chooses an opcode and its operands."""


@dataclass(frozen=True)
class Job:
    """A program, where it lies, and the memory around it.

    Attributes
    ----------
    instructions : (n,) uint32
    vertices, nodes : int
        How many.
    program_at, vertices_at, nodes_at : int
        Addresses.
    seed : int
        Of the vertices.
    """

    instructions: np.ndarray
    vertices: int
    nodes: int
    program_at: int
    vertices_at: int
    nodes_at: int
    seed: int


def legal(config: Config, choices, mix, reach, pools, vertices: int, nodes: int) -> list[int]:
    """Instructions of a legal program that does what the choices ask for, as far as it is legal.

    Operands are chosen among the `reach` registers that were written last: a small one makes for
    short distances. `pools` is how many vertex and box registers are in use.
    """
    written = {"v": [], "b": []}  # registers, the one written last first
    turns = {"v": 0, "b": 0}  # most writes go to the register that was written longest ago
    words = []
    lowest = node = 0  # the first node not written, the next node

    def emit(opcode, **operands):
        words.append(LAYOUTS[opcode].const({"opcode": opcode} | operands).as_bits())

    def recent(kind, choice):
        return written[kind][choice % min(reach, len(written[kind]))]

    def write(kind, choice):
        count = config.vertex_registers if kind == "v" else config.box_registers
        pool = min(pools["vb".index(kind)], count)
        turns[kind] += 1
        index = (turns[kind] if choice >= 16 else choice) % pool
        register = index * (count - 1) // max(pool - 1, 1)  # the last register too
        if register in written[kind]:
            written[kind].remove(register)
        written[kind].insert(0, register)
        return register

    for op, a, b, c, d in choices:
        opcode = mix[op % len(mix)]
        if opcode is Opcode.MERGE2 and (not written["b"] or node == nodes):
            opcode = Opcode.MERGE3
        if opcode is Opcode.MERGE3 and not written["v"]:
            opcode = Opcode.LOAD
        match opcode:
            case Opcode.LOAD:
                emit(opcode, vertex=b * vertices // 64, v=write("v", a))
            case Opcode.MERGE3:
                v0, v1, v2 = (recent("v", x) for x in (b, c, d))
                emit(opcode, v0=v0, v1=v1, v2=v2, b=write("b", a))
            case Opcode.MERGE2:
                b0, b1 = recent("b", b), recent("b", c)
                # One time in three the result goes to an operand.
                target = (b0, b1)[a % 2] if a % 3 == 0 else None
                if target is not None:
                    written["b"].remove(target)
                    written["b"].insert(0, target)
                b_out = write("b", a) if target is None else target
                emit(opcode, b0=b0, b1=b1, axis=d % 3, b=b_out)
                node += 1
                lowest = node
            case Opcode.NODE:
                node = min(lowest + a % 5, nodes)
                emit(opcode, node=node)
    return words


@st.composite
def jobs(draw, config: Config, words: int, longest: int) -> Job:
    """A job in a memory of so many words, of at most `longest` instructions."""
    slots = records.instructions_per_word(config.fmt)
    part = words // 3
    length = draw(st.integers(0, min(longest, part * slots)))
    choices = draw(st.lists(CHOICES, min_size=length, max_size=length))
    pools = draw(st.sampled_from([(64, 64), (3, 2), (5, 64), (64, 5), (1, 1)]))
    mix = MIXES[draw(st.sampled_from(list(MIXES)))]
    reach = draw(st.sampled_from([2, 1, 5, 64]))
    vertices = draw(st.integers(1, min(part, 40)))
    nodes = draw(st.integers(0, min(part, 60)))
    instructions = legal(config, choices, mix, reach, pools, vertices, nodes)
    # Three regions in any order, with gaps between them.
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    sizes = {"program": -(-length // slots), "vertices": vertices, "nodes": nodes}
    gaps = np.diff(np.sort(rng.integers(0, words - sum(sizes.values()) + 1, 3)), prepend=0)
    places, address = {}, 0
    for gap, name in zip(gaps.tolist(), rng.permutation(list(sizes)).tolist(), strict=True):
        places[f"{name}_at"] = address + gap
        address += gap + sizes[name]
    return Job(np.array(instructions, np.uint32), vertices, nodes, **places, seed=seed)


def coordinates(config: Config, job: Job) -> np.ndarray:
    """Bit patterns (V, 3) of the vertices: ordinary numbers, the corners of the format, or both."""
    fmt, rng = config.fmt, np.random.default_rng(job.seed)
    size = (job.vertices, 3)
    kinds = (
        encode(fmt, rng.uniform(-1, 1, size)),
        rng.choice(specials(fmt), size),
        weighted(fmt, rng, *size),
    )
    return np.choose(rng.integers(0, 3, size) if job.seed % 4 else job.seed // 4 % 3, kinds)


def write_job(config: Config, job: Job, memory: np.ndarray):
    """Put a job's program and vertices into a memory (words, limbs)."""
    limbs = memory.shape[1]
    count = -(-len(job.instructions) // limbs)
    program = memory[job.program_at : job.program_at + count].reshape(-1)
    program[: len(job.instructions)] = job.instructions
    vertices = memory[job.vertices_at : job.vertices_at + job.vertices]
    put_columns(vertices, records.vertex(config.fmt), coordinates(config, job))


def put_columns(words: np.ndarray, layout, columns: np.ndarray):
    """Overwrite the fields of a layout in the lowest bits of words (n, limbs), and no other bit."""
    for column, (_, field) in enumerate(layout):
        old = fields.get(words, field)
        clear = np.zeros_like(words)
        fields.put(clear, field, old)
        words ^= clear
        fields.put(words, field, columns[:, column])


def bounds_of(config: Config, words: np.ndarray) -> np.ndarray:
    """Bit patterns (n, 4) of the bounds in node records."""
    layout = records.bounds(config.fmt)
    return np.stack([fields.get(words, field) for _, field in layout], axis=1)
