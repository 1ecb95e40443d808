"""Several demonstrations of one task: laws of the mean and the worst, and that a run with them is one as any other."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from armdesign.demonstration import Recording, read_recording, write_plain_csv
from armdesign.errors import ArmDesignError, RunFolderError, SearchError, TaskError
from armdesign.export.robot_file import finished_robot
from armdesign.fitness.robot import Rejections
from armdesign.runs.checkpoint import CURRENT
from armdesign.runs.folder import claim_folder
from armdesign.runs.reading import read_problem, read_result
from armdesign.runs.resumable import carry_out, finished
from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.parallel import WorkerPool
from armdesign.search.design_problem import DesignProblem
from armdesign.search.evaluation import combined_evaluation, evaluate_design
from armdesign.search.prepare import prepare
from armdesign.search.result import Result
from armdesign.search.search import Search, search
from armdesign.settings.sections import Settings, read_settings

CUTS = (0.3, 0.7, 0.95, 1.0, 1.2)


def altered(recording, path, factor=1.0, every=1):
    """The same motion at another size or another frame rate, read from a file."""
    points = {name: factor * values[::every] for name, values in recording.points.items()}
    turns = {name: values[::every] for name, values in recording.orientations.items()}
    write_plain_csv(path, Recording(recording.time[::every], points, turns))
    return read_recording(path)


@pytest.fixture(scope="module")
def takes(examples, tmp_path_factory):
    """Four demonstrations of each example's task, of 100, 100, 50 and 100 frames."""
    found = {}
    for scenario, path in examples.items():
        first, place = read_recording(path), tmp_path_factory.mktemp(scenario)
        others = {"b": (1.03, 1), "c": (0.97, 2), "d": (1.01, 1)}
        found[scenario] = [first, *(altered(first, place / f"{name}.csv", *how) for name, how in others.items())]
    return found


@pytest.fixture(scope="module")
def prepared(takes):
    """Some of them, prepared."""

    def ready(which, *, scenario="packaging", unseen=(), dof=4, how="mean", **search_settings):
        settings = Settings().replace(
            {
                "design": {"dof": dof},
                "fitness": {"scenario": scenario, "demonstrations": how},
                "search": {"particles": 12, "iterations": 4} | search_settings,
            }
        )
        every = takes[scenario]
        return prepare([every[k] for k in which], settings, holdouts=[every[k] for k in unseen])

    return ready


@pytest.fixture(scope="module")
def designs(prepared):
    """Random designs of four joints."""
    return prepared([0]).space.sample(np.random.default_rng(3), 40)


@pytest.fixture(scope="module")
def scores(prepared, designs):
    """Scores of the designs on some demonstrations."""
    known = {}

    def score(*which, scenario="packaging", how="mean"):
        key = (which, scenario, how)
        if key not in known:
            known[key] = prepared(which, scenario=scenario, how=how).objective().evaluate(designs)[0]
        return known[key]

    return score


@pytest.mark.parametrize("scenario", ["packaging", "welding"])
@pytest.mark.parametrize("how", ["mean", "worst"])
def test_the_same_recording_again_and_again_is_once(scores, scenario, how):
    once, thrice = scores(0, scenario=scenario), scores(0, 0, 0, scenario=scenario, how=how)
    assert once.valid.sum() > 5
    np.testing.assert_array_equal(thrice.valid, once.valid)
    for name in ("fitness", "path_fitness", "area"):
        np.testing.assert_allclose(getattr(thrice, name), getattr(once, name), rtol=1e-12, atol=0.0)


def test_the_mean_does_not_depend_on_the_order(scores):
    one, other = scores(0, 1, 2), scores(2, 0, 1)
    np.testing.assert_array_equal(one.valid, other.valid)
    for name in ("fitness", "path_fitness", "area", "start_error", "steps"):
        np.testing.assert_array_equal(getattr(one, name)[one.valid], getattr(other, name)[one.valid])


def test_the_mean_and_the_worst_are_those_of_each_alone(scores):
    each = [scores(k) for k in (0, 1, 2)]
    mean, worst = scores(0, 1, 2), scores(0, 1, 2, how="worst")
    valid = np.logical_and.reduce([one.valid for one in each])
    assert valid.sum() > 5
    for both in (mean, worst):
        np.testing.assert_array_equal(both.valid, valid)
        assert np.isinf(both.fitness[~valid]).all()
    # what is added for bodies that touch is not among them: the modules sit the same in all demonstrations
    alone = np.array([one.fitness - one.excess for one in each])[:, valid]
    paper = [both.fitness[valid] - both.excess[valid] for both in (mean, worst)]
    np.testing.assert_allclose(paper[0], alone.mean(axis=0), rtol=1e-12)
    np.testing.assert_allclose(paper[1], alone.max(axis=0), rtol=1e-12)
    assert (paper[1] >= paper[0] - 1e-12).all()
    of_terms = 15.0 * worst.path_fitness + 5.0 * worst.area + worst.excess
    np.testing.assert_allclose(worst.fitness, of_terms, rtol=1e-14)


