"""The verdict against closed forms: errors, limits, and the speed at which they are kept."""

from dataclasses import replace

import numpy as np
import pytest

from armdesign.bodies.arm_body import arm_body
from armdesign.bodies.loads import base_gravity, joint_torques
from armdesign.cell.obstacles import Obstacle, Obstacles, Sphere
from armdesign.errors import SettingsError
from armdesign.feasibility.demand import joint_demand, speed_fraction
from armdesign.feasibility.needs import SLIDING, TURNING, joint_needs
from armdesign.feasibility.penalty import Requirements, Shown
from armdesign.feasibility.verdict import judge, spread
from armdesign.feasibility.violations import Followed, Gap, figure
from armdesign.feasibility.words import Judged, base_words, conclusion, headline, summary
from armdesign.kinematics.base_pose import BasePose, placed_base
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.motion import smooth_motion
from armdesign.settings import Settings

TIME = np.linspace(0.0, 2.0, 101)
TABLE = DHTable.from_rows([(0.0, 0.0, 0.1), (np.pi / 2, 0.0, 0.0), (0.0, 0.4, 0.0), (0.0, 0.3, 0.1)])


def wanted(**needs):
    return Settings().replace({"design": {"dof": 3}, "body": {"kind": "thin"}, "needs": needs})


def accelerating(rates):
    """Angles q = rate t^2 / 2: speeds rate t, accelerations rate; smoothing leaves quadratics as they are."""
    return np.outer(TIME**2 / 2.0, rates)


def followed(rates=(0.1, 0.2, 0.3), miss=None, angle=None, name=""):
    error = np.linspace(0.0, 10e-3, len(TIME)) if miss is None else miss
    return Followed(TIME, accelerating(rates), error, angle, name)


def verdict_on(arm, each, settings, *obstacles):
    """The verdict on an arm at the room's origin, among obstacles."""
    n, still = settings.design.dof, Obstacles(obstacles)
    shown = tuple(Shown(one.time, np.zeros((len(one.time), 2, 3)), still) for one in each)
    return judge(arm, BasePose(), each, Requirements(settings, np.tile([-3.2, 3.2], (n, 1)), (False,) * n, shown))


def judged(each=None, **needs):
    each = [followed()] if each is None else each
    return verdict_on(arm_body(TABLE, Settings().body), each, wanted(**needs))


def test_the_hand_s_error_is_mean_share_and_largest():
    verdict = judged([followed(miss=np.arange(101) * 1e-4)])
    assert vars(verdict.hand_error) == pytest.approx({"mean": 5e-3, "p95": 9.5e-3, "max": 10e-3})
    assert verdict.hand_angle is None
    assert verdict.tolerance is None
    assert verdict.tolerance_met is None
    assert verdict.feasible
    assert verdict.passed
    assert not verdict.reasons


def test_of_several_demonstrations_the_worst_counts():
    first, second = np.full(101, 2e-3), np.r_[np.zeros(100), 7e-3]
    assert vars(spread([first, second])) == pytest.approx({"mean": 2e-3, "p95": 2e-3, "max": 7e-3})
    verdict = judged([followed(miss=first, name="a"), followed(miss=second, name="b")], hand_tolerance=5e-3)
    assert verdict.tolerance_met is False
    assert not verdict.passed
    assert "7.00 mm" in verdict.reasons[0]
    assert "5 mm" in verdict.reasons[0]
    assert " of b" in verdict.reasons[0]
    speeds = judged([followed((0.1, 0.2, 0.3)), followed((0.4, 0.1, 0.1))]).peak_speed
    assert speeds == pytest.approx((0.8, 0.4, 0.6))


@pytest.mark.parametrize(("percent", "met"), [(100.0, False), (96.0, False), (95.0, True), (50.0, True)])
def test_a_percentile_is_the_share_of_frames_within_the_tolerance(percent, met):
    miss = np.where(np.arange(100) < 95, 1e-3, 9e-3)
    time, q = TIME[:100], accelerating((0.1, 0.2, 0.3))[:100]
    verdict = judged([Followed(time, q, miss)], hand_tolerance=5e-3, tolerance_percentile=percent)
    assert verdict.tolerance_met is met
    assert verdict.feasible  # the tolerance is a matter of its own


def test_the_orientation_has_a_tolerance_of_its_own():
    angle = np.deg2rad(np.linspace(0.0, 4.0, 101))
    kept, missed = (judged([followed(angle=angle)], tolerance_angle=allowed) for allowed in (4.1, 3.9))
    assert kept.tolerance_met is True
    assert missed.tolerance_met is False
    assert np.rad2deg(missed.hand_angle.max) == pytest.approx(4.0)
    assert "4.00 deg" in missed.reasons[0]
    assert "3.9 deg" in missed.reasons[0]
    with pytest.raises(SettingsError) as refused:
        judged(tolerance_angle=3.0)
    assert refused.value.value == 3.0


