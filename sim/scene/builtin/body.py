"""The walker's body at rest: where the points of its cage are, and which bones hold them.

Metres; x to the figure's left, y up from the ground, z forward. The rest pose has straight legs
and arms 30 degrees off the trunk. Proportions of a person of 1.78 m.
"""

from itertools import product

import numpy as np

from sim.scene.builtin.cage import Surface, cage

SIDES = (-1, 1)  # right, left
BONES = ["pelvis", "chest", "head"] + [
    f"{bone} {side}"
    for side in SIDES
    for bone in ("upper arm", "forearm", "hand", "thigh", "shin", "foot", "toes")
]
ARM = np.deg2rad(30)

# The lattice: arms run along x, trunk, legs and head along y, feet along z.
REACH = 8  # cubes in an arm
SOLE, CROTCH, ARMPIT, SHOULDER, CROWN = 0, 8, 12, 13, 17  # planes of y
BACK, FRONT, INSTEP, TIP = 0, 1, 2, 3  # planes of z
MIDDLE = REACH + 1  # cube of x in the middle of the trunk

# Radius that a square ring of the cage leaves after smoothing, as part of its half width
SHRINK = 0.93

# y, centre x, centre z, radius in x, radius in z, weights by bone: the planes of a leg
LEG = [
    (0.000, 0.093, -0.018, 0.036, 0.050, {"foot": 1}),
    (0.085, 0.090, -0.020, 0.036, 0.050, {"foot": 0.6, "shin": 0.4}),
    (0.160, 0.090, -0.022, 0.036, 0.043, {"shin": 1}),
    (0.330, 0.092, -0.022, 0.056, 0.062, {"shin": 1}),
    (0.450, 0.092, 0.000, 0.052, 0.056, {"shin": 0.8, "thigh": 0.2}),
    (0.540, 0.092, 0.006, 0.057, 0.062, {"shin": 0.2, "thigh": 0.8}),
    (0.680, 0.094, 0.006, 0.072, 0.080, {"thigh": 1}),
    (0.800, 0.094, 0.000, 0.084, 0.095, {"thigh": 1}),
]
# y, half width, half width of the middle, z at the middle and at the sides of back and front
TRUNK = [
    (0.870, 0.182, 0.020, -0.095, -0.095, 0.095, 0.085, {"pelvis": 0.5, "thigh": 0.5}),
    (0.970, 0.180, 0.080, -0.165, -0.125, 0.105, 0.080, {"pelvis": 1}),
    (1.110, 0.140, 0.070, -0.085, -0.070, 0.105, 0.070, {"pelvis": 0.5, "chest": 0.5}),
    (1.240, 0.165, 0.080, -0.115, -0.090, 0.135, 0.095, {"chest": 1}),
    (1.350, 0.190, 0.080, -0.150, -0.100, 0.150, 0.085, {"chest": 1}),
    (1.490, 0.165, 0.060, -0.095, -0.075, 0.055, 0.045, {"chest": 1}),
]
# y, centre z, half width, half depth: neck, jaw, brow, crown
HEAD = [
    (1.540, 0.000, 0.062, 0.060, {"chest": 0.4, "head": 0.6}),
    (1.590, 0.026, 0.086, 0.104, {"head": 1}),
    (1.700, 0.015, 0.092, 0.118, {"head": 1}),
    (1.815, 0.005, 0.070, 0.090, {"head": 1}),
]
# distance from the shoulder, half height, half depth, forward: the planes of an arm
ARMS = [
    (0.035, 0.064, 0.062, -0.010, {"chest": 0.3, "upper arm": 0.7}),
    (0.150, 0.050, 0.054, -0.010, {"upper arm": 1}),
    (0.265, 0.042, 0.047, -0.010, {"upper arm": 0.8, "forearm": 0.2}),
    (0.330, 0.042, 0.047, -0.008, {"upper arm": 0.2, "forearm": 0.8}),
    (0.430, 0.036, 0.041, -0.004, {"forearm": 1}),
    (0.550, 0.025, 0.032, 0.000, {"forearm": 0.5, "hand": 0.5}),
    (0.640, 0.021, 0.050, 0.004, {"hand": 1}),
    (0.745, 0.014, 0.036, 0.004, {"hand": 1}),
]
# z, half width, top at the instep and at the tip of the foot
FOOT = [(0.110, 0.056, 0.066, {"foot": 0.5, "toes": 0.5}), (0.220, 0.052, 0.040, {"toes": 1})]

