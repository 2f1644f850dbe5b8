"""`bkd-sim stability`."""

from pathlib import Path

from sim.cli.parser import format_argument
from sim.cli.sweeps import scheduler_argument, sweeps
from sim.command import Parser, format_of
from sim.console import conclude, print_text
from sim.errors import InputError
from sim.files import check_writable
from sim.options import json_argument
from sim.study.motion import cells as motion
from sim.study.motion.measure import measure as measure_motion
from sim.study.motion.tables import caption as motion_caption
from sim.study.motion.tables import grids as motion_grids
from sim.study.motion.tables import wrong_motions
from sim.study.needs import check_matplotlib
from sim.study.precision.measure import machine_of
from sim.study.provenance import provenance
from sim.study.stability.cases import CASES, PEERS, cells, measure, wrong
from sim.study.stability.tables import caption, grids

EXAMPLE = "stability --cases closed slivers --peers"
MOTION = "motion"
TITLE = "Stability: extreme cases, and stiff motion"


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    names = [*CASES, MOTION]
    add("--cases", metavar="NAME", nargs="+", default=names, help=", ".join(names) + "; all")
    add("--peers", action="store_true", help="the same cases through Embree and warp")
    format_argument(parser)
    add("--seed", metavar="N", type=int, default=1, help="of meshes and rays; %(default)s")
    scheduler_argument(parser)
    add("--out", metavar="DIR", type=Path, help="folder for a page with diagrams, and all figures")
    json_argument(parser)


def run(options) -> int:
    """Try extreme cases, and motion whose rates differ by many powers of ten."""
    check_writable(options.json)
    fmt = format_of(options.format)
    machine_of(fmt)
    if options.seed < 0:
        raise InputError(f"--seed {options.seed}: give a whole number from 0 on")
    names = [*CASES, MOTION]
    for name in options.cases:
        if name not in names:
            raise InputError(f"--cases {name}: no such case; cases are {', '.join(names)}")
    chosen = list(dict.fromkeys(name for name in options.cases if name != MOTION))
    extreme = cells(chosen, fmt, options.seed, options.peers)
    moving = motion.cells(str(fmt)) if MOTION in options.cases else []
    if options.out:
        check_matplotlib()
        from sim.study.folder import check_folder

        check_folder(options.out)
    with sweeps(options.scheduler) as swept:
        results = swept("trying cases", measure, extreme)
        motions = swept("moving scenes", measure_motion, moving)
    made = provenance(options.seed, "distributed", *(PEERS if options.peers else ()))
    figures = {"provenance": made, "cases": results, "motion": motions}
    lines = [*wrong(results), *wrong_motions(motions)]
    shown = [grid.shown() for grid in (*grids(results), *motion_grids(motions))]
    conclude(shown, options.json, figures, lines)
    for says in (caption(results), motion_caption(motions)):
        if says:
            print_text(says)
    if options.out:
        from sim.study.folder import save
        from sim.study.stability.report import sections

        save(
            options.out,
            "stability",
            TITLE,
            sections(results, motions),
            caption(results),
            {},
            figures,
        )
        print_text(f"{options.out / 'index.html'}: all of it, with diagrams")
    return 1 if lines else 0
