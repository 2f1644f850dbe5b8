"""bkd-sim as its users run it: real commands, bad input, pipes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from sim import pose
from sim.command import command_line

FACES = np.array([[0, 1, 2], [0, 2, 3], [3, 2, 1]], np.int32)
POINTS = np.random.default_rng(1).normal(size=(3, 4, 3))


def save(folder: Path, faces=FACES, vertices=POINTS) -> Path:
    file = folder / "scene.npz"
    np.savez(file, faces=faces, vertices=vertices)
    return file


def with_(frame, vertex, value):
    points = POINTS.copy()
    points[frame, vertex, 1] = value
    return points


def obj(path: Path, faces: str) -> Path:
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n" + faces)
    return path


BAD = {
    "no triangles": (lambda d: [save(d, FACES[:0])], ["scene.npz", "triangle"]),
    "index": (lambda d: [save(d, FACES + 2)], ["scene.npz", "triangle 0", "4"]),
    "NaN": (lambda d: [save(d, vertices=with_(2, 3, np.nan))], ["frame 2", "vertex 3"]),
    "infinity": (lambda d: [save(d, vertices=with_(1, 0, np.inf))], ["frame 1", "vertex 0"]),
    "missing": (lambda d: [d / "none.npz"], ["none.npz", "no such file"]),
    "unknown scene": (lambda d: ["runner"], ["runner", "walker"]),
    "unknown extension": (lambda d: [obj(d / "a.xyzzy", "")], ["a.xyzzy", ".npz"]),
    "size": (lambda d: ["walker:many"], ["walker:many"]),
    "narrow format": (lambda d: [save(d), "--format", "2,1"], ["2,1", "vertex", "frame 0"]),
    "no format": (lambda d: [save(d), "--format", "1,40"], ["1,40"]),
    "frames": (lambda d: [save(d), "--frames", "2:9"], ["--frames 2:9", "0 to 2"]),
    "builder": (lambda d: [save(d), "--builder", "best"], ["best", "sah"]),
    "latency": (lambda d: [save(d), "--latency", "0"], ["latency", "0"]),
    "folder": (lambda d: [save(d), "--json", d / "no" / "u.json"], ["u.json", "written"]),
    "waves": (lambda d: [save(d), "--waves", d / "w.txt"], ["w.txt", ".fst"]),
    "option": (lambda d: [save(d), "--lattency", "3"], ["--lattency", "--help"]),
}


@pytest.mark.parametrize("case", BAD)
def test_bad_input_is_one_line_and_no_file(case, run, tmp_path):
    arguments, words = BAD[case]
    arguments = arguments(tmp_path)
    if "--json" not in arguments:
        arguments = [*arguments, "--json", tmp_path / "u.json"]
    before = sorted(tmp_path.iterdir())
    code, out, err = run("bkd-sim", "update", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("bkd-sim: ") and all(word in err for word in words), err
    assert sorted(tmp_path.iterdir()) == before


BAD_RENDER = {
    "size 0": (["--size", "0x20"], ["--size 0x20"]),
    "no size": (["--size", "20"], ["--size 20", "512x386"]),
    "own target": (["--camera", "1,2,3,1,2,3,40"], ["camera", "same point"]),
    "no camera": (["--camera", "1,2,3"], ["--camera 1,2,3", "seven"]),
    "field of view": (["--camera", "1,2,3,0,0,0,180"], ["180"]),
    "frame": (["--frame", "3"], ["--frame 3", "0 to 2"]),
    "frames": (["--frames", "1:9"], ["--frames 1:9", "0 to 2"]),
    "both": (["--frame", "1", "--frames", "0:2"], ["--frame"]),
    "folder": (["--out", "no/such/a.png"], ["no/such/a.png", "written"]),
    "picture": (["--out", "a.xyzzy"], ["a.xyzzy", ".png"]),
    "animation": (["--frames", "0:2", "--out", "a.jpg"], ["a.jpg", ".gif"]),
    "shallow": (["--stack", "1"], ["2 levels", "--stack 2"]),
    "cache": (["--cache", "100"], ["100", "power of two"]),
    "no cache": (["--cache", "0"], ["--cache 0", "banks"]),
    "recording": (["--record", "a.txt"], ["a.txt", ".npz"]),
    "recording of frames": (["--frames", "0:2", "--record", "a.npz"], ["a.npz", "--frame"]),
    "wide": (["--size", "300x9", "--format", "4,9"], ["300 x 9", "4,9", "255"]),
    "steps": (["--size", "64x48", "--format", "4,9"], ["4,9", "pixel's step", "exponent"]),
    "no rays": (["--format", "4,12"], ["4,12", "exponent"]),
}


@pytest.mark.parametrize("case", BAD_RENDER)
def test_bad_input_of_render_is_one_line_and_no_file(case, run, tmp_path, monkeypatch):
    arguments, words = BAD_RENDER[case]
    file = save(tmp_path)
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    code, out, err = run("bkd-sim", "render", file, "--json", "r.json", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("bkd-sim: ") and all(word in err for word in words), err
    assert sorted(tmp_path.iterdir()) == before


def test_a_bad_recording_is_one_line(run, tmp_path):
    np.savez(tmp_path / "other.npz", faces=FACES)
    (tmp_path / "cut.npz").write_bytes((tmp_path / "other.npz").read_bytes()[:-9])
    for name in ("none.npz", "other.npz", "cut.npz"):
        code, _, err = run("bkd-sim", "replay", tmp_path / name)
        assert (code, err.count("\n")) == (2, 1) and name in err


def test_render_and_replay_agree(run, tmp_path, monkeypatch):
    file = save(tmp_path)
    monkeypatch.chdir(tmp_path)
    options = ["--frame", "1", "--size", "15x10", "--shadows", "--record", "rays.npz"]
    code, out, err = run("bkd-sim", "render", file, *options, "--json", "r.json")
    assert (code, err) == (0, "") and max(map(len, out.split("\n"))) <= 80
    result = json.loads(Path("r.json").read_text())
    with Image.open("scene.png") as picture:
        assert picture.size == (15, 10)
    assert result["model_mismatches"] == result["oracle"]["unexplained"] == 0
    assert result["rays"] - result["shadow_rays"] == 15 * 10
    assert result["shadow_rays"] == round(result["hit_fraction"] * 15 * 10) > 0
    waits = sum(result["stall_cycles"]["rays"].values())
    packets = (result["cycles"] - waits) / result["steps_per_packet"]
    assert packets == pytest.approx(8 * 5 + result["shadow_rays"] / 4, rel=0.2)
    assert result["updates"] == 1 and result["update_cycles"] > 0

    code, out, err = run("bkd-sim", "replay", "rays.npz", "--json", "p.json")
    assert (code, err) == (0, "") and max(map(len, out.split("\n"))) <= 80
    replayed = json.loads(Path("p.json").read_text())
    assert replayed["rays"] == result["rays"] and replayed["mismatches"] == 0
    assert replayed["oracle"] == result["oracle"]
    assert all(replayed[k]["nearer"] == 0 for k in ("recorded", "model"))

    with np.load("rays.npz") as stored:
        columns = dict(stored)
    hit = int(np.flatnonzero(columns["triangle"] < len(FACES))[0])
    columns["triangle"][hit] = 2**28 - 1
    np.savez("rays.npz", **columns)
    code, out, _ = run("bkd-sim", "replay", "rays.npz", "--json", "p.json")
    assert code == 1
    assert json.loads(Path("p.json").read_text())["recorded"]["miss_became_hit"] == 1


def test_a_still_scene_needs_no_update(run, tmp_path):
    file = save(tmp_path, vertices=POINTS[:1])
    options = ["--size", "8x8", "--view", "depth", "--out", tmp_path / "a.png"]
    figures = tmp_path / "r.json"
    code, out, _ = run("bkd-sim", "render", file, *options, "--json", figures)
    assert code == 0 and "no vertex has moved" in out
    result = json.loads(figures.read_text())
    assert result["updates"] == result["update_cycles"] == result["update_share"] == 0


def test_a_wrong_hit_is_found_and_fails(run, tmp_path, monkeypatch):
    """The command's check can fail: the model is bent, by one ulp of one t."""
    import sim.prepare as prepare

    honest = prepare.trace

    def bent(*arguments, **options):
        hits = honest(*arguments, **options)
        hits.t[5] += 1
        return hits

    monkeypatch.setattr(prepare, "trace", bent)
    options = ["--size", "8x8", "--out", tmp_path / "a.png"]
    code, _, err = run("bkd-sim", "render", save(tmp_path), *options)
    assert code == 1 and "ray 5: t " in err


