"""From what is asked for to the points of a task."""

import numpy as np
import pytest

from armdesign.demonstration import Recording, resolve
from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.demonstration.points.standard import mirrored
from armdesign.demonstration.recording import About
from armdesign.errors import TaskError

RNG = np.random.default_rng(11)
FRAMES = 40


def recording(names, oriented=(), bodies=None, captured=True, **values):
    points = {name: values.get(name, RNG.normal(size=(FRAMES, 3))) for name in names}
    turns = {name: RNG.normal(size=(FRAMES, 4)) for name in oriented}
    about = About("C3D", captured, bodies=bodies or {})
    return Recording(np.arange(FRAMES) / 100, points, turns, "here.c3d", about)


def body(n=4):
    """Markers of a body that moves, and its rotations."""
    q = np.cumsum(RNG.normal(scale=0.05, size=(FRAMES, 4)), axis=0) + np.array([0, 0, 0, 1])
    R = rotation_matrices(q / np.linalg.norm(q, axis=1, keepdims=True))
    places = np.einsum("tij,nj->tni", R, RNG.normal(scale=0.05, size=(n, 3))) + RNG.normal(size=(FRAMES, 1, 3))
    return {f"m{i}": places[:, i] for i in range(n)}, R


def test_a_finished_recording_is_taken_in_its_order():
    plain = recording(["s", "e", "h"], ["h"], captured=False)
    chosen = resolve(plain, None, (), None)
    assert (chosen.base, chosen.points, chosen.orientation, chosen.steps) == ("s", ("e", "h"), None, ())
    assert list(chosen.recording.points) == ["s", "e", "h"]
    assert not chosen.recording.orientations
    assert resolve(plain, "e", (), None).points == ("s", "h")
    assert resolve(plain, None, ("h",), None).base == "s"
    assert resolve(plain, "root=s+e", (), None).points == ("h",)


def test_the_points_keep_the_names_that_were_given():
    source = recording(["S:A", "S:B", "S:C"])
    chosen = resolve(source, "root=A", ("B", "mid=0.25*B+0.75*S:C", "C"), None)
    assert list(chosen.recording.points) == ["root", "B", "mid", "C"]
    np.testing.assert_array_equal(chosen.recording.points["B"], source.points["S:B"])
    expected = 0.25 * source.points["S:B"] + 0.75 * source.points["S:C"]
    np.testing.assert_allclose(chosen.recording.points["mid"], expected, atol=1e-15)
    assert chosen.expressions["mid"] == "mid=0.25*B+0.75*S:C"
    again = resolve(source, chosen.expressions["root"], [chosen.expressions[n] for n in chosen.points], None)
    assert again.recording.points["mid"].tobytes() == chosen.recording.points["mid"].tobytes()


def test_expressions_may_build_on_earlier_ones():
    source = recording(["a", "b", "c"])
    chosen = resolve(source, "root=a", ("elbow=a+b", "mid=0.5*elbow+0.5*c", "c"), None)
    expected = source.points["a"] / 4 + source.points["b"] / 4 + source.points["c"] / 2
    np.testing.assert_allclose(chosen.recording.points["mid"], expected, atol=1e-15)


def test_a_mean_needs_all_its_parts():
    gap = RNG.normal(size=(FRAMES, 3))
    gap[3:5] = np.nan
    chosen = resolve(recording(["s", "a", "b"], a=gap), "s", ("m=a+b",), None)
    np.testing.assert_array_equal(np.isnan(chosen.recording.points["m"][:, 0]), np.isnan(gap[:, 0]))


def test_the_mean_of_a_rigid_body_is_known_with_markers_hidden():
    markers, _ = body()
    whole = np.mean(list(markers.values()), axis=0)
    seen = {name: values.copy() for name, values in markers.items()}
    seen["m1"][5:9] = np.nan
    seen["m2"][8:12] = np.nan
    source = recording(["s", *markers], **seen)
    chosen = resolve(source, "s", ("hand=m0+m1+m2+m3",), None)
    known = np.arange(FRAMES) != 8  # there only two are seen
    np.testing.assert_allclose(chosen.recording.points["hand"][known], whole[known], atol=1e-12)
    assert np.isnan(chosen.recording.points["hand"][8]).all()
    assert "In 6 of 40 frames some markers of 'hand' are hidden" in chosen.steps[0].sentence


def test_markers_of_no_rigid_body_are_all_needed():
    seen = {name: RNG.normal(size=(FRAMES, 3)) for name in ("a", "b", "c", "d")}
    seen["a"][5] = np.nan
    chosen = resolve(recording(["s", *seen], **seen), "s", ("hand=a+b+c+d",), None)
    assert np.isnan(chosen.recording.points["hand"][5]).all()
    assert chosen.steps == ()


@pytest.mark.parametrize("text", ["hand", "m0+m1+m2+m3", "grip=m0+m1+m2+m3"])
def test_three_markers_have_an_orientation(text):
    markers, R = body()
    chosen = resolve(recording(["s", *markers], **markers), "s", ("hand=m0+m1+m2+m3",), text)
    turned = rotation_matrices(chosen.recording.orientations[chosen.orientation])
    np.testing.assert_allclose(turned @ turned[0].T, R @ R[0].T, atol=1e-9)
    assert "residual 0.0 mm rms" in chosen.steps[-1].sentence
    assert chosen.orientation == text.partition("=")[0]


