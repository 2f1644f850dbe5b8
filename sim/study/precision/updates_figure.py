"""A diagram of policies of updates: cycles of update and of rays, and what is lost."""

from collections.abc import Sequence

from matplotlib.figure import Figure

from sim.study.precision.figure import SMALL
from sim.study.precision.tables import percent

MILLION = 1e6


def updates_figure(rows: Sequence[dict]) -> Figure:
    """Bars of cycles, a policy each; rows as sim.study.precision.updates makes them."""
    figure = Figure((8.0, 1.3 + 0.3 * len(rows)), layout="constrained")
    axes = figure.subplots()
    places = range(len(rows))
    updates = [row["update_cycles"] / MILLION for row in rows]
    rays = [row["render_cycles"] / MILLION for row in rows]
    axes.barh(places, updates, color="0.35", edgecolor="black", label="updates")
    axes.barh(
        places, rays, left=updates, color="white", edgecolor="black", hatch="///", label="rays"
    )
    for place, row in zip(places, rows, strict=True):
        lost = f"{row['lost']:,} hits lost" if row["lost"] else "none lost"
        differ = percent(row["different_share"])
        axes.annotate(
            f"{lost}, {differ} of pixels differ" if row["different_share"] else lost,
            (row["cycles"] / MILLION, place),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=SMALL,
            fontweight="bold" if row["lost"] else "normal",
        )
    axes.axvline(
        rows[0]["cycles"] / MILLION,
        color="black",
        linewidth=0.8,
        linestyle=":",
        zorder=0,
        label=f"both, {rows[0]['policy']}",
    )
    axes.set_yticks(places, [row["policy"] for row in rows])
    axes.invert_yaxis()
    axes.set_xlim(0, 1.45 * max(row["cycles"] for row in rows) / MILLION)
    axes.legend(fontsize=SMALL, loc="upper right")
    axes.tick_params(labelsize=SMALL)
    axes.set_xlabel(f"million cycles, {len(rows[0]['frames'])} frames together", fontsize=9)
    axes.set_title(f"{rows[0]['scene']}: what updates may leave out", fontsize=10)
    return figure
