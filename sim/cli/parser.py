"""Options that several commands of `bkd-sim` share, and what they mean."""

from dataclasses import replace

from hdl.config import FULL, Config
from sim.command import Parser, checked, format_of
from sim.compiler.rays import check_rays
from sim.cosim.machine import Timing
from sim.errors import InputError

BANK_LATENCY = 2
"""Cycles of a bank on the chip: one for the address, one for the word."""


def format_argument(parser: Parser):
    """The floats of the machine."""
    parser.add_argument(
        "--format", metavar="E,M", default="7,16", help="bits of a float; %(default)s"
    )


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
    config = config_of(
        fmt,
        latency=ray_timing_of(options).latency,
        cache_words=0 if banks else options.cache,
        stack_depth=options.stack,
    )
    check_rays(config.fmt)
    return config


def config_of(fmt: str, **changes) -> Config:
    """The full machine, with another format and other parameters."""
    return checked(lambda **new: replace(FULL, **new), fmt=format_of(fmt), **changes)
