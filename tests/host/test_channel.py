"""The channel: all arrives once, or ends in an error."""

import time
from collections import Counter

import numpy as np
import pytest

from hdl.config import ULX3S
from hdl.link.protocol import BODY_BYTES, VERSION, Kind, Reason
from hdl.registers import JOB_AT
from host.link import channel as channel_module
from host.link.channel import OPENING, PATIENCE, TRY, WINDOW, Channel
from host.link.errors import LinkError, Refused, SessionLost
from host.link.frames import Frame, encode
from tests.host.board import BoardModel
from tests.host.line import BadLine
from tests.host.pipes import Wire

JOB = JOB_AT // 4
WORD = 16


def joined(words: int = 1 << 12, up=None, down=None, *, wire=None, **options):
    """A board, a wire to it and a channel over that."""
    board = BoardModel(ULX3S, words)
    pipe = Wire(board, up, down, **(wire or {}))
    return board, pipe, Channel(pipe, clock=pipe.clock, **options)


def random_runs(rng, words: int, size: int, most: int) -> list[tuple[int, bytes]]:
    """Runs of words that may overlap."""
    runs = []
    for _ in range(rng.integers(1, 8)):
        count = int(rng.integers(1, most))
        runs.append((int(rng.integers(words - count + 1)), rng.bytes(count * size)))
    return runs


def written(memory: np.ndarray, runs, first: int, size: int) -> np.ndarray:
    """What a memory is after runs."""
    memory = memory.copy()
    for address, data in runs:
        rows = np.frombuffer(data, np.uint8).reshape(-1, size)
        memory[address : address + len(rows), first : first + size] = rows
    return memory


def test_memory_and_registers(rng):
    board, _, channel = joined()
    for _ in range(20):
        first = int(rng.integers(WORD))
        size = int(rng.integers(1, WORD - first + 1))
        runs = random_runs(rng, len(board.memory), size, 700)
        moved = []
        expected = written(board.memory, runs, first, size)
        channel.write(runs, first, size, moved.append)
        assert (board.memory == expected).all()
        assert sum(moved) == sum(len(data) for _, data in runs)
        moved.clear()
        count = int(rng.integers(1, 3000))
        address = int(rng.integers(len(board.memory) - count + 1))
        read = channel.read(address, count, first, size, moved.append)
        assert read == expected[address : address + count, first : first + size].tobytes()
        assert sum(moved) == len(read)
    assert channel.statistics.retransmissions == channel.statistics.frames_damaged == 0
    values = rng.integers(0, 1 << 14, 20).tolist()
    channel.poke((JOB, values), (JOB + 5, [77]))
    assert channel.peek(JOB, 4) == [*values[:1], values[1], values[2] & 1, values[3]]
    assert board.registers[JOB + 5] == 77
    assert len(channel.peek(0, 1000)) == 1000


def test_nothing_to_do_is_nothing():
    board, _, channel = joined()
    channel.write([], 0, 4)
    assert channel.read(0, 0, 0, 4) == b"" and board.changes == []


