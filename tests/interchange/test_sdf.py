"""SDF worlds: frames, joints, includes, and what stands still or moves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from objstate.building import inspect_building, load_building, outline
from objstate.building.model import Building, Kind, MovableObject
from objstate.building.shapes import Box
from objstate.errors import BuildingError
from objstate.geometry import FloatArray
from objstate.interchange import ImportOptions, ImportResult, import_building


def box(size: str, pose: str = "0 0 0 0 0 0", tag: str = "collision") -> str:
    shape = f"<geometry><box><size>{size}</size></box></geometry>"
    return f'<{tag} name="c"><pose>{pose}</pose>{shape}</{tag}>'


def model(name: str, content: str, pose: str = "0 0 0 0 0 0", static: bool = False) -> str:
    return (
        f'<model name="{name}"><static>{str(static).lower()}</static><pose>{pose}</pose>'
        f"{content}</model>"
    )


WALL = model(
    "wall", f'<link name="l">{box("4 0.1 2.5", "0 0 1.25 0 0 0")}</link>', "0 3 0 0 0 0", True
)

# as rmf_building_map_tools makes them: hung at the middle of the leaf, which is 1 m wide
DOOR = """
<link name="right"><pose>0 0 1.1 0 0 0</pose>{leaf}</link>
<joint name="right_joint" type="revolute"><parent>world</parent><child>right</child>
<axis><xyz>0 0 -1</xyz><limit><lower>0</lower><upper>1.57</upper></limit></axis>
<pose>0.5 0 0 0 0 0</pose></joint>
""".format(leaf=box("1 0.03 2.2"))


def save(folder: Path, *models: str, version: str = "1.9", name: str = "home.world") -> Path:
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    world = "".join(models)
    path.write_text(f'<sdf version="{version}"><world name="w">{world}</world></sdf>')
    return path


def save_model(folder: Path, name: str, content: str, version: str = "1.9") -> None:
    (folder / name).mkdir(parents=True)
    text = f'<sdf version="{version}">{content}</sdf>'
    (folder / name / "model.sdf").write_text(text)
    config = (
        f'<model><sdf version="1.4">old.sdf</sdf><sdf version="{version}">model.sdf</sdf></model>'
    )
    (folder / name / "model.config").write_text(config)


def imported(
    folder: Path, *models: str, options: ImportOptions | None = None, version: str = "1.9"
) -> tuple[ImportResult, Building]:
    path = save(folder, *models, version=version)
    result = import_building(path, folder / "out", options=options)
    return result, load_building(result.buildings[0])


def centre(item: MovableObject, state: float | list[float]) -> FloatArray:
    """The middle of an object's bounds in a state."""
    moved = item.mesh.moved(item.transforms(np.atleast_2d(state))[0]).vertices
    return (moved.min(axis=0) + moved.max(axis=0)) / 2


def bounds(building: Building) -> list[float]:
    points = outline(building.walls, 0.3).reshape(-1, 2)
    return [*points.min(axis=0), *points.max(axis=0)]


def test_a_door_hangs_where_its_joint_is_and_turns_as_its_axis_points(tmp_path: Path) -> None:
    # the model is turned by 90 degrees: the hinge, at x = 0.5 in it, lies at y = 2.5
    result, building = imported(
        tmp_path, WALL, model("front", DOOR, "1 2 0 0 0 1.5707963267948966")
    )
    front = building["front"]
    assert front.kind is Kind.HINGED
    assert front.hinge == pytest.approx([1, 2.5])
    assert centre(front, 0.0) == pytest.approx([1, 2, 1.1])
    assert centre(front, np.pi / 2)[:2] == pytest.approx([0.5, 2.5])  # clockwise: y- becomes x-
    assert (front.lower, front.upper) == (0, 1.57)
    assert result.notes.left == []
    assert "<box" in result.buildings[0].read_text()


def test_a_sliding_door_moves_along_its_axis(tmp_path: Path) -> None:
    door = DOOR.replace("revolute", "prismatic").replace("0 0 -1", "1 0 0").replace("1.57", "0.9")
    _, building = imported(tmp_path, WALL, model("slide", door, "1 2 0 0 0 0"))
    assert building["slide"].kind is Kind.SLIDING
    assert centre(building["slide"], 0.9)[:2] == pytest.approx([1.9, 2])


