from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from takes import read_as, steps, table

from armdesign.demonstration.files.formats import qualisys_tsv
from armdesign.demonstration.files.quaternions import rotation_matrices
from armdesign.errors import RecordingError

read = partial(read_as, qualisys_tsv)

NAMES = ("shoulder", "elbow_r", "hand")
FRAMES = 8
_rng = np.random.default_rng(5)
VALUES = _rng.uniform(-900.0, 900.0, (FRAMES, 9)).round(3)
TURNS = Rotation.from_rotvec(_rng.normal(size=(3 * FRAMES, 3)))
POSE = ["X", "Y", "Z", "Roll", "Pitch", "Yaw", "Residual", *(f"Rot[{i}]" for i in range(9))]


def head(names, kind="3D", **facts):
    """Header lines as Qualisys Track Manager writes them."""
    bodies = kind == "6D"
    facts = {"NO_OF_FRAMES": FRAMES, "NO_OF_BODIES" if bodies else "NO_OF_MARKERS": len(names), **facts}
    return [
        f"NO_OF_FRAMES\t{facts.pop('NO_OF_FRAMES')}",
        "NO_OF_CAMERAS\t4",
        *(f"{key}\t{value}" for key, value in facts.items() if key.startswith("NO_OF")),
        f"FREQUENCY\t{facts.get('FREQUENCY', 100)}",
        "NO_OF_ANALOG\t0",
        "ANALOG_FREQUENCY\t0",
        "DESCRIPTION\t--",
        "TIME_STAMP\t2020-01-22, 17:47:17\t22107.99179716",
        f"DATA_INCLUDED\t{kind}",
        ("BODY_NAMES\t" if bodies else "MARKER_NAMES\t") + "\t".join(names),
        *([] if bodies else ["TRAJECTORY_TYPES\t" + "\t".join(["Measured"] * len(names))]),
    ]


def rows(values, hidden="nan", leading=True, numbers=None, digits=3):
    numbers = range(1, len(values) + 1) if numbers is None else numbers
    cells = [[hidden if np.isnan(value) else f"{value:.{digits}f}" for value in row] for row in values]
    front = [[str(number), f"{(number - 1) / 100:.5f}"] if leading else [] for number in numbers]
    return ["\t".join([*start, *row]) for start, row in zip(front, cells, strict=True)]


LABELS = "Frame\tTime\t" + "\t".join(f"{name} {axis}" for name in NAMES for axis in "XYZ")


def markers(values=VALUES, hidden="nan", **facts):
    return [*head(NAMES, **facts), LABELS, *rows(values, hidden)]


def poses(hidden=()):
    """Values of two bodies, frames that are hidden without a value, and their matrices."""
    matrices = TURNS.as_matrix().reshape(-1, FRAMES, 3, 3)[:2]
    angles = TURNS.as_euler("XYZ", degrees=True).reshape(-1, FRAMES, 3)[:2]
    residual = np.full((2, FRAMES, 1), 0.3)
    columns = matrices.transpose(0, 1, 3, 2).reshape(2, FRAMES, 9)  # one column of the matrix after the other
    table = np.concatenate([VALUES[:, :6].reshape(FRAMES, 2, 3).transpose(1, 0, 2), angles, residual, columns], axis=2)
    table[:, list(hidden)] = np.nan
    return table.transpose(1, 0, 2).reshape(FRAMES, 32), matrices


def bodies(values, hidden="nan", names=("arm", "hand")):
    labels = ["Frame", "Time", *(f"{name} X" if part == "X" else part for name in names for part in POSE)]
    lines = [*head(names, "6D"), "\t".join(labels) + "\t", *(row + "\t" for row in rows(values, hidden, digits=5))]
    return lines


WITHOUT_LABELS = [*head(NAMES), *rows(VALUES)]
DECORATED = {
    "tabs to the right": [line + "\t" for line in markers()],
    "blanks to the right": [f"{line} " for line in markers()],
    "file version": ["FILE_VERSION\t2.0.0", *markers()],
    "events": [*markers()[:8], "EVENT\tstart\t3\t0.02", "EVENT\tend\t7\t0.06", *markers()[8:]],
    "no column names": WITHOUT_LABELS,
    "no Frame and Time": [*head(NAMES), LABELS[11:], *rows(VALUES, leading=False)],
    "nothing but numbers": [*head(NAMES), *rows(VALUES, leading=False)],
    "no Time": [
        *head(NAMES),
        LABELS.replace("Time\t", ""),
        *(f"{i + 1}\t{r}" for i, r in enumerate(rows(VALUES, leading=False))),
    ],
    "no MARKER_NAMES": [line for line in markers() if not line.startswith("MARKER_NAMES")],
    "decimal commas": [*markers()[:12], *(line.replace(".", ",") for line in markers()[12:])],
}


