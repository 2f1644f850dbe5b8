"""Executes commands, and answers them."""

from amaranth import *
from amaranth.lib import enum, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.bus.signals import Registers, RegistersInterface
from hdl.config import Config
from hdl.link.cobs import PART
from hdl.link.operation import NO_REASON, Operation
from hdl.link.outbox import Outbox
from hdl.link.protocol import (
    BODY_BYTES,
    HEADER,
    HEADER_BYTES,
    HELLO_ANSWER,
    MAGIC,
    VERSION,
    Kind,
    Reason,
)
from hdl.link.session import Session
from hdl.memory.port import Port, PortInterface

GREETING = HELLO_ANSWER.const({"magic": MAGIC, "version": VERSION, "body_bytes": BODY_BYTES})
GREETING_BYTES = HELLO_ANSWER.size // 8


class Step(enum.Enum, shape=3):
    """Of a command. Each goes on to the next one, if it does not say otherwise."""

    HEADER = 0  # take it
    COMPARE = 1  # session and number with those of the board
    DECIDE = 2
    BODY = 3  # do what it says
    CONCLUDE = 4
    BYTES = 5  # of an answer to a HELLO, or of a refusal
    ANSWER = 6


class Executor(wiring.Component):
    """Executes one command after the other, as hdl.link.protocol says, and answers each.

    A frame that is to come again is asked for when no other waits, once for all of them.

    Parameters
    ----------
    config : Config
    words : int
        Of memory.
    registers : int
        A power of two.

    Members
    -------
    i : In(stream of bytes), header and body of frames
    waits : In(1), bytes of a frame do, at `i` or before it
    dropped : In(1), for a cycle: a frame was, and is to come again
    o : Out(stream of PART), frames with their CRC
    port : Out(Port)
    registers : Out(Registers)
    failed : In(1), for a cycle: the memory answered with an error
    unsettled : In(1), writes that the port took two cycles ago or before have not taken effect
    executed : Out(1), for a cycle at each command that was, without a fault
    """

    i: stream.Interface
    waits: Signal
    dropped: Signal
    o: stream.Interface
    port: PortInterface
    registers: RegistersInterface
    failed: Signal
    unsettled: Signal
    executed: Signal

    def __init__(self, config: Config, *, words: int, registers: int):
        self.config = config
        self.words = words
        self.count = registers
        super().__init__({
            "i": In(stream.Signature(8)),
            "waits": In(1),
            "dropped": In(1),
            "o": Out(stream.Signature(PART)),
            "port": Out(Port(config)),
            "registers": Out(Registers(exact_log2(registers))),
            "failed": In(1),
            "unsettled": In(1),
            "executed": Out(1),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.session = session = Session()
        m.submodules.outbox = outbox = Outbox()
        m.submodules.operation = operation = Operation(
            self.config, words=self.words, registers=self.count
        )
        wiring.connect(m, outbox.o, wiring.flipped(self.o))
        wiring.connect(m, operation.port, wiring.flipped(self.port))
        wiring.connect(m, operation.registers, wiring.flipped(self.registers))

        step = Signal(Step)
        command = Signal(HEADER, reset_less=True)  # bytes come in at the top
        count = Signal(3)  # of its bytes, or those of a greeting
        kind = Signal(8, reset_less=True)  # of the answer
        asks = Signal()  # for frames that did not come
        silent = Signal()  # there is no answer to this command
        reason = Signal(8, reset_less=True)  # why it is refused, before its body is looked at
        hello = Signal()
        alters = Signal()  # memory or registers
        does = Signal()  # it is executed
        is_header = step == Step.HEADER
        m.d.comb += [
            session.session.eq(command.session),
            session.sequence.eq(command.sequence),
            hello.eq(command.kind == Kind.HELLO),
            alters.eq((command.kind == Kind.WRITE) | (command.kind == Kind.POKE)),
            does.eq(hello | (session.own & (session.next | (session.before & ~alters)))),
            operation.executes.eq(does),
            operation.kind.eq(command.kind),
            operation.length.eq(command.length),
            operation.i.payload.eq(self.i.payload),
            operation.i.valid.eq(self.i.valid & ~is_header),
            operation.full.eq(outbox.full),
            operation.failed.eq(self.failed),
            operation.unsettled.eq(self.unsettled),
            self.i.ready.eq(is_header | operation.i.ready),
        ]
        own, why = session.own | hello, reason | operation.reason  # one of these is 0
        refused = kind == Kind.REFUSED
        repeat = kind == Kind.REPEAT
        m.d.comb += [
            outbox.i_bytes.valid.eq(operation.o.valid),
            outbox.i_bytes.payload.eq(operation.o.payload),
            outbox.i.p.kind.eq(kind),
            outbox.i.p.session.eq(Mux(repeat, session.current, command.session)),
            outbox.i.p.sequence.eq(Mux(repeat, session.expected, command.sequence)),
        ]
        m.d.sync += self.executed.eq(0)
        with m.Switch(step):
            with m.Case(Step.HEADER):
                with m.If(self.i.valid):
                    m.d.sync += [
                        Value.cast(command).eq(Cat(Value.cast(command)[8:], self.i.payload)),
                        count.eq(count + 1),
                    ]
                    with m.If(count == HEADER_BYTES - 1):
                        m.d.sync += step.eq(Step.COMPARE)
                with m.Elif(asks & ~self.waits):
                    m.d.sync += [asks.eq(0), kind.eq(Kind.REPEAT)]
                    with m.If(session.is_open):
                        m.d.sync += step.eq(Step.ANSWER)
            with m.Case(Step.COMPARE):
                m.d.sync += [count.eq(0), step.eq(Step.DECIDE)]
            with m.Case(Step.DECIDE):
                m.d.comb += operation.starts.eq(1)
                m.d.sync += [
                    silent.eq(own & ~does & ~session.before),
                    reason.eq(Mux(own, NO_REASON, Reason.SESSION)),
                    step.eq(Step.BODY),
                ]
                with m.If(own & ~does & ~session.before):
                    m.d.sync += asks.eq(1)
            with m.Case(Step.BODY):
                with m.If(~operation.busy):
                    m.d.sync += step.eq(Mux(silent, Step.HEADER, Step.CONCLUDE))
            with m.Case(Step.CONCLUDE):
                m.d.comb += outbox.clear.eq(why != NO_REASON)
                with m.If(why != NO_REASON):
                    m.d.sync += [kind.eq(Kind.REFUSED), step.eq(Step.BYTES)]
                with m.Else():
                    m.d.comb += [
                        session.opens.eq(hello & ~session.own & (operation.version == VERSION)),
                        session.advances.eq(~hello & session.next),
                    ]
                    m.d.sync += [
                        kind.eq(Kind.OK),
                        self.executed.eq(does),
                        step.eq(Mux(hello, Step.BYTES, Step.ANSWER)),
                    ]
            with m.Case(Step.BYTES):
                m.d.comb += [
                    outbox.i_bytes.valid.eq(1),
                    outbox.i_bytes.payload.eq(
                        Mux(refused, why, GREETING.as_value().word_select(count, 8))
                    ),
                ]
                m.d.sync += count.eq(count + 1)
                with m.If(refused | (count == GREETING_BYTES - 1)):
                    m.d.sync += [count.eq(0), step.eq(Step.ANSWER)]
            with m.Case(Step.ANSWER):
                m.d.comb += outbox.i.valid.eq(1)
                with m.If(outbox.i.ready):
                    m.d.sync += step.eq(Step.HEADER)
        with m.If(self.dropped):
            m.d.sync += asks.eq(1)
        return m
