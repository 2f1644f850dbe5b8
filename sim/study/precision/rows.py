"""Results of formats, joined with what the hardware is."""

from collections.abc import Sequence

from hdl.records import word_bits
from sim.command import format_of
from sim.study.hardware import SIZES, Hardware

COLUMNS = (
    "scene",
    "frame",
    "format",
    "bits",
    "word_bits",
    "refused",
    "triangles",
    "pixels",
    "edge_pixels",
    "wrong",
    "silhouette",
    "inside",
    "lost",
    "false",
    "t_median",
    "t_99",
    "t_max",
    "update_cycles",
    "ray_cycles",
    "cycles",
    "cycles_per_ray",
    "steps_per_packet",
    "overflow",
    "mismatches",
    "milliseconds",
    "clock_mhz",
    "clock_measured",
    *SIZES,
)
"""Of the table of all rows."""


def rows_of(
    names: dict[str, str], cells: Sequence[dict], results: Sequence[dict], hardware: Hardware
) -> list[dict]:
    """A row a cell, in their order: COLUMNS, of which a refused format has the first few only.

    Parameters
    ----------
    names : dict
        What to call each scene.
    cells, results : sequence of dict
        As sim.study.precision.measure takes and gives.
    hardware : Hardware
    """
    rows = []
    for cell, result in zip(cells, results, strict=True):
        fmt = format_of(cell["format"])
        row = {
            "scene": names[cell["scene"]],
            "frame": cell["frame"],
            "format": str(fmt),
            "bits": fmt.bits,
            "word_bits": word_bits(fmt),
            **hardware.figures(str(fmt)),
            **result,
        }
        if "refused" not in result:
            row["milliseconds"] = result["cycles"] / row["clock_mhz"] / 1000
        rows.append(row)
    return rows


def measured(rows: Sequence[dict]) -> list[dict]:
    """The rows that were not refused, from the least bits to the most."""
    return sorted((r for r in rows if "refused" not in r), key=lambda r: (r["bits"], r["format"]))
