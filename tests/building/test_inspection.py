"""Inspection shows what is in a building and names each thing that is wrong with it."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

from objstate.building import inspect_building, load_building
from objstate.errors import BuildingError
from objstate.run.inputs import BuildingInput


def box(size: str, xyz: str) -> str:
    return f'<collision><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></collision>'


def walls(gap: float = 0.9) -> str:
    """A room of 8 by 6 m; in its north wall a doorway from x = 0 to ``gap``."""
    right = 4 - gap
    return (
        '<link name="walls">'
        + box("8 0.2 2.5", "0 -3 1.25")
        + box("0.2 6 2.5", "-4 0 1.25")
        + box("0.2 6 2.5", "4 0 1.25")
        + box("4 0.2 2.5", "-2 3 1.25")
        + box(f"{right} 0.2 2.5", f"{4 - right / 2} 3 1.25")
        + "</link>"
    )


def door(length: float = 0.9, height: float = 2.0, low: float = 0.0) -> str:
    xyz = f"{length / 2} 0 {low + height / 2}"
    return f'<link name="leaf">{box(f"{length} 0.04 {height}", xyz)}</link>'


def hinge(xyz: str = "0 3 0", axis: str = "0 0 1", limit: str = '<limit upper="1.57"/>') -> str:
    return (
        '<joint name="door" type="revolute"><parent link="walls"/><child link="leaf"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


def desk(xyz: str = "0 0 0", axis: str = "") -> str:
    return (
        f'<link name="top">{box("1.6 0.8 0.75", "0 0 0.375")}</link>'
        '<joint name="desk" type="planar"><parent link="walls"/><child link="top"/>'
        f'<origin xyz="{xyz}"/>{axis}</joint>'
    )


def write(folder: Path, *elements: str) -> Path:
    path = folder / "office.urdf"
    path.write_text('<robot name="office">\n' + "\n".join(elements) + "\n</robot>")
    return path


def test_a_sound_building_is_shown_without_problems(tmp_path: Path) -> None:
    summary = inspect_building(write(tmp_path, walls(), door(), hinge(), desk("-2 -1 0")))
    assert summary.problems == []
    assert summary.name == "office"
    assert summary.extent == ((-4.1, -3.1, 0.0), (4.1, 3.1, 2.5))
    leaf, table = summary.objects
    assert (leaf.name, leaf.kind, leaf.lower, leaf.upper) == ("door", "hinged", 0.0, 1.57)
    assert leaf.position == (0.0, 3.0, 0.0)
    assert leaf.reach == pytest.approx(0.9, abs=1e-3)
    assert leaf.outline_length == pytest.approx(1.88)
    assert (table.kind, table.outline_length) == ("planar", pytest.approx(4.8))


PROBLEMS: dict[str, tuple[tuple[str, ...], str]] = {
    "leaf too long": (
        (walls(gap=0.7), door(), hinge()),
        r"leaf of 'door' is 0.90 m long, but a wall stands 0.70 m from its hinge",
    ),
    "no doorway": ((walls(), door(), hinge("-3 3 0")), "'door' stands inside the walls"),
    "far from walls": ((walls(), door(), hinge("0 0 0")), "2.90 m away from any wall"),
    "hinge leans": ((walls(), door(), hinge(axis="1 0 1")), "leans by 45 degrees"),
    "degrees": ((walls(), door(), hinge(limit='<limit upper="90"/>')), "upper in .*1.571"),
    "below the laser": ((walls(), door(height=0.2), hinge()), "not cut by a laser 0.3 m"),
    "above the laser": ((walls(), door(low=0.4), hinge()), "not cut by a laser 0.3 m"),
    "no shape": ((walls(), '<link name="leaf"/>', hinge()), "Door 'door' in .* has no shape"),
    "no shape of a desk": (
        (
            walls(),
            '<link name="top"/><joint name="desk" type="planar"><parent link="walls"/>'
            '<child link="top"/></joint>',
        ),
        "'desk' has no shape",
    ),
    "no walls": (('<link name="walls"/>', door(), hinge()), "building has no walls"),
    "in the wall": ((walls(), desk("0 -2.8 0")), "'desk' starts inside the walls"),
    "desk on a slope": (
        (walls(), desk(axis='<axis xyz="1 0 0"/>')),
        "plane that is not the floor",
    ),
    "walls in the air": (
        (f'<link name="walls">{box("4 4 1", "0 0 5")}</link>',),
        "reach from 4.50 to 5.50 m",
    ),
    "no limit": ((walls(), door(), hinge(limit="")), "'door' has no upper limit"),
    "two leaves in one doorway": (
        (
            walls(),
            door(),
            hinge(),
            door().replace('"leaf"', '"other"'),
            hinge("0.9 3 0")
            .replace('xyz="0.9 3 0"', 'xyz="0.9 3 0" rpy="0 0 3.141593"')
            .replace('"leaf"', '"other"')
            .replace('"door"', '"back"'),
        ),
        "'door' and 'back' overlap when closed",
    ),
    "slides away": (
        (
            walls(),
            door(),
            hinge(axis="1 0 0", limit='<limit upper="8"/>').replace("revolute", "prismatic"),
        ),
        "'door' slides by 8.00 m, but measures 0.90 m along its way",
    ),
    "two roots": ((walls(), door()), "2 root links"),
    "circle": (
        (
            '<link name="a"/><link name="b"/>'
            '<joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint>'
            '<joint name="ba" type="fixed"><parent link="b"/><child link="a"/></joint>',
        ),
        "circle",
    ),
}


@pytest.mark.parametrize("case", PROBLEMS)
def test_each_thing_that_is_wrong_is_named_alone_and_with_its_cure(
    tmp_path: Path, case: str
) -> None:
    elements, sentence = PROBLEMS[case]
    summary = inspect_building(write(tmp_path, *elements))
    (problem,) = summary.problems
    assert re.search(sentence, problem)
    assert problem.endswith(".")
    assert ";" in problem


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        ("building_error: {wall_std: 0.03}", "wall_std_m"),
        ("building_error: {wall_std_m: -0.03}", "wall_std_m"),
        ("building_error:\n\twall_std_m: 0.03", "not valid YAML"),
        ("building_error: {wall_std_m: '0,03'}", "wall_std_m"),
        (
            "building_error: {doors: {gone: {hinge_std_m: 0.1, bearing_std_deg: 1}}}",
            "names 'gone', which is no object",
        ),
    ],
)
def test_what_is_wrong_beside_the_urdf_is_named(tmp_path: Path, words: str, sentence: str) -> None:
    urdf = write(tmp_path, walls(), door(), hinge())
    urdf.with_name("office.building.yaml").write_text(words)
    (problem,) = inspect_building(urdf).problems
    assert "office.building.yaml" in problem
    assert re.search(sentence, problem)


def test_a_desk_that_only_touches_a_wall_is_fine(tmp_path: Path) -> None:
    assert inspect_building(write(tmp_path, walls(), desk("-3.1 -2.5 0"))).problems == []


def test_a_building_in_millimetres_is_not_estimated_with(tmp_path: Path) -> None:
    urdf = write(tmp_path, walls())
    assert BuildingInput.read(urdf).model.name
    mesh = load_building(urdf).walls
    trimesh.Trimesh(1000.0 * mesh.vertices, mesh.faces).export(tmp_path / "walls.stl")
    shape = '<collision><geometry><mesh filename="walls.stl"/></geometry></collision>'
    urdf.write_text(f'<robot name="large"><link name="walls">{shape}</link></robot>')
    with pytest.raises(BuildingError, match="looks like millimetres; give metres"):
        BuildingInput.read(urdf)


def turned_y_up(mesh: trimesh.Trimesh) -> None:
    mesh.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        (lambda mesh: mesh.apply_scale(1000.0), "looks like millimetres"),
        (turned_y_up, "drawn y-up"),
        (lambda mesh: None, None),
    ],
)
def test_walls_in_the_wrong_unit_or_on_their_side_are_noticed(
    tmp_path: Path, change: Callable[[trimesh.Trimesh], None], sentence: str | None
) -> None:
    building = load_building(write(tmp_path, walls()))
    mesh = trimesh.Trimesh(building.walls.vertices, building.walls.faces)
    change(mesh)
    mesh.export(tmp_path / "walls.stl")
    link = (
        '<link name="walls"><collision><geometry><mesh filename="walls.stl"/></geometry>'
        "</collision></link>"
    )
    problems = inspect_building(write(tmp_path, link)).problems
    assert [sentence in problem for problem in problems] == ([True] if sentence else [])


def test_what_is_refused_is_still_shown_as_far_as_it_can_be(tmp_path: Path) -> None:
    path = write(tmp_path, walls(), door(), hinge(limit=""), desk("-2 -1 0"))
    with pytest.raises(BuildingError):
        load_building(path)
    summary = inspect_building(path)
    assert [item.name for item in summary.objects] == ["door", "desk"]
    assert summary.wall_faces == 60


def test_what_is_no_urdf_is_refused(tmp_path: Path) -> None:
    (tmp_path / "x.urdf").write_text("<html/>")
    for path in (tmp_path / "x.urdf", tmp_path / "none.urdf"):
        with pytest.raises(BuildingError):
            inspect_building(path)
