import json
import signal
import subprocess
import sys
import time

import pytest


def content(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_ctrl_c_before_the_work_is_one_sentence_and_changes_nothing(run, packaged, packaging, small, monkeypatch):
    folder, _ = packaged
    before = content(folder)

    def interrupted(*args, **options):
        raise KeyboardInterrupt

    monkeypatch.setattr("armdesign.cli.input_recordings.prepare", interrupted)
    outcome = run("search", packaging, *small, "--seed", 1, "--out", folder, "--overwrite")
    assert outcome.exit_code == 130
    assert outcome.output.splitlines()[-1].startswith("armdesign: ")
    assert "Traceback" not in outcome.output
    assert content(folder) == before


@pytest.mark.skipif(sys.platform == "win32", reason="signals")
def test_ctrl_c_on_a_real_process_leaves_the_best_arm_so_far(tmp_path, packaging, environment):
    code = (
        "import signal; signal.signal(signal.SIGINT, signal.default_int_handler)\n"
        "from armdesign.cli import main; main()"
    )
    flags = [
        "--dof",
        "6",
        "--particles",
        "10",
        "--iterations",
        "100000",
        "--workers",
        "1",
        "--no-report",
        "--out",
        "run",
    ]
    command = [sys.executable, "-c", code, "search", str(packaging), *flags]
    log = tmp_path / "log"
    with (
        log.open("w") as stream,
        subprocess.Popen(command, stdout=stream, stderr=stream, cwd=tmp_path, env=environment) as child,
    ):
        deadline = time.monotonic() + 120
        while " valid " not in log.read_text() and child.poll() is None and time.monotonic() < deadline:
            time.sleep(0.05)
        child.send_signal(signal.SIGINT)
        assert child.wait(60) == 130
    assert "Traceback" not in log.read_text()
    assert "search --resume run" in log.read_text().splitlines()[-1]
    result = json.loads((tmp_path / "run" / "result.json").read_text())
    assert result["stopped_by"] == "interrupted"
    rows = (tmp_path / "run" / "history.csv").read_text().splitlines()[1:]
    assert result["evaluations"] == 10 * len(rows)
    assert (tmp_path / "run" / "arm.urdf").is_file()
