"""A URDF becomes the building that its author meant, or an error that says how to mend it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from objstate.building import load_building
from objstate.building.model import Kind
from objstate.errors import BuildingError

WALL = (
    '<link name="walls"><collision><origin xyz="0 2 1.25"/>'
    '<geometry><box size="6 0.2 2.5"/></geometry></collision></link>'
)
LEAF = (
    '<link name="leaf"><collision><origin xyz="0.45 0 1"/>'
    '<geometry><box size="0.9 0.04 2"/></geometry></collision></link>'
)
HINGE = (
    '<joint name="door" type="revolute"><parent link="walls"/><child link="leaf"/>'
    '<origin xyz="1 2 0" rpy="0 0 1.5707963267948966"/><axis xyz="0 0 2"/>'
    '<limit lower="-0.1" upper="1.6"/></joint>'
)


def leaf(name: str) -> str:
    return LEAF.replace('"leaf"', f'"{name}"')


NO_LIMIT = HINGE.replace('<limit lower="-0.1" upper="1.6"/>', "")


def write(folder: Path, *elements: str) -> Path:
    path = folder / "office.urdf"
    path.write_text(
        '<?xml version="1.0"?>\n<robot name="office">\n' + "\n".join(elements) + "\n</robot>"
    )
    return path


def test_a_wall_and_a_door_stand_where_the_urdf_puts_them(tmp_path: Path) -> None:
    building = load_building(write(tmp_path, WALL, LEAF, HINGE))
    assert building.name == "office"
    np.testing.assert_allclose(building.walls.vertices.min(axis=0), [-3, 1.9, 0], atol=1e-12)
    np.testing.assert_allclose(building.walls.vertices.max(axis=0), [3, 2.1, 2.5], atol=1e-12)
    door = building["door"]
    assert (door.kind, door.lower, door.upper, door.wraps) == (Kind.HINGED, -0.1, 1.6, False)
    np.testing.assert_allclose(door.axis, [0, 0, 1])
    tip = np.array([0.9, 0.0, 1.0, 1.0])
    closed, quarter = door.transforms(np.array([[0.0], [np.pi / 2]])) @ tip
    np.testing.assert_allclose(closed[:3], [1, 2.9, 1], atol=1e-12)
    np.testing.assert_allclose(quarter[:3], [0.1, 2, 1], atol=1e-12)


def test_an_upper_limit_that_is_absent_is_zero_where_that_leaves_a_range(tmp_path: Path) -> None:
    backward = NO_LIMIT.replace("</joint>", '<limit lower="-1.5"/></joint>')
    door = load_building(write(tmp_path, WALL, LEAF, backward))["door"]
    assert (door.lower, door.upper) == (-1.5, 0.0)


def test_every_joint_type_becomes_its_kind(tmp_path: Path) -> None:
    links = [leaf(name) for name in ("a", "b", "c")]
    joints = [
        '<joint name="spin" type="continuous"><parent link="walls"/><child link="a"/></joint>',
        '<joint name="slide" type="prismatic"><parent link="walls"/><child link="b"/>'
        '<axis xyz="0 1 0"/><limit upper="0.8"/></joint>',
        '<joint name="desk" type="planar"><parent link="walls"/><child link="c"/>'
        '<origin xyz="2 -1 0" rpy="0 0 0.5"/></joint>',
    ]
    building = load_building(write(tmp_path, WALL, *links, *joints))
    assert list(building.objects) == ["spin", "slide", "desk"]
    assert building["spin"].wraps
    assert (building["spin"].lower, building["spin"].upper) == (-np.pi, np.pi)
    assert (building["slide"].lower, building["slide"].upper) == (0.0, 0.8)
    np.testing.assert_allclose(building["desk"].home, [2, -1, 0.5])


def test_fixed_joints_extend_walls_and_objects(tmp_path: Path) -> None:
    more = [
        '<link name="wing"><collision><geometry><box size="1 1 1"/></geometry></collision></link>',
        '<joint name="w" type="fixed"><parent link="walls"/><child link="wing"/>'
        '<origin xyz="0 0 0" rpy="0 0 1.5707963267948966"/></joint>',
        leaf("leaf2"),
        '<joint name="far" type="revolute"><parent link="wing"/><child link="leaf2"/>'
        '<origin xyz="2 0 0"/><axis xyz="0 0 1"/><limit upper="1"/></joint>',
        '<link name="handle"><collision><geometry><sphere radius="0.05"/></geometry></collision></link>',
        '<joint name="h" type="fixed"><parent link="leaf"/><child link="handle"/>'
        '<origin xyz="0.8 0.1 1"/></joint>',
    ]
    building = load_building(write(tmp_path, *more, WALL, LEAF, HINGE))
    assert len(building.walls.faces) == 24
    np.testing.assert_allclose(building["far"].origin[:3, 3], [0, 2, 0], atol=1e-12)
    assert building["door"].mesh.vertices[:, 1].max() == pytest.approx(0.15)


def test_collision_geometry_goes_before_visual_and_there_may_be_several(tmp_path: Path) -> None:
    def solid(tag: str, size: float) -> str:
        return f'<{tag}><geometry><box size="{size} {size} {size}"/></geometry></{tag}>'

    both = f'<link name="walls">{solid("visual", 9)}{solid("collision", 1)}{solid("collision", 2)}</link>'
    building = load_building(write(tmp_path, both))
    assert len(building.walls.faces) == 24
    assert np.ptp(building.walls.vertices[:, 0]) == 2
    seen = load_building(write(tmp_path, f'<link name="walls">{solid("visual", 9)}</link>'))
    assert np.ptp(seen.walls.vertices[:, 0]) == 9


def test_ten_thousand_equal_doors_share_one_leaf(tmp_path: Path) -> None:
    doors = [
        LEAF.replace('"leaf"', f'"leaf{i}"')
        + HINGE.replace('"door"', f'"door{i}"').replace('"leaf"', f'"leaf{i}"')
        for i in range(10_000)
    ]
    building = load_building(write(tmp_path, WALL, *doors))
    assert len({id(door.mesh) for door in building.objects.values()}) == 1
    assert len(building.objects) == 10_000


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply", "glb", "gltf"])
def test_meshes_of_every_format_come_out_z_up_and_scaled(tmp_path: Path, suffix: str) -> None:
    box = trimesh.creation.box((2000.0, 400.0, 3000.0))
    if suffix in ("glb", "gltf"):  # stored y-up, as glTF has it
        box.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    _save(box, tmp_path / "meshes", f"wall.{suffix}")
    link = _mesh_link(f"meshes/wall.{suffix}", 'scale="0.001 0.001 0.001"')
    walls = load_building(write(tmp_path, link)).walls
    np.testing.assert_allclose(np.ptp(walls.vertices, axis=0), [2, 0.4, 3], atol=1e-6)


def test_parts_of_a_gltf_scene_stand_where_its_nodes_put_them(tmp_path: Path) -> None:
    scene = trimesh.Scene([trimesh.creation.box((1, 1, 1))])
    aside = trimesh.transformations.translation_matrix([5.0, 2.0, -3.0])  # y-up
    scene.add_geometry(trimesh.creation.box((1, 1, 1)), transform=aside)
    scene.export(tmp_path / "scene.glb")
    walls = load_building(write(tmp_path, _mesh_link("scene.glb"))).walls
    np.testing.assert_allclose(walls.vertices.max(axis=0), [5.5, 3.5, 2.5], atol=1e-6)
    assert len(walls.faces) == 24


def test_mesh_paths_of_every_sort_are_found(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    package = tmp_path / "checkout"
    (package / "urdf").mkdir(parents=True)
    (package / "package.xml").write_text("<package><name>my_building</name></package>")
    _save(trimesh.creation.box((1, 1, 1)), package / "meshes", "a wall.stl")
    spaced = (package / "meshes" / "a wall.stl").as_posix().replace(" ", "%20")
    elsewhere = tmp_path / "elsewhere"
    _save(trimesh.creation.box((1, 1, 1)), elsewhere / "other" / "meshes", "b.stl")
    monkeypatch.setenv("ROS_PACKAGE_PATH", str(elsewhere))
    for name in (
        "../meshes/a wall.stl",
        f"file://{spaced}",
        "package://my_building/meshes/a wall.stl",
        "package://other/meshes/b.stl",
    ):
        building = load_building(write(package / "urdf", _mesh_link(name)))
        assert len(building.walls.faces) == 12
    with pytest.raises(BuildingError, match="ROS_PACKAGE_PATH"):
        load_building(write(package / "urdf", _mesh_link("package://nowhere/meshes/b.stl")))


REFUSED = {
    "no shape": (
        (WALL, '<link name="leaf"/>', HINGE),
        r"Door 'door' in office.urdf, line 5 has no shape; give its link 'leaf' a <collision>",
    ),
    "no shape of a sliding door": (
        (WALL, '<link name="leaf"/>', HINGE.replace("revolute", "prismatic")),
        "Door 'door' in office.urdf, line 5 has no shape",
    ),
    "degrees of a frame": (
        (WALL, LEAF, HINGE.replace("1.5707963267948966", "90")),
        "rpy in office.urdf, line 5: 90 rad is more than a whole turn .* write 1.571",
    ),
    "degrees of a limit": (
        (WALL, LEAF, HINGE.replace("1.6", "90")),
        "upper in office.urdf, line 5: 90 rad is more than a whole turn .* write 1.571",
    ),
    "no limit": (
        (WALL, LEAF, NO_LIMIT),
        r"Door 'door' has no upper limit in office.urdf, line 5; "
        r'add <limit lower="0" upper="1.57"/>\.',
    ),
    "lower limit alone": (
        (WALL, LEAF, NO_LIMIT.replace("</joint>", '<limit lower="0"/></joint>')),
        "no upper limit",
    ),
    "effort alone": (
        (WALL, LEAF, NO_LIMIT.replace("</joint>", '<limit effort="1" velocity="1"/></joint>')),
        "no upper limit",
    ),
    "limits exchanged": (
        (WALL, LEAF, HINGE.replace('"1.6"', '"-1.6"')),
        "lower limit -0.1 above its upper limit -1.6",
    ),
    "no room to move": ((WALL, LEAF, HINGE.replace('"1.6"', '"-0.1"')), 'type="fixed"'),
    "no axis": ((WALL, LEAF, HINGE.replace("0 0 2", "0 0 0")), "axis of length zero"),
    "unknown type": ((WALL, LEAF, HINGE.replace("revolute", "hinge")), "unknown type 'hinge'"),
    "floating": ((WALL, LEAF, HINGE.replace("revolute", "floating")), 'type="planar"'),
    "same link twice": ((WALL, WALL), "second time"),
    "same joint twice": ((WALL, LEAF, HINGE, HINGE), "second time"),
    "unknown link": ((WALL, HINGE), "'leaf', which does not exist"),
    "two roots": ((WALL, LEAF), "2 root links"),
    "two parents": ((WALL, LEAF, HINGE, HINGE.replace('"door"', '"d2"')), "hangs on two joints"),
    "number that is none": ((WALL.replace("6 0.2", "6 O.2"),), "line 3"),
    "no extent": ((WALL.replace("6 0.2", "6 0"),), "no extent"),
    "no geometry": (('<link name="w"><collision/></link>',), "no <geometry>"),
    "odd geometry": (
        ('<link name="w"><collision><geometry><capsule/></geometry></collision></link>',),
        "<capsule>",
    ),
    "no mesh": (
        (
            '<link name="w"><collision><geometry><mesh filename="w.stl"/></geometry></collision></link>',
        ),
        "was not found",
    ),
    "nameless link": (("<link/>",), "has no name"),
    "nameless parent": ((WALL, LEAF, HINGE.replace('parent link="walls"', "parent")), "no link"),
    "no links": ((), "holds no links"),
    "macros": (('<xacro:wall length="${l}"/>',), "run|expand"),
    "nested": (
        (
            WALL,
            LEAF,
            HINGE,
            '<link name="flap"/><joint name="cat_flap" type="revolute"><parent link="leaf"/>'
            '<child link="flap"/><limit upper="1"/></joint>',
        ),
        "'cat_flap' in office.urdf, line 6 hangs below joint 'door'",
    ),
    "circle": (
        (
            WALL,
            '<link name="a"/><link name="b"/>',
            '<joint name="ab" type="fixed"><parent link="a"/><child link="b"/></joint>',
            '<joint name="ba" type="fixed"><parent link="b"/><child link="a"/></joint>',
        ),
        "circle through 'a', 'b'",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_cannot_be_meant_is_refused_with_its_cure(tmp_path: Path, case: str) -> None:
    elements, message = REFUSED[case]
    with pytest.raises(BuildingError, match=message):
        load_building(write(tmp_path, *elements))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "line 1"),
        (b"\x00\xff\x01", "line 1"),
        (b"<robot>\n<link>\n</robot>", "line 3"),
        (b'<?xml version="1.0" encoding="klingon"?><robot/>', "not well-formed"),
        (b"<html/>", "not <robot>"),
    ],
)
def test_files_that_are_no_urdf_are_refused(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "bad.urdf"
    path.write_bytes(content)
    with pytest.raises(BuildingError, match=message):
        load_building(path)


def test_a_map_is_refused_and_what_makes_a_building_of_it_named(tmp_path: Path) -> None:
    (tmp_path / "map.yaml").write_text("image: map.pgm\n")
    with pytest.raises(BuildingError, match="objstate building from-map"):
        load_building(tmp_path / "map.yaml")


def test_a_folder_stands_for_the_only_urdf_that_it_holds(tmp_path: Path) -> None:
    with pytest.raises(BuildingError, match="holds 0 URDF files"):
        load_building(tmp_path)
    corridor = Path(__file__).resolve().parents[2] / "models" / "corridor"
    assert (
        load_building(corridor).objects.keys()
        == load_building(corridor / "corridor.urdf").objects.keys()
    )
    (tmp_path / "office.urdf").touch()
    (tmp_path / "other.urdf").touch()
    with pytest.raises(BuildingError, match="holds 2 URDF files; give that of the building"):
        load_building(tmp_path)


@pytest.mark.parametrize("given", [None, ["office.urdf"]])
def test_what_is_no_path_is_refused(given: Any) -> None:
    with pytest.raises(TypeError, match="is no path of a building; give the path of its URDF"):
        load_building(given)


def test_a_path_that_leads_nowhere_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BuildingError, match="can't be read"):
        load_building(tmp_path / "none.urdf")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("bad.stl", b"solid nothing", "can't be read|no triangles"),
        ("bad.glb", b"glTF\x02\x00", "can't be read"),
        ("bad.fbx", b"Kaydara", "'.fbx', which is not read"),
        ("cloud.obj", b"v 0 0 0\nv 1 0 0\n", "can't be read|no triangles"),
    ],
)
def test_meshes_that_hold_no_triangles_are_refused(
    tmp_path: Path, name: str, content: bytes, message: str
) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(BuildingError, match=message):
        load_building(write(tmp_path, _mesh_link(name)))


def _mesh_link(filename: str, attributes: str = "") -> str:
    return (
        '<link name="walls"><collision><geometry>'
        f'<mesh filename="{filename}" {attributes}/></geometry></collision></link>'
    )


def _save(mesh: trimesh.Trimesh, folder: Path, name: str) -> None:
    folder.mkdir(parents=True)
    exported = mesh.export(file_type=Path(name).suffix[1:])
    files = exported if isinstance(exported, dict) else {name: exported}
    for part, content in files.items():
        target = folder / (name if part == "model.gltf" else part)
        target.write_bytes(content.encode() if isinstance(content, str) else content)
