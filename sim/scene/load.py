"""From what a user names to a scene."""

from pathlib import Path

from sim.errors import InputError
from sim.scene.builtin.figures import FIGURES, build_figure
from sim.scene.cache import load_cache
from sim.scene.gltf.load import load_gltf
from sim.scene.merge import merge_vertices
from sim.scene.meshfile import MESH_SUFFIXES, load_mesh
from sim.scene.scene import Scene
from sim.scene.sequence import is_sequence, load_sequence

GLTF_SUFFIXES = {".gltf", ".glb"}


def load_scene(
    spec: str,
    *,
    fps: float | None = None,
    animation: str | None = None,
    period: int | None = None,
) -> Scene:
    """Load the scene that `spec` names.

    Parameters
    ----------
    spec : str
        A vertex cache (`.npz` with `faces` and `vertices`), a glTF file, any other mesh file that
        trimesh reads, a folder or a pattern of numbered mesh files (`walk_*.obj`), or a built-in
        figure and the number of triangles wanted (`walker`, `walker:80k`). A file or folder that
        is called like a figure is reached as `./walker`.
    fps : float
        glTF only: frames a second at which the animation is sampled, 24 if not given.
    animation : str
        glTF only: name or number of the animation, the first if not given.
    period : int
        Built-in figures only: frames in one period of the motion, 24 if not given.

    Raises
    ------
    InputError
        One line that names the file and what is wrong with it.

    """
    path = Path(spec)
    suffix = path.suffix.lower()
    figure = spec.partition(":")[0] in FIGURES
    gltf = not figure and suffix in GLTF_SUFFIXES
    if period is not None and not figure:
        raise InputError(f"{spec}: period is for built-in figures; files have their own")
    for option, value in (("fps", fps), ("animation", animation)):
        if value is not None and not gltf:
            raise InputError(f"{spec}: {option} is for glTF files (.gltf, .glb); leave it out")

    if figure:
        return build_figure(spec, 24 if period is None else period)
    if is_sequence(spec):
        return merge_vertices(load_sequence(spec))
    if not path.is_file():
        raise InputError(
            f"{spec}: no such file, folder or built-in figure (figures: {', '.join(FIGURES)})"
        )
    if gltf:
        return merge_vertices(load_gltf(path, 24.0 if fps is None else fps, animation))
    if suffix == ".npz":
        return merge_vertices(load_cache(path))
    if suffix in MESH_SUFFIXES:
        return merge_vertices(load_mesh(path))
    known = ", ".join(sorted(MESH_SUFFIXES | GLTF_SUFFIXES | {".npz"}))
    raise InputError(f"{spec}: cannot read a '{suffix}' file; known are {known}")
