from __future__ import annotations

import itertools
from functools import partial

import numpy as np
import pytest
from bvh_files import CMU, Joint, bvh_text, joints, motion, person, places
from scipy.spatial.transform import Rotation
from takes import read_as, refused_as, steps

from armdesign.demonstration import read_recording
from armdesign.demonstration.files.formats import bvh

read = partial(read_as, bvh)
refused = partial(refused_as, bvh)


def agrees(take, roots, table, tolerance=2e-5):
    """Whether everything is where the plain recursion puts it."""
    wanted = places(roots, table)
    assert list(take.points) == list(wanted)
    for name, poses in wanted.items():
        np.testing.assert_allclose(take.points[name], poses[:, :3, 3], atol=tolerance)
        if name in take.orientations:
            turns = Rotation.from_quat(take.orientations[name]).as_matrix()
            np.testing.assert_allclose(turns, poses[:, :3, :3], atol=tolerance)


@pytest.fixture
def rng():
    return np.random.default_rng(3)


@pytest.mark.parametrize("order", ["".join(order) for order in itertools.permutations("XYZ")])
def test_places_and_turns_are_those_of_the_plain_recursion(tmp_path, rng, order):
    root = person(" ".join(f"{axis}rotation" for axis in order))
    table = motion([root], 12, rng)
    take = read(tmp_path, bvh_text([root], table))
    agrees(take, [root], table)
    assert (take.format, take.units, take.up, take.captured, take.steps) == ("BVH", None, None, True, ())
    assert list(take.orientations) == [joint.name for joint in joints(root)]
    np.testing.assert_allclose(take.time, np.arange(12) * 0.0083333)
    assert take.rate == pytest.approx(120.0, rel=1e-5)


def test_all_angles_zero_is_the_skeleton_as_drawn(tmp_path):
    root = person()
    take = read(tmp_path, bvh_text([root], np.zeros((3, 27))))
    np.testing.assert_allclose(take.points["RightHand"][0], [-11.4, 6.9, -0.1], atol=1e-12)
    assert all((turns == [0.0, 0.0, 0.0, 1.0]).all() for turns in take.orientations.values())


def test_position_channels_anywhere_and_in_any_order(tmp_path, rng):
    fingers = Joint("Finger", (0.0, 1.0, 0.0), "Yrotation", [(0.0, 0.0, 0.0)])
    sliding = Joint("Wrist", (0.5, 3.0, 0.0), "Zposition Xrotation Xposition Yrotation Xrotation", [fingers])
    bare = Joint("Elbow", (0.0, 4.0, 0.0), "", [sliding])
    root = Joint("Shoulder", (1.0, 2.0, 3.0), "Yrotation Zposition Xrotation Yposition", [bare])
    table = motion([root], 8, rng)
    take = read(tmp_path, bvh_text([root], table))
    wanted = places([root], table)
    del wanted["Finger (end)"]  # in the same place as the finger
    assert list(take.points) == list(wanted)
    for name, poses in wanted.items():
        np.testing.assert_allclose(take.points[name], poses[:, :3, 3], atol=2e-5)


def test_position_channels_that_hold_the_offset_replace_it(tmp_path, rng):
    root = person()
    table = motion([root], 9, rng)
    plain = read(tmp_path, bvh_text([root], table))
    six, wide = person(), []
    column = 0
    for joint in joints(six):
        count = len(joint.channels.split())
        if joint.name != "Hips":
            joint.channels = f"Xposition Yposition Zposition {joint.channels}"
            wide.append(np.tile(joint.offset, (9, 1)) + rng.normal(scale=1e-3, size=(9, 3)))
        wide.append(table[:, column : column + count])
        column += count
    take = read(tmp_path, bvh_text([six], np.hstack(wide)))
    for name in plain.points:
        np.testing.assert_allclose(take.points[name], plain.points[name], atol=0.05)
    assert "RightForeArm" in steps(take)["offsets"] or "and" in steps(take)["offsets"]


def test_several_roots_and_names_with_blanks_or_twice(tmp_path, rng):
    roots = [person(), Joint("Box", (5.0, 0.0, 0.0), f"Xposition Yposition Zposition {CMU}", [(0.0, 1.0, 0.0)])]
    table = motion(roots, 6, rng)
    take = read(tmp_path, bvh_text(roots, table))
    agrees(take, roots, table)
    assert "Left Leg" in take.points
    twice = bvh_text(roots, table).replace("JOINT Left Leg", "JOINT Spine")
    assert [name for name in read(tmp_path, twice).orientations if "Spine" in name] == ["Spine", "Spine (2)"]


