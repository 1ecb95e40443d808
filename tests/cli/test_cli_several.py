"""Several demonstrations on the command line: search, resume, evaluate and report, and what is refused."""

import json
import re
import tomllib

import numpy as np
import pytest

from armdesign.demonstration import Recording, read_recording, write_plain_csv
from armdesign.search.search import Search

FLAGS = ("--dof", "4", "--particles", "10", "--iterations", "3", "--no-report")


@pytest.fixture(scope="session")
def takes(packaging, tmp_path_factory):
    """Three demonstrations of one task, and one of other points."""
    first, folder = read_recording(packaging), tmp_path_factory.mktemp("takes")
    for name, factor in {"a": 1.0, "b": 1.03, "d": 0.98}.items():
        points = {point: factor * values for point, values in first.points.items()}
        write_plain_csv(folder / f"{name}.csv", Recording(first.time, points))
    points = {point.replace("forearm", "elbow"): values for point, values in first.points.items()}
    write_plain_csv(folder / "other.csv", Recording(first.time, points))
    return folder


@pytest.fixture(scope="session")
def searched(run, takes, tmp_path_factory):
    """A finished run on two of them with one held out, and what the command printed."""
    folder = tmp_path_factory.mktemp("searched") / "run"
    flags = (*FLAGS, "--demonstrations", "worst", "--holdout", takes / "d.csv", "--out", folder)
    outcome = run("search", takes / "a.csv", takes / "b.csv", *flags)
    assert outcome.exit_code == 0, outcome.output
    return folder, outcome.output


def test_the_table_at_the_end_tells_of_each(searched):
    folder, output = searched
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert "One arm for 2 demonstrations: a.csv (100 frames), b.csv (100 frames)." in output
    assert "Held out, not seen by the search: d.csv (100 frames)." in output
    assert "worst of 2 demonstrations" in output
    names = ("a.csv", "b.csv", "d.csv, held out")
    for name, entry in zip(names, [*result["demonstrations"], *result["holdout"]], strict=True):
        r, f, E = entry["fitness"], 1e3 * entry["path_fitness"], 1e3 * entry["area"]
        assert re.search(rf"^{re.escape(name)} +{r:.4f} +{f:.2f} +{E:.2f} +100  ", output, re.MULTILINE)
    assert result["fitness"] == max(entry["fitness"] for entry in result["demonstrations"])
    for name in ("demonstration_2", "holdout_1"):
        assert f"  {folder / name}\n" in output


def test_the_settings_repeat_the_run(run, searched, place):
    folder, _ = searched
    settings = tomllib.loads((folder / "settings.toml").read_text(encoding="utf-8"))
    assert settings["fitness"]["demonstrations"] == "worst"
    assert len(settings["task"]["more_recordings"]) == len(settings["task"]["holdouts"]) == 1
    outcome = run("search", "--config", folder / "settings.toml", "--no-report", "--quiet", "--out", place / "again")
    assert outcome.exit_code == 0, outcome.output
    for name in ("history.csv", "trajectory.csv", "demonstration_2/trajectory.csv", "holdout_1/trajectory.csv"):
        assert (place / "again" / name).read_bytes() == (folder / name).read_bytes()


def test_an_interrupted_run_is_gone_on_with(run, searched, takes, place, monkeypatch):
    folder, _ = searched
    advance = Search.advance

    def stopped(self):
        if self.swarm.iteration == 1:
            raise KeyboardInterrupt
        return advance(self)

    flags = (*FLAGS, "--demonstrations", "worst", "--holdout", takes / "d.csv")
    with monkeypatch.context() as patch:
        patch.setattr(Search, "advance", stopped)
        assert run("search", takes / "a.csv", takes / "b.csv", *flags).exit_code == 130
    (begun,) = (place / "runs").iterdir()
    assert begun.name == "a-and-1-more-rapso-n4-seed0"
    assert run("search", "--resume", begun, "--no-report").exit_code == 0
    for name in ("history.csv", "trajectory.csv", "demonstration_2/trajectory.csv", "holdout_1/trajectory.csv"):
        assert (begun / name).read_bytes() == (folder / name).read_bytes()


def test_evaluate_finds_what_the_search_found(run, searched, takes):
    folder, output = searched
    table = output[output.index("4 joints, modified") : output.index("Written:")].strip()
    assert table in run("evaluate", folder).output
    alone = run("evaluate", folder, takes / "d.csv").output
    held_out = json.loads((folder / "result.json").read_text(encoding="utf-8"))["holdout"][0]
    assert f"r {held_out['fitness']:.4f} m" in alone
    assert "held out" not in alone
    both = run("evaluate", folder, takes / "d.csv", takes / "b.csv").output
    assert "worst of 2 demonstrations" in both


def test_every_demonstration_can_be_exported_and_reported(run, searched, place):
    folder, _ = searched
    outcome = run("export", folder / "demonstration_2", "--trajectory", "csv", "--out", place / "second")
    assert outcome.exit_code == 0, outcome.output
    motions = [
        run("export", folder / name, "--trajectory", "npz", "--out", place / name) for name in (".", "holdout_1")
    ]
    assert [motion.exit_code for motion in motions] == [0, 0]
    outcome = run("report", folder, "--out", place / "page.html")
    assert outcome.exit_code == 0, outcome.output
    page = (place / "page.html").read_text(encoding="utf-8")
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    assert "What counts is the r of the worst of 2 demonstrations" in page
    for entry in (*result["demonstrations"], *result["holdout"]):
        assert f"<td>{1e3 * entry['fitness']:.2f}</td><td>{1e3 * entry['path_fitness']:.2f}</td>" in page
    assert "d.csv, held out" in page


def test_write_config_names_them(run, takes):
    outcome = run("search", takes / "a.csv", takes / "b.csv", "--holdout", takes / "d.csv", "--write-config")
    task = tomllib.loads(outcome.output)["task"]
    assert [task["recording"], *task["more_recordings"], *task["holdouts"]] == [
        str((takes / f"{name}.csv").resolve()) for name in "abd"
    ]


def test_a_sweep_takes_one_demonstration_at_a_time(refused, searched):
    assert "one at a time" in refused("sweep", "--config", searched[0] / "settings.toml")


def test_frames_and_rates_may_differ(run, takes, place):
    recording = read_recording(takes / "b.csv")
    points = {name: values[:60:2] for name, values in recording.points.items()}
    write_plain_csv(place / "short.csv", Recording(np.array(recording.time[:60:2]), points))
    outcome = run("search", takes / "a.csv", "short.csv", *FLAGS, "--out", "run")
    assert outcome.exit_code == 0, outcome.output
    assert "not the same speed in all demonstrations: 500 deg/s in a.csv; 250 deg/s in short.csv" in " ".join(
        outcome.output.split()
    )
    frames = [entry["frames"] for entry in json.loads((place / "run" / "result.json").read_text())["demonstrations"]]
    assert frames == [100, 30]
