"""Work for tests of sweeps: it leaves a trace each time it is done."""

from pathlib import Path
from time import sleep

from sim.errors import InputError


def square(cell: dict) -> dict:
    """Of a number, after a while; a file in `folder` each time it is worked out."""
    sleep(cell.get("seconds", 0))
    if cell["number"] < 0:
        raise InputError(f"{cell['number']} is below 0")
    folder = Path(cell["folder"])
    folder.joinpath(f"{cell['number']}-{len(list(folder.iterdir()))}").touch()
    return {"square": cell["number"] ** 2}
