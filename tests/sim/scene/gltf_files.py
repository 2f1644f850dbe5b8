"""glTF files put together by hand: JSON as the specification has it, numbers packed by struct."""

import base64
import json
import struct
from pathlib import Path

import numpy as np

from sim.scene.load import load_scene
from sim.scene.scene import Scene

BYTE, UBYTE, SHORT, USHORT, UINT, FLOAT = 5120, 5121, 5122, 5123, 5125, 5126
LETTERS = {BYTE: "b", UBYTE: "B", SHORT: "h", USHORT: "H", UINT: "I", FLOAT: "f"}
TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}

CORNERS = [(0, 0, 0), (1, 0, 0), (0, 2, 0.5)]  # one triangle, exact in float32


class File:
    """A file that grows: every method returns the index of what it adds."""

    def __init__(self):
        self.data = b""
        self.json = {"asset": {"version": "2.0"}, "accessors": [], "bufferViews": []}

    def add(self, key: str, **entry) -> int:
        self.json.setdefault(key, []).append(entry)
        return len(self.json[key]) - 1

    def view(self, data: bytes, **more) -> int:
        self.data += bytes(-len(self.data) % 4)
        start = len(self.data)
        self.data += data
        return self.add("bufferViews", buffer=0, byteOffset=start, byteLength=len(data), **more)

    def accessor(self, rows, component: int = FLOAT, **more) -> int:
        rows = [row if isinstance(row, (tuple, list)) else (row,) for row in rows]
        view = self.view(pack(rows, component))
        return self.add(
            "accessors",
            bufferView=view,
            componentType=component,
            count=len(rows),
            type=TYPES[len(rows[0])],
            **more,
        )

    def mesh(self, corners=CORNERS, mode: int | None = None, **attributes) -> int:
        """A mesh of one primitive without indices."""
        primitive = {"attributes": {"POSITION": self.accessor(corners)} | attributes}
        return self.add("meshes", primitives=[primitive | ({} if mode is None else {"mode": mode})])

    def animation(self, node: int, path: str, times, values, interpolation=None, **more) -> int:
        """An animation of one channel."""
        sampler = {"input": self.accessor(times), "output": self.accessor(values)}
        sampler |= {"interpolation": interpolation} if interpolation else {}
        channel = {"sampler": 0, "target": {"node": node, "path": path}}
        return self.add("animations", samplers=[sampler], channels=[channel], **more)

    def text(self) -> str:
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        return json.dumps(self.json | {"buffers": [{"byteLength": len(self.data), "uri": uri}]})

    def save(self, folder: Path, name: str = "a.gltf") -> Path:
        (folder / name).write_text(self.text())
        return folder / name

    def save_binary(self, folder: Path, name: str = "a.glb") -> Path:
        head = json.dumps(self.json | {"buffers": [{"byteLength": len(self.data)}]}).encode()
        head += b" " * (-len(head) % 4)
        body = self.data + bytes(-len(self.data) % 4)
        chunks = struct.pack("<I4s", len(head), b"JSON") + head
        chunks += struct.pack("<I4s", len(body), b"BIN\0") + body
        whole = struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks
        (folder / name).write_bytes(whole)
        return folder / name

    def load(self, folder: Path, **options) -> Scene:
        return load_scene(str(self.save(folder)), **options)


def pack(rows, component: int) -> bytes:
    return b"".join(struct.pack(f"<{len(row)}{LETTERS[component]}", *row) for row in rows)


def corners(scene: Scene, frame: int = 0) -> np.ndarray:
    """Corners of all triangles (T, 3, 3): whatever the order and the merging of vertices."""
    return scene.pose(frame)[scene.faces]


def hamilton(a, b) -> tuple:
    """Product of quaternions (x, y, z, w), by i² = j² = k² = ijk = -1."""
    ax, ay, az, aw = a
    bx, by, bz, bw = b
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def turned(q, point) -> np.ndarray:
    """A point turned by a quaternion: q p q*."""
    return np.array(hamilton(hamilton(q, (*point, 0)), (-q[0], -q[1], -q[2], q[3]))[:3])


def about(axis, degrees: float) -> tuple:
    """The unit quaternion of a turn."""
    half = np.deg2rad(degrees) / 2
    axis = np.array(axis) / np.linalg.norm(axis)
    return (*(float(x) for x in np.sin(half) * axis), float(np.cos(half)))
