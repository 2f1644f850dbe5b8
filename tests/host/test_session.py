"""The board as a Python object, against a board in Python."""

import struct
from dataclasses import replace
from math import ceil

import numpy as np
import pytest

from hdl.config import FULL, TINY, ULX3S
from hdl.fp.format import F24, FloatFormat
from hdl.link.protocol import Kind
from hdl.rays.packet import NO_TRIANGLE
from hdl.registers import Outcome
from host import parts, runner
from host.link.errors import LinkError, SessionLost
from host.link.port import BAUD
from host.runner import RunError
from host.session import Board
from sim.compiler.rays import HIT_FIELDS
from sim.divide.divided import divide
from sim.errors import InputError
from sim.model.rays.traversal import trace
from sim.model.refit import refit
from sim.prepare import prepare
from sim.report.pixels import camera_rays
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from tests.host.board import FOREVER, BoardModel
from tests.host.conftest import SCENE, on, view
from tests.host.pipes import Tcp, Terminal


def hits_by_model(prepared, frame: int, seen) -> dict[str, np.ndarray]:
    fmt, bits = prepared.config.fmt, prepared.coordinates(frame)
    corners = bits[prepared.leaf_vertices]
    order, rays = prepared.image.order, camera_rays(fmt, seen)
    bounds = refit(fmt, order, corners)
    limits = rays.t_min, rays.t_max
    found = trace(fmt, order, bounds, corners, rays.origins, rays.directions, *limits)
    return {name: getattr(found, name) for name in HIT_FIELDS}


def agree(found, expected) -> bool:
    return all((found[name] == expected[name]).all() for name in HIT_FIELDS)


STILL = replace(ULX3S, update=False, source=False, pointer_bits=10)
"""A machine that updates no tree, and makes rays by its camera only."""


@pytest.mark.parametrize("config", [ULX3S, FULL, TINY, replace(FULL, fmt=FloatFormat(8, 23))])
def test_a_board_says_what_it_is(config):
    board = on(BoardModel(config, 100, clock_hz=0))
    assert board.config == config and board.words == 100 and board.clock_hz == 0
    assert on(BoardModel(config, 100)).clock_hz == 50_000_000
    silent = BoardModel(config, 100)
    silent["MEMORY_WORDS"] = 0
    assert on(silent).words == 1 << config.address_bits
    with pytest.raises(LinkError, match=f"floats are {config.fmt}, not 5,5"):
        on(BoardModel(config, 100), FloatFormat(5, 5))


def test_boards_that_this_host_does_not_know(model):
    for name, value, said in (
        ("VERSION", 77, "version 77 of the registers"),
        ("MAGIC", 1, "no registers of a B-KD tree machine"),
        ("EXPONENT_BITS", 20, "no kind that this host knows"),
    ):
        kept, model[name] = model[name], value
        with pytest.raises(LinkError, match=said):
            on(model)
        model[name] = kept
    assert on(model, F24).config == ULX3S


def test_upload_show_and_render(model, prepared):
    board = on(model)
    board.upload(prepared)
    image = prepared.image
    for frame in (0, 3, 3, 11, 0):
        moved = []
        counters = board.show(frame, moved.append)
        assert (counters is None) == (not moved)
        bits = prepared.coordinates(frame)
        expected = refit(F24, image.order, bits[prepared.leaf_vertices])
        words = np.ascontiguousarray(model.memory).view("<u4")
        assert (image.bounds_of(words[image.nodes_at : image.size]) == expected).all()
        constant = image.constant_words()
        for begin, end in ((0, image.vertices_at), (image.triangles_at, image.nodes_at)):
            assert (words[begin:end] == constant[begin:end]).all()
        assert (words[image.nodes_at : image.size, 3] == constant[image.nodes_at :, 3]).all()
        ran = []
        seen = view(prepared)
        hits = board.render(seen, ran=ran.append)
        assert agree(hits, hits_by_model(prepared, frame, seen))
        assert len(ran) == 1 and ran[0]["cast"]["packets"] == seen.packets
    assert (hits["triangle"] < len(prepared.scene.faces)).sum() > 50


def test_only_what_means_something_travels(model, prepared):
    board = on(model)
    model.memory[:] = 0xEE
    moved = []
    board.upload(prepared, progress=moved.append)
    image = prepared.image
    assert sum(moved) == (
        16 * image.vertices_at + 12 * len(image.corners) + 4 * image.nodes + 9 * len(image.vertices)
    )
    assert (model.memory[image.vertices_at : image.triangles_at, 9:] == 0xEE).all()
    assert (model.memory[image.triangles_at : image.nodes_at, 12:] == 0xEE).all()
    moved.clear()
    seen = view(prepared)
    hit = board.render(seen, moved.append)["triangle"] != NO_TRIANGLE
    runs = np.count_nonzero(np.diff(hit))
    least = 4 * len(hit) + 9 * np.count_nonzero(hit)  # of misses the triangle only
    assert least <= sum(moved) < least + 13 * runs and least < 0.8 * 13 * len(hit)


