"""The URDF text: kinematics read back, what readers insist on, names and limits."""

from __future__ import annotations

import io
import subprocess
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from export_designs import CHECK_URDF, random_design
from scipy.spatial.transform import Rotation

from armdesign.bodies.arm_body import arm_body
from armdesign.errors import DesignError
from armdesign.export.joints import joint_limits
from armdesign.export.urdf import urdf_text
from armdesign.export.xml_text import rpy, safe_name
from armdesign.kinematics.dh import DHTable, rot_x, rot_z
from armdesign.settings import Body

DESIGNS = [(n, seed) for n in range(1, 9) for seed in range(6)]
ARM, LIMITS, _ = random_design(5, 5)


def parsed(text):
    return ElementTree.fromstring(text)


def floats(text):
    return np.array([float(word) for word in text.split(" ")])


def inertia_of(link):
    entry = link.find("inertial/inertia").attrib
    ixx, ixy, ixz, iyy, iyz, izz = (float(entry[key]) for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"))
    return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


def tool_pose(model, q):
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId("tool0")].homogeneous


@pytest.mark.parametrize(("n", "seed"), DESIGNS)
def test_pinocchio_reads_back_the_table(n, seed):
    table, limits, rng = random_design(n, seed)
    model = pin.buildModelFromXML(urdf_text(table, limits=limits))
    assert list(model.names[1:]) == [f"joint_{i + 1}" for i in range(n)]
    np.testing.assert_array_equal(np.stack([model.lowerPositionLimit, model.upperPositionLimit], axis=1), limits)
    for q in (np.zeros(n), *rng.uniform(*limits.T, (3, n))):
        frames = table.frames(q)
        np.testing.assert_allclose(tool_pose(model, q), frames[-1], atol=1e-12)
        data = model.createData()
        pin.forwardKinematics(model, data, q)
        np.testing.assert_allclose([pose.homogeneous for pose in data.oMi[1:]], frames[:-1], atol=1e-12)


@pytest.mark.parametrize(("n", "seed"), [(n, n % 3 + 1) for n in range(1, 9)])
def test_yourdfpy_reads_back_the_table(n, seed):
    table, limits, rng = random_design(n, seed)
    robot = yourdfpy.URDF.load(io.BytesIO(urdf_text(table, limits=limits).encode()), load_meshes=False)
    q = rng.uniform(*limits.T)
    robot.update_cfg(dict(zip(robot.actuated_joint_names, q, strict=True)))
    frames = table.frames(q)
    for i, frame in enumerate(frames):
        link = "tool0" if i == n else f"link_{i + 1}"
        np.testing.assert_allclose(robot.get_transform(link, "base_link"), frame, atol=1e-12)


@pytest.mark.parametrize("world", [False, True])
@pytest.mark.parametrize(("n", "seed"), [(1, 0), (4, 1), (6, 2), (8, 5)])
def test_mujoco_reads_back_the_table(n, seed, world):
    mujoco = pytest.importorskip("mujoco")
    table, limits, rng = random_design(n, seed)
    model = mujoco.MjModel.from_xml_string(urdf_text(table, limits=limits, world=world))
    data = mujoco.MjData(model)
    data.qpos[:] = q = rng.uniform(*limits.T)
    mujoco.mj_kinematics(model, data)
    tool = data.body("tool0")
    np.testing.assert_allclose(tool.xpos, table.frames(q)[-1][:3, 3], atol=1e-12)
    np.testing.assert_allclose(tool.xmat.reshape(3, 3), table.frames(q)[-1][:3, :3], atol=1e-12)
    links = sum(body.inertial.mass for body in arm_body(table, Body(), None, limits).links) + Body().tool_mass
    assert model.body_mass.sum() == pytest.approx(links, rel=1e-12)


@pytest.mark.skipif(CHECK_URDF is None, reason="check_urdf is not installed")
@pytest.mark.parametrize("n", range(1, 9))
def test_urdfdom_reads_the_same_chain(n, tmp_path):
    table, limits, _ = random_design(n, n % 3)
    path = tmp_path / "arm.urdf"
    path.write_text(urdf_text(table, limits=limits))
    found = subprocess.run([CHECK_URDF, str(path)], capture_output=True, text=True, check=True)
    names = [line.split()[-1] for line in found.stdout.splitlines() if "child" in line]
    assert "root Link: base_link has 1 child(ren)" in found.stdout
    assert names[1:] == [*(f"link_{i + 1}" for i in range(n)), "tool0"]


