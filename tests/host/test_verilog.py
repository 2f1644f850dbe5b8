"""A host and the Verilog of a board: all arrives once over any line, or ends in an error."""

from dataclasses import replace

import numpy as np
import pytest

from hdl.config import TINY, ULX3S
from hdl.rays.packet import NO_TRIANGLE
from host.link.channel import Channel
from host.link.errors import LinkError
from host.parts import parts_of
from host.session import Board
from sim.cosim.board import SimulatedBoard
from sim.cosim.verilate import simulator
from sim.divide.divided import divide
from sim.report.pixels import camera_rays
from sim.scene.load import load_scene
from tests.host.conftest import view
from tests.host.line import BadLine
from tests.host.simulated import SimulatedPipe
from tests.sim.parts.making import shuffled

pytestmark = pytest.mark.skipif(simulator() == "icarus", reason="millions of cycles")
WORD = 16
WORDS = 1 << TINY.address_bits


@pytest.fixture(scope="module")
def board():
    with SimulatedBoard(TINY, direct=True) as board:
        yield board


def test_a_clean_line_loses_nothing(board, rng):
    pipe = SimulatedPipe(board)
    channel = Channel(pipe, clock=pipe.clock)
    for _ in range(30):
        count = int(rng.integers(1, 600))
        address, data = int(rng.integers(WORDS - count + 1)), rng.bytes(count * WORD)
        channel.write([(address, data)], 0, WORD)
        assert channel.read(address, count, 0, WORD) == data


@pytest.mark.slow
def test_a_thousand_uploads_over_a_bad_line(board, seed):
    """Never a wrong word: what was said to be there is, whatever damage came later."""
    rng = np.random.default_rng(seed)
    memory = np.zeros((WORDS, WORD), np.uint8)
    known = np.zeros(WORDS, bool)
    lines = [BadLine((seed, way), rate=1e-4, bursts=1e-5, frames=0.002) for way in range(2)]
    pipe, honest = SimulatedPipe(board, *lines), SimulatedPipe(board)
    errors = sent_again = 0
    for _ in range(10):
        channel = Channel(pipe, clock=pipe.clock)
        for _ in range(100):
            count = int(rng.integers(1, 80))
            address, data = int(rng.integers(WORDS - count + 1)), rng.bytes(count * WORD)
            there = slice(address, address + count)
            try:
                channel.write([(address, data)], 0, WORD)
                memory[there] = np.frombuffer(data, np.uint8).reshape(-1, WORD)
                known[there] = True
            except LinkError:
                errors, known[there] = errors + 1, False
        sent_again += channel.statistics.retransmissions
        found = Channel(honest, clock=honest.clock).read(0, WORDS, 0, WORD)
        rows = np.frombuffer(found, np.uint8).reshape(-1, WORD)
        assert (rows == memory)[known].all()
    print(f"{errors} of 1000 uploads ended in an error; {sent_again} frames were sent again")
    assert errors < 20 < sent_again


@pytest.mark.slow
def test_the_line_is_used(rng):
    """By the board's clock: 85 % of 3 Mbaud, each way, and a status command in a millisecond."""
    with SimulatedBoard(ULX3S, clock_hz=25e6) as simulated:
        pipe = SimulatedPipe(simulated)
        board = Board(Channel(pipe, clock=pipe.clock))
        given = rng.integers(256, size=(256, WORD), dtype=np.uint8)
        times = [pipe.clock()]
        board.write(0, given)
        times.append(pipe.clock())
        assert (board.read(0, len(given)) == given).all()
        times.append(pipe.clock())
        for _ in range(10):
            board.status()
        times.append(pipe.clock())
    writing, reading, asking = np.diff(times)
    print(
        f"{given.size / writing:,.0f} and {given.size / reading:,.0f} bytes/s; {asking / 10:.6f} s"
    )
    assert given.size / max(writing, reading) > 0.85 * 300_000
    assert asking / 10 < 1e-3


@pytest.mark.slow
def test_a_divided_scene():
    """Rows, vertices and new trees over the line: memory and hits are the model's each frame."""
    config = replace(ULX3S, instances=True, packets=4, cache_words=64)
    with SimulatedBoard(config, direct=True) as simulated:
        pipe = SimulatedPipe(simulated)
        board = Board(Channel(pipe, clock=pipe.clock))
        for scene in (load_scene("fleet:300"), shuffled(24)):
            board.upload(divide(scene, board.config))
            for frame in (0, 3, 5):
                board.show(frame)
                pose = board.pose
                assert pose
                for part in parts_of(pose.image):
                    rows = board.read(part.words.start, len(part.words), part.first, part.size)
                    assert (rows == part.rows(pose.words)).all(), part.name
                seen = view(pose.prepared, 12, 8)
                hits, rays = board.render(seen), camera_rays(config.fmt, seen)
                model = pose.prepared.trace(pose.bits, pose.rows, pose.bounds, rays).fields(config)
                assert all((hits[name] == model[name]).all() for name in model)
                assert (hits["triangle"] != NO_TRIANGLE).any()