def test_speeds_are_those_of_the_motion_and_the_assumed_joints_turn_at_180_deg_a_second():
    verdict = judged([followed((1.0, 4.0, 2.0))])
    assert verdict.peak_speed == pytest.approx((2.0, 8.0, 4.0))
    assert verdict.speed_fraction == pytest.approx(TURNING / 8.0)
    assert verdict.feasible  # no speed is stated
    assert judged([followed((0.1, 0.1, 0.1))]).speed_fraction == 1.0


def test_a_stated_speed_rules_the_arm_out_and_a_stated_acceleration_counts_by_its_root():
    slow = judged([followed((1.0, 4.0, 2.0))], max_speed=(180.0, 45.0, 360.0))
    assert not slow.feasible
    assert slow.speed_fraction == pytest.approx(np.deg2rad(45.0) / 8.0)
    assert "Joint 2" in slow.reasons[0]
    assert "458 deg/s" in slow.reasons[0]
    assert "45 deg/s" in slow.reasons[0]
    lazy = judged([followed((1.0, 4.0, 2.0))], max_speed=(1e4,), max_acceleration=(np.rad2deg(1.0),))
    assert lazy.speed_fraction == pytest.approx(0.5)


@pytest.mark.parametrize("mounted", ["floor", "wall"])
def test_at_the_speed_that_a_torque_allows_the_torque_is_just_reached(mounted):
    arm, base = arm_body(TABLE, Settings().body), placed_base((0.0, 0.0, 0.0), 0.3, mounted)
    q = accelerating((6.0, 9.0, 12.0))
    demand = joint_demand(arm, [smooth_motion(TIME, q, arm.limits)], 1.5, base)
    limit = 0.5 * (np.abs(demand.holding).max(axis=0) + np.abs(demand.torque).max(axis=0))
    limits = joint_needs(wanted(max_torque=tuple(limit.tolist()), max_speed=(1e4,)))
    fraction = speed_fraction(demand, limits)
    assert 0.0 < fraction < 1.0
    motion = smooth_motion(TIME, q, arm.limits).at_speed(fraction)
    slowed = np.abs(joint_torques(arm, motion, 1.5, base_gravity(base)))
    assert (slowed / limit).max() == pytest.approx(1.0, rel=1e-6)


def test_an_arm_too_weak_to_stand_still_has_no_speed():
    arm = arm_body(TABLE, Settings().body)
    demand = joint_demand(arm, [smooth_motion(TIME, accelerating((0.1, 0.1, 0.1)), arm.limits)], 0.0, BasePose())
    weak = np.abs(demand.holding).max() * 0.9
    limits = joint_needs(wanted(max_torque=(weak,)))
    assert speed_fraction(demand, limits) == 0.0
    verdict = judged([followed((0.1, 0.1, 0.1))], max_torque=(weak,))
    assert not verdict.feasible
    assert "N m" in verdict.reasons[0]
    assert "any speed" in summary(verdict, Judged(wanted(max_torque=(weak,)), located=True), BasePose())[-1]


def test_a_payload_adds_its_weight_times_its_lever():
    arm, still = arm_body(TABLE, Settings().body), smooth_motion(TIME, np.zeros((101, 3)))
    bare, loaded = (joint_demand(arm, [still], mass, BasePose()).torque[0] for mass in (0.0, 2.0))
    assert np.abs(loaded - bare) == pytest.approx(2.0 * 9.81 * np.array([0.0, 0.7, 0.3]), abs=1e-9)


def test_reasons_come_worst_first():
    verdict = judged([followed((1.0, 4.0, 2.0))], hand_tolerance=9e-3, max_speed=(45.0,))
    assert [reason.split()[0] for reason in verdict.reasons] == ["Joint", "The"]


@pytest.mark.parametrize(
    ("needs", "value"), [({"max_speed": (90.0, 90.0)}, (90.0, 90.0)), ({"max_torque": (1.0,) * 4}, (1.0,) * 4)]
)
def test_limits_are_one_or_one_a_joint(needs, value):
    with pytest.raises(SettingsError) as refused:
        joint_needs(wanted(**needs))
    assert refused.value.value == value
    assert "3" in str(refused.value.allowed)


def test_limits_of_joints_that_slide_are_lengths():
    settings = wanted(max_speed=(90.0, 0.2, 90.0)).replace({"design": {"joints": "RPR"}})
    limits = joint_needs(settings)
    assert limits.speed == pytest.approx([np.pi / 2, 0.2, np.pi / 2])
    assert joint_needs(settings.replace({"needs": {"max_speed": None}})).actuator_speed == pytest.approx(
        [TURNING, SLIDING, TURNING]
    )


