"""Which of several points no other one beats."""

from collections.abc import Sequence


def frontier(points: Sequence[tuple[float, float]]) -> list[int]:
    """Numbers of the points (cost, error) that no other is below in one and not above in the other.

    In the order of their cost, then of their numbers: a Pareto front, by definition, in time
    O(n^2).
    """
    kept = [
        k
        for k, (cost, error) in enumerate(points)
        if not any(c <= cost and e <= error and (c, e) != (cost, error) for c, e in points)
    ]
    return sorted(kept, key=lambda k: points[k][0])
