"""sim.study.fit and bkd-sim fit: the smallest machine that a scene needs."""

import json
from dataclasses import replace

import pytest

from hdl.config import TWO_LEVEL, Config
from hdl.fp.format import F24, FloatFormat
from sim.cli.fit import EXAMPLE
from sim.compiler.cycles import cycles as program_cycles
from sim.configuration import read_config
from sim.divide.divided import divide
from sim.errors import InputError
from sim.parts.analyse import analyse
from sim.pose import pose_of
from sim.prepare import view_of
from sim.report.pixels import camera_rays
from sim.scene.camera import auto
from sim.scene.load import load_scene
from sim.scene.normalise import normalise
from sim.study.fit import REACHED, Tried, fit, frame_cycles, narrowest

SIZE = (48, 36)
FORMATS = [FloatFormat(4, 9), FloatFormat(5, 12), F24]


def fitted(spec: str, **kept) -> Config:
    scene = load_scene(spec)
    return fit(divide(scene, TWO_LEVEL), SIZE, **{"camera": True, "source": False, **kept})


def test_units_that_are_not_needed_are_left_out(scene_file):
    still = fitted(str(scene_file("CornellBox.glb")))
    assert not (still.update or still.instances or still.source) and still.camera
    assert still.cache_words <= 64 and still.pointer_bits == 6 and still.stack_depth <= 10
    ships = fitted("fleet:2000", source=True)
    assert ships.update and ships.instances and ships.source
    assert ships.box_registers <= 12 < ships.stack_depth
    walker = fitted("walker:500")
    assert walker.update and not walker.instances and walker.vertex_registers < 64


@pytest.mark.parametrize("spec", ["fleet:500", "room:500", "waves:300"])
def test_the_fitted_machine_holds_the_scene(spec):
    scene, config = load_scene(spec), fitted(spec)
    prepared = divide(scene, config)
    prepared.image.check_fits(prepared.image.size + SIZE[0] * SIZE[1])
    whole = divide(scene, TWO_LEVEL)
    spent, least = (program_cycles(of.config, of.image.instructions) for of in (prepared, whole))
    assert spent <= 1.03 * least
    with pytest.raises(InputError, match="memory words .* addresses"):
        divide(scene, replace(config, address_bits=config.address_bits - 4))


@pytest.mark.parametrize("spec", ["fleet:500", "room:500", "burst:200"])
def test_it_sees_what_the_full_machine_sees(spec):
    """Bit for bit, in one format, of a scene that is divided for both."""
    scene = load_scene(spec)
    images = []
    for machine in (TWO_LEVEL, fitted(spec)):
        prepared = divide(scene, machine)
        pose = pose_of(prepared, prepared.frames[7])
        camera = auto(prepared.scene.pose(7)[None], scene.faces, *SIZE)
        rays = camera_rays(F24, view_of(F24, camera))
        hits = pose.prepared.trace(pose.bits, pose.rows, pose.bounds, rays).fields(machine)
        images.append([pose.prepared.surfaces(hits), *(hits[name] for name in "tuv")])
    assert (images[0][0] >= 0).mean() > 0.05
    assert all((full == small).all() for full, small in zip(*images, strict=True))


def test_trees_of_all_frames_fit():
    """Parts that fly apart get new trees, and the machine holds them all."""
    config = fitted("burst:300")
    prepared, seen = divide(load_scene("burst:300"), config), set()
    for frame in prepared.frames:
        prepared = pose_of(prepared, frame).prepared
        assert prepared.levels <= config.stack_depth
        seen.add(prepared.levels)
    assert max(seen) == config.stack_depth and len(seen) > 1


def test_another_scene_is_refused_with_the_reason(scene_file):
    still = fitted(str(scene_file("CornellBox.glb")))
    with pytest.raises(InputError, match="pointer_bits is 6 and has to be"):
        divide(load_scene("walker:500"), still)
    small = fitted("waves:100")
    with pytest.raises(InputError, match="pointer_bits is 7 and has to be 10"):
        divide(load_scene("waves:1000"), small)
    wide = replace(small, pointer_bits=28, address_bits=28)
    with pytest.raises(InputError, match="box_registers is 8 and has to be"):
        divide(load_scene("waves:1000"), wide)


def test_the_format_of_fewest_bits_that_is_enough():
    scene = load_scene("waves:300")
    analysis = analyse(normalise(scene).scene)
    chosen, tried = narrowest(scene, analysis, FORMATS, 0.05, SIZE)
    assert chosen == FORMATS[1] and {of.fmt for of in tried} >= {FORMATS[0], FORMATS[1]}
    refused = next(of for of in tried if of.fmt == FORMATS[0])
    assert refused.wrong is None and "pixel's step" in refused.reason
    assert narrowest(scene, analysis, FORMATS, 0.004, SIZE)[0] == F24
    with pytest.raises(InputError, match=r"no format errs in a share of 1e-09 .* the least is"):
        narrowest(scene, analysis, FORMATS[:2], 1e-9, SIZE)


