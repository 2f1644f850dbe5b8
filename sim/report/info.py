"""What a scene, its tree and its program look like, before anything runs."""

import numpy as np
from rich.table import Table

from hdl.isa import LAYOUTS, Opcode
from sim.compiler import fields
from sim.console import table
from sim.prepare import Prepared
from sim.tree.cost import cost, refit
from sim.tree.shape import depth


def scene_info(prepared: Prepared) -> dict:
    """Figures of a prepared scene; sizes in memory words, box in units of the source."""
    scene, image = prepared.scene, prepared.image
    vertices = scene.pose(prepared.frames[0])
    used = vertices[scene.faces]
    box = np.stack([used.min(axis=(0, 1)), used.max(axis=(0, 1))])
    words = image.instructions.reshape(-1, 1)
    opcodes = fields.get(words, LAYOUTS[Opcode.LOAD]["opcode"])
    return {
        "scene": scene.name,
        "triangles": len(scene.faces),
        "vertices": len(vertices),
        "vertices_used": len(image.vertices),
        "frames": len(prepared.frames),
        "box": prepared.normalised.source_points(box).tolist(),
        "centre": prepared.normalised.centre.tolist(),
        "scale_exponent": prepared.normalised.exponent,
        "format": str(prepared.config.fmt),
        "depth": depth(prepared.tree),
        "sah_cost": cost(prepared.tree, refit(prepared.tree, vertices, scene.faces), box),
        "box_registers": image.order.boxes,
        "instructions": {op.name: int((opcodes == op.value).sum()) for op in Opcode},
        "memory_words": {
            "program": image.vertices_at,
            "vertices": len(image.vertices),
            "triangles": len(image.corners),
            "nodes": image.nodes,
        },
        "word_bits": 32 * image.limbs,
        "build_seconds": prepared.build_seconds,
        "compile_seconds": prepared.compile_seconds,
    }


def info_tables(figures: dict) -> list[Table]:
    """What `bkd-sim info` prints."""
    low, high = figures["box"]
    sizes = [f"{b - a:.6g}" for a, b in zip(low, high, strict=True)]
    mesh = [
        ("triangles", f"{figures['triangles']:,}"),
        ("vertices, in use", f"{figures['vertices']:,}, {figures['vertices_used']:,}"),
        ("frames", f"{figures['frames']:,}"),
        ("size of the first frame", " x ".join(sizes)),
        ("centre of all frames", ", ".join(f"{c:.6g}" for c in figures["centre"])),
        ("scaled by", f"2^{-figures['scale_exponent']}"),
        ("float format", figures["format"]),
    ]
    triangles = figures["triangles"]
    tree = [
        ("levels", f"{figures['depth']}"),
        ("SAH cost: cycles of a random line", f"{figures['sah_cost']:.2f}"),
        ("box registers that its order needs", f"{figures['box_registers']}"),
        ("built in", f"{figures['build_seconds']:.3f} s"),
        ("compiled in", f"{figures['compile_seconds']:.3f} s"),
    ]
    program = [
        (name, f"{count:,}", f"{count / triangles:.3f}")
        for name, count in figures["instructions"].items()
        if count
    ]
    words = figures["memory_words"]
    memory = [
        (name, f"{count:,}", f"{count * figures['word_bits'] // 8:,}")
        for name, count in [*words.items(), ("in all", sum(words.values()))]
    ]
    return [
        table(figures["scene"], mesh),
        table("Tree", tree),
        *(
            [table("Program", program, header=("", "instructions", "a triangle"))]
            if program
            else []
        ),
        table("Memory", memory, header=("", f"words of {figures['word_bits']} bits", "bytes")),
    ]
