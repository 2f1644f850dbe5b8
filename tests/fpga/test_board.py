"""The top level that `bkd-fpga build ulx3s` builds, simulated from the pins of the board."""

import os
from dataclasses import replace
from pathlib import Path

import cocotb
import numpy as np
import pytest
from cocotb.clock import Clock
from cocotb.triggers import ValueChange, with_timeout

from fpga.boards import BOARDS
from fpga.content import Show, show
from fpga.project import project
from fpga.tools import run_yosys
from hdl import board as design
from hdl.board import Content
from sim.compiler.rays import HIT_FIELDS, hit_words
from sim.cosim import verilate
from sim.model.rays.traversal import NO_TRIANGLE, trace
from sim.model.refit import refit
from sim.report.pixels import camera_rays

BOARD = BOARDS["ulx3s"]
PINS = Path(__file__).parent / "ulx3s_pins.v"
WARNINGS = "error,ignore::DeprecationWarning:cocotbext.uart.uart"


def verilog_of(shown: Show, folder: Path) -> str:
    """Verilog of the RTLIL that the project of the board gives to synthesis."""
    project(BOARD, shown.content, {}).write(folder)
    passes = ["proc -nomux -norom", "memory_collect", "opt_clean -purge"]
    run_yosys(["read_rtlil top.il", *passes, "write_verilog -norename -noattr top.v"], folder)
    return (folder / "top.v").read_text()


def expected(shown: Show) -> np.ndarray:
    """Hit records (n, limbs) of the model: an update from bounds that are zero, and a camera."""
    prepared, fmt = shown.prepared, BOARD.config.fmt
    order = prepared.image.order
    corners = prepared.coordinates(shown.frame)[prepared.leaf_vertices]
    rays = camera_rays(fmt, shown.view)
    columns = (np.ascontiguousarray(rays.origins), rays.directions, rays.t_min, rays.t_max)
    hits = trace(fmt, order, refit(fmt, order, corners), corners, *columns)
    assert 0.1 < (hits.triangle != NO_TRIANGLE).mean() < 0.9
    return hit_words(BOARD.config, {field: getattr(hits, field) for field in HIT_FIELDS})


def test_one_port_wants_caches():
    content = Content([], 0, 0, 4)
    with pytest.raises(ValueError, match="caches"):
        design.Board(
            replace(BOARD.config, cache_words=0), words=16, content=content, clock_hz=1e8, baud=1e6
        )


@pytest.mark.slow
@pytest.mark.skipif(verilate.simulator() == "icarus", reason="hundreds of times slower")
def test_it_updates_and_renders(tmp_path, seed):
    shown = show(BOARD, "walker:1000", 8, (24, 18))
    picture = tmp_path / "hits"
    picture.write_bytes(expected(shown).astype("<u4").tobytes())
    texts = [PINS.read_text(), verilog_of(shown, tmp_path / "project")]
    work = tmp_path / "run"
    work.mkdir()
    verilate.run(
        verilate.build_text(texts),
        __name__,
        work,
        COCOTB_RANDOM_SEED=seed,
        PYTHONWARNINGS=WARNINGS,
        BKDTREE_HITS=picture,
    )


@cocotb.test()
async def hits_leave_by_the_serial_line(dut):
    """Those of the frame at power-up, and those of a press of the button: the model's."""
    from cocotbext.uart import UartSink

    hits = Path(os.environ["BKDTREE_HITS"]).read_bytes()
    period = 2 * round(1e12 / BOARD.clock_hz / 2)  # ps
    dut.button.value = 0
    line = UartSink(dut.tx, baud=BOARD.baud, bits=8)
    Clock(dut.clock, period, unit="ps", impl="gpi").start()
    for frame in (1, 2):
        received = b""
        while len(received) < len(hits):
            await with_timeout(line.wait(), 20, "ms")
            received += line.read_nowait()
        wrong = [k for k in range(0, len(hits), 16) if received[k : k + 16] != hits[k : k + 16]]
        assert not wrong, f"frame {frame}: {len(wrong)} hits are not the model's: {wrong[:5]}"
        assert len(received) == len(hits)
        while int(dut.led.value) != frame << 2:  # neither running nor sending
            await with_timeout(ValueChange(dut.led), 1, "ms")
        dut.button.value = 1
        await with_timeout(ValueChange(dut.led), 1, "ms")
        assert int(dut.led.value) == frame << 2 | 1, "running"
        dut.button.value = 0
