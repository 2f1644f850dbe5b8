"""Float formats: the one place that says how many bits a number has."""

from dataclasses import dataclass
from enum import IntEnum

from amaranth.lib import data


class Rounding(IntEnum):
    """Which of the two neighbours of an exact result is taken.

    It is rounded as if exponents had no end. Then, where the result's exponent is out of range:

    ======== ================= =============== =============== =============== ===============
    rounding takes             below smallest  and negative    above largest   and negative
    ======== ================= =============== =============== =============== ===============
    NEAREST  nearest, ties to  +0              -0              +inf            -inf
             the even mantissa
    DOWN     lower             +0              minus smallest  largest         -inf
    UP       higher            smallest        -0              +inf            minus largest
    ======== ================= =============== =============== =============== ===============

    So DOWN <= exact <= UP, always. Where the exact result could be any value, as of inf - inf,
    DOWN is -inf and UP is +inf.
    """

    NEAREST = 0
    DOWN = 1
    UP = 2


@dataclass(frozen=True)
class FloatFormat:
    """Sign, biased exponent, mantissa with a hidden one.

    Exponent 0 is zero, of either sign; exponent all ones is infinity. There are no subnormals and
    there is no NaN. Zero and infinity are canonical with mantissa 0; only such are ever produced.

    Parameters
    ----------
    exp_bits : int
        2 to 8; in `difference` and `product` up to 10.
    man_bits : int
        1 to 23; in `product` up to 47.

    Raises
    ------
    ValueError
        Outside of these ranges: what a 32-bit float holds and all that is narrower, and what the
        exact sum of two products of such numbers asks for.
    """

    exp_bits: int
    man_bits: int

    def __post_init__(self):
        if not (2 <= self.exp_bits <= 10 and 1 <= self.man_bits <= 47):
            raise ValueError(
                f"a float format has 2 to 10 exponent bits and 1 to 47 mantissa bits, not {self}"
            )

    def __str__(self) -> str:
        return f"{self.exp_bits},{self.man_bits}"

    @property
    def bits(self) -> int:
        """Bits of a number."""
        return 1 + self.exp_bits + self.man_bits

    @property
    def bias(self) -> int:
        return 2 ** (self.exp_bits - 1) - 1

    @property
    def min_exp(self) -> int:
        """The smallest normal is 2 ** min_exp."""
        return 1 - self.bias

    @property
    def max_exp(self) -> int:
        """The largest number is below 2 ** (max_exp + 1)."""
        return self.bias

    @property
    def product(self) -> "FloatFormat":
        """The format that holds the product of two finite numbers of this one, exactly."""
        return FloatFormat(self.exp_bits + 2, 2 * self.man_bits + 1)

    @property
    def difference(self) -> "FloatFormat":
        """The format of the difference of two products: zero only if they are equal.

        Raises
        ------
        ValueError
            There are more mantissa bits than the exponents of a difference reach down.
        """
        if self.man_bits > self.bias + 2:
            raise ValueError(f"format {self}: a difference of products may be below all numbers")
        return FloatFormat(self.exp_bits + 2, self.man_bits)

    @property
    def layout(self) -> data.StructLayout:
        return data.StructLayout({"man": self.man_bits, "exp": self.exp_bits, "sign": 1})


F24 = FloatFormat(exp_bits=7, man_bits=16)
"""The fp24 of Direct3D 9 hardware. The split of the 2006 board's 24 bits is not published."""


def power_of_two(fmt: FloatFormat, exponent: int) -> data.Const:
    """The pattern of a power of two: infinity or zero where out of range."""
    top = (1 << fmt.exp_bits) - 1
    return fmt.layout.const({"exp": min(max(exponent + fmt.bias, 0), top)})
