"""The xacro files: they expand to the URDF, and the macro takes a prefix and a parent."""

from __future__ import annotations

import re
from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from export_designs import random_robot

from armdesign.export.options import RobotOptions, TagOptions
from armdesign.export.urdf import robot_urdf
from armdesign.export.xacro import robot_xacro, robot_xacro_macro

MACRO = "arm_macro.xacro"
TAGS = RobotOptions(tags=TagOptions(name="My arm", ros2_control="mock", transmissions=True))
XACRO = "{http://www.ros.org/wiki/xacro}"


def canonical(element):
    return element.tag, dict(element.attrib), (element.text or "").strip(), [canonical(child) for child in element]


@pytest.fixture
def expand(tmp_path):
    """Write both files and expand them with the xacro package."""
    xacro = pytest.importorskip("xacro")

    def expanded(robot, main=None, **arguments):
        (tmp_path / MACRO).write_text(robot_xacro_macro(robot))
        path = tmp_path / "arm.xacro"
        path.write_text(main or robot_xacro(robot, MACRO))
        return ElementTree.fromstring(xacro.process_file(str(path), mappings=arguments).toxml())

    return expanded


@pytest.mark.parametrize("options", [None, TAGS, replace(TAGS, tags=replace(TAGS.tags, world=True))])
@pytest.mark.parametrize("n", [1, 4, 8])
def test_it_expands_to_the_urdf(expand, n, options):
    robot, _ = random_robot(n, 1, options)
    assert canonical(expand(robot)) == canonical(ElementTree.fromstring(robot_urdf(robot)))


def test_without_xacro_the_macro_is_the_urdf_all_the_same():
    robot, _ = random_robot(4, 2, TAGS)
    macro = ElementTree.fromstring(robot_xacro_macro(robot).replace("${prefix}", ""))
    parts = [item for item in macro.find(f"{XACRO}macro") if not item.tag.startswith(XACRO)]
    urdf = ElementTree.fromstring(robot_urdf(robot))
    expected = [item for item in urdf if item.tag not in ("mujoco", "material")]
    assert [canonical(item) for item in parts] == [canonical(item) for item in expected]
    assert macro.find(f"{XACRO}macro").get("name") == "armdesign_arm"


def test_every_name_carries_the_prefix(expand):
    robot, _ = random_robot(3, 1, TAGS)
    plain = ElementTree.tostring(expand(robot), encoding="unicode")
    left = ElementTree.tostring(expand(robot, prefix="left_"), encoding="unicode")
    assert left.count("left_") > 20
    assert canonical(ElementTree.fromstring(left.replace("left_", ""))) == canonical(ElementTree.fromstring(plain))
    names = re.findall(r'(?<=name=")[^"]*', left)
    own = ("My_arm", "base", "joint", "tube", "position", "velocity", "min", "max", "initial_value")
    assert not [name for name in names if not name.startswith("left_") and name not in own]


def test_two_arms_on_one_body(expand):
    robot, rng = random_robot(3, 2)
    main = f"""<robot name="pair" xmlns:xacro="http://www.ros.org/wiki/xacro">
      <xacro:include filename="{MACRO}"/>
      <link name="torso"/>
      <xacro:armdesign_arm prefix="left_" parent="torso" xyz="0 0.2 1"/>
      <xacro:armdesign_arm prefix="right_" parent="torso" xyz="0 -0.2 1" rpy="0 0 0.5"/>
    </robot>"""
    model = pin.buildModelFromXML(ElementTree.tostring(expand(robot, main), encoding="unicode"))
    assert model.nq == 6
    data, q = model.createData(), rng.uniform(-1, 1, 3)
    pin.framesForwardKinematics(model, data, np.r_[q, q])
    for name, place in (("left", (0, 0.2, 1, 0)), ("right", (0, -0.2, 1, 0.5))):
        mount = pin.SE3(pin.utils.rotate("z", place[3]), np.array(place[:3])).homogeneous
        found = data.oMf[model.getFrameId(f"{name}_tool0")].homogeneous
        np.testing.assert_allclose(found, mount @ robot.table.frames(q)[-1], atol=1e-12)
