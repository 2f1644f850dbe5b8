"""A glTF file and the arrays in it."""

import base64
import json
import struct
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from sim.errors import InputError

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
# Extensions that change where triangles are and that are not read. What else a file may require
# is about materials, light or cameras, or is KHR_mesh_quantization, which is read.
UNREAD = (
    "KHR_draco_mesh_compression",
    "EXT_meshopt_compression",
    "KHR_meshopt_compression",
    "EXT_mesh_gpu_instancing",
)


class Document:
    """A file, its JSON as `gltf` and its accessors as arrays.

    Lists that every file may leave out (nodes, meshes, skins, animations) are there, if empty.

    Raises
    ------
    InputError
        The file's arrays are compressed, or a file beside it is missing.
    """

    def __init__(self, path: Path):
        self.path = path
        self.gltf: dict = {"nodes": [], "meshes": [], "skins": [], "animations": []}
        text, self._binary = split_chunks(path.read_bytes())
        self.gltf.update(json.loads(text))
        if "asset" not in self.gltf:
            raise InputError(f"{path}: is JSON but no glTF; it has no asset")
        for extension in self.gltf.get("extensionsRequired", []):
            self.refuse(extension)
        for view in self.gltf.get("bufferViews", []):
            for extension in view.get("extensions", []):
                self.refuse(extension)
        self._buffers = [self._buffer(buffer) for buffer in self.gltf.get("buffers", [])]

    def refuse(self, extension: str) -> None:
        """Raise the error for an extension that triangles are stored with."""
        if extension in UNREAD:
            raise InputError(
                f"{self.path}: is stored with {extension}; save it uncompressed, without that"
            )

    def _buffer(self, buffer: dict) -> bytes:
        uri = buffer.get("uri")
        if uri is None:
            data = self._binary
        elif uri.startswith("data:"):
            data = base64.b64decode(uri.partition(",")[2])
        else:
            beside = self.path.parent / unquote(uri)
            if not beside.is_file():
                raise InputError(f"{self.path}: needs the file {beside}, which is missing")
            data = beside.read_bytes()
        if len(data) < buffer["byteLength"]:
            raise ValueError(f"a buffer has {len(data)} bytes instead of {buffer['byteLength']}")
        return data

    def array(self, index: int) -> np.ndarray:
        """An accessor (count, width): float64, or int64 where it holds integers that count."""
        accessor = self.gltf["accessors"][index]
        count, width = accessor["count"], WIDTHS[accessor["type"]]
        kind = np.dtype(COMPONENTS[accessor["componentType"]])
        values = np.zeros((count, width), kind)
        if "bufferView" in accessor:
            values = self._elements(accessor, kind, count, width)
        if "sparse" in accessor:
            sparse = accessor["sparse"]
            places = np.dtype(COMPONENTS[sparse["indices"]["componentType"]])
            rows = self._elements(sparse["indices"], places, sparse["count"], 1)[:, 0]
            values[rows] = self._elements(sparse["values"], kind, sparse["count"], width)
        if kind.kind == "f":
            return values.astype(np.float64)
        if accessor.get("normalized"):
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values.astype(np.int64)

    def _elements(self, source: dict, kind: np.dtype, count: int, width: int) -> np.ndarray:
        """A copy of `count` rows of `width` components from a buffer view."""
        view = self.gltf["bufferViews"][source["bufferView"]]
        begin = view.get("byteOffset", 0) + source.get("byteOffset", 0)
        strides = (view.get("byteStride", width * kind.itemsize), kind.itemsize)
        rows = np.ndarray((count, width), kind, self._buffers[view["buffer"]], begin, strides)
        return rows.copy()


def split_chunks(data: bytes) -> tuple[bytes, bytes]:
    """The JSON and the binary chunk of a .glb; all of a .gltf is JSON."""
    if not data.startswith(b"glTF"):
        return data, b""
    _, version, length = struct.unpack_from("<4sII", data)
    if version != 2:
        raise ValueError(f"version {version} of glTF; only 2 is read")
    if len(data) < length:
        raise ValueError(f"{len(data)} bytes of {length}")
    chunks: dict[bytes, bytes] = {}
    place = 12
    while place < length:
        size, kind = struct.unpack_from("<I4s", data, place)
        chunks.setdefault(kind, data[place + 8 : place + 8 + size])
        place += 8 + size
    return chunks[b"JSON"], chunks.get(b"BIN\0", b"")
