"""First hits in exact rationals, triangle by triangle: what sim.oracle.trace has to find."""

from fractions import Fraction


def exact(vector) -> list[Fraction]:
    return [Fraction(float(x)) for x in vector]


def minus(a, b):
    return [p - q for p, q in zip(a, b, strict=True)]


def dot(a, b):
    return sum(p * q for p, q in zip(a, b, strict=True))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def determinant(a, b, c) -> Fraction:
    return dot(cross(a, b), c)


def meet(corners, origin, direction) -> Fraction | None:
    """Where a line meets a triangle, in directions; edges and corners count."""
    a, b, c = (minus(corner, origin) for corner in corners)
    edges = [determinant(p, q, direction) for p, q in ((b, c), (c, a), (a, b))]
    if min(edges) < 0 < max(edges) or not any(edges):
        return None
    normal = cross(minus(b, a), minus(c, a))
    return dot(normal, a) / dot(normal, direction)


def first_hits(corners, origin, direction, t_min: float, t_max: float):
    """(t, triangles that are hit there); (None, []) where nothing is hit."""
    origin, direction = exact(origin), exact(direction)
    hits = []
    for number, triangle in enumerate(corners):
        t = meet([exact(corner) for corner in triangle], origin, direction)
        if t is not None and t_min <= t <= t_max:
            hits.append((t, number))
    first = min(hits)[0] if hits else None
    return first, [number for t, number in hits if t == first]
