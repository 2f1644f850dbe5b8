"""`bkd-host play`."""

from pathlib import Path

from rich.table import Table

from host.cli import pictures
from host.cli.meter import Meter
from host.cli.parser import board_of, board_scene_arguments, load, prepare_for
from host.cli.player import PlayReport, play
from host.cli.upload import upload
from sim.command import Parser, size_of
from sim.console import print_tables, table
from sim.files import check_writable, write_json
from sim.options import frame_of, frames_of, json_argument, picture_of, view_arguments
from sim.report.overflow import overflow_text
from sim.report.painter import check_view, painter_for
from sim.report.picture import save
from sim.report.scene_view import camera_and_lamp, check_camera

EXAMPLE = "play walker:2000 --frames 0:24 --out walker.webp"
SIZE = "192x144"
"""Up to 360 kB of hits: a second at 3 Mbaud, or half of one where half of the rays hit."""


def arguments(parser: Parser):
    """Options of the command."""
    board_scene_arguments(parser)
    text = "frames A to B - 1, or one frame; all"
    parser.add_argument("--frames", metavar="A:B", default=":", help=text)
    picture_arguments(parser)


def picture_arguments(parser: Parser):
    """What is shown, and where that goes."""
    view_arguments(parser, SIZE)
    add = parser.add_argument
    text = "picture, animation, or a name without a suffix: a folder; the scene's name .png"
    add("--out", metavar="FILE", type=Path, help=text)
    add("--show", action="store_true", help="open it in the system's viewer")
    json_argument(parser)


def run(options) -> int:
    """Animate a scene on a board: each frame's vertices there, its picture back."""
    return run_frames(options, lambda count: frames_of(options.frames, count))


def run_frame(options) -> int:
    """The same for one frame."""
    return run_frames(options, lambda count: frame_of(options.frame, count))


def run_frames(options, chosen) -> int:
    """Render the frames that are `chosen` of so many."""
    width, height = size_of(options.size, SIZE)
    check_camera(options.camera)
    check_view(options.view, options.divide)
    out: Path = picture_of(options)
    check_writable(options.json)
    if options.show:
        pictures.check_viewer(out)
    with Meter() as meter, board_of(options) as board:
        scene = load(options, meter)
        frames: range = chosen(scene.frames)
        pictures.check_out(out, len(frames))
        prepared = prepare_for(board, scene, options, meter)
        report = PlayReport(
            scene=scene.name,
            port=board.channel.name,
            triangles=len(scene.faces),
            frames=list(frames),
            size=(width, height),
            format=str(board.config.fmt),
            memory_words=board.words,
        )
        meter.step("choosing the view")
        camera, lamp = camera_and_lamp(options.camera, prepared, frames, width, height)
        painter = painter_for(options.view, prepared, lamp)
        folder = pictures.is_folder(out)

        def painted(frame: int):
            if folder:
                pictures.add_to_folder(out, frame, painter.pictures.pop())

        report.upload_seconds = upload(board, prepared, frames[0], meter)
        play(board, camera, painter, report, meter, painted)
        if not folder:
            save(out, painter.pictures, fps=options.fps or 24.0)
    print_tables(_table(report, out, board.clock_hz))
    write_json(options.json, report.as_dict())
    if options.show:
        pictures.show(out)
    return 0


def _table(report: PlayReport, out: Path, clock_hz: int) -> Table:
    """What was rendered."""
    frames = f"{report.frames[0]}" + (f" to {report.frames[-1]}" if report.frames[1:] else "")
    rendered = sum(report.seconds)
    bands = report.bands / len(report.frames)
    updates = f"{report.updates}, of {report.update_cycles:,} cycles" if report.updates else "none"
    rows = [
        ("picture", f"{out}"),
        ("triangles", f"{report.triangles:,}"),
        ("frames", f"{len(report.frames)} ({frames})"),
        ("uploaded in", f"{report.upload_seconds:.2f} s"),
        ("rendered in", f"{rendered:.2f} s: {rendered / len(report.frames):.2f} s a frame"),
        ("updates after the first frame", updates),
        ("numbers that became infinite", overflow_text(report.overflows)),
        ("cycles a ray", f"{report.cast_cycles / report.rays:.2f}"),
        ("rays that hit", f"{report.hit_fraction:.1%}"),
        ("bytes sent, received", f"{report.bytes_sent:,}, {report.bytes_received:,}"),
        ("frames of the link sent again", f"{report.retransmissions:,}"),
    ]
    if bands > 1:
        rows.insert(3, ("parts of a picture that fit the memory", f"{bands:g}"))
    if clock_hz:
        seconds = (report.cast_cycles + report.update_cycles) / clock_hz
        rows.insert(-2, ("seconds that the board worked", f"{seconds:.4f}"))
    width, height = report.size
    return table(f"{report.scene}: {width} x {height} pixels, by the board on {report.port}", rows)
