"""ULX3S with an ECP5-85F, built by the open tools of PyPI."""

from amaranth import *

from fpga.boards.board import Board
from fpga.tools import version
from hdl.config import ULX3S as CONFIG

OSCILLATOR_MHZ = 25
CLOCK_MHZ = 50
"""Of the core, which closes at it: a multiple of 12.5, so that the PLL's loop runs at no less."""
VCO_MHZ = 600
"""About what the PLL's oscillator runs at: 400 to 800."""


def platform(_):
    """That of amaranth-boards: its pins are those of the board's public constraint files."""
    version("amaranth-boards")  # or says what to install
    from amaranth_boards.ulx3s import ULX3S_85F_Platform

    return ULX3S_85F_Platform()


def pll(m: Module, oscillator: Value, locked: Signal):
    """The clock of the domain `sync` from the oscillator's."""
    divide = 1 if CLOCK_MHZ % OSCILLATOR_MHZ == 0 else 2
    multiply = round(divide * CLOCK_MHZ / OSCILLATOR_MHZ)
    output = round(VCO_MHZ / CLOCK_MHZ)
    m.submodules.pll = Instance(
        "EHXPLLL",
        a_FREQUENCY_PIN_CLKI=str(OSCILLATOR_MHZ),
        a_FREQUENCY_PIN_CLKOP=str(CLOCK_MHZ),
        a_ICP_CURRENT="12",
        a_LPF_RESISTOR="8",
        p_CLKI_DIV=divide,
        p_CLKFB_DIV=multiply,
        p_CLKOP_DIV=output,
        p_CLKOP_CPHASE=output // 2,
        p_CLKOP_FPHASE=0,
        p_CLKOP_ENABLE="ENABLED",
        p_FEEDBK_PATH="CLKOP",
        i_CLKI=oscillator,
        i_CLKFB=ClockSignal(),
        o_CLKOP=ClockSignal(),
        o_LOCK=locked,
        **{f"i_{name}": C(0, 1) for name in ("RST", "STDBY", "PLLWAKESYNC", "ENCLKOP")},
        **{f"i_PHASE{name}": C(0, 1) for name in ("SEL0", "SEL1", "DIR", "STEP", "LOADREG")},
    )


ULX3S = Board(
    name="ulx3s",
    config=CONFIG,
    platform=platform,
    clock_hz=CLOCK_MHZ * 1e6,
    pll=pll,
    baud=3_000_000,  # the most that its USB chip, an FT231X, takes
    loader=("-b", "ulx3s"),
    tools="Yosys and nextpnr",
    pins="amaranth-boards, which has them from the board's public constraints",
)
