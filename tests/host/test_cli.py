"""bkd-host as its users run it: real commands over a pseudo-terminal, and every error."""

import json
import os
import pty
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from hdl.config import ULX3S
from hdl.fp.format import FloatFormat
from host.cli import bench, counters, identify, play, ports, render, reset, upload, verify
from host.link import port
from tests.host.board import FOREVER, BoardModel
from tests.host.conftest import SCENE
from tests.host.line import BadLine
from tests.host.pipes import Terminal

FACES = np.array([[0, 1, 2], [0, 2, 3], [3, 2, 1]], np.int32)
POINTS = np.random.default_rng(1).normal(size=(4, 4, 3))


@pytest.fixture
def host(run, model):
    """Runs bkd-host at a board: exit code, output and errors."""
    with Terminal(model.receive) as terminal:
        yield lambda *arguments: run("bkd-host", "--port", terminal.path, *arguments)


@pytest.fixture
def small(tmp_path, monkeypatch) -> str:
    """A scene of three triangles and four frames, in the folder that is the current one."""
    monkeypatch.chdir(tmp_path)
    np.savez("scene.npz", faces=FACES, vertices=POINTS)
    return "scene.npz"


def narrow(text: str) -> bool:
    return max(map(len, text.split("\n"))) <= 80


def test_identify(host, model, tmp_path):
    code, out, err = host("identify", "--json", tmp_path / "i.json")
    assert (code, err) == (0, "") and narrow(out)
    assert "4,096 words of 128 bits" in out and "50 MHz" in out and "idle" in out
    figures = json.loads((tmp_path / "i.json").read_text())
    assert figures["stack_depth"] == 24 and figures["memory_words"] == 4096


def test_upload_and_verify(host, model, tmp_path):
    figures = tmp_path / "u.json"
    code, out, err = host("upload", SCENE, "--frame", 3, "--json", figures)
    assert (code, err) == (0, "") and narrow(out) and "of 4,096" in out
    assert json.loads(figures.read_text())["words"] < 4096
    code, out, err = host("verify", SCENE, "--frame", 3)
    assert (code, err) == (0, "") and narrow(out)
    model.memory[700, 2] ^= 0x10
    model.memory[1000, 15] ^= 1
    code, out, err = host("verify", SCENE, "--frame", 3, "--json", figures)
    lines = err.splitlines()
    assert code == 1 and len(lines) == 2 and "at word 700: " in lines[0] + lines[1]
    assert json.loads(figures.read_text())["mismatches"] == 2
    code, out, err = host("verify", SCENE)
    assert code == 1 and len(err.splitlines()) == 10


def test_a_divided_scene(run, compiled, tmp_path, monkeypatch):
    """Ships that move as a whole: far fewer bytes travel, and all that is there is right."""
    monkeypatch.chdir(tmp_path)
    model = BoardModel(replace(ULX3S, instances=True), 1 << 12)
    sent = []
    with Terminal(model.receive) as terminal:
        for options in (["--divide"], []):
            board = "--port", terminal.path
            assert run("bkd-host", *board, "upload", "fleet:500", *options, "--frame", 3)[0] == 0
            code, out, err = run("bkd-host", *board, "verify", "fleet:500", *options, "--frame", 3)
            assert (code, err) == (0, "") and narrow(out)
            assert ("rows of instances" in out) == bool(options)
            view = ["--view", "motion"] if options else []
            play = "play", "fleet:500", *options, *view, "--frames", "1:4", "--size", "16x12"
            code, out, err = run("bkd-host", *board, *play, "--json", "p.json")
            assert (code, err) == (0, "") and narrow(out) and Path("fleet.png").exists()
            figures = json.loads(Path("p.json").read_text())
            assert figures["updates"] == 2 and figures["hit_fraction"] > 0.05
            sent.append((figures["bytes_sent"], figures["update_cycles"]))
    assert sent[0][0] < 0.6 * sent[1][0]


@pytest.mark.parametrize("out", ["walk", "walk.png", "walk.webp", "walk.gif"])
def test_play(out, host, small):
    code, text, err = host(
        "play", small, "--frames", "1:4", "--size", "16x12", "--out", out, "--json", "p.json"
    )
    assert (code, err) == (0, "") and narrow(text) and out in text
    figures = json.loads(Path("p.json").read_text())
    assert figures["frames"] == [1, 2, 3] and figures["rays"] == 3 * 16 * 12
    assert figures["updates"] == 2 and figures["bands"] == 3 and figures["hit_fraction"] > 0.2
    if out == "walk":
        assert [f.name for f in sorted(Path(out).iterdir())] == [
            f"frame_{k:04}.png" for k in (1, 2, 3)
        ]
        pictures = [np.asarray(Image.open(f)) for f in sorted(Path(out).iterdir())]
        assert {picture.shape for picture in pictures} == {(12, 16, 3)}
        assert not (pictures[0] == pictures[1]).all()
    else:
        with Image.open(out) as picture:
            assert picture.size == (16, 12) and picture.n_frames == 3


