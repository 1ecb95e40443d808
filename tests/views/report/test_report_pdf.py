"""Printing: by a real browser where there is one, and sentences where there is none or it fails."""

import sys

import pytest

from armdesign.errors import ArmDesignError
from armdesign.views.report import find_browser, pdf, print_pdf

needs_posix = pytest.mark.skipif(sys.platform == "win32", reason="the stand-in for a browser is a shell script")


def stand_in(tmp_path, script):
    """A program that is called like a browser."""
    program = tmp_path / "browser"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    return str(program)


@pytest.mark.skipif(find_browser() is None, reason="no browser is installed")
def test_a_browser_prints_the_report(invented, tmp_path):
    from armdesign.views.report import report_html  # noqa: PLC0415

    print_pdf(report_html(invented()), tmp_path / "report.pdf")
    content = (tmp_path / "report.pdf").read_bytes()
    assert content.startswith(b"%PDF")
    assert content.count(b"/Type /Page\n") + content.count(b"/Type /Page ") >= 3


def test_without_a_browser_there_is_a_sentence(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.setattr(pdf, "PLACES", ())
    with pytest.raises(ArmDesignError, match=r"needs a browser to print it, and none is on PATH\. Open the HTML file"):
        print_pdf("<p>", tmp_path / "a.pdf")


@needs_posix
def test_a_browser_is_found_by_its_name_on_path(monkeypatch, tmp_path):
    program = stand_in(tmp_path, "exit 0")
    chromium = tmp_path / "chromium"
    chromium.symlink_to(program)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert find_browser() == str(chromium)


@needs_posix
@pytest.mark.parametrize(
    ("script", "said"), [("exit 3", "has printed nothing"), ("sleep 30", "has not printed within 0.3 s")]
)
def test_a_browser_that_fails_gives_a_sentence_and_no_file(tmp_path, script, said):
    with pytest.raises(ArmDesignError, match=said):
        print_pdf("<p>", tmp_path / "a.pdf", browser=stand_in(tmp_path, script), time_limit=0.3)
    assert not (tmp_path / "a.pdf").exists()


@needs_posix
def test_what_the_browser_prints_is_what_is_written(tmp_path):
    script = 'for a; do case "$a" in --print-to-pdf=*) printf "%%PDF-1.4 x" > "${a#*=}";; esac; done'
    print_pdf("<p>", tmp_path / "a.pdf", browser=stand_in(tmp_path, script))
    assert (tmp_path / "a.pdf").read_bytes() == b"%PDF-1.4 x"


def test_a_program_that_is_none_gives_a_sentence(tmp_path):
    with pytest.raises(ArmDesignError, match="cannot be started"):
        print_pdf("<p>", tmp_path / "a.pdf", browser=str(tmp_path / "nothing"))
