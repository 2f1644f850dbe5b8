"""`bkd-host verify`."""

from collections.abc import Iterator

import numpy as np

from host import parts
from host.cli.meter import Meter
from host.cli.parser import board_of, board_scene_arguments, load, prepare_for
from host.fit import check_fit
from host.parts import Part
from sim.command import Parser
from sim.console import conclude, table
from sim.files import check_writable
from sim.model.refit import refit
from sim.options import frames_of, json_argument
from sim.prepare import Prepared

EXAMPLE = "verify walker:2000 --frame 8"
NAMES = {
    "program": "words of the program",
    "triangle": "triangles",
    "link of node": "nodes, of which the links",
    "vertex": "vertices",
    "bounds of node": "nodes, of which the bounds",
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
        expected = list(_expected(prepared, frame))
        meter.begin("reading", sum(part.rows.size for part in expected))
        for part in expected:
            found = board.read(part.address, len(part.rows), part.first, part.size, meter.moved)
            differ = np.flatnonzero((found != part.rows).any(axis=1))
            wrong, words[part.name] = wrong + len(differ), len(part.rows)
            shown += [_describe(part, row, found[row]) for row in differ[:SHOWN].tolist()]
    rows = [(NAMES[name], f"{count:,}") for name, count in words.items()]
    rows.append(("of these, words that differ from the model", f"{wrong:,}"))
    title = f"{scene.name}, frame {frame}, on {board.channel.name}"
    figures = {"scene": scene.name, "frame": frame, "words": words, "mismatches": wrong}
    figures["mismatches_shown"] = shown[:SHOWN]
    conclude([table(title, rows)], options.json, figures, shown[:SHOWN])
    return 1 if wrong else 0


def _expected(prepared: Prepared, frame: int) -> Iterator[Part]:
    """All that means something in the memory of the board."""
    image, bits = prepared.image, prepared.coordinates(frame)
    yield from parts.constant_parts(image)
    yield parts.vertex_part(image, bits)
    bounds = refit(image.config.fmt, image.order, bits[prepared.leaf_vertices])
    yield parts.bounds_part(image, bounds)


def _describe(part: Part, row: int, found: np.ndarray) -> str:
    """One line on a word that differs: its bytes, the highest first."""
    got, want = (bytes(raw[::-1]).hex() for raw in (found, part.rows[row]))
    return f"{part.name} {row}, at word {part.address + row}: {got}, not {want}"
