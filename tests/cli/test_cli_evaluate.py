"""The evaluate command: given arms from runs and files, in either convention."""

import json
import shutil

import numpy as np
import pytest

ARM = np.array([[0.5, 0, 0], [1.0, 0.3, 0.1], [1.2, 0.3, 0.1], [-1.0, 0.2, 0.1], [0.5, 0.1, 0.1]])


def modified(rows):
    return "alpha,a,d\n" + "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist())


def result_of(folder):
    return json.loads((folder / "result.json").read_text(encoding="utf-8"))


@pytest.mark.parametrize("scenario", ["packaged", "welded"])
def test_run_on_its_own_task_has_the_same_fitness_bit_for_bit(run, place, request, scenario):
    folder, _ = request.getfixturevalue(scenario)
    outcome = run("evaluate", folder, folder / "task.csv", "--base", "origin", "--out", "again")
    assert outcome.exit_code == 0, outcome.output
    first, second = result_of(folder), result_of(place / "again")
    same = (
        "schema_version armdesign_version dof dh length fitness path_fitness area mount points weights "
        "orientation_weight orientation_metric point_error orientation_error start_error frames"
    )
    assert {name: second[name] for name in same.split()} == {name: first[name] for name in same.split()}
    for name in ("trajectory.csv", "task.csv", "arm.urdf"):
        assert (place / "again" / name).read_bytes() == (folder / name).read_bytes()


def test_run_on_its_recording_has_the_same_fitness_bit_for_bit(run, place, welded, welding):
    folder, _ = welded
    for design in (folder, folder / "result.json"):
        outcome = run("evaluate", design, welding, "--out", "again", "--overwrite")
        assert outcome.exit_code == 0, outcome.output
        assert result_of(place / "again")["fitness"] == result_of(folder)["fitness"]
        assert result_of(place / "again")["settings"] == result_of(folder)["settings"]


def test_classic_table_is_the_same_arm(run, place, packaging):
    rows = ARM.copy()
    rows[0], rows[-1, 2] = 0.0, 0.0  # what a classic table cannot hold: a first twist, a last offset
    (place / "modified.csv").write_text(modified(rows))
    (place / "classic.csv").write_text(modified(np.c_[rows[1:, 0], rows[1:, 1], rows[:-1, 2]]))
    (place / "far.toml").write_text("[fitness]\nreach_tolerance = 0.2\n")
    for kind in ("modified", "classic"):
        flags = ("--convention", kind, "--config", "far.toml", "--out", kind)
        outcome = run("evaluate", f"{kind}.csv", packaging, *flags)
        assert outcome.exit_code == 0, outcome.output
    one, other = (result_of(place / kind) for kind in ("modified", "classic"))
    assert (one["dh"], one["fitness"]) == (other["dh"], other["fitness"])


def test_flags_choose_another_task(run, place, packaged, packaging):
    folder, _ = packaged
    flags = ("--points", "forearm,hand", "--weights", "1/4,3/4", "--out", "other")
    outcome = run("evaluate", folder, packaging, *flags)
    assert outcome.exit_code == 0, outcome.output
    assert result_of(place / "other")["weights"] == [0.25, 0.75]
    assert list(result_of(place / "other")["point_error"]) == ["forearm", "hand"]


def test_settings_of_a_file_go_before_those_a_run_carries(run, place, packaged, packaging):
    folder, _ = packaged
    (place / "mine.toml").write_text("[fitness]\nlambda_f = 1.0\nlambda_E = 0.0\n")
    assert run("evaluate", folder, packaging, "--config", "mine.toml", "--out", "other").exit_code == 0
    other = result_of(place / "other")
    assert other["fitness"] == other["path_fitness"] == result_of(folder)["path_fitness"]


def test_without_out_nothing_is_written(run, place, packaged, packaging):
    folder, _ = packaged
    outcome = run("evaluate", folder, packaging)
    assert outcome.exit_code == 0
    assert f"r {result_of(folder)['fitness']:.4f} m" in outcome.output
    assert not list(place.iterdir())


def test_quiet_prints_nothing(run, place, packaged, packaging):
    outcome = run("evaluate", packaged[0], packaging, "--quiet", "--out", "other")
    assert (outcome.exit_code, outcome.output) == (0, "")
    assert (place / "other" / "result.json").is_file()


def test_evaluation_in_a_search_s_folder_leaves_no_file_of_the_search(run, place, packaging, small):
    assert run("search", packaging, *small, "--out", "run").exit_code == 0
    (place / "arm.csv").write_text(modified(ARM))
    assert run("evaluate", "arm.csv", packaging, "--out", "run", "--overwrite").exit_code == 0
    assert not (place / "run" / "history.csv").exists()


def test_long_arm_may_be_longer_than_a_search_allows(run, place, packaging):
    """L_max bounds what a search looks for, not what can be scored."""
    (place / "mine.toml").write_text("[design]\nlength = [0.1, 0.3]\n")
    (place / "arm.csv").write_text(modified(ARM))
    outcome = run("evaluate", "arm.csv", packaging, "--config", "mine.toml")
    assert outcome.exit_code == 0, outcome.output


def test_settings_that_points_from_the_base_do_not_need_are_named(run, place, packaged):
    (place / "mine.toml").write_text("[task]\nscale = 0.5\n")
    outcome = run("evaluate", packaged[0], packaged[0] / "task.csv", "--base", "origin", "--config", "mine.toml")
    assert outcome.exit_code == 0, outcome.output
    assert "scale" in outcome.output


def test_a_run_folder_that_was_moved_is_evaluated_and_repeated(run, place, packaging, small):
    shutil.copy(packaging, place / "take.csv")
    assert run("search", "take.csv", *small, "-q", "--out", "run").exit_code == 0
    (place / "take.csv").unlink()
    (place / "run").rename(place / "moved")
    outcome = run("evaluate", "moved", "--out", "again")
    assert outcome.exit_code == 0, outcome.output
    assert "take.csv does not exist any more" in " ".join(outcome.stderr.split())
    assert "--base origin" in outcome.stderr
    one, other = (json.loads((place / name / "result.json").read_text()) for name in ("moved", "again"))
    assert one["fitness"] == other["fitness"]
    assert run("search", "--config", "moved/settings.toml", "-q", "--out", "repeated").exit_code == 0
    assert (place / "repeated" / "history.csv").read_bytes() == (place / "moved" / "history.csv").read_bytes()
