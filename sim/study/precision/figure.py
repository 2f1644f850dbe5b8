"""Diagrams of formats: error against time, against size and against bits, and where errors lie."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, NullFormatter

from sim.study.precision.frontier import frontier
from sim.study.precision.rows import measured

INCHES = (8.0, 6.6)
"""At README width, 800 pixels, an inch is 100 of them."""
SMALL = 7.5
"""Points of the smallest text: 10 pixels there."""


@dataclass(frozen=True)
class Point:
    """Something that costs, and errs."""

    label: str
    cost: float
    error: float


def formats_figure(rows: Sequence[dict]) -> Figure:
    """Four panels on one scene, of sim.study.precision.rows; refused formats are left out."""
    known = measured(rows)
    figure = Figure(INCHES, layout="constrained")
    time, size, distance, where = figure.subplots(2, 2).ravel()
    size.sharey(time)
    first = known[0]
    figure.suptitle(
        f"{first['scene']}, frame {first['frame']}: {first['triangles']:,} triangles, "
        f"{first['pixels']:,} pixels; labels are exponent,mantissa bits",
        fontsize=10,
    )
    floor = 0.5 / first["pixels"]
    clocks = {row["clock_mhz"] for row in known}
    guessed = any(not row["clock_measured"] for row in known)
    note = f"at {clocks.pop():g} MHz" if len(clocks) == 1 else "at each one's clock"
    if guessed:
        note += ", not measured for all"
    trade(time, [Point(r["format"], r["milliseconds"], r["wrong"]) for r in known], floor)
    time.set(title="Error against run time", xlabel=f"milliseconds a frame, {note}")
    sized = [Point(r["format"], r["ecp5_lut"], r["wrong"]) for r in known if r["ecp5_lut"]]
    trade(size, sized, floor)
    size.set(title="Error against size", xlabel="LUT4 of an ECP5, whole core")
    if len(sized) < len(known):
        size.text(
            *(0.03, 0.03),
            f"known for {len(sized)} of {len(known)} formats",
            fontsize=SMALL,
            va="bottom",
            transform=size.transAxes,
        )
    _distances(distance, known)
    _where(where, known)
    for axes in (time, size, distance, where):
        axes.tick_params(labelsize=SMALL)
        axes.title.set_fontsize(10)
        axes.xaxis.label.set_fontsize(9)
        axes.yaxis.label.set_fontsize(9)
    return figure


def trade(axes: Axes, points: Sequence[Point], floor: float):
    """Errors, in logarithm, against costs; those that no other point beats are filled and joined.

    An error of zero is drawn at `floor`, as a triangle.
    """
    axes.set_ylabel("pixels wrong (%)")
    axes.grid(alpha=0.3, linewidth=0.5)
    if not points:
        return
    errors = [max(point.error, floor) for point in points]
    best = frontier([(point.cost, point.error) for point in points])
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{100 * value:g}"))
    costs = [point.cost for point in points]
    if max(costs) > 4 * min(costs):
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        axes.xaxis.set_minor_formatter(NullFormatter())
    axes.margins(x=0.24, y=0.1)
    rises = _rises(costs, errors)
    for k, point in enumerate(points):
        left = point.cost == max(costs)  # there is no room on the right
        axes.plot(
            point.cost,
            errors[k],
            "o" if point.error else "v",
            color="black",
            markerfacecolor="black" if k in best else "white",
            markersize=5,
        )
        axes.annotate(
            point.label if point.error else f"{point.label}: none",
            (point.cost, errors[k]),
            xytext=(-5 if left else 5, -1 if rises else 1),  # off the way to the next point
            textcoords="offset points",
            ha="right" if left else "left",
            va="top" if rises else "bottom",
            fontsize=SMALL,
        )
    right, top = axes.get_xlim()[1], axes.get_ylim()[1]
    axes.step(
        [*(costs[k] for k in (best[0], *best)), right],
        [top, *(errors[k] for k in (*best, best[-1]))],
        where="post",
        color="black",
        linewidth=1,
        zorder=1,
        label="frontier: no other is better in both",
    )
    axes.set(xlim=(None, right), ylim=(None, top))
    axes.legend(fontsize=SMALL, loc="center right" if rises else "upper right")


def _rises(costs: Sequence[float], errors: Sequence[float]) -> bool:
    """Whether the points leave the right free, rather than the upper right."""
    return costs[int(np.argmax(errors))] > np.sqrt(min(costs) * max(costs))


def _distances(axes: Axes, rows: list[dict]):
    """Errors of t against bits."""
    for name, label, style in (
        ("t_max", "largest", "^:"),
        ("t_99", "99 of 100 below", "s--"),
        ("t_median", "median", "o-"),
    ):
        there = [row for row in rows if row[name]]
        axes.plot(
            *([row[of] for row in there] for of in ("bits", name)),
            style,
            color="black",
            markersize=4,
            linewidth=1,
            label=label,
        )
    bits = sorted({row["bits"] for row in rows})
    axes.set_yscale("log")
    axes.set_xticks(bits)
    axes.grid(alpha=0.3, linewidth=0.5)
    axes.legend(fontsize=SMALL)
    axes.set(title="Error of distances", xlabel="bits of a float", ylabel="relative error of t")


def _where(axes: Axes, rows: list[dict]):
    """Which part of the wrong pixels lies on silhouettes."""
    places = range(len(rows))
    edges = [100 * row["silhouette"] / row["wrong"] if row["wrong"] else 0 for row in rows]
    inside = [100 * row["inside"] / row["wrong"] if row["wrong"] else 0 for row in rows]
    axes.bar(places, edges, color="0.35", edgecolor="black", label="on silhouettes")
    axes.bar(
        places, inside, bottom=edges, color="white", edgecolor="black", hatch="///", label="inside"
    )
    for place, row in zip(places, rows, strict=True):
        count = round(row["wrong"] * row["pixels"])
        axes.text(place, 101, f"{count:,}", ha="center", va="bottom", fontsize=SMALL)
    axes.set_xticks(places, [row["format"] for row in rows], fontsize=SMALL)
    axes.set_ylim(0, 125)
    axes.set_yticks(range(0, 101, 25))
    axes.legend(fontsize=SMALL, loc="upper right", ncols=2)
    axes.set(
        title="Where they are (above: how many)",
        xlabel="exponent,mantissa bits",
        ylabel="of all pixels wrong (%)",
    )
