"""Does what the body of a command says."""

from amaranth import *
from amaranth.lib import enum, stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl.bus.signals import LITE_BITS, Registers, RegistersInterface
from hdl.config import Config
from hdl.link.protocol import BODY_BYTES, HELLO, PEEK, POKE, READ, RUN, WRITE, Kind, Reason
from hdl.link.reach import SCOPE, Reach
from hdl.link.transfer import Transfer
from hdl.memory.port import Port, PortInterface
from hdl.records import word_bits

NO_REASON = 0
LONGEST_PART = READ


class Step(enum.Enum, shape=4):
    """Of a body. Each goes on to the next one, if it does not say otherwise."""

    WAIT = 0  # for a command
    LENGTH = 1
    PART = 2  # take some bytes, and go on to where is known
    LANES = 3  # of each word
    RUN = 4  # is there another one?
    REACH = 5  # does it exist?
    REACHED = 6
    ORDER = 7
    MOVE = 8  # the bytes
    DRAIN = 9  # what is left of the body
    SETTLE = 10  # what was written


class Operation(wiring.Component):
    """Executes the body of a command, and takes all of it in any case.

    The order of the checks: kind and length of the body; of each run that its RUN is whole, its
    range, and at each word that its bytes are there. What comes before a fault is written.
    An answer is too long when it is full. A WRITE ends when all that was written has taken effect.

    Parameters
    ----------
    config : Config
    words : int
        Of memory.
    registers : int
        A power of two.

    Members
    -------
    starts : In(1), with the first byte of the body to come at `i`
    executes : In(1), with `starts`: else the body is taken, and that is all
    kind : In(8), length : In(16), of the command; they stay as they are
    i : In(stream of bytes), the body
    o : Out(stream of bytes), that were read, taken at once
    full : In(1), no more of them are
    busy : Out(1), from the cycle after `starts` on
    reason : Out(Reason or 0), why it is refused; holds after `busy`
    version : Out(8), of a HELLO; holds after `busy`
    port : Out(Port)
    registers : Out(Registers)
    failed : In(1), for a cycle: the memory answered with an error
    unsettled : In(1), writes that the port took two cycles ago or before have not taken effect
    """

    starts: Signal
    executes: Signal
    kind: Signal
    length: Signal
    i: stream.Interface
    o: stream.Interface
    full: Signal
    busy: Signal
    reason: Signal
    version: Signal
    port: PortInterface
    registers: RegistersInterface
    failed: Signal
    unsettled: Signal

    def __init__(self, config: Config, *, words: int, registers: int):
        self.config = config
        self.words = words
        self.count = registers
        super().__init__({
            "starts": In(1),
            "executes": In(1),
            "kind": In(8),
            "length": In(16),
            "i": In(stream.Signature(8)),
            "o": Out(stream.Signature(8, always_ready=True)),
            "full": In(1),
            "busy": Out(1),
            "reason": Out(8),
            "version": Out(HELLO.size),
            "port": Out(Port(config)),
            "registers": Out(Registers(exact_log2(registers))),
            "failed": In(1),
            "unsettled": In(1),
        })

    def elaborate(self, platform):
        m = Module()

        bits = len(self.registers.address)
        lane_count = word_bits(self.config.fmt) // 8
        m.submodules.transfer = transfer = Transfer(self.config, register_bits=bits)
        m.submodules.reach = reach = Reach(
            words=self.words, word_bytes=lane_count, registers=self.count
        )
        wiring.connect(m, transfer.port, wiring.flipped(self.port))
        wiring.connect(m, transfer.registers, wiring.flipped(self.registers))
        wiring.connect(m, transfer.o_bytes, wiring.flipped(self.o))

        step = Signal(Step)
        after = Signal(Step, reset_less=True)  # a part
        wanted = Signal(range(LONGEST_PART.size // 8 + 1))  # bytes of the part
        left = Signal(16)  # bytes of the body
        any_left = Signal()
        last = Signal(LONGEST_PART.size, reset_less=True)  # bytes taken; the latest is the highest
        lanes = Signal(WRITE, reset_less=True)
        uses = Signal()  # memory
        faulty = Signal()  # which answered with an error meanwhile

        def taken(part):
            """A part of the body that was taken last."""
            return part(last[-part.size :])

        def take(part, then: Step):
            return [wanted.eq(part.size // 8), after.eq(then), step.eq(Step.PART)]

        def refuse(why: Reason):
            return [self.reason.eq(why), step.eq(Step.DRAIN)]

        byte = Signal()
        m.d.comb += [
            self.busy.eq(step != Step.WAIT),
            self.version.eq(taken(HELLO).version),
            any_left.eq(left != 0),
            transfer.i_bytes.valid.eq(self.i.valid & any_left),
            transfer.i_bytes.payload.eq(self.i.payload),
            self.i.ready.eq(
                any_left & ((step == Step.PART) | (step == Step.DRAIN) | transfer.i_bytes.ready)
            ),
            byte.eq(self.i.valid & self.i.ready),
        ]
        with m.If(byte):
            m.d.sync += [left.eq(left - 1), last.eq(Cat(last[8:], self.i.payload))]

        # What the part that was taken last is about. It stays until the order is given.
        scope = Signal(SCOPE)
        m.d.comb += [scope.first.eq(lanes.first), scope.bytes.eq(lanes.bytes)]
        with m.Switch(self.kind):
            with m.Case(Kind.READ):
                part = taken(READ)
                m.d.comb += [scope.address.eq(part.address), scope.count.eq(part.count)]
            with m.Case(Kind.WRITE):
                part = taken(RUN)
                m.d.comb += [scope.address.eq(part.address), scope.count.eq(part.count)]
            with m.Case(Kind.PEEK):
                part = taken(PEEK)
                m.d.comb += [scope.address.eq(part.register), scope.count.eq(part.count)]
                m.d.comb += scope.registers.eq(1)
            with m.Case(Kind.POKE):
                part = taken(POKE)
                m.d.comb += [scope.address.eq(part.register), scope.count.eq(left >> 2)]
                m.d.comb += scope.registers.eq(1)
        writes_words = self.kind == Kind.WRITE
        writes = writes_words | (self.kind == Kind.POKE)
        registers = scope.registers
        m.d.comb += [
            reach.i.eq(scope),
            transfer.i.p.address.eq(scope.address),
            transfer.i.p.count.eq(scope.count),
            transfer.i.p.first.eq(Mux(registers, 0, scope.first)),
            transfer.i.p.past.eq(Mux(registers, LITE_BITS // 8, scope.first + scope.bytes)),
            transfer.i.p.registers.eq(registers),
            transfer.i.p.write.eq(writes),
        ]

        with m.Switch(step):
            with m.Case(Step.WAIT):
                with m.If(self.starts):
                    m.d.sync += [
                        self.reason.eq(NO_REASON),
                        left.eq(self.length),
                        uses.eq(self.executes & ((self.kind == Kind.READ) | writes_words)),
                        faulty.eq(0),
                        step.eq(Mux(self.executes, Step.LENGTH, Step.DRAIN)),
                    ]
            with m.Case(Step.LENGTH):
                m.d.sync += refuse(Reason.LENGTH)
                fits = self.length <= BODY_BYTES
                with m.Switch(self.kind):
                    for kind, part, right, then in [
                        (Kind.HELLO, HELLO, self.length == HELLO.size // 8, Step.DRAIN),
                        (Kind.READ, READ, self.length == READ.size // 8, Step.LANES),
                        (Kind.WRITE, WRITE, fits & (self.length >= WRITE.size // 8), Step.LANES),
                        (Kind.PEEK, PEEK, self.length == PEEK.size // 8, Step.REACH),
                        (Kind.POKE, POKE, fits & (self.length[:2] == POKE.size // 8), Step.RUN),
                    ]:
                        with m.Case(kind):
                            with m.If(right):
                                m.d.sync += [self.reason.eq(NO_REASON), *take(part, then)]
                    with m.Default():
                        m.d.sync += self.reason.eq(Reason.KIND)
            with m.Case(Step.PART):
                with m.If(byte):
                    m.d.sync += wanted.eq(wanted - 1)
                    with m.If(wanted == 1):
                        m.d.sync += step.eq(after)
                with m.If(~any_left):
                    m.d.sync += refuse(Reason.LENGTH)
            with m.Case(Step.LANES):  # they come last in READ as well
                m.d.sync += [lanes.eq(taken(WRITE)), step.eq(Mux(writes, Step.RUN, Step.REACH))]
            with m.Case(Step.RUN):
                with m.If(~any_left):
                    m.d.sync += step.eq(Step.DRAIN)
                with m.Elif(registers):
                    m.d.sync += step.eq(Step.REACH)
                with m.Else():
                    m.d.sync += take(RUN, Step.REACH)
            with m.Case(Step.REACH):
                m.d.sync += step.eq(Step.REACHED)
            with m.Case(Step.REACHED):
                m.d.sync += step.eq(Step.ORDER)
            with m.Case(Step.ORDER):
                m.d.comb += transfer.i.valid.eq(reach.good)
                m.d.sync += step.eq(Step.MOVE)
                with m.If(~reach.good):
                    m.d.sync += refuse(Reason.RANGE)
            with m.Case(Step.MOVE):
                m.d.comb += transfer.stop.eq(
                    (transfer.i_bytes.ready & ~any_left) | (self.o.valid & self.full)
                )
                with m.If(transfer.i.ready):
                    m.d.sync += step.eq(Mux(writes, Step.RUN, Step.DRAIN))
                with m.If(transfer.stop):
                    m.d.sync += refuse(Reason.LENGTH)
            with m.Case(Step.DRAIN):
                with m.If(~any_left):
                    m.d.sync += step.eq(Step.SETTLE)
            with m.Case(Step.SETTLE):  # the last write was taken three cycles ago or before
                with m.If(~(uses & writes & self.unsettled)):
                    m.d.sync += step.eq(Step.WAIT)
                    with m.If((self.reason == NO_REASON) & (faulty | (uses & self.failed))):
                        m.d.sync += self.reason.eq(Reason.MEMORY)
        with m.If(uses & self.failed):
            m.d.sync += faulty.eq(1)
        return m
