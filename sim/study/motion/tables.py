"""Results of stiff scenes as text, at most 80 columns wide."""

from collections.abc import Sequence

from sim.study.section import Grid

BITS = ("", "triangles", "rates differ by", "updates", "words other", "in Verilog")
COSTS = ("", "SAH: new", "refitted", "worst", "stops paying", "first frame's", "repaid")
CAPTION = (
    "rates differ by: how far the fastest hundredth of the vertices moves in a frame, over the "
    "slowest hundredth that moves; the median of the frames, and the largest. words other: nodes, "
    "of all updates, that have not the bits of a refit from clean memory; in Verilog: words of its "
    "whole memory, over {verilog} frames. SAH: mean cost of a tree built for the frame, and of the "
    "machine's refitted one; worst: their largest ratio. stops paying: the first frame in which a "
    "rebuild, {rebuild:,} cycles or more, costs less than what the refitted tree costs above a new "
    "one; first frame's: the same for a tree built over the first frame alone; repaid: the frame "
    "by which one rebuild of that tree has paid for itself."
)


def grids(results: Sequence[dict]) -> list[Grid]:
    """What is equal, and what is not worth it; of results of sim.study.motion.measure."""
    known = [result for result in results if "refused" not in result]
    shown = []
    if known:
        title = f"Stiff motion: float {known[0]['format']}, {known[0]['updates']:,} updates a scene"
        shown += [
            Grid(title, BITS, [_bits(result) for result in known]),
            Grid("When refit stops paying", COSTS, [_costs(result) for result in known]),
            Grid(
                "Update cycles a frame, by policy",
                ("", *known[0]["policies"]),
                [_policies(result) for result in known],
            ),
        ]
    refused = [(r["scene"], r["refused"]) for r in results if "refused" in r]
    return shown + ([Grid("Refused", ("", ""), refused)] if refused else [])


def wrong_motions(results: Sequence[dict]) -> list[str]:
    """A line for each scene in which a bound or a word is not what it has to be."""
    return [
        f"{result['scene']}: {result['differing']:,} bounds and {result['mismatches']:,} words of "
        f"the Verilog are not those of a fresh refit"
        for result in results
        if result.get("differing") or result.get("mismatches")
    ]


def sentence(result: dict) -> str:
    """What a scene shows."""
    stops = {name: frame_text(frame) for name, frame in result["stops"].items()}
    return (
        f"{result['scene'].partition(':')[0]}: refit stops paying at frame {stops['poses']} for a "
        f"tree built over three poses, at {stops['first']} for one built over the first frame."
    )


def caption(results: Sequence[dict]) -> str | None:
    """What the columns mean; None where there are none."""
    known = [result for result in results if "refused" not in result]
    if not known:
        return None
    return CAPTION.format(
        verilog=max(len(result["verilog_frames"]) for result in known),
        rebuild=min(result["rebuild_cycles"] for result in known),
    )


def _bits(result: dict) -> list[str]:
    rates = (result["rates_median"], result["rates_largest"])
    return [
        result["scene"].partition(":")[0],
        f"{result['triangles']:,}",
        " to ".join(_short(rate) for rate in rates),
        f"{result['updates']:,}",
        f"{result['differing']:,}",
        f"{result['mismatches']:,}",
    ]


def _costs(result: dict) -> list[str]:
    sah = result["sah"]
    ratios = [old / new for old, new in zip(sah["poses"], sah["rebuilt"], strict=True)]
    return [
        result["scene"].partition(":")[0],
        *(f"{sum(sah[name]) / len(ratios):.1f}" for name in ("rebuilt", "poses")),
        f"{max(ratios):.2f}",
        frame_text(result["stops"]["poses"]),
        frame_text(result["stops"]["first"]),
        frame_text(result["repaid"]),
    ]


def _policies(result: dict) -> list[str]:
    return [
        result["scene"].partition(":")[0],
        *(f"{cycles:,.0f}" for cycles in result["policies"].values()),
    ]


def _short(rate: float | None) -> str:
    return "none" if rate is None else f"{rate:.1g}".replace("e+0", "e").replace("e+", "e")


def frame_text(frame: int | None) -> str:
    """A frame, or that there is none."""
    return "never" if frame is None else f"{frame:,}"
