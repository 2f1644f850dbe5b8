"""Options that several commands of `bkd-sim` share, and what they mean."""

import re
from dataclasses import replace
from pathlib import Path

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from sim.command import Parser
from sim.cosim.machine import Timing
from sim.errors import InputError
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from sim.tree.build import BUILDERS

BANK_LATENCY = 2
"""Cycles of a bank on the chip: one for the address, one for the word."""
SCENE_HELP = (
    "walker, waves, room or burst, with a size as in walker:80k; an .npz with faces and vertices; "
    "glTF; any mesh file; a folder or pattern of numbered meshes"
)


def scene_arguments(parser: Parser, default: str | None = None):
    """The scene, its tree and its format; the scene may be left out where it has a default."""
    add = parser.add_argument
    text = SCENE_HELP + (f"; {default}" if default else "")
    add("scene", metavar="SCENE", help=text, nargs="?" if default else None, default=default)
    add("--builder", choices=BUILDERS, default="sah", help="of the tree; %(default)s")
    add("--format", metavar="E,M", default="7,16", help="bits of a float; %(default)s")
    add("--fps", metavar="N", type=float, help="glTF: frames a second; 24")
    add("--animation", metavar="NAME", help="glTF: name or number; the first")
    add("--period", metavar="N", type=int, help="walker, ...: frames of a period; 24")


def timing_arguments(parser: Parser):
    """How the memory behaves."""
    add = parser.add_argument
    add("--latency", metavar="N", type=int, default=32, help="of memory, in cycles; %(default)s")
    add("--stalls", metavar="P", type=float, default=0.0, help="share of cycles memory stalls; 0")
    add("--seed", metavar="N", type=int, default=1, help="of the stalls; %(default)s")


def memory_arguments(parser: Parser):
    """The memory of the ray path, and how large what hides it is."""
    add = parser.add_argument
    text = "behind caches, or in banks on the chip; %(default)s"
    add("--memory", choices=("dram", "banks"), default="dram", help=text)
    add("--cache", metavar="N", type=int, default=2048, help="words of each of two; %(default)s")
    add("--stack", metavar="N", type=int, default=32, help="levels of the tree; %(default)s")
    timing_arguments(parser)


def json_argument(parser: Parser):
    """A file for the figures."""
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures to FILE")


def scene_of(options) -> Scene:
    """The scene that options name."""
    return load_scene(
        options.scene, fps=options.fps, animation=options.animation, period=options.period
    )


def timing_of(options) -> Timing:
    """The memory that options describe."""
    return checked(Timing, latency=options.latency, stalls=options.stalls, seed=options.seed)


def ray_timing_of(options) -> Timing:
    """The memory of the ray path that options describe; banks have a latency of their own."""
    timing = timing_of(options)
    return replace(timing, latency=BANK_LATENCY) if options.memory == "banks" else timing


def ray_config_of(options, fmt: str) -> Config:
    """The machine for that memory."""
    banks = options.memory == "banks"
    if not banks and options.cache < 2:
        raise InputError(f"--cache {options.cache}: a cache has 2 words at least, or use banks")
    return config_of(
        fmt,
        latency=ray_timing_of(options).latency,
        cache_words=0 if banks else options.cache,
        stack_depth=options.stack,
    )


def config_of(fmt: str, **changes) -> Config:
    """The full machine, with another format and other parameters."""
    match = re.fullmatch(r"(\d+),(\d+)", fmt)
    if not match:
        raise InputError(f"--format {fmt}: give exponent and mantissa bits, as in 7,16")
    chosen = checked(FloatFormat, exp_bits=int(match[1]), man_bits=int(match[2]))
    return checked(lambda **new: replace(FULL, **new), fmt=chosen, **changes)


def frames_of(text: str, count: int, option: str = "--frames") -> range:
    """Frames of A:B, or of one number."""
    match = re.fullmatch(r"(\d*)(:?)(\d*)", text)
    if not match or text == "":
        raise InputError(f"{option} {text}: give A:B for frames A to B - 1, or one frame")
    first = int(match[1] or 0)
    last = int(match[3] or count) if match[2] else first + 1
    chosen = range(first, last)
    if not chosen or chosen[-1] >= count:
        raise InputError(f"{option} {text}: the scene has frames 0 to {count - 1}")
    return chosen


def checked(make, **values):
    """What `make` makes of options; what it refuses is bad input."""
    try:
        return make(**values)
    except ValueError as error:
        raise InputError(str(error)) from error
