"""Rows of formats and of policies as text, for terminals and pages."""

from collections.abc import Sequence

ERRORS = ("format", "wrong %", "edges", "inside", "lost", "false", "t 50 %", "t 99 %", "t max")
COSTS = ("format", "bits", "update", "a ray", "ms", "MHz", "LUT", "mult", "xc4v")

SHOWN = ("ecp5_lut", "ecp5_multipliers", "xc4v_lut")
"""Sizes among them."""

CAPTION = (
    "wrong: share of pixels that see another triangle than in exact arithmetic on the scene as it "
    "is; its parts on silhouettes (edges) and inside; lost, false: pixels that should hit and do "
    "not, and the reverse; t: relative error of the distance, where the triangle is right; update: "
    "cycles; a ray: cycles; ms: milliseconds a frame; LUT, mult: LUT4 and multipliers of an ECP5; "
    "xc4v: LUT4 of a Virtex-4; ~: an assumed clock. Of updates: differ is the share of pixels "
    "that see another triangle than with an update of every frame."
)


def error_table(rows: Sequence[dict]) -> list[list[str]]:
    """Cells under ERRORS; a refused format says no more than that."""
    return [
        [row["format"], "-", *[""] * 7]
        if "refused" in row
        else [
            row["format"],
            *(figure(100 * row[name]) for name in ("wrong", "silhouette", "inside")),
            *(f"{row[name]:,}" for name in ("lost", "false")),
            *(
                "" if row[name] is None else power(row[name])
                for name in ("t_median", "t_99", "t_max")
            ),
        ]
        for row in rows
    ]


def cost_table(rows: Sequence[dict]) -> list[list[str]]:
    """Cells under COSTS, of the formats that were not refused."""
    return [
        [
            row["format"],
            f"{row['bits']}",
            f"{row['update_cycles']:,}",
            f"{row['cycles_per_ray']:.4g}",
            f"{row['milliseconds']:.4g}",
            f"{'' if row['clock_measured'] else '~'}{row['clock_mhz']:g}",
            *("" if row[name] is None else f"{row[name]:,}" for name in SHOWN),
        ]
        for row in rows
        if "refused" not in row
    ]


def refusals(rows: Sequence[dict]) -> list[str]:
    """A line on each format that was refused."""
    return [f"{row['format']} refused: {row['refused']}" for row in rows if "refused" in row]


def figure(value: float) -> str:
    """A number above 0 to two figures, or all of those before its point."""
    return f"{value:.1f}" if value >= 10 else f"{value:.2g}"


def percent(share: float) -> str:
    """A share in percent."""
    return f"{figure(100 * share)} %"


def power(value: float) -> str:
    """A number to two figures, with its power of ten."""
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}"
