"""Files that are written whole or not at all, and where what is made once is kept."""

import json
import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from platformdirs import user_cache_path

from sim.errors import InputError


def cache_folder() -> Path:
    """Where builds and results are kept: $BKDTREE_CACHE, or the user's cache folder."""
    return Path(os.environ.get("BKDTREE_CACHE", user_cache_path("bkdtree")))


def check_writable(*files: Path | None):
    """Refuse files that cannot be written, before the work and not after it."""
    named = [file.absolute() for file in files if file and not _is_device(file)]
    for file in files:
        if file and named.count(file.absolute()) > 1:
            raise InputError(f"{file}: is named for two things; give each a file of its own")
        if file and (file.is_dir() or not os.access(file.absolute().parent, os.W_OK)):
            raise InputError(f"{file}: cannot be written; name a file in a folder that exists")


def _is_device(file: Path) -> bool:
    return file.exists() and not (file.is_file() or file.is_dir())


@contextmanager
def written_whole(file: Path) -> Iterator[Path]:
    """A file of the same name in a new folder, to write to; it takes its place at the end.

    A link stays, and its target is replaced. Devices and pipes are written to as they are.
    """
    if _is_device(file):
        yield file
        return
    file = file.resolve()
    with tempfile.TemporaryDirectory(dir=file.absolute().parent) as folder:
        temporary = Path(folder) / file.name
        yield temporary
        temporary.replace(file)


def write_json(file: Path | None, figures: dict):
    """Write figures, if there is a file for them."""
    if file:
        with written_whole(file) as temporary:
            temporary.write_text(json.dumps(figures, indent=1) + "\n")
