"""The many-basin search on arms: what must not change it, equal arms, and the alternatives it leaves."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.demonstration import read_recording
from armdesign.errors import RunFolderError, SettingsError
from armdesign.fitness.constraints import design_space
from armdesign.kinematics.dh import DHTable
from armdesign.runs.alternatives import read_designs, write_alternatives
from armdesign.runs.reading import read_problem, read_result
from armdesign.runs.writing import write_result
from armdesign.search.arm_symmetry import arm_distances, canonical_form, different_arms, length_slab
from armdesign.search.backends import InProcess, WorkerPool
from armdesign.search.evaluation import evaluate_design
from armdesign.search.prepare import prepare
from armdesign.search.result import Result
from armdesign.search.search import Search, search
from armdesign.settings.sections import Design, Settings

RECORDING = Path(__file__).resolve().parents[2] / "examples" / "packaging.csv"


def prepared(**changes):
    settings = Settings().replace(
        {
            "task": {"recording": str(RECORDING), "rate": 10.0},
            "design": {"dof": 4},
            "solver": {"descents": 12, "starts": 64},
            "search": {"algorithm": "multibasin", "budget": 1200, "seed": 3},
        }
    )
    settings = settings.replace({"search": changes})
    return prepare(read_recording(RECORDING), settings)


@pytest.fixture(scope="module")
def reference():
    return search(prepared())


@pytest.fixture(scope="module")
def folder(reference, tmp_path_factory):
    place = tmp_path_factory.mktemp("multibasin") / "run"
    write_result(place, reference)
    return place


def same(one, other):
    for name in ("best", "mean", "valid", "evaluations"):
        assert getattr(one.history, name).tobytes() == getattr(other.history, name).tobytes(), name
    assert one.evaluation.path.q.tobytes() == other.evaluation.path.q.tobytes()
    assert one.basins[0].tobytes() == other.basins[0].tobytes()
    return True


def test_best_is_evaluated_afresh_and_ends_the_history(reference):
    assert reference.facts.stopped_by == "budget"
    assert reference.history.evaluations[-1] <= 1200
    assert reference.evaluation.fitness == reference.history.best[-1] == reference.basins[1][0]
    again = evaluate_design(reference.evaluation.table, prepared())
    assert again.fitness == reference.evaluation.fitness


@pytest.mark.parametrize("block", [1, 5])
def test_block_size_changes_nothing(reference, block):
    assert same(search(prepared(), block=block), reference)


def test_workers_change_nothing(reference):
    ready = prepared()
    with WorkerPool(ready, 2) as pool:
        assert same(search(ready, backend=pool), reference)


def test_put_down_and_taken_up_after_every_batch_changes_nothing(reference):
    ready = prepared()
    backend = InProcess(ready)
    run = Search(ready, backend)
    while (reason := run.ended_by()) is None:
        run.advance()
        state = run.state()
        run = Search(ready, backend)
        run.restore(state)
    assert same(run.result(reason), reference)


def test_progress_counts_candidates():
    told = []
    result = search(prepared(budget=500), on_progress=told.append)
    assert [each.iteration for each in told] == result.history.evaluations.tolist()
    assert {(each.iterations, each.unit) for each in told} == {(500, "candidate")}
    assert [each.fitness for each in told] == result.history.best.tolist()
    settings = Settings().fitness
    for each in told[-3:]:
        assert each.fitness == settings.lambda_f * each.path_fitness + settings.lambda_E * each.area


def test_stop_rules_hold(reference):
    middle = float(reference.history.best[len(reference.history.best) // 2])
    assert search(prepared(target=middle)).facts.stopped_by == "target"
    assert search(prepared(patience=1, budget=5000)).facts.stopped_by == "patience"


def test_ended_within_the_first_sample_there_is_a_best_all_the_same(tmp_path):
    ready = prepared()
    run = Search(ready, InProcess(ready))
    run.advance()
    result = run.result("interrupted")
    write_result(tmp_path / "run", result)
    assert result.basins[1].tolist() == [result.evaluation.fitness]
    assert len(read_designs(tmp_path / "run", ready.space())) == 1


def test_no_design_is_in_canonical_form():
    space = design_space(Design(dof=4))
    assert canonical_form(space)(np.zeros((0, 11))).shape == (0, 11)


def test_designs_to_begin_with_are_evaluated_first(reference):
    best = reference.basins[0][0]
    warm = search(prepared(seed=9, budget=300, first=[best.tolist()]))
    assert warm.evaluation.fitness <= reference.evaluation.fitness


def axes_and_corners(table, q):
    """Joint axes and the corners of the skeleton at joint angles q, by the matrices of eq. 2."""
    T, axes, corners = np.eye(4), [], [np.zeros(3)]
    for i in range(table.dof + 1):
        c, s = np.cos(table.alpha[i]), np.sin(table.alpha[i])
        T = T @ np.array([[1, 0, 0, table.a[i]], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1.0]])
        corners.append(T[:3, 3])
        T = T @ np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, table.d[i]], [0, 0, 0, 1.0]])
        corners.append(T[:3, 3])
        if i < table.dof:
            axes.append(T[:3, 2])
            c, s = np.cos(q[i]), np.sin(q[i])
            T = T @ np.array([[c, -s, 0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]])
    return np.array(axes), np.array(corners)


def test_canonical_form_is_the_same_arm():
    rng, space = np.random.default_rng(0), design_space(Design(dof=5))
    Phi = space.sample(rng, 40)
    a = np.flatnonzero([name.startswith("a_") for name in np.array(space.names)[space.free]])
    Phi[:, a] += 0.002  # none nearly meet
    for design in Phi:
        design[rng.permutation(a)[:2]] = 0.0
    for before, after in zip(space.full(Phi), space.full(canonical_form(space)(Phi)), strict=True):
        one, other = (DHTable.from_rows(entries[:-1].reshape(6, 3)) for entries in (before, after))
        turned = np.sign(before[:-1].reshape(6, 3)[:, 0]) != np.sign(after[:-1].reshape(6, 3)[:, 0])
        q = rng.uniform(-3, 3, 5)
        moved = q.copy()
        for i in np.flatnonzero(turned):  # half a turn before the row, and one behind it
            moved[i - 1] += np.pi
            if i < 5:
                moved[i] += np.pi
        for seen, again in zip(axes_and_corners(one, q), axes_and_corners(other, moved), strict=True):
            assert np.allclose(seen, again, atol=1e-12)


def test_canonical_form_of_a_canonical_form_is_itself():
    space = design_space(Design(dof=4))
    Phi = space.sample(np.random.default_rng(1), 50)
    once = canonical_form(space)(Phi)
    assert np.array_equal(canonical_form(space)(once), once)
    assert np.allclose(space.lengths(once), space.lengths(Phi))


def written_otherwise(table, turned, behind, q):
    """The same arm with some axes turned round and some rows told from behind, and its joint angles."""
    rows, angles = np.c_[table.alpha, table.a, table.d], q.copy()
    for i in np.flatnonzero(turned):
        rows[i] += [np.pi, 0.0, -2.0 * rows[i, 2]]
        rows[i + 1, 0] -= np.pi
        angles[i] *= -1.0
    for i in np.flatnonzero(behind):  # half a turn before the row, and one behind it
        rows[i, :2] *= -1.0
        angles[i - 1] += np.pi
        if i < len(q):
            angles[i] -= np.pi
    return rows, angles


def test_the_same_arm_written_otherwise_is_no_other_arm():
    rng, space = np.random.default_rng(4), design_space(Design(dof=4))
    for phi, other in zip(space.sample(rng, 30), space.sample(rng, 30), strict=True):
        table, q = space.table(phi), rng.uniform(-3, 3, 4)
        rows, angles = written_otherwise(table, rng.random(4) < 0.5, np.r_[False, rng.random(4) < 0.5], q)
        again = DHTable.from_rows(rows)
        _, corners = axes_and_corners(table, q)
        assert np.allclose(axes_and_corners(again, angles)[1], corners, atol=1e-12)
        twin = np.r_[rows.reshape(-1), 0.0][space.free]
        assert arm_distances(space, phi, twin[None])[0] < 1e-6
        apart = arm_distances(space, phi, np.vstack([other, phi]))
        assert apart[0] == pytest.approx(arm_distances(space, twin, other[None])[0], abs=1e-6)
        assert apart[0] == pytest.approx(arm_distances(space, other, phi[None])[0], abs=1e-9)
        assert apart[0] > 0.01
        assert apart[1] == 0.0


def test_slab_is_the_length():
    space = design_space(Design(dof=4, bounds={"a_1": (0.1, 0.1)}))
    Phi, slab = space.sample(np.random.default_rng(2), 50), length_slab(space)
    assert np.allclose(Phi @ slab.weights - slab.low, space.lengths(Phi) - space.length[0])
    assert np.allclose(slab.high - slab.low, space.length[1] - space.length[0])


def test_alternatives_differ_and_are_runs_of_their_own(folder, reference):
    ready = read_problem(folder)
    found = write_alternatives(folder, ready, count=3)
    assert [each.folder.name for each in found] == ["1", "2", "3"]
    assert found[0].evaluation.fitness == pytest.approx(reference.evaluation.fitness, rel=1e-12)
    space = ready.space()
    Phi = np.array([space.phi(each.evaluation.table) for each in found])
    assert different_arms(Phi, space, 0.3, 9) == [0, 1, 2]
    for each in found:
        again = read_result(each.folder)
        assert again.evaluation.fitness == each.evaluation.fitness
    fewer = write_alternatives(folder, ready, count=1)
    assert len(fewer) == 1
    assert {path.name for path in (folder / "alternatives").iterdir()} == {"1"}


def test_twins_count_once():
    space = design_space(Design(dof=4))
    Phi = space.sample(np.random.default_rng(3), 1)
    twin = Phi.copy()
    twin[0, -1] *= -1.0  # the tool's twist, whose a is 0
    assert different_arms(np.vstack([Phi, twin]), space, 0.01, 9) == [0]


def test_swarms_leave_alternatives_too(tmp_path):
    ready = prepared(algorithm="pso", particles=30, iterations=3)
    result = search(ready)
    write_result(tmp_path / "run", result)
    Phi = read_designs(tmp_path / "run", ready.space())
    assert len(Phi) >= 1
    assert evaluate_design(ready.space().table(Phi[0]), ready).fitness == result.evaluation.fitness


def test_command_prints_them_side_by_side(folder):
    told = CliRunner().invoke(app, ["alternatives", str(folder), "--count", "2"])
    assert told.exit_code == 0, told.output
    assert "no. 1" in told.output
    assert "tool alpha [deg]" in told.output


def test_bad_input_is_one_sentence(folder, reference, tmp_path):
    write_result(tmp_path / "arm", Result(reference.problem, reference.evaluation))
    damaged = json.loads((folder / "alternatives.json").read_text(encoding="utf-8"))
    damaged["designs"][0]["phi"] = [1.0]
    write_result(tmp_path / "damaged", reference)
    (tmp_path / "damaged" / "alternatives.json").write_text(json.dumps(damaged), encoding="utf-8")
    for arguments in (
        [tmp_path / "arm"],
        [tmp_path / "damaged"],
        [folder, "--count", "0"],
        [folder, "--distance", "-1"],
    ):
        told = CliRunner().invoke(app, ["alternatives", *map(str, arguments)])
        assert told.exit_code == 2, told.output
        assert "Traceback" not in told.output
    ready = read_problem(folder)
    with pytest.raises(RunFolderError, match="keeps no alternatives"):
        read_designs(tmp_path / "arm", ready.space())
    with pytest.raises(SettingsError, match="alternatives"):
        write_alternatives(folder, ready, count=100)
