"""A small scene, and a board that it fits."""

import pytest

from hdl.config import ULX3S
from hdl.fp.format import FloatFormat
from host.link.channel import Channel
from host.session import Board
from sim.prepare import Prepared, prepare, view_of
from sim.scene.camera import auto
from sim.scene.load import load_scene
from tests.host.board import BoardModel
from tests.host.pipes import Wire

SCENE = "walker:428"


def on(model: BoardModel, fmt: FloatFormat | None = None) -> Board:
    """A board object over a wire."""
    wire = Wire(model, rate=1e7, delay=0.001)
    return Board(Channel(wire, clock=wire.clock), fmt)


def view(prepared: Prepared, width: int = 20, height: int = 15):
    """An image of the first frame."""
    pose = prepared.scene.pose(0)
    return view_of(prepared.config.fmt, auto(pose[None], prepared.scene.faces, width, height))


@pytest.fixture(scope="session")
def prepared() -> Prepared:
    """A figure of 428 triangles."""
    return prepare(load_scene(SCENE), ULX3S)


@pytest.fixture(scope="session")
def compiled(prepared):
    """The golden model is: its first run may take longer than hosts wait for an answer."""
    board = on(BoardModel(ULX3S))
    board.upload(prepared)
    board.show(1)
    board.render(view(prepared))


@pytest.fixture
def model(compiled) -> BoardModel:
    """A board as it is after power-up."""
    return BoardModel(ULX3S, 1 << 12)