def test_small_runs_share_frames():
    board, _, channel = joined()
    channel.write([(k, b"123456789") for k in range(0, 400, 4)], 0, 9)
    per_frame = (BODY_BYTES - 2) // 15
    assert len(board.changes) == -(-100 // per_frame)


@pytest.mark.parametrize("window", [1, 4096, WINDOW])
def test_the_window_bounds_what_is_under_way(window):
    board, pipe, channel = joined(wire={"delay": 0.1}, window=window)
    channel.write([(0, bytes(16 * 4096))], 0, 16)
    assert window < pipe.most_under_way < window + 2 * 1100
    assert channel.statistics.retransmissions == 0


def test_a_window_fills_the_line():
    """3 Mbaud and 16 ms until an answer is seen: within 15 % of what the line can."""
    board, pipe, channel = joined(wire={"delay": 0.008, "rate": 300_000})
    channel.open()
    for work in (
        lambda: channel.write([(0, bytes(16 * 4096))] * 4, 0, 16),
        lambda: channel.read(0, 4096, 0, 16),
    ):
        begin, moved = pipe.now, channel.statistics.bytes_sent + channel.statistics.bytes_received
        work()
        moved = channel.statistics.bytes_sent + channel.statistics.bytes_received - moved
        assert moved / (pipe.now - begin) > 0.85 * 300_000


@pytest.mark.parametrize("times", [10, 100, 300])
def test_a_line_that_is_simulated_is_only_slower(times):
    board, pipe, channel = joined(wire={"rate": 300_000 / times})
    channel.write([(0, bytes(range(256)) * 128)], 0, 16)
    assert channel.read(0, 2048, 0, 16) == bytes(range(256)) * 128
    assert channel.statistics.retransmissions <= (8 if times > 100 else 0)
    assert pipe.now < 1.2 * times * 65536 / 300_000 + 1


def test_a_board_that_is_slower_than_the_line_is_not_swamped():
    """As a simulated one without a UART: it works at a tenth of the line, on 4096 bytes at once."""
    board, pipe, channel = joined(wire={"rate": 3e6, "speed": 3e5, "room": 4096, "delay": 0.002})
    channel.write([(0, bytes(range(256)) * 256)] * 8, 0, 16)
    assert board.memory.tobytes() == bytes(range(256)) * 256
    assert channel.statistics.retransmissions < 8 * 64 / 5
    assert pipe.now < 2 * 8 * 65536 / 3e5


LINES = {
    "bytes": {"rate": 2e-5},
    "many bytes": {"rate": 3e-4},
    "bursts": {"bursts": 2e-5},
    "frames": {"frames": 0.03},
    "all": {"rate": 1e-4, "bursts": 1e-5, "frames": 0.01},
}


@pytest.mark.parametrize("kind", LINES)
def test_hundreds_of_uploads_over_a_bad_line(kind, seed):
    rng = np.random.default_rng(seed)
    ends, sent_again = Counter(), 0
    for trial in range(60):
        lines = (BadLine([seed, trial, way], **LINES[kind]) for way in range(2))
        board, pipe, channel = joined(1 << 10, *lines)
        expected = board.memory.copy()
        try:
            for _ in range(4):
                runs = random_runs(rng, len(expected), 9, 300)
                expected = written(expected, runs, 0, 9)
                channel.write(runs, 0, 9)
                assert (board.memory == expected).all()
                assert channel.read(0, 300, 0, 16) == expected[:300].tobytes()
            ends["whole"] += 1
        except LinkError as error:
            ends[type(error).__name__] += 1
            assert kind in ("frames", "all")  # a late HELLO takes the board from its own host
        sent_again += channel.statistics.retransmissions
    print(ends, sent_again)
    assert ends["whole"] >= 55 and sent_again > 5


def test_a_change_is_made_once_and_in_order(seed):
    for trial in range(30):
        lines = (BadLine([seed, trial, way], rate=3e-4, frames=0.02) for way in range(2))
        board, _, channel = joined(16, *lines)
        runs = [(JOB + k % 7, [k]) for k in range(200)]
        try:
            channel.poke(*runs)
        except SessionLost:
            continue
        found = [int.from_bytes(body[2:], "little") for _, body in board.changes]
        assert found == list(range(200))


def test_sequence_numbers_run_over():
    board, _, channel = joined(wire={"delay": 0.0, "rate": 1e9})
    channel.open()
    assert channel._session
    channel._session.next, board.expected = 0xFFF0, 0xFFF0
    for k in range(40):
        channel.poke((JOB, [k]))
        assert channel.peek(JOB, 1) == [k]
    channel.write([(0, bytes(16 * 4096))], 0, 16)
    assert channel.statistics.retransmissions == 0


class Script:
    """A line that treats frames by their place."""

    def __init__(self, **what):
        self.what, self.count, self.cut = what, -1, False

    def carry(self, data: bytes) -> bytes:
        self.count += 1
        fate = {k: v for k, v in self.what.items() if self.count in v}
        if "drop" in fate:
            return b""
        if "flip" in fate:
            return data[:3] + bytes([data[3] ^ 1 or 2]) + data[4:]
        if "cut" in fate:  # the zero at its end is lost
            return data[:-1]
        return data * 2 if "twice" in fate else data


@pytest.mark.parametrize("fate", ["drop", "flip", "cut"])
def test_one_frame_lost_is_one_window_again(fate):
    """Frames 0 and 1 are HELLOs."""
    board, pipe, channel = joined(up=Script(**{fate: [7]}))
    channel.write([(0, bytes(range(256)) * 256)], 0, 16)
    assert board.memory.tobytes() == bytes(range(256)) * 256
    assert 1 <= channel.statistics.retransmissions <= WINDOW // 1024 + 2
    assert pipe.now < 1  # by REPEAT, not by the clock


def test_the_last_frame_lost_is_sent_again_by_the_clock():
    board, pipe, channel = joined(up=Script(drop=[3]))
    channel.write([(0, bytes(2000))], 0, 16)
    assert channel.statistics.retransmissions == 1 and len(board.changes) == 2


def test_a_lost_answer_of_a_write_costs_nothing():
    board, pipe, channel = joined(down=Script(drop=[3, 4, 5]))
    channel.write([(0, bytes(16 * 1024))], 0, 16)
    assert channel.statistics.retransmissions == 0


@pytest.mark.parametrize("fate", ["drop", "flip"])
def test_a_lost_answer_of_a_read_is_asked_for_again(fate):
    board, pipe, channel = joined(down=Script(**{fate: [5]}))
    board.memory[:] = np.arange(len(board.memory))[:, None] % 251
    assert channel.read(0, 2000, 0, 16) == board.memory[:2000].tobytes()
    assert 1 <= channel.statistics.retransmissions <= 5 and pipe.now < 0.26, pipe.now


def test_frames_that_come_twice_change_nothing():
    board, pipe, channel = joined(up=Script(twice=range(1000)), down=Script(twice=range(1000)))
    channel.write([(0, bytes(range(256)) * 64)], 0, 16)
    assert channel.read(0, 1024, 0, 16) == bytes(range(256)) * 64
    assert len(board.changes) == -(-1024 // ((BODY_BYTES - 8) // 16))


def test_old_answers_are_ignored():
    board, pipe, channel = joined()
    channel.open()
    assert channel._session
    session = channel._session.number
    other = Frame(Kind.REFUSED.value, session ^ 1, 1, bytes([Reason.SESSION.value]))
    old = Frame(Kind.REPEAT.value, session, 0xFF00)
    early = Frame(Kind.OK.value, session, 9)
    for frame in (other, old, early):
        pipe._came += encode(frame)
    channel.write([(0, bytes(16 * 1024))], 0, 16)
    assert channel.statistics.retransmissions == 0


def test_a_refusal_says_why_and_the_next_command_works():
    board, _, channel = joined(100)
    with pytest.raises(Refused, match="READ.*beyond the last") as refusal:
        channel.read(90, 20, 0, 16)
    assert refusal.value.reason == Reason.RANGE
    assert channel.read(90, 10, 0, 16) == bytes(160)
    with pytest.raises(Refused, match="WRITE.*beyond"):
        channel.write([(0, bytes(1600 * 10))], 0, 16)
    board.failing = range(5, 6)
    with pytest.raises(Refused, match="memory answers with an error"):
        channel.read(5, 1, 0, 16)
    with pytest.raises(Refused, match="no such command"):
        board._execute = refuse_all
        channel.peek(0, 1)


def refuse_all(kind, body):
    from tests.host.board import Refusal

    raise Refusal(Reason.KIND)


def test_a_board_that_is_reset_is_a_lost_session():
    board, pipe, channel = joined()
    channel.write([(0, bytes(160))], 0, 16)
    board.reset()
    with pytest.raises(SessionLost, match="reset, or another host"):
        channel.write([(0, bytes(160))], 0, 16)
    channel.write([(0, b"\1" * 160)], 0, 16)
    assert board.memory[9, 15] == 1


def test_a_board_that_is_reset_in_the_middle():
    board, pipe, channel = joined()

    def reset(count: int):
        board.reset()

    with pytest.raises(SessionLost):
        channel.write([(0, bytes(16 * 4096))], 0, 16, reset)


def test_two_hosts_take_turns():
    board, pipe, first = joined()
    first.open()
    second = Channel(pipe, clock=pipe.clock)
    second.poke((JOB, [5]))
    with pytest.raises(SessionLost):
        first.poke((JOB, [6]))
    assert board.registers[JOB] == 5


def test_a_cut_line_ends_in_an_error_in_time():
    for way in ("up", "down"):
        board, pipe, channel = joined()
        channel.open()
        getattr(pipe, way).cut = True
        begin = pipe.now
        with pytest.raises(LinkError, match=r"no answer for 1\d s"):
            channel.write([(0, bytes(16 * 4096))], 0, 16)
        assert PATIENCE <= pipe.now - begin < PATIENCE + 1
        getattr(pipe, way).cut = False
        channel.write([(0, b"\2" * 160)], 0, 16)
        assert board.memory[9, 0] == 2


def test_noise_for_ever_ends_in_an_error():
    board, pipe, channel = joined(patience=1.0)
    channel.open()
    pipe.up.cut = True
    read = pipe.read
    pipe.read = lambda size: read(size) or b"\x55"
    with pytest.raises(LinkError, match="no answer"):
        channel.peek(0, 1)
    assert pipe.now < 5


def test_a_port_that_goes_is_an_error_at_once():
    board, pipe, channel = joined()
    channel.open()
    pipe.gone = True
    with pytest.raises(LinkError, match="port is gone"):
        channel.peek(0, 1)


@pytest.mark.parametrize("answer", [b"", b"\x55", b"login: ", b"\0\0", encode(Frame(9, 9, 9))])
def test_no_board(answer):
    board, pipe, channel = joined(name="/dev/x")
    board.receive = lambda data: answer
    with pytest.raises(LinkError, match="/dev/x: no board" + (": .*no answer" * bool(answer))):
        channel.open()
    assert pipe.now < OPENING + 0.3


def test_another_version():
    board, pipe, channel = joined()
    board.version = VERSION + 1
    with pytest.raises(LinkError, match=f"version {VERSION + 1} .*version {VERSION}"):
        channel.open()
    assert board.session is None and pipe.now < 0.1


@pytest.mark.parametrize("far", range(0, 40_000, 1_777))
def test_a_host_that_is_killed_in_the_middle(far):
    """A new one on the same pipe: half a frame and a window of the old one are under way."""
    board, pipe, channel = joined()
    channel.open()

    class Killed(BaseException):
        pass

    written = 0
    write = pipe.write

    def killed(data):
        nonlocal written
        if written + len(data) > far:
            write(data[: far - written])
            raise Killed
        written += len(data)
        return write(data)

    pipe.write = killed
    with pytest.raises(Killed):
        channel.write([(0, b"\1" * (16 * 4096))], 0, 16)
        channel.write([(0, b"\1" * (16 * 4096))], 0, 16)
    pipe.write = write
    board.changes.clear()
    after = Channel(pipe, clock=pipe.clock)
    begin = pipe.now
    after.open()
    assert pipe.now - begin < TRY  # the first HELLO is heard
    after.write([(0, b"\2" * (16 * 2000))], 0, 16)
    assert after.read(0, 2000, 0, 16) == b"\2" * (16 * 2000)
    assert after.statistics.retransmissions == 0


@pytest.mark.parametrize("other", [0, 1])
def test_a_session_that_has_the_number_of_the_last_one_by_chance(other, monkeypatch):
    board, pipe, channel = joined()
    channel.poke((JOB, [1]), (JOB, [2]))
    assert board.session is not None
    session = board.session ^ other
    monkeypatch.setattr(channel_module.secrets, "randbits", lambda _: session)
    monkeypatch.setattr(channel_module.secrets, "randbelow", lambda _: 0)
    after = Channel(pipe, clock=pipe.clock)
    after.poke((JOB, [3]))
    assert board.registers[JOB] == 3


def test_time_is_that_of_the_clock():
    """Without a clock of its own it is the computer's."""
    assert Channel(Wire(BoardModel(ULX3S, 16)))._line.clock is time.monotonic
