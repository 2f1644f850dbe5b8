"""Where a picture of a scene is taken from, and where its lamp is: the same for all its frames."""

import numpy as np

from sim.prepare import Prepared
from sim.report.light import light
from sim.scene.camera import Camera, auto, look_at, parse
from sim.scene.view import FILL
from sim.tree.build import spread

FILLS = {"auto": FILL, "whole": 0.0}
"""Share of the image that the scene fills at least, by the name of the camera."""
POSES = 8
"""Poses of an animation that these look at."""


def check_camera(text: str):
    """Refuse an option --camera that means nothing, before the work."""
    if text not in FILLS:
        parse(text)


def camera_and_lamp(
    text: str, prepared: Prepared, frames: range, width: int, height: int
) -> tuple[Camera, np.ndarray]:
    """The camera of an option --camera, and the lamp (3,), in normalised coordinates."""
    if text in FILLS:
        poses = np.stack([prepared.scene.pose(frame) for frame in spread(frames, POSES)])
        camera = auto(poses, prepared.scene.faces, width, height, FILLS[text])
    else:
        eye, target, fov = parse(text)
        eye, target = prepared.normalised.points(np.stack([eye, target]))
        camera = look_at(eye, target, fov, width, height)
    return camera, light(camera, prepared.scene.pose(frames[0]))