@pytest.mark.parametrize(
    ("version", "extra", "ahead"),
    [
        ("1.9", "", 1),
        ("1.4", "", -1),
        ("1.6", "<use_parent_model_frame>1</use_parent_model_frame>", -1),
    ],
)
def test_an_axis_is_told_in_the_joint_or_in_the_model(
    tmp_path: Path, version: str, extra: str, ahead: int
) -> None:
    # the leaf stands on its head, and with it the joint: its z points down
    door = DOOR.replace("0 0 1.1 0 0 0", "0 0 1.1 3.141592653589793 0 0").replace(
        "</axis>", f"{extra}</axis>"
    )
    _, building = imported(tmp_path, WALL, model("front", door), version=version)
    assert centre(building["front"], np.pi / 2)[:2] == pytest.approx([0.5, -0.5 * ahead])


def test_poses_are_relative_to_other_frames(tmp_path: Path) -> None:
    content = f"""
    <frame name="corner"><pose degrees="true">2 0 0 0 0 90</pose></frame>
    <frame name="above" attached_to="corner"><pose>0 0 1.25 0 0 0</pose></frame>
    <link name="a"><pose relative_to="above">1 0 0 0 0 0</pose>{box("1 0.2 2.5")}</link>
    """
    _, building = imported(tmp_path, model("m", content, "0 5 0 0 0 0", static=True))
    assert bounds(building) == pytest.approx([1.9, 5.5, 2.1, 6.5])


def test_models_in_models_are_placed_and_named_by_both(tmp_path: Path) -> None:
    inner = model("inner", DOOR, "1 0 0 0 0 0").replace("<static>false</static>", "")
    outer = f'<model name="outer"><pose>0 2 0 0 0 0</pose>{inner}</model>'
    _, building = imported(tmp_path, WALL, outer)
    assert centre(building["outer_inner"], 0.0)[:2] == pytest.approx([1, 2])


def test_includes_are_found_in_folders_that_are_given(tmp_path: Path) -> None:
    desk = f'<link name="l">{box("1 0.5 0.7", "0 0 0.35 0 0 0")}</link>'
    save_model(tmp_path / "models", "shop/desk", model("desk", desk))
    include = (
        "<include><uri>model://shop/desk</uri><name>mine</name><pose>1 1 0 0 0 0.5</pose></include>"
    )
    merged = "<include merge='true'><uri>model://shop/desk</uri><name>other</name></include>"
    lost = "<include><uri>model://shop/lamp</uri></include>"
    options = ImportOptions(models=[tmp_path / "models"])
    result, building = imported(tmp_path, WALL, include, merged, lost, options=options)
    mine = building["mine"]
    assert mine.kind is Kind.PLANAR
    assert mine.home == pytest.approx([1, 1, 0.5])
    assert centre(mine, [0, 0, 0]) == pytest.approx([0, 0, 0.35])
    assert [line for line in result.notes.left if "lamp" in line]
    assert [line for line in result.notes.doubts if "'other' is to be merged" in line]


def test_static_models_are_walls_unless_they_are_called_movable(tmp_path: Path) -> None:
    table = model(
        "table_1", f'<link name="l">{box("1 1 1", "0 0 0.5 0 0 0")}</link>', "0 1 0 0 0 0", True
    )
    _, building = imported(tmp_path, WALL, table)
    assert not building.objects
    assert bounds(building) == pytest.approx([-2, 0.5, 2, 3.05])
    options = ImportOptions(movable=["table*", "nothing*"])
    result = import_building(
        save(tmp_path, WALL, table), tmp_path / "out", options=options, overwrite=True
    )
    building = load_building(result.buildings[0])
    assert building["table_1"].kind is Kind.PLANAR
    (unmatched,) = [each for each in result.notes.doubts if "--movable" in each]
    assert "'nothing*' matches no model; there are " in unmatched
    assert "table_1" in unmatched
    assert bounds(building) == pytest.approx([-2, 2.95, 2, 3.05])
    assert inspect_building(result.buildings[0]).problems == []


def test_the_frame_of_a_door_is_wall_and_its_handle_goes_with_the_leaf(tmp_path: Path) -> None:
    content = f"""
    <link name="frame">{box("0.1 0.1 2.2", "0.55 0 1.1 0 0 0")}</link>
    {DOOR.replace("<parent>world", "<parent>frame")}
    <link name="handle"><pose relative_to="turn"/>{box("0.1 0.1 0.1")}</link>
    <joint name="turn" type="revolute"><pose relative_to="right">-0.4 0.05 0 0 0 0</pose>
    <parent>right</parent><child>handle</child>
    <axis><xyz>0 1 0</xyz><limit><lower>0</lower><upper>1</upper></limit></axis></joint>
    """
    result, building = imported(tmp_path, model("entry", content))
    assert list(building.objects) == ["entry"]
    assert bounds(building) == pytest.approx([0.5, -0.05, 0.6, 0.05])
    leaf = building["entry"].mesh.moved(building["entry"].transforms(np.zeros((1, 1)))[0])
    assert leaf.vertices.max(axis=0)[1] == pytest.approx(0.1)
    assert any(
        "taken as fixed, as it moves on joint 'entry::right_joint'" in n for n in result.notes.left
    )


