"""Scenes and cameras as fields of a job, rays and hits as memory words."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from hdl.config import FULL, Config
from hdl.fp.format import FloatFormat
from hdl.rays.packet import hit, margin, pixel_bits, ray_word
from hdl.records import vertex, word_bits
from sim.compiler import fields
from sim.compiler.image import Image
from sim.errors import InputError, UnfitError

HIT_FIELDS = tuple(name for name, _ in hit(FULL))
"""Of a hit record without instances."""


@dataclass(frozen=True)
class View:
    """A camera in bit patterns, as hdl.rays.camera takes it.

    Attributes
    ----------
    origin, corner, right, down : (3,) int64
    width, height : int
    t_min, t_max : int
    top : int
        Its first row, an even one: those above are not cast.
    """

    origin: np.ndarray
    corner: np.ndarray
    right: np.ndarray
    down: np.ndarray
    width: int
    height: int
    t_min: int
    t_max: int
    top: int = 0

    @property
    def packets(self) -> int:
        """Packets of 2 x 2 pixels."""
        return -(-self.width // 2) * -(-(self.height - self.top) // 2)

    def bands(self, packets: int) -> Iterator["View"]:
        """The view in parts of whole rows, of no more packets each, or of one row of packets."""
        rows = 2 * max(1, packets // -(-self.width // 2))
        for top in range(self.top, self.height, rows):
            yield replace(self, top=top, height=min(top + rows, self.height))


def check_ray_format(fmt: FloatFormat):
    """Refuse a format in which no ray can be cast.

    Raises
    ------
    InputError
        Says which are wide enough.
    """
    try:
        _ = fmt.difference  # which the triangle test asks for
    except ValueError as error:
        raise InputError(f"{error}, so rays cannot be cast; use more exponent bits") from error


def check_image(fmt: FloatFormat, width: int, height: int):
    """Refuse an image of which a format does not count each column and row exactly.

    Raises
    ------
    InputError
        Says how many it counts.
    """
    most = (1 << pixel_bits(fmt)) - 1
    if not (1 <= width <= most and 1 <= height <= most):
        raise InputError(
            f"an image of {width} x {height} pixels: with format {fmt} the camera counts 1 to "
            f"{most} columns and rows"
        )


def scene_fields(image: Image, wider: int | None = None) -> dict:
    """Where the rays of a job find a scene whose image lies at word 0.

    `wider` is the pattern of a margin larger than that which rounding asks for.
    """
    fmt = image.config.fmt
    return {
        "vertices": image.vertices_at,
        "triangles": image.triangles_at,
        "nodes": image.nodes_at,
        "root": image.world - 1,
        "margin": margin(fmt) if wider is None else fmt.layout.from_bits(wider),
    }


def image_fields(config: Config, view: View) -> dict:
    """Fields of hdl.rays.camera.image, for an image that `check_image` passes."""

    def number(bits):
        return config.fmt.layout.from_bits(int(bits))

    vectors = {
        name: dict(zip("xyz", map(number, getattr(view, name)), strict=True))
        for name in ("origin", "corner", "right", "down")
    }
    limits = {"t_min": number(view.t_min), "t_max": number(view.t_max)}
    pixels = {"width": view.width, "height": view.height, "top": view.top}
    return {**vectors, **pixels, **limits}


def camera_fields(config: Config, view: View) -> dict:
    """Fields of hdl.rays.caster.cast_job for the rays of a camera.

    Raises
    ------
    InputError
        The machine has no camera.
    """
    check_rays(config, camera=True)
    return {**({"camera": 1} if config.source else {}), "image": image_fields(config, view)}


def memory_fields(config: Config, address: int, packets: int) -> dict:
    """Fields of hdl.rays.caster.cast_job for packets of rays that lie in memory.

    Raises
    ------
    InputError
        The machine reads no rays.
    """
    check_rays(config, source=True)
    rays = {"rays": {"address": address, "packets": packets}}
    return {**({"camera": 0} if config.camera else {}), **rays}


def check_rays(config: Config, *, camera: bool = False, source: bool = False):
    """Refuse rays of a camera, or from memory, where the machine has not what gives them."""
    if camera and not config.camera:
        raise UnfitError(
            "the machine has no camera to make these rays: use a configuration with camera true"
        )
    if source and not config.source:
        raise UnfitError(
            "the machine reads no rays from memory, as shadows and recordings need it: use a "
            "configuration with source true"
        )


def ray_words(
    config: Config,
    origins: np.ndarray,
    directions: np.ndarray,
    t_min: np.ndarray,
    t_max: np.ndarray,
) -> np.ndarray:
    """Words (2n, limbs) of rays, of the bit patterns (n, 3) and (n,) of what they are."""
    layout = ray_word(config.fmt)
    words = np.zeros((2 * len(origins), word_bits(config.fmt) // 32), np.uint32)
    for half, (points, t) in enumerate([(origins, t_min), (directions, t_max)]):
        rows = np.zeros((len(points), words.shape[1]), np.uint32)
        for axis, (_, field) in enumerate(vertex(config.fmt)):
            fields.put(rows, field, points[:, axis], layout["point"].offset)
        fields.put(rows, layout["t"], t)
        words[half::2] = rows
    return words


def hit_words(config: Config, hits: dict[str, np.ndarray]) -> np.ndarray:
    """Words (n, limbs) of hits, of the columns (n,) of their fields."""
    words = np.zeros((len(hits["t"]), word_bits(config.fmt) // 32), np.uint32)
    for name, field in hit(config):
        fields.put(words, field, hits[name])
    return words


def hits_of(config: Config, words: np.ndarray) -> dict[str, np.ndarray]:
    """The fields t, u, v, triangle (n,) of hit words: the inverse of `hit_words`."""
    return {name: fields.get(words, field) for name, field in hit(config)}
