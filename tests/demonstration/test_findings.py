import numpy as np
import pytest
from tasks import task_of

from armdesign.demonstration import Recording
from armdesign.demonstration.findings import FASTEST, sanity_steps, side_steps

TIME = np.arange(300) / 100
NAMES = ("shoulder", "elbow", "wrist", "hand")


def arm(lengths=(0.3, 0.25, 0.08), names=NAMES):
    """An arm that bends and stretches."""
    swing = 0.8 + 0.5 * np.sin(TIME * 2.0)
    links = []
    for k, length in enumerate(lengths):
        angle = -1.2 + (k + 0.5) * swing
        links.append(length * np.stack([np.cos(angle), 0.3 * np.sin(TIME), np.sin(angle)], axis=1))
        links[-1] *= length / np.linalg.norm(links[-1], axis=1, keepdims=True)
    places = np.cumsum([np.tile([0.0, 0.0, 1.4], (len(TIME), 1)), *links], axis=0)
    return Recording(TIME, dict(zip(names, places, strict=True)), source="r.csv")


def moved(recording, name, shift):
    """The recording with one point somewhere else."""
    return Recording(recording.time, {**recording.points, name: recording.points[name] + shift})


def told(recording, base="shoulder", points=NAMES[1:]):
    return sanity_steps(recording, base, points)


def warnings(recording, *choice):
    return [step.sentence for step in told(recording, *choice) if step.name == "warning"]


def test_an_arm_gives_its_figures_and_no_warning():
    segments, motion = told(arm())
    assert "shoulder to elbow 300 +- 0 mm, elbow to wrist 250 +- 0 mm, wrist to hand 80 +- 0 mm" in segments.sentence
    hand = arm().points["hand"]
    steps = np.linalg.norm(np.diff(hand, axis=0), axis=1)
    assert motion.details["path_length"] == pytest.approx(steps.sum(), rel=1e-12)
    assert motion.details["top_speed"] == pytest.approx(100 * steps.max(), rel=1e-9)
    assert motion.details["time"] == TIME[steps.argmax()]


@pytest.mark.parametrize(("factor", "said"), [(1e3, "--time-unit ms"), (1e-2, "check the times"), (1.0, None)])
def test_times_in_another_unit_are_seen_by_the_hands_speed(factor, said):
    recording = arm()
    moves = Recording(factor * recording.time, recording.points)
    found = [text for text in warnings(moves) if "--time-unit" in text]
    assert len(found) == (said is not None)
    assert said is None or said in found[0]


@pytest.mark.parametrize("unit", [0.9, 1.1])
def test_figures_scale_with_the_arm(unit):
    one, other = told(arm()), told(arm(tuple(unit * length for length in (0.3, 0.25, 0.08))))
    for a, b in zip(one[0].details["segments"], other[0].details["segments"], strict=True):
        assert b["mean"] == pytest.approx(unit * a["mean"])
    assert other[1].details["top_speed"] == pytest.approx(unit * one[1].details["top_speed"])


@pytest.mark.parametrize(
    ("lengths", "what"),
    [
        ((0.1, 0.25, 0.08), "'shoulder' to 'elbow', the upper arm, measures 100 mm; people's measure 200 to 420 mm"),
        ((0.3, 0.5, 0.08), "'elbow' to 'wrist', the forearm, measures 500 mm"),
        ((0.3, 0.25, 0.4), "'wrist' to 'hand', the hand, measures 400 mm"),
        ((0.4, 0.34, 0.38), "from 'shoulder' over all points the arm measures 1120 mm, longer than people's"),
    ],
)
def test_lengths_that_nobody_has(lengths, what):
    assert any(what in sentence for sentence in warnings(arm(lengths)))


def test_points_between_the_joints_may_have_any_distance():
    bands = arm((0.15, 0.25, 0.2), names=("Shoulder", "UpperArm", "Forearm", "Hand"))
    assert warnings(bands, "Shoulder", ("UpperArm", "Forearm", "Hand")) == []


def test_a_wrist_that_slides_is_named_with_the_time():
    slide = np.zeros((300, 3))
    slide[:, 0] = 0.04 * np.sin(TIME * 3.0)
    slide[120, 0] = 0.12
    (sentence,) = [text for text in warnings(moved(arm(), "wrist", slide)) if "not steady" in text and "elbow" in text]
    assert "the distance from 'elbow' to 'wrist' is not steady, 25" in sentence
    assert "at 1.2 s" in sentence


def test_a_jump_is_named_with_the_time():
    jump = np.zeros((300, 3))
    jump[200] = 1.05 * FASTEST / 100
    sentences = [text for text in warnings(moved(arm(), "hand", jump)) if "faster than a hand at work" in text]
    assert len(sentences) == 1
    assert sentences[0].startswith("Warning: 'hand' moves at ")
    assert "at 1.99 s" in sentences[0] or "at 2 s" in sentences[0]


def test_points_in_another_order_are_told_the_right_one():
    (sentence,) = [text for text in warnings(arm(), "shoulder", ("wrist", "elbow", "hand")) if "order" in text]
    assert "'wrist' may be out of place: in the order elbow, wrist, hand the points make a shorter" in sentence


def test_an_arm_given_from_the_hand_on_is_noticed():
    found = warnings(arm(), "hand", ("wrist", "elbow", "shoulder"))
    assert any("the base 'hand' moves more than the last point 'shoulder'" in sentence for sentence in found)


def test_warnings_are_among_the_steps_of_a_task():
    task = task_of(arm((0.1, 0.25, 0.08)))
    assert [step.name for step in task.steps].count("warning") == 1
    assert any(note.startswith("Warning: 'shoulder' to 'elbow'") for note in task.notes)


def test_everything_told_is_free_of_the_axes():
    R = np.array([[0.36, 0.48, -0.8], [-0.8, 0.6, 0.0], [0.48, 0.64, 0.6]])
    turned = arm((0.1, 0.5, 0.08)).changed(TIME, lambda p: p @ R.T + 2.0, lambda q: q)
    assert warnings(turned) == warnings(arm((0.1, 0.5, 0.08)))


@pytest.mark.parametrize(
    ("names", "mirrored", "said"),
    [
        (["LELB", "LWRA+LWRB"], False, "LELB) tell of a left arm"),
        (["L.Elbow"], False, "tell of a left arm"),
        (["LeftForeArm"], False, "tell of a left arm"),
        (["LELB"], True, None),
        (["RELB"], False, None),
        (["R.Elbow"], True, "tell of a right arm, and --mirror made it a left one"),
        (["INDEX+LASTC+MEDH+LATH", "EPICl+EPICm"], False, None),
        (["elbow", "wrist", "hand"], False, None),
        (["LELB", "RELB"], False, None),
    ],
)
def test_names_tell_left_from_right(names, mirrored, said):
    steps = side_steps(names, mirrored)
    assert bool(steps) == (said is not None)
    assert said is None or said in steps[0].sentence
