"""``armdesign study``: tables on the screen, files in the folder, and one sentence for what cannot be."""

import json
import sys

import pytest

from armdesign.demonstration import Recording, read_recording, write_plain_csv

TINY = ("--dof", "3", "--reps", "1", "--algorithm", "slsqp,dls-1", "--workers", "1")


@pytest.fixture(scope="module")
def studied(run, tmp_path_factory):
    """A finished study of single frames: its folder and what the command printed."""
    folder = tmp_path_factory.mktemp("studied") / "study"
    outcome = run("study", "temporal", *TINY, "--out", folder, "packaging")
    assert outcome.exit_code == 0, outcome.output
    return folder, outcome


def test_tables_are_printed_and_files_named(studied):
    folder, outcome = studied
    assert "Temporal fitness G [mm] by solver" in outcome.output
    assert "best known" in outcome.output
    for name in ("table.csv", "table.md", "figure.png", "about.json", "runs.csv"):
        assert str(folder / name) in outcome.output.replace("\n", "")
        assert (folder / name).exists()


def test_resuming_what_is_finished_prints_the_tables_again(run, studied):
    folder, first = studied
    again = run("study", "temporal", "--resume", folder)
    assert again.exit_code == 0
    assert [line for line in again.stdout.splitlines() if "packaging " in line] == [
        line for line in first.stdout.splitlines() if "packaging " in line
    ]


def test_settings_file_is_a_task_with_its_scenario_also_without_opytimizer(run, place, welding, monkeypatch):
    monkeypatch.setitem(sys.modules, "opytimizer", None)
    (place / "seam.toml").write_text(f'[task]\nrecording = "{welding.as_posix()}"\n[fitness]\nscenario = "welding"\n')
    outcome = run("study", "temporal", *TINY, "--out", "study", "-q", "seam.toml")
    assert outcome.exit_code == 0, outcome.output
    assert outcome.output == ""
    asked = json.loads((place / "study" / "study.json").read_text())
    assert asked["tasks"] == [str(place / "seam.toml")]
    assert 'scenario = "welding"' in (place / "study" / ".tasks" / "seam-n3" / "settings.toml").read_text()
    same = run("study", "temporal", *TINY, "--out", "study", "-q", "--config", "seam.toml")
    assert same.exit_code == 0, same.output


def test_flags_that_a_study_does_not_have_are_said_to_be_settings(refused, run, place, welding):
    recording = read_recording(welding)
    points = {name: values for name, values in recording.points.items() if name != "forearm"}
    write_plain_csv(place / "two.csv", Recording(recording.time, points))
    words = ("study", "designs", "--scenario", "welding", "--dof", "3")
    sentence = refused(*words, "two.csv")
    assert "two.csv: there are 3 weights" in sentence
    assert "'armdesign search two.csv --points ... --write-config > task.toml'" in sentence
    (place / "two.toml").write_text(run("search", "two.csv", "--write-config").stdout)
    assert "In two.toml these are entries of [task] and [fitness]" in refused(*words, "two.toml")


@pytest.mark.parametrize("name", ["temporal", "robot"])
def test_missing_extra_is_one_sentence_with_the_way_out(refused, monkeypatch, name):
    monkeypatch.setitem(sys.modules, "opytimizer", None)
    assert "not installed. Run: pip install 'armdesign[bench]'" in refused("study", name, "--dof", "3")


def test_nothing_may_be_asked_beside_resume(refused, studied):
    sentence = refused("study", "temporal", "--resume", studied[0], "--reps", "2")
    assert "but --reps is given as well" in sentence


def test_another_study_is_not_resumed(refused, studied):
    sentence = refused("study", "robot", "--resume", studied[0])
    assert "holds the study 'temporal', not 'robot'. Go on with: armdesign study temporal --resume" in sentence


def test_runs_leaves_out_what_is_no_search(run, studied):
    outcome = run("runs", studied[0])
    assert "design0" not in outcome.output


def test_its_folder_takes_neither_a_run_nor_a_sweep(run, studied, packaging):
    folder, _ = studied
    before = set(folder.rglob("*"))
    for command in ("search", "sweep"):
        outcome = run(command, packaging, "--dof", "3", "--out", folder)
        assert outcome.exit_code == 2
        assert "holds a study" in outcome.output.splitlines()[-1]
    assert set(folder.rglob("*")) == before
