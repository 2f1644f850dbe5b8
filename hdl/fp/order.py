"""The total order of floats: the only thing that bounds need."""

from amaranth import *


def order_key(x):
    """Unsigned value that orders as the float `x` does: combinational, one inverter a bit.

    The order is -inf < ... < -0 < +0 < ... < +inf, total over all bit patterns, so that minimum
    and maximum are exact and do not depend on the order of their operands.

    Parameters
    ----------
    x : View of FloatFormat.layout

    Returns
    -------
    Value of as many bits as the format
    """
    return Mux(x.sign, ~x.as_value(), Cat(x.man, x.exp, 1))


def less(a, b):
    """One bit: float `a` is before float `b` in the total order."""
    return order_key(a) < order_key(b)
