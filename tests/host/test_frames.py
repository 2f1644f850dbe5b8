"""Frames: what is encoded comes back, and no damage hides the next good one."""

import zlib

import numpy as np
from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from hdl.link import protocol
from hdl.link.protocol import BODY_BYTES
from host.link.frames import LONGEST, Deframer, Frame, Packed, decode, encode
from tests.host.line import BadLine

numbers = st.integers(0, (1 << 16) - 1)
bodies = st.binary(max_size=BODY_BYTES) | st.integers(0, BODY_BYTES).map(bytes)
frames = st.builds(Frame, st.integers(0, 255), numbers, numbers, bodies)


@given(st.lists(frames, max_size=5), st.lists(st.integers(1, 50), min_size=1))
def test_frames_come_back_whole_from_pieces(sent, sizes):
    line = b"".join(encode(frame) for frame in sent)
    deframer, found, at = Deframer(), [], 0
    while at < len(line):
        size = sizes[at % len(sizes)]
        found += deframer.feed(line[at : at + size])
        at += size
    assert found == sent and deframer.damaged == 0


@given(frames)
def test_the_zero_that_ends_a_frame_is_its_only_one(frame):
    encoded = encode(frame)
    assert encoded.index(0) == len(encoded) - 1 <= LONGEST


def test_by_hand():
    frame = Frame(0x02, 0x1234, 0x5678, b"\x01\x00")
    raw = b"\x02\x34\x12\x78\x56\x02\x00\x01\x00"
    raw += zlib.crc32(raw).to_bytes(4, "little")
    assert zlib.crc32(b"123456789") == 0xCBF43926  # CRC-32/ISO-HDLC
    assert encode(frame) == cobs.encode(raw) + b"\0"
    assert Packed(protocol.READ).pack(address=1, count=2, first=3, bytes=4) == bytes([
        1,
        0,
        0,
        0,
        2,
        0,
        3,
        4,
    ])


@given(st.binary(max_size=3 * LONGEST), frames)
def test_after_anything_and_a_zero_the_next_frame_is_found(damage, frame):
    assert Deframer().feed(damage + b"\0" + encode(frame))[-1] == frame


@given(frames, st.data())
def test_a_frame_with_a_wrong_bit_is_none(frame, draw):
    encoded = bytearray(encode(frame))
    at = draw.draw(st.integers(0, len(encoded) - 2))
    encoded[at] ^= 1 << draw.draw(st.integers(0, 7))
    assert frame not in Deframer().feed(bytes(encoded))


def test_a_length_that_lies_is_damage():
    raw = b"\x80\x00\x00\x00\x00\x05\x00\x01"
    raw += zlib.crc32(raw).to_bytes(4, "little")
    assert decode(cobs.encode(raw)) is None


def test_what_never_ends_takes_no_room():
    deframer = Deframer()
    for _ in range(100):
        assert deframer.feed(b"\x01" * 1000) == [] and len(deframer._begun) <= LONGEST + 1
    frame = Frame(1, 2, 3, b"4")
    assert deframer.feed(b"\0" + encode(frame)) == [frame]
    assert deframer.damaged == 1 and len(deframer._begun) == 0


def test_a_bad_line_never_makes_a_frame_that_was_not_sent(seed):
    line, rng = BadLine(seed, rate=0.003, bursts=1e-4), np.random.default_rng(seed)
    deframer, sent, found = Deframer(), [], []
    for number in range(2000):
        frame = Frame(3, 7, number, rng.bytes(rng.integers(100)))
        sent.append(frame)
        found += deframer.feed(line.carry(encode(frame)))
    assert 500 < len(found) < 2000 and deframer.damaged > 100
    rest = iter(sent)
    assert all(frame in rest for frame in found)  # in their order