def test_layout_does_not_matter(tmp_path, rng):
    root = person()
    table = motion([root], 6, rng)
    plain = read(tmp_path, bvh_text([root], table))
    for text in (
        bvh_text([root], table, gap="\t"),
        bvh_text([root], table, gap="   ").replace("Frame Time:", "Frame Time:\t").replace("Frames: ", "Frames:"),
        bvh_text([root], table, brace=" "),
        bvh_text([root], table).replace("rotation", "ROTATION").replace("HIERARCHY", "\n\nHierarchy"),
        "\ufeff" + bvh_text([root], table) + "\n\n",
        "\n".join(f"  {line}  " for line in bvh_text([root], table).splitlines()),
        bvh_text([root], table).replace(".", ","),
    ):
        take = read(tmp_path, text)
        assert take.steps == ()
        assert all((take.points[name] == plain.points[name]).all() for name in plain.points)


def turned_up(joint):
    """The same skeleton with z up: (x, y, z) becomes (x, -z, y)."""
    x, y, z = joint.offset
    children = [turned_up(c) if isinstance(c, Joint) else (c[0], -c[2], c[1]) for c in joint.children]
    return Joint(joint.name, (x, -z, y), joint.channels, children)


def test_skeletons_with_y_or_z_up_stand_upright_after_reading(tmp_path, rng):
    standing = person()
    standing.children[1].children[:] = [Joint("LeftFoot", (0.0, -14.0, 0.0), CMU, [(0.0, 0.0, 2.0)])]
    for root in (standing, turned_up(standing)):
        path = tmp_path / "take.bvh"
        path.write_text(bvh_text([root], motion([root], 30, rng, 15.0)))
        points = read_recording(path, units="0.0564").points  # the unit of the CMU files
        trunk = points["Head"] - points["Hips"]
        assert (trunk[:, 2] > 0.8 * np.linalg.norm(trunk, axis=1)).all()
        assert (points["LeftFoot"][:, 2] < points["Hips"][:, 2] - 0.5).all()
        assert (points["RightHand"][:, 0] < points["RightShoulder"][:, 0]).all()


def test_a_t_pose_before_the_motion_is_left_out(tmp_path, rng):
    root = person()
    table = motion([root], 6, rng)
    table[0, 3:] = 0.0
    take = read(tmp_path, bvh_text([root], table))
    assert len(take.time) == 5
    assert take.time[0] == pytest.approx(0.0083333)
    agrees(take, [root], table[1:])
    assert "T-pose" in steps(take)["t-pose"]
    table[1:] = table[0] + 0.001 * np.arange(5)[:, None]
    assert len(read(tmp_path, bvh_text([root], table)).time) == 6


def test_what_is_not_seen_is_missing_in_all_that_hangs_on_it(tmp_path, rng):
    root = person()
    table = motion([root], 6, rng)
    table[2, 19] = np.nan  # a turn of the forearm
    take = read(tmp_path, bvh_text([root], table))
    missing = {name for name, values in take.points.items() if np.isnan(values[2]).any()}
    assert missing == {"RightHand", "RightHand (end)"}
    assert not any(np.isnan(np.delete(values, 2, axis=0)).any() for values in take.points.values())


def test_wrong_counts_are_reported(tmp_path, rng):
    root = person()
    text = bvh_text([root], motion([root], 9, rng), count=7)
    take = read(tmp_path, text)
    assert len(take.time) == 9
    assert "announces 7 frames, the file holds 9" in steps(take)["count"]


def test_files_without_frames_or_cut_off_above_them_are_refused(tmp_path):
    text = bvh_text([person()], np.zeros((0, 27)))
    assert "holds no frame" in refused(tmp_path, text)
    lines = text.splitlines()
    for count in range(1, len(lines)):
        message = refused(tmp_path, "\n".join(lines[:count]))
        assert "'MOTION'" in message or "'Frame Time'" in message


