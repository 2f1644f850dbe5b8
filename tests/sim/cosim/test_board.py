"""The simulated board: bytes through its line, and its time."""

import pylibfst
import pytest

from hdl.config import TINY
from sim.cosim.board import SimulatedBoard
from sim.cosim.board_bench import DirectBench, PinsBench
from sim.cosim.line import DEPTH
from sim.cosim.verilate import SimulationError, simulator
from tests.sim.cosim.echo import Echo, EchoBoard

CLOCK_HZ = 50e6
RATES = [
    None,  # direct
    3e6,
    pytest.param(921_600.0, marks=pytest.mark.slow),  # a simulator each
    pytest.param(115_200.0, marks=pytest.mark.slow),
]
LONG = 30_000 if simulator() == "icarus" else 500_000  # cycles


def echo(baud: float | None = None, work: int = 0) -> SimulatedBoard:
    if baud is None:
        return SimulatedBoard(TINY, bench=DirectBench(Echo(work=work)))
    unit = EchoBoard(clock_hz=CLOCK_HZ, baud=baud)
    return SimulatedBoard(TINY, bench=PinsBench(unit, CLOCK_HZ / baud))


def all_of(board: SimulatedBoard, given: bytes, step: int) -> bytes:
    """What comes back until all is idle; steps are longer from the last byte on."""
    left, received = given, b""
    while left or not board.idle:
        some, left = left[: board.room], left[board.room :]
        received += board.exchange(some, max(step, 5000 * (len(received) == len(given)))).received
    return received


@pytest.mark.parametrize("baud", RATES)
def test_bytes_come_back(baud, rng):
    byte = 10 * CLOCK_HZ / baud if baud else 2  # cycles
    with echo(baud) as board:
        for step, some in [
            (byte / 3, rng.bytes(40)),
            (7 * byte, bytes(range(256))),
            (5000, rng.bytes(min(30_000, int(LONG / byte)))),
        ]:
            begun = board.cycles
            assert all_of(board, some, int(step) + 1) == some
            passed = board.cycles - begun
            assert len(some) * byte < passed < 1.01 * len(some) * byte + 10 * byte + 70_000
        assert board.framing_errors == 0


def test_waves(tmp_path):
    file = tmp_path / "board.fst"
    with SimulatedBoard(TINY, bench=DirectBench(Echo()), waves=file) as board:
        assert all_of(board, b"waves", 100) == b"waves"
    waves = pylibfst.lib.fstReaderOpen(str(file).encode())
    assert pylibfst.lib.fstReaderGetEndTime(waves) > 0
    pylibfst.lib.fstReaderClose(waves)


@pytest.mark.parametrize("baud", RATES[:2])
def test_it_returns_when_an_answer_has_ended(baud):
    with echo(baud) as board:
        board.exchange(b"", 200_000)
        assert board.idle
        begun = board.cycles
        result = board.exchange(b"hello", 1_000_000)
        byte = 10 * CLOCK_HZ / baud if baud else 2
        assert result.received == b"hello" and not result.idle
        assert result.cycles == board.cycles - begun < 9 * byte + 60


def test_idle_costs_no_cycles():
    with echo() as board:
        assert not board.idle
        assert board.exchange(b"", 200_000).idle and board.idle
        begun = board.cycles
        assert board.exchange(b"", 1000) == (b"", 0, 0, 0, True)
        assert board.cycles == begun
        assert board.exchange(b"x", 10).cycles > 0 and not board.idle


def test_a_board_that_works_is_not_idle():
    with echo(work=150_000) as board:
        result = board.exchange(b"x", 140_000)
        assert not result.received and not result.idle and result.cycles >= 140_000
        assert board.exchange(b"", 20_000).received == b"x"


def test_a_line_that_is_full_says_so(rng):
    with echo(3e6) as board:
        given = rng.bytes(DEPTH)
        assert board.room == DEPTH
        result = board.exchange(given, 10)
        assert board.room == DEPTH - result.waiting < DEPTH // 2
        with pytest.raises(ValueError, match=f"room for {board.room} bytes, not for {DEPTH}"):
            board.exchange(given, 10)
        board.reset()
        assert board.room == DEPTH
        assert all_of(board, b"after", 10_000) == b"after", "what was under way is lost"


@pytest.mark.slow
def test_framing_errors_are_counted():
    unit = EchoBoard(clock_hz=CLOCK_HZ, baud=2e6)
    with SimulatedBoard(TINY, bench=PinsBench(unit, CLOCK_HZ / 3e6)) as board:
        all_of(board, bytes(range(256)), 10_000)
        assert board.framing_errors > 0
        board.reset()
        assert board.framing_errors == 0


def test_what_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="baud"):
        SimulatedBoard(TINY, baud=20e6)
    with pytest.raises(ValueError, match="words"):
        SimulatedBoard(TINY, words=1 << 20)


def test_a_simulator_that_dies_is_an_error():
    with echo() as board, pytest.raises(SimulationError, match="Key"):
        board._process.call("no such call")