def test_a_mesh_is_read_scaled_and_beside_the_file(tmp_path: Path) -> None:
    import trimesh

    mesh = Box((1000, 200, 2500)).mesh()
    trimesh.Trimesh(mesh.vertices, mesh.faces).export(tmp_path / "wall.stl")
    shape = "<geometry><mesh><uri>wall.stl</uri><scale>0.001 0.001 0.001</scale></mesh></geometry>"
    link = f'<link name="l"><pose>0 0 1.25 0 0 0</pose><visual name="v">{shape}</visual></link>'
    _, building = imported(tmp_path, model("m", link, static=True))
    assert bounds(building) == pytest.approx([-0.5, -0.1, 0.5, 0.1], abs=1e-6)


def test_what_a_laser_does_not_meet_or_objstate_does_not_know_is_left(tmp_path: Path) -> None:
    plane = '<link name="l"><collision name="c"><geometry><plane/></geometry></collision></link>'
    lamp = '<link name="l"><visual name="v"><geometry><capsule/></geometry></visual></link>'
    robot = f'<link name="l"><sensor name="s" type="gpu_lidar"/>{box("1 1 1")}</link>'
    door = DOOR.replace("revolute", "ball")
    result, building = imported(
        tmp_path,
        "<light name='sun'/>",
        WALL,
        model("ground", plane, static=True),
        model("lamp", lamp),
        model("robot", robot),
        model("odd", door),
    )
    assert not building.objects
    left = " ".join(result.notes.left)
    for told in ("capsule", "'robot': it carries a laser", "of type ball", "1 light"):
        assert told in left
    assert bounds(building)[:2] == pytest.approx([-2, -0.015])  # the odd door is held by the world


def test_a_mesh_that_is_not_read_is_left_with_its_cure(tmp_path: Path) -> None:
    (tmp_path / "lamp.fbx").write_text("Kaydara")
    shape = "<geometry><mesh><uri>lamp.fbx</uri></mesh></geometry>"
    lamp = model("lamp", f'<link name="l"><visual name="v">{shape}</visual></link>', static=True)
    result, building = imported(tmp_path, WALL, lamp)
    assert bounds(building) == pytest.approx([-2, 2.95, 2, 3.05])
    assert "convert it to one of" in result.notes.left[0]


def test_continuous_joints_go_round(tmp_path: Path) -> None:
    door = DOOR.replace("<limit><lower>0</lower><upper>1.57</upper></limit>", "")
    _, building = imported(tmp_path, WALL, model("round", door))
    assert building["round"].wraps
    assert (building["round"].lower, building["round"].upper) == pytest.approx((-np.pi, np.pi))


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            '<link name="l"><pose relative_to="nowhere">0 0 0 0 0 0</pose></link>',
            "'nowhere'.*home.world",
        ),
        ('<link name="l"><pose>1 2 3</pose></link>', "must hold x y z roll pitch yaw"),
        (f'<link name="l">{box("1 -1 1")}</link>', "has no extent"),
        (
            '<frame name="a"><pose relative_to="b"/></frame><frame name="b"><pose relative_to="a"/></frame>'
            '<link name="l"><pose relative_to="a"/></link>',
            "relative to itself",
        ),
    ],
)
def test_what_cannot_be_understood_is_an_error_with_its_line(
    tmp_path: Path, content: str, message: str
) -> None:
    with pytest.raises(BuildingError, match=message):
        imported(tmp_path, model("m", content))
    assert not (tmp_path / "out").exists()


def test_a_model_that_includes_itself_is_refused(tmp_path: Path) -> None:
    save_model(
        tmp_path, "snake", '<model name="s"><include><uri>model://snake</uri></include></model>'
    )
    with pytest.raises(BuildingError, match="includes itself"):
        imported(tmp_path, "<include><uri>model://snake</uri></include>")


def test_a_urdf_is_no_sdf(tmp_path: Path) -> None:
    path = tmp_path / "home.sdf"
    path.write_text('<robot name="r"/>')
    with pytest.raises(BuildingError, match="is no SDF"):
        import_building(path, tmp_path / "out")
