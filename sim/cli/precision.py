"""`bkd-sim precision`."""

import sys
from dataclasses import asdict
from pathlib import Path

from sim.cli.sweeps import scheduler_argument, sweeps
from sim.command import Parser, format_of, size_of
from sim.console import print_tables, print_text
from sim.errors import InputError
from sim.options import SCENE_HELP, frame_of
from sim.scene.load import load_scene
from sim.scene.scene import Scene
from sim.study.hardware import FORMATS, MEASURED, read_hardware
from sim.study.needs import check_matplotlib
from sim.study.policies.measure import measure as measure_policy
from sim.study.precision.measure import machine_of, measure
from sim.study.precision.rows import COLUMNS, rows_of
from sim.study.precision.tables import CAPTION
from sim.study.precision.updates import COLUMNS as UPDATE_COLUMNS
from sim.study.precision.updates import update_cells, update_rows
from sim.study.provenance import provenance

EXAMPLE = "precision walker:2000 --formats 5,12 7,16 8,23"
SIZE = "240x180"


def arguments(parser: Parser):
    """Options of the command."""
    add = parser.add_argument
    add("scenes", metavar="SCENE", nargs="*", default=["walker"], help=f"{SCENE_HELP}; walker")
    text = "exponent and mantissa bits; ten from 5,8 to 8,23"
    add("--formats", metavar="E,M", nargs="+", default=FORMATS, help=text)
    add("--frame", metavar="K", help="which one; that a third of the way")
    add("--size", metavar="WxH", default=SIZE, help="in pixels; %(default)s")
    text = "sizes and clocks by format, as JSON; those that come with bkd-sim"
    add("--hardware", metavar="FILE", type=Path, default=MEASURED, help=text)
    add("--only", choices=("formats", "updates"), help="of the two, which run; both")
    scheduler_argument(parser)
    add("--out", metavar="DIR", type=Path, help="folder for all that is made; precision-SCENE")


def run(options) -> int:
    """Error against run time, over float formats and over what updates may leave out."""
    width, height = size_of(options.size, SIZE)
    formats = list(dict.fromkeys(str(format_of(text, "--formats")) for text in options.formats))
    for text in formats:
        machine_of(format_of(text))
    hardware = read_hardware(options.hardware)
    check_matplotlib()
    from sim.study.folder import check_folder, save
    from sim.study.precision import report

    scenes = {spec: load_scene(spec) for spec in options.scenes}
    names = _names(scenes)
    folder = options.out or Path("-".join(["precision", *names.values()]))
    check_folder(folder)
    with sweeps(options.scheduler) as swept:
        cells = [
            {
                "scene": spec,
                "format": fmt,
                "frame": frame_of(options.frame, scene.frames)[0],
                "width": width,
                "height": height,
            }
            for spec, scene in scenes.items()
            for fmt in formats
            if options.only != "updates"
        ]
        rows = rows_of(names, cells, swept("simulating formats", measure, cells), hardware)
        cells = [
            cell
            for spec, scene in scenes.items()
            for cell in update_cells(spec, scene)
            if options.only != "formats"
        ]
        updates = update_rows(names, cells, swept("simulating updates", measure_policy, cells))
    sections = []
    for kind, section, of in (
        ("precision", report.formats_section, rows),
        ("updates", report.updates_section, updates),
    ):
        for name in names.values():
            if own := [row for row in of if row["scene"] == name]:
                sections.append(section(kind if len(names) == 1 else f"{kind}-{name}", own))
    if not sections:
        still = ", ".join(options.scenes)
        raise InputError(f"{still}: nothing moves there, so no update may be left out")
    figures = {
        "provenance": provenance(None, "distributed", "matplotlib"),
        "conclusions": [section.conclusion for section in sections],
        "hardware": asdict(hardware),
        "formats": rows,
        "updates": updates,
    }
    tables = {"precision": (COLUMNS, rows), "updates": (UPDATE_COLUMNS, updates)}
    save(
        folder,
        "precision",
        "Error against run time",
        sections,
        CAPTION,
        {k: of for k, of in tables.items() if of[1]},
        figures,
    )
    for section in sections:
        print_tables(*(grid.shown() for grid in section.tables))
        for text in (*section.notes, section.conclusion):
            print_text(text)
    print_text(f"{folder / 'index.html'}: all of it, with diagrams")
    wrong = [row for row in (*rows, *updates) if row.get("mismatches")]
    for row in wrong:
        of = row.get("policy") or row["format"]
        print(f"{row['scene']}, {of}: {row['mismatches']:,} not the model's", file=sys.stderr)
    return 1 if wrong else 0


def _names(scenes: dict[str, Scene]) -> dict[str, str]:
    """What to call each scene, in tables and in names of files."""
    names = {spec: Path(scene.name).stem.replace(":", "-") for spec, scene in scenes.items()}
    for spec, name in names.items():
        if list(names.values()).count(name) > 1:
            raise InputError(f"{spec}: another scene is called {name} too; study them one by one")
    return names
