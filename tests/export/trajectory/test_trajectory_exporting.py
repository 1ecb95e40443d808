"""The trajectory of a run as files: what the notes state holds, and what is refused leaves nothing behind."""

import re
from dataclasses import replace

import numpy as np
import pytest
import yaml

from armdesign.errors import RunFolderError, SettingsError
from armdesign.export.export_files import export
from armdesign.export.trajectory.exporting import FILES, TrajectoryOptions, make_trajectory
from armdesign.export.trajectory.tool_poses import tool_poses


def export_trajectory(run, kind, folder, options=None, *, overwrite=False):
    """Write one kind of trajectory alone: its path and the notes."""
    done = export(run, folder, (), kind, timing=options, overwrite=overwrite)
    (path,) = done.paths
    return path, done.notes


def read_csv(path):
    values = np.loadtxt(path, delimiter=",", skiprows=1)
    n = (values.shape[1] - 1) // 3
    return values[:, 0], values[:, 1 : n + 1], values[:, n + 1 : 2 * n + 1], values[:, 2 * n + 1 :]


@pytest.mark.parametrize("kind", FILES)
def test_every_kind_is_written_under_its_name(tmp_path, run, kind):
    written, _ = export_trajectory(run, kind, tmp_path / "new" / "folder")
    assert written == tmp_path / "new" / "folder" / FILES[kind]
    assert [path.name for path in written.parent.iterdir()] == [FILES[kind]]


def test_all_kinds_carry_the_same_motion(tmp_path, run):
    for kind in ("csv", "ros", "npz"):
        export_trajectory(run, kind, tmp_path, TrajectoryOptions(rate=75.0, speed=0.6))
    _, q, v, a = read_csv(tmp_path / FILES["csv"])
    arrays = np.load(tmp_path / FILES["npz"])
    points = yaml.safe_load((tmp_path / FILES["ros"]).read_text())["points"]
    for values, name, field in ((q, "q", "positions"), (v, "v", "velocities"), (a, "a", "accelerations")):
        np.testing.assert_array_equal(arrays[name], values)
        np.testing.assert_array_equal([point[field] for point in points], values)


def test_the_rate_is_that_asked_for_or_the_demonstrations(tmp_path, run):
    for rate in (None, 250.0):
        time, *_ = read_csv(export_trajectory(run, "csv", tmp_path, TrajectoryOptions(rate=rate), overwrite=True)[0])
        np.testing.assert_allclose(np.diff(time), run.problem.task.dt if rate is None else 1 / rate, rtol=1e-6)


def test_the_notes_state_the_deviation_that_the_angles_show(run):
    trajectory = make_trajectory(run)
    path, q = trajectory.path, run.evaluation.path.q
    smooth, solved = tool_poses(run.table, path.at(path.time)), tool_poses(run.table, q)
    moved = 1e3 * np.linalg.norm(smooth[:, :3, 3] - solved[:, :3, 3], axis=1)
    (note,) = [note for note in trajectory.notes if note.startswith("Smoothed")]
    stated = [float(x) for x in re.findall(r"([\d.]+) (?:deg|mm)", note)]
    angle = np.degrees(np.abs(path.at(path.time) - q).max())
    assert stated[:3] == pytest.approx([angle, moved.max(), moved.mean()], abs=0.006)


@pytest.mark.parametrize("speed", [0.5, 1.0, 3.0])
def test_a_motion_beyond_the_joints_limits_is_said_first_with_the_speed_that_keeps_them(runs, speed):
    run = runs["packaging"]
    needs = {"needs": {"max_speed": np.rad2deg(0.6 * np.array(run.verdict.peak_speed)).tolist()}}
    slow = replace(run, problem=replace(run.problem, settings=run.problem.settings.replace(needs)), known_verdict=None)
    assert slow.verdict.speed_fraction == pytest.approx(0.6)
    first = make_trajectory(slow, TrajectoryOptions(speed=speed)).notes[0]
    assert ("(--speed 0.6)" in first or "(--speed 0.59)" in first) == (speed > 0.6)
    motion = make_trajectory(slow, TrajectoryOptions(speed=0.59)).motion
    assert (np.abs(motion.v).max(axis=0) <= 0.6 * np.array(run.verdict.peak_speed)).all()


