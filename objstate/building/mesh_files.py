"""Mesh files: where a URDF's file name points, and the triangles in it."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path
from urllib.parse import unquote

import numpy as np

from objstate.building.model import Mesh
from objstate.errors import BuildingError
from objstate.geometry import FloatArray

FARTHEST = 1e11  # of any unit; coordinates of a country in millimetres are smaller
PACKAGE, FILE = "package://", "file://"
Y_UP = {".glb", ".gltf"}  # glTF 2.0, section 3.4: +Y is up
# as URDF takes them: the axis isn't stated, so they aren't turned
Z_UP = {".stl", ".obj", ".ply", ".off"}
COLLADA = ".dae"  # states its unit and its axis
# COLLADA 1.5, <up_axis>: which of the file's axes, and with which sign, are x, y and z with z up
TURNED = {
    "X_UP": ((1, -1.0), (2, -1.0), (0, 1.0)),
    "Y_UP": ((0, 1.0), (2, -1.0), (1, 1.0)),
    "Z_UP": ((0, 1.0), (1, 1.0), (2, 1.0)),
}
DEFAULT_UP = "Y_UP"  # of a COLLADA file that states none


def resolve(name: str, urdf: Path, where: str) -> Path:
    """The file that ``name`` means in a URDF: a path relative to it, absolute, file:// or package://.

    Raises BuildingError, naming the places looked in, if there is no such file.
    """
    if name.startswith(PACKAGE):
        package, _, rest = name.removeprefix(PACKAGE).partition("/")
        folders = list(_package_folders(package, urdf))
        candidates = [folder / rest for folder in folders if _is_package(folder, package)]
        looked = ", ".join(map(str, dict.fromkeys(folder.parent for folder in folders)))
        cure = f"looked for the package '{package}' in {looked}; add it to ROS_PACKAGE_PATH"
    else:
        candidates = [urdf.parent / unquote(name.removeprefix(FILE))]
        if not name.startswith(FILE):
            candidates = [urdf.parent / name]
        cure = f"looked for {candidates[0]}; correct the file name (relative to the URDF)"
    for candidate in candidates:
        if candidate.is_file():
            return candidate.resolve()
    raise BuildingError(f"Mesh '{name}' of {where} was not found: {cure}.")


def _package_folders(package: str, urdf: Path) -> Iterator[Path]:
    """Folders that may be the package, nearest first: above the URDF, then ROS's own."""
    for above in urdf.resolve().parents:
        yield above
        yield above / package
    for root in filter(None, os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep)):
        yield Path(root)
        yield Path(root) / package
    for prefix in filter(None, os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)):
        yield Path(prefix) / "share" / package


def _is_package(folder: Path, package: str) -> bool:
    """Whether a folder is the package: by its name, or by the name in its package.xml."""
    if folder.name == package:
        return folder.is_dir()
    manifest = folder / "package.xml"
    if not manifest.is_file():
        return False
    from xml.etree import ElementTree

    try:
        return (ElementTree.parse(manifest).findtext("name") or "").strip() == package
    except ElementTree.ParseError:
        return False  # another package's broken manifest is not this building's concern


def load_mesh(path: Path, where: str) -> Mesh:
    """The triangles of a mesh file, z up, in the file's own unit; COLLADA in metres.

    glTF, and COLLADA as it states, are turned to z-up. Raises BuildingError if the format is not
    read, the file is damaged, or it holds no triangles.
    """
    kind = path.suffix.lower()
    if kind not in Y_UP | Z_UP | {COLLADA}:
        formats = ", ".join(sorted(Y_UP | Z_UP | {COLLADA}))
        raise BuildingError(
            f"Mesh {path} of {where} has the format '{kind}', which is not read; "
            f"convert it to one of {formats}."
        )
    if kind == COLLADA and find_spec("collada") is None:
        raise BuildingError(
            f"Mesh {path} of {where} is COLLADA, which needs pycollada; pip install "
            "'objstate[collada]', or convert it to .stl."
        )
    import trimesh

    try:
        loaded = trimesh.load_scene(path).to_mesh()
        vertices = np.asarray(loaded.vertices, dtype=float).reshape(-1, 3)
        faces = np.asarray(loaded.faces, dtype=np.int64).reshape(-1, 3)
    except Exception as error:  # whatever a damaged file raises in the reader
        raise BuildingError(
            f"Mesh {path} of {where} can't be read ({type(error).__name__}: {error}); "
            "export it again."
        ) from error
    if len(faces) == 0 or not (np.abs(vertices) <= FARTHEST).all():
        lack = "no triangles" if len(faces) == 0 else "vertices out of all bounds"
        raise BuildingError(f"Mesh {path} of {where} holds {lack}; export it again.")
    if kind in Y_UP:
        vertices = np.column_stack([vertices[:, 0], -vertices[:, 2], vertices[:, 1]])
    if kind == COLLADA:
        vertices = _metres_up(vertices, *collada_asset(path))
    return Mesh(vertices, faces)


def collada_asset(path: Path) -> tuple[float, str]:
    """The metres in a unit of a COLLADA file, and the axis that points up, as it states them."""
    import collada

    asset = collada.Collada(str(path), ignore=[collada.DaeError]).assetInfo
    return float(asset.unitmeter or 1.0), str(asset.upaxis or DEFAULT_UP)


def _metres_up(vertices: FloatArray, unit: float, up: str) -> FloatArray:
    return np.column_stack([sign * vertices[:, k] * unit for k, sign in TURNED[up]])