def test_a_body_stands_for_its_markers():
    markers, R = body()
    source = recording(["s", *markers], bodies={"Hand": tuple(markers)}, **markers)
    chosen = resolve(source, "s", ("Hand",), "Hand")
    np.testing.assert_allclose(chosen.recording.points["Hand"], np.mean(list(markers.values()), axis=0), atol=1e-15)
    turned = rotation_matrices(chosen.recording.orientations["Hand"])
    np.testing.assert_allclose(turned @ turned[0].T, R @ R[0].T, atol=1e-9)


def test_the_orientation_of_the_body_itself_comes_first():
    source = recording(["s", "G:Hand"], ["G:Hand", "tool"])
    for text, name in (("grip=Hand", "grip"), ("Hand", "Hand"), ("tool", "tool")):
        chosen = resolve(source, "s", ("hand=Hand",), text)
        assert list(chosen.recording.orientations) == [name]
    chosen = resolve(source, "s", ("hand=Hand",), "hand")
    np.testing.assert_array_equal(chosen.recording.orientations["hand"], source.orientations["G:Hand"])


def test_without_points_the_arm_is_guessed_and_said():
    source = recording(["RSHO", "RELB", "RWRA", "RWRB", "LSHO", "LELB", "LWRA", "LWRB"])
    chosen = resolve(source, None, (), None)
    assert (chosen.base, chosen.points) == ("shoulder", ("elbow", "wrist"))
    assert chosen.steps[0].name == "guess"
    assert "the right arm (Plug-in Gait)" in chosen.steps[0].sentence
    assert resolve(source, "LSHO", (), None).expressions["elbow"] == "elbow=LELB"
    assert resolve(source, None, ("RELB", "RWRA"), None).expressions["shoulder"] == "shoulder=RSHO"
    assert resolve(mirrored(source), None, (), None).expressions["shoulder"] == "shoulder=LSHO"
    assert resolve(source, "RSHO", ("RELB",), None).steps == ()


def test_an_orientation_is_found_where_one_is_needed():
    source = recording(["RUArm", "RFArm", "RHand"], ["RHand"])
    assert resolve(source, None, (), None).orientation is None
    assert resolve(source, None, (), None, oriented=True).orientation == "wrist"
    plain = recording(["s", "h"], ["h"], captured=False)
    assert resolve(plain, None, (), None, oriented=True).orientation == "h"


@pytest.mark.parametrize(
    ("base", "points", "orientation", "message"),
    [
        ("x", ("e",), None, "there is no point 'x' for the base; allowed: s, e, h"),
        ("s", ("e", "x"), None, "there is no point 'x'; allowed"),
        ("s", ("e", "s"), None, "'s' is the base and cannot be among the points; allowed: .*h"),
        ("s", ("e", "h", "e"), None, "point 'e' is given twice. Name each point once"),
        ("s", ("e=h", "e"), None, "point 'e' is given twice"),
        ("s", ("never",), None, "point 'never' was not seen in any frame"),
        ("s", ("e",), "h", "there is no orientation of 'h', which is a single point; allowed: tool. Name an oriented"),
        ("s", ("m=e+h",), "m", "there is no orientation of 'm', which is the mean of 2 points"),
        ("s", ("m=0.2*e+0.8*h",), "m", "there is no orientation of 'm', which is a mean with weights"),
        ("s", ("e",), "x", "here.c3d, orientation: there is no point 'x'"),
        ("s", ("tool",), None, "there is no point 'tool'"),
        (None, (), None, "no arm is known by the names of the points; its points are s, e, h, never. Name those"),
        ("s", (), None, "no arm is known .* as in --points elbow=A\\+B,wrist=C,hand=D"),
    ],
)
def test_what_is_wrong_is_said(base, points, orientation, message):
    source = recording(["s", "e", "h", "never"], ["tool"], never=np.full((FRAMES, 3), np.nan))
    with pytest.raises(TaskError, match=message):
        resolve(source, base, points, orientation)


def test_a_recording_with_too_little_is_refused():
    with pytest.raises(TaskError, match="there are no points, only orientations"):
        resolve(recording([], ["tool"]), None, (), None)
    with pytest.raises(TaskError, match="beside the base 's' there is no point to follow"):
        resolve(recording(["s"], captured=False), None, (), None)
    with pytest.raises(TaskError, match=r"nor of any other point. Name .*, or leave the orientation out"):
        resolve(recording(["s", "h"]), "s", ("h",), "h")
    blind = recording(["s", "h"])
    blind = Recording(blind.time, blind.points, {"h": np.full((FRAMES, 4), np.nan)})
    with pytest.raises(TaskError, match="the orientation of 'h' was not seen in any frame"):
        resolve(blind, "s", ("h",), "h")


def test_several_subjects_are_listed():
    names = [f"{who}:{what}" for who in ("giver", "taker") for what in ("RUArm", "RFArm", "RHand")]
    with pytest.raises(TaskError, match="several subjects have an arm: 'giver', 'taker'; its points are giver:RUArm"):
        resolve(recording(names), None, (), None)
    assert resolve(recording(names), "taker:RUArm", (), None).expressions["wrist"] == "wrist=taker:RHand"
