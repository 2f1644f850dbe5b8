"""The first frame above a limit, found by bisection."""

import pytest

from sim.tree.rebuild import first_above


@pytest.mark.parametrize("first", range(1, 31))
def test_the_first_frame_is_found_in_few_steps(first):
    asked = []

    def value(frame: int) -> float:
        asked.append(frame)
        return 1.5 if frame >= first else 1.0

    samples = [0, 10, 20, 30]
    values = [value(frame) for frame in samples]
    asked.clear()
    assert first_above(samples, values, value, 1.0) == first
    assert len(asked) <= 4


def test_none_and_the_first_sample():
    def refused(frame: int) -> float:
        raise AssertionError(frame)

    assert first_above([3, 9], [1.0, 1.0], refused, 1.0) is None
    assert first_above([3, 9], [1.1, 0.0], refused, 1.0) == 3
    assert first_above([3, 4], [1.0, 1.1], refused, 1.0) == 4
