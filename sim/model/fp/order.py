"""Model of hdl.fp.order: the total order of bit patterns."""

import numpy as np

from hdl.fp.format import FloatFormat


def order_key(fmt: FloatFormat, x):
    """Signed integers in the order of the floats `x`: -inf < ... < -0 < +0 < ... < +inf."""
    sign = 1 << (fmt.bits - 1)
    return np.where(x & sign, sign - 1 - x, x)


def from_key(fmt: FloatFormat, key):
    """Bit patterns of order keys: the inverse of `order_key`."""
    sign = 1 << (fmt.bits - 1)
    return np.where(key < 0, sign - 1 - key, key)


def minimum(fmt: FloatFormat, a, b):
    """The smaller of two floats; exact."""
    return np.where(order_key(fmt, b) < order_key(fmt, a), b, a)


def maximum(fmt: FloatFormat, a, b):
    """The larger of two floats; exact."""
    return np.where(order_key(fmt, b) > order_key(fmt, a), b, a)
