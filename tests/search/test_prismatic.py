"""Arms with joints that slide: the search, its result against the method's text, its files as others read them."""

import io
import json

import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from armdesign.demonstration import Recording, read_recording
from armdesign.errors import DesignError, SettingsError
from armdesign.feasibility.needs import joint_needs
from armdesign.fitness.block import BlockEvaluator, as_rows, batch_of
from armdesign.fitness.constraints import design_space, joint_limits
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.dh_files import read_design
from armdesign.runs.reading import read_result
from armdesign.runs.writing import write_result
from armdesign.search.evaluation import evaluate_design
from armdesign.search.prepare import prepare
from armdesign.search.search import search
from armdesign.settings.sections import Design, Settings

JOINTS = "RPRR"


@pytest.fixture(scope="module")
def found(examples, tmp_path_factory):
    """A small search in a run folder."""
    settings = Settings().replace(
        {
            "design": {"joints": JOINTS, "travel": (-0.1, 0.3)},
            "search": {"particles": 60, "iterations": 4},
        }
    )
    result = search(prepare(read_recording(examples["packaging"]), settings))
    folder = tmp_path_factory.mktemp("slides") / "run"
    write_result(folder, result)
    return result, folder


def test_kinds_alone_say_how_many_joints_there_are():
    assert Settings().replace({"design": {"joints": "rppr"}}).design.dof == 4
    with pytest.raises(SettingsError, match="4 letters R or P"):
        Settings().replace({"design": {"joints": "RXPR"}})
    with pytest.raises(SettingsError, match="3 letters R or P"):
        Settings().replace({"design": {"joints": "RRPR", "dof": 3}})


def test_limits_are_in_metres_where_a_joint_slides():
    by_kind = joint_limits(Settings().replace({"design": {"joints": "RPR", "travel": (-0.1, 0.4)}}).design)
    np.testing.assert_allclose(by_kind, [[-np.pi, np.pi], [-0.1, 0.4], [-np.pi, np.pi]])
    pairs = ((-90.0, 90.0), (0.0, 0.25), (-45.0, 45.0))
    each = joint_limits(Settings().replace({"design": {"joints": "RPR", "joint_limits": pairs}}).design)
    np.testing.assert_allclose(each, [[-np.pi / 2, np.pi / 2], [0.0, 0.25], [-np.pi / 4, np.pi / 4]])
    with pytest.raises(SettingsError, match="travel"):
        joint_limits(Settings().replace({"design": {"joints": "RPR", "travel": (0.1, 0.4)}}).design)


def test_one_number_does_not_do_for_both_kinds():
    mixed = Settings().replace({"design": {"joints": "RPR"}, "needs": {"max_speed": [90.0]}})
    with pytest.raises(SettingsError, match="deg/s of joints that turn and m/s"):
        joint_needs(mixed)
    each = joint_needs(mixed.replace({"needs": {"max_speed": [90.0, 0.4, 180.0]}}))
    np.testing.assert_allclose(each.speed, [np.pi / 2, 0.4, np.pi])
    alike = Settings().replace({"design": {"joints": "PP"}, "needs": {"max_speed": [0.2]}})
    np.testing.assert_allclose(joint_needs(alike).speed, 0.2)


def test_arms_are_measured_fully_extended_and_parallel_slides_are_one():
    travel = (-0.2, 0.3)
    space = design_space(Design(dof=3, joints="RPP", d=(-0.5, 0.5), travel=travel))
    designs = space.sample(np.random.default_rng(0), 200)
    rows, _ = space.rows(designs)
    ends = np.array([(0.0, 0.0), travel, travel, (0.0, 0.0)])
    reach = np.abs(rows[:, :, 2, None] + ends).max(axis=2)
    np.testing.assert_allclose(space.lengths(designs), (np.abs(rows[:, :, 1]) + reach).sum(axis=1), atol=1e-15)
    assert space.admissible(designs).all()
    assert (np.abs(rows[:, 2, 0]) >= np.deg2rad(1.0)).all()  # of slides 2 and 3
    flat = designs[:1].copy()
    names = np.array(space.names)[space.free]
    flat[0, names == "alpha_2"] = 0.0
    assert not space.admissible(flat).any()
    one_axis = designs[:1].copy()  # joint 1 turns about the axis along which joint 2 slides: two motions
    one_axis[0, names == "alpha_1"] = one_axis[0, names == "a_1"] = 0.0
    one_axis[0, names == "a_2"] = rows[0, 2, 1] + rows[0, 1, 1]
    assert space.admissible(one_axis).all() or space.lengths(one_axis)[0] > space.length[1]