@pytest.mark.parametrize("lines", DECORATED.values(), ids=DECORATED.keys())
def test_decoration_changes_nothing(tmp_path, lines):
    take = read(tmp_path, lines)
    assert tuple(take.points) == NAMES
    np.testing.assert_array_equal(table(take), VALUES)
    np.testing.assert_allclose(take.time, np.arange(FRAMES) / 100)
    assert take.steps == ()


@pytest.mark.parametrize("hidden", ["nan", "NaN", "", "NULL", "null", "0.000", "  "])
@pytest.mark.parametrize("leading", [True, False])
def test_what_was_not_seen(tmp_path, hidden, leading):
    values = VALUES.copy()
    values[2:5, 3:6], values[0, 6:], values[3] = np.nan, np.nan, np.nan
    lines = [*head(NAMES), LABELS if leading else LABELS[11:], *rows(values, hidden, leading)]
    take = read(tmp_path, lines)
    np.testing.assert_array_equal(table(take), values)
    assert ("zeros" in steps(take)) == (hidden == "0.000")


def test_a_coordinate_of_zero_is_seen(tmp_path):
    values = VALUES.copy()
    values[:, 0], values[2, 3:5] = 0.0, 0.0
    np.testing.assert_array_equal(table(read(tmp_path, markers(values))), values)


@pytest.mark.parametrize("hidden", ["nan", "", "0.00000"])
def test_bodies_turn_by_their_matrix_column_by_column(tmp_path, hidden):
    values, matrices = poses(hidden=(2, 5))
    take = read(tmp_path, bodies(values, hidden))
    assert (list(take.points), list(take.orientations)) == (["arm", "hand"], ["arm", "hand"])
    assert take.format == "Qualisys TSV 6D"
    seen = [i for i in range(FRAMES) if i not in (2, 5)]
    for body, expected in zip(("arm", "hand"), matrices, strict=True):
        turns = take.orientations[body]
        np.testing.assert_allclose(rotation_matrices(turns[seen]), expected[seen], atol=2e-5)
        assert np.isnan(turns[[2, 5]]).all()
        assert np.isnan(take.points[body][[2, 5]]).all()
    np.testing.assert_array_equal(take.points["hand"][seen], VALUES[seen, 3:6])


def test_angles_of_the_standard_definition_agree_with_the_matrix(tmp_path):
    row = (
        "1 0.0 1 2 3 -0.65630 0.09391 0.05772 0.1 1 0.00101 -0.00164 -0.00099 0.99993 -0.01145 0.00165 0.01145 0.99993"
    )
    labels = "\t".join(["Frame", "Time", "arm X", *POSE[1:]])
    lines = [*head(["arm"], "6D", NO_OF_FRAMES=1), labels, row.replace(" ", "\t")]
    angles = Rotation.from_quat(read(tmp_path, lines).orientations["arm"][0]).as_euler("xyz", degrees=True)
    np.testing.assert_allclose(angles, [-0.6563, 0.09391, 0.05772], atol=1e-3)


def test_what_is_no_rotation_matrix_is_refused(tmp_path):
    for bad in (lambda m: 1.1 * m, lambda m: -m, lambda m: np.where(m == m.max(), 1e200, m)):
        values, matrices = poses()
        values[3, 16 + 7 :] = bad(matrices[1, 3].T.ravel())
        with pytest.raises(RecordingError, match=r"line 15, body 'hand': Rot\[0\] to Rot\[8\] are no rotation matrix"):
            read(tmp_path, bodies(values))


def without(lines, *keys):
    return [line for line in lines if not line.startswith(keys)]


BAD = {
    "2D": (markers(), ("3D", "2D"), "holds '2D' data; allowed: 3D, 6D"),
    "no names at all": (
        without(WITHOUT_LABELS, "MARKER_NAMES"),
        ("", ""),
        "line 11: the header names no marker or body",
    ),
    "one column too many": (
        [*head(NAMES), *(f"7\t{row}" for row in rows(VALUES, leading=False))],
        ("", ""),
        "line 12: there is one column more than the 9 of the names",
    ),
    "other columns": (markers(), ("elbow_r Y", "elbow_r speed"), "line 12: the columns 'shoulder X, .* none of this"),
    "columns missing": (markers(), ("\thand Z", ""), "line 12: the columns .* allowed: for each name X, Y, Z"),
    "Frame twice": (markers(), ("Time\t", "Frame\t"), "line 12: the column 'frame' stands twice"),
}


@pytest.mark.parametrize(("lines", "change", "message"), BAD.values(), ids=BAD.keys())
def test_bad_files_are_refused_in_a_sentence(tmp_path, lines, change, message):
    lines = [line.replace(*change) if change[0] else line for line in lines]
    with pytest.raises(RecordingError, match=message):
        read(tmp_path, lines)
