"""Stiff motion: scenes whose parts move at very different rates, and what refit makes of them.

sim.study.motion.cells      cells(): what is measured
sim.study.motion.measure    measure(cell) -> result, for sim.study.sweep
sim.study.motion.tables     grids(results)
sim.study.motion.plot       figure(result): cost over frames
"""
