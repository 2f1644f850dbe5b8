"""A small scene, and a board that it fits."""

import pytest

from hdl.config import ULX3S
from sim.prepare import Prepared, prepare
from sim.scene.load import load_scene
from tests.host.board import BoardModel

SCENE = "walker:428"


@pytest.fixture(scope="session")
def prepared() -> Prepared:
    """A figure of 428 triangles."""
    return prepare(load_scene(SCENE), ULX3S)


@pytest.fixture
def model() -> BoardModel:
    """A board as it is after power-up."""
    return BoardModel(ULX3S, 1 << 12)
