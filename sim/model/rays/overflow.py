"""Where finite numbers have become infinite: flags that stay, as in hdl.rays.caster.overflows."""

import numpy as np
from numba import njit

SETUP, PLANES, TRIANGLES, TRANSFORM = range(4)
"""Places in an array of flags: all of the ray path but the camera."""


@njit(cache=True)
def no_overflows():
    """Flags of which none is set."""
    return np.zeros(4, np.bool_)
