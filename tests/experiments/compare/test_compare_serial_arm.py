"""Which joints make the arm, and where its tool is."""

from __future__ import annotations

import numpy as np
import pytest
from compare_arms import frames_at, urdf

from armdesign.errors import DesignError
from armdesign.experiments.compare.ready_made import open_ready_made
from armdesign.experiments.compare.serial_arm import read_arm

JOINTS_AND_TOOLS = {
    "ur5": (6, "tool0"), "panda": (7, "panda_hand_tcp"), "kinova": (6, "j2s6s200_end_effector"),
    "xarm7": (7, "link_eef"), "z1": (6, "gripperStator"), "so100": (5, "gripper"), "so101": (5, "gripper_frame_link"),
}  # fmt: skip


def chain(*names):
    """Revolute joints one behind the other, from link 'base'."""
    links = ["base", *(f"{name}_link" for name in names)]
    return [(name, "revolute", links[i], links[i + 1]) for i, name in enumerate(names)]


def read(tmp_path, *joints, **options):
    path = tmp_path / "robot.urdf"
    path.write_text(urdf(*joints))
    return read_arm(path, **options)


@pytest.mark.parametrize("name", JOINTS_AND_TOOLS)
def test_known_arms_have_their_joints_and_tools(name):
    arm = open_ready_made(name)
    assert (arm.dof, arm.tool) == JOINTS_AND_TOOLS[name]


def test_the_arm_of_a_named_robot_is_upright():
    for name in JOINTS_AND_TOOLS:
        arm = open_ready_made(name)
        first = arm.placements[0][:3, :3] @ arm.axes[0]
        np.testing.assert_allclose(np.abs(first), [0, 0, 1], atol=1e-5, err_msg=name)  # the first joint turns about z


def test_names_are_taken_as_people_write_them():
    assert open_ready_made("SO-100").name == "so100"
    assert open_ready_made("Jaco").name == "kinova"
    assert open_ready_made("xArm").name == "xarm7"


def test_an_unknown_name_gets_the_list_and_a_hint():
    with pytest.raises(DesignError, match=r"ready-made arm 'ur6'; allowed: ur3, ur5, ur10, panda.*Did you mean ur"):
        open_ready_made("ur6")


def test_fingers_wheels_and_heads_are_held(tmp_path):
    arm = read(
        tmp_path,
        ("wheel", "continuous", "base", "wheel_link"),
        *chain("a", "b", "c", "d"),
        ("flange", "fixed", "d_link", "tool0"),
        ("finger_left", "prismatic", "tool0", "left"),
        ("finger_right", "prismatic", "tool0", "right"),
    )
    assert arm.joints == ("a", "b", "c", "d")
    assert arm.tool == "tool0"
    assert arm.held == ("wheel", "finger_left", "finger_right")


def test_the_tool_is_the_deepest_fixed_link_and_names_settle_draws(tmp_path):
    joints = [*chain("a", "b"), ("x", "fixed", "b_link", "camera"), ("y", "fixed", "b_link", "tool0")]
    assert read(tmp_path, *joints).tool == "tool0"
    deeper = [*joints, ("z", "fixed", "camera", "lens")]
    assert read(tmp_path, *deeper).tool == "lens"
    assert read(tmp_path, *deeper, tool="tool0").tool == "tool0"


def test_a_named_tool_picks_one_of_several_arms(tmp_path):
    both = [("spine", "revolute", "root", "base"), *chain("a", "b", "c")]
    both += [
        (f"r_{name}", kind, parent.replace("_link", "_r"), child.replace("_link", "_r"))
        for name, kind, parent, child in chain("a", "b", "c")
    ]
    with pytest.raises(DesignError, match="parts into several arms behind 'base'"):
        read(tmp_path, *both)
    arm = read(tmp_path, *both, tool="c_r")
    assert arm.joints == ("spine", "r_a", "r_b", "r_c")


def test_an_unknown_tool_gets_the_list_of_links(tmp_path):
    with pytest.raises(DesignError, match="no link 'hand' for the tool; allowed: base, a_link, b_link"):
        read(tmp_path, *chain("a", "b"), tool="hand")


def test_the_length_is_that_of_the_polyline_through_the_joint_origins():
    arm = open_ready_made("ur5")
    corners = np.vstack([np.zeros(3), frames_at(arm, np.random.default_rng(0).uniform(-2, 2, 6))[:, :3, 3]])
    assert arm.length == pytest.approx(np.linalg.norm(np.diff(corners, axis=0), axis=1).sum(), abs=1e-12)


def test_speeds_are_those_of_the_file_and_unknown_where_it_has_none(tmp_path):
    inner = [f'<limit lower="-2" upper="2" effort="1" {text}/>' for text in ('velocity="1.5"', "", 'velocity="0"')]
    arm = read(tmp_path, *((*joint, text) for joint, text in zip(chain("a", "b", "c"), inner, strict=True)))
    np.testing.assert_array_equal(arm.speeds, [1.5, np.nan, np.nan])
