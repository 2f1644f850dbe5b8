"""KC705 with a Kintex-7 325T, built by Vivado."""

from amaranth import *
from amaranth.build import Attrs, Clock, DiffPairs, Resource

from fpga.boards.board import Board
from fpga.tools import version
from hdl.config import KC705 as CONFIG

CLOCK_MHZ = 62.5
"""Of the core: the PLL's 1,000 MHz by a whole number. Nobody has seen Vivado close it yet."""


def platform(_):
    """Part and package of amaranth-boards, and resources of UG810, which has more of them.

    amaranth-boards has no button, and one voltage for LEDs that lie in banks of two.
    """
    version("amaranth-boards")  # or says what to install
    from amaranth_boards.kc705 import KC705Platform
    from amaranth_boards.resources import ButtonResources, LEDResources, UARTResource

    low, high = Attrs(IOSTANDARD="LVCMOS15"), Attrs(IOSTANDARD="LVCMOS25")
    pair, oscillator = DiffPairs("AD12", "AD11", dir="i"), Clock(200e6)

    class Platform(KC705Platform):
        default_clk = "clk200"
        resources = [
            Resource("clk200", 0, pair, oscillator, Attrs(IOSTANDARD="LVDS")),
            *LEDResources(pins={0: "AB8", 1: "AA8", 2: "AC9", 3: "AB9"}, attrs=low),
            *LEDResources(pins={4: "AE26", 5: "G19", 6: "E18", 7: "F16"}, attrs=high),
            *ButtonResources(pins={0: "G12"}, attrs=high),
            UARTResource(0, rx="M19", tx="K24", attrs=high),
        ]

    return Platform()


def pll(m: Module, oscillator: Value, locked: Signal):
    """The clock of the domain `sync` from the board's 200 MHz."""
    feedback, slow = Signal(), Signal()
    m.submodules.pll = Instance(
        "PLLE2_BASE",
        p_CLKIN1_PERIOD=5.0,
        p_CLKFBOUT_MULT=5,
        p_CLKOUT0_DIVIDE=round(1000 / CLOCK_MHZ),
        i_CLKIN1=oscillator,
        i_CLKFBIN=feedback,
        o_CLKFBOUT=feedback,
        o_CLKOUT0=slow,
        o_LOCKED=locked,
        i_RST=C(0, 1),
        i_PWRDWN=C(0, 1),
    )
    m.submodules.global_clock = Instance("BUFG", i_I=slow, o_O=ClockSignal())


KC705 = Board(
    name="kc705",
    config=CONFIG,
    platform=platform,
    clock_hz=CLOCK_MHZ * 1e6,
    pll=pll,
    baud=921_600,  # the most that its USB chip, a CP2103, takes
    loader=("-b", "kc705"),
    tools="Vivado",
    pins="UG810, KC705 Evaluation Board User Guide",
    overrides={
        "add_constraints": "set_property CFGBVS VCCO [current_design]\n"
        "set_property CONFIG_VOLTAGE 2.5 [current_design]"
    },
)