def test_render_is_the_frame_that_bkd_sim_would_choose(host, small):
    code, _, err = host("render", small, "--size", "16x12", "--json", "p.json")
    assert (code, err) == (0, "") and Path("scene.png").exists()
    assert json.loads(Path("p.json").read_text())["frames"] == [1]
    code, _, err = host("render", small, "--frame", 3, "--size", "16x12", "--view", "depth")
    assert (code, err) == (0, "")


def test_a_picture_in_bands(run, small):
    arguments = ["render", small, "--size", "40x30", "--out"]
    for words, bands in ((4096, 1), (13 + 3 * 80, 5)):
        model = BoardModel(ULX3S, words)
        with Terminal(model.receive) as terminal:
            command = ["bkd-host", *arguments, f"{bands}.png", "--port", terminal.path]
            assert run(*command, "--json", "p.json")[0] == 0
        assert json.loads(Path("p.json").read_text())["bands"] == bands
    assert Path("1.png").read_bytes() == Path("5.png").read_bytes()


def test_a_bad_line_makes_the_same_picture(run, small, model):
    arguments = ["bkd-host", "play", small, "--frames", "0:2", "--size", "40x30", "--port"]
    for name, rate in (("good", 0.0), ("bad", 3e-4)):
        lines = (BadLine(way, rate) for way in range(2))
        with Terminal(model.receive, *lines) as terminal:
            code, _, err = run(*arguments, terminal.path, "--out", f"{name}.png", "--json", "p")
        assert (code, err) == (0, "")
    assert Path("good.png").read_bytes() == Path("bad.png").read_bytes()
    assert json.loads(Path("p").read_text())["retransmissions"] > 0


