"""Boards that send back what they get, in place of the real one."""

from amaranth import Module, Signal
from amaranth.lib import fifo, stream, wiring
from amaranth.lib.wiring import In, Out

from hdl.link.uart import Receiver, Transmitter


class Echo(wiring.Component):
    """Sends back each byte, `work` cycles after it came and no sooner; busy until then.

    Members
    -------
    i, o : streams of bytes
    busy : Out(1)
    """

    i: stream.Interface
    o: stream.Interface
    busy: Signal

    def __init__(self, *, work: int = 0):
        self.work = work
        super().__init__({
            "i": In(stream.Signature(8)),
            "o": Out(stream.Signature(8)),
            "busy": Out(1),
        })

    def elaborate(self, platform):
        m = Module()
        m.submodules.held = held = fifo.SyncFIFOBuffered(width=8, depth=64)
        wiring.connect(m, wiring.flipped(self.i), held.w_stream)
        left = Signal(range(self.work + 1))
        with m.If(self.i.valid & self.i.ready):
            m.d.sync += left.eq(self.work)
        with m.Elif(left != 0):
            m.d.sync += left.eq(left - 1)
        m.d.comb += [
            self.busy.eq(left != 0),
            self.o.payload.eq(held.r_data),
            self.o.valid.eq(held.r_rdy & ~self.busy),
            held.r_en.eq(self.o.ready & ~self.busy),
        ]
        return m


class EchoBoard(wiring.Component):
    """An echo behind the UART of our boards.

    Members
    -------
    rx : In(1)
    tx, busy : Out(1)
    """

    rx: Signal
    tx: Signal
    busy: Signal

    def __init__(self, *, clock_hz: float, baud: float):
        self.receiver = Receiver(clock_hz=clock_hz, baud=baud)
        self.transmitter = Transmitter(clock_hz=clock_hz, baud=baud)
        super().__init__({"rx": In(1, init=1), "tx": Out(1), "busy": Out(1)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.echo = echo = Echo()
        m.submodules.receiver = receiver = self.receiver
        m.submodules.transmitter = transmitter = self.transmitter
        m.d.comb += [
            receiver.rx.eq(self.rx),
            echo.i.payload.eq(receiver.o.payload),
            echo.i.valid.eq(receiver.o.valid),
            self.tx.eq(transmitter.tx),
            self.busy.eq(echo.busy),
        ]
        wiring.connect(m, echo.o, transmitter.i)
        return m
