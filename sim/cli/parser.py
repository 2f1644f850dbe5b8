"""Options that several commands of `bkd-sim` share, and what they mean."""

from dataclasses import replace

from hdl.config import FULL, Config
from sim.command import Parser, checked, format_of
from sim.compiler.rays import check_ray_format
from sim.configuration import config_argument, read_config
from sim.cosim.machine import Timing
from sim.errors import InputError

BANK_LATENCY = 2
"""Cycles of a bank on the chip: one for the address, one for the word."""


def format_argument(parser: Parser):
    """The floats of the machine."""
    parser.add_argument(
        "--format", metavar="E,M", default="7,16", help="bits of a float; %(default)s"
    )


def machine_arguments(parser: Parser):
    """The machine, and its floats if they are others."""
    config_argument(parser)
    text = "bits of a float, in place of those of CONFIG; full: 7,16"
    parser.add_argument("--format", metavar="E,M", help=text)


def timing_arguments(parser: Parser):
    """How the memory behaves."""
    add = parser.add_argument
    text = "of memory, in cycles; those that CONFIG hides, full: 32"
    add("--latency", metavar="N", type=int, help=text)
    add("--stalls", metavar="P", type=float, default=0.0, help="share of cycles memory stalls; 0")
    add("--seed", metavar="N", type=int, default=1, help="of the stalls; %(default)s")


def memory_arguments(parser: Parser):
    """The memory of the ray path, and how large what hides it is, in place of CONFIG's."""
    add = parser.add_argument
    text = "behind caches, or in banks on the chip; full: dram"
    add("--memory", choices=("dram", "banks"), help=text)
    add("--cache", metavar="N", type=int, help="words of each of two; full: 2048")
    add("--stack", metavar="N", type=int, help="levels of the tree; full: 32")
    timing_arguments(parser)


def timing_of(options, config: Config) -> Timing:
    """The memory that options describe; a machine hides its latency."""
    return checked(Timing, latency=config.latency, stalls=options.stalls, seed=options.seed)


def config_of(options, **changes) -> Config:
    """The machine that options describe; `changes` that are None change nothing."""
    fmt = {"fmt": format_of(options.format)} if getattr(options, "format", None) else {}
    given = {name: value for name, value in changes.items() if value is not None}
    base = read_config(options.config or "full")
    return checked(lambda **new: replace(base, **new), **fmt, **given)


def ray_config_of(options) -> Config:
    """The machine that options describe, with its memory of the ray path."""
    config = _ray_config_of(options)
    check_ray_format(config.fmt)
    return config


def _ray_config_of(options) -> Config:
    words, cache = config_of(options).cache_words, options.cache
    if options.memory == "banks":
        if options.latency is not None:
            raise InputError(
                f"--latency {options.latency}: banks on the chip have {BANK_LATENCY} cycles; leave "
                f"it out"
            )
        return config_of(options, latency=BANK_LATENCY, cache_words=0, stack_depth=options.stack)
    if cache is not None and cache < 2:
        raise InputError(f"--cache {cache}: a cache has 2 words at least, or use banks")
    if cache is None and options.memory and not words:
        cache = FULL.cache_words
    return config_of(options, latency=options.latency, cache_words=cache, stack_depth=options.stack)