@pytest.mark.parametrize(("how", "scenario"), [("mean", "packaging"), ("worst", "packaging"), ("mean", "welding")])
def test_pruning_drops_what_is_beyond_its_cutoff_and_changes_nothing_else(prepared, designs, scores, how, scenario):
    whole = scores(0, 1, 2, scenario=scenario, how=how)
    cutoff = np.where(whole.valid, whole.fitness, 1.0) * np.resize(CUTS, len(designs))
    pruned, removed = prepared([0, 1, 2], scenario=scenario, how=how).objective().evaluate(designs, cutoff)
    np.testing.assert_array_equal(pruned.valid, whole.valid)
    assert pruned.pruned.sum() > 3
    assert (whole.fitness[pruned.pruned] > cutoff[pruned.pruned]).all()
    kept = ~pruned.pruned
    np.testing.assert_array_equal(pruned.fitness[kept], whole.fitness[kept])
    assert pruned.frames.sum() < whole.frames.sum()
    assert removed.pruned == pruned.pruned.sum()
    assert removed.constraints + removed.reach + removed.start == (~whole.valid).sum()


@pytest.mark.parametrize("scenario", ["packaging", "welding"])
def test_scores_do_not_depend_on_blocks_and_chunks(prepared, designs, scores, scenario):
    whole = scores(0, 1, 2, scenario=scenario)
    objective = prepared([0, 1, 2], scenario=scenario).objective(block=3)
    answers = [objective.evaluate(designs[part]) for part in (slice(0, 9), slice(9, 11), slice(11, None))]
    for name, values in vars(whole).items():
        together = np.concatenate([getattr(part, name) for part, _ in answers])
        np.testing.assert_array_equal(together, values, err_msg=name)
    assert sum((removed for _, removed in answers), Rejections()) == objective.evaluate(designs)[1]


@pytest.mark.parametrize("scenario", ["packaging", "welding"])
def test_known_start_poses_give_the_same_scores_in_less_time(prepared, designs, scores, scenario):
    whole = scores(0, 1, scenario=scenario)
    hinted, _ = prepared([0, 1], scenario=scenario).objective().evaluate(designs, None, whole.q0)
    assert whole.q0.shape == (len(designs), 8)
    valid = whole.valid
    np.testing.assert_allclose(hinted.fitness[valid], whole.fitness[valid], rtol=1e-9)
    assert hinted.steps[valid].sum() < 0.7 * whole.steps[valid].sum()


def test_start_poses_of_another_shape_are_refused(prepared, designs):
    with pytest.raises(ArmDesignError, match=r"start poses have shape \(40, 4\); allowed: 40, 8"):
        prepared([0, 1]).objective().evaluate(designs, None, np.zeros((40, 4)))


def test_one_tool_is_bolted_on_once(prepared, designs, scores):
    task = prepared([0, 1], scenario="welding")
    best = task.space.table(designs[int(np.argmin(scores(0, 1, scenario="welding").fitness))])
    evaluation = evaluate_design(best, task)
    first, second = evaluation.demonstrations
    np.testing.assert_array_equal(first.path.mount, second.path.mount)
    assert first.path.orientation_error[0] < 1e-9
    assert evaluation.fitness == pytest.approx(scores(0, 1, scenario="welding").fitness.min(), rel=1e-14)


@pytest.mark.parametrize("scenario", ["packaging", "welding"])
def test_a_holdout_equal_to_the_demonstration_has_its_fitness(prepared, designs, scores, scenario):
    task = prepared([0], scenario=scenario, unseen=[0, 3])
    best = task.space.table(designs[int(np.argmin(scores(0, scenario=scenario).fitness))])
    evaluation = evaluate_design(best, task)
    assert evaluation.holdouts[0].fitness == evaluation.fitness
    assert evaluation.holdouts[1].fitness != evaluation.fitness


def test_holdouts_have_no_part_in_the_search(prepared):
    with_them, without = search(prepared([0, 1], unseen=[3])), search(prepared([0, 1]))
    assert replace(with_them.evaluation, holdouts=()).fitness == without.evaluation.fitness
    np.testing.assert_array_equal(with_them.history.best, without.history.best)