def test_frame_times_that_make_no_sense_are_refused(tmp_path):
    for step in ("0", "-0.01", "nan", "inf", "fast", "1e9"):
        text = bvh_text([person()], np.zeros((4, 27)), step=step)
        assert f"the frame time is '{step}'" in refused(tmp_path, text)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("JOINT Spine", "BONE Spine", "line 6: 'BONE' is unknown"),
        ("JOINT Spine", "ROOT Spine", "line 6: ROOT 'Spine' stands inside another joint"),
        ("OFFSET 0.000000 4.200000 -0.300000", "OFFSET 0 four 0", "the OFFSET of 'Spine' is '0 four 0'"),
        ("OFFSET 0.000000 4.200000 -0.300000", "OFFSET 0 1", "the OFFSET of 'Spine'"),
        ("\t\tOFFSET 0.000000 4.200000 -0.300000\n", "", "'Spine' has no OFFSET"),
        ("CHANNELS 3 Zrotation", "CHANNELS 4 Zrotation", "the CHANNELS of 'Spine' are '4', and 3 names follow"),
        ("CHANNELS 3 Zrotation", "CHANNELS 3 Wrotation", "'Spine' has a channel 'Wrotation'"),
        ("CHANNELS 3 Zrotation Yrotation Xrotation", "CHANNELS", "the CHANNELS of 'Spine' are nothing"),
        ("CHANNELS 3 Z", "CHANNELS 4 Xrotation Z", "too many"),
        ("MOTION", "}\nMOTION", "a brace closes that was not opened"),
        ("}\nMOTION", "MOTION", "the braces of 'Hips' are not closed"),
        ("ROOT Hips\n{", "ROOT Hips", "'{' is missing after 'Hips'"),
        ("{\n\tOFFSET", "{ {\n\tOFFSET", "a brace opens that belongs to no joint"),
        ("\tEnd Site", "\tEnd Site\n{ JOINT Deep", "an End Site holds another joint"),
        ("HIERARCHY", "HIERARCHY\nOFFSET 0 0 0", "line 2: OFFSET stands outside a joint"),
        ("HIERARCHY", "HIERARCHY\nCHANNELS 0", "line 2: CHANNELS stands outside a joint"),
        ("HIERARCHY", "HIERARCHY\nEnd Site", "line 2: an End Site stands outside a joint"),
        ("HIERARCHY", "HIERARCHY\nMOTION", "there is no ROOT"),
        ("Frames: 4", "Frames 4 here", "the line 'Frame Time' is missing"),
    ],
)
def test_what_is_wrong_in_the_skeleton_is_named(tmp_path, old, new, message):
    text = bvh_text([person()], np.zeros((4, 27)))
    assert old in text
    assert message in refused(tmp_path, text.replace(old, new, 1))


def test_deep_chains_are_read_and_endless_ones_refused(tmp_path):
    def chain(count):
        head = "".join(f"JOINT j{i}\n{{\nOFFSET 0 1 0\nCHANNELS 1 Xrotation\n" for i in range(count))
        body = head.replace("JOINT", "ROOT", 1) + "}\n" * count
        row = " ".join(["0"] * count)
        return f"HIERARCHY\n{body}MOTION\nFrames: 3\nFrame Time: 0.01\n{row}\n{row}\n{row}\n"

    take = read(tmp_path, chain(2000))
    assert take.points["j1999"][0, 1] == 2000.0
    assert "more than 5,000 joints" in refused(tmp_path, chain(5001))


def test_more_places_than_fit_into_memory_are_refused(tmp_path):
    joint = "{ OFFSET 0 1 0 } "
    chain = "".join(f"JOINT j{i} {joint}" for i in range(4900))
    text = (
        f"HIERARCHY\nROOT r {{ OFFSET 0 0 0\nCHANNELS 1 Xrotation\n{chain} }}\nMOTION\nFrames: 4000\nFrame Time: 0.01\n"
    )
    assert "4,000 frames of 4,901 joints" in refused(tmp_path, text.replace("} J", "}\nJ") + "0\n" * 4000)


def test_all_joints_hold_the_whole_place_if_most_bones_do(tmp_path):
    three = "Xposition Yposition Zposition"
    arm = Joint("RightArm", (0.0, 30.0, 0.0), three, [Joint("RightForeArm", (30.0, 0.0, 0.0), three, [])])
    root = Joint("Root", (0.0, 0.0, 0.0), three, [Joint("Hips", (0.0, 93.0, 0.0), three, [arm])])
    hips = np.stack([np.linspace(-80, 80, 9), np.full(9, 93.0), np.full(9, 5.0)], axis=1)
    table = np.hstack([np.zeros((9, 3)), hips, np.tile([0.0, 30.0, 0.0, 30.0, 0.0, 0.0], (9, 1))])
    take = read(tmp_path, bvh_text([root], table))
    np.testing.assert_allclose(take.points["Hips"], hips, atol=1e-5)
    np.testing.assert_allclose(take.points["RightForeArm"] - hips, np.tile([30.0, 30.0, 0.0], (9, 1)), atol=1e-5)


def test_comments_above_the_hierarchy_are_passed_over(tmp_path, rng):
    root = person()
    table = motion([root], 5, rng)
    take = read(tmp_path, "# made by hand\n// twice\n" + bvh_text([root], table))
    agrees(take, [root], table)
