"""The configuration of a machine: every parameter that hardware, compiler and model share."""

from dataclasses import dataclass
from typing import ClassVar

from hdl.fp.format import F24, FloatFormat
from hdl.isa import NODE_BITS, REGISTER_BITS


@dataclass(frozen=True)
class Config:
    """What is built.

    Parameters
    ----------
    fmt : FloatFormat
        Format of coordinates and bounds.
    vertex_registers, box_registers : int
        3 to 64 and 2 to 64.
    latency : int
        Cycles from a memory request to its response that the update processor hides; at longer
        ones it is as right, and slower. 1 to 256.
    address_bits : int
        Bits of the address of a memory word. 4 to 28.
    packets : int
        Packets of four rays in flight. 1 to 32.
    stack_depth : int
        Nodes that a packet can have waiting: levels of nodes of the deepest tree. 1 to 64.
    cache_words : int
        Words of the cache of nodes, and of that of geometry: a power of two, 2 to 65536. With 0
        there are none; nodes and geometry have memory ports of their own, for banks on the chip.
    update : bool
        There is an update processor. Without one, trees stay as they are.
    camera, source : bool
        Rays come from the camera, and from memory. One of them at least.
    instances : bool
        Leaves of a tree may be instances of objects, which have trees of their own.
    folded : bool
        The ray path has half the units for nodes and a third of those for triangles, and they take
        turns: a node takes two cycles, a ray at a triangle three. The same hits.
    pointer_bits : int
        Bits of the index of a node or a triangle inside the machine; those in memory have 28. The
        highest index stands for no triangle. 2 to 28.

    Raises
    ------
    ValueError
        A parameter is out of its range, or there is nowhere for rays to come from.
    """

    fmt: FloatFormat = F24
    vertex_registers: int = 64
    box_registers: int = 64
    latency: int = 32
    address_bits: int = 28
    packets: int = 32
    stack_depth: int = 32
    cache_words: int = 2048
    update: bool = True
    camera: bool = True
    source: bool = True
    instances: bool = False
    folded: bool = False
    pointer_bits: int = NODE_BITS

    box_latency: ClassVar[int] = 2
    """Cycles from the issue of a merge to that of the first instruction that can read its box."""

    def __post_init__(self):
        if self.fmt.exp_bits > 8 or self.fmt.man_bits > 23:
            raise ValueError(f"a float has at most 8,23 bits, not {self.fmt}")
        most = 1 << REGISTER_BITS
        for name, low, high in [
            ("vertex_registers", 3, most),
            ("box_registers", 2, most),
            ("latency", 1, 256),
            ("address_bits", 4, 28),
            ("packets", 1, 32),
            ("stack_depth", 1, 64),
            ("cache_words", 0, 1 << 16),
            ("pointer_bits", 2, NODE_BITS),
        ]:
            if not low <= getattr(self, name) <= high:
                raise ValueError(f"{name} is {low} to {high}, not {getattr(self, name)}")
        if self.cache_words == 1 or self.cache_words & (self.cache_words - 1):
            raise ValueError(f"cache_words is 0 or a power of two, not {self.cache_words}")
        if not (self.camera or self.source):
            raise ValueError("rays come from somewhere: camera or source is true, not neither")

    @property
    def most_triangles(self) -> int:
        """Triangles of the largest scene, by the bits of their indices."""
        return (1 << self.pointer_bits) - 1

    @property
    def load_latency(self) -> int:
        """Cycles from the issue of a LOAD to that of the first MERGE3 that can read its vertex.

        What the units take if nothing else wants the memory port, and `latency`.
        """
        return self.latency + 5

    @property
    def lead(self) -> int:
        """Leaves by which a LOAD should be ahead of its MERGE3.

        A leaf comes every 2.5 instructions; some cycles more, since others want the port too.
        """
        return -(-2 * (self.load_latency + 13) // 5)


FULL = Config()
"""The machine of the 2006 paper."""

TINY = Config(
    FloatFormat(3, 2),
    vertex_registers=5,
    box_registers=4,
    latency=4,
    address_bits=12,
    packets=3,
    stack_depth=4,
    cache_words=16,
)
"""Small enough to meet every corner in a test."""

SMALL = Config(vertex_registers=32, box_registers=32, packets=16, stack_depth=24, cache_words=512)
"""For small devices: half the packets, a quarter of the caches."""

ULX3S = Config(
    vertex_registers=32,
    box_registers=32,
    latency=3,  # arbiter and memory on the chip
    address_bits=14,  # 16,384 words: 128 of the 208 block RAMs of an ECP5-85F
    packets=16,  # memory this near has little latency to hide; leaves a third of the LUTs free
    stack_depth=24,  # what fits the memory has a tree of 16 levels
    cache_words=256,  # memory behind them is on the chip too; they are there to share its port
)
"""For memory on the chip of an ECP5-85F."""

TWO_LEVEL = Config(instances=True)
"""The full machine, and instances of objects."""

KC705 = Config(
    latency=3,
    address_bits=15,  # 32,768 words: 256 of the 890 block RAMs of 18 kbit of a Kintex-7 325T
    stack_depth=24,
    cache_words=512,
)
"""For memory on the chip of a Kintex-7 325T: all registers and packets of the full machine."""

ADM_XRC_4LX = Config(
    latency=3,
    address_bits=14,  # 16,384 words: 128 of the 288 block RAMs of a Virtex-4 LX160
    stack_depth=24,
    cache_words=512,
)
"""For memory on the chip of a Virtex-4 LX160: all registers and packets of the full machine."""

CONFIGS = {
    "tiny": TINY,
    "small": SMALL,
    "full": FULL,
    "two-level": TWO_LEVEL,
    "ulx3s": ULX3S,
    "kc705": KC705,
    "adm-xrc-4lx": ADM_XRC_4LX,
}
"""Configurations by name."""
