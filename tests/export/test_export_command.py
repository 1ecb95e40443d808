"""The export command: what it writes where, what comes out of it again, and what it refuses in one sentence."""

from __future__ import annotations

import json
import re
import shutil
from dataclasses import fields

import numpy as np
import pytest

from armdesign.building.build_files import BUILD_FORMATS
from armdesign.export.formats import FORMATS, robot_files
from armdesign.export.options import LimitOptions, SimulationOptions, TagOptions
from armdesign.export.robot_file import finished_robot
from armdesign.kinematics.dh_files import read_design
from armdesign.settings import Body

ALL = ",".join(FORMATS)


@pytest.fixture
def folder(finished, tmp_path):
    """A copy of a run folder."""
    return shutil.copytree(finished["packaging"].folder, tmp_path / "run")


@pytest.fixture
def refused(invoke):
    """A command that ends with exit code 2 and one sentence; gives the sentence."""

    def call(*args):
        outcome = invoke(*args)
        assert outcome.exit_code == 2, outcome.output
        assert "Traceback" not in outcome.output
        sentence = outcome.output.splitlines()[-1]
        assert sentence.startswith("armdesign: ")
        return sentence

    return call


def test_the_default_is_the_urdf_of_the_run(invoke, folder):
    outcome = invoke("export", folder)
    assert outcome.exit_code == 0, outcome.output
    assert [path.name for path in (folder / "export").iterdir()] == ["arm.urdf"]
    assert (folder / "export" / "arm.urdf").read_bytes() == (folder / "arm.urdf").read_bytes()


def test_every_kind_is_written_as_its_function_says(invoke, finished, folder, tmp_path):
    out = tmp_path / "deep" / "out"
    outcome = invoke("export", folder, "--format", ALL, "--out", out)
    assert outcome.exit_code == 0, outcome.output
    run = finished["packaging"].run
    robot = finished_robot(run)
    expected = {name: text for kind in FORMATS for name, text in robot_files(robot, kind).items()}
    assert {path.name: path.read_text() for path in out.iterdir()} == expected
    for name in expected:
        assert str(out / name) in outcome.output


@pytest.mark.parametrize("kind", ["dh-csv", "dh-toml"])
@pytest.mark.parametrize("convention", ["modified", "classic"])
def test_a_dh_file_scores_as_the_run_did(invoke, folder, tmp_path, kind, convention):
    assert invoke("export", folder, "--format", kind, "--convention", convention, "--out", tmp_path).exit_code == 0
    written = tmp_path / FORMATS[kind][0]
    for column in ("alpha", "a", "d", "theta"):
        np.testing.assert_array_equal(getattr(read_design(written), column), getattr(read_design(folder), column))
    outcome = invoke("evaluate", written, folder / "task.csv", "--base", "origin", "--out", tmp_path / "again")
    assert outcome.exit_code == 0, outcome.output
    scores = [json.loads((place / "result.json").read_text())["fitness"] for place in (folder, tmp_path / "again")]
    assert scores[0] == pytest.approx(scores[1], rel=1e-9)


def test_options_reach_the_files(invoke, folder, tmp_path):
    outcome = invoke(
        "export", folder, "--format", "urdf,mjcf", "--out", tmp_path, "--name", "Ärmchen 7", "--world",
        "--ros2-control", "gazebo", "--transmissions", "--payload", "1", "--joint-mass", "2", "--kp", "55",
        "--base-side", "left", "--narrow-limits", "5",
    )  # fmt: skip
    assert outcome.exit_code == 0, outcome.output
    urdf, mjcf = (tmp_path / "arm.urdf").read_text(), (tmp_path / "arm.xml").read_text()
    for words in ('name="Armchen_7"', '<link name="world">', "GazeboSimSystem", "<transmission"):
        assert words in urdf
    assert 'kp="55.0"' in mjcf
    assert "to the left of the base" in outcome.output
    assert 'upper="3.141592653589793"' not in re.findall(r"<limit [^>]*>", urdf)[0]


