"""The files for ROS against schemas of their formats, and as urdfdom, xacro and catkin_pkg read them."""

import subprocess
from pathlib import Path

import pytest
from catkin_pkg.package import parse_package_string
from export_designs import CHECK_URDF, random_robot
from lxml import etree

from armdesign.export import planning
from armdesign.export.options import RobotOptions, TagOptions
from armdesign.export.planning import robot_srdf
from armdesign.export.ros_package import ros_package
from armdesign.export.urdf import robot_urdf

TAGS = (TagOptions(), TagOptions(ros2_control="gazebo", transmissions=True, world=True))


@pytest.fixture(autouse=True)
def few_samples(monkeypatch):
    monkeypatch.setattr(planning, "SAMPLES", 50)


def check(kind, text):
    """Raise where a file is not of its format."""
    etree.RelaxNG(etree.parse(Path(__file__).with_name(f"{kind}.rng"))).assertValid(etree.fromstring(text.encode()))


@pytest.mark.parametrize("tags", TAGS)
@pytest.mark.parametrize(("n", "seed"), [(1, 0), (4, 1), (10, 3)])
def test_urdf_and_srdf_are_of_their_formats(n, seed, tags):
    robot, _ = random_robot(n, seed, RobotOptions(tags=tags))
    check("urdf", robot_urdf(robot))
    check("srdf", robot_srdf(robot))


@pytest.mark.parametrize("wrong", ['<link name=""/>', '<link name="a"/><joint name="b" type="hinge"/>', "<links/>"])
def test_the_schema_is_strict(wrong):
    with pytest.raises(etree.DocumentInvalid):
        check("urdf", f'<robot name="arm">{wrong}</robot>')


@pytest.mark.skipif(CHECK_URDF is None, reason="check_urdf is not installed")
def test_a_ros_package_is_read_by_the_tools_of_ros(tmp_path):
    robot, _ = random_robot(7, 2)
    files = ros_package(robot, "my_arm")
    for name, text in files.items():
        if name.endswith((".urdf", ".srdf")):
            check(name.rsplit(".")[-1], text)
        if name.endswith(".urdf"):
            (tmp_path / "arm.urdf").write_text(text)
            found = subprocess.run([CHECK_URDF, tmp_path / "arm.urdf"], capture_output=True, text=True, check=True)
            assert found.stdout.count("child(1)") == 9  # base_link, seven links, tool0, in one chain
    package = parse_package_string(files["package.xml"])
    assert package.name == "my_arm"
    assert package.get_build_type() == "ament_cmake"
    used = {dependency.name for dependency in package.exec_depends}
    assert {"controller_manager", "joint_trajectory_controller", "robot_state_publisher"} <= used
