"""`bkd-host upload`."""

from time import perf_counter

from host import parts
from host.cli.meter import Meter
from host.cli.parser import board_of, board_scene_arguments, load, prepare_for
from host.session import Board
from sim.command import Parser
from sim.console import print_tables, table
from sim.files import check_writable, write_json
from sim.options import frames_of, json_argument
from sim.prepare import Prepared

EXAMPLE = "upload walker:2000 --frame 8"


def arguments(parser: Parser):
    """Options of the command."""
    board_scene_arguments(parser)
    parser.add_argument("--frame", metavar="K", default="0", help="its pose; %(default)s")
    json_argument(parser)


def run(options) -> int:
    """Bring a scene to a board, in the pose of a frame."""
    check_writable(options.json)
    with Meter() as meter, board_of(options) as board:
        scene = load(options, meter)
        frame = frames_of(options.frame, scene.frames, "--frame")[0]
        prepared = prepare_for(board, scene, options, meter)
        seconds = upload(board, prepared, frame, meter)
        statistics = board.channel.statistics
    moved = parts.upload_bytes(prepared.image)
    figures = {
        "scene": prepared.scene.name,
        "triangles": len(scene.faces),
        "frame": frame,
        "words": prepared.image.size,
        "memory_words": board.words,
        "bytes": moved,
        "seconds": seconds,
        "bytes_per_second": moved / seconds,
        "retransmissions": statistics.retransmissions,
    }
    rows = [
        ("triangles", f"{figures['triangles']:,}"),
        ("memory words", f"{prepared.image.size:,} of {board.words:,}"),
        ("bytes", f"{moved:,}"),
        ("in", f"{seconds:.2f} s: {moved / seconds:,.0f} bytes a second"),
        ("frames sent again", f"{statistics.retransmissions:,}"),
    ]
    print_tables(table(f"{prepared.scene.name}, frame {frame}, to {board.channel.name}", rows))
    write_json(options.json, figures)
    return 0


def upload(board: Board, prepared: Prepared, frame: int, meter: Meter) -> float:
    """Bring a scene to a board; the seconds that it took."""
    meter.begin("uploading", parts.upload_bytes(prepared.image))
    begin = perf_counter()
    board.upload(prepared, frame, meter.moved)
    return perf_counter() - begin
