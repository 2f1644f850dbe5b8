"""Model of hdl.rays.step: four rays at a node, and what is to be visited next."""

from numba import njit

from hdl.rays.packet import RAYS
from sim.model.rays.planes import clip_bits


@njit(cache=True)
def step_bits(exp_bits, man_bits, rows, axis, bounds, near, far, best, nears, fars, overflows):
    """Clip rays to both children: which are reached, and the one that goes first (0 is left).

    A child that no ray reaches is left out. Of two, the one goes first that the first ray in both
    enters first: the left one, if equal or if no ray is in both.

    `rows` (4, COLUMNS) is of sim.model.rays.setup, `bounds` (4,) of the node; near, far, best (4,)
    are order keys, and so are nears and fars (2, 4), which it fills. Sets flags of `overflows`.
    """
    reached_left = reached_right = left_first = decided = False
    for ray in range(RAYS):
        in_child = [False, False]
        for side in range(2):
            nears[side, ray], fars[side, ray] = clip_bits(
                exp_bits,
                man_bits,
                rows[ray],
                axis,
                bounds[2 * side],
                bounds[2 * side + 1],
                near[ray],
                far[ray],
                overflows,
            )
            in_child[side] = nears[side, ray] <= min(fars[side, ray], best[ray])
        reached_left = reached_left or in_child[0]
        reached_right = reached_right or in_child[1]
        if in_child[0] and in_child[1] and not decided:
            decided = True
            left_first = nears[0, ray] <= nears[1, ray]
    if reached_left and reached_right:
        first = 0 if left_first or not decided else 1
    else:
        first = 0 if reached_left else 1
    return reached_left, reached_right, first