@pytest.mark.parametrize("cell", [{"obstacles": ("cell.toml",)}, {"stay_within": 0.08}])
def test_a_thin_arm_has_nothing_to_check(cell):
    with pytest.raises(SettingsError) as refused:
        verdict_on(arm_body(TABLE, Settings().body), [followed()], wanted().replace({"cell": cell}))
    assert "tube" in str(refused.value.allowed)


def test_the_summary_leads_with_the_hand_and_suffices_is_never_said_without_a_tolerance():
    for needs, words in (
        ({}, "no tolerance is stated"),
        ({"hand_tolerance": 0.02}, "within the tolerance of 20 mm"),
        ({"hand_tolerance": 0.002}, "but not within the tolerance of 2 mm"),
        ({"hand_tolerance": 0.002, "max_speed": (1.0,)}, "nor within the tolerance of 2 mm"),
    ):
        verdict, by = judged(**needs), Judged(wanted(**needs), located=True)
        lines = summary(verdict, by, BasePose())
        assert lines[0].startswith("Hand error 5.00 mm mean")
        assert words in headline(verdict, by)
        assert words in lines[1]


@pytest.mark.parametrize(
    ("tolerance", "fraction", "located", "speed", "words", "comes_to"),
    [
        (0.02, 1.0, True, 1.0, "feasible, within the tolerance of 20 mm", "good"),
        (0.02, 0.733, True, 1.0, "feasible, within the tolerance of 20 mm, at 73 % of the demonstrated speed", "part"),
        (0.02, 1.0, True, 0.5, "feasible, within the tolerance of 20 mm, at 50 % of the demonstrated speed", "part"),
        (0.02, 1.0, False, 1.0, "within the tolerance of 20 mm; where it stands is not checked", "part"),
        (0.02, 0.0, True, 1.0, "within the tolerance of 20 mm, but its joints cannot at any speed", "bad"),
        (None, 0.733, True, 1.0, "feasible, at 73 % of the demonstrated speed; no tolerance is stated", "open"),
        (0.002, 0.733, False, 1.0, "feasible, but not within the tolerance of 2 mm", "bad"),
    ],
)
def test_the_line_of_the_verdict_says_what_limits_it(tolerance, fraction, located, speed, words, comes_to):
    needs = {} if tolerance is None else {"hand_tolerance": tolerance}
    verdict = replace(judged(**needs), speed_fraction=fraction)
    by = Judged(wanted(**needs).replace({"body": {"kind": "tube"}}), located=located, speed=speed)
    assert headline(verdict, by).endswith(words)
    assert conclusion(verdict, by) == comes_to


def test_the_least_gap_is_told_first_that_of_parts_too():
    verdict = replace(judged(), self_clearance=Gap(0.03, 0, ("a", "b"), 0.0),
                      obstacle_clearance=Gap(0.02, 0, ("c", "d"), 0.0))  # fmt: skip
    by = Judged(wanted(), located=True)
    for value, order in ((0.01, "pdb"), (0.025, "dpb"), (0.04, "dbp")):
        lines = summary(verdict, by, BasePose(), (value, "p comes near"))
        told = {
            "P comes near": "p",
            "On the demonstrated motion a and b": "b",
            "On the demonstrated motion c and d": "d",
        }
        found = [mark for line in lines for begins, mark in told.items() if line.startswith(begins)]
        assert "".join(found) == order


@pytest.mark.parametrize(
    ("value", "limit", "text"),
    [(18.41, 18.4, "18.41"), (18.44, 18.42, "18.44"), (4.9996, 5.0, "4.9996"), (20.0, 5.0, "20.0"), (5.0, 5.0, "5.00")],
)
def test_a_figure_shows_on_which_side_of_its_limit_it_is(value, limit, text):
    assert figure(value, limit) == text


@pytest.mark.parametrize(
    ("value", "text"), [(0.0, "0"), (0.0421, "0.0421"), (5.04, "5.04"), (33.04, "33.0"), (910.4, "910")]
)
def test_figures_have_three_digits(value, text):
    assert figure(value) == text


@pytest.mark.parametrize(("a", "gap"), [(0.018, -0.042), (0.062, 0.002), (0.1, 0.04)])
def test_modules_side_by_side_are_as_far_apart_as_their_axes_less_a_diameter(a, gap):
    table = DHTable.from_rows([(0.0, 0.0, 0.0), (0.0, a, 0.0), (np.pi / 2, 0.3, 0.1)])
    settings = Settings().replace({"design": {"dof": 2}})
    still = Followed(TIME, np.zeros((101, 2)), np.full(101, 1e-3))
    verdict = verdict_on(arm_body(table, settings.body, side=None), [still], settings)
    assert verdict.self_clearance.value == pytest.approx(gap, abs=6e-5)
    assert verdict.self_clearance.bodies == ("module of joint_1", "module of joint_2")
    assert verdict.feasible == (gap >= settings.body.clearance)
    assert verdict.obstacle_clearance is None
    reasons = " ".join(verdict.reasons)
    assert ("5 mm" in reasons) == (gap < settings.body.clearance)
    assert ("inside" in reasons) == (gap < 0.0)