def test_one_demonstration_alone_is_prepared_as_ever(prepared, takes):
    alone = prepared([0], how=None)
    ever = prepare(
        takes["packaging"][0], Settings().replace({"design": {"dof": 4}, "search": {"particles": 12, "iterations": 4}})
    )
    assert alone.settings == ever.settings
    assert alone.notes == ever.notes
    assert "demonstrations" not in ever.settings.to_toml()


@pytest.mark.slow
def test_workers_find_what_one_process_finds(prepared):
    task = prepared([0, 2], scenario="welding", particles=40)
    alone = search(task, backend=InProcess(task))
    with WorkerPool(task, 2) as pool:
        shared = search(task, backend=pool)
    np.testing.assert_array_equal(shared.history.best, alone.history.best)
    np.testing.assert_array_equal(shared.evaluation.path.q, alone.evaluation.path.q)
    assert shared.facts.rejected == alone.facts.rejected


@pytest.fixture(scope="module")
def run(prepared, tmp_path_factory):
    """A finished run on three demonstrations with two held out, one of them out of reach."""
    place = tmp_path_factory.mktemp("several") / "run"
    task = prepared([0, 1, 2], unseen=[3], how="worst")
    hand = task.holdouts[0].task.P.copy()
    hand[:, -1] += 2.0
    far = replace(task.holdouts[0], task=replace(task.holdouts[0].task, P=hand))
    task = replace(task, holdouts=(*task.holdouts, far))
    claim_folder(place)
    result, _ = carry_out(place, task, InProcess(task), fresh=True)
    return place, task, result


def files_below(place):
    """Content of all files of a run but its state, without the times in it."""
    found = {}
    for path in sorted(place.rglob("*")):
        if path.is_file() and path.name != CURRENT:
            content = path.read_text(encoding="utf-8")
            if path.name == "result.json":
                content = json.loads(content)
                content.pop("wall_time", None)
            found[str(path.relative_to(place))] = content
    return found


def test_the_folder_tells_what_was_minimised_and_each_by_itself(run):
    place, _, result = run
    content = json.loads((place / "result.json").read_text(encoding="utf-8"))
    each = content["demonstrations"]
    assert [entry["folder"] for entry in each] == [".", "demonstration_2", "demonstration_3"]
    assert [entry["frames"] for entry in each] == [100, 100, 50]
    assert content["fitness"] == max(entry["fitness"] for entry in each) == result.history.best[-1]
    reached, missed = content["holdout"]
    assert reached["folder"] == "holdout_1"
    assert reached["fitness"] > 0.0
    assert missed["fitness"] is None
    assert missed["missed"]["frame"] == 0
    assert missed["missed"]["distance"] > 0.5
    for entry in [*each[1:], reached]:
        inner = json.loads((place / entry["folder"] / "result.json").read_text(encoding="utf-8"))
        assert inner["dh"] == content["dh"]
        assert all(inner[name] == entry[name] for name in ("fitness", "path_fitness", "area", "frames"))


def test_a_run_is_read_back_as_it_was(run):
    place, task, result = run
    back, best = read_result(place), result.evaluation
    assert back.evaluation.fitness == best.fitness
    pairs = [*zip(back.evaluation.demonstrations, best.demonstrations, strict=True)]
    pairs += [*zip(back.evaluation.holdouts, best.holdouts, strict=True)]
    assert len(pairs) == 5
    for read, was in pairs:
        assert (read.fitness, read.path_fitness, read.area, read.missed) == (
            was.fitness,
            was.path_fitness,
            was.area,
            was.missed,
        )
        np.testing.assert_array_equal(read.path.q, was.path.q)
        np.testing.assert_allclose(read.path.distance, was.path.distance, atol=1e-12)
    for read, was in zip(back.problem.demonstrations, task.demonstrations, strict=True):
        assert read.settings == was.settings
        np.testing.assert_array_equal(read.task.P, was.task.P)


def test_every_demonstration_is_a_run_of_its_own(run):
    place, _, result = run
    inner = read_result(place / "demonstration_3")
    assert inner.evaluation.fitness == result.evaluation.demonstrations[2].fitness
    assert inner.evaluation.path.q.shape == (50, 4)


def test_the_urdf_s_limits_cover_every_demonstration(run):
    _, task, result = run
    whole = finished_robot(result).limits
    for each, scored in zip(task.demonstrations, result.evaluation.demonstrations, strict=True):
        alone = finished_robot(
            Result(DesignProblem(each.settings, (each,)), combined_evaluation(result.table, [scored]))
        ).limits
        assert (whole.velocity >= alone.velocity).all()
        assert (whole.effort >= alone.effort).all()


