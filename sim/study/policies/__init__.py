"""What an update may leave out: policies, what they cost in the Verilog, and what they lose.

A policy is a text:

============  ====================================================================================
every         a refit of every frame: the reference
every-K       a refit of every K-th frame; bounds grown in between
moved-E       a refit of the leaves with a vertex that lies farther than E, on an axis, from where
              it was when the leaf's bounds were made; all bounds grown by what is left. E is in
              units of the normalised scene, which lies in [-1, 1]
rebuild-K     a new tree from the host every K frames, and a refit of the others
sah-F         a new tree when the SAH cost of the tree is F times what it was when it was new
stale-K       as every-K, but bounds do not grow: it loses hits
============  ====================================================================================

Vertices travel to memory every frame, whatever the policy, and triangles are tested where they
are: only bounds get old. At the first of the frames every policy makes all bounds: a new tree, if
it is one that builds trees. The host's time for a tree is not counted, but the words that it
writes are, one a cycle.

To grow boxes costs no update: rays see all of them larger by one margin anyway, a field of the
job. So they all grow by what the vertex has moved that is farthest from where it was.

sim.study.policies.measure
    measure(cell) -> result, for sim.study.sweep
sim.study.policies.cycles
    update_cycles(prepared, policy, frames) -> list[int], without rays
sim.study.policies.policy
    POLICIES, those that a study compares
    parse(policy) -> (kind, number); InputError if there is no such policy

Keys of a cell and of a result are listed at `measure`.
"""
