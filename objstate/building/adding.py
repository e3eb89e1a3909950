"""A URDF with one more piece of furniture."""

from __future__ import annotations

from xml.etree import ElementTree
from xml.sax.saxutils import escape

from objstate.errors import BuildingError
from objstate.geometry import FloatArray

END = "</robot>"


def with_box(text: str, name: str, pose: FloatArray, size: tuple[float, float, float]) -> str:
    """The text of a URDF with a box of furniture added; all else stays as it is, comments too.

    Args:
        text: of the URDF.
        name: of the joint, which is the object's.
        pose: (3,) x, y m and yaw rad where it stands, in the frame of the root link.
        size: m along its own axes.

    Raises:
        BuildingError: the name is taken, or this is no plain URDF.
    """
    try:
        robot = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise BuildingError(f"This is no URDF that can be added to: {error}.") from error
    if "http://www.ros.org/wiki/xacro" in text or END not in text:
        raise BuildingError(
            "Objects can be added to plain URDF alone; expand the xacro file first."
        )
    link = f"{name}_body"
    if name in _names(robot, "joint") or link in _names(robot, "link"):
        raise BuildingError(f"The building has a '{name}' already; give another name.")
    children = {child.get("link") for child in robot.iter("child")}
    root = next(each for each in _names(robot, "link") if each not in children)
    x, y, yaw = (f"{float(value):.6g}" for value in pose)
    sides = " ".join(f"{side:.6g}" for side in size)
    added = f"""\
  <link name="{escape(link)}">
    <collision>
      <origin xyz="0 0 {size[2] / 2.0:.6g}"/>
      <geometry><box size="{sides}"/></geometry>
    </collision>
  </link>
  <joint name="{escape(name)}" type="planar">
    <parent link="{escape(root)}"/>
    <child link="{escape(link)}"/>
    <origin xyz="{x} {y} 0" rpy="0 0 {yaw}"/>
    <axis xyz="0 0 1"/>
  </joint>
"""
    before, _, after = text.rpartition(END)
    return f"{before}{added}{END}{after}"


def _names(robot: ElementTree.Element, kind: str) -> list[str]:
    return [each.get("name", "") for each in robot.findall(kind)]
