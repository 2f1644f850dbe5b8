"""The built-in figures by name and size."""

import re
from collections.abc import Callable

from sim.errors import InputError
from sim.scene.builtin.burst import burst
from sim.scene.builtin.cloth import cloth
from sim.scene.builtin.collapse import collapse
from sim.scene.builtin.explosion import explosion
from sim.scene.builtin.fleet import fleet
from sim.scene.builtin.propeller import propeller
from sim.scene.builtin.room import room
from sim.scene.builtin.shock import shock
from sim.scene.builtin.walker import walker
from sim.scene.builtin.waves import waves
from sim.scene.scene import Scene

FIGURES: dict[str, Callable[[str, int, int], Scene]] = {
    "burst": burst,
    "cloth": cloth,
    "collapse": collapse,
    "explosion": explosion,
    "fleet": fleet,
    "propeller": propeller,
    "room": room,
    "shock": shock,
    "walker": walker,
    "waves": waves,
}
DEFAULT_TRIANGLES = 20_000
LARGEST = 10_000_000  # triangles; what a machine with 16 GB can still build and compile


def build_figure(spec: str, frames: int) -> Scene:
    """Build the figure `spec`, such as `walker`, `walker:500`, `walker:80k` or `walker:1M`.

    The mesh has about as many triangles as asked for: from 1000 on within 5 %. One period of the
    motion takes `frames` frames. A figure is a pure function of its name, size and frame.
    """
    name, colon, size = spec.partition(":")
    triangles = parse_size(spec, size) if colon else DEFAULT_TRIANGLES
    if frames < 1:
        raise InputError(f"{spec}: a period of {frames} frames; at least 1 is needed")
    return FIGURES[name](spec, triangles, frames)


def parse_size(spec: str, size: str) -> int:
    """Triangles in `size`: digits, with k for thousands or M for millions."""
    match = re.fullmatch(r"(\d+(?:\.\d+)?)([kKmM]?)", size)
    if not match:
        raise InputError(f"{spec}: '{size}' is no size; write triangles as in walker:80000 or :80k")
    triangles = float(match[1]) * {"": 1, "k": 1e3, "m": 1e6}[match[2].lower()]
    if triangles > LARGEST:
        raise InputError(f"{spec}: {triangles:.10g} triangles are too many; {LARGEST} is the most")
    return round(triangles)
