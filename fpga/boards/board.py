"""What is known of a board, and the top level that is built for it."""

from collections.abc import Callable
from dataclasses import dataclass, field

from amaranth import *
from amaranth.build.plat import TemplatedPlatform
from amaranth.lib import io
from amaranth.lib.cdc import FFSynchronizer, ResetSynchronizer

from hdl import board as design
from hdl.config import Config

LEDS = 8


@dataclass(frozen=True)
class Board:
    """A board that a machine is built for.

    Attributes
    ----------
    name : str
    config : Config
    platform : callable
        Makes the platform of Amaranth: it has `led` 0 to 7, `button` 0, and `uart` 0 with `rx` and
        `tx`. It is given the pins of a file that a user wrote, which most need none of.
    clock_hz : float
        Of the core.
    pll : callable, optional
        Makes that clock of the oscillator's, and the signal that it has locked; none where the
        platform's own is that of the core.
    baud : int
    loader : tuple of str
        Arguments of openFPGALoader; empty where it does not know the board.
    tools : str
        Who builds.
    pins : str
        Where the pins come from.
    needs : tuple of str
        Pins that a user has to name.
    overrides : dict
        Of Amaranth's build templates.
    """

    name: str
    config: Config
    platform: Callable[[dict], TemplatedPlatform]
    clock_hz: float
    pll: Callable[[Module, Value, Signal], None] | None
    baud: int
    loader: tuple[str, ...]
    tools: str
    pins: str
    needs: tuple[str, ...] = ()
    overrides: dict[str, str] = field(default_factory=dict)

    @property
    def words(self) -> int:
        """Memory words on the chip: all that the configuration addresses."""
        return 1 << self.config.address_bits

    def clock(self, m: Module, platform, pressed: Value):
        """Make the domain `sync`, in reset until its clock runs, and while a button is pressed.

        The platform makes its own domain, which has no reset.
        """
        if not self.pll:
            return
        oscillator = platform.request(platform.default_clk, dir="-")
        m.submodules.clock_pin = pin = io.Buffer(io.Direction.Input, oscillator)
        m.domains.sync = ClockDomain("sync")
        locked = Signal()
        self.pll(m, pin.i, locked)
        m.submodules.reset = ResetSynchronizer(~locked | pressed)


class Top(Elaboratable):
    """A board's design and its pins.

    The button resets all but the memory. LEDs: 0, a run is under way; 1 to 7, commands executed.
    """

    def __init__(self, board: Board):
        self.board = board

    def elaborate(self, platform):
        m = Module()
        board = self.board
        m.submodules.button = button = io.Buffer(
            io.Direction.Input, platform.request("button", dir="-")
        )
        board.clock(m, platform, button.i)
        inner = design.Board(
            board.config, words=board.words, clock_hz=board.clock_hz, baud=board.baud
        )
        if board.pll:
            m.submodules.design = inner
        else:
            pressed = Signal()
            m.submodules.pressed = FFSynchronizer(button.i, pressed)
            m.submodules.design = ResetInserter(pressed)(inner)
        uart = platform.request("uart", dir="-")
        m.submodules.rx = rx = io.Buffer(io.Direction.Input, uart.rx)
        m.submodules.tx = tx = io.Buffer(io.Direction.Output, uart.tx)
        m.d.comb += [inner.rx.eq(rx.i), tx.o.eq(inner.tx)]
        shown = Cat(inner.busy, inner.executed)[:LEDS]
        for number, bit in enumerate(shown):
            led = io.Buffer(io.Direction.Output, platform.request("led", number, dir="-"))
            m.submodules[f"led_{number}"] = led
            m.d.comb += led.o.eq(bit)
        return m
