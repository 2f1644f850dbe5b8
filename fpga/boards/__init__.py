"""Boards that a machine is built for."""

from fpga.boards.adm_xrc_4lx import ADM_XRC_4LX
from fpga.boards.kc705 import KC705
from fpga.boards.ulx3s import ULX3S

BOARDS = {board.name: board for board in (ADM_XRC_4LX, KC705, ULX3S)}
"""Boards by name."""
