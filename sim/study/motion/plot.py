"""The diagram of a scene: what its trees cost over its frames."""

from matplotlib.figure import Figure

from sim.study.motion.tables import frame_text

INCHES = (6.4, 4.0)
"""At README width, 640 pixels, an inch is 100 of them."""
LINES = {
    "first": ("refitted, built over frame 0", "0.5", "-"),
    "poses": ("refitted, built over 3 poses", "tab:blue", "-"),
    "rebuilt": ("rebuilt for each frame", "black", "--"),
}


def figure(result: dict) -> Figure:
    """The diagram of a result of sim.study.motion.measure.

    SAH costs over frames; the band above the rebuilt tree's is where refit pays, and a mark on a
    refitted tree's line the frame in which it stops.
    """
    drawn = Figure(INCHES, layout="constrained")
    axes = drawn.subplots()
    frames, sah = result["frames"], result["sah"]
    for name, (label, colour, style) in LINES.items():
        axes.plot(frames, sah[name], style, color=colour, label=label, linewidth=1.5)
    axes.fill_between(
        frames,
        sah["rebuilt"],
        [cost + result["most"] for cost in sah["rebuilt"]],
        color="tab:green",
        alpha=0.12,
        linewidth=0,
        label=f"refit pays: up to {result['most']:.1f} above",
    )
    top = max(max(costs) for costs in sah.values()) * 1.12
    axes.set_ylim(0, top)
    axes.set_xlim(frames[0], frames[-1])
    for name in ("first", "poses"):
        stop = result["stops"][name]
        if stop is not None:
            axes.axvline(stop, color=LINES[name][1], linestyle=":", linewidth=1.5)
            axes.annotate(
                f"frame {stop:,}",
                (stop, top),
                xytext=(3, -3),
                textcoords="offset points",
                va="top",
                rotation=90,
                fontsize=9,
                color=LINES[name][1],
                bbox={"color": "white", "alpha": 0.8, "pad": 0.5},
            )
    axes.set_xlabel("frame")
    axes.set_ylabel("SAH cost (steps and tests of a ray)")
    says = ", ".join(
        f"{frame_text(result['stops'][name])} ({label})"
        for name, label in (("poses", "3 poses"), ("first", "frame 0"))
    )
    axes.set_title(
        f"{result['scene'].partition(':')[0]}, {result['triangles']:,} triangles, float "
        f"{result['format']}; refit stops paying at: {says}",
        fontsize=9,
    )
    axes.legend(fontsize=8, loc="best", framealpha=0.9)
    axes.grid(alpha=0.3, linewidth=0.5)
    return drawn