def test_only_vertices_that_change_travel(model, prepared):
    scene = prepared.scene

    def pose(frame):
        points = scene.pose(0).copy()
        points[[3, 4, 5, 90]] += 0.01 * (frame == 1)
        return points

    stirred = prepare(Scene("stirred", scene.faces, 3, pose), ULX3S)
    board = on(model)
    board.upload(stirred)
    model.changes.clear()
    moved = []
    assert board.show(2, moved.append) is None and not model.changes and not moved
    assert board.show(1, moved.append)["instructions"] == len(stirred.image.instructions)
    assert sum(moved) == 4 * 9
    assert [kind for kind, _ in model.changes] == [Kind.WRITE, Kind.POKE, Kind.POKE]
    expected = stirred.image.vertex_words(stirred.coordinates(1))
    at = slice(stirred.image.vertices_at, stirred.image.triangles_at)
    assert (np.ascontiguousarray(model.memory).view("<u4")[at] == expected).all()


def test_runs_are_merged_where_that_is_shorter():
    for size, header, gap, runs in ((9, 6, 1, 2), (4, 6, 1, 1), (4, 6, 2, 2), (9, 20, 2, 1)):
        rows = np.arange(20 * size, dtype=np.uint8).reshape(20, size)
        changed = np.zeros(20, bool)
        changed[[4, 5, 6 + gap]] = True
        found = parts.runs_of(100, rows, changed, header)
        assert len(found) == runs and found[0][0] == 104
        assert found[-1][1].endswith(rows[6 + gap].tobytes())
    assert parts.runs_of(100, rows, np.zeros(20, bool), 6) == []


