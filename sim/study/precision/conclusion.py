"""What the figures of formats come to, in words."""

from collections.abc import Sequence

from hdl.fp.format import F24
from sim.study.precision.rows import measured
from sim.study.precision.tables import percent, power

LIMITS = (0.01, 0.001, 0.0001)
"""Shares of wrong pixels for which a format is looked for."""
FEW = 3
"""Pixels that a limit has to be."""
SLOW = 1.2
"""Run time over the shortest from which a format counts as slow."""


def conclusion(rows: Sequence[dict]) -> str:
    """Which format is enough for which error, and what 24 bits cost against the most.

    `rows` are sim.study.precision.rows of one scene.
    """
    known = measured(rows)
    if not known:
        return f"{rows[0]['scene']}: no format holds it."
    sentences = [_enough(known), _against_widest(known), _slow(known)]
    return f"{known[0]['scene']}, frame {known[0]['frame']}: " + " ".join(filter(None, sentences))


def _enough(rows: list[dict]) -> str:
    """The format of the least bits under each limit that is a few pixels at least."""
    pixels = rows[0]["pixels"]
    parts = []
    for limit in LIMITS:
        below = [row for row in rows if row["wrong"] < limit]
        if below and limit * pixels >= FEW:
            of = "" if parts else f" of {pixels:,} pixels wrong"
            parts.append(f"less than {percent(limit)}{of}: {_name(below[0])}")
    if not parts:
        best = min(rows, key=lambda row: row["wrong"])
        return f"{_name(best)} is best, with {_wrong(best)}."
    return f"fewest bits that have {'; '.join(parts)}."


def _against_widest(rows: list[dict]) -> str:
    """What 24 bits, where they were measured, give and cost against the widest format."""
    ours = [row for row in rows if row["format"] == str(F24)]
    widest = rows[-1]
    if not ours or ours[0] is widest:
        return ""
    row = ours[0]
    ratios = [(row["milliseconds"] / widest["milliseconds"], "milliseconds")]
    for part, name in (("ecp5_lut", "LUTs"), ("ecp5_multipliers", "multipliers")):
        if row[part] and widest[part]:
            ratios.append((row[part] / widest[part], name))
    ratios.append((row["word_bits"] / widest["word_bits"], "bits of a memory word"))
    costs = _listed([f"{ratio:.2f} times the {name}" for ratio, name in ratios])
    off = (
        f"Half of all distances are off by less than {power(row['t_median'])}, and "
        f"{power(widest['t_median'])}. "
        if row["t_median"] and widest["t_median"]
        else ""
    )
    return (
        f"{_name(row)} has {_wrong(row)} (hits lost: {row['lost']:,}), {_name(widest)} "
        f"{_wrong(widest)} ({widest['lost']:,}). {off}{row['format']} takes {costs}."
    )


def _slow(rows: list[dict]) -> str:
    """That fewer bits are slower, where they are: boxes grow by what the arithmetic rounds."""
    fastest, narrowest = min(rows, key=lambda row: row["milliseconds"]), rows[0]
    times = narrowest["milliseconds"] / fastest["milliseconds"]
    if times < SLOW:
        return ""
    more = narrowest["steps_per_packet"] / fastest["steps_per_packet"]
    return (
        f"Fewer bits are not faster: {_name(narrowest)} takes {times:.1f} times as long as "
        f"{_name(fastest)}, since boxes grow with the rounding and rays meet {more:.1f} times the "
        f"nodes."
    )


def _name(row: dict) -> str:
    return f"{row['format']} ({row['bits']} bits)"


def _wrong(row: dict) -> str:
    return f"{percent(row['wrong'])} of pixels wrong" if row["wrong"] else "none wrong"


def _listed(parts: Sequence[str]) -> str:
    return parts[0] if len(parts) == 1 else f"{', '.join(parts[:-1])} and {parts[-1]}"
