"""A folder of results: pictures, tables, figures, and a page that holds all."""

import csv
import os
from collections.abc import Sequence
from pathlib import Path

from sim.errors import InputError
from sim.files import write_json, written_whole
from sim.study.page import page, picture
from sim.study.provenance import line
from sim.study.section import Section


def check_folder(folder: Path):
    """Refuse a folder that cannot be made or written to, before the work."""
    there = folder if folder.exists() else folder.absolute().parent
    if not (there.is_dir() and os.access(there, os.W_OK)):
        raise InputError(f"--out {folder}: cannot be made; name one in a folder that exists")


def save(
    folder: Path,
    name: str,
    title: str,
    sections: Sequence[Section],
    caption: str,
    csv_tables: dict[str, tuple[Sequence[str], Sequence[dict]]],
    figures: dict,
):
    """Write all files of a study into a folder, each of them whole.

    Parameters
    ----------
    folder : Path
        Made, if it is not there.
    name : str
        Of the .json.
    title, caption : str
        Of index.html.
    sections : sequence of Section
        A .png and .svg of each with a figure, and all of them in index.html.
    csv_tables : dict
        For each .csv its name, its columns and its rows.
    figures : dict
        For the .json; its provenance goes to all other files too, in a .csv as a first line that
        begins with #.
    """
    made = line(figures["provenance"])
    folder.mkdir(exist_ok=True)
    for section in sections:
        if section.figure:
            for kind in ("png", "svg"):
                with written_whole(folder / f"{section.name}.{kind}") as temporary:
                    temporary.write_bytes(picture(section.figure, kind, made))
    for of, (columns, rows) in csv_tables.items():
        with written_whole(folder / f"{of}.csv") as temporary, temporary.open("w") as file:
            file.write(f"# {made}\n")
            writer = csv.DictWriter(file, columns, extrasaction="ignore", lineterminator="\n")
            writer.writeheader()
            writer.writerows(rows)
    write_json(folder / f"{name}.json", figures)
    with written_whole(folder / "index.html") as temporary:
        temporary.write_text(page(title, sections, caption, figures["provenance"]))
