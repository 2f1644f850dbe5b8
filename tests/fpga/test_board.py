"""The top level that `bkd-fpga build ulx3s` builds, simulated from the pins of the board."""

from pathlib import Path

import numpy as np
import pytest
from amaranth import ClockSignal, Instance, Module, ResetSignal
from amaranth.lib import wiring
from amaranth.lib.wiring import In, Out

from fpga.boards import BOARDS
from fpga.project import project
from fpga.tools import run_yosys
from hdl.rays.packet import NO_TRIANGLE
from host.link.channel import Channel
from host.link.errors import SessionLost
from host.session import Board
from sim.cosim import verilate
from sim.cosim.board import SimulatedBoard
from sim.cosim.board_bench import PinsBench
from sim.model.rays.traversal import trace
from sim.model.refit import refit
from sim.prepare import Prepared, prepare, view_of
from sim.report.pixels import camera_rays
from sim.scene.camera import auto
from sim.scene.load import load_scene
from tests.host.simulated import SimulatedPipe

BOARD = BOARDS["ulx3s"]
PINS = Path(__file__).parent / "ulx3s_pins.v"


class Pins(wiring.Component):
    """The board by its pins; its button is the reset of the bench."""

    def __init__(self):
        super().__init__({"rx": In(1, init=1), "tx": Out(1), "busy": Out(1), "led": Out(8)})

    def elaborate(self, platform):
        m = Module()
        m.submodules.board = Instance(
            "ulx3s_pins",
            i_clock=ClockSignal(),
            i_button=ResetSignal(),
            i_rx=self.rx,
            o_tx=self.tx,
            o_led=self.led,
        )
        m.d.comb += self.busy.eq(self.led[0])
        return m


def verilog_of(folder: Path) -> Path:
    """Verilog of the RTLIL that the project of the board gives to synthesis."""
    project(BOARD, {}).write(folder)
    passes = ["proc -nomux -norom", "memory_collect", "opt_clean -purge"]
    run_yosys(["read_rtlil top.il", *passes, "write_verilog -norename -noattr top.v"], folder)
    return folder / "top.v"


def expected(prepared: Prepared, view, frame: int) -> dict[str, np.ndarray]:
    """Hits of the model."""
    fmt, order = BOARD.config.fmt, prepared.image.order
    corners = prepared.coordinates(frame)[prepared.leaf_vertices]
    rays = camera_rays(fmt, view)
    columns = (np.ascontiguousarray(rays.origins), rays.directions, rays.t_min, rays.t_max)
    hits = trace(fmt, order, refit(fmt, order, corners), corners, *columns)
    assert 0.1 < (hits.triangle != NO_TRIANGLE).mean() < 0.9
    return {name: getattr(hits, name) for name in ("t", "u", "v", "triangle")}


@pytest.mark.slow
@pytest.mark.skipif(verilate.simulator() == "icarus", reason="hundreds of times slower")
def test_a_host_updates_and_renders(tmp_path):
    """By the pins; and the button makes the board forget its host, but not its memory."""
    sources = [PINS, verilog_of(tmp_path / "project")]
    bench = PinsBench(Pins(), BOARD.clock_hz / BOARD.baud)
    with SimulatedBoard(BOARD.config, bench=bench, sources=sources) as simulated:
        pipe = SimulatedPipe(simulated)  # no load of this machine makes it late
        board = Board(Channel(pipe, clock=pipe.clock))
        assert (board.config, board.words) == (BOARD.config, BOARD.words)
        assert board.clock_hz == BOARD.clock_hz
        prepared = prepare(load_scene("walker:500"), board.config)
        pose = prepared.scene.pose(8)[None]
        view = view_of(board.config.fmt, auto(pose, prepared.scene.faces, 24, 18))
        board.upload(prepared)
        for frame in (8, 15):
            assert board.show(frame)
            found, want = board.render(view), expected(prepared, view, frame)
            assert all((found[name] == want[name]).all() for name in want)
        simulated.reset()
        words = prepared.image.nodes_at, prepared.image.nodes
        with pytest.raises(SessionLost):
            board.read(*words)
        found = np.ascontiguousarray(board.read(*words)).view("<u4")
        bounds = prepared.image.bounds_of(found)
        corners = prepared.coordinates(15)[prepared.leaf_vertices]
        assert (bounds == refit(board.config.fmt, prepared.image.order, corners)).all()