def test_fitted_limits_hold_and_the_slow_down_is_said(tmp_path, runs):
    options = TrajectoryOptions(rate=1000.0, fit_limits=True, max_velocity=1.0, max_acceleration=3.0)
    written, notes = export_trajectory(runs["packaging"], "csv", tmp_path, options)
    _, _, v, a = read_csv(written)
    assert np.abs(v).max() <= 1.0
    assert np.abs(a).max() <= 3.0
    assert np.abs(v).max() > 0.99 or np.abs(a).max() > 2.97
    assert any(note.startswith("Slowed down to 0.") for note in notes)


def test_limits_never_speed_up(runs):
    plain, fitted = (
        make_trajectory(
            runs["welding"], TrajectoryOptions(speed=0.3, fit_limits=fit, max_velocity=50.0, max_acceleration=1e4)
        )
        for fit in (False, True)
    )
    assert fitted.timing == plain.timing
    assert any("without slowing down" in note for note in fitted.notes)


def test_an_exported_trajectory_is_a_pure_function_of_the_run(tmp_path, run):
    for kind in ("csv", "ros", "npz"):
        paths = [export_trajectory(run, kind, tmp_path / name)[0] for name in "ab"]
        assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize(
    ("settings", "told"),
    [
        ({"speed": 0.001}, "speed is 0.001"),
        ({"rate": -1.0}, "rate is -1.0 samples/s"),
        ({"cutoff": 0.0}, "cutoff is 0.0 Hz"),
        ({"ramp": -1.0}, "ramp is -1.0 s"),
        ({"fit_limits": True, "max_velocity": 0.0}, "velocity limits are 0.0"),
        ({"fit_limits": True, "max_velocity": 1e-4}, "times the demonstrated speed; allowed: 0.01 or more. Raise"),
    ],
)
def test_a_setting_out_of_range_is_refused_and_leaves_nothing_behind(tmp_path, runs, settings, told):
    with pytest.raises(SettingsError) as caught:
        export_trajectory(runs["packaging"], "csv", tmp_path / "out", TrajectoryOptions(**settings))
    assert told in str(caught.value)
    assert not list(tmp_path.iterdir())


def test_an_unknown_kind_is_answered_with_those_there_are(tmp_path, runs):
    with pytest.raises(SettingsError, match=r"xml.*allowed: csv, ros, ros2-bag, npz"):
        export_trajectory(runs["packaging"], "xml", tmp_path)


def test_a_file_is_replaced_only_when_asked(tmp_path, runs):
    path, _ = export_trajectory(runs["packaging"], "csv", tmp_path)
    before = path.read_bytes()
    with pytest.raises(RunFolderError, match="is there already"):
        export_trajectory(runs["packaging"], "csv", tmp_path, TrajectoryOptions(speed=0.5))
    assert path.read_bytes() == before
    export_trajectory(runs["packaging"], "csv", tmp_path, TrajectoryOptions(speed=0.5), overwrite=True)
    assert path.read_bytes() != before


def test_places_that_cannot_be_are_refused(tmp_path, runs):
    (tmp_path / "file").write_text("")
    (tmp_path / FILES["csv"]).mkdir()
    for place, overwrite in ((tmp_path / "file" / "below", False), (tmp_path / "file", False), (tmp_path, True)):
        with pytest.raises(RunFolderError):
            export_trajectory(runs["packaging"], "csv", place, overwrite=overwrite)
    assert (tmp_path / "file").read_text() == ""


def test_joints_held_inside_their_limits_are_named(runs):
    run = runs["packaging"]
    q = run.evaluation.path.q
    limits = np.degrees([np.minimum(q.min(axis=0) - 1e-5, 0.0), np.maximum(q.max(axis=0) + 1e-5, 0.0)]).T.tolist()
    settings = run.problem.settings.replace({"design": {"joint_limits": limits}})
    narrow = replace(run, problem=replace(run.problem, settings=settings))
    trajectory = make_trajectory(narrow, TrajectoryOptions(rate=1000.0))
    assert trajectory.path.bounded
    (note,) = [note for note in trajectory.notes if note.startswith("The fit was held")]
    assert f"joint_{trajectory.path.bounded[0] + 1}" in note
    assert (trajectory.motion.q >= narrow.limits[:, 0] - 1e-12).all()
    assert (trajectory.motion.q <= narrow.limits[:, 1] + 1e-12).all()
