"""Writing buildings: a URDF, and beside it the meshes of walls and objects."""

from __future__ import annotations

import re
import shutil
from collections.abc import Collection, Iterator, Mapping
from contextlib import contextmanager
from html import escape
from pathlib import Path

import numpy as np

from objstate.building.door_table import Door
from objstate.building.leaves import leaf_of_door
from objstate.building.model import Building, Kind, Mesh, MovableObject
from objstate.building.shapes import Box
from objstate.building.sidecar import SUFFIX, sidecar_path
from objstate.building.written import LIST_FILE, foreign_in, list_files
from objstate.errors import BuildingError
from objstate.geometry import FloatArray, rpy_from_rotation
from objstate.outputs import whole

WALLS_FILE = "walls.stl"
SHAPE_FILE = "shape_{}.stl"  # of an object, numbered from 1
DOORS_FILE, DECISIONS_FILE, LEARN_FILE = "doors.csv", "decisions.json", "learn.json"
CALIBRATION, REPORT_FILE = "calibration.yaml", "report.html"
BESIDE = (
    DOORS_FILE,
    DECISIONS_FILE,
    LEARN_FILE,
    CALIBRATION,
    REPORT_FILE,
)  # of a building that was edited, or learnt
# how a URDF begins that versions wrote which kept no list of their files
WITHOUT_LIST = re.compile(
    r'<\?xml version="1\.0"\?>\n<robot name="[^"\n]*">\n  <link name="walls">\n    <collision>\n'
    rf'      <origin xyz="[^"\n]*"/>\n      <geometry><mesh filename="{re.escape(WALLS_FILE)}"/>'
)
SAME = 1e-9  # m: corners no further from those of a box are its
JOINTS = {Kind.HINGED: "revolute", Kind.SLIDING: "prismatic", Kind.PLANAR: "planar"}


def check_target(out: Path, overwrite: bool) -> None:
    """Raise BuildingError if ``out`` exists, unless ``overwrite`` is set and objstate wrote it."""
    if not out.exists():
        return
    if not overwrite:
        raise BuildingError(
            f"{out} exists already; choose another folder, or overwrite it (--overwrite)."
        )
    if fault := foreign_in(out, _fault_without_list):
        raise BuildingError(
            f"{out} won't be overwritten, as {fault}; choose another folder, or move it away."
        )


def check_output(
    out: Path, overwrite: bool, *inputs: str | Path, cure: str = "choose another folder"
) -> None:
    """The same for what is made of some ``inputs``.

    Raises BuildingError also where ``out`` holds one of these, or what a person decided, for which
    the message names the ``cure``.
    """
    check_target(out, overwrite)
    check_apart(out, *inputs)
    if (out / DECISIONS_FILE).exists():
        raise BuildingError(
            f"{out / DECISIONS_FILE} holds what a person decided on doors, so {out} won't be "
            f"overwritten; {cure}."
        )


def check_apart(out: Path, *inputs: str | Path) -> None:
    """Raise BuildingError if ``out`` holds one of some inputs."""
    for each in inputs:
        if Path(each).resolve().is_relative_to(out.resolve()):
            raise BuildingError(
                f"{each} lies in {out}, which would replace it; give another --out."
            )


def check_in_place(folder: Path) -> None:
    """Raise BuildingError if a building's folder holds what an edit in place would lose."""
    if fault := foreign_in(folder, _fault_without_list, kept_in_place(folder)):
        raise BuildingError(
            f"{folder} isn't edited in place, as {fault}; say with --out to which other folder the "
            "edited building goes."
        )


def kept_in_place(folder: Path) -> set[str]:
    """Names of the files that stay where a building's folder is edited in place, whose ever."""
    return {*BESIDE, *(sidecar_path(urdf).name for urdf in folder.glob("*.urdf"))}


def _fault_without_list(folder: Path) -> str | None:
    """What of a folder isn't a building as versions wrote it that kept no list of its files."""
    models = list(folder.glob("*.urdf"))
    if len(models) != 1 or not WITHOUT_LIST.match(models[0].read_text("utf-8", errors="replace")):
        return f"it has no {LIST_FILE}, in which objstate lists the files that it wrote"
    known = {WALLS_FILE, models[0].name, models[0].stem + SUFFIX, *BESIDE}
    known |= {path.name for path in folder.glob(SHAPE_FILE.format("*"))}
    foreign = sorted(path for path in folder.iterdir() if path.name not in known)
    return f"objstate didn't write {foreign[0]}" if foreign else None


@contextmanager
def building_folder(out: Path, keep: Collection[str] = ()) -> Iterator[Path]:
    """A new folder to fill, which becomes ``out`` when the block ends without an error.

    Its files, and those of each folder in it, are listed, so that they may be replaced later. What
    ``out`` held is replaced, but for files to ``keep`` that the block doesn't write; ask
    ``check_target`` before. Raises ResultError.
    """

    def is_replaceable(folder: Path) -> bool:
        return foreign_in(folder, _fault_without_list, keep) is None

    with whole(out, overwrite=True, replaceable=is_replaceable) as made:
        made.mkdir()
        yield made
        for name in keep:
            if (out / name).is_file() and not (made / name).exists():
                shutil.copyfile(out / name, made / name)
        for folder in (made, *(each for each in made.iterdir() if each.is_dir())):
            list_files(folder)


