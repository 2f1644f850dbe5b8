"""FPGA families: how Yosys maps to them, and what a device has."""

from dataclasses import dataclass

RESOURCES = ("LUT", "FF", "multipliers", "block RAM")


@dataclass(frozen=True)
class Family:
    """A family and the device of it that figures are held against.

    Attributes
    ----------
    device : str
    synthesis : str
        Yosys command that makes one module of all; `{top}` is the top module.
    cells : dict
        What a cell takes: (resource, count) by the name of the cell.
    device_has : dict
        Count of each resource.
    lut_inputs : int
    """

    device: str
    synthesis: str
    cells: dict[str, tuple[str, int]]
    device_has: dict[str, int]
    lut_inputs: int


def _cells(luts: dict[str, int], ffs: str, multiplier: str, rams: dict[str, int]) -> dict:
    return (
        {name: ("LUT", count) for name, count in luts.items()}
        | dict.fromkeys(ffs.split(), ("FF", 1))
        | {multiplier: ("multipliers", 1)}
        | {name: ("block RAM", count) for name, count in rams.items()}
    )


XILINX_FFS = "FD FDE FDR FDRE FDS FDSE FDC FDCE FDP FDPE FDRSE FDCPE"
FAMILIES = {
    "xc4v": Family(
        device="Virtex-4 LX160",
        synthesis="synth_xilinx -family xc4v -flatten -top {top}",
        cells=_cells(
            {**{f"LUT{k}": 1 for k in range(1, 5)}, "INV": 1, "RAM16X1D": 2, "SRL16E": 1},
            XILINX_FFS,
            "DSP48",
            {"RAMB16": 1},
        ),
        device_has={"LUT": 135_168, "FF": 135_168, "multipliers": 96, "block RAM": 288},
        lut_inputs=4,
    ),
    "xc7": Family(
        device="Kintex-7 325T",
        synthesis="synth_xilinx -family xc7 -flatten -top {top}",
        cells=_cells(
            {
                **{f"LUT{k}": 1 for k in range(1, 7)},
                **{"INV": 1, "RAM32X1D": 2, "RAM64X1D": 2, "RAM128X1D": 4},
                **{"RAM32M": 4, "RAM64M": 4, "SRL16E": 1, "SRLC32E": 1},
            },
            XILINX_FFS,
            "DSP48E1",
            {"RAMB18E1": 1, "RAMB36E1": 2},
        ),
        device_has={"LUT": 203_800, "FF": 407_600, "multipliers": 840, "block RAM": 890},
        lut_inputs=6,
    ),
    "ecp5": Family(
        device="ECP5-85F",
        synthesis="synth_ecp5 -top {top}",
        cells=_cells(
            {"LUT4": 1, "CCU2C": 2, "TRELLIS_DPR16X4": 6},
            "TRELLIS_FF",
            "MULT18X18D",
            {"DP16KD": 1},
        ),
        device_has={"LUT": 83_640, "FF": 83_640, "multipliers": 156, "block RAM": 208},
        lut_inputs=4,
    ),
}
"""Families by name. Block RAM is counted in 18 kbit, distributed RAM in the LUTs that it takes."""