def test_command(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    options = ["--formats", "5,12", "7,16", "--size", "48x36", "-o", "m.json", "--json", "f.json"]
    code, out, err = run("bkd-sim", "fit", "waves:300", *options)
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80 and "left out" in out
    config = read_config("m.json")
    assert config.update and not config.instances and not config.source and config.folded
    figures = json.loads((tmp_path / "f.json").read_text())
    assert figures["about"]["scene"] == "waves:300" and figures["formats"][0]["wrong"] > 0
    assert EXAMPLE.startswith("fit ")
    rates = figures["images_per_second"]
    wanted = (rates["folded"] + rates["all units"]) / 2
    for rate, words in [
        (wanted, "all units are there"),
        (1e9, "1,000,000,000 are wanted, and these are all"),
    ]:
        code, out, _ = run("bkd-sim", "fit", "waves:300", *options, "--rate", rate)
        assert code == 0 and words in " ".join(out.split()) and not read_config("m.json").folded


def test_ways_of_rays(run, tmp_path):
    """From a camera, from memory, or from both: what is not asked for is left out."""
    file = tmp_path / "m.json"
    options = ["--formats", "7,16", "--size", "16x12", "--error", "0.1", "-o", file]
    for option, camera, source in (
        ([], True, False),
        (["--shadows"], True, True),
        (["--no-camera"], False, True),
    ):
        code, out, _ = run("bkd-sim", "fit", "waves:100", *options, *option)
        config = read_config(str(file))
        assert (code, config.camera, config.source) == (0, camera, source)
        words = " ".join(out.split()).partition("left out: ")[2].partition(".")[0]
        assert ("camera" in words, "rays from memory" in words) == (not camera, not source)
    code, _, err = run("bkd-sim", "fit", "waves:100", "--shadows", "--no-camera")
    assert code == 2 and "not allowed with" in err


def test_the_busiest_unit_says_how_long_an_image_takes():
    prepared = divide(load_scene("waves:300"), TWO_LEVEL)
    update = program_cycles(prepared.config, prepared.image.instructions)
    work = {"steps": 700, "tests": 100, "ray_tests": 300, "entries": 0}
    for changes, whole, folded in [
        ({}, 700, 1400),
        ({"tests": 200}, 800, 1400),
        ({"ray_tests": 900}, 900, 2700),
        ({"entries": 200}, 2400, 2400),
    ]:
        tried = Tried(F24, 0.0, work=[work, work | changes])
        for fold, cycles in ((False, whole), (True, folded)):
            found = frame_cycles(prepared, tried, fold, shadows=False)
            assert found == pytest.approx(update + cycles / REACHED)
            again = frame_cycles(prepared, tried, fold, shadows=True)
            assert again == pytest.approx(update + 2 * cycles / REACHED)


def test_some_frames_only(run, tmp_path, monkeypatch):
    """Of a room whose frames 3 to 5 are shown: formats and trees are tried on these."""
    monkeypatch.chdir(tmp_path)
    options = ["--size", "32x24", "--formats", "7,16", "--error", "0.1", "-o", "m.json"]
    code, out, err = run("bkd-sim", "fit", "room:500", "--frames", "3:6", *options)
    assert (code, err) == (0, "") and read_config("m.json").instances
    render = ["render", "room:500", "--divide", "-c", "m.json", "--size", "32x24", "--frame", "4"]
    assert run("bkd-sim", *render, "--out", "a.png")[0] == 0
    code, _, err = run("bkd-sim", "render", "walker:500", "-c", "m.json", "--size", "32x24")
    assert code == 2 and err.endswith("(m.json was fitted to room:500, with --divide, at 32x24)\n")


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["waves:300", "--error", "2"], ["--error 2", "0 to 1"]),
        (["waves:300", "--error", "0", "--formats", "5,10"], ["no format"]),
        (["waves:300", "--formats", "9,30"], ["9,30", "8,23"]),
        (["waves:300", "--formats", "abc"], ["--formats abc", "7,16"]),
        (["waves:300", "--error", "0", "--formats", "2,1"], ["no format", "2,1: "]),
        (["waves:300", "--rate", "0"], ["--rate 0", "above 0"]),
        (["waves:300", "--clock", "inf"], ["--clock inf", "above 0"]),
        (["none.npz"], ["none.npz"]),
        (["waves:300", "-o", "no/such.json"], ["no/such.json"]),
    ],
)
def test_bad_input_is_one_line_and_no_file(options, words, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, out, err = run("bkd-sim", "fit", *options)
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert all(word in err for word in words), err
    assert not list(tmp_path.iterdir())
