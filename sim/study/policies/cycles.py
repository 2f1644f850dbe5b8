"""Update cycles of a policy, without rays."""

from collections.abc import Sequence

from sim.cosim.machine import Machine, Timing
from sim.prepare import Prepared
from sim.study.policies.memory import place, room, words_written
from sim.study.policies.plan import plan


def update_cycles(prepared: Prepared, policy: str, frames: Sequence[int]) -> list[int]:
    """Cycles of the update of each frame: its program in the Verilog, and what the host writes.

    The words that the host writes for the update take one a cycle; vertices are not counted. The
    update processor alone is simulated, on a memory of the latency that it is made for.

    Parameters
    ----------
    prepared : Prepared
    policy : str
        Of sim.study.policies.
    frames : sequence of int
        One after the other, as the policy sees them.

    Raises
    ------
    InputError
        There is no such policy, or the machine is too small for the scene.
    SimulationError
        The simulator fails.
    """
    timing = Timing(latency=prepared.config.latency)
    cycles, before = [], None
    with Machine(prepared.config, room(prepared), timing) as machine:
        for frame in plan(prepared, policy, frames):
            program, image = place(machine, frame, before), frame.image
            spent = words_written(frame, before)
            if len(frame.program):
                length = len(frame.program)
                counters = machine.update(program, length, image.vertices_at, image.nodes_at)
                spent += sum(counters.values())
            cycles.append(spent)
            before = frame
    return cycles
