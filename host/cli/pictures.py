"""Where pictures go: a folder, a file each, or one file for all; and a viewer."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from sim.errors import InputError
from sim.files import check_writable
from sim.report.picture import check_picture_file, save

VIEWER = {"darwin": "open", "linux": "xdg-open"}.get(sys.platform)
"""The command that opens a file; on Windows Python does."""


def check_out(out: Path, frames: int):
    """Refuse a place that pictures cannot go to, before they are made."""
    if not is_folder(out):
        check_writable(out)
        check_picture_file(out, frames)
    elif out.exists() and not (out.is_dir() and os.access(out, os.W_OK)):
        raise InputError(f"{out}: is no folder to write to; name another by --out")
    elif not os.access(out.absolute().parent, os.W_OK):
        raise InputError(f"{out}: cannot be written; name a folder in one that exists")


def check_viewer(out: Path):
    """Refuse to show where there is no viewer."""
    if not hasattr(os, "startfile") and not (VIEWER and shutil.which(VIEWER)):
        raise InputError(f"--show: {VIEWER or 'a viewer'} is not installed; open {out} yourself")


def is_folder(out: Path) -> bool:
    """Pictures go to a folder of this name: it has no suffix, or is one."""
    return not out.suffix or out.is_dir()


def add_to_folder(out: Path, frame: int, picture: np.ndarray):
    """Write the picture of a frame to a folder, whole or not at all."""
    out.mkdir(exist_ok=True)
    save(out / f"frame_{frame:04}.png", [picture])


def show(out: Path):
    """Open pictures in the system's viewer."""
    if hasattr(os, "startfile"):
        os.startfile(out)  # type: ignore[attr-defined]
    elif VIEWER:
        quiet = subprocess.DEVNULL
        subprocess.Popen([VIEWER, out], stdout=quiet, stderr=quiet, start_new_session=True)
