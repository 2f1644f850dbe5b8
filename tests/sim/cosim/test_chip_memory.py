"""The simulator's memory on the chip: what is asked of hdl.memory.onchip is asked of it."""

import pytest

from sim.cosim.chip_memory import CHIP_MEMORY, ChipMemory
from tests.harness import CONFIGS, one_of, run_cocotb
from tests.hdl.memory import test_onchip


@pytest.mark.parametrize("name", test_onchip.NAMES)
def test_contract(name, tmp_path, seed):
    units = one_of(
        lambda config: ChipMemory(config, words=test_onchip.WORDS),
        {name: CONFIGS[name] for name in test_onchip.NAMES},
        name,
    )
    module = test_onchip.__name__
    run_cocotb(units, module, tmp_path, seed=seed, sources=[CHIP_MEMORY], UNIT=name)
