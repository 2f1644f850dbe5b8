"""`bkd-fpga verilog`."""

from pathlib import Path

from rich.console import Console

from fpga.verilog import export
from hdl.config import CONFIGS
from sim.command import Parser
from sim.errors import InputError
from sim.files import check_writable, written_whole

EXAMPLE = "verilog -c full -o rtl/bkd_full.v"
SUFFIXES = (".v", ".vlt", ".core", ".md", ".h")


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    add("-c", "--config", choices=CONFIGS, default="full", help="%(choices)s; %(default)s")
    add("-o", metavar="FILE", dest="file", type=Path, help="Verilog file; bkd_CONFIG.v")


def run(options) -> int:
    """Write the machine as Verilog, with a FuseSoC core, lint waivers and the register map.

    Beside FILE, of the same name: .core, .vlt, and .md and .h of the registers.
    """
    file = options.file or Path(f"bkd_{options.config}.v")
    if file.suffix != ".v":
        raise InputError(f"{file}: name a file that ends in .v")
    config = CONFIGS[options.config]
    if not config.cache_words:
        raise InputError(f"{options.config}: one bus to the memory needs caches, and it has none")
    check_writable(*(file.with_suffix(suffix) for suffix in SUFFIXES))
    with Console(stderr=True).status("writing Verilog"):
        texts = export(config, options.config, file.stem)
    for suffix, text in texts.items():
        with written_whole(file.with_suffix(suffix)) as temporary:
            temporary.write_text(text)
    lines = texts[".v"].count("\n")
    print(f"{file}: {lines:,} lines; beside it {', '.join(SUFFIXES[1:])}")
    return 0
