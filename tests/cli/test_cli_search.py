"""The search command: what it says, how flags and files of settings go together, where runs go."""

import json
import re
import tomllib
from fractions import Fraction
from pathlib import Path

import pytest

from armdesign.runs.folder import PREVIEW, REPORT
from armdesign.search.search import Search


@pytest.fixture
def settings_of(run, place, packaging, small):
    """Settings in the settings.toml of a search with these flags, and what the command printed."""

    def settings(*flags, recording=packaging):
        outcome = run("search", recording, *small, "--out", place / "run", "--overwrite", *flags)
        assert outcome.exit_code == 0, outcome.output
        return tomllib.loads((place / "run" / "settings.toml").read_text(encoding="utf-8")), outcome.output

    return settings


def test_progress_speaks_the_paper_s_terms(packaged):
    _, outcome = packaged
    pattern = r"iteration 3/3  r 0\.\d{4}  f \d+\.\d, E \d+\.\d mm  valid \d+  0:00 left"
    assert re.search(pattern, outcome.output)


def test_opening_says_what_is_searched(packaged):
    _, outcome = packaged
    assert "The recording has 100 frames over 1.98 s, about 50 frames/s." in outcome.output
    assert "Weights: upper_arm 0.167, forearm 0.333, hand 0.5." in outcome.output
    assert "an arm of 4 joints with rapso, 10 particles, 3 iterations, seed 0" in outcome.output


def test_table_at_the_end_is_that_of_the_result(packaged):
    folder, outcome = packaged
    result = json.loads((folder / "result.json").read_text())
    assert f"L {result['length']:.4f} m" in outcome.output
    assert f"r {result['fitness']:.4f} m" in outcome.output
    assert f"f {1e3 * result['path_fitness']:.2f} mm" in outcome.output
    assert f"E {1e3 * result['area']:.2f} mm" in outcome.output
    for name, error in result["point_error"].items():
        assert re.search(rf"{name} +{1e3 * error['mean']:.2f} +{1e3 * error['max']:.2f}\n", outcome.output)
    for row in result["dh"]["rows"]:
        assert re.search(rf" {1e3 * row['a']:.2f} +{1e3 * row['d']:.2f}\n", outcome.output)


def test_paths_at_the_end_are_the_files_in_the_folder(packaged):
    folder, outcome = packaged
    told = set(re.findall(rf"^  {re.escape(str(folder))}.(\S+)$", outcome.output, re.MULTILINE))
    whole = {"result.json", "trajectory.csv", "task.csv", "task.json", "history.csv", "settings.toml", "arm.urdf"}
    assert told - {PREVIEW, REPORT, "alternatives.json"} == whole
    there = {path.name for path in folder.iterdir() if not path.name.startswith(".")}
    assert told == there - {"state.npz"}  # from which --resume with a larger budget goes on


def test_orientation_has_its_line_where_it_counts(packaged, welded):
    assert "orientation [deg]" in welded[1].output
    assert "orientation of hand 0.2" in welded[1].output
    assert "orientation [deg]" not in packaged[1].output


def test_quiet_prints_nothing(run, place, packaging, small):
    outcome = run("search", packaging, *small, "--quiet", "--out", "run")
    assert outcome.exit_code == 0
    assert outcome.output == ""
    assert (place / "run" / "result.json").is_file()


def test_default_folder_tells_what_it_holds_and_is_never_used_twice(run, place, packaging, small):
    for _ in range(2):
        assert run("search", packaging, *small, "--seed", 7, "--algorithm", "pso").exit_code == 0
    assert {path.name for path in (place / "runs").iterdir()} == {
        "packaging-pso-n4-seed7",
        "packaging-pso-n4-seed7-2",
    }


@pytest.fixture
def stopped(run, place, packaging, small, monkeypatch):
    """The folder of a search that was stopped at once in its second iteration."""
    advance = Search.advance

    def interrupted(self):
        if self.swarm.iteration == 1:
            raise KeyboardInterrupt
        return advance(self)

    with monkeypatch.context() as patch:
        patch.setattr(Search, "advance", interrupted)
        assert run("search", packaging, *small).exit_code == 130
    (folder,) = (place / "runs").iterdir()
    return folder


def test_search_that_was_stopped_is_not_lost_by_starting_it_again(run, place, packaging, small, stopped):
    before = {path.name: path.read_bytes() for path in stopped.iterdir()}
    assert run("search", packaging, *small).exit_code == 0
    assert {path.name: path.read_bytes() for path in stopped.iterdir()} == before
    assert (place / "runs" / f"{stopped.name}-2" / "result.json").is_file()
    outcome = run("search", packaging, *small, "--out", stopped)
    assert outcome.exit_code == 2
    assert "--resume" in outcome.output
    assert {path.name: path.read_bytes() for path in stopped.iterdir()} == before
    assert run("search", "--resume", stopped).exit_code == 0
    for name in ("history.csv", "trajectory.csv", "arm.urdf"):
        assert (stopped / name).read_bytes() == (place / "runs" / f"{stopped.name}-2" / name).read_bytes()


@pytest.mark.parametrize("name", ['it\'s "my" arm.csv', "Übung  α 手 100%{x}.csv", "-o.csv"])
def test_odd_file_names(run, place, packaging, small, name):
    (place / name).write_bytes(packaging.read_bytes())
    assert run("search", *small, "--quiet", "--", name).exit_code == 0
    (folder,) = (place / "runs").iterdir()
    settings = tomllib.loads((folder / "settings.toml").read_text(encoding="utf-8"))
    assert settings["task"]["recording"] == str(place.resolve() / name)
    assert run("search", "--config", folder / "settings.toml", "--out", "again", "--quiet").exit_code == 0
    assert (place / "again" / "history.csv").read_bytes() == (folder / "history.csv").read_bytes()


