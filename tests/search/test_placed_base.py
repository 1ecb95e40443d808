"""A base that is placed in the room together with the arm: the search, its result, its run folder."""

import numpy as np
import pytest

import armdesign
from armdesign.demonstration import Recording, read_recording
from armdesign.errors import SettingsError, TaskError
from armdesign.fitness.constraints import design_space
from armdesign.fitness.robot import RobotFitness
from armdesign.kinematics.base_pose import placed_base
from armdesign.runs.alternatives import alternatives
from armdesign.runs.reading import read_problem, read_result
from armdesign.runs.resumable import carry_out, start_run
from armdesign.runs.writing import write_result
from armdesign.search.arm_symmetry import arm_distances, canonical_form, length_slab
from armdesign.search.backends.backend import InProcess
from armdesign.search.evaluation import evaluate_candidate
from armdesign.search.prepare import prepare
from armdesign.search.search import search
from armdesign.settings.place import Site
from armdesign.settings.sections import Design, Settings

AROUND = "x=-0.5..0.8 y=-0.5..0.8 z=0.8..1.2"
ABOVE = "x=-0.5..0.8 y=-0.5..0.8 z=1.6..2.2 mounted=ceiling"
BESIDE = "x=-0.4 y=-0.5..0.5 z=1..1.8 mounted=wall"


def placed_settings(*places, scenario="packaging", **changes):
    basis = {
        "design": {"dof": 3}, "search": {"particles": 40, "iterations": 4}, "body": {"kind": "thin"},
        "fitness": {"scenario": scenario}, "cell": {"place": places},
    }  # fmt: skip
    return Settings().replace(basis).replace(changes)


@pytest.fixture(scope="module")
def found(examples):
    """A search over three sites of both scenarios."""
    results = {}
    for scenario in ("packaging", "welding"):
        settings = placed_settings(AROUND, ABOVE, BESIDE, scenario=scenario, design={"dof": 5})
        results[scenario] = search(prepare(read_recording(examples[scenario]), settings))
    return results


@pytest.mark.parametrize("scenario", ["packaging", "welding"])
def test_the_placed_problem_gives_the_fitness_of_the_search_to_the_last_bit(found, scenario):
    result = found[scenario]
    assert result.fitness == result.history.best[-1]
    room = result.problem.in_room
    designs = room.space.sample(np.random.default_rng(1), 300)
    scores, _ = room.objective().evaluate(designs)
    chosen = np.flatnonzero(scores.valid)
    kinds = set()
    for k in chosen[:12]:
        seen, evaluation = evaluate_candidate(designs[k], room)
        assert evaluation.fitness == scores.fitness[k]
        kinds.add(seen.base_pose.mounted)
    assert len(kinds) > 1


@pytest.mark.parametrize("scenario", ["packaging", "welding"])
def test_a_run_folder_gives_the_same_result_again(found, scenario, tmp_path):
    result = found[scenario]
    write_result(tmp_path / "run", result)
    again = read_result(tmp_path / "run")
    for name in ("translation", "rotation"):
        np.testing.assert_array_equal(getattr(again.base_pose, name), getattr(result.base_pose, name))
    assert (again.base_pose.mounted, again.base_pose.frame) == (result.base_pose.mounted, "room")
    assert again.evaluation.fitness == result.evaluation.fitness
    for name, values in vars(result.evaluation.path).items():
        np.testing.assert_array_equal(getattr(again.evaluation.path, name), values, err_msg=name)
    assert armdesign.evaluate(tmp_path / "run", read_problem(tmp_path / "run")).fitness == result.fitness
    write_result(tmp_path / "again", again)
    for name in ("task.csv", "task.json", "settings.toml", "result.json"):
        if name != "result.json":
            assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "run" / name).read_bytes()


def test_a_search_in_the_room_is_taken_up_where_it_stopped(examples, tmp_path):
    settings = placed_settings(AROUND, ABOVE)
    problem = prepare(read_recording(examples["packaging"]), settings)
    whole = search(problem)
    start_run(tmp_path, problem)
    again = read_problem(tmp_path)
    np.testing.assert_array_equal(again.task.P, problem.task.P)
    np.testing.assert_array_equal(again.task.shoulder, problem.task.shoulder)
    np.testing.assert_array_equal(again.origin, np.zeros(3))
    result, _ = carry_out(tmp_path, again, InProcess(again))
    np.testing.assert_array_equal(result.history.best, whole.history.best)
    assert result.fitness == whole.fitness


