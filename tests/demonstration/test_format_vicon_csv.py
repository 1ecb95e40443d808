from functools import partial
from pathlib import Path

import numpy as np
import pytest
from takes import read_as, steps, table

from armdesign.demonstration.files import text_files
from armdesign.demonstration.files.formats import vicon_csv
from armdesign.errors import RecordingError

read = partial(read_as, vicon_csv)

SHARED = Path(__file__).resolve().parents[3] / "shared" / "recordings"
NAMES = ("boite:gauche", "Daphnee:EPICl", "Daphnee:STYLr")
VALUES = np.random.default_rng(4).uniform(-900.0, 900.0, (8, 9)).round(4)
VALUES[2:4, 3:6] = np.nan
DEVICES = ["Devices", "1000", ",,Force,,", "Frame,Sub Frame,Fx,Fy,Fz", ",,N,N,N", "1,0,1,2,3", "1,1,4,5,6", ""]
MODEL = ["Model Outputs", "100", ",,D:LElbowAngles,,", "Frame,Sub Frame,X,Y,Z", ",,deg,deg,deg", "1,0,10,20,30", ""]
SEGMENTS = ["Segments", "100", ",,D:Hand,,,,,", "Frame,Sub Frame,RX,RY,RZ,TX,TY,TZ", ",,deg,deg,deg,mm,mm,mm", ""]


def vicon_lines(values=VALUES, numbers=None, rate="100", units="mm"):
    """Lines of a block of trajectories in which all is as it should be."""
    numbers = np.arange(1, len(values) + 1) if numbers is None else numbers
    rows = [["" if np.isnan(value) else f"{value:g}" for value in row] for row in values]
    return [
        "Trajectories",
        rate,
        ",," + ",,,".join(NAMES) + ",,",
        "Frame,Sub Frame" + ",X,Y,Z" * 3,
        "," + f",{units}" * 9,
        *(f"{number},0,{','.join(row)}" for number, row in zip(numbers, rows, strict=True)),
    ]


EXPECTED = np.array([[float(f"{value:g}") for value in row] for row in VALUES])


LINES = vicon_lines()
DECORATED = {
    "commas to the right": [line + "," * 20 for line in LINES],
    "empty lines": ["", LINES[0], "", *LINES[1:], "", ",,,"],
    "tabs": [line.replace(",", "\t") for line in LINES],
    "semicolons and decimal commas": [line.replace(",", ";").replace(".", ",") for line in LINES],
    "quoted": [*LINES[:2], LINES[2].replace("boite:gauche", '"boite:gauche"'), *LINES[3:]],
    "rate with a unit": [LINES[0], "100,Hz", *LINES[2:]],
    "short lines of names": [*LINES[:2], LINES[2].rstrip(","), *LINES[3:]],
    "small letters": [LINES[0].upper(), *LINES[1:3], LINES[3].lower(), *LINES[4:]],
}


@pytest.mark.parametrize("lines", DECORATED.values(), ids=DECORATED.keys())
def test_decoration_changes_nothing(tmp_path, lines):
    take = read(tmp_path, lines)
    assert tuple(take.points) == NAMES
    np.testing.assert_array_equal(table(take), EXPECTED)
    assert (take.units, take.rate, take.steps) == ("mm", 100.0, ())


@pytest.mark.parametrize("above", [[], DEVICES, [*DEVICES, *MODEL], [*SEGMENTS, *MODEL, *DEVICES]])
@pytest.mark.parametrize("below", [[], ["", *MODEL], ["", "", *SEGMENTS, *DEVICES]])
def test_other_blocks_are_left_out_and_told(tmp_path, above, below):
    take = read(tmp_path, [*above, *vicon_lines(), *below])
    assert tuple(take.points) == NAMES
    np.testing.assert_array_equal(table(take), EXPECTED)
    others = [line for line in [*above, *below] if line in ("Devices", "Model Outputs", "Segments")]
    assert bool(others) == ("blocks" in steps(take))
    assert all(title in steps(take)["blocks"] for title in others)


def test_rows_of_commas_are_frames_in_which_nothing_was_seen(tmp_path):
    values = VALUES.copy()
    values[4] = np.nan
    assert np.isnan(table(read(tmp_path, vicon_lines(values)))[4]).all()


def test_units_line_may_be_missing_or_empty(tmp_path):
    lines = vicon_lines()
    assert read(tmp_path, [*lines[:4], *lines[5:]]).units is None
    assert read(tmp_path, [*lines[:4], "," * 10, *lines[5:]]).units is None
    assert len(read(tmp_path, [*lines[:4], "," * 10, *lines[5:]]).time) == 8


def test_markers_without_a_name_and_twice(tmp_path):
    lines = vicon_lines()
    lines[2] = ",,,,,Daphnee:EPICl,,,Daphnee:EPICl,,"
    take = read(tmp_path, lines)
    assert list(take.points) == ["unnamed 1", "Daphnee:EPICl", "Daphnee:EPICl#2"]
    assert "Daphnee:EPICl#2" in steps(take)["names"]


def changed(index, old, new):
    return [*LINES[:index], LINES[index].replace(old, new), *LINES[index + 1 :]]


BAD = {
    "no trajectories": ([*DEVICES, *MODEL], "holds no block 'Trajectories', only Devices, Model Outputs"),
    "no row with Frame": ([*LINES[:3], *LINES[4:]], "no row that begins with 'Frame' stands below 'Trajectories'"),
    "no positions": (changed(3, ",X,Y,Z", ",TX,TY,TZ"), "line 4: there is no column 'X'"),
    "part of a position": (
        changed(3, "X,Y,Z,X,Y,Z,X,Y,Z", "X,Y,Z,X,Z"),
        "line 4, column 6: the columns 'X, Z' are no pos",
    ),
    "two units": (changed(4, ",mm,mm,mm", ",mm,mm,m"), "line 5: the positions have different units, m, mm"),
    "unknown unit": (vicon_lines(units="px"), "line 5: the unit 'px' is none of length; allowed: m, cm, mm, in"),
    "long name": (changed(2, "boite", "b" * 300), "line 3: the name|line 4: the name"),
}


@pytest.mark.parametrize(("lines", "message"), BAD.values(), ids=BAD.keys())
def test_bad_files_are_refused_in_a_sentence(tmp_path, lines, message):
    with pytest.raises(RecordingError, match=message):
        read(tmp_path, lines)


@pytest.mark.parametrize("rate", ["0", "-100", "nan", "x", "1e12"])
def test_a_rate_that_makes_no_sense(tmp_path, rate):
    (tmp_path / "trial.csv").write_text("\n".join(vicon_lines(rate=rate)))
    with pytest.raises(RecordingError, match=r"frame rate that makes sense; allowed: 0\.01 to 100,000"):
        vicon_csv.read(tmp_path / "trial.csv")


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared recordings are not at hand")
def test_real_file():
    take = vicon_csv.read(SHARED / "pyomeca/box_lift_vicon.csv")
    assert (len(take.time), len(take.points), take.rate, take.units, take.steps) == (580, 51, 100.0, "mm", ())


def test_lines_without_end_in_other_blocks_are_refused(tmp_path, monkeypatch):
    monkeypatch.setattr(text_files, "MAX_LINES", 30)
    with pytest.raises(RecordingError, match="holds more than 30 lines"):
        read(tmp_path, [*DEVICES[:5], *(["1,0,1,2,3"] * 40)])
