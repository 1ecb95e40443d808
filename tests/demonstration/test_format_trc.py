from functools import partial
from pathlib import Path

import numpy as np
import pytest
from takes import read_as, refused_as, steps, table

from armdesign.demonstration.files.formats import trc
from armdesign.errors import RecordingError

read = partial(read_as, trc)

SHARED = Path(__file__).resolve().parents[3] / "shared" / "recordings"
NAMES = ("R.Shoulder", "R.Elbow", "R.Wrist")
VALUES = np.random.default_rng(3).uniform(-900.0, 900.0, (8, 9)).round(3)
KEYS = (
    *("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units"),
    *("OrigDataRate", "OrigDataStartFrame", "OrigNumFrames"),
)


def cells(row, hidden=""):
    return [hidden if np.isnan(value) else f"{value:.3f}" for value in row]


def trc_lines(values=VALUES, first=1, times=None, hidden="", **facts):
    """Lines of a file in which all is as it should be."""
    frames = len(values)
    facts = {"DataRate": 100.0, "CameraRate": 100.0, "NumFrames": frames, "NumMarkers": 3, "Units": "mm", **facts}
    times = np.arange(frames) / 100 if times is None else times
    return [
        "PathFileType\t4\t(X/Y/Z)\ttake.trc",
        "\t".join(KEYS),
        "\t".join(str(facts.get(key, 1)) for key in KEYS),
        "Frame#\tTime\t" + "\t\t\t".join(NAMES) + "\t\t",
        "\t\t" + "\t".join(f"{axis}{i}" for i in (1, 2, 3) for axis in "XYZ"),
        "",
        *(f"{first + i}\t{times[i]:.5f}\t" + "\t".join(cells(row, hidden)) for i, row in enumerate(values)),
    ]


def test_markerless_files_of_sports2d(tmp_path):
    names = ("Hip", "RShoulder", "RElbow", "RWrist")
    lines = ["PathFileType\t4\t(X/Y/Z)\tsports2d_m.trc", "\t".join(KEYS), "30.0\t30.0\t4\t4\tm\t30.0\t0\t4"]
    lines += ["Frame#\tTime\t" + "\t\t\t".join(names) + "\t\t"]
    lines += ["\t\t" + "\t".join(f"{axis}{i + 1}" for i in range(4) for axis in "XYZ")]
    lines += [f"{i}\t{i / 30.0}\t" + "\t".join(["0.1", f"1.{i}", ""] * 4) for i in range(2)]
    lines += [f"{i}\t{i / 30.0}\t" + "\t".join(["0.1", f"1.{i}", "0.0"] * 4) for i in range(2, 4)]
    take = read(tmp_path, lines)
    assert (take.units, list(take.points)) == ("m", list(names))
    assert np.isnan(take.points["RWrist"]).any(axis=1).tolist() == [True, True, False, False]
    assert "metres" in refused_as(trc, tmp_path, [line.replace("\tm\t", "\tpx\t") for line in lines])


def variant(index, line):
    lines = trc_lines()
    return [*lines[:index], *line, *lines[index + 1 :]]


ROW = trc_lines()[3]
DECORATED = {
    "commas": [line.replace("\t", ",") for line in trc_lines()],
    "semicolons": [line.replace("\t", ";") for line in trc_lines()],
    "semicolons and decimal commas": [
        *(line.replace("\t", ";") for line in trc_lines()[:6]),
        *(line.replace("\t", ";").replace(".", ",") for line in trc_lines()[6:]),
    ],
    "tabs and decimal commas": [*trc_lines()[:6], *(line.replace(".", ",") for line in trc_lines()[6:])],
    "blanks in line 1": variant(0, ["PathFileType  4\t(X/Y/Z) C:\\take\\"]),
    "double tabs and blanks in line 3": variant(
        2, ["  100.0\t\t  100.0\t\t    8\t\t     3\t\t mm\t  100.0\t      1\t    8"]
    ),
    "tabs to the right everywhere": [line + "\t" * 40 for line in trc_lines()],
    "tabs to the right of the header": [line + "\t" * 12 for line in trc_lines()[:6]] + trc_lines()[6:],
    "padded names": variant(3, [ROW.replace("R.", "  R.").replace("\t\t\t", "  \t\t\t")]),
    "names shifted by a tab": variant(3, [ROW.replace("Time\t", "Time\t\t")]),
    "one tab between names": variant(3, [ROW.replace("\t\t\t", "\t")]),
    "two tabs between names, labels shifted": [
        *trc_lines()[:3],
        ROW.replace("Time\t", "Time\t\t").replace("\t\t\t", "\t\t"),
        "\t" + trc_lines()[4],
        *trc_lines()[5:],
    ],
    "no empty line": [*trc_lines()[:5], *trc_lines()[6:]],
    "line of tabs": [*trc_lines()[:5], "\t" * 11, *trc_lines()[6:]],
    "no line of axes": [*trc_lines()[:4], *trc_lines()[6:]],
    "padded rows": [*trc_lines()[:6], *(line.replace("\t", "  \t   ") for line in trc_lines()[6:])],
    "empty lines below": [*trc_lines(), "", "\t\t\t\t"],
    "empty lines between": [*trc_lines()[:6], *(line for row in trc_lines()[6:] for line in (row, ""))],
}


