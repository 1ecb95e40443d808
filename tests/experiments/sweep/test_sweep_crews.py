"""Who carries out the units changes nothing; a crew survives the death of its members."""

import os
import signal
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest
from sweep_crews import Here

from armdesign.errors import SearchError
from armdesign.experiments.sweep import FuturesCrew, LocalCrew, carry_out_unit, run_sweep, units_of
from armdesign.experiments.sweep.sweep_store import settle
from armdesign.experiments.sweep.units import begin_unit
from armdesign.runs.resumable import finished

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals")
LONG = {"search": {"iterations": 100_000, "particles": 8}}


@pytest.fixture(scope="module")
def asked(ask):
    return ask(dof=(2, 4))


@pytest.fixture(scope="module")
def whole(asked, tmp_path_factory):
    """An undisturbed sweep, one unit after the other in this process."""
    folder = tmp_path_factory.mktemp("whole")
    run_sweep(folder, *asked, lambda units: Here())
    return folder


def begun(folder, asked):
    """The run folders of a sweep's units, ready to be carried out."""
    folder.mkdir()
    settle(folder, *asked)
    return [begin_unit(folder, unit) for unit in units_of(*asked)]


def outcomes(crew, count, on_progress=None):
    """The outcomes of so many units by name; calls back whenever there is progress."""
    found = {}
    while len(found) < count:
        for news in crew.wait(10.0):
            if news.outcome is not None:
                found[news.name] = news.outcome
            elif on_progress is not None:
                on_progress(news)
    return found


@pytest.mark.parametrize("workers", [1, 2])
def test_number_of_processes_does_not_show_in_the_folder(asked, whole, files_of, tmp_path, workers):
    told = []
    run_sweep(tmp_path, *asked, lambda units: LocalCrew(workers), on_change=told.append)
    assert max(len(standing.running) for standing in told) == workers
    assert [standing.finished + standing.failed for standing in told if standing.ended] == list(range(1, 9))
    assert files_of(tmp_path) == files_of(whole)


def test_units_carried_out_elsewhere_come_back_to_the_same_folder(asked, whole, files_of, tmp_path):
    with ThreadPoolExecutor(2) as executor:
        run_sweep(tmp_path, *asked, lambda units: FuturesCrew(executor, lambda: 2))
    assert files_of(tmp_path) == files_of(whole)


def test_end_of_a_worker_elsewhere_is_told_and_the_sweep_goes_on(asked, rows_of, tmp_path):
    class Fragile(ThreadPoolExecutor):
        def submit(self, function, name, files):
            call = os.strerror if "n4" in name else function
            return super().submit(call, *([name] if call is os.strerror else [name, files]))

    with Fragile(1) as executor:
        run_sweep(tmp_path, *asked, lambda units: FuturesCrew(executor, lambda: 1))
    assert {row["stopped_by"] for row in rows_of(tmp_path) if row["dof"] == "4"} == {
        "TypeError: 'str' object cannot be interpreted as an integer"
    }


def test_unit_of_a_killed_process_goes_on_in_a_fresh_one(ask, files_of, tmp_path):
    asked = ask(seeds=(0,), algorithms=("rapso",), changes={"search": {"iterations": 30}})
    (place,) = begun(tmp_path / "killed", asked)
    killed = []

    def kill(news):
        if not killed:
            killed.extend(crew.pids)
            os.kill(killed[0], signal.SIGKILL)

    with LocalCrew(1) as crew:
        crew.take(place)
        assert outcomes(crew, 1, kill)[place.name].state == "finished"
        assert crew.pids != killed
    (undisturbed,) = begun(tmp_path / "undisturbed", asked)
    assert carry_out_unit(undisturbed).state == "finished"
    assert files_of(place) == files_of(undisturbed)


def test_unit_whose_process_dies_three_times_has_failed_and_the_worker_goes_on(ask, tmp_path):
    (deadly,) = begun(tmp_path / "deadly", ask(seeds=(0,), algorithms=("pso",), changes=LONG))
    (harmless,) = begun(tmp_path / "harmless", ask(seeds=(0,), algorithms=("pso",)))
    deaths = []

    def kill(news):
        if crew.pids[0] not in deaths:
            deaths.append(crew.pids[0])
            os.kill(deaths[-1], signal.SIGKILL)

    with LocalCrew(1) as crew:
        crew.take(deadly)
        outcome = outcomes(crew, 1, kill)[deadly.name]
        assert (outcome.state, len(deaths)) == ("failed", 3)
        assert outcome.reason.startswith("its process died 3 times, the last time by SIGKILL")
        assert crew.room() == 1
        crew.take(harmless)
        assert outcomes(crew, 1)[harmless.name].state == "finished"
    assert not finished(deadly)


def test_interrupted_units_leave_a_result_and_a_state(ask, tmp_path):
    (place,) = begun(tmp_path / "sweep", ask(seeds=(0,), algorithms=("pso",), changes=LONG))
    told = []

    def interrupt(news):
        if not told:
            told.append(news)
            crew.interrupt()

    with LocalCrew(1) as crew:
        crew.take(place)
        assert outcomes(crew, 1, interrupt)[place.name].state == "interrupted"
    assert (place / "result.json").exists()
    assert (place / "state.npz").exists()
    assert not finished(place)


def test_units_elsewhere_that_have_not_begun_are_dropped_at_once(ask, tmp_path):
    places = begun(tmp_path / "sweep", ask(algorithms=("pso",)))
    with ThreadPoolExecutor(1) as executor, FuturesCrew(executor, lambda: 2) as crew:
        for place in places:
            crew.take(place)
        assert crew.room() == 0
        crew.interrupt()
        states = {name: outcome.state for name, outcome in outcomes(crew, 2).items()}
    assert states[places[1].name] == "interrupted"


def test_workers_that_do_not_start_end_the_sweep_with_a_sentence(ask, tmp_path, monkeypatch):
    (place,) = begun(tmp_path / "sweep", ask(seeds=(0,), algorithms=("pso",)))
    monkeypatch.setattr("armdesign.experiments.sweep.local_workers.work", os._exit)
    with LocalCrew(1) as crew:
        crew.take(place)
        with pytest.raises(SearchError, match=r"5 worker processes in a row ended before they were ready.*__main__"):
            outcomes(crew, 1)