def test_robot_files_and_trajectories_go_together(invoke, folder, tmp_path):
    out = tmp_path / "out"
    outcome = invoke("export", folder, "--format", "urdf", "--trajectory", "csv,npz", "--rate", "100", "--out", out)
    assert outcome.exit_code == 0, outcome.output
    assert sorted(path.name for path in out.iterdir()) == ["arm.urdf", "joint_trajectory.csv", "joint_trajectory.npz"]
    assert "Smoothed" in outcome.output
    assert outcome.output.count("Smoothed") == 1


def test_a_trajectory_alone_writes_no_robot(invoke, folder):
    assert invoke("export", folder, "--trajectory", "csv", "--speed", "0.5").exit_code == 0
    assert [path.name for path in (folder / "export").iterdir()] == ["joint_trajectory.csv"]


def test_files_are_replaced_only_when_asked(invoke, refused, folder):
    assert invoke("export", folder, "--format", "urdf").exit_code == 0
    path = folder / "export" / "arm.urdf"
    path.write_text("mine")
    assert "is there already" in refused("export", folder, "--format", "sdf,urdf")
    assert [item.name for item in (folder / "export").iterdir()] == ["arm.urdf"]
    assert path.read_text() == "mine"
    assert invoke("export", folder, "--format", "urdf", "--overwrite").exit_code == 0
    assert path.read_text() != "mine"


def test_unknown_kinds_are_refused_with_the_list(refused, folder):
    assert refused("export", folder, "--format", "urdf,obj").endswith(
        f"--format is 'obj'; allowed: {', '.join((*FORMATS, *BUILD_FORMATS))}"
    )
    assert "--format is ''" in refused("export", folder, "--format", "")
    assert "csv, ros, ros2-bag, npz" in refused("export", folder, "--trajectory", "rosbag")
    assert "allowed: modified, classic" in refused("export", folder, "--format", "dh-csv", "--convention", "craig")
    assert not (folder / "export").exists()


@pytest.mark.parametrize(
    ("flags", "words"),
    [
        (("--tube-wall", "0.5"), "tube_wall"),
        (("--joint-mass", "0"), "joint_mass"),
        (("--margin", "0.9"), "margin"),
        (("--payload", "-1"), "payload"),
        (("--narrow-limits", "0"), "narrow_limits"),
        (("--base-side", "top"), "below, above"),
        (("--ros2-control", "${x}"), "ros2_control"),
        (("--kp", "nan"), "kp"),
    ],
)
def test_options_out_of_range_are_refused(refused, folder, flags, words):
    assert words in refused("export", folder, *flags)
    assert not (folder / "export").exists()


def test_a_folder_without_a_result_is_refused(refused, folder, tmp_path):
    (tmp_path / "empty").mkdir()
    assert "result.json is missing" in refused("export", tmp_path / "empty")
    assert "there is no run folder" in refused("export", tmp_path / "nothing")
    assert "there is no run folder" in refused("export", folder / "arm.urdf")
    for text in ("{", "[]", '{"dh": 3}', ""):
        (folder / "result.json").write_text(text)
        assert "result.json" in refused("export", folder)
    assert not (folder / "export").exists()


def test_a_broken_trajectory_is_refused(refused, folder):
    (folder / "trajectory.csv").write_text("time,joint_1\n0,x\n")
    assert "trajectory.csv is missing or damaged" in refused("export", folder)


def test_an_output_that_cannot_be_is_refused(refused, folder, tmp_path):
    taken = tmp_path / "taken"
    taken.write_text("mine")
    for out in (taken, taken / "below"):
        assert "taken is a file" in refused("export", folder, "--out", out)
    (tmp_path / "out" / "arm.urdf").mkdir(parents=True)
    assert "arm.urdf is a folder" in refused("export", folder, "--out", tmp_path / "out", "--overwrite")
    assert taken.read_text() == "mine"


def test_help_documents_every_option(invoke):
    outcome = invoke("export", "--help")
    assert outcome.exit_code == 0
    text = " ".join(outcome.output.split())
    for section in (Body, LimitOptions, SimulationOptions, TagOptions):
        for entry in (
            each
            for each in fields(section)
            if each.name not in ("kind", "module_slide", "modules", "inertials", "post")
        ):
            assert f"--{entry.name.replace('_', '-')}" in text
    for name in (*FORMATS, "ros2-bag", "--overwrite", "--convention", "--rate", "--speed"):
        assert name in text
    assert "(default 2700.0)" in text