@pytest.mark.parametrize("text", DECORATED.values(), ids=DECORATED.keys())
def test_decoration_changes_nothing(tmp_path, text):
    take, plain = read(tmp_path, text), read(tmp_path, trc_lines())
    assert list(take.points) == list(plain.points)
    np.testing.assert_allclose(table(take), table(plain), rtol=1e-12)
    np.testing.assert_array_equal(take.time, plain.time)
    assert (take.units, take.rate, take.steps) == (plain.units, plain.rate, ())


@pytest.mark.parametrize("hidden", ["", "NaN", "Nan", "NAN", "nan", "       NaN", "NULL"])
def test_what_was_not_seen(tmp_path, hidden):
    values = VALUES.copy()
    values[2:5, :3], values[0, 6:], values[-1, 3:6] = np.nan, np.nan, np.nan
    np.testing.assert_array_equal(table(read(tmp_path, trc_lines(values, hidden=hidden))), values)


def test_rows_may_stop_early(tmp_path):
    values = VALUES.copy()
    values[3, 6:] = np.nan
    lines = trc_lines(values)
    lines[9] = lines[9].rstrip("\t")
    take = read(tmp_path, lines)
    np.testing.assert_array_equal(table(take), values)
    assert "stop early: 1" in steps(take)["short"]


def test_wrong_counts_are_told_and_nothing_more(tmp_path):
    take = read(tmp_path, trc_lines(NumFrames=652, NumMarkers=51))
    np.testing.assert_array_equal(table(take), VALUES)
    assert "announces 652 frames, the file holds 8" in steps(take)["count"]
    assert "announces 51 markers, the file holds 3" in steps(take)["markers"]


@pytest.mark.parametrize(("word", "units"), [("m", "m"), ("MM", "mm"), ("cm", "cm"), ("meters", "m"), ("", None)])
def test_units(tmp_path, word, units):
    take = read(tmp_path, trc_lines(Units=word))
    assert (take.units, take.rate) == (units, 100.0)


def changed(index, old, new):
    lines = trc_lines()
    lines[index] = lines[index].replace(old, new)
    return lines


BAD = {
    "no row of names": (trc_lines()[:3], "none of the first 20 lines is the row of names, which begins with 'Frame#'"),
    "no names": (variant(3, ["Frame#\tTime\t\t\t"]), "line 4: there are no names"),
    "no time": (changed(3, "Time", "Zeit"), "line 4: 'Zeit' follows 'Frame#', not 'Time'"),
    "two takes": ([*trc_lines(), *trc_lines()[6:]], "line 15: the time does not increase, 0 comes after 0.07"),
    "long name": (changed(3, "R.Wrist", "W" * 201), "line 4: the name 'W+...' has 201 letters"),
    "too many names": (
        variant(3, ["Frame#\tTime\t" + "\t".join(f"m{i}" for i in range(10_000))]),
        "line 4: the table has 30,002 columns",
    ),
}


@pytest.mark.parametrize(("lines", "message"), BAD.values(), ids=BAD.keys())
def test_bad_files_are_refused_in_a_sentence(tmp_path, lines, message):
    with pytest.raises(RecordingError, match=message):
        read(tmp_path, lines)


REAL = {
    "opensim/markers_walk.trc": (238, 41, 100.0, set()),
    "opensim/dataWithNaNsWithSpaces.trc": (427, 42, 100.0, set()),
    "opensim/std_walking2_markers.trc": (126, 44, 25.0, {"rate"}),
    "pyomeca/box_lift_start.trc": (93, 51, 100.0, {"count"}),
}


@pytest.mark.skipif(not SHARED.is_dir(), reason="the shared recordings are not at hand")
@pytest.mark.parametrize("name", REAL)
def test_real_files(name):
    frames, markers, rate, told = REAL[name]
    take = trc.read(SHARED / name)
    assert (len(take.time), len(take.points), take.rate, take.units) == (frames, markers, rate, "mm")
    assert set(steps(take)) == told
    assert np.nanmedian(np.abs(np.diff(take.time) * rate - 1)) < 1e-9
