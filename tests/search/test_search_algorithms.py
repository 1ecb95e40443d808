"""Laws of a search of arms, whatever the algorithm: what must not change it, progress, stop rules, resuming."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import read_recording
from armdesign.runs.alternatives import read_designs
from armdesign.runs.writing import write_result
from armdesign.search.backends.backend import InProcess
from armdesign.search.backends.parallel import WorkerPool
from armdesign.search.evaluation import evaluate_design
from armdesign.search.prepare import prepare
from armdesign.search.search import Search, search
from armdesign.settings.sections import Settings
from armdesign.swarm import ALGORITHMS

RECORDING = Path(__file__).resolve().parents[2] / "examples" / "packaging.csv"
SMALL = {"particles": 60, "iterations": 6, "budget": 700, "seed": 3}


@pytest.fixture(scope="module", params=ALGORITHMS)
def ready(request):
    """Prepares a small search by the algorithm, with other settings where they are given."""
    recording = read_recording(RECORDING)

    def prepared(**changes):
        tables = {
            "task": {"recording": str(RECORDING), "rate": 10.0},
            "design": {"dof": 4},
            "solver": {"descents": 12, "starts": 64},
            "search": SMALL | {"algorithm": request.param} | changes,
        }
        return prepare(recording, Settings().replace(tables))

    prepared.kind = ALGORITHMS[request.param]
    return prepared


@pytest.fixture(scope="module")
def reference(ready):
    return search(ready())


def same(one, other):
    """Whether two searches went the same way to the last bit."""
    for name in ("best", "mean", "valid", "evaluations"):
        assert getattr(one.history, name).tobytes() == getattr(other.history, name).tobytes(), name
    assert one.evaluation.path.q.tobytes() == other.evaluation.path.q.tobytes()
    assert (one.evaluation.fitness, one.evaluation.area) == (other.evaluation.fitness, other.evaluation.area)
    assert one.basins[0].tobytes() == other.basins[0].tobytes()
    return True


def test_best_is_evaluated_afresh_and_ends_the_history(ready, reference):
    assert reference.facts.stopped_by == ready.kind.length
    assert reference.evaluation.fitness == reference.history.best[-1] == reference.basins[1][0]
    assert evaluate_design(reference.evaluation.table, ready()).fitness == reference.evaluation.fitness


@pytest.mark.parametrize("block", [1, 5])
def test_block_size_changes_nothing(ready, reference, block):
    assert same(search(ready(), block=block), reference)


@pytest.mark.parametrize("ready", ["multibasin"], indirect=True)
def test_workers_change_nothing(ready, reference):
    """With the algorithm that uses hints and gradients, which is all that backends know of algorithms."""
    prepared = ready()
    with WorkerPool(prepared, 2) as pool:
        assert same(search(prepared, backend=pool), reference)


def test_pruning_changes_nothing(ready, reference):
    plain = search(ready(prune=False))
    assert same(plain, reference)
    assert plain.facts.rejected["pruned"] == 0
    assert (reference.facts.rejected["pruned"] > 0) == (ready.kind.name != "multibasin")  # which has gradients here


def test_another_seed_is_another_search_whatever_the_global_generator(ready, reference):
    np.random.seed(5)  # noqa: NPY002
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    assert search(ready(seed=4)).history.best[0] != reference.history.best[0]
    assert np.array_equal(np.random.get_state()[1], before)  # noqa: NPY002


def test_put_down_and_taken_up_after_every_batch_changes_nothing(ready, reference):
    prepared = ready()
    backend = InProcess(prepared)
    run = Search(prepared, backend)
    while (reason := run.ended_by()) is None:
        run.advance()
        state = run.state()
        run = Search(prepared, backend)
        run.restore(state)
    assert same(run.result(reason), reference)


def test_progress_is_told_after_every_batch_in_the_unit_of_the_algorithm(ready, reference):
    told = []
    search(ready(), on_progress=told.append)
    history, kind = reference.history, ready.kind
    done = [kind.units_done(int(count), SMALL) for count in history.evaluations]
    assert [entry.iteration for entry in told] == done
    assert {(entry.iterations, entry.unit) for entry in told} == {(SMALL[kind.length], kind.unit)}
    assert [entry.fitness for entry in told] == history.best.tolist()
    assert [entry.valid for entry in told] == history.valid.tolist()
    assert np.array_equal(np.cumsum([entry.particles for entry in told]), history.evaluations)
    assert all(entry.elapsed <= later.elapsed for entry, later in pairwise(told))
    settings = Settings().fitness
    for entry in told:
        assert entry.fitness == settings.lambda_f * entry.path_fitness + settings.lambda_E * entry.area


def test_stop_rules_hold(ready, reference):
    longer = {name: 20 * SMALL[name] for name in ("iterations", "budget")}
    middle = float(reference.history.best[len(reference.history.best) // 2])
    assert search(ready(target=middle)).facts.stopped_by == "target"
    assert search(ready(patience=1, **longer)).facts.stopped_by == "patience"
    assert search(ready(time_limit=1e-3)).facts.stopped_by == "time_limit"


def test_designs_to_begin_with_are_evaluated_first(ready, reference):
    best = reference.basins[0][0]
    run = Search(ready(seed=9, first=[best.tolist()]), InProcess(ready()))
    assert np.array_equal(run.swarm.ask()[0], best)
    run.advance()
    assert run.swarm.best_fitness <= reference.evaluation.fitness


def test_ended_after_the_first_batch_there_is_a_best_and_an_alternative_all_the_same(ready, tmp_path):
    prepared = ready()
    run = Search(prepared, InProcess(prepared))
    run.advance()
    result = run.result("interrupted")
    write_result(tmp_path / "run", result)
    Phi = read_designs(tmp_path / "run", prepared.space)
    assert evaluate_design(prepared.space.table(Phi[0]), prepared).fitness == result.evaluation.fitness
