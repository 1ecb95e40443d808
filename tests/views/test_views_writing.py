"""A search leaves a preview and a report beside its result."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.errors import RunFolderError
from armdesign.views import writing as views

PACKAGING = Path(__file__).resolve().parents[2] / "examples" / "packaging.csv"
SMALL = ("--dof", "4", "--particles", "12", "--iterations", "3")


def search(*flags):
    return CliRunner().invoke(app, ["search", str(PACKAGING), *SMALL, *map(str, flags)])


@pytest.mark.views
def test_a_search_leaves_preview_and_report_and_another_one_removes_them(tmp_path):
    done = search("--out", tmp_path / "run")
    assert done.exit_code == 0, done.output
    for name in ("preview.html", "report.html"):
        page = (tmp_path / "run" / name).read_text(encoding="utf-8")
        assert page.startswith("<!")
        assert "<title>run: " in page  # called after its folder
        assert "".join(str(tmp_path / "run" / name).split()) in "".join(done.output.split())
    assert search("--out", tmp_path / "run", "--overwrite", "--no-report").exit_code == 0
    assert not (tmp_path / "run" / "report.html").exists()
    assert not (tmp_path / "run" / "preview.html").exists()


@pytest.mark.views
def test_a_view_that_cannot_be_written_leaves_the_result(tmp_path, monkeypatch):
    def full(path, text):
        raise RunFolderError(f"cannot write {path}: No space left on device")

    monkeypatch.setattr(views, "write_whole", full)
    done = search("--out", tmp_path / "run")
    assert done.exit_code == 2
    assert "No space left on device" in done.stderr
    assert (tmp_path / "run" / "result.json").is_file()
