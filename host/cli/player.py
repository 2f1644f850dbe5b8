"""Frames of a scene on a board: updated, rendered and painted, and what that took."""

from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass, field
from time import perf_counter

import numpy as np

from host import parts
from host.cli.meter import Meter
from host.session import Board
from sim.model.rays.traversal import NO_TRIANGLE
from sim.prepare import view_of
from sim.report import pixels
from sim.report.painter import Painter
from sim.scene.camera import Camera


@dataclass
class PlayReport:
    """Figures of frames that a board rendered; a list has one entry a frame.

    Cycles are of the board. `overflows` counts the runs in which numbers became infinite, by the
    places of hdl.core.counters. `seconds` are of all: vertices and jobs to the board, its runs,
    hits back, pictures. Bytes are of the line: with headers, and what was sent twice.
    """

    scene: str
    port: str
    triangles: int
    frames: list[int]
    size: tuple[int, int]
    format: str
    memory_words: int
    upload_seconds: float = 0.0
    seconds: list[float] = field(default_factory=list)
    updates: int = 0
    update_cycles: int = 0
    bands: int = 0
    rays: int = 0
    cast_cycles: int = 0
    hit_fraction: float = 0.0
    overflows: dict[str, int] = field(default_factory=dict)
    bytes_sent: int = 0
    bytes_received: int = 0
    retransmissions: int = 0

    def as_dict(self) -> dict:
        """For a file."""
        return asdict(self)


def play(
    board: Board,
    camera: Camera,
    painter: Painter,
    report: PlayReport,
    meter: Meter,
    painted: Callable[[int], None] = lambda _: None,
):
    """Render the frames of a report in the scene that is on a board; `painted` is told of each."""
    assert board.pose
    image, config = board.pose.image, board.config
    view = view_of(config.fmt, camera)
    rays = pixels.camera_rays(config.fmt, view)
    moving = ("vertex", "row")
    all_vertices = sum(part.bytes for part in parts.parts_of(image) if part.name in moving)
    hit_bytes = len(rays.pixels) * parts.hit_bytes(config)
    meter.begin("rendering", len(report.frames) * (all_vertices + hit_bytes))
    cycles, overflows = Counter(), Counter()
    found = 0

    def ran(counters: dict):
        cast = counters["cast"]
        overflows.update(counters["overflows"])
        cycles.update(cast=cast["steps"] + sum(cast["waits"].values()), bands=1)

    for frame in report.frames:
        meter.step(f"frame {frame}")
        begin, moved = perf_counter(), 0

        def sent(count: int):
            nonlocal moved
            moved += count
            meter.moved(count)

        update = board.show(frame, sent)
        if update:
            cycles.update(update=sum(update.values()), updates=1)
        hits = board.render(view, sent, ran)
        meter.less(all_vertices + hit_bytes - moved)
        pose = board.pose
        seen = pixels.seen_by(camera, pose.vertices, pose.prepared, rays, hits)
        painter.paint(seen, None)
        painted(frame)
        found += int(np.count_nonzero(hits["triangle"] != NO_TRIANGLE))
        report.seconds.append(perf_counter() - begin)
    report.updates, report.update_cycles = cycles["updates"], cycles["update"]
    report.overflows = dict(overflows)
    report.bands, report.cast_cycles = cycles["bands"], cycles["cast"]
    report.rays = len(report.frames) * int((rays.pixels >= 0).sum())
    report.hit_fraction = found / report.rays
    statistics = board.channel.statistics
    report.bytes_sent, report.bytes_received = statistics.bytes_sent, statistics.bytes_received
    report.retransmissions = statistics.retransmissions
