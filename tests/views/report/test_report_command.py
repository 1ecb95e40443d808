"""The command: what it writes and what it refuses."""

import json
import shutil

import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.views.report import pdf

MUJOCO = "mujoco"


@pytest.fixture
def run(folders, tmp_path, undrawn):
    """A copy of a run folder."""
    return shutil.copytree(folders["packaging"], tmp_path / "run")


def call(*words):
    return CliRunner().invoke(app, ["report", *map(str, words)])


def refused(*words):
    """The sentence of a call that is turned away."""
    result = call(*words)
    assert result.exit_code == 2, result.output
    assert "Traceback" not in result.output
    return " ".join(result.output.split())


def test_the_report_lies_in_the_run_folder_and_is_replaced(run):
    first = call(run)
    assert first.exit_code == 0
    assert "report.html" in first.output
    content = (run / "report.html").read_bytes()
    assert b"</html>" in content
    assert call(run, "--quiet").output == ""
    assert (run / "report.html").read_bytes() == content


def test_another_file_is_replaced_only_if_asked(run, tmp_path):
    out = tmp_path / "page.html"
    out.write_text("mine")
    assert "is there already" in refused(run, "--out", out)
    assert out.read_text() == "mine"
    assert call(run, "--out", out, "--overwrite", "--payload", 2.5).exit_code == 0
    assert "2.5 kg" in out.read_text(encoding="utf-8")
    assert not (run / "report.html").exists()


def test_bad_outputs_are_refused(run, tmp_path):
    assert "is a folder" in refused(run, "--out", tmp_path)
    assert "is no HTML file; allowed: .html, .htm" in refused(run, "--out", tmp_path / "a.pdf")
    assert "does not exist" in refused(run, "--out", tmp_path / "none" / "a.html")
    (run / "report.html").mkdir()
    assert "is a folder" in refused(run)


def test_the_pdf_is_checked_beforehand(run, tmp_path):
    (tmp_path / "a.pdf").write_text("mine")
    assert "a.pdf is there already" in refused(run, "--out", tmp_path / "a.html", "--pdf")
    assert not (tmp_path / "a.html").exists()


def test_bad_run_folders_are_refused(run, tmp_path):
    assert "does not exist" in refused(tmp_path / "nothing")
    assert "is a file" in refused(run / "result.json")
    assert "result.json is missing" in refused(tmp_path)


@pytest.mark.parametrize("text", ["", "{", "[]", "{}", '{"fitness": "low"}'])
def test_a_broken_result_is_named(run, text):
    (run / "result.json").write_text(text)
    assert "result.json" in refused(run)
    assert not (run / "report.html").exists()


@pytest.mark.parametrize("name", ["fitness", "dh", "seed", "rejected", "wall_time"])
def test_a_result_with_a_part_missing_is_refused(run, name):
    content = json.loads((run / "result.json").read_text())
    del content[name]
    (run / "result.json").write_text(json.dumps(content))
    assert name in refused(run) or name == "dh"


def test_without_a_browser_the_page_is_there_and_a_sentence(run, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(pdf, "PLACES", ())
    assert "the PDF needs a browser" in refused(run, "--pdf")
    assert (run / "report.html").is_file()


def test_a_payload_that_cannot_be_is_refused(run):
    assert "payload" in refused(run, "--payload", -1)


def test_the_simulation_is_added(run):
    pytest.importorskip(MUJOCO)
    assert call(run, "--simulate").exit_code == 0
    assert "under position control in MuJoCo" in (run / "report.html").read_text(encoding="utf-8")
