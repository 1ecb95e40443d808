"""Real motion capture, where it is at hand: the files work as they are, one in each scenario."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.demonstration import read_recording
from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.kinematics.dh import DHTable

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "recordings" / "converted"
FILES = ("box_lift.csv", "handover_giver.csv")

pytestmark = pytest.mark.skipif(not FOLDER.is_dir(), reason="the shared recordings are not at hand")


@pytest.mark.parametrize(("name", "scenario"), [*zip(FILES, ("packaging", "welding"), strict=True)])
def test_recording_gives_an_arm_as_it_is(tmp_path, outside, name, scenario):
    flags = f"--scenario {scenario} --dof 4 --particles 8 --iterations 2 --out {tmp_path / 'run'}".split()
    outcome = CliRunner().invoke(app, ["search", str(FOLDER / name), *flags])
    assert outcome.exit_code == 0, outcome.output
    content = json.loads((tmp_path / "run" / "result.json").read_text())
    recording = read_recording(FOLDER / name)
    gaps = any(np.isnan(points).any() for points in recording.points.values())
    assert bool(re.search(r"Filled \d+ gaps? by interpolation", outcome.output)) == gaps
    assert any("Filled" in note for note in content["notes"]) == gaps
    assert content["points"] == ["elbow", "wrist", "hand"]
    assert content["frames"] == recording.frames
    assert content["fitness"] < 5.0
    trajectory = np.loadtxt(tmp_path / "run" / "trajectory.csv", delimiter=",", skiprows=1)
    task = np.loadtxt(tmp_path / "run" / "task.csv", delimiter=",", skiprows=1)
    assert np.isfinite(task).all()
    np.testing.assert_array_equal(trajectory[:, 0], recording.time)
    check_fitness(content, trajectory[:, 1:], task, outside)


def check_fitness(content, q, task, outside):
    """f and E once more, out of the files."""
    table = DHTable.from_rows([[row["alpha"], row["a"], row["d"]] for row in content["dh"]["rows"]])
    R = rotation_matrices(task[:, 10:14]) if task.shape[1] == 14 else None
    f, E = outside.fitness(
        table, q, task[:, 1:10].reshape(-1, 3, 3), np.array(content["weights"]),
        content["settings"]["fitness"]["delta"], content["orientation_weight"], R, np.array(content["mount"]),
    )  # fmt: skip
    assert f == pytest.approx(content["path_fitness"], abs=1e-9)
    assert pytest.approx(content["area"], abs=1e-9) == E


def test_gaps_are_told_of_in_the_file_that_has_them():
    gaps = {name: np.isnan(read_recording(FOLDER / name).points["wrist"]).any() for name in FILES}
    assert gaps["box_lift.csv"]
