"""Options that the commands of several folders share, and what they mean."""

import re
from pathlib import Path

from sim.command import Parser
from sim.divide.divided import divide
from sim.errors import InputError
from sim.prepare import prepare
from sim.report.painter import CHOICES
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from sim.tree.build import BUILDERS

SCENE_HELP = (
    "walker, waves, room, fleet, burst, or the stiff propeller, cloth, shock, collapse or "
    "explosion, with a size as in walker:80k; an .npz with faces and vertices; glTF; any mesh "
    "file; a folder or pattern of numbered meshes"
)


def scene_arguments(parser: Parser, default: str | None = None):
    """The scene and its tree; the scene may be left out where it has a default."""
    source_arguments(parser, default)
    parser.add_argument(
        "--builder", choices=BUILDERS, default="sah", help="of the tree; %(default)s"
    )


def source_arguments(parser: Parser, default: str | None = None):
    """The scene alone."""
    add = parser.add_argument
    text = SCENE_HELP + (f"; {default}" if default else "")
    add("scene", metavar="SCENE", help=text, nargs="?" if default else None, default=default)
    add("--fps", metavar="N", type=float, help="glTF: frames a second; 24")
    add("--animation", metavar="NAME", help="glTF: name or number; the first")
    add("--period", metavar="N", type=int, help="walker, ...: frames of a period; 24")


def divide_argument(parser: Parser):
    """How the scene is compiled."""
    text = "part by part: nothing is done for what is still; what moves as a whole is an instance"
    parser.add_argument("--divide", action="store_true", help=text)


def compiler_of(options):
    """What compiles a scene: sim.prepare.prepare, or sim.divide.divided.divide."""
    return divide if options.divide else prepare


def view_arguments(parser: Parser, size: str):
    """What of a scene is shown, and how."""
    add = parser.add_argument
    add("--size", metavar="WxH", default=size, help="in pixels; %(default)s")
    text = "auto: it fills the image; whole: all of it; or ex,ey,ez,tx,ty,tz,fov; %(default)s"
    add("--camera", metavar="C", default="auto", help=text)
    add("--view", choices=CHOICES, default="shaded", help="what is shown; %(default)s")


def json_argument(parser: Parser):
    """A file for the figures."""
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the figures to FILE")


def scene_of(options) -> Scene:
    """The scene that options name."""
    return load_scene(
        options.scene, fps=options.fps, animation=options.animation, period=options.period
    )


def picture_of(options) -> Path:
    """Where the picture goes that options name: a file called like the scene, if they do not."""
    return options.out or Path(f"{Path(options.scene.split(':')[0]).stem}.png")


def frames_of(text: str, count: int, option: str = "--frames") -> range:
    """Frames of A:B, or of one number."""
    match = re.fullmatch(r"(\d*)(:?)(\d*)", text)
    if not match or text == "":
        raise InputError(f"{option} {text}: give A:B for frames A to B - 1, or one frame")
    first = int(match[1] or 0)
    last = int(match[3] or count) if match[2] else first + 1
    chosen = range(first, last)
    if not chosen or chosen[-1] >= count:
        raise InputError(f"{option} {text}: the scene has frames 0 to {count - 1}")
    return chosen


def frame_of(text: str | None, count: int) -> range:
    """The frame of --frame alone; that a third of the way, if it is not given."""
    return frames_of(text or str(count // 3), count, "--frame")
