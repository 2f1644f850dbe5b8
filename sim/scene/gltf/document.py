"""A glTF file and the arrays in it."""

import base64
from pathlib import Path
from urllib.parse import unquote

import numpy as np
import pygltflib

from sim.errors import InputError

COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
COMPRESSED = ("KHR_draco_mesh_compression", "EXT_meshopt_compression")


class Document:
    """A file, its JSON as `gltf` and its accessors as arrays.

    Raises
    ------
    InputError
        The file's arrays are compressed.
    """

    def __init__(self, path: Path):
        self.path = path
        loaded = pygltflib.GLTF2().load(str(path))
        if loaded is None:
            raise ValueError("no glTF document")
        self.gltf: pygltflib.GLTF2 = loaded
        for extension in self.gltf.extensionsRequired or []:
            if extension in COMPRESSED:
                raise InputError(f"{path}: is compressed ({extension}); save it uncompressed")
        self._buffers = [self._buffer(buffer) for buffer in self.gltf.buffers]

    def _buffer(self, buffer) -> bytes:
        if buffer.uri is None:
            return bytes(self.gltf.binary_blob() or b"")
        if buffer.uri.startswith("data:"):
            return base64.b64decode(buffer.uri.partition(",")[2])
        return (self.path.parent / unquote(buffer.uri)).read_bytes()

    def array(self, index: int) -> np.ndarray:
        """An accessor (count, width): float64, or int64 where it holds integers that count."""
        accessor = self.gltf.accessors[index]
        width = WIDTHS[accessor.type]
        kind = np.dtype(COMPONENTS[accessor.componentType])
        values = np.zeros((accessor.count, width), kind)
        if accessor.bufferView is not None:
            values = self._elements(
                accessor.bufferView, accessor.byteOffset, kind, accessor.count, width
            )
        if accessor.sparse is not None:
            sparse = accessor.sparse
            places = self._elements(
                sparse.indices.bufferView,
                sparse.indices.byteOffset,
                np.dtype(COMPONENTS[sparse.indices.componentType]),
                sparse.count,
                1,
            )
            values[places[:, 0]] = self._elements(
                sparse.values.bufferView, sparse.values.byteOffset, kind, sparse.count, width
            )
        if kind.kind == "f":
            return values.astype(np.float64)
        if accessor.normalized:
            return np.maximum(values / np.iinfo(kind).max, -1.0)
        return values.astype(np.int64)

    def _elements(self, view: int, offset: int | None, kind, count: int, width: int) -> np.ndarray:
        """A copy of `count` rows of `width` components from a buffer view."""
        place = self.gltf.bufferViews[view]
        begin = (place.byteOffset or 0) + (offset or 0)
        stride = place.byteStride or width * kind.itemsize
        rows = np.ndarray(
            (count, width),
            kind,
            self._buffers[place.buffer],
            begin,
            (stride, kind.itemsize),
        )
        return rows.copy()
