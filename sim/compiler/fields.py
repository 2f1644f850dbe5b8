"""Columns of numbers into the fields of memory words, and back."""

import numpy as np
from amaranth.lib import data


def put(words: np.ndarray, field: data.Field, values, base: int = 0):
    """Write `values` (n,) into a field of `words` (n, limbs) uint32 whose bits there are zero.

    `base` is the offset in bits of the layout that `field` belongs to.

    Raises
    ------
    ValueError
        A value is negative, too wide or no integer: nothing is ever cut off in silence.
    """
    values = np.asarray(values)
    if values.size and values.dtype.kind not in "biu":
        raise ValueError(f"a field holds integers, not {values.dtype}")
    values = values.astype(np.int64)
    if values.size and (values.min() < 0 or values.max() >> field.width):
        raise ValueError(f"{field.width} bits do not hold {values.min()} to {values.max()}")
    limb, shift = divmod(base + field.offset, 32)
    shifted = values.astype(np.uint64) << np.uint64(shift)
    words[:, limb] |= shifted.astype(np.uint32)
    if shift + field.width > 32:
        words[:, limb + 1] |= (shifted >> np.uint64(32)).astype(np.uint32)


def get(words: np.ndarray, field: data.Field, base: int = 0) -> np.ndarray:
    """Values (n,) int64 of a field of at most 32 bits of `words` (n, limbs) uint32."""
    limb, shift = divmod(base + field.offset, 32)
    value = words[:, limb].astype(np.uint64)
    if shift + field.width > 32:
        value |= words[:, limb + 1].astype(np.uint64) << np.uint64(32)
    mask = np.uint64((1 << field.width) - 1)
    return ((value >> np.uint64(shift)) & mask).astype(np.int64)
