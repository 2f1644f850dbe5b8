"""What lies beside the Verilog: a FuseSoC core, lint waivers, and the register map."""

from amaranth.lib import data

from hdl.config import Config
from hdl.registers import Access, Outcome, Register, registers

WAIVERS = {
    "DECLFILENAME": "one file holds all modules",
    "INITIALDLY": "time_zero changes after all processes wait, so that each runs once at time 0",
    "PROCASSINIT": "registers have their reset values from power-on too, as FPGAs give them",
    "CASEINCOMPLETE": "what no case lists keeps the value assigned before it",
    "UNUSEDSIGNAL": "records are passed whole, to those too who want a part",
    "VARHIDDEN": "an instance may be called as a signal inside it",
    "WIDTHEXPAND": {
        f"*Operator {name} expects*": "operands are as wide as they are, and Verilog extends them"
        for name in (
            "ADD", "SUB", "MUL", "EQ", "NEQ", "LT", "LTE", "GT", "GTE", "LTS", "LTES", "GTS",
            "GTES", "SHIFTL", "AND", "OR", "XOR", "COND",
        )
    },
    "WIDTHTRUNC": {"*SHIFTR generates*": "a shift chooses one of several records"},
}  # fmt: skip
"""Of Verilator's lint, each with its reason; some for messages of one kind only."""


def waivers() -> str:
    """Verilator's configuration file."""
    lines = ["`verilator_config"]
    for rule, why in WAIVERS.items():
        for match, reason in (why if isinstance(why, dict) else {"": why}).items():
            only = f' -file "*" -match "{match}"' if match else ""
            lines += [f"// {reason}", f"lint_off -rule {rule}{only}"]
    return "\n".join(lines) + "\n"


def fusesoc(top: str, stem: str, version: str) -> str:
    """FuseSoC core description (CAPI2)."""
    return f"""\
CAPI=2:
name: "::{top}:{version}"
description: "B-KD tree ray tracing machine: AXI4 memory, AXI4-Lite registers"

filesets:
  rtl:
    files:
      - {stem}.v: {{file_type: verilogSource-2005}}
      - {stem}.h: {{file_type: user}}
  waivers:
    files:
      - {stem}.vlt: {{file_type: vlt}}

targets:
  default: &default
    filesets: [rtl]
    toplevel: {top}
  lint:
    <<: *default
    filesets: [waivers, rtl]
    default_tool: verilator
    tools:
      verilator:
        mode: lint-only
        verilator_options: [-Wall]
"""


def markdown(config: Config, top: str) -> str:
    """The register map for people."""
    access = {Access.READ: "R", Access.WRITE: "RW", Access.SPECIAL: "by field"}
    lines = [
        f"# Registers of {top}",
        "",
        "32 bits each, at byte offsets. Bits above the width read as 0. A write of less than four "
        "bytes and an access where there is no register are answered with SLVERR. Addresses count "
        "memory words, floats are bit patterns.",
        "",
        "| offset | register | access | bits | value | |",
        "|---|---|---|---|---|---|",
    ]
    for r in registers(config):
        value = f"0x{r.value:X}" if r.value else "0"
        row = f"0x{r.offset:03X}", f"`{r.name}`", access[r.access], str(r.width), value, r.doc
        lines.append(f"| {' | '.join(row)} |")
    for register in registers(config):
        if register.fields:
            lines += ["", f"## {register.name}", "", "| bits | field | |", "|---|---|---|"]
            lines += _field_rows(register)
    return "\n".join(lines) + "\n"


FIELD_DOCS = {
    "start": "1 starts a run of the job, and clears done; nothing while busy. Reads as 0",
    "stop": "1 ends the run with what is under way; nothing while not busy. Reads as 0",
    "interrupt": "the line irq is that of done",
    "busy": "a run is under way",
    "done": "a run has ended; a 1 that is written clears it",
    "outcome": "of the last run: "
    + ", ".join(f"{o.value} {o.name.lower().replace('_', ' ')}" for o in Outcome),
}


def _field_rows(register: Register) -> list[str]:
    return [
        f"| {_bits(field)} | {name} | {FIELD_DOCS[str(name)]} |"
        for name, field in register.fields or ()
    ]


def _bits(field: data.Field) -> str:
    top = field.offset + field.width - 1
    return str(top) if field.width == 1 else f"{top}:{field.offset}"


def header(config: Config, top: str) -> str:
    """The register map for C."""
    guard = f"{top.upper()}_H"
    lines = [
        f"/* Registers of {top}: byte offsets, masks of their fields, and constants. */",
        f"#ifndef {guard}",
        f"#define {guard}",
        "",
    ]
    lines += [f"#define BKD_{r.name:<40} 0x{r.offset:03X}u" for r in registers(config)]
    for register in registers(config):
        if register.fields:
            lines.append("")
            for name, field in register.fields:
                mask = ((1 << field.width) - 1) << field.offset
                label = f"{register.name}_{name}".upper()
                lines.append(f"#define BKD_{label:<40} 0x{mask:X}u")
    lines += ["", "/* STATUS_OUTCOME, shifted to its place. */"]
    shift = next(f.offset for r in registers(config) if r.fields for n, f in r.fields
                 if n == "outcome")  # fmt: skip
    lines += [f"#define BKD_OUTCOME_{o.name:<32} 0x{o.value << shift:X}u" for o in Outcome]
    lines += ["", "/* What was built, as the registers of these names read. */"]
    lines += [
        f"#define BKD_VALUE_{r.name:<34} 0x{r.value:X}u" for r in registers(config) if r.value
    ]
    lines += ["", f"#endif /* {guard} */"]
    return "\n".join(lines) + "\n"
