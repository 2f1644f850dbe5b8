"""Libraries that not everyone has."""

from importlib.util import find_spec

from sim.errors import InputError


def check_matplotlib():
    """Refuse diagrams without the library that draws them."""
    if find_spec("matplotlib") is None:
        raise InputError("diagrams need matplotlib: pip install 'bkdtree[study]'")
