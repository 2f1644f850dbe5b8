"""The board's end of a serial link: bytes to memory and registers, and back."""

from amaranth import *
from amaranth.lib import stream, wiring
from amaranth.lib.wiring import In, Out
from amaranth.utils import exact_log2

from hdl import registers
from hdl.bus.signals import Registers, RegistersInterface
from hdl.config import Config
from hdl.link.cobs import Decoder, Encoder
from hdl.link.executor import Executor
from hdl.link.inbox import Inbox
from hdl.link.protocol import BODY_BYTES, CRC_BYTES, HEADER_BYTES
from hdl.memory.port import Port, PortInterface

REGISTERS = registers.SPAN // registers.BYTES
LARGEST_FRAME = HEADER_BYTES + BODY_BYTES + CRC_BYTES


class Link(wiring.Component):
    """Executes the commands of hdl.link.protocol, and answers them; bytes as on the line.

    ::

        i ─► decoder ─► inbox ─► executor ─► encoder ─► o
                                  │    │
                               port    registers

    Takes a byte a cycle at any time; a frame for which there is no room is lost, which the host is
    told. A command waits until the answer before it has gone to the encoder, which holds 512 bytes.
    A READ gathers its answer before it gives it, so that an error of the memory is known by then.

    Parameters
    ----------
    config : Config
    words : int
        Of memory, from address 0 on.
    ring : int
        Bytes of frames that wait: a power of two, at least 2048.

    Members
    -------
    i : In(stream of bytes), taken at once
    o : Out(stream of bytes)
    port : Out(Port)
    registers : Out(Registers)
    failed : In(1), for a cycle: the memory answered with an error. A READ or WRITE that is under
        way is refused
    unsettled : In(1), writes that the port took two cycles ago or before have not taken effect:
        a WRITE is not answered
    damaged : Out(1), for a cycle at each frame that is dropped, since it is none
    lost : Out(1), for a cycle at each frame that is dropped, since there is no room
    executed : Out(1), for a cycle at each command that was, without a fault
    """

    i: stream.Interface
    o: stream.Interface
    port: PortInterface
    registers: RegistersInterface
    failed: Signal
    unsettled: Signal
    damaged: Signal
    lost: Signal
    executed: Signal

    def __init__(self, config: Config, words: int, ring: int = 4096):
        if not 1 <= words <= 1 << config.address_bits:
            raise ValueError(
                f"1 to {1 << config.address_bits} words have an address, and these are {words}"
            )
        if ring < LARGEST_FRAME or ring & (ring - 1):
            raise ValueError(f"a ring is a power of two of at least 2048 bytes, not {ring}")
        self.config = config
        self.words = words
        self.ring = ring
        super().__init__({
            "i": In(stream.Signature(8, always_ready=True)),
            "o": Out(stream.Signature(8)),
            "port": Out(Port(config)),
            "registers": Out(Registers(exact_log2(REGISTERS))),
            **dict.fromkeys(("failed", "unsettled"), In(1)),
            **dict.fromkeys(("damaged", "lost", "executed"), Out(1)),
        })

    def elaborate(self, platform):
        m = Module()

        m.submodules.decoder = decoder = Decoder()
        m.submodules.inbox = inbox = Inbox(self.ring)
        m.submodules.executor = executor = Executor(
            self.config, words=self.words, registers=REGISTERS
        )
        m.submodules.encoder = encoder = Encoder()
        wiring.connect(m, wiring.flipped(self.i), decoder.i)
        wiring.connect(m, decoder.o, inbox.i)
        wiring.connect(m, inbox.o, executor.i)
        wiring.connect(m, executor.o, encoder.i)
        wiring.connect(m, encoder.o, wiring.flipped(self.o))
        wiring.connect(m, executor.port, wiring.flipped(self.port))
        wiring.connect(m, executor.registers, wiring.flipped(self.registers))
        m.d.comb += [
            inbox.ends.eq(decoder.ends),
            inbox.good.eq(decoder.good),
            executor.waits.eq(inbox.waits),
            executor.dropped.eq(inbox.damaged | inbox.lost),
            executor.failed.eq(self.failed),
            executor.unsettled.eq(self.unsettled),
            self.damaged.eq(inbox.damaged),
            self.lost.eq(inbox.lost),
            self.executed.eq(executor.executed),
        ]
        return m
