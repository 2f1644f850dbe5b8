"""sim.configuration: files, what is wrong with them, and commands that take them."""

import json
from argparse import Namespace
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hdl.config import CONFIGS, FULL, TINY
from hdl.fp.format import FloatFormat
from sim.compiler.compile import compile_tree
from sim.configuration import config_name, explain, read_config, write_config
from sim.errors import InputError, UnfitError
from sim.model.fp.format import decode, encode
from sim.prepare import COARSEST, ENOUGH, prepare
from sim.scene.load import load_scene
from sim.tree.build import build

ODD = replace(
    TINY, fmt=FloatFormat(8, 23), update=False, camera=False, pointer_bits=9, cache_words=0
)
STILL = replace(FULL, update=False, address_bits=16, pointer_bits=9)
KIND = "bkdtree configuration"


@pytest.mark.parametrize("config", [*CONFIGS.values(), ODD, STILL])
def test_what_is_written_is_read(config, tmp_path):
    file = tmp_path / "a b.json"
    write_config(file, config, {"scene": "elephant", "words": 5})
    assert read_config(str(file)) == config and config_name(str(file)) == "a b"
    content = json.loads(file.read_text())
    assert content[KIND] == 1 and content["about"] == {"scene": "elephant", "words": 5}


def test_names_and_what_a_file_does_not_say(tmp_path):
    assert read_config("tiny") is TINY and config_name("adm-xrc-4lx") == "adm-xrc-4lx"
    file = tmp_path / "few.json"
    file.write_text('{"bkdtree configuration": 1, "config": {"packets": 3, "source": false}}')
    assert read_config(str(file)) == replace(FULL, packets=3, source=False)
    file.write_text('{"bkdtree configuration": 1}')
    assert read_config(str(file)) == FULL


def with_(**values) -> str:
    return json.dumps({KIND: 1, "config": values})


BAD = {
    "text": ("packets = 3", ["no JSON", "line 1"]),
    "list": ("[1]", ["no configuration", KIND]),
    "other": ('{"config": {}}', ["no configuration", KIND]),
    "version": ('{"bkdtree configuration": 2}', [KIND, "is 2", "reads 1"]),
    "part": ('{"bkdtree configuration": 1, "for": 3}', ['"for"', "none of", "about, config"]),
    "about": ('{"bkdtree configuration": 1, "about": "me"}', ['"about"', "braces", '"me"']),
    "config": ('{"bkdtree configuration": 1, "config": [3]}', ['"config"', "braces", "[3]"]),
    "key": (with_(pakets=3), ['"pakets"', "none of fmt", "packets"]),
    "number": (with_(packets="3"), ['"packets"', "whole number", '"3"']),
    "fraction": (with_(packets=3.0), ['"packets"', "whole number", "3.0"]),
    "truth as number": (with_(packets=True), ['"packets"', "whole number", "true"]),
    "number as truth": (with_(update=0), ['"update"', "true or false", "0"]),
    "format": (with_(fmt=24), ['"fmt"', "7,16", "24"]),
    "format text": (with_(fmt="fp24"), ['"fmt"', "7,16", "fp24"]),
    "narrow format": (with_(fmt="1,40"), ['"fmt"', "2 to 10 exponent bits", "1,40"]),
    "wide format": (with_(fmt="9,20"), ["at most 8,23 bits", "9,20"]),
    "range": (with_(packets=33), ["packets is 1 to 32, not 33"]),
    "pointers": (with_(pointer_bits=29), ["pointer_bits is 2 to 28, not 29"]),
    "cache": (with_(cache_words=100), ["cache_words", "power of two", "100"]),
    "no rays": (with_(camera=False, source=False), ["camera", "source"]),
}


@pytest.mark.parametrize("case", BAD)
def test_what_is_wrong_is_named(case, run, tmp_path):
    text, words = BAD[case]
    file = tmp_path / "bad.json"
    file.write_text(text)
    with pytest.raises(InputError) as caught:
        read_config(str(file))
    assert str(caught.value).startswith(f"{file}: ")
    assert all(word in str(caught.value) for word in words), caught.value
    for command in (["bkd-sim", "info", "waves:50"], ["bkd-fpga", "verilog"]):
        code, out, err = run(*command, "-c", file)
        assert (code, out, err.count("\n")) == (2, "", 1) and str(file) in err


def test_files_that_are_none(tmp_path):
    with pytest.raises(InputError, match=r"huge: no such configuration; give tiny.*or a file"):
        read_config("huge")
    with pytest.raises(InputError, match="directory"):
        read_config(str(tmp_path))
    (tmp_path / "x").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="no JSON"):
        read_config(str(tmp_path / "x"))


@pytest.fixture
def still(tmp_path):
    file = tmp_path / "still.json"
    write_config(file, STILL, {})
    return file


def test_options_override_a_file(run, still, tmp_path):
    figures = tmp_path / "i.json"
    for options, fmt in (([], "7,16"), (["--format", "6,10"], "6,10")):
        code, out, _ = run("bkd-sim", "info", "waves:50", "-c", still, *options, "--json", figures)
        found = json.loads(figures.read_text())
        assert code == 0 and found["format"] == fmt and "instructions" not in out
        assert found["memory_words"]["program"] == 0


