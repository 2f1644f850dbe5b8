"""Reports as tables of at most 80 columns."""

from pathlib import Path

from rich.table import Table

from sim.console import table
from sim.report.overflow import overflow_text
from sim.report.render import RenderReport
from sim.report.replay import ReplayReport
from sim.report.update import UpdateReport


def update_tables(report: UpdateReport) -> list[Table]:
    """What `bkd-sim update` prints."""
    work = report.triangles * len(report.frames)
    per_triangle = [("instructions", report.instructions_per_triangle)]
    per_triangle += [
        (f"waiting: {CAUSES[cause]}", count / work) for cause, count in report.stall_cycles.items()
    ]
    run = [
        ("triangles, vertices", f"{report.triangles:,}, {report.vertices:,}"),
        ("frames", f"{len(report.frames)} ({report.frames[0]} to {report.frames[-1]})"),
        ("words checked that differ from the model", f"{report.mismatches:,}"),
        ("frames with infinite vertices", f"{report.overflows:,}"),
        *_sent(report.words_sent),
        ("loads a triangle", f"{report.loads_per_triangle:.3f}"),
        ("memory words a triangle", f"{report.memory_words_per_triangle:.3f}"),
        ("SAH cost against a rebuild, worst frame", f"{max(report.sah_ratio):.3f}"),
        ("tree built in", f"{report.build_seconds:.3f} s"),
        ("program compiled in", f"{report.compile_seconds:.3f} s"),
        ("simulated cycles a second", f"{report.simulated_cycles_per_second:,.0f}"),
    ]
    title = f"{report.scene}: float {report.format}, memory latency {report.latency} cycles"
    return [
        table(title, run),
        table(
            "Where the cycles go",
            [(name, f"{value:.4f}") for name, value in per_triangle]
            + [("in all", f"{report.cycles_per_triangle:.4f}"), ("the 2006 board", "4.1")],
            header=("", "cycles a triangle"),
        ),
    ]


def _sent(words: list[int]) -> list[tuple[str, str]]:
    """What the host writes: all for the first frame, then what changes."""
    later = words[1:]
    mean = [("then, a frame", f"{sum(later) / len(later):,.0f}")] if later else []
    return [("memory words that the host writes first", f"{words[0]:,}"), *mean]


CAUSES = {
    "fetch": "for the next instruction",
    "vertex": "for a vertex that is being loaded",
    "box": "for a box that is being merged",
    "load": "for the memory port, to load",
    "write": "for the memory port, to write nodes",
    "drain": "for the last nodes to be written",
}


def render_tables(report: RenderReport, picture: Path) -> list[Table]:
    """What `bkd-sim render` prints."""
    frames = f"{report.frames[0]}" + (f" to {report.frames[-1]}" if report.frames[1:] else "")
    shadows = f", {report.shadow_rays:,} of them to the lamp" if report.shadow_rays else ""
    if report.updates:
        update = f"{report.update_cycles:,}: {report.update_share:.1%} of all"
    else:
        update = "none: no vertex has moved"
    run = [
        ("picture", f"{picture}"),
        ("triangles", f"{report.triangles:,}"),
        ("frames", frames),
        ("rays", f"{report.rays:,}{shadows}"),
        ("camera rays that hit", f"{report.hit_fraction:.1%}"),
        ("hits and words other than the model's", f"{report.model_mismatches:,}"),
        ("numbers that became infinite", overflow_text(report.overflows)),
        ("steps a packet", f"{report.steps_per_packet:.2f}"),
        ("triangle tests a ray", f"{report.triangle_tests_per_ray:.2f}"),
        ("cycles of updates", update),
        *(
            (f"cache of {kind}: hits", f"{_share(cache):.2%}")
            for kind, cache in report.cache.items()
            if report.memory == "dram"
        ),
        ("simulated in", f"{report.wall_seconds:.1f} s"),
    ]
    memory = {
        "dram": f"{report.latency} cycles of latency, 2 caches of {report.cache_words:,} words",
        "banks": f"banks on the chip, {report.latency} cycles of latency",
    }[report.memory]
    waits = report.stall_cycles["rays"]
    steps = report.cycles - sum(waits.values())
    cycles = [("packets at nodes", steps)]
    cycles += [(f"waiting: {WAITS[cause]}", count) for cause, count in waits.items()]
    return [
        table(f"{report.scene}: float {report.format}, {memory}", run),
        table(
            "Where the cycles go",
            [(name, f"{count / report.rays:.3f}") for name, count in cycles]
            + [("in all", f"{report.cycles_per_ray:.3f}"), ("the 2006 board", "8.3 to 33")],
            header=("", "cycles a ray"),
        ),
        taxonomy_table({"exact first hits": report.oracle}),
    ]


def replay_tables(report: ReplayReport) -> list[Table]:
    """What `bkd-sim replay` prints."""
    run = [
        ("rays", f"{report.rays:,}"),
        ("cycles a ray", f"{report.cycles_per_ray:.3f}"),
        ("simulated in", f"{report.wall_seconds:.1f} s"),
    ]
    title = f"{report.scene}: float {report.format}, {report.memory}, latency {report.latency}"
    against = {
        "the recording": report.recorded,
        "the model": report.model,
        "exact first hits": report.oracle,
    }
    return [table(title, run), taxonomy_table(against)]


def taxonomy_table(against: dict[str, dict]) -> Table:
    """Hits of the Verilog, by how they differ from those of others."""
    rows = [
        (name, *(f"{counts[kind]:,}" for counts in against.values()))
        for kind, name in CLASS_NAMES.items()
    ]
    unexplained = (counts.get("unexplained") for counts in against.values())
    shown = ["" if count is None else f"{count:,}" for count in unexplained]
    rows.append(("not explained by rounding", *shown))
    return table("Hits of the Verilog against", rows, header=("", *against))


CLASS_NAMES = {
    "same_bits": "the same bits",
    "same_triangle": "the same triangle, other bits",
    "tie": "another triangle, equally far",
    "hit_became_miss": "a hit became a miss",
    "miss_became_hit": "a miss became a hit",
    "nearer": "a nearer hit",
    "farther": "a farther hit",
}
WAITS = {
    "nodes": "for nodes from memory",
    "tests": "for triangle tests",
    "loop": "for packets on their way from node to node",
    "rays": "for rays to be prepared",
}


def _share(cache: dict[str, int]) -> float:
    return cache["hits"] / max(cache["hits"] + cache["misses"], 1)
