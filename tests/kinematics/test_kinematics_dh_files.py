"""Designs out of files: JSON, TOML and CSV, modified and classic, in radians and degrees."""

import json

import numpy as np
import pytest

from armdesign.errors import DesignError
from armdesign.kinematics.dh import ClassicDH, DHTable
from armdesign.kinematics.dh_files import read_design

ROWS = [[0.1, 0.0, 0.2, 0.3], [1 / 3, 0.25, -0.1, 0.0], [-1.5, 0.3, 0.0, -0.7], [0.5, 0.0, 0.1, 0.0]]
NAMES = ("alpha", "a", "d", "theta")


def entries(rows, names=NAMES):
    return [dict(zip(names, row, strict=True)) for row in rows]


def csv_text(rows, header="alpha,a,d,theta"):
    return "\n".join([header, *(",".join(map(repr, row)) for row in rows)]) + "\n"


def toml_text(rows, head=""):
    tables = ("\n".join(f"{name} = {value!r}" for name, value in row.items()) for row in entries(rows))
    return head + "".join(f"[[rows]]\n{table}\n" for table in tables)


FORMS = {
    "objects.json": json.dumps({"rows": entries(ROWS)}),
    "lists.json": json.dumps({"convention": "modified", "rows": ROWS}),
    "result.json": json.dumps({"dof": 3, "dh": {"convention": "modified", "base_yaw": 0.0, "rows": entries(ROWS)}}),
    "without_ending": json.dumps({"rows": ROWS}),
    "marked.json": "\ufeff" + json.dumps({"rows": ROWS}),
    "lists.toml": f"# an arm\nrows = {ROWS!r}\n",
    "tables.toml": toml_text(ROWS, "convention = 'modified'\n"),
    "table.csv": csv_text(ROWS),
    "spaced.csv": "# an arm\n\n" + csv_text(ROWS).replace(",", " , ") + "\n",
    "labelled.csv": "row,alpha,a,d,theta\n"
    + "".join(f"{i},{','.join(map(repr, row))}\n" for i, row in enumerate(ROWS)),
    "moved.csv": csv_text([row[::-1] for row in ROWS], "theta,d,a,alpha"),
    "marked.csv": "\ufeff" + csv_text(ROWS).replace("\n", "\r\n"),
}


@pytest.fixture
def saved(tmp_path):
    def save(content, name="design.json"):
        path = tmp_path / name
        path.write_text(content, encoding="utf-8", newline="")
        return path

    return save


@pytest.mark.parametrize("name", FORMS)
def test_every_form_gives_the_same_table_to_the_last_bit(saved, name):
    table = read_design(saved(FORMS[name], name))
    expected = DHTable.from_rows(ROWS)
    for column in NAMES:
        np.testing.assert_array_equal(getattr(table, column), getattr(expected, column))
    assert table.base_yaw == 0.0


def test_path_may_be_text_or_a_run_folder(saved, tmp_path):
    saved(FORMS["result.json"], "result.json")
    assert read_design(tmp_path).dof == read_design(str(tmp_path / "result.json")).dof == 3


def test_degrees_and_base_yaw(saved):
    rows = [{"alpha_deg": 90, "a": 0, "d": 0.1, "theta_deg": -45}, {"alpha_deg": -30.0, "a": 0.2, "d": 0.3}]
    table = read_design(saved(json.dumps({"base_yaw": 0.25, "rows": rows})))
    np.testing.assert_allclose(table.alpha, [np.pi / 2, -np.pi / 6], rtol=1e-15)
    np.testing.assert_allclose(table.theta, [-np.pi / 4, 0.0], rtol=1e-15)
    assert table.base_yaw == 0.25
    text = "alpha_deg,a,d\n90,0,0.1\n-30,0.2,0.3\n"
    np.testing.assert_array_equal(read_design(saved(text, "deg.csv")).alpha, table.alpha)


@pytest.mark.parametrize("form", ["stated", "asked"])
def test_classic_table_is_the_classic_arm(saved, form):
    content = {"rows": ROWS} | ({"convention": "classic"} if form == "stated" else {})
    table = read_design(saved(json.dumps(content)), None if form == "stated" else "classic")
    q = np.array([0.3, -1.0, 2.0, 0.7])
    classic = ClassicDH(np.array(ROWS), np.eye(4), np.eye(4)).pose(q)
    assert table.dof == 4
    np.testing.assert_allclose(table.frames(q)[-1], classic, rtol=0, atol=1e-14)


