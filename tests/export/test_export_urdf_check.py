"""A URDF that does not read back as the arm is refused before it is written."""

import pytest
from export_designs import random_robot

from armdesign.errors import DesignError
from armdesign.export import export_files
from armdesign.export.options import RobotOptions, TagOptions
from armdesign.export.urdf import robot_urdf
from armdesign.export.urdf_check import check_urdf


@pytest.mark.parametrize("tags", [TagOptions(), TagOptions(world=True, ros2_control="mock", transmissions=True)])
def test_what_is_written_is_taken(tags):
    robot, _ = random_robot(4, 3, RobotOptions(tags=tags))
    check_urdf(robot_urdf(robot), robot)


@pytest.mark.parametrize(
    ("old", "new"),
    [('name="joint_2"', 'name="elbow"'), ('name="link_2"', 'name="link_x"'), ("</robot>", ""), ('rpy="', 'rpy="1 ')],
)
def test_a_slip_of_a_template_is_found(old, new):
    robot, _ = random_robot(3, 1)
    with pytest.raises(DesignError, match="does not read back as the arm"):
        check_urdf(robot_urdf(robot).replace(old, new), robot)


def test_another_arm_is_not_taken_and_nothing_is_written(finished, tmp_path, monkeypatch):
    other, _ = random_robot(3, 2)
    monkeypatch.setattr(export_files, "robot_files", lambda *_: {"arm.urdf": robot_urdf(other)})
    with pytest.raises(DesignError, match="tool0 is"):
        export_files.export(finished["packaging"].run, tmp_path / "out")
    assert not (tmp_path / "out").exists()
