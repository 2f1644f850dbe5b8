"""Alpha Data's ADM-XRC-4LX with a Virtex-4 LX160, built by ISE."""

from amaranth.build import Attrs, Clock, Pins, Resource, Subsignal
from amaranth.vendor import XilinxPlatform

from fpga.boards.board import LEDS, Board
from fpga.boards.pins import FILL_IN
from hdl.config import ADM_XRC_4LX as CONFIG

CLOCK_MHZ = 66
"""Of the local bus, which the core runs on, and what the 2006 machine ran at."""

PINS = ("clk", "button", "rx", "tx", *(f"led{number}" for number in range(LEDS)))
"""What a user fills in."""


class Platform(XilinxPlatform):
    """The device, and pins from a user's file: those that are missing are called FILL_IN_...

    Alpha Data gives its constraint files to owners of the board. Public are the names in its SDK's
    examples (`lclk` is the clock of the local bus) and, in Xilinx's DS112, that an XC4VLX160 comes
    in FF1148 and in FF1513. Which of them a board has, and of which speed, is in the file too.
    """

    device = "xc4vlx160"
    package = "ff1148"
    speed = "10"
    default_clk = "lclk"
    connectors = []
    resources = []

    def __init__(self, pins: dict[str, str]):
        at = {name: pins.get(name, f"{FILL_IN}_{name}") for name in PINS}
        attrs = Attrs(IOSTANDARD=pins.get("iostandard", "LVCMOS33"))
        self.package = pins.get("package", self.package)
        self.speed = pins.get("speed", self.speed)
        self.resources = [
            Resource("lclk", 0, Pins(at["clk"], dir="i"), Clock(CLOCK_MHZ * 1e6), attrs),
            Resource("button", 0, Pins(at["button"], dir="i"), attrs),
            Resource(
                "uart",
                0,
                Subsignal("rx", Pins(at["rx"], dir="i")),
                Subsignal("tx", Pins(at["tx"], dir="o")),
                attrs,
            ),
            *(
                Resource("led", number, Pins(at[f"led{number}"], dir="o"), attrs)
                for number in range(LEDS)
            ),
        ]
        super().__init__(toolchain="ISE")


ADM_XRC_4LX = Board(
    name="adm-xrc-4lx",
    config=CONFIG,
    platform=Platform,
    clock_hz=CLOCK_MHZ * 1e6,
    pll=None,  # the platform's own: local bus clock, gated until configured
    baud=115_200,
    loader=(),
    tools="ISE",
    pins="no public document that we know: a file of yours",
    needs=PINS,
)
