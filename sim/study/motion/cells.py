"""What is measured: the stiff built-in figures over a long period."""

SCENES = ("propeller", "cloth", "shock", "collapse", "explosion")
POLICIES = ("every", "every-4", "moved-0", "moved-0.001", "moved-0.01")
TRIANGLES = 2000
FRAMES = 10_000
RAYS = 512 * 386
"""A frame."""


def cells(fmt: str = "7,16", triangles: int = TRIANGLES, frames: int = FRAMES) -> list[dict]:
    """A cell a scene, as sim.study.motion.measure takes them."""
    return [
        {
            "scene": f"{name}:{triangles}",
            "frames": frames,
            "format": fmt,
            "samples": 40,
            "verilog": 8,
            "policies": list(POLICIES),
            "rays": RAYS,
        }
        for name in SCENES
    ]