@pytest.mark.parametrize(("width", "height"), [(20, 15), (7, 9), (1, 1), (33, 2)])
def test_bands_are_the_whole_image(prepared, width, height):
    seen = view(prepared, width, height)
    whole = hits_by_model(prepared, 5, seen)
    row = 4 * -(-width // 2)
    for rows in (1, 2, 100):
        model = BoardModel(ULX3S, prepared.image.size + rows * row + row // 2)
        board, ran = on(model), []
        board.upload(prepared, 5)
        assert agree(board.render(seen, ran=ran.append), whole)
        assert len(ran) == ceil(ceil(height / 2) / rows)
    with pytest.raises(InputError, match=f"take {row} memory words.*the board has {row - 1}"):
        on_board = on(BoardModel(ULX3S, prepared.image.size + row - 1))
        on_board.upload(prepared)
        on_board.render(seen)


DIVIDED = replace(ULX3S, instances=True, address_bits=16)


@pytest.mark.parametrize("scene", ["fleet:500", "burst:300", "room:500", "propeller:500"])
def test_a_divided_scene(compiled, scene):
    """Frame for frame what the model says, in all words that mean something; little travels."""
    model = BoardModel(DIVIDED, 1 << 13)
    board = on(model)
    divided = divide(load_scene(scene), board.config)
    moved = []
    for frame in (0, 8, 8, 3):
        moved.append([])
        if frame:
            board.show(frame, moved[-1].append)
        else:
            board.upload(divided, frame, moved[-1].append)
        pose = board.pose
        assert pose.frame == frame
        memory = np.ascontiguousarray(model.memory).view("<u4")
        for part in parts.parts_of(pose.image):
            assert (part.rows(memory) == part.rows(pose.words)).all(), part.name
        seen = view(divided)
        hits = board.render(seen)
        rays = camera_rays(F24, seen)
        expected = pose.prepared.trace(pose.bits, pose.rows, pose.bounds, rays).fields(DIVIDED)
        assert all((hits[name] == expected[name]).all() for name in expected)
        assert (hits["triangle"] != NO_TRIANGLE).sum() > 20
    sent = [sum(counts) for counts in moved]
    assert sent[0] == parts.upload_bytes(divided.image) and not sent[2]
    if scene == "fleet:500":
        assert 0 < sent[1] <= len(divided.image.instances) * (3 * 16 + 2 * 9)
    if scene == "burst:300":
        assert sent[1] > 9 * len(divided.image.vertices)  # another tree too


def test_a_divided_scene_on_a_board_without_instances(prepared):
    divided = divide(load_scene("fleet:500"), DIVIDED)
    with pytest.raises(InputError, match="instances and the board has none"):
        on(BoardModel(ULX3S, 1 << 13)).upload(divided)


def test_a_wide_format():
    config = replace(ULX3S, fmt=FloatFormat(8, 23))
    prepared = prepare(load_scene("walker:428"), config)
    board = on(BoardModel(config, 1 << 12))
    board.upload(prepared, 2)
    seen = view(prepared)
    assert agree(board.render(seen), hits_by_model(prepared, 2, seen))


@pytest.mark.parametrize("triangles", [1, 2, 3])
def test_the_smallest_scenes(triangles):
    points = np.random.default_rng(3).normal(size=(2, 5, 3))
    faces = np.array([[0, 1, 2], [0, 2, 3], [4, 2, 1]], np.int32)[:triangles]
    prepared = prepare(Scene("small", faces, 2, lambda k: points[k]), ULX3S)
    board = on(BoardModel(ULX3S, 1 << 10))
    board.upload(prepared)
    board.show(1)
    seen = view(prepared)
    assert agree(board.render(seen), hits_by_model(prepared, 1, seen))


def test_what_does_not_fit_is_named_with_numbers(prepared):
    image = prepared.image
    small = on(BoardModel(ULX3S, image.size - 1))
    with pytest.raises(InputError, match=f"takes {image.size:,} .* has {image.size - 1:,}"):
        small.upload(prepared)
    flat = on(BoardModel(replace(ULX3S, stack_depth=3), 1 << 12))
    with pytest.raises(InputError, match=r"has \d+ levels and a stack of the board holds 3"):
        flat.upload(prepared)
    few = on(BoardModel(replace(ULX3S, vertex_registers=8), 1 << 12))
    with pytest.raises(InputError, match="32 vertex registers and the board has 8"):
        few.upload(prepared)
    other = on(BoardModel(replace(ULX3S, fmt=FloatFormat(6, 10)), 1 << 12))
    with pytest.raises(InputError, match="floats of 7,16 and the board's are 6,10"):
        other.upload(prepared)


def test_a_board_without_update_processor(compiled):
    """The host writes the bounds of the frame that is uploaded; others are refused."""
    scene = load_scene(SCENE)
    model = BoardModel(STILL, 1 << 12)
    board = on(model)
    assert board.config == replace(STILL, vertex_registers=64, box_registers=64)
    prepared = prepare(scene, board.config)
    moved = []
    for frame in (0, 8):
        board.upload(prepared, frame, moved.append)
        hits = board.render(view(prepared))
        assert agree(hits, hits_by_model(prepared, frame, view(prepared)))
        assert board.show(frame) is None
        with pytest.raises(InputError, match=r"moved in frame 3 .* no update processor"):
            board.show(3)
        assert agree(board.render(view(prepared)), hits)
    image = prepared.image
    constant, vertices = 12 * len(image.corners) + 4 * image.nodes, 9 * len(image.vertices)
    assert sum(moved) == 2 * (constant + vertices + 12 * image.nodes) and not image.vertices_at
    counters = board.counters()
    assert "update" not in counters and set(counters["overflows"]) >= {"camera", "setup"}
    assert counters["cast"]["packets"] and "source" not in counters["overflows"]


def test_what_a_board_has_not_is_refused(prepared, compiled):
    few = on(BoardModel(replace(ULX3S, pointer_bits=8), 1 << 12))
    with pytest.raises(InputError, match="428 triangles .* 255: pointer_bits is 8 .* be 9"):
        few.upload(prepared)
    still = prepare(load_scene(SCENE), replace(ULX3S, update=False))
    with pytest.raises(InputError, match="compiled without a program"):
        on(BoardModel(ULX3S, 1 << 12)).upload(still)
    blind = on(BoardModel(replace(ULX3S, camera=False), 1 << 12))
    blind.upload(prepared)
    with pytest.raises(InputError, match="no camera .* camera true"):
        blind.render(view(prepared))


def test_a_run_takes_its_time(model, prepared):
    board = on(model)
    model.polls, model.clock_hz = 5, 1000
    board.upload(prepared)
    assert board.show(1) and board.status().done


def test_a_run_that_does_not_end_is_stopped(model, prepared, monkeypatch):
    board = on(model)
    board.upload(prepared)
    model.polls, model.clock_hz = FOREVER, 1 << 31  # half a billion cycles between two looks
    with pytest.raises(RunError, match=r"did not end within [\d,]+ cycles and was stopped"):
        board.show(1)
    assert not model.busy and board.status().outcome == Outcome.STOPPED
    model.polls, model.clock_hz = 0, 50_000_000
    assert board.show(1)


def test_a_run_that_does_not_even_stop(model, prepared, monkeypatch):
    board = on(model)
    monkeypatch.setattr(model, "_end", lambda outcome: None)
    monkeypatch.setattr(runner, "STOPPING", 0.2)
    model.polls = FOREVER
    board._registers.start({}, 1)
    with pytest.raises(RunError, match="does not stop; reset the board"):
        board.upload(prepared)


@pytest.mark.parametrize("outcome", [Outcome.READ_ERROR, Outcome.WRITE_ERROR])
def test_a_run_that_the_memory_fails(model, prepared, outcome):
    board = on(model)
    board.upload(prepared)
    model.fails = outcome
    word = outcome.name.split("_")[0].lower()
    with pytest.raises(RunError, match=f"the memory answered a {word} with an error"):
        board.show(1)
    model.fails = None
    assert board.show(0)  # all vertices again: nobody knows what is there


def test_a_run_of_another_host_is_stopped_first(model, prepared):
    first = on(model)
    model.polls = FOREVER
    first._registers.start({}, 1)
    second = on(model)
    assert model.busy and second.status().busy  # looking on does not stop it
    model.polls = 0
    second.upload(prepared)
    assert not model.busy and second.pose.prepared is prepared


def test_reset(model, prepared):
    board = on(model)
    assert board.reset() is False
    model.polls = FOREVER
    board._registers.start({}, 1)
    session = model.session
    assert board.reset() is True
    assert not model.busy and model.session != session


def test_ctrl_c_leaves_the_board_usable(model, prepared, monkeypatch):
    board = on(model)
    board.upload(prepared)
    model.polls = FOREVER

    def ctrl_c(seconds):
        raise KeyboardInterrupt

    monkeypatch.setattr(runner.time, "sleep", ctrl_c)
    with pytest.raises(KeyboardInterrupt):
        board.show(1)
    monkeypatch.undo()
    model.polls = 0
    assert model.busy and board.show(1) and not model.busy


def test_a_board_that_was_reset_has_no_scene(model, prepared):
    board = on(model)
    board.upload(prepared)
    model.reset()
    with pytest.raises(SessionLost):
        board.show(1)
    with pytest.raises(InputError, match="no scene on the board; upload one"):
        board.render(view(prepared))
    board.upload(prepared)
    assert board.show(1)


def test_memory_and_counters(model, rng, prepared):
    board = on(model)
    rows = rng.integers(0, 256, (50, 5), np.uint8)
    board.write(100, rows, 3)
    assert (board.read(100, 50, 3, 5) == rows).all() and board.read(99, 2).shape == (2, 16)
    assert (board.read(100, 50, 2) == model.memory[100:150, 2:]).all()
    board.upload(prepared)
    counters = board.counters()
    assert counters["update"]["instructions"] == len(prepared.image.instructions)
    assert set(counters["cast"]["waits"]) == {"nodes", "tests", "loop", "rays"}
    assert counters["link"]["executed"] > 5 and counters["link"]["damaged"] == 0


def test_over_a_real_port(model, prepared):
    with Terminal(model.receive) as terminal:
        with Board.open(terminal.path) as board:
            board.upload(prepared)
            seen = view(prepared)
            assert agree(board.render(seen), hits_by_model(prepared, 0, seen))
            with pytest.raises(LinkError, match="busy"):
                Board.open(terminal.path)
            assert board.channel.statistics.retransmissions == 0
        with Board.open(terminal.path, BAUD) as board:
            assert board.show.__doc__ and board.config == ULX3S


def test_over_tcp(model, prepared):
    with Tcp(model.receive) as tcp:
        for _ in range(2):
            with Board.open(tcp.path) as board:
                board.upload(prepared)
                seen = view(prepared)
                assert agree(board.render(seen), hits_by_model(prepared, 0, seen))
                assert board.channel.statistics.retransmissions == 0
    with pytest.raises(LinkError, match="nothing listens there"):
        Board.open(tcp.path)


def test_a_port_that_goes_in_the_middle(model, prepared):
    with Terminal(model.receive) as terminal, Board.open(terminal.path) as board:
        board.upload(prepared)
        terminal.unplug()
        with pytest.raises(LinkError, match="the port is gone"):
            board.show(1)


def test_stale_bytes_both_ways_of_a_real_port(model, prepared):
    """A host that ended in the middle of a frame, and did not read its answers."""
    with Terminal(model.receive) as terminal:
        board = Board.open(terminal.path)
        old = board.channel._session
        assert old
        raw = struct.pack("<BHHH", 2, old.number, old.next, 8)
        board.channel._line._pipe.write(b"\x07" + raw[:4])
        board.__exit__()
        with Board.open(terminal.path) as board:
            board.upload(prepared)
            assert board.show(3)