def test_of_several_demonstrations_the_nearest_counts():
    table = DHTable.from_rows([(0.0, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.3, 0.1)])
    settings = Settings().replace({"design": {"dof": 2}})
    arm = arm_body(table, settings.body, side=None)
    motions = [("open", np.zeros((101, 2))), ("folded", np.outer(np.linspace(0.0, 3.0, 101), [0.0, 1.0]))]
    each = [Followed(TIME, q, np.zeros(101), None, name) for name, q in motions]
    alone = [verdict_on(arm, [one], settings).self_clearance.value for one in each]
    both = verdict_on(arm, each, settings)
    assert alone[0] == pytest.approx(2.0 * settings.body.reach, abs=6e-5)  # tubes in line, cut off about their joint
    assert alone[1] < 0.0
    assert both.self_clearance.value == pytest.approx(alone[1], abs=6e-5)
    assert both.self_clearance.demonstration == 1
    assert " of folded;" in both.reasons[0]


def test_an_obstacle_is_as_far_as_it_is_and_named():
    table = DHTable.from_rows([(0.0, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.3, 0.1)])
    settings = Settings().replace({"design": {"dof": 2}})
    still = Followed(TIME, np.zeros((101, 2)), np.zeros(101))
    pose = np.eye(4)
    pose[:3, 3] = 0.45, 0.2, 0.0  # beside the second tube, of 20 mm radius
    ball = Obstacle("lamp", Sphere(0.1), pose)
    verdict = verdict_on(arm_body(table, settings.body, side=None), [still], settings, ball)
    assert verdict.obstacle_clearance.value == pytest.approx(0.08, abs=6e-5)
    assert "lamp" in verdict.obstacle_clearance.bodies
    pose[1, 3] = 0.1
    verdict = verdict_on(arm_body(table, settings.body, side=None), [still], settings, ball)
    assert not verdict.feasible
    assert "lamp" in verdict.reasons[0]


@pytest.mark.parametrize(("shift", "origin"), [(0.0, None), (0.2, None), (0.2, [5.0, 0.0, 1.0])])
def test_the_envelope_is_left_by_what_is_farthest_from_the_demonstrator_s_arm(shift, origin):
    table = DHTable.from_rows([(0.0, 0.0, 0.0), (0.0, 0.3, 0.0), (0.0, 0.2, 0.0)])
    upright = np.tile([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]], (len(TIME), 1, 1))
    far = 0.5 + shift + 0.02  # the tool's end and the radius of a tube
    for allowed, feasible in ((far + 1e-3, True), (far - 1e-3, False)):
        settings = Settings().replace({"design": {"dof": 2}, "cell": {"stay_within": allowed}})
        place = None if origin is None else np.array(origin)
        asked = Requirements(settings, np.tile([-3.2, 3.2], (2, 1)), (False,) * 2, (Shown(TIME, upright),), place)
        base = BasePose(np.array([shift, 0.0, 0.0]) + (0.0 if place is None else place))
        still = Followed(TIME, np.zeros((101, 2)), np.zeros(101))
        verdict = judge(arm_body(table, settings.body, side=None), base, [still], asked)
        assert verdict.envelope_excess == pytest.approx(far, abs=1.5e-4)
        assert verdict.envelope_excess >= far
        assert verdict.feasible == feasible


@pytest.mark.parametrize("mounted", ["floor", "wall", "ceiling"])
def test_where_the_base_stands_is_said_as_it_was_placed(mounted):
    words = base_words(placed_base((0.4, -0.25, 0.7), np.deg2rad(30.0), mounted))
    assert "x 400, y -250, z 700 mm" in words
    assert "30.0 deg" in words
    assert mounted in words


def test_a_base_that_moves_with_the_recording_stands_nowhere():
    settings = wanted().replace({"cell": {"place": ("x=-1..1 y=-1..1 z=0",)}})
    each = [followed()]
    asked = Requirements(settings, np.tile([-3.2, 3.2], (3, 1)), (False,) * 3, (Shown(TIME, np.zeros((101, 2, 3))),))
    arm = arm_body(TABLE, Settings().body)
    assert judge(arm, BasePose(), each, asked).feasible
    moving = judge(arm, BasePose(frame="base"), each, asked)
    assert not moving.feasible
    assert "moves" in moving.reasons[0]
