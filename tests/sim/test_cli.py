"""bkd-sim as its users run it: real commands, bad input, pipes."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from sim.cli import main

FACES = np.array([[0, 1, 2], [0, 2, 3], [3, 2, 1]], np.int32)
POINTS = np.random.default_rng(1).normal(size=(3, 4, 3))


def run(monkeypatch, capsys, *arguments) -> tuple[int, str, str]:
    """Exit code, standard output and standard error of a command."""
    monkeypatch.setattr(sys, "argv", ["bkd-sim", *map(str, arguments)])
    with pytest.raises(SystemExit) as end:
        main()
    code = end.value.code
    assert isinstance(code, int)
    return (code, *capsys.readouterr())


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
def test_bad_input_is_one_line_and_no_file(case, tmp_path, monkeypatch, capsys):
    arguments, words = BAD[case]
    arguments = arguments(tmp_path)
    if "--json" not in arguments:
        arguments = [*arguments, "--json", tmp_path / "u.json"]
    before = sorted(tmp_path.iterdir())
    code, out, err = run(monkeypatch, capsys, "update", *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert err.startswith("bkd-sim: ") and all(word in err for word in words), err
    assert sorted(tmp_path.iterdir()) == before


def test_a_truncated_file_is_one_line(tmp_path, monkeypatch, capsys):
    whole = save(tmp_path).read_bytes()
    for size in (0, 10, len(whole) // 2, len(whole) - 10):
        (tmp_path / "cut.npz").write_bytes(whole[:size])
        code, _, err = run(monkeypatch, capsys, "info", tmp_path / "cut.npz")
        assert (code, err.count("\n")) == (2, 1) and "cut.npz" in err


def test_frames_of_different_topology_are_one_line(tmp_path, monkeypatch, capsys):
    obj(tmp_path / "a1.obj", "f 1 2 3\nf 1 3 4\n")
    obj(tmp_path / "a2.obj", "f 1 2 3\nf 1 2 4\n")
    code, _, err = run(monkeypatch, capsys, "info", tmp_path)
    assert (code, err.count("\n")) == (2, 1) and "a2.obj" in err


@pytest.mark.parametrize(
    "faces",
    [FACES[:1], np.array([[0, 0, 1], [2, 2, 2], [2, 2, 2]]), np.repeat(FACES, 3, axis=0)],
    ids=["one triangle", "degenerate", "duplicate"],
)
def test_legal_oddities_work(faces, tmp_path, monkeypatch, capsys):
    file = save(tmp_path, faces)
    figures = tmp_path / "u.json"
    assert run(monkeypatch, capsys, "update", file, "--json", figures)[0] == 0
    result = json.loads(figures.read_text())
    assert result["mismatches"] == 0 and result["triangles"] == len(faces)
    assert result["frames"] == [0, 1, 2]


def test_a_wrong_bound_is_found_and_fails(tmp_path, monkeypatch, capsys):
    """The command's check can fail: the model is bent, by one ulp of one bound."""
    import sim.report.update as report

    honest = report.refit

    def bent(*arguments):
        bounds = honest(*arguments).copy()
        bounds[1, 2] += 1
        return bounds

    monkeypatch.setattr(report, "refit", bent)
    code, out, err = run(monkeypatch, capsys, "update", save(tmp_path), "--frames", "1")
    assert code == 1
    assert "frame 1, node 1, right lo" in err and "1 ulp" in err


def test_info_and_disasm_agree(tmp_path, monkeypatch, capsys):
    file = save(tmp_path)
    figures = tmp_path / "i.json"
    code, out, _ = run(monkeypatch, capsys, "info", file, "--json", figures)
    assert code == 0 and max(map(len, out.split("\n"))) <= 80
    count = json.loads(figures.read_text())["instructions"]
    code, out, _ = run(monkeypatch, capsys, "disasm", file)
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
def test_the_main_job_at_full_size(scene, scene_file, tmp_path, monkeypatch, capsys):
    file = scene_file(scene) if scene.endswith(".npz") else scene
    frames = [] if scene.endswith(".npz") else ["--frames", "0:3"]
    figures = tmp_path / "u.json"
    code, out, _ = run(monkeypatch, capsys, "update", file, *frames, "--json", figures)
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
    assert result["sah_ratio"][0] == 1.0
