"""``armdesign search --dof auto`` as a user types it."""

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.errors import RunFolderError
from armdesign.experiments.studies.study_plan import StudyRequest
from armdesign.experiments.studies.study_store import settle_study

ROOT = Path(__file__).resolve().parents[3]
EXAMPLE = ROOT / "examples" / "packaging.csv"
SMALL = ("--dof", "auto", "--particles", "16", "--iterations", "3", "--rate", "5", "--enough", "50", "--no-report")


@pytest.fixture(scope="module")
def run():
    return lambda *args: CliRunner().invoke(app, [str(arg) for arg in args])


@pytest.fixture(scope="module")
def made(run, tmp_path_factory):
    """A choice of the number of joints: its folder and what was printed."""
    folder = tmp_path_factory.mktemp("command") / "auto"
    outcome = run("search", EXAMPLE, *SMALL, "--out", folder)
    assert outcome.exit_code == 0, outcome.output
    return folder, outcome.output


def test_it_says_why_it_stopped(made):
    folder, printed = made
    content = json.loads((folder / "auto.json").read_text(encoding="utf-8"))
    assert content["explanation"] in " ".join(printed.split())
    assert re.search(rf"^\* +{content['chosen']} ", printed, re.MULTILINE)
    assert json.loads((folder / "result.json").read_text(encoding="utf-8"))["dof"] == content["chosen"]


def test_what_reads_run_folders_reads_it(made, run, tmp_path):
    folder, _ = made
    outcome = run("export", folder, "--out", tmp_path / "robot")
    assert outcome.exit_code == 0, outcome.output
    listed = run("runs", folder).output
    assert "finished" in listed.splitlines()[1]


def test_a_finished_one_is_left_alone(made, run):
    folder, _ = made
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()}
    outcome = run("search", "--resume", folder)
    assert (outcome.exit_code, "nothing to resume" in " ".join(outcome.output.split())) == (0, True)
    refused = run("search", EXAMPLE, *SMALL, "--out", folder)
    assert (refused.exit_code, "--overwrite" in refused.output) == (2, True)
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file()} == before


def test_its_folder_takes_no_single_run_and_no_study(made, run):
    folder, _ = made
    before = {path for path in folder.rglob("*")}
    for flags in ((), ("--overwrite",)):
        outcome = run("search", EXAMPLE, "--dof", "3", "--out", folder, *flags)
        assert outcome.exit_code == 2
        assert "holds a search for the number of joints. Name another folder" in outcome.output.splitlines()[-1]
    assert {path for path in folder.rglob("*")} == before
    with pytest.raises(RunFolderError, match="holds a search for the number of joints, not a study"):
        settle_study(folder, StudyRequest("designs", (), (), 1, 0), {})


@pytest.mark.parametrize(
    ("flags", "sentence"),
    [
        (("--dof", "auto", "--within", "-1"), "--within is -1 %; allowed: 0 % or more"),
        (("--dof", "auto", "--enough", "nan"), "--enough is nan mm; allowed: 0 mm or more"),
        (("--dof", "many"), "auto"),
    ],
)
def test_bad_figures_write_nothing(run, tmp_path, monkeypatch, flags, sentence):
    monkeypatch.chdir(tmp_path)
    outcome = run("search", EXAMPLE, *flags)
    assert outcome.exit_code == 2
    assert sentence in outcome.output.splitlines()[-1]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(("tolerance", "code"), [("500mm", 0), ("0.001mm", 3)])
def test_with_a_tolerance_it_says_first_whether_that_is_met(run, tmp_path, tolerance, code):
    flags = ("--dof", "auto", "--particles", "16", "--iterations", "2", "--rate", "5", "--no-report", "--body", "thin")
    narrow = tmp_path / "narrow.toml"
    narrow.write_text("[design]\nauto_dof = [3, 4]\n", encoding="utf-8")
    folder = tmp_path / "auto"
    outcome = run("search", EXAMPLE, *flags, "--config", narrow, "--tolerance", tolerance, "--out", folder)
    assert outcome.exit_code == code, outcome.output
    content = json.loads((folder / "auto.json").read_text(encoding="utf-8"))
    assert content["stopped_by"] == ("missed" if code else "tolerance")
    assert ("suffice" in outcome.output) == (code == 0)
    assert [each["dof"] for each in content["searched"]] == ([3, 4] if code else [3])


def test_a_tolerance_and_the_rule_for_none_contradict(run, tmp_path):
    outcome = run("search", EXAMPLE, *SMALL, "--tolerance", "5mm", "--out", tmp_path / "auto")
    assert outcome.exit_code == 2
    assert "--enough" in outcome.output
    assert "5 mm" in outcome.output
