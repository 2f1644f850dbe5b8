"""`bkd-fpga verilog`."""

from pathlib import Path

from rich.console import Console

from fpga.verilog import export
from sim.command import Parser
from sim.configuration import config_argument, config_name, read_config
from sim.errors import InputError
from sim.files import check_writable, written_whole

EXAMPLE = "verilog -c full -o rtl/bkd_full.v"
SUFFIXES = (".v", ".vlt", ".core", ".md", ".h")


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    config_argument(parser)
    add("-o", metavar="FILE", dest="file", type=Path, help="Verilog file; bkd_CONFIG.v")


def run(options) -> int:
    """Write the machine as Verilog, with a FuseSoC core, lint waivers and the register map.

    Beside FILE, of the same name: .core, .vlt, and .md and .h of the registers.
    """
    config, name = read_config(options.config), config_name(options.config)
    file = options.file or Path(f"bkd_{name}.v")
    if file.suffix != ".v":
        raise InputError(f"{file}: name a file that ends in .v")
    if not config.cache_words:
        raise InputError(f"{name}: one bus to the memory needs caches, and it has none")
    check_writable(*(file.with_suffix(suffix) for suffix in SUFFIXES))
    with Console(stderr=True).status("writing Verilog"):
        texts = export(config, name, file.stem)
    for suffix, text in texts.items():
        with written_whole(file.with_suffix(suffix)) as temporary:
            temporary.write_text(text)
    lines = texts[".v"].count("\n")
    print(f"{file}: {lines:,} lines; beside it {', '.join(SUFFIXES[1:])}")
    return 0
