"""Stands in for the memory behind a port of a unit under cocotb."""

import random
from collections import deque
from dataclasses import dataclass

from cocotb.triggers import RisingEdge

from hdl.config import Config
from hdl.memory.port import request
from tests.payloads import unpack
from tests.streams import now


@dataclass(frozen=True)
class Request:
    """A request that a memory took, and when."""

    cycle: int
    address: int
    write: int
    mask: int
    data: int


class Memory:
    """Stands in for the memory at a port, and checks the port's rules.

    Parameters
    ----------
    dut
    port : str
    config : Config
    words : dict of address to word
        Changes with each write; a read of a word that is not there fails.
    latency : int
        Cycles from request to response, at least 1.
    busy : float
        Chance that a cycle takes no request or begins no response. A busy memory is ready only
        after it has seen valid.
    period : int
        Requests are taken in one of so many cycles only.

    Attributes
    ----------
    requests : list of Request
    responses : list of cycles
    most_under_way : int
        Reads that waited for their response together.
    """

    def __init__(
        self, dut, port: str, config: Config, words: dict[int, int],
        *, latency: int = 1, busy: float = 0.0, period: int = 1,
    ):  # fmt: skip
        self.dut, self.port, self.words = dut, port, words
        self.latency, self.busy, self.period = latency, busy, period
        self.layout = request(config)
        self.requests: list[Request] = []
        self.responses: list[int] = []
        self.most_under_way = 0

    async def run(self):
        """Serve without end."""
        dut, port, layout = self.dut, self.port, self.layout
        valid, payload, ready = (
            getattr(dut, f"{port}__request__{name}") for name in ("valid", "payload", "ready")
        )
        # An output that is constant or an input that nobody reads may not be in the Verilog.
        answer_valid, answer = (
            getattr(dut, f"{port}__response__{name}", None) for name in ("valid", "payload")
        )
        due: deque[tuple[int, int]] = deque()
        waiting = None
        willing = not self.busy
        while True:
            ready.value = willing = willing and now() % self.period == 0
            answering = bool(due) and due[0][0] <= now() and random.random() >= self.busy
            if answer_valid is not None:
                answer_valid.value = answering
            if answering:
                answer.value = due.popleft()[1]
            await RisingEdge(dut.clk)
            if answering:
                self.responses.append(now())
            if not valid.value:
                assert waiting is None, f"{port}: a request was withdrawn"
                willing = not self.busy
                continue
            bits = payload.value.to_unsigned()
            assert waiting in (None, bits), f"{port}: request {waiting:x} became {bits:x}"
            waiting = None if willing else bits
            if willing:
                taken = Request(now(), **unpack(layout, bits))
                self.requests.append(taken)
                if taken.write:
                    self.words[taken.address] = written(self.words.get(taken.address, 0), taken)
                else:
                    assert taken.address in self.words, f"{port}: read of word {taken.address}"
                    due.append((now() + self.latency - 1, self.words[taken.address]))
                    self.most_under_way = max(self.most_under_way, len(due))
            willing = random.random() >= self.busy


def written(word: int, request) -> int:
    """A word after a write of the bytes of a request's mask."""
    bits = sum(0xFF << 8 * k for k in range(request.mask.bit_length()) if request.mask >> k & 1)
    return word & ~bits | request.data & bits
