"""`bkd-host verify`."""

import numpy as np

from host import parts
from host.cli.meter import Meter
from host.cli.parser import board_of, board_scene_arguments, load, prepare_for
from host.fit import check_fit
from host.parts import Part
from sim.command import Parser
from sim.console import conclude, table
from sim.files import check_writable
from sim.options import frames_of, json_argument
from sim.pose import pose_of

EXAMPLE = "verify walker:2000 --frame 8"
NAMES = {
    "program": "words of the program",
    "triangle": "triangles",
    "link of node": "nodes, of which the links",
    "vertex": "vertices",
    parts.BOUNDS: "nodes, of which the bounds",
    "row": "rows of instances",
    "corner": "corners of boxes that stand still",
}
SHOWN = 10
"""Words that differ and are shown."""


def arguments(parser: Parser):
    """Options of the command."""
    board_scene_arguments(parser)
    text = "the pose it was uploaded in, or shown in last; %(default)s"
    parser.add_argument("--frame", metavar="K", default="0", help=text)
    json_argument(parser)


def run(options) -> int:
    """Read a scene back from a board, and compare every byte with the model's."""
    check_writable(options.json)
    wrong, shown, words = 0, [], {}
    with Meter() as meter, board_of(options) as board:
        scene = load(options, meter)
        frame = frames_of(options.frame, scene.frames, "--frame")[0]
        prepared = prepare_for(board, scene, options, meter)
        check_fit(prepared, board.config, board.words)
        pose = pose_of(prepared, frame)
        all_parts = list(parts.parts_of(pose.image))
        meter.begin("reading", sum(part.bytes for part in all_parts))
        for part in all_parts:
            at, expected = part.words, part.rows(pose.words)
            found = board.read(at.start, len(at), part.first, part.size, meter.moved)
            differ = np.flatnonzero((found != expected).any(axis=1))
            wrong, words[part.name] = wrong + len(differ), len(at)
            shown += [
                _describe(part, row, found[row], expected[row]) for row in differ[:SHOWN].tolist()
            ]
    rows = [(NAMES[name], f"{count:,}") for name, count in words.items()]
    rows.append(("of these, words that differ from the model", f"{wrong:,}"))
    title = f"{scene.name}, frame {frame}, on {board.channel.name}"
    figures = {"scene": scene.name, "frame": frame, "words": words, "mismatches": wrong}
    figures["mismatches_shown"] = shown[:SHOWN]
    conclude([table(title, rows)], options.json, figures, shown[:SHOWN])
    return 1 if wrong else 0


def _describe(part: Part, row: int, found: np.ndarray, expected: np.ndarray) -> str:
    """One line on a word that differs: its bytes, the highest first."""
    got, want = (bytes(raw[::-1]).hex() for raw in (found, expected))
    return f"{part.name} {row}, at word {part.words[row]}: {got}, not {want}"
