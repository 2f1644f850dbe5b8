"""Pictures and animations as files, through Pillow."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from sim.errors import InputError
from sim.files import written_whole

ANIMATED = (".png", ".gif", ".webp")
"""Suffixes of files that hold several pictures."""
QUALITY = {".jpg": {"quality": 92}, ".jpeg": {"quality": 92}, ".webp": {"quality": 90}}


def check_picture_file(file: Path, frames: int = 1):
    """Refuse a file that `save` could not write so many pictures to, before they are made.

    Raises
    ------
    InputError
        Pillow writes no such file, or it does not hold several pictures.
    """
    if frames > 1 and file.suffix.lower() not in ANIMATED:
        raise InputError(
            f"{file}: {frames} frames go into {', '.join(ANIMATED[:-1])} or {ANIMATED[-1]}; name "
            f"such a file, or choose one frame"
        )
    try:  # the formats that Pillow can write depend on how it was built: try with a pixel
        _write(io.BytesIO(), file.suffix, [np.zeros((1, 1, 3), np.uint8)] * min(frames, 2), 24.0)
    except (KeyError, ValueError, OSError) as error:
        raise InputError(
            f"{file}: cannot write a '{file.suffix}' picture; name a file that ends in .png"
        ) from error


def save(file: Path, pictures: Sequence[np.ndarray], fps: float = 24.0):
    """Write a picture, or several as an animation that runs for ever; whole or not at all.

    Parameters
    ----------
    file : Path
        Its suffix says how.
    pictures : sequence of (height, width, 3) uint8
        All of one size, at least one.
    fps : float
        Pictures a second. A file counts in milliseconds, a .gif in hundredths of a second.

    Raises
    ------
    InputError
        What `check_picture_file` refuses; the format does not hold a picture of this size.
    """
    check_picture_file(file, len(pictures))
    with written_whole(file) as temporary:
        try:
            with temporary.open("wb") as stream:
                _write(stream, file.suffix, pictures, fps)
        except (ValueError, OSError) as error:
            raise InputError(f"{file}: cannot be written: {error}") from error


def _write(stream, suffix: str, pictures: Sequence[np.ndarray], fps: float):
    suffix = suffix.lower()
    images = [Image.fromarray(picture) for picture in pictures]
    options: dict = dict(QUALITY.get(suffix, {}))
    if suffix == ".gif":
        images = _with_one_palette(images)
    if len(images) > 1:
        unit = 10 if suffix == ".gif" else 1
        times = unit * np.rint(np.arange(len(images) + 1) * 1000 / fps / unit)
        options |= {"save_all": True, "append_images": images[1:], "loop": 0}
        options["duration"] = np.diff(times).astype(int).tolist()
    images[0].save(stream, Image.registered_extensions()[suffix], **options)


def _with_one_palette(images: list[Image.Image]) -> list[Image.Image]:
    """Images in 256 colours that they share, so that what is still does not flicker."""
    pixels = np.concatenate([np.asarray(image).reshape(-1, 3) for image in images])
    sample = Image.fromarray(pixels[:: len(pixels) // 250_000 + 1][None])
    palette = sample.quantize(256, Image.Quantize.MEDIANCUT)
    return [image.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG) for image in images]