def test_convention_asked_for_must_be_the_one_stated(saved):
    path = saved(json.dumps({"convention": "modified", "rows": ROWS}))
    assert read_design(path, "modified").dof == 3
    with pytest.raises(DesignError, match=r"modified.*classic"):
        read_design(path, "classic")


REFUSED = {
    "cut.json": ('{"rows": [[0, 0', "not valid JSON: line 1, column 16"),
    "cut.toml": ("rows = [[0, 0", "not valid TOML"),
    "list.json": ("[[0, 0, 0]]", "holds no DH table: 'rows' is missing or empty"),
    "number.json": ("3", "holds no DH table"),
    "empty.json": ('{"rows": []}', "holds no DH table"),
    "object.json": ('{"rows": {"alpha": 1}}', "holds no DH table"),
    "convention.json": ('{"convention": 3, "rows": [[0, 0, 0]]}', "convention is 3; allowed: modified, classic"),
    "short.json": ('{"rows": [[0, 0, 1], [0, 1]]}', r"rows\[1\] is \[0, 1\]; allowed: rows like"),
    "long.json": ('{"rows": [[0, 0, 1, 2, 3]]}', r"rows\[0\] is \[0, 0, 1, 2, 3\]"),
    "null.json": ('{"rows": [[null, 0, 1]]}', r"rows\[0\].alpha is None; allowed: a finite number"),
    "true.json": ('{"rows": [[true, 0, 1]]}', r"rows\[0\].alpha is True"),
    "infinite.json": ('{"rows": [[0, Infinity, 1]]}', r"rows\[0\].a is inf; allowed: a finite number"),
    "huge.json": (f'{{"rows": [[{10**400}, 0, 0]]}}', r"rows\[0\].alpha is 1000"),
    "endless.json": (f'{{"rows": [[{"1" * 5000}, 0, 0]]}}', "endless.json"),
    "deep.json": ("[" * 100_000, "deep.json"),
    "unknown.json": (
        '{"rows": [{"alpha": 0, "a": 0, "d": 0, "r": 0}]}',
        r"unknown entry 'r'; allowed: alpha, a, d, theta",
    ),
    "missing.json": ('{"rows": [{"alpha": 0, "d": 0}]}', r"rows\[0\] has no 'a'"),
    "yaw.json": ('{"base_yaw": null, "rows": [[0, 0, 0], [0, 0, 1]]}', "base_yaw is None"),
    "turned.json": ('{"convention": "classic", "base_yaw": 1, "rows": [[0, 0, 1]]}', "a classic table has no base_yaw"),
    "toolless.json": ('{"rows": [[0, 0, 1]]}', "needs a row per joint and a tool row, this has 1"),
    "header.csv": ("alpha,length,d\n0,1,2\n", "the header is 'alpha, length, d'; allowed: alpha,a,d"),
    "column.csv": ("alpha,a,d,thta\n0,1,2,3\n0,1,2,3\n", "unknown column 'thta'"),
    "decimals.csv": ("alpha,a,d\n0,5,0,1,0,2\n", r"rows\[0\] has more cells than the header"),
    "word.csv": ("alpha,a,d\n0,x,2\n", r"rows\[0\].a is 'x'; allowed: a finite number"),
    "none.csv": ("", "the header is ''"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_no_table_is_refused_by_place(saved, name):
    content, message = REFUSED[name]
    with pytest.raises(DesignError, match=message) as raised:
        read_design(saved(content, name))
    assert name in str(raised.value)


def test_files_that_are_none(tmp_path):
    for path in (tmp_path / "absent.json", tmp_path, tmp_path / ("x" * 300)):
        with pytest.raises(DesignError, match="cannot read the design"):
            read_design(path)
    (tmp_path / "binary").write_bytes(bytes(range(256)))
    with pytest.raises(DesignError, match="is not text; allowed: JSON, TOML or CSV"):
        read_design(tmp_path / "binary")