def test_a_single_slide_follows_a_straight_line_in_closed_form():
    s = np.linspace(0.0, 1.0, 12)
    hand = np.stack([0.0 * s, 0.0 * s, 0.3 + 0.25 * s * (2.0 - s)], axis=1)
    shoulder = np.zeros_like(hand)
    points = {"shoulder": shoulder, "elbow": 0.5 * hand, "hand": hand}
    settings = Settings().replace(
        {
            "design": {"joints": "P", "travel": (0.0, 0.3)}, "body": {"kind": "thin"},
            "task": {"points": ("elbow", "hand"), "base": "shoulder"}, "fitness": {"weights": (0.4, 0.6)},
        }
    )  # fmt: skip
    problem = prepare(Recording(s, points), settings)
    table = DHTable([0.0, 0.0], [0.0, 0.0], [0.2, 0.1], joints="P")
    evaluation = evaluate_design(table, problem)
    np.testing.assert_allclose(evaluation.path.q[:, 0], hand[:, 2] - 0.3, atol=1e-8)
    assert evaluation.path_fitness == pytest.approx(0.0, abs=1e-8)
    assert evaluation.area == pytest.approx(0.0, abs=1e-8)  # arm and arm lie on one line


def test_the_result_is_what_the_text_of_the_method_says(found, outside):
    result, _ = found
    task, path, table = result.problem.task, result.evaluation.path, result.table
    assert table.joints == JOINTS
    assert result.fitness == result.history.best[-1]
    weights, delta = np.array(result.problem.settings.fitness.weights), result.problem.settings.fitness.delta
    f, E = outside.fitness(table, path.q, task.P, weights, delta)
    assert result.evaluation.path_fitness == pytest.approx(f, abs=1e-9)
    assert result.evaluation.area == pytest.approx(E, abs=1e-8)
    limits = joint_limits(result.problem.settings.design)
    assert (path.q >= limits[:, 0]).all()
    assert (path.q <= limits[:, 1]).all()
    assert np.ptp(path.q[:, 1]) > 1e-3  # the slide is used


def test_candidates_do_not_depend_on_the_block_they_are_in(found):
    result, _ = found
    problem, space = result.problem.path_problem, result.problem.space
    rows, yaw = space.rows(space.sample(np.random.default_rng(3), 40))
    alone, together = (BlockEvaluator(problem, block=size).evaluate(rows, yaw) for size in (1, 16))
    np.testing.assert_array_equal(alone.fitness, together.fitness)
    assert np.isfinite(alone.fitness).any()


def test_a_run_folder_is_read_back_and_its_arm_moves_alike_elsewhere(found):
    result, folder = found
    content = json.loads((folder / "result.json").read_text())
    assert content["joints"] == JOINTS
    again = read_result(folder)
    assert again.table == result.table
    assert evaluate_design(again.table, again.problem).fitness == result.fitness
    assert read_design(folder) == result.table
    text = (folder / "arm.urdf").read_text()
    model = pin.buildModelFromXML(text)
    data, robot = model.createData(), yourdfpy.URDF.load(io.BytesIO(text.encode()), load_meshes=False)
    for q in result.evaluation.path.q[::20]:
        tool = result.table.frames(q)[-1]
        pin.framesForwardKinematics(model, data, q)
        np.testing.assert_allclose(data.oMf[model.getFrameId("tool0")].homogeneous, tool, atol=1e-12)
        robot.update_cfg(q)
        np.testing.assert_allclose(robot.get_transform("tool0", "base_link"), tool, atol=1e-12)


def test_another_kind_of_arm_is_refused(found):
    result, _ = found
    turning = DHTable.from_rows(np.stack([result.table.alpha, result.table.a, result.table.d], axis=1))
    with pytest.raises(DesignError, match="RRRR"):
        evaluate_design(turning, result.problem)
    assert turning != result.table
    assert np.isfinite(batch_of(*as_rows([turning])).rows).all()


def test_the_verdict_counts_metres_of_the_slide(found):
    result, _ = found
    verdict = result.verdict
    assert verdict.peak_speed[1] == pytest.approx(
        np.abs(np.gradient(result.evaluation.path.q[:, 1], result.problem.task.time)).max(), rel=0.4
    )
    names = [part.name for part in result.body.parts]
    assert "rail of joint_2" in names
