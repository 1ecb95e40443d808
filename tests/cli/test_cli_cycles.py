"""Recordings in their cycles, folders and patterns of takes, every N-th held out."""

import json
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from armdesign.cli.command_options import WeightFlags
from armdesign.cli.input_recordings import Split, every_recording, open_demonstrations
from armdesign.demonstration import Recording, write_plain_csv
from armdesign.errors import SettingsError
from armdesign.settings.sections import Settings


@pytest.fixture
def take(tmp_path):
    """The hand goes to and fro seven times."""
    time = np.arange(700) / 50.0
    away = np.sin(np.pi * time / 2.0) ** 2
    points = {"shoulder": np.tile([0, 0, 1.3], (700, 1)), "elbow": np.tile([0.3, 0, 1.3], (700, 1))}
    points["hand"] = np.stack([0.5 - 0.2 * away, 0.2 * away, 1.3 + 0 * away], axis=1)
    write_plain_csv(tmp_path / "take.csv", Recording(time, points))
    return tmp_path / "take.csv"


def test_cycles_are_listed(run, take):
    outcome = run("recording", "cycles", take)
    assert outcome.exit_code == 0, outcome.output
    assert "--cycles all" in outcome.output
    rows = re.findall(r"^[* ] +\d+ +([\d.]+) +([\d.]+) +([\d.]+)", outcome.output, re.MULTILINE)
    assert len(rows) == 7
    assert all(abs(float(length) - 2.0) < 0.3 for *_, length in rows)
    told = json.loads(run("recording", "cycles", take, "--json", "--from", "4").stdout)
    assert len(told["cycles"]) == 5


def test_all_cycles_are_demonstrations_and_every_third_is_held_out(take):
    opened = open_demonstrations([take], Settings(), WeightFlags(), split=Split("all", 3))
    assert (len(opened.seen), len(opened.unseen), opened.source) == (5, 2, take)
    spans = sorted((each.time[0], each.time[-1]) for each in (*opened.seen, *opened.unseen))
    assert all(one[1] <= other[0] + 1e-9 for one, other in pairwise(spans))
    again = open_demonstrations(None, opened.settings, WeightFlags())  # the settings name the parts
    assert [each.source for each in again.seen] == [str(Path(each.source).resolve()) for each in opened.seen]
    assert len(again.unseen) == 2
    (best,) = open_demonstrations([take], Settings(), WeightFlags(), split=Split("best")).seen
    assert best.frames < 120


def test_settings_alone_have_no_cycles(run, take):
    outcome = run("search", take, "--write-config", "--cycles", "all")
    assert outcome.exit_code == 2
    assert "--cycles" in outcome.output


def test_folders_and_patterns_are_their_files_in_order(tmp_path, take):
    for name in ("b.csv", "a.csv", ".hidden"):
        (tmp_path / "takes").mkdir(exist_ok=True)
        (tmp_path / "takes" / name).write_bytes(take.read_bytes())
    wanted = [tmp_path / "takes" / name for name in ("a.csv", "b.csv")]
    assert every_recording([tmp_path / "takes"]) == every_recording([tmp_path / "takes" / "*.csv"]) == wanted
    opened = open_demonstrations([tmp_path / "takes"], Settings(), WeightFlags(), split=Split(None, 2))
    assert [Path(each.source).name for each in (*opened.seen, *opened.unseen)] == ["a.csv", "b.csv"]
    for i in range(12):
        (tmp_path / "takes" / f"x_{i:04d}_keypoints.json").write_text("{}")  # of OpenPose, a file a frame
    assert every_recording([tmp_path / "takes"]) == [*wanted, tmp_path / "takes" / "x_0000_keypoints.json"]
    with pytest.raises(SettingsError, match="no recording"):
        every_recording([tmp_path / "takes" / "*.bvh"])


@pytest.mark.parametrize("split", [Split("some"), Split(None, 1), Split(None, 3), Split("best", 2)])
def test_what_cannot_be_split_is_refused(take, split):
    with pytest.raises(SettingsError, match="--"):
        open_demonstrations([take], Settings(), WeightFlags(), split=split)
