"""``armdesign preview``: a file or a server, and a sentence for everything that cannot be."""

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import urllib.request

import pytest
from typer.testing import CliRunner

from armdesign.cli import app
from armdesign.runs.folder import claim_folder
from armdesign.runs.writing import write_result
from armdesign.search.result import Result


@pytest.fixture(scope="session")
def folder(example_runs, tmp_path_factory):
    """A run folder with a result, and a name of its own."""
    run = example_runs["packaging"]
    out = tmp_path_factory.mktemp("runs") / "<b>one"
    claim_folder(out, overwrite=False)
    write_result(out, Result(run.problem, run.evaluation))
    return out


def call(*args):
    return CliRunner().invoke(app, ["preview", *map(str, args)])


def test_html_is_written_once_and_again_only_when_told(folder, tmp_path):
    target = tmp_path / "preview.html"
    done = call(folder, folder, "--html", target)
    assert done.exit_code == 0, done.output
    assert f"Written: {target} (" in done.output
    page = target.read_text(encoding="utf-8")
    assert "&lt;b&gt;one" in page
    assert "<b>one" not in page
    target.write_text("mine")
    again = call(folder, "--html", target)
    assert again.exit_code == 2
    assert "is there already" in again.output
    assert target.read_text() == "mine"
    assert call(folder, "--html", target, "--overwrite").exit_code == 0
    assert target.read_text(encoding="utf-8").startswith("<!DOCTYPE html>")
    assert [path.name for path in tmp_path.iterdir()] == ["preview.html"]


def test_what_cannot_be_is_a_sentence(folder, tmp_path):
    broken, target = tmp_path / "broken", tmp_path / "out.html"
    shutil.copytree(folder, broken)
    (broken / "result.json").write_text("{")
    (tmp_path / "empty").mkdir()
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        cases = [
            ((tmp_path / "none", "--html", target), "there is no run folder"),
            ((tmp_path / "empty", "--html", target), "holds no result"),
            ((broken, "--html", target), "is damaged"),
            ((folder, "--html", tmp_path), "it is a folder"),
            ((folder, "--html", tmp_path / "no" / "where.html"), "the folder does not exist"),
            ((folder, "--html", target, "--port", "8080"), "--port is of no use with --html"),
            ((folder, "--html", target, "--speed", "0"), "the speed is 0"),
            ((*[folder] * 13, "--html", target), "13 designs"),
            ((folder, "--port", port), f"cannot listen on port {port} of 127.0.0.1: it is in use"),
            ((folder, "--port", "70000"), "port 70000 is none"),
        ]
        for args, sentence in cases:
            done = call(*args)
            assert done.exit_code == 2, args
            assert sentence in done.output
            assert "Traceback" not in done.output
    assert not target.exists()


@pytest.mark.skipif(os.name == "nt", reason="sends signals")
def test_the_server_says_where_it_is_serves_the_page_and_ends_with_ctrl_c(folder):
    environment = {
        key: value for key, value in os.environ.items() if key not in {"DISPLAY", "WAYLAND_DISPLAY", "BROWSER"}
    }
    environment |= {"PYTHONPATH": os.pathsep.join(sys.path)}
    command = [sys.executable, "-m", "armdesign", "preview", str(folder)]
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment, start_new_session=True
    ) as process:
        address = re.search(r"http://127\.0\.0\.1:\d+/", process.stdout.readline()).group()
        assert "There is no display here" in process.stdout.readline()
        with urllib.request.urlopen(address, timeout=10) as answer:
            assert b"MeshCat" in answer.read()
        process.send_signal(signal.SIGINT)
        assert process.wait(timeout=10) == 0
        assert process.stderr.read() == ""
        with pytest.raises(ProcessLookupError):
            os.killpg(process.pid, 0)  # no process of its group is left
