"""Float formats: the one place that says how many bits a number has."""

from dataclasses import dataclass

from amaranth.lib import data


@dataclass(frozen=True)
class FloatFormat:
    """Sign, biased exponent, mantissa with a hidden one.

    Exponent 0 is zero, of either sign; exponent all ones is infinity. There are no subnormals and
    there is no NaN. Zero and infinity are canonical with mantissa 0; only such are ever produced.

    Parameters
    ----------
    exp_bits : int
        2 to 8.
    man_bits : int
        1 to 23.

    Raises
    ------
    ValueError
        Outside of these ranges, which hold what a 32-bit float does and all that is narrower.
    """

    exp_bits: int
    man_bits: int

    def __post_init__(self):
        if not (2 <= self.exp_bits <= 8 and 1 <= self.man_bits <= 23):
            raise ValueError(
                f"a float format has 2 to 8 exponent bits and 1 to 23 mantissa bits, not {self}"
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
    def layout(self) -> data.StructLayout:
        return data.StructLayout({"man": self.man_bits, "exp": self.exp_bits, "sign": 1})


F24 = FloatFormat(exp_bits=7, man_bits=16)
"""The fp24 of Direct3D 9 hardware. The split of the 2006 board's 24 bits is not published."""
