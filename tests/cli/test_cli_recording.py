"""armdesign recording: info, plot and convert."""

import json
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import build_task, read_recording
from armdesign.settings.sections import Task as TaskSettings

SHARED = Path(__file__).resolve().parents[3] / "shared" / "recordings"
BOX = SHARED / "pyomeca" / "box_lift.c3d"
FRAMES = 61


@pytest.fixture
def take(tmp_path):
    """An arm in millimetres with y up, as a TRC file."""
    t = np.linspace(0, 1, FRAMES)
    shoulder = np.stack([0 * t, 1400 + 0 * t, 0 * t], axis=1)
    elbow = shoulder + 300 * np.stack([np.sin(t), -np.cos(t), 0 * t], axis=1)
    wrist = elbow + 250 * np.stack([np.sin(2 * t), -np.cos(2 * t), 0.1 * t], axis=1)
    heel = shoulder - [0, 1400, 0]
    table = np.column_stack([np.arange(FRAMES) + 1, t, shoulder, elbow, wrist, heel])
    names = ("R.Shoulder", "R.Elbow", "R.Wrist", "R.Heel")
    head = [
        "PathFileType\t4\t(X/Y/Z)\ttake.trc",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"60\t60\t{FRAMES}\t4\tmm\t60\t1\t{FRAMES}",
        "Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in range(1, 5) for axis in "XYZ"),
        "",
    ]
    rows = ["\t".join([f"{row[0]:.0f}", *(f"{value:.6f}" for value in row[1:])]) for row in table]
    file = tmp_path / "take.trc"
    file.write_text("\n".join([*head, *rows]) + "\n")
    return file


def test_info_says_what_there_is(run, take):
    result = run("recording", "info", take)
    assert result.exit_code == 0
    for part in ("TRC, 61 frames over 1 s", "Lengths are in millimetres", "y points up", "* the right arm",
                 "shoulder to elbow", "0.300 m +- 0.000 m", "--base shoulder=R.Shoulder"):  # fmt: skip
        assert part in result.stdout


def test_info_as_json(run, take):
    content = json.loads(run("recording", "info", take, "--json").stdout)
    assert content["frames"] == FRAMES
    assert content["arms"][0]["points"] == ["elbow=R.Elbow", "wrist=R.Wrist"]


def test_units_axis_and_mirror_can_be_said(run, take):
    result = run("recording", "info", take, "--units", "cm", "--up", "z", "--mirror")
    for part in ("Lengths are in centimetres, as asked for although the file says mm", "z points up", "Mirrored"):
        assert part in result.stdout


@pytest.mark.parametrize("ending", ["png", "svg"])
def test_plot_writes_a_picture_once(run, take, tmp_path, ending):
    out = tmp_path / f"picture.{ending}"
    assert run("recording", "plot", take, "--out", out).exit_code == 0
    content = out.read_bytes()
    result = run("recording", "plot", take, "--out", out)
    assert result.exit_code == 2
    assert "is there already. Use --overwrite" in result.stderr
    assert run("recording", "plot", take, "--out", out, "--overwrite").exit_code == 0
    assert out.read_bytes() == content


def test_plot_names_its_picture_after_the_file(run, take, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "Written: take.png" in run("recording", "plot", "take.trc").stdout
    assert (tmp_path / "take.png").is_file()


@pytest.mark.parametrize("flags", [[], ["--rate", "30"], ["--from", "0.2", "--to", "0.8", "--scale", "2"]])
def test_a_converted_recording_has_the_same_task(run, take, tmp_path, flags):
    out = tmp_path / "out.csv"
    result = run("recording", "convert", take, out, *flags)
    assert result.exit_code == 0, result.stderr
    names = {"--rate": "rate", "--from": "start", "--to": "stop", "--scale": "scale"}
    settings = {names[flag]: float(value) for flag, value in zip(flags[::2], flags[1::2], strict=True)}
    ours, theirs = build_task(read_recording(out)), build_task(read_recording(take), TaskSettings(**settings))
    assert ours.points == theirs.points == ("elbow", "wrist")
    assert ours.P.tobytes() == theirs.P.tobytes()
    assert ours.time.tobytes() == theirs.time.tobytes()


def test_convert_tells_what_was_done(run, take, tmp_path):
    result = run("recording", "convert", take, tmp_path / "out.csv", "--points", "elbow=R.Elbow,hand=R.Wrist")
    assert "Lengths are in millimetres" in result.stderr
    assert "out.task.json" in result.stdout
    content = json.loads((tmp_path / "out.task.json").read_text())
    assert content["points"] == ["elbow=R.Elbow", "hand=R.Wrist"]
    assert content["up"] == "y"
    assert " ".join(step["sentence"] for step in content["steps"]) == " ".join(result.stderr.split())
    assert max(map(len, result.stderr.splitlines())) <= 80
    assert run("recording", "convert", take, tmp_path / "quiet.csv", "-q").output == ""


def test_convert_overwrites_nothing_unasked(run, take, tmp_path):
    for name in ("out.csv", "out.task.json"):
        (tmp_path / name).write_text("mine")
        result = run("recording", "convert", take, tmp_path / "out.csv")
        assert result.exit_code == 2
        assert f"{name} is there already" in result.stderr
        assert (tmp_path / name).read_text() == "mine"
        (tmp_path / name).unlink()
    assert run("recording", "convert", take, take.with_suffix(".csv")).exit_code == 0


def test_several_files_through_the_settings(run, tmp_path):
    for name, x in (("upper", 0.0), ("lower", 0.3), ("hand", 0.55)):
        rows = "".join(f"{x},{0.01 * i},1,0,0,0,1\n" for i in range(10))
        (tmp_path / f"{name}.csv").write_text("x,y,z,q0,q1,q2,q3\n" + rows)
    config = tmp_path / "take.toml"
    files = 'files = { shoulder = "upper.csv", elbow = "lower.csv", hand = "hand.csv" }'
    config.write_text(f'[task]\n{files}\nfile_rate = 50\nbase = "shoulder"\npoints = ["elbow", "hand"]\n')
    assert "3 points, 3 of them always seen" in run("recording", "info", "--config", config, "--units", "m").stdout
    out = tmp_path / "out.csv"
    result = run("recording", "convert", out, "--config", config, "--units", "m", "--orientation", "hand")
    assert result.exit_code == 0, result.stderr
    converted = read_recording(out)
    assert list(converted.points) == ["shoulder", "elbow", "hand"]
    assert list(converted.orientations) == ["hand"]


@pytest.mark.skipif(not BOX.is_file(), reason="the shared recordings are not at hand")
def test_a_real_take_from_the_file_to_plain_csv(run, tmp_path):
    out = tmp_path / "box.csv"
    assert "308" in run("recording", "convert", BOX, out, "--orientation", "hand").stderr
    ours, theirs = (build_task(read_recording(file), TaskSettings(orientation="hand")) for file in (out, BOX))
    assert ours.P.tobytes() == theirs.P.tobytes()
    np.testing.assert_allclose(ours.R, theirs.R, atol=1e-12)
