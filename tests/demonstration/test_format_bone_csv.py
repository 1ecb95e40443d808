from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration import Hints, read_take
from armdesign.demonstration.files.formats import bone_csv
from armdesign.errors import RecordingError, SettingsError

FOLDER = Path(__file__).resolve().parents[3] / "shared" / "recordings" / "kth_handover"
HEADER = "x,y,z,q0,q1,q2,q3"


def written(tmp_path, text):
    path = tmp_path / "RHand.csv"
    path.write_bytes(text.encode())
    return path


def rows(count=5, seed=0):
    table = np.random.default_rng(seed).normal(size=(count, 7))
    return table, "".join(",".join(map(repr, row)) + "\n" for row in table.tolist())


def at(path, rate=120.0):
    return read_take(path, Hints(rate=rate))


def test_a_bone_has_its_files_name_and_the_rate_given(tmp_path):
    table, text = rows()
    take = at(written(tmp_path, f"{HEADER}\n{text}"))
    np.testing.assert_array_equal(take.time, np.arange(5) / 120.0)
    np.testing.assert_array_equal(take.points["RHand"], table[:, :3])
    np.testing.assert_array_equal(take.orientations["RHand"], table[:, 3:])
    assert (take.rate, take.units, take.up, take.captured) == (120.0, None, None, True)
    assert "x, y, z, w" in {step.name: step.sentence for step in take.steps}["quaternions"]
    scalar_first = read_take(tmp_path / "RHand.csv", Hints(rate=120.0, quaternions="wxyz"))
    np.testing.assert_array_equal(scalar_first.orientations["RHand"], table[:, [4, 5, 6, 3]])


def test_columns_in_another_order_other_names_and_times(tmp_path):
    table, _ = rows()
    lines = [f"{k / 50},{r[6]},{r[3]},{r[4]},{r[5]},{r[2]},{r[1]},{r[0]}" for k, r in enumerate(table.tolist())]
    path = written(tmp_path, "\ufeffTime, QW, qx,qy,qz,z,y,x\r\n" + "\r\n".join(lines))
    assert bone_csv.matches(path.read_bytes())
    take = bone_csv.read(path)
    np.testing.assert_array_equal(take.time, np.arange(5) / 50)
    np.testing.assert_array_equal(take.points["RHand"], table[:, :3])
    np.testing.assert_array_equal(take.orientations["RHand"], table[:, 3:])
    assert take.steps == ()


def test_empty_cells_are_not_seen(tmp_path):
    path = written(tmp_path, f"{HEADER}\n1,2,3,0,0,0,1\n,,,,,,\n1,,3,0,NaN,null,1\n1,2,3,0,0,0,1\n")
    take = at(path)
    assert np.isnan(take.points["RHand"]).any(axis=1).tolist() == [False, True, True, False]


def test_a_file_without_times_needs_a_rate(tmp_path):
    path = written(tmp_path, f"{HEADER}\n{rows()[1]}")
    with pytest.raises(RecordingError, match=r"RHand\.csv \(bone CSV\) holds no times.* --rate"):
        read_take(path)
    for rate in (0.0, -1.0, float("nan"), float("inf"), 1e9):
        with pytest.raises(SettingsError, match="frame rate"):
            at(path, rate)


def test_times_of_its_own_count_before_a_rate(tmp_path):
    path = written(tmp_path, f"time,{HEADER}\n0,1,2,3,0,0,0,1\n1,1,2,3,0,0,0,1\n")
    np.testing.assert_array_equal(at(path).time, [0.0, 1.0])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (f"{HEADER}\n1,2,3,0,0,0\n1,2,3,0,0,0,1\n", "line 2: too few cells, 6"),
        ("x,y,z\n1,2,3\n", "no header of a bone's file"),
        (f"{HEADER},x\n", "no header of a bone's file"),
    ],
)
def test_what_is_wrong_is_named(tmp_path, text, message):
    with pytest.raises(RecordingError) as caught:
        bone_csv.read(written(tmp_path, text))
    assert message in str(caught.value)
    assert "RHand.csv" in str(caught.value)


@pytest.mark.skipif(not FOLDER.exists(), reason="the shared recordings are not at hand")
def test_real_bones_hang_together():
    takes = [at(FOLDER / f"giver_{bone}_pose_saved.csv") for bone in ("RUArm", "RFArm")]
    upper, fore = (next(iter(take.points.values())) for take in takes)
    lengths = np.linalg.norm(fore - upper, axis=1)
    assert lengths.mean() == pytest.approx(0.252, abs=0.001)
    assert list(takes[0].points) == ["giver_RUArm_pose_saved"]