def test_a_truncated_file_is_one_line(run, tmp_path):
    whole = save(tmp_path).read_bytes()
    for size in (0, 10, len(whole) // 2, len(whole) - 10):
        (tmp_path / "cut.npz").write_bytes(whole[:size])
        code, _, err = run("bkd-sim", "info", tmp_path / "cut.npz")
        assert (code, err.count("\n")) == (2, 1) and "cut.npz" in err


def test_frames_of_different_topology_are_one_line(run, tmp_path):
    obj(tmp_path / "a1.obj", "f 1 2 3\nf 1 3 4\n")
    obj(tmp_path / "a2.obj", "f 1 2 3\nf 1 2 4\n")
    code, _, err = run("bkd-sim", "info", tmp_path)
    assert (code, err.count("\n")) == (2, 1) and "a2.obj" in err


@pytest.mark.parametrize(
    "faces",
    [FACES[:1], np.array([[0, 0, 1], [2, 2, 2], [2, 2, 2]]), np.repeat(FACES, 3, axis=0)],
    ids=["one triangle", "degenerate", "duplicate"],
)
def test_legal_oddities_work(faces, run, tmp_path):
    file = save(tmp_path, faces)
    figures = tmp_path / "u.json"
    assert run("bkd-sim", "update", file, "--json", figures)[0] == 0
    result = json.loads(figures.read_text())
    assert result["mismatches"] == 0 and result["triangles"] == len(faces)
    assert result["frames"] == [0, 1, 2]


def test_a_wrong_bound_is_found_and_fails(run, tmp_path, monkeypatch):
    """The command's check can fail: the model is bent, by one ulp of one bound."""
    honest = pose.refit

    def bent(*arguments):
        bounds = honest(*arguments).copy()
        bounds[1, 2] += 1
        return bounds

    monkeypatch.setattr(pose, "refit", bent)
    code, out, err = run("bkd-sim", "update", save(tmp_path), "--frames", "1")
    assert code == 1
    assert "frame 1, node 1, right lo" in err and "1 ulp" in err


def test_a_divided_scene_is_updated_as_the_model_says(run, tmp_path):
    """Eight ships: of the whole program what moves is left, and few words travel."""
    figures = tmp_path / "u.json"
    lengths = []
    for options in ([], ["--divide"]):
        command = "update", "fleet:500", *options, "-c", "two-level", "--frames", "0:3"
        code, out, err = run("bkd-sim", *command, "--json", figures)
        assert (code, err) == (0, "") and max(map(len, out.splitlines())) <= 80
        found = json.loads(figures.read_text())
        assert found["mismatches"] == 0 and len(found["words_sent"]) == 3
        assert "then, a frame" in out
        code, out, _ = run("bkd-sim", "disasm", "fleet:500", *options, "-c", "two-level")
        assert code == 0
        lengths.append(len(out.splitlines()))
    assert lengths[1] < lengths[0] / 10 and found["words_sent"][1:] == [40, 40]
    command = "update", "waves:50", "--divide", "-c", "two-level", "--frames", "0"
    code, out, _ = run("bkd-sim", *command, "--json", figures)
    assert code == 0 and json.loads(figures.read_text())["cycles"] == 0
    assert "then, a frame" not in out


def test_info_and_disasm_agree(run, tmp_path):
    file = save(tmp_path)
    figures = tmp_path / "i.json"
    code, out, _ = run("bkd-sim", "info", file, "--json", figures)
    assert code == 0 and max(map(len, out.split("\n"))) <= 80
    count = json.loads(figures.read_text())["instructions"]
    code, out, _ = run("bkd-sim", "disasm", file)
    assert code == 0
    assert {name: out.count(name) for name in count} == count
    assert count["MERGE3"] == 3 and count["MERGE2"] == 2 and count["LOAD"] == 4


def test_as_a_module_from_another_folder_into_a_pipe(tmp_path):
    command = f"{sys.executable} -m sim disasm waves:5000 | head -n 2"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        command, shell=True, cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0 and done.stderr == ""
    assert len(done.stdout.splitlines()) == 2 and "LOAD" in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize("scene", ["elephant.npz", "walker:80000"])
def test_the_main_job_at_full_size(scene, run, scene_file, tmp_path):
    file = scene_file(scene) if scene.endswith(".npz") else scene
    frames = [] if scene.endswith(".npz") else ["--frames", "0:3"]
    figures = tmp_path / "u.json"
    code, out, _ = run("bkd-sim", "update", file, *frames, "--json", figures)
    assert code == 0 and max(map(len, out.split("\n"))) <= 80
    result = json.loads(figures.read_text())
    assert result["mismatches"] == 0
    assert result["cycles_per_triangle"] <= 2.70
    assert result["loads_per_triangle"] <= 0.57
    work = result["triangles"] * len(result["frames"])
    waits = sum(result["stall_cycles"].values()) / work
    assert np.isclose(
        result["instructions_per_triangle"] + waits, result["cycles_per_triangle"], rtol=1e-12
    )
    assert len(result["sah_ratio"]) == len(result["frames"]) == len(result["cycles_per_frame"])
    assert max(result["sah_ratio"]) < 1.6


@pytest.mark.slow
@pytest.mark.parametrize(("memory", "most"), [("dram", 12.0), ("banks", 10.0)])
def test_a_frame_at_full_size(memory, most, run, scene_file, tmp_path):
    file, figures = scene_file("elephant.npz"), tmp_path / "r.json"
    options = ["--frame", "20", "--memory", memory, "--out", tmp_path / "e.png"]
    code, out, _ = run("bkd-sim", "render", file, *options, "--json", figures)
    assert code == 0 and max(map(len, out.split("\n"))) <= 80
    result = json.loads(figures.read_text())
    assert result["rays"] == 512 * 386
    assert result["model_mismatches"] == result["oracle"]["unexplained"] == 0
    assert result["hit_fraction"] >= 0.40
    assert result["cycles_per_ray"] <= most
    assert result["update_share"] <= 0.15


@pytest.mark.parametrize(
    ("called", "command"),
    [("/usr/bin/bkd-sim", "bkd-sim fit 'my scene.obj'"),
     ("/x/sim/__main__.py", "python -m sim fit 'my scene.obj'")],
)  # fmt: skip
def test_files_say_how_to_make_them_again(called, command, monkeypatch):
    monkeypatch.setattr(sys, "argv", [called, "fit", "my scene.obj"])
    assert command_line() == command


def test_files_are_written_though_nobody_reads_what_is_printed(tmp_path):
    file = save(tmp_path)
    command = f"{sys.executable} -m sim update {file} --json u.json | true; exit ${{PIPESTATUS[0]}}"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(
        ["bash", "-c", command], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert json.loads((tmp_path / "u.json").read_text())["mismatches"] == 0


def test_what_is_no_plain_file_is_written_to_as_it_is(run, tmp_path):
    """A link keeps its target's place; a pipe gets the text."""
    target, link, pipe = (tmp_path / name for name in ("target", "link", "pipe"))
    target.write_text("before")
    link.symlink_to(target)
    assert run("bkd-sim", "info", save(tmp_path), "--json", link)[0] == 0
    assert link.is_symlink() and json.loads(target.read_text())["triangles"] == 3
    os.mkfifo(pipe)
    reader = subprocess.Popen(["cat", pipe], stdout=subprocess.PIPE)
    assert run("bkd-sim", "info", save(tmp_path), "--json", pipe)[0] == 0
    assert json.loads(reader.communicate()[0])["triangles"] == 3 and pipe.is_fifo()


def test_two_files_of_one_name_are_refused(run, tmp_path):
    file = tmp_path / "both.png"
    code, _, err = run("bkd-sim", "render", "waves:50", "--out", file, "--json", file)
    assert code == 2 and "named for two things" in err and not file.exists()