REFUSED = {
    "update": (["update", "waves:50"], STILL, ["no update processor", "update true"]),
    "disasm": (["disasm", "waves:50"], STILL, ["no update processor"]),
    "frames": (
        ["render", "waves:50", "--frames", "0:2", "--size", "8x8"],
        STILL,
        ["frame 1", "update true"],
    ),
    "shadows": (
        ["render", "waves:50", "--frame", "2", "--shadows"],
        replace(STILL, source=False),
        ["from memory", "source true"],
    ),
    "camera": (["render", "waves:50"], replace(STILL, camera=False), ["camera true"]),
    "levels": (
        ["render", "waves:50", "--size", "8x8"],
        replace(STILL, stack_depth=3),
        ["stack_depth has to be", "holds 3"],
    ),
    "words": (
        ["info", "waves:50"],
        replace(STILL, address_bits=6),
        ["address_bits is 6 and has to be 8"],
    ),
    "triangles": (
        ["info", "waves:50"],
        replace(STILL, pointer_bits=5),
        ["50 triangles", "pointer_bits is 5 and has to be 6"],
    ),
    "boxes": (["info", "waves:50"], replace(FULL, box_registers=2), ["box_registers is 2 and has"]),
    "format": (
        ["render", "waves:50", "--size", "1x1"],
        replace(STILL, fmt=FloatFormat(3, 2)),
        ["format 3,2 is too narrow", "4,2 is enough"],
    ),
    "pixels": (
        ["render", "waves:50", "--size", "4x4"],
        replace(STILL, fmt=FloatFormat(3, 2)),
        ["format 3,2 is too narrow", "a pixel's step", "more exponent bits"],
    ),
}


@pytest.mark.parametrize(
    ("about", "told"),
    [
        (
            {"scene": "a.glb", "size": [8, 6]},
            " (m.json was fitted to a.glb, with --divide, at 8x6)",
        ),
        ({"scene": "a.glb", "size": 8}, " (m.json)"),
        ({"scene": "a.glb", "size": ["8", 6]}, " (m.json)"),
        ({"size": [8, 6]}, " (m.json)"),
    ],
)
def test_what_it_was_fitted_to_is_said_if_the_file_says_it(about, told, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    write_config(Path("m.json"), STILL, about)
    assert explain(Namespace(config="m.json"), UnfitError("too small")) == told
    assert explain(Namespace(config="m.json"), InputError("no such file")) == ""
    assert explain(Namespace(config="full"), UnfitError("too small")) == ""


@pytest.mark.parametrize("case", REFUSED)
def test_what_a_machine_cannot_do_is_one_line(case, run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    command, config, words = REFUSED[case]
    write_config(tmp_path / "c.json", config, {})
    code, out, err = run("bkd-sim", *command, "-c", "c.json")
    assert (code, out, err.count("\n")) == (2, "", 1), err
    assert all(word in err for word in words), err
    assert [file.name for file in tmp_path.iterdir()] == ["c.json"]


def test_no_format_as_wide_as_that_which_is_enough_moves_vertices_far():
    exact = np.linspace(-1, 1, 100_001)
    for bits in ((4, 2), (4, 3), (5, 2), (8, 23)):
        fmt = FloatFormat(*bits)
        assert np.abs(decode(fmt, encode(fmt, exact)) - exact).max() <= COARSEST
    fmt = FloatFormat(3, 2)
    assert str(ENOUGH) == "4,2" and np.abs(decode(fmt, encode(fmt, exact)) - exact).max() > COARSEST


def test_without_update_there_is_no_program_and_the_rest_is_the_same(rng):
    scene = load_scene("waves:50")
    tree = build(scene.pose(0)[None], scene.faces)
    whole, still = (compile_tree(tree, scene.faces, config) for config in (FULL, STILL))
    assert not len(still.instructions) and still.vertices_at == 0
    assert still.size == whole.size - whole.vertices_at and still.nodes == whole.nodes
    assert (scene.faces[still.order.triangles] == still.vertices[still.corners]).all()
    assert sorted(still.vertices) == sorted(whole.vertices)
    first = [still.corners.ravel().tolist().index(k) for k in range(len(still.vertices))]
    assert first == sorted(first), "in the order of their use"
    prepared = prepare(scene, replace(FULL, update=False, box_registers=2))
    assert prepared.image.nodes == 49, "no box registers are needed"


@pytest.mark.parametrize(("triangles", "bits"), [(2, 2), (3, 2), (4, 3), (7, 3), (8, 4)])
def test_pointers_name_every_triangle_but_one(triangles, bits):
    faces = np.arange(3 * triangles, dtype=np.int32).reshape(-1, 3)
    tree = build(np.random.default_rng(1).normal(size=(1, 3 * triangles, 3)), faces)
    assert compile_tree(tree, faces, replace(FULL, pointer_bits=bits)).corners.shape[0] == triangles
    if bits > 2:
        with pytest.raises(InputError, match=f"pointer_bits is {bits - 1} and has to be {bits}"):
            compile_tree(tree, faces, replace(FULL, pointer_bits=bits - 1))