def test_odd_point_names(run, place, packaging, small):
    text = (
        packaging.read_text()
        .replace("upper_arm", "Oberarm (α)")
        .replace("forearm", "avant-bras é")
        .replace("hand", "手")
    )
    (place / "odd.csv").write_text(text, encoding="utf-8")
    outcome = run("search", "odd.csv", *small, "--points", "Oberarm (α),手", "--out", "run")
    assert outcome.exit_code == 0, outcome.output
    result = json.loads((place / "run" / "result.json").read_text(encoding="utf-8"))
    assert result["points"] == list(result["point_error"]) == ["Oberarm (α)", "手"]
    assert (place / "run" / "task.csv").read_text(encoding="utf-8").startswith("time,Oberarm (α)_x,")


def test_flags_go_over_the_file(settings_of, place):
    text = "[search]\nparticles = 11\nseed = 5\ninertia = 0.7\n[design]\ndof = 5\n[task]\nrecording = 'absent.csv'\n"
    (place / "mine.toml").write_text(text)
    settings, _ = settings_of("--config", place / "mine.toml", "--seed", 6)
    assert Path(settings["task"]["recording"]).name == "packaging.csv"
    assert settings["search"]["particles"] == 10
    assert settings["search"]["seed"] == 6
    assert settings["search"]["inertia"] == 0.7
    assert settings["design"]["dof"] == 4


def test_recording_in_a_file_counts_from_the_file(run, place, packaging, small, monkeypatch):
    (place / "data").mkdir()
    (place / "elsewhere").mkdir()
    (place / "data" / "mine.csv").write_bytes(packaging.read_bytes())
    (place / "data" / "mine.toml").write_text('[task]\nrecording = "mine.csv"\n')
    monkeypatch.chdir(place / "elsewhere")
    outcome = run("search", "--config", "../data/mine.toml", *small, "--out", "run")
    assert outcome.exit_code == 0, outcome.output
    settings = tomllib.loads((place / "elsewhere" / "run" / "settings.toml").read_text())
    assert settings["task"]["recording"] == str((place / "data" / "mine.csv").resolve())


@pytest.mark.parametrize(
    ("text", "w_0", "weights"),
    [
        ("1/6,1/3,1/2", 0.0, ["1/6", "1/3", "1/2"]),
        (" 0.25 , 0.25,0.5 ", 0.0, ["1/4", "1/4", "1/2"]),
    ],
)
def test_weights_as_fractions_with_and_without_that_of_the_orientation(settings_of, text, w_0, weights):
    settings, _ = settings_of("--weights", text)
    assert settings["fitness"]["orientation_weight"] == w_0
    assert settings["fitness"]["weights"] == [float(Fraction(weight)) for weight in weights]


def test_first_of_m_plus_one_weights_is_that_of_the_orientation(settings_of, welding):
    settings, output = settings_of("--weights", "1/5,0,3/10,1/2", recording=welding)
    assert settings["fitness"]["orientation_weight"] == 0.2
    assert settings["fitness"]["weights"] == [0.0, 0.3, 0.5]
    assert settings["task"]["orientation"] == "hand"
    assert "orientation of hand 0.2" in output


def test_scenario_goes_over_the_weights_of_the_file(settings_of, place, welding):
    (place / "mine.toml").write_text("[fitness]\nweights = [0.2, 0.2, 0.6]\norientation_weight = 0.0\n")
    settings, _ = settings_of("--config", place / "mine.toml", "--scenario", "welding", recording=welding)
    assert settings["fitness"]["scenario"] == "welding"
    assert settings["fitness"]["weights"] == [0.0, 0.1, 0.7]
    assert settings["fitness"]["orientation_weight"] == 0.2
    settings, _ = settings_of("--config", place / "mine.toml", recording=welding)
    assert settings["fitness"]["weights"] == [0.2, 0.2, 0.6]


def test_orientation_without_weight_says_that_it_is_not_followed(settings_of, welding):
    settings, output = settings_of("--orientation", "hand", recording=welding)
    assert "The orientation of 'hand' is not followed: the orientation weight w_0 is 0." in output
    assert "orientation" not in settings["task"]


def test_base_and_points_are_those_named(settings_of):
    settings, output = settings_of("--base", "upper_arm", "--points", "forearm, hand")
    assert settings["task"]["base"] == "upper_arm"
    assert settings["task"]["points"] == ["forearm", "hand"]
    assert settings["fitness"]["weights"] == pytest.approx([1 / 3, 2 / 3], abs=1e-15)
    assert "Base upper_arm; points from there to the hand: forearm, hand; no orientation." in output


@pytest.mark.parametrize("dof", [1, 10])
def test_any_number_of_joints_from_1_to_10(run, place, packaging, dof):
    reachable = "[fitness]\nreach_tolerance = 0.5\n[design]\nlength = [0.05, 1.2]\n"  # for one joint, too
    (place / "near.toml").write_text(reachable)
    flags = ("--dof", dof, "--particles", 4, "--iterations", 2, "--config", "near.toml", "--out", "run")
    outcome = run("search", packaging, *flags)
    assert outcome.exit_code == 0, outcome.output
    result = json.loads((place / "run" / "result.json").read_text())
    assert result["dof"] == dof
    assert len(result["dh"]["rows"]) == dof + 1
    assert (place / "run" / "trajectory.csv").read_text().splitlines()[0].endswith(f",joint_{dof}")


def test_three_frames_are_enough(run, place, packaging, small):
    (place / "three.csv").write_text("\n".join(packaging.read_text().splitlines()[:4]))
    assert run("search", "three.csv", *small, "--out", "run").exit_code == 0
    assert len((place / "run" / "trajectory.csv").read_text().splitlines()) == 4
