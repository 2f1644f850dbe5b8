"""What stays beside each other."""

import numpy as np

from sim.parts.adjacent import adjacent


def boxes(*rows):
    """Lowest corners of unit boxes, by pose and piece, as positions on x."""
    low = np.zeros((len(rows), len(rows[0]), 3))
    low[:, :, 0] = rows
    return low, low + 1


def test_boxes_that_meet_in_all_poses_are_one_group():
    low, high = boxes([0, 0.5, 1.4, 4, 5], [7, 7.5, 8, 0, 1])
    assert adjacent(low, high, np.ones(5, bool)).tolist() == [0, 0, 0, 1, 1]
    low, high = boxes([0, 0.5, 1.4, 4, 5], [7, 7.5, 9, 0, 1])
    assert adjacent(low, high, np.ones(5, bool)).tolist() == [0, 0, 1, 2, 2]


def test_small_pieces_join_large_ones_or_all_others_that_are_small():
    low, high = boxes([0.0, 0.5, 10, 10.5, 20])
    large = np.array([True, False, False, False, False])
    assert adjacent(low, high, large).tolist() == [0, 0, 1, 1, 1]
    assert adjacent(low, high, ~large).tolist() == [0, 0, 1, 1, 2]
    assert adjacent(low, high, np.zeros(5, bool)).tolist() == [0] * 5