def test_alternatives_stand_where_their_designs_say(examples):
    settings = placed_settings(AROUND, search={"algorithm": "multibasin", "budget": 1000})
    result = search(prepare(read_recording(examples["packaging"]), settings))
    others = alternatives(result, 3, 0.3)
    assert others[0].fitness == result.fitness
    assert len({tuple(each.base_pose.translation) for each in others}) == len(others)


def test_turning_the_room_with_everything_in_it_changes_nothing(examples):
    recording = read_recording(examples["packaging"])
    site = Site("floor", (-0.1, 0.3), (-0.4, 0.1), (0.9, 1.3))
    space = design_space(Design(dof=3), [site])
    designs = space.sample(np.random.default_rng(3), 150)
    problem = prepare(recording, placed_settings(AROUND)).path_problem
    scores = RobotFitness(problem, space).evaluate(designs)[0]
    angle, shift = 0.7, np.array([3.0, -2.0, 0.5])
    turn = placed_base(np.zeros(3), angle).rotation
    moved = prepare(
        Recording(recording.time, {name: each @ turn.T + shift for name, each in recording.points.items()}),
        placed_settings("x=2..4 y=-3..-1 z=0..3"),
    ).path_problem
    bases = space.bases(designs)
    axes = bases[:, :9].reshape(-1, 3, 3) @ turn.T
    bases = np.concatenate([axes.reshape(-1, 9), bases[:, 9:] @ turn.T + shift], axis=1)
    other = RobotFitness(moved, space).evaluator.evaluate(*space.rows(designs), bases=bases)
    np.testing.assert_array_equal(other.valid, scores.valid)
    assert scores.valid.sum() > 3
    np.testing.assert_allclose(other.fitness[scores.valid], scores.fitness[scores.valid], rtol=1e-6)


def test_the_base_counts_as_p_0_and_from_it_the_reach(examples):
    """At the demonstrator's shoulder, which rests there, the placed arm has the fitness of one at the shoulder."""
    recording = read_recording(examples["packaging"])
    shoulder = recording.points["shoulder"].mean(axis=0)
    still = {name: each - recording.points["shoulder"] + shoulder for name, each in recording.points.items()}
    still = Recording(recording.time, still)
    plain = prepare(still, placed_settings())
    at = prepare(still, placed_settings(cell={"base_at": tuple(shoulder)}))
    table = plain.space.table(plain.space.sample(np.random.default_rng(0), 200)[
        int(np.argmin(plain.objective().evaluate(plain.space.sample(np.random.default_rng(0), 200))[0].fitness))
    ])  # fmt: skip
    expected, there = armdesign.evaluate(table, plain), armdesign.evaluate(table, at)
    assert there.fitness == pytest.approx(expected.fitness, rel=1e-6)
    np.testing.assert_allclose(there.base_pose.translation, shoulder, atol=1e-15)


def test_points_without_a_base_will_do(examples):
    recording = read_recording(examples["packaging"])
    hand_only = Recording(recording.time, {"hand": recording.points["hand"]})
    problem = prepare(hand_only, placed_settings(AROUND, task={"base": "origin", "points": ("hand",)}))
    np.testing.assert_array_equal(problem.task.P[:, 0], recording.points["hand"])
    assert problem.task.arm.shape == (len(recording.time), 1, 3)
    named = prepare(recording, placed_settings(AROUND, task={"points": ("upper_arm", "forearm", "hand")}))
    np.testing.assert_array_equal(named.task.arm[:, 0], recording.points["shoulder"])
    alone = Recording(recording.time, {name: recording.points[name] for name in ("forearm", "hand")})
    both = prepare(alone, placed_settings(AROUND, task={"points": ("forearm", "hand")}))
    assert both.task.points == ("forearm", "hand")


def test_a_place_that_nothing_reaches_from_is_refused_with_the_distance(examples):
    recording = read_recording(examples["packaging"])
    with pytest.raises(TaskError, match="no place of the base reaches") as refused:
        prepare(recording, placed_settings("x=5..6 y=0 z=0"))
    assert 4.0 < refused.value.value < 6.0


def test_a_given_arm_needs_one_place(examples):
    problem = prepare(read_recording(examples["packaging"]), placed_settings(AROUND))
    with pytest.raises(SettingsError, match="one place"):
        armdesign.evaluate(problem.space.table(problem.space.sample(np.random.default_rng(0), 1)[0]), problem)


