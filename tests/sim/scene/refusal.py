"""What load_scene says of what it refuses."""

from pathlib import Path

import pytest

from sim.errors import InputError
from sim.scene.load import load_scene


def refusal(spec, **options) -> str:
    """The message: one line that names the scene."""
    with pytest.raises(InputError) as error:
        load_scene(str(spec), **options)
    line = str(error.value)
    assert line.startswith((f"{spec}: ", f"{Path(spec).name}: ")) and "\n" not in line, line
    return line