SHOULDER_JOINT = np.array([0.175, 1.425, -0.010])
PIVOTS = {
    "pelvis": (0, 0.97, 0),
    "chest": (0, 1.12, 0),
    "head": (0, 1.53, 0),
    "upper arm": SHOULDER_JOINT,
    "forearm": SHOULDER_JOINT + 0.298 * np.array([np.sin(ARM), -np.cos(ARM), 0]),
    "hand": SHOULDER_JOINT + 0.560 * np.array([np.sin(ARM), -np.cos(ARM), 0]),
    "thigh": (0.092, 0.90, 0),
    "shin": (0.092, 0.495, 0),
    "foot": (0.090, 0.085, -0.020),
    "toes": (0.095, 0.015, 0.110),
}


def body() -> Surface:
    """The cage; values are position (3) and weight by bone, in the order of `BONES`."""
    values = np.zeros((2 * REACH + 4, CROWN + 1, TIP + 1, 3 + len(BONES)))
    for side in SIDES:
        place_leg(values, side)
    place_trunk(values)
    for side in SIDES:
        place_arm(values, side)
    return cage(cubes(), values)


def cubes() -> set[tuple[int, int, int]]:
    """The body as cubes."""
    legs = {(MIDDLE + s, y, BACK) for s in SIDES for y in range(SOLE, CROTCH)}
    feet = {(MIDDLE + s, SOLE, z) for s in SIDES for z in (FRONT, INSTEP)}
    trunk = {(MIDDLE + s, y, BACK) for s in (-1, 0, 1) for y in range(CROTCH, SHOULDER)}
    arms = {(MIDDLE + s * (2 + i), ARMPIT, BACK) for s in SIDES for i in range(REACH)}
    thumbs = {(MIDDLE + s * (REACH), ARMPIT, FRONT) for s in SIDES}
    head = {(MIDDLE, y, BACK) for y in range(SHOULDER, CROWN)}
    return legs | feet | trunk | arms | thumbs | head


def plane_x(side: int, out: int) -> int:
    """Plane of x that is `out` cubes outside the middle cube, on a side."""
    return MIDDLE - out if side < 0 else MIDDLE + 1 + out


def put(values: np.ndarray, point: tuple[int, int, int], place, weights: dict, side: int) -> None:
    """Set a lattice point's position, given for the left side, and its weights."""
    values[point] = 0
    values[point][:3] = place
    values[point][0] *= side
    for bone, weight in weights.items():
        name = bone if bone in BONES else f"{bone} {side}"
        values[point][3 + BONES.index(name)] = weight


def place_leg(values: np.ndarray, side: int) -> None:
    """A leg from the sole up, and its foot."""
    for y, (height, cx, cz, rx, rz, weights) in enumerate(LEG):
        for out, z in product((0, 1), (BACK, FRONT)):
            x = cx + (2 * out - 1) * rx / SHRINK
            place = (x, height, cz + (2 * z - 1) * rz / SHRINK)
            put(values, (plane_x(side, out), y, z), place, weights, side)
    for z, (forward, half, top, weights) in enumerate(FOOT, INSTEP):
        for out, y in product((0, 1), (SOLE, SOLE + 1)):
            place = (0.098 + (2 * out - 1) * half, top * y, forward)
            put(values, (plane_x(side, out), y, z), place, weights, side)


def place_trunk(values: np.ndarray) -> None:
    """Trunk and head, both sides."""
    for side, out, z in product(SIDES, (0, 1), (BACK, FRONT)):
        for y, (height, half, inner, back, back_side, front, front_side, weights) in enumerate(
            TRUNK, CROTCH
        ):
            depth = ((back, front), (back_side, front_side))[out][z]
            put(
                values,
                (plane_x(side, out), y, z),
                ((inner, half)[out], height, depth),
                weights,
                side,
            )
        if out == 0:
            for y, (height, cz, half, deep, weights) in enumerate(HEAD, SHOULDER + 1):
                place = (half, height, cz + (2 * z - 1) * deep)
                put(values, (plane_x(side, 0), y, z), place, weights, side)


def place_arm(values: np.ndarray, side: int) -> None:
    """An arm and its thumb."""
    along = np.array([np.sin(ARM), -np.cos(ARM), 0])
    across = np.array([np.cos(ARM), np.sin(ARM), 0])
    for out, (distance, high, deep, forward, weights) in enumerate(ARMS, 2):
        centre = SHOULDER_JOINT + distance * along + (0, 0, 0.010 + forward)
        for y, z in product((0, 1), (BACK, FRONT)):
            place = centre + (2 * y - 1) * high / SHRINK * across
            place[2] += (2 * z - 1) * deep / SHRINK
            put(values, (plane_x(side, out), ARMPIT + y, z), place, weights, side)
    for y, end in product((0, 1), (0, 1)):
        place = SHOULDER_JOINT + (0.63 + 0.03 * end) * along + (2 * y - 1) * 0.014 * across
        place[2] = 0.085
        put(values, (plane_x(side, REACH - 1 + end), ARMPIT + y, INSTEP), place, {"hand": 1}, side)