def test_anywhere_on_the_floor_is_settled_as_a_region(examples):
    recording = read_recording(examples["packaging"])
    problem = prepare(recording, placed_settings(cell={"stand": "floor"}, design={"length": (0.6, 2.0)}))
    (site,) = problem.space.sites
    assert site.z == (0.0, 0.0)
    assert np.isfinite(site.box).all()
    assert prepare(recording, problem.settings).settings == problem.settings


def test_obstacles_fix_the_base_in_the_room(examples, tmp_path):
    cell = tmp_path / "cell.toml"
    cell.write_text('[[box]]\nname = "far"\ncenter = [5, 5, 5]\nsize = [1, 1, 1]\n')
    recording = read_recording(examples["packaging"])
    problem = prepare(recording, placed_settings(cell={"obstacles": (str(cell),)}, body={"kind": "tube"}))
    assert problem.settings.task.base_mode == "fixed"
    np.testing.assert_allclose(problem.origin, recording.points["shoulder"].mean(axis=0))
    np.testing.assert_allclose(problem.base_pose.translation, problem.origin)
    np.testing.assert_allclose(problem.task.arm[:, 0] + problem.origin, recording.points["shoulder"], atol=1e-12)
    assert any("base_mode" in note for note in problem.notes)


def test_a_moving_base_has_no_room(prepared_for):
    problem = prepared_for()
    assert problem.origin is None
    assert problem.base_pose.frame == "base"


class TestSpace:
    space = design_space(
        Design(dof=3),
        [
            Site("floor", (0.0, 1.0), (0.0, 1.0), (0.0, 0.0)),
            Site("ceiling", (0.5, 2.0), (0.0, 1.0), (2.0, 2.2), (0.0, 1.0)),
        ],
    )  # fmt: skip

    def test_entries_and_hull(self):
        names = [n for n, free in zip(self.space.names, self.space.free, strict=True) if free]
        assert names[-5:] == ["base_yaw", "base_x", "base_y", "base_z", "base_site"]
        assert "d_0" in names
        assert self.space.bounds[1][-5:] == pytest.approx([np.pi, 2.0, 1.0, 2.2, 2.0])

    def test_bases_lie_in_their_sites(self):
        designs = self.space.sample(np.random.default_rng(0), 200)
        site, standing = self.space.standing(designs)
        assert set(site) == {0, 1}
        for k, each in enumerate(self.space.sites):
            low, high = each.box
            assert ((standing[site == k, 1:] >= low) & (standing[site == k, 1:] <= high)).all()
        for design in designs[:20]:
            base = self.space.base_pose(design)
            np.testing.assert_allclose(base.rotation @ base.rotation.T, np.eye(3), atol=1e-12)
            np.testing.assert_array_equal(base.columns, self.space.bases(design)[0])
            yaw = self.space.standing(design)[1][0, 0]
            np.testing.assert_allclose(base.rotation, placed_base([0, 0, 0], yaw, base.mounted).rotation, atol=1e-15)

    def test_the_canonical_form_is_the_same_arm(self):
        designs = self.space.sample(np.random.default_rng(0), 50)
        same = canonical_form(self.space)(designs)
        np.testing.assert_allclose(self.space.bases(same), self.space.bases(designs), atol=1e-12)
        np.testing.assert_allclose(arm_distances(self.space, designs[0], same[:1]), 0.0, atol=1e-12)

    def test_positions_do_not_count_in_the_length(self):
        slab, designs = length_slab(self.space), self.space.sample(np.random.default_rng(0), 50)
        fixed = self.space.length[1] - slab.high
        np.testing.assert_allclose(designs @ slab.weights + fixed, self.space.lengths(designs), atol=1e-12)

    def test_a_design_is_found_again_from_table_and_base(self):
        for design in self.space.sample(np.random.default_rng(2), 20):
            again = self.space.phi(self.space.table(design), self.space.base_pose(design))
            np.testing.assert_allclose(self.space.bases(again), self.space.bases(design), atol=1e-12)

    def test_the_base_s_yaw_is_not_the_design_s(self):
        with pytest.raises(SettingsError, match="yaw"):
            design_space(Design(bounds={"base_yaw": (0.0, 10.0)}), self.space.sites)
