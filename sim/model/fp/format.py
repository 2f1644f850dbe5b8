"""Model of hdl.fp.format: bit patterns of float64 numbers, and back."""

import numpy as np

from hdl.fp.format import FloatFormat


def encode(fmt: FloatFormat, x) -> np.ndarray:
    """Bit patterns of the numbers nearest to `x`.

    One rounding, to nearest even, as if exponents had no end; then what is below the smallest
    normal becomes zero and what is above the largest number infinity. Signs are kept, of zero too.

    Parameters
    ----------
    fmt : FloatFormat
    x : array of float64

    Returns
    -------
    int64 array of the shape of `x`

    Raises
    ------
    ValueError
        `x` has a NaN: no format holds one.
    """
    x = np.asarray(x, np.float64)
    if np.isnan(x).any():
        raise ValueError("NaN has no bit pattern")
    finite = np.isfinite(x)
    fraction, exponent = np.frexp(np.where(finite, np.abs(x), 1.0))
    # Significand as an integer of man_bits + 1 bits; rint rounds to nearest even.
    significand = np.rint(np.ldexp(fraction, fmt.man_bits + 1)).astype(np.int64)
    carry = significand >> (fmt.man_bits + 1)
    exponent = exponent.astype(np.int64) - 1 + carry
    significand >>= carry
    mantissa = significand - (1 << fmt.man_bits)
    magnitude = ((exponent + fmt.bias) << fmt.man_bits) + mantissa
    magnitude = np.where((exponent < fmt.min_exp) | (x == 0), 0, magnitude)
    infinity = ((1 << fmt.exp_bits) - 1) << fmt.man_bits
    magnitude = np.where(~finite | (exponent > fmt.max_exp), infinity, magnitude)
    return magnitude | (np.signbit(x).astype(np.int64) << (fmt.bits - 1))


def decode(fmt: FloatFormat, bits) -> np.ndarray:
    """Numbers, exact in float64, of bit patterns: the inverse of `encode`."""
    bits = np.asarray(bits, np.int64)
    mantissa = bits & ((1 << fmt.man_bits) - 1)
    exponent = (bits >> fmt.man_bits) & ((1 << fmt.exp_bits) - 1)
    magnitude = np.ldexp(
        1.0 + mantissa / 2.0**fmt.man_bits, np.asarray(exponent - fmt.bias, np.int32)
    )
    magnitude = np.where(exponent == 0, 0.0, magnitude)
    magnitude = np.where(exponent == (1 << fmt.exp_bits) - 1, np.inf, magnitude)
    return np.where(bits >> (fmt.bits - 1), -magnitude, magnitude)