@pytest.mark.parametrize(("n", "seed"), DESIGNS[::3])
@pytest.mark.parametrize("world", [False, True])
def test_the_file_is_what_readers_insist_on(n, seed, world):
    table, limits, _ = random_design(n, seed)
    text = urdf_text(table, limits=limits, world=world)
    robot = parsed(text)
    assert text.isascii()
    assert robot.tag == "robot"
    assert robot.get("name")
    links, joints = robot.findall("link"), robot.findall("joint")
    names = [item.get("name") for item in (*links, *joints)]
    assert len(set(names)) == len(names) == 2 * (n + 2) - 1 + 2 * world
    assert all(name.isidentifier() for name in names)
    assert not [*robot.iter("mesh"), *robot.iter("mimic")]
    seen = {links[0].get("name")}
    for item in list(robot):
        if item.tag == "joint":
            assert item.find("parent").get("link") in seen
            assert item.find("child").get("link") in seen
        elif item.tag == "link":
            seen.add(item.get("name"))


@pytest.mark.parametrize(("n", "seed"), DESIGNS[::3])
def test_every_joint_is_complete(n, seed):
    table, limits, _ = random_design(n, seed)
    joints = parsed(urdf_text(table, limits=limits)).findall("joint")
    kinds = ["prismatic" if slides else "revolute" for slides in table.prismatic]
    assert [joint.get("type") for joint in joints] == [*kinds, "fixed"]
    for joint, placement in zip(joints, table.placements(), strict=True):
        origin = joint.find("origin")
        np.testing.assert_array_equal(floats(origin.get("xyz")), placement[:3, 3])
        turn = Rotation.from_euler("xyz", floats(origin.get("rpy"))).as_matrix()
        np.testing.assert_allclose(turn, placement[:3, :3], atol=1e-15)
    for joint, (lower, upper) in zip(joints[:-1], limits, strict=True):
        assert joint.find("axis").get("xyz") == "0 0 1"
        limit = {key: float(value) for key, value in joint.find("limit").attrib.items()}
        assert (limit["lower"], limit["upper"]) == (lower, upper)
        assert limit["effort"] > 0
        assert limit["velocity"] > 0


@pytest.mark.parametrize(("n", "seed"), DESIGNS[::3])
def test_every_link_has_a_body_that_can_exist(n, seed):
    table, limits, _ = random_design(n, seed)
    links = parsed(urdf_text(table, limits=limits)).findall("link")
    assert [link.get("name") for link in links] == ["base_link", *(f"link_{i + 1}" for i in range(n)), "tool0"]
    for link in links:
        assert floats(link.find("inertial/origin").get("rpy")).tolist() == [0, 0, 0]
        assert float(link.find("inertial/mass").get("value")) > 1e-6
        moments = np.linalg.eigvalsh(inertia_of(link))
        assert moments[0] > 0
        assert moments[2] < moments[0] + moments[1]


def test_the_masses_are_those_of_the_solids():
    links = parsed(urdf_text(ARM, limits=LIMITS)).findall("link")[:-1]
    for link, body in zip(links, arm_body(ARM, Body(), None, LIMITS).links, strict=True):
        assert float(link.find("inertial/mass").get("value")) == pytest.approx(sum(p.mass for p in body.visual))
        np.testing.assert_array_equal(floats(link.find("inertial/origin").get("xyz")), body.inertial.com)
        np.testing.assert_array_equal(inertia_of(link), body.inertial.inertia)
        assert len(link.findall("visual")) == len(body.visual)
        assert len(link.findall("collision")) == len(body.collision)


def test_materials_come_first_and_cylinders_have_a_size():
    robot = parsed(urdf_text(ARM, limits=LIMITS))
    tags = [item.tag for item in robot]
    assert max(i for i, tag in enumerate(tags) if tag == "material") < tags.index("link")
    defined = {material.get("name") for material in robot.findall("material")}
    assert {material.get("name") for material in robot.findall("link/visual/material")} <= defined
    for cylinder in robot.iter("cylinder"):
        assert float(cylinder.get("radius")) > 0
        assert float(cylinder.get("length")) > 0


def test_tool0_is_kept_by_readers_that_merge_fixed_links():
    robot = parsed(urdf_text(ARM))
    assert robot.find("mujoco/compiler").get("fusestatic") == "false"
    assert robot.find("gazebo[@reference='tool0_fixed']/preserveFixedJoint").text == "true"
    assert robot.find("joint[@name='tool0_fixed']/origin") is not None