@pytest.fixture
def stopped(run, tmp_path, monkeypatch):
    """The same run, killed in its third iteration."""
    advance = Search.advance

    def killed(self):
        if self.swarm.iteration == 2:
            raise KeyboardInterrupt
        return advance(self)

    task, place = run[1], claim_folder(tmp_path / "run")
    with monkeypatch.context() as patch:
        patch.setattr(Search, "advance", killed)
        with pytest.raises(KeyboardInterrupt):
            carry_out(place, task, InProcess(task), fresh=True)
    assert (place / CURRENT).is_file()
    return place


def test_a_resumed_run_ends_as_one_that_was_not_interrupted(run, stopped):
    again = read_problem(stopped)
    carry_out(stopped, again, InProcess(again))
    assert finished(stopped)
    assert files_below(stopped) == files_below(run[0])


def test_a_demonstration_that_changed_stops_the_resumption(stopped):
    path = stopped / "demonstration_2" / "task.csv"
    path.write_text("\n".join(path.read_text(encoding="utf-8").splitlines()[:-1]), encoding="utf-8")
    again = read_problem(stopped)
    with pytest.raises(RunFolderError, match="belongs to another task"):
        carry_out(stopped, again, InProcess(again))


def test_a_demonstration_that_is_missing_is_named(run, tmp_path):
    place = shutil.copytree(run[0], tmp_path / "run")
    shutil.rmtree(place / "demonstration_3")
    with pytest.raises(RunFolderError, match=r"demonstration_3.* missing"):
        read_problem(place)


def test_another_run_in_the_folder_leaves_no_old_demonstrations(run, prepared, tmp_path):
    place = shutil.copytree(run[0], tmp_path / "run")
    (place / "demonstration_2" / "mine.txt").write_text("kept")
    task = prepared([0], how=None)
    carry_out(place, task, InProcess(task), fresh=True)
    assert [path.name for path in place.iterdir() if path.is_dir()] == ["demonstration_2"]
    assert [path.name for path in (place / "demonstration_2").iterdir()] == ["mine.txt"]
    assert "demonstrations" not in json.loads((place / "result.json").read_text(encoding="utf-8"))
    assert len(read_problem(place).demonstrations) == 1


def test_different_points_are_refused_with_files_and_points(takes):
    first = takes["packaging"][0]
    points = {name.replace("forearm", "elbow"): values for name, values in first.points.items()}
    other = Recording(first.time, points, {}, "other.csv", first.about)
    with pytest.raises(TaskError) as caught:
        prepare([first, other], Settings())
    assert f"{first.source} has upper_arm, forearm, hand; other.csv has upper_arm, elbow, hand" in str(caught.value)
    chosen = Settings().replace({"task": {"points": ["upper_arm", "hand"], "base": "shoulder"}})
    assert prepare([first, other], chosen).demonstrations[1].task.points == ("upper_arm", "hand")
    with pytest.raises(TaskError, match=r"other\.csv: there is no point 'forearm'"):
        prepare([first, other], Settings().replace({"task": {"points": ["forearm", "hand"]}}))


def test_what_the_first_settles_holds_for_all(takes):
    first, other = takes["packaging"][:2]
    captured = replace(first, about=replace(first.about, captured=True))
    named = Settings().replace({"task": {"base": "shoulder", "points": ["forearm", "hand"]}})
    both = prepare([captured, other], named)
    assert both.settings.task.low_pass == both.demonstrations[1].settings.task.low_pass == 6.0
    assert both.settings.fitness.weights == both.demonstrations[1].settings.fitness.weights


def test_a_bound_per_frame_that_is_another_speed_is_told(prepared):
    told = [note for note in prepared([0, 1, 2]).notes if "not the same speed" in note]
    assert len(told) == 1
    assert "500 deg/s" in told[0]
    assert "250 deg/s" in told[0]
    assert not [note for note in prepared([0, 1]).notes if "not the same speed" in note]


def test_an_arm_that_misses_a_demonstration_is_told_which(run):
    _, task, result = run
    unreachable = replace(task, demonstrations=(*task.demonstrations, task.holdouts[1]), holdouts=())
    with pytest.raises(SearchError, match=r"does not reach the first frame of .*d\.csv: its end-effector stays"):
        evaluate_design(result.evaluation.table, unreachable)


def test_paths_of_recordings_count_from_the_settings_file(tmp_path):
    (tmp_path / "mine.toml").write_text(
        '[task]\nrecording = "a.csv"\nmore_recordings = ["b.csv"]\nholdouts = ["d.csv"]\n'
    )
    task = read_settings(tmp_path / "mine.toml").task
    assert task.more_recordings == (str(tmp_path / "b.csv"),)
    assert task.holdouts == (str(tmp_path / "d.csv"),)
