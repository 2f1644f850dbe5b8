"""The motion of the walker's bones over one cycle of two steps."""

from collections.abc import Sequence

import numpy as np

from sim.scene.builtin.body import BONES, PIVOTS, SIDES
from sim.scene.builtin.rotate import rotations

# Degrees at every tenth of the cycle, from heel strike on; flexion of hip, knee and elbow,
# raising of foot and toes are positive. After the normal gait of adults in Perry, "Gait Analysis".
HIP = [27, 24, 17, 8, -2, -10, -5, 10, 24, 29]
KNEE = [6, 15, 17, 12, 7, 10, 35, 60, 52, 20]
FOOT = [0, -4, 3, 7, 10, 4, -16, -8, 1, 2]
TOES = [6, 0, 0, 0, 8, 26, 14, 0, 0, 6]
LOWERED = np.deg2rad(21)  # arms, from the rest pose
SOLES = np.array([(0.095, 0, -0.06), (0.095, 0, 0.11), (0.095, 0, 0.205)])  # heel, ball, tip


def periodic(samples: Sequence[float], phase: float) -> float:
    """The smooth periodic curve through evenly spaced samples, in radians, at phase 0..1."""
    spectrum = np.fft.rfft(np.deg2rad(samples)) / len(samples)
    turns = np.exp(2j * np.pi * phase * np.arange(len(spectrum)))
    doubled = np.where(np.arange(len(spectrum)) % (len(samples) / 2) == 0, 1, 2)
    return float((doubled * spectrum * turns).real.sum())


def turn(axis: int, angle: float) -> np.ndarray:
    """Rotation (3, 3) about x, y or z."""
    return rotations(np.eye(3)[axis], np.float64(angle))


def motion(phase: float) -> np.ndarray:
    """Each bone's motion from rest, (bones, 4, 4), at a phase 0..1 of the cycle.

    The right heel strikes at 0, the left one at 0.5. The figure walks on the spot, its lowest
    sole on the ground.
    """
    swing = np.cos(2 * np.pi * phase)  # 1 with the right leg forward
    sway = np.sin(2 * np.pi * phase)
    turns = {
        "pelvis": turn(1, 0.10 * swing) @ turn(2, 0.05 * sway),
        "chest": turn(1, -0.22 * swing) @ turn(2, -0.06 * sway) @ turn(0, 0.05),
        "head": turn(1, 0.12 * swing) @ turn(0, -0.04),
    }
    parents = {"chest": "pelvis", "head": "chest"}
    for side in SIDES:
        own = (phase + (0.5 if side > 0 else 0)) % 1
        arm = -np.cos(2 * np.pi * own)  # arms swing against their legs
        turns |= {
            f"thigh {side}": turn(0, -periodic(HIP, own)),
            f"shin {side}": turn(0, periodic(KNEE, own)),
            f"foot {side}": turn(1, side * 0.10) @ turn(0, -periodic(FOOT, own)),
            f"toes {side}": turn(0, -periodic(TOES, own)),
            f"upper arm {side}": turn(0, -0.38 * arm + 0.08) @ turn(2, -side * LOWERED),
            f"forearm {side}": turn(0, -0.34 - 0.18 * arm),
            f"hand {side}": turn(0, -0.10),
        }
        for limb, root in (
            (("upper arm", "forearm", "hand"), "chest"),
            (("thigh", "shin", "foot", "toes"), "pelvis"),
        ):
            for parent, bone in zip((root, *limb), limb, strict=False):
                parents[f"{bone} {side}"] = parent if parent == root else f"{parent} {side}"

    matrices: dict[str, np.ndarray] = {}
    for bone in BONES:
        kind, _, side = bone.rpartition(" ") if bone not in PIVOTS else (bone, "", "1")
        pivot = np.array(PIVOTS[kind]) * (int(side), 1, 1)
        local = np.eye(4)
        local[:3, :3] = turns[bone]
        local[:3, 3] = pivot - turns[bone] @ pivot
        matrices[bone] = matrices[parents[bone]] @ local if bone in parents else local
    motions = np.stack([matrices[bone] for bone in BONES])

    lowest = min(
        float((matrices[f"{bone} {side}"] @ np.append(sole * (side, 1, 1), 1))[1])
        for side in SIDES
        for bone, sole in zip(("foot", "foot", "toes"), SOLES, strict=True)
    )
    motions[:, 1, 3] -= lowest
    return motions