def test_a_world_link_holds_the_base():
    robot = parsed(urdf_text(ARM, world=True))
    assert robot.find("link").get("name") == "world"
    joint = robot.find("joint[@name='world_fixed']")
    assert joint.get("type") == "fixed"
    assert (joint.find("parent").get("link"), joint.find("child").get("link")) == ("world", "base_link")


def test_same_input_same_text():
    assert urdf_text(ARM, limits=LIMITS) == urdf_text(ARM, limits=LIMITS.copy(), body=Body())


def test_neighbours_touch_only_when_folded():
    straight = DHTable.from_rows([(0, 0, 0.3)] * 4)
    planar = DHTable.from_rows([(np.pi / 2, 0, 0.3)] + [(0, 0.3, 0)] * 3)
    rng = np.random.default_rng(0)
    for table, reach in ((straight, np.pi), (planar, 1.0)):
        text = urdf_text(table)
        model = pin.buildModelFromXML(text)
        geometry = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
        geometry.addAllCollisionPairs()
        data = pin.GeometryData(geometry)
        for q in rng.uniform(-reach, reach, (10, table.dof)):
            assert not pin.computeCollisions(model, model.createData(), geometry, data, q, False)


@pytest.mark.parametrize(
    "name", ["a'b\"c", "<arm>", "R&D", "my arm", "Ärmchen 7", "7dof", "机械臂", "", "  ", "x" * 300]
)
def test_any_name_becomes_a_plain_one(name):
    robot = parsed(urdf_text(ARM, name=name))
    found = robot.get("name")
    assert found == safe_name(name) == safe_name(found)
    assert found.isascii()
    assert found.isidentifier()
    assert pin.buildModelFromXML(urdf_text(ARM, name=name)).nq == 5


def test_names_keep_what_they_can():
    assert safe_name("Ärmchen 7") == "Armchen_7"
    assert safe_name("7dof") == "arm_7dof"
    assert safe_name("机械臂") == "arm"


@pytest.mark.parametrize("off", [0.0, 1e-16, 1e-12, 1e-9, -1e-8, 1e-4, 0.3])
@pytest.mark.parametrize("pitch", [np.pi / 2, -np.pi / 2])
def test_angles_rebuild_the_rotation_near_gimbal_lock(pitch, off):
    for first, last in np.random.default_rng(0).uniform(-np.pi, np.pi, (20, 2)):
        R = Rotation.from_euler("xyz", [first, pitch + off, last]).as_matrix()
        np.testing.assert_allclose(Rotation.from_euler("xyz", rpy(R)).as_matrix(), R, atol=1e-15)


def test_angles_of_a_right_angled_row_rebuild_it():
    R = (rot_x(np.pi / 2) @ rot_z(np.pi / 2))[:3, :3]
    np.testing.assert_allclose(Rotation.from_euler("xyz", rpy(R)).as_matrix(), R, atol=1e-15)


@pytest.mark.parametrize("alpha", [0.0, 0.1, -np.pi / 2, np.pi / 2, 3.0])
def test_a_pure_twist_is_a_roll(alpha):
    np.testing.assert_allclose(rpy(rot_x(alpha)[:3, :3]), [alpha, 0, 0], atol=1e-15)


@pytest.mark.parametrize("bad", [(0.1, 1.0), (-1.0, -0.1), (1.0, -1.0), (0.0, 0.0), (np.nan, 1.0), (-np.inf, 1.0)])
def test_a_range_without_zero_or_without_width_is_refused(bad):
    limits = np.tile([-1.0, 1.0], (5, 1))
    limits[3] = bad
    with pytest.raises(DesignError):
        urdf_text(ARM, limits=limits)
    with pytest.raises(DesignError, match="joint_4" if np.isfinite(bad).all() else "finite"):
        joint_limits(5 * [False], limits)


@pytest.mark.parametrize("kind", ["velocity", "effort"])
@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
def test_speed_and_torque_limits_are_positive(kind, bad):
    values = np.ones(5)
    values[2] = bad
    with pytest.raises(DesignError, match=kind):
        urdf_text(ARM, **{kind: values})


@pytest.mark.parametrize("kind", ["limits", "velocity", "effort"])
def test_limits_fit_the_number_of_joints(kind):
    with pytest.raises(DesignError, match="5 joints"):
        urdf_text(ARM, **{kind: np.ones(4)})


def test_a_limit_may_end_at_zero():
    model = pin.buildModelFromXML(urdf_text(ARM, limits=[(0.0, 1.0)] * 5))
    np.testing.assert_array_equal(model.lowerPositionLimit, 0.0)