def write_building(
    out: Path,
    name: str,
    walls: Mesh,
    doors: list[Door],
    thickness: float,
    height: float,
    sidecar: str | None = None,
) -> Path:
    """Write ``name``.urdf, its walls and its sidecar to the folder ``out``, or nothing.

    The doors' leaves are boxes of ``thickness`` and ``height``, m. What ``out`` held
    is replaced; ask ``check_target`` before. Raises ResultError if it can't be written.
    """
    leaves = {door.name: leaf_of_door(door, thickness, height) for door in doors}
    return write_buildings(out, {".": Building(name, walls, leaves)}, {".": sidecar})[0]


def write_buildings(
    out: Path,
    buildings: Mapping[str, Building],
    sidecars: Mapping[str, str | None],
    beside: Mapping[str, str] | None = None,
    keep: Collection[str] = (),
) -> list[Path]:
    """Write each building, with its sidecar if it has one, to a folder in ``out``; all or nothing.

    The keys are the folders, ``.`` for ``out`` itself. ``beside`` are the names, of ``BESIDE``, and
    texts of files that are written to ``out`` as well. What ``out`` held is replaced, but for files
    to ``keep`` that aren't written anew; ask ``check_target`` before. Raises ResultError if they
    can't be written.
    """
    with building_folder(out, keep) as made:
        for folder, building in buildings.items():
            (made / folder).mkdir(exist_ok=True)
            _write(made / folder, building, sidecars.get(folder))
        for name, text in (beside or {}).items():
            (made / name).write_text(text, encoding="utf-8")
    return [out / folder / f"{building.name}.urdf" for folder, building in buildings.items()]


def _write(folder: Path, building: Building, sidecar: str | None) -> None:
    vertices = building.walls.vertices
    start = vertices.min(axis=0) if len(vertices) else np.zeros(3)
    write_mesh(folder / WALLS_FILE, Mesh(vertices - start, building.walls.faces))
    shapes = _Shapes(folder)
    objects = [_object_elements(item, shapes) for item in building.objects.values()]
    urdf = _urdf(building.name, start, objects)
    (folder / f"{building.name}.urdf").write_text(urdf, encoding="utf-8")
    if sidecar is not None:
        (folder / f"{building.name}{SUFFIX}").write_text(sidecar, encoding="utf-8")


def write_mesh(path: Path, mesh: Mesh) -> None:
    """STL has float32 numbers, so the mesh had better be about the origin."""
    import trimesh

    trimesh.Trimesh(mesh.vertices, mesh.faces, process=False).export(path)


class _Shapes:
    """The files of objects' meshes, one for all objects that share a mesh."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files: dict[int, str] = {}  # by the identity of a mesh

    def geometry(self, mesh: Mesh) -> tuple[FloatArray, str]:
        """Where a shape lies in its link, (3,) m, and its URDF element."""
        corners = box_corners(mesh)
        if corners is not None:
            low, high = corners
            return (low + high) / 2, f'<box size="{_numbers(high - low)}"/>'
        if id(mesh) not in self._files:
            name = SHAPE_FILE.format(len(self._files) + 1)
            write_mesh(self._folder / name, mesh)
            self._files[id(mesh)] = name
        return np.zeros(3), f'<mesh filename="{self._files[id(mesh)]}"/>'


def box_corners(mesh: Mesh) -> tuple[FloatArray, FloatArray] | None:
    """The lowest and highest corner (3,) m of a mesh that is a box along its axes; else None."""
    if len(mesh.vertices) == 0:
        return None
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    box = Box(tuple(high - low)).mesh()
    if mesh.faces.shape != box.faces.shape or mesh.vertices.shape != box.vertices.shape:
        return None
    if not np.array_equal(mesh.faces, box.faces):
        return None
    is_same = np.allclose(mesh.vertices, box.vertices + (low + high) / 2, rtol=0, atol=SAME)
    return (low, high) if is_same else None


def _urdf(name: str, start: FloatArray, objects: list[str]) -> str:
    walls = f"""\
  <link name="walls">
    <collision>
      <origin xyz="{_numbers(start)}"/>
      <geometry><mesh filename="{WALLS_FILE}"/></geometry>
    </collision>
  </link>
"""
    parts = "".join([walls, *objects])
    return f'<?xml version="1.0"?>\n<robot name="{escape(name)}">\n{parts}</robot>\n'


def _object_elements(item: MovableObject, shapes: _Shapes) -> str:
    """The link and joint of one object."""
    name, link = escape(item.name), escape(f"{item.name}_{_part(item.kind)}")
    place, geometry = shapes.geometry(item.mesh)
    kind = "continuous" if item.wraps else JOINTS[item.kind]
    rpy = _numbers(rpy_from_rotation(item.origin[:3, :3]))
    limit = f'<limit lower="{item.lower:.12g}" upper="{item.upper:.12g}" effort="0" velocity="0"/>'
    has_limit = item.kind is not Kind.PLANAR and not item.wraps
    return f"""\
  <link name="{link}">
    <collision>
      <origin xyz="{_numbers(place)}"/>
      <geometry>{geometry}</geometry>
    </collision>
  </link>
  <joint name="{name}" type="{kind}">
    <parent link="walls"/>
    <child link="{link}"/>
    <origin xyz="{_numbers(item.origin[:3, 3])}" rpy="{rpy}"/>
    <axis xyz="{_numbers(item.axis)}"/>
""" + (f"    {limit}\n  </joint>\n" if has_limit else "  </joint>\n")


def _part(kind: Kind) -> str:
    return "body" if kind is Kind.PLANAR else "leaf"


def _numbers(values: FloatArray | tuple[float, ...]) -> str:
    return " ".join(f"{float(value) + 0.0:.12g}" for value in values)
