"""DH tables as files: read back to the last bit, modified and classic, and the classic rows are that arm."""

from __future__ import annotations

import numpy as np
import pytest

from armdesign.errors import DesignError, SettingsError
from armdesign.export.dh_text import dh_csv, dh_rows, dh_toml
from armdesign.kinematics.dh import DHTable, rot_x, rot_z, translation
from armdesign.kinematics.dh_files import read_design

WRITERS = {"dh.csv": dh_csv, "dh.toml": dh_toml}
COLUMNS = ("alpha", "a", "d", "theta")


def random_table(n, seed):
    """Zeros, right angles, negative lengths; of every second seed offsets, a base yaw and joints that slide."""
    rng = np.random.default_rng([n, seed])
    alpha = rng.choice([0.0, np.pi / 2, -np.pi / 2, rng.uniform(-np.pi, np.pi)], n + 1)
    a, d = rng.uniform(-0.4, 0.5, (2, n + 1)) * (rng.random((2, n + 1)) > 0.35)
    theta, yaw = rng.uniform(-3, 3, n + 1) * (seed % 2), rng.uniform(-3, 3) * (seed % 2)
    return DHTable(alpha, a, d, theta, yaw, "".join(rng.choice(["R", "P"], n)) if seed % 2 else "")


@pytest.mark.parametrize("convention", ["modified", "classic"])
@pytest.mark.parametrize("name", WRITERS)
@pytest.mark.parametrize("n", range(1, 9))
def test_a_table_is_read_back_to_the_last_bit(n, name, convention, tmp_path):
    for seed in (0, 1):
        table, path = random_table(n, seed), tmp_path / name
        path.write_text(WRITERS[name](table, convention))
        found = read_design(path)
        for column in COLUMNS:
            np.testing.assert_array_equal(getattr(found, column), getattr(table, column))
        assert found.base_yaw == table.base_yaw
        assert found.joints == table.joints


@pytest.mark.parametrize("n", range(1, 9))
def test_the_classic_rows_multiply_to_the_arm(n):
    table, q = random_table(n, 1), np.random.default_rng(n).uniform(-3, 3, n)
    pose = np.eye(4)
    rows = zip(dh_rows(table, "classic"), [0.0, *q, 0.0], f"R{table.joints}R", strict=True)
    for (_, (alpha, a, d, theta)), motion, kind in rows:
        turn, way = (0.0, motion) if kind == "P" else (motion, 0.0)
        pose = pose @ rot_z(theta + turn) @ translation(0, 0, d + way) @ translation(a, 0, 0) @ rot_x(alpha)
    np.testing.assert_allclose(pose, table.frames(q)[-1], atol=1e-13)
    np.testing.assert_allclose(table.to_classic().pose(q), pose, atol=1e-13)


@pytest.mark.parametrize("convention", ["modified", "classic"])
@pytest.mark.parametrize("name", WRITERS)
def test_a_file_that_says_what_it_is_is_not_read_as_the_other(name, convention, tmp_path):
    path = tmp_path / name
    path.write_text(WRITERS[name](random_table(3, 1), convention))
    other = "classic" if convention == "modified" else "modified"
    with pytest.raises(DesignError, match=f"says that it is {convention}"):
        read_design(path, other)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("# convention: classic\nrow,alpha,a,d\nbase,0,0,0.1\n1,0,0,0.2\n", r"base\.d is 0\.1; allowed: 0"),
        ("# convention: classic\nrow,alpha,a,d\n1,0,0,0.2\ntool,0.5,0,0.2\n", r"tool\.alpha is 0\.5; allowed: 0"),
        ("# convention: classic\nrow,alpha,a,d\nbase,0,0,0\ntool,0,0,0.2\n", "needs a row per joint"),
        ("# convention: clasic\nrow,alpha,a,d\n1,0,0,0.2\n", "convention is 'clasic'; allowed: modified, classic"),
        ("# base_yaw: east\nrow,alpha,a,d\n1,0,0,0.2\n2,0,0,0.2\n", "base_yaw is 'east'"),
    ],
)
def test_rows_without_a_place_are_refused(text, words, tmp_path):
    path = tmp_path / "dh.csv"
    path.write_text(text)
    with pytest.raises(DesignError, match=words):
        read_design(path)


@pytest.mark.parametrize("write", [dh_csv, dh_toml, dh_rows])
def test_there_are_two_conventions(write):
    with pytest.raises(SettingsError, match="allowed: modified, classic"):
        write(random_table(2, 0), "craig")
