"""Extreme cases: what the machine makes of them, beside Embree and warp.

`cases.cells` says what there is to do, `cases.measure` does one cell, `tables.grids` shows the
results, and `cases.wrong` names what is not as it must be.
"""