def test_counters_bench_and_reset(host, model, tmp_path, rng):
    model.memory[:] = rng.integers(0, 256, model.memory.shape, np.uint8)
    before, figures = model.memory.copy(), tmp_path / "b.json"
    code, out, err = host("bench", "--seconds", 0.1, "--json", figures)
    assert (code, err) == (0, "") and narrow(out)
    found = json.loads(figures.read_text())
    assert (model.memory == before).all() and found["bytes"] >= 4096
    for key in ("read_bytes_per_second", "write_bytes_per_second"):
        assert found[key]["board"] == pytest.approx(found[key]["wall"], rel=0.5)
    code, out, err = host("counters", "--json", figures)
    assert (code, err) == (0, "") and narrow(out) and "executed" in out
    assert json.loads(figures.read_text())["counters"]["link"]["damaged"] == 0
    assert host("reset") == (0, "No run was under way.\n", "")
    model.polls, model._left = FOREVER, FOREVER
    model.registers[0x44 // 4] = 1
    assert "a run is under way" in host("identify")[1]
    assert "not final" in host("counters")[1]
    code, _, err = host("bench")
    assert code == 2 and "a run is under way; wait" in err
    assert host("reset")[:2] == (0, "The run under way was stopped.\n")
    assert not model.busy and "stopped" in host("identify")[1]


def test_a_clock_that_is_not_known(run):
    with Terminal(BoardModel(ULX3S, 64, clock_hz=0).receive) as terminal:
        code, out, _ = run("bkd-host", "bench", "--port", terminal.path, "--seconds", "0.05")
        assert code == 0 and narrow(out) and "not known" in out
        assert "it does not say" in run("bkd-host", "--port", terminal.path, "identify")[1]


def test_the_port_comes_from_the_environment_or_is_the_only_one(run, monkeypatch, model):
    with Terminal(model.receive) as terminal:
        monkeypatch.setenv("BKDTREE_PORT", terminal.path)
        assert run("bkd-host", "reset")[0] == 0
        monkeypatch.delenv("BKDTREE_PORT")
        found = [port.PortInfo(terminal.path, "a board", "", True)]
        found.append(port.PortInfo("/dev/ttyS0", "", "", False))
        monkeypatch.setattr(port, "ports", lambda: found)
        monkeypatch.setattr("host.cli.ports.ports", lambda: found)
        assert run("bkd-host", "reset")[0] == 0
        code, out, _ = run("bkd-host", "ports")
        assert code == 0 and terminal.path in out and "a board" in out
        found.append(replace(found[0], url="/dev/ttyUSB7"))
        code, _, err = run("bkd-host", "reset")
        assert (code, err.count("\n")) == (2, 1) and f"{terminal.path}, /dev/ttyUSB7" in err
        found.clear()
        code, _, err = run("bkd-host", "reset")
        assert (code, err.count("\n")) == (2, 1) and "no serial port" in err
        assert run("bkd-host", "ports")[1] == "There are no serial ports.\n"


@contextmanager
def in_time(seconds: float = 3.0):
    begin = time.monotonic()
    yield
    assert time.monotonic() - begin < seconds


COMMANDS = {
    "render": ["--size", "8x8"],
    "play": ["--size", "8x8"],
    "upload": [],
    "verify": [],
    "identify": [],
    "counters": [],
    "bench": [],
    "reset": [],
}


def arguments_of(command: str, small: str) -> list[str]:
    scene = [small] if command in ("render", "play", "upload", "verify") else []
    return [command, *scene, *COMMANDS[command]]


def fails(run, path: str, *arguments) -> str:
    """The one line of a command that fails in time, and leaves no file."""
    before = sorted(Path().iterdir())
    with in_time():
        code, out, err = run("bkd-host", "--port", path, *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("bkd-host: ") and sorted(Path().iterdir()) == before
    return err


@pytest.mark.parametrize("command", COMMANDS)
def test_errors_of_the_port_are_one_line_in_time(command, run, small):
    arguments = arguments_of(command, small)
    err = fails(run, "/dev/ttyNONE", *arguments)
    assert "/dev/ttyNONE: there is no such port; bkd-host ports" in err
    with Terminal(lambda data: b"") as terminal:
        err = fails(run, terminal.path, *arguments)
        assert f"{terminal.path}: no board answers" in err


@pytest.mark.parametrize("said", [b"login: ", b"\0", b"\xff\x00\xaa", bytes(range(256)) * 4])
def test_something_else_on_the_port(said, run, small):
    with Terminal(lambda data: said) as terminal:
        assert "and no answer in them; is this the board's port" in fails(
            run, terminal.path, "identify"
        )


def test_an_echo_is_no_board(run, small):
    with Terminal(lambda data: data) as terminal:
        assert "and no answer in them" in fails(run, terminal.path, "identify")


def test_another_version(run, small):
    model = BoardModel(ULX3S, 64, version=9)
    with Terminal(model.receive) as terminal:
        assert "version 9 of the protocol" in fails(run, terminal.path, "upload", small)
    model = BoardModel(ULX3S, 64)
    model["VERSION"] = 9
    with Terminal(model.receive) as terminal:
        assert "version 9 of the registers" in fails(run, terminal.path, "upload", small)


def test_a_busy_port(run, small, model):
    with Terminal(model.receive) as terminal:
        taken = port.open_port(terminal.path, port.BAUD)
        assert "the port is busy" in fails(run, terminal.path, "upload", small)
        taken.close()
        assert run("bkd-host", "--port", terminal.path, "upload", small)[0] == 0


def test_a_port_that_goes_in_the_middle(run, small, model):
    def receive(data):
        answer = model.receive(data)
        if len(model.changes) > 2:
            raise OSError
        return answer

    with Terminal(receive) as terminal:
        assert "the port is gone" in fails(run, terminal.path, "upload", small)


def test_a_board_that_is_reset_in_the_middle(run, small, model):
    def receive(data):
        if len(model.changes) == 2:
            model.reset()
        return model.receive(data)

    with Terminal(receive) as terminal:
        assert "reset, or another host" in fails(run, terminal.path, "upload", small)


BOARDS = {
    "memory": (ULX3S, 10, ["at least 12 memory words", "has 10"]),
    "hits": (ULX3S, 27, ["two rows of 8 pixels take 16", "has 15"]),
    "stack": (replace(ULX3S, stack_depth=1), 64, ["has 2 levels", "holds 1"]),
    "format": (replace(ULX3S, fmt=FloatFormat(6, 10)), 64, ["floats are 6,10, not 7,16"]),
}


@pytest.mark.parametrize("case", BOARDS)
def test_boards_that_are_too_small(case, run, small):
    config, words, said = BOARDS[case]
    with Terminal(BoardModel(config, words).receive) as terminal:
        err = fails(run, terminal.path, "render", small, "--size", "8x8", "--format", "7,16")
        assert all(text in err for text in said), err


def test_identify_refuses_another_configuration(run, model):
    with Terminal(model.receive) as terminal:
        for name, said in (("ulx3s", None), ("full", "vertex_registers is 32, not 64")):
            arguments = ["--port", terminal.path, "identify", "-c", name]
            code, out, err = run("bkd-host", *arguments)
            assert code == (2 if said else 0) and (said or "") in err
        err = fails(run, terminal.path, "identify", "-c", "none.json")
        assert "none.json: no such configuration; give tiny" in err


BAD = {
    "frame": (["render", "--frame", "9"], ["--frame 9", "0 to 3"]),
    "frames": (["play", "--frames", "2:9"], ["--frames 2:9", "0 to 3"]),
    "upload": (["upload", "--frame", "4"], ["--frame 4", "0 to 3"]),
    "size": (["play", "--size", "0x9"], ["--size 0x9", play.SIZE]),
    "camera": (["play", "--camera", "1,2"], ["--camera 1,2", "seven"]),
    "out": (["play", "--out", "no/such/a.png"], ["no/such/a.png", "written"]),
    "suffix": (["play", "--out", "a.xyzzy"], ["a.xyzzy", ".png"]),
    "animation": (["play", "--out", "a.jpg"], ["a.jpg", ".gif"]),
    "no folder": (["play", "--out", "no/such"], ["no/such", "folder"]),
    "json": (["upload", "--json", "no/such/a.json"], ["a.json", "written"]),
    "format": (["upload", "--format", "1,40"], ["1,40"]),
    "option": (["upload", "--lattency"], ["--lattency", "--help"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_no_file(case, run, small, model):
    (command, *options), said = BAD[case]
    with Terminal(model.receive) as terminal:
        err = fails(run, terminal.path, command, small, *options)
        assert all(text in err for text in said), err


def test_a_folder_that_is_a_file(host, small):
    Path("walk").write_text("")
    code, _, err = host("play", small, "--size", "8x8", "--out", "walk")
    assert code == 2 and "walk: is no folder" in err


def test_show(host, small, monkeypatch):
    arguments = ["render", small, "--size", "8x8", "--show"]
    monkeypatch.setattr("host.cli.pictures.shutil.which", lambda name: None)
    code, _, err = host(*arguments)
    assert code == 2 and "--show: " in err and not Path("scene.png").exists()
    opened = []
    monkeypatch.setattr("host.cli.pictures.shutil.which", lambda name: name)
    monkeypatch.setattr(
        "host.cli.pictures.subprocess.Popen", lambda command, **_: opened.append(command)
    )
    assert host(*arguments)[0] == 0 and opened == [["xdg-open", Path("scene.png")]]


def test_ctrl_c_and_the_next_command(host, small, model, monkeypatch):
    def ctrl_c(seconds):
        raise KeyboardInterrupt

    model.polls, model.clock_hz = FOREVER, 1000
    with monkeypatch.context() as context:
        context.setattr("host.runner.time.sleep", ctrl_c)
        assert host("upload", small)[0] == 130
    assert model.busy
    model.polls = 0
    assert host("upload", small)[0] == 0 and host("verify", small)[0] == 0


def heed_ctrl_c():
    """What runs in the background of a shell is told to ignore it, and so are its children."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_ctrl_c_at_a_real_process(small, model, run):
    model.polls, model.clock_hz = FOREVER, 1000
    with Terminal(model.receive) as terminal:
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
        command = [sys.executable, "-m", "host", "--port", terminal.path, "upload", small]
        with subprocess.Popen(
            command,
            env=environment,
            stderr=subprocess.PIPE,
            preexec_fn=heed_ctrl_c,
        ) as process:
            end = time.monotonic() + 60
            while not model.busy and time.monotonic() < end:
                time.sleep(0.02)
            process.send_signal(signal.SIGINT)
            try:
                _, err = process.communicate(timeout=60)
            finally:
                process.kill()
        assert (process.returncode, err) == (130, b"") and model.busy
        model.polls = 0
        assert run("bkd-host", "--port", terminal.path, "upload", small)[0] == 0


def test_every_example_is_a_command(run):
    for module in (bench, counters, identify, play, ports, render, reset, upload, verify):
        code, out, _ = run("bkd-host", module.__name__.split(".")[-1], "--help")
        assert code == 0 and module.EXAMPLE in out and narrow(out)


def test_as_a_module_from_another_folder_at_a_terminal(tmp_path, model):
    """Progress, at 80 columns, on a standard error that is a terminal."""
    with Terminal(model.receive) as terminal:
        environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "COLUMNS": "80"}
        environment |= {"TERM": "xterm", "BKDTREE_PORT": terminal.path}
        shown, screen = pty.openpty()
        command = [sys.executable, "-m", "host", "upload", SCENE]
        done = subprocess.run(
            command, cwd=tmp_path, env=environment, stdout=subprocess.PIPE, stderr=screen, text=True
        )
        os.close(screen)
        seen = os.read(shown, 1 << 16).decode()
        os.close(shown)
    assert done.returncode == 0 and "memory words" in done.stdout
    assert "uploading" in seen and "kB" in seen
