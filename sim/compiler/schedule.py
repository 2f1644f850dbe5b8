"""The order of instructions, so that the interlocks of the update processor cost nothing."""

import numba
import numpy as np

from hdl.config import Config
from hdl.isa import LAYOUTS, Opcode
from sim.compiler import fields
from sim.compiler.allocate import Loads
from sim.compiler.order import Order

LOAD, MERGE3, MERGE2 = Opcode.LOAD.value, Opcode.MERGE3.value, Opcode.MERGE2.value


def schedule(order: Order, loads: Loads, slots: np.ndarray, config: Config) -> np.ndarray:
    """Instructions (n,) uint32 of an update of all nodes, in linear time.

    A list schedule of three queues, each in its order. In each cycle: the next MERGE2, if its
    boxes are there; else the next LOAD, if its merge is within `config.lead` leaves; else the
    next MERGE3, into a free box register; else a LOAD still further ahead. Merges of leaves are
    so hoisted into the cycles in which a MERGE2 would wait for the one before it.

    Parameters
    ----------
    order : Order
        Needs at most `config.box_registers`.
    loads : Loads
        Of the leaves of `order`.
    slots : (K,) int32
        Index in memory of the vertex of each load.
    config : Config

    Raises
    ------
    ValueError
        It needs more.
    """
    if order.boxes > config.box_registers:
        raise ValueError(f"{order.boxes} boxes do not fit {config.box_registers} registers")
    table = _schedule(
        order.children,
        order.axis,
        loads.register,
        loads.leaf,
        loads.release,
        np.ascontiguousarray(slots, np.int32),
        loads.operands,
        config.box_registers,
        config.box_latency,
        config.load_latency,
        config.lead,
    )
    words = np.zeros((len(table), 1), np.uint32)
    for opcode, names in (
        (Opcode.LOAD, ("opcode", "v", "vertex")),
        (Opcode.MERGE3, ("opcode", "b", "v0", "v1", "v2")),
        (Opcode.MERGE2, ("opcode", "b", "b0", "b1", "axis")),
    ):
        rows = np.flatnonzero(table[:, 0] == opcode.value)
        part = np.zeros((len(rows), 1), np.uint32)
        for column, name in enumerate(names):
            fields.put(part, LAYOUTS[opcode][name], table[rows, column])
        words[rows] = part
    return words[:, 0]


@numba.njit(cache=True)
def _emit(table, row, opcode, first, second, third, fourth):
    table[row, 0] = opcode
    table[row, 1] = first
    table[row, 2] = second
    table[row, 3] = third
    table[row, 4] = fourth


@numba.njit(
    "int32[:, ::1](int32[:, ::1], uint8[::1], int32[::1], int32[::1], int32[::1], int32[::1],"
    "int32[:, ::1], int64, int64, int64, int64)",
    cache=True,
)
def _schedule(
    children,
    axis,
    load_register,
    load_leaf,
    load_release,
    load_slot,
    operands,
    box_registers,
    box_latency,
    load_latency,
    lead,
):
    nodes, leaves, loads = len(children), len(operands), len(load_leaf)
    table = np.empty((nodes + leaves + loads, 5), np.int32)
    node = leaf = load = row = 0  # the next of each
    cycle = 0
    vertex_ready = np.zeros(load_register.max() + 1, np.int64)  # cycle, by register
    # Box and the cycle in which it is ready, of the leaves (first) and nodes done so far.
    box = np.empty(leaves + nodes, np.int32)
    box_ready = np.empty(leaves + nodes, np.int64)
    free = np.arange(box_registers - 1, -1, -1)  # a stack
    free_count = box_registers
    while node < nodes:
        left, right = children[node, 0], children[node, 1]
        left = ~left if left < 0 else leaves + left
        right = ~right if right < 0 else leaves + right
        # A leaf right of a leaf comes after it, so the last leaf to be merged tells for both.
        merged = (left >= leaves or left < leaf) and (right >= leaves or right < leaf)
        next_load = load < loads and load_release[load] < leaf
        if merged and box_ready[left] <= cycle and box_ready[right] <= cycle:
            _emit(table, row, MERGE2, box[left], box[left], box[right], axis[node])
            box[leaves + node] = box[left]
            box_ready[leaves + node] = cycle + box_latency
            free[free_count] = box[right]
            free_count += 1
            node += 1
            row += 1
        elif next_load and load_leaf[load] < leaf + lead:
            _emit(table, row, LOAD, load_register[load], load_slot[load], 0, 0)
            vertex_ready[load_register[load]] = cycle + load_latency
            load += 1
            row += 1
        elif (
            leaf < leaves
            and free_count > 0
            and vertex_ready[operands[leaf, 0]] <= cycle
            and vertex_ready[operands[leaf, 1]] <= cycle
            and vertex_ready[operands[leaf, 2]] <= cycle
        ):
            free_count -= 1
            box[leaf] = free[free_count]
            box_ready[leaf] = cycle + box_latency
            v0, v1, v2 = operands[leaf]
            _emit(table, row, MERGE3, box[leaf], v0, v1, v2)
            leaf += 1
            row += 1
        elif next_load:
            _emit(table, row, LOAD, load_register[load], load_slot[load], 0, 0)
            vertex_ready[load_register[load]] = cycle + load_latency
            load += 1
            row += 1
        cycle += 1  # with or without an instruction
    return table
