"""sim.compiler.cycles against the Verilog, where registers are plenty and where they are few."""

from dataclasses import replace

import pytest

from hdl.config import FULL
from sim.compiler.cycles import cycles
from sim.cosim.machine import Machine, Timing
from sim.cosim.verilate import simulator
from sim.prepare import prepare
from sim.scene.load import load_scene
from tests.sim.compiler.programs import load, merge2, merge3, node, words_of


def test_waits_are_those_of_the_operands():
    loading, merging = FULL.load_latency, FULL.box_latency
    for program, expected in [
        ([], 0),
        ([load(0, 7), load(1, 7)], 2),
        ([load(0, 7), merge3(0, 0, 0, 0)], loading + 1),
        ([load(0, 7), node(3), merge3(0, 0, 0, 0)], loading + 1),
        ([load(0, 7), merge3(0, 0, 0, 0), merge2(0, 0, 0, 1)], loading + merging + 1),
    ]:
        assert cycles(FULL, words_of(program)) == expected, program


@pytest.mark.skipif(simulator() == "icarus", reason="a hundred thousand cycles")
@pytest.mark.parametrize("scene", ["walker:2000", "burst:1000"])
@pytest.mark.parametrize("registers", [64, 4])
def test_near_what_the_verilog_takes(scene, registers):
    config = replace(FULL, vertex_registers=registers)
    prepared = prepare(load_scene(scene), config)
    image = prepared.image
    with Machine(config, image.size, Timing(config.latency)) as machine:
        machine.write(0, image.constant_words())
        machine.write(image.vertices_at, image.vertex_words(prepared.coordinates(0)))
        length = len(image.instructions)
        measured = machine.update(0, length, image.vertices_at, image.nodes_at)
    estimate = cycles(config, image.instructions)
    assert estimate <= sum(measured.values()) <= 1.08 * estimate + 100
    if registers == 64:
        assert estimate < 1.05 * length
