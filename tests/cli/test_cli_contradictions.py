"""Flags that contradict each other are refused; a run folder that was moved is still a task."""

import json
import shutil

import pytest

CONTRADICTIONS = [
    (("search", "--budget", 500, "--particles", 9), "--budget", "multibasin"),
    (("search", "--algorithm", "pso", "--budget", 500), "--budget", "multibasin"),
    (("search", "--algorithm", "multibasin", "--iterations", 5), "--iterations", "rapso, pso"),
    (("sweep", "--algorithm", "pso", "--budget", 500), "--budget", "multibasin"),
    (("search", "--overwrite"), "--overwrite", "--out"),
    (("search", "--enough", 3), "--enough", "--dof auto"),
]


@pytest.mark.parametrize(("args", "flag", "needed"), CONTRADICTIONS)
def test_flags_that_contradict_each_other(refused, packaging, args, flag, needed):
    command, *flags = args
    sentence = refused(command, packaging, *flags)
    assert flag in sentence
    assert needed in sentence


@pytest.mark.parametrize(
    ("flags", "flag", "needed"),
    [
        (("--rate", 50), "--rate", "--trajectory"),
        (("--trajectory", "csv", "--payload", 2), "--payload", "--format"),
    ],
)
def test_export_takes_no_option_without_effect(refused, packaged, flags, flag, needed):
    sentence = refused("export", packaged[0], *flags)
    assert flag in sentence
    assert needed in sentence


def test_a_run_folder_that_was_moved_is_evaluated_and_repeated(run, place, packaging, small):
    shutil.copy(packaging, place / "take.csv")
    assert run("search", "take.csv", *small, "-q", "--out", "run").exit_code == 0
    (place / "take.csv").unlink()
    (place / "run").rename(place / "moved")
    outcome = run("evaluate", "moved", "--out", "again")
    assert outcome.exit_code == 0, outcome.output
    assert "take.csv does not exist any more" in outcome.stderr
    assert "--base origin" in outcome.stderr
    one, other = (json.loads((place / name / "result.json").read_text()) for name in ("moved", "again"))
    assert one["fitness"] == other["fitness"]
    assert run("search", "--config", "moved/settings.toml", "-q", "--out", "repeated").exit_code == 0
    assert (place / "repeated" / "history.csv").read_bytes() == (place / "moved" / "history.csv").read_bytes()
