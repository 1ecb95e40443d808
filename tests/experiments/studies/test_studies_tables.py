"""Tables: numbers survive the way to CSV, text lines up, Markdown has a cell per column."""

import csv
import io

import numpy as np
import pytest

from armdesign.experiments.studies.study_tables import Column, Spread, Table, shown, spread_of

TABLE = Table(
    "some",
    "Some figures",
    ("name", Column("G [mm]", 1), Column("time [s]", 3), "runs"),
    (("PSO", spread_of([1.0, 2.0, 4.0]), 0.12345678901234567, 3), ("a|b", None, float("inf"), "2/3")),
    ("First note.", "Second note."),
)


def test_spread_is_mean_and_standard_deviation_of_the_finite_values():
    values = np.random.default_rng(0).normal(size=20)
    found = spread_of([*values, float("nan"), float("inf")])
    assert found.count == 20
    assert found.mean == pytest.approx(np.mean(values), abs=1e-15)
    assert found.spread == pytest.approx(np.std(values, ddof=1), abs=1e-15)


def test_spread_of_one_is_zero_and_of_none_is_none():
    assert spread_of([3.0]) == Spread(3.0, 0.0, 1)
    assert spread_of([]) is spread_of([float("nan")]) is None


def test_csv_holds_every_digit():
    rows = list(csv.DictReader(io.StringIO(TABLE.csv())))
    assert float(rows[0]["time [s]"]) == 0.12345678901234567
    spread = TABLE.rows[0][1]
    found = [float(rows[0][f"G [mm]{end}"]) for end in ("", " spread", " count")]
    assert found == [spread.mean, spread.spread, spread.count]
    assert rows[1]["G [mm]"] == rows[1]["time [s]"] == ""
    assert rows[1]["name"] == "a|b"


def test_text_lines_up_and_rounds_as_the_column_says():
    lines = TABLE.text().splitlines()
    assert lines[0] == TABLE.title
    assert lines[-2:] == list(TABLE.notes)
    assert "2.3±1.5" in lines[2]
    assert "0.123" in lines[2]
    ends = [line.rstrip().rfind(word) + len(word) for line, word in zip(lines[1:4], ("runs", "3", "2/3"), strict=True)]
    assert len(set(ends)) == 1


def test_markdown_has_a_cell_per_column_in_every_row():
    rows = [line.replace("\\|", "/") for line in TABLE.markdown().splitlines() if line.startswith("|")]
    assert {row.count("|") for row in rows} == {len(TABLE.columns) + 1}
    assert "2.3 ± 1.5" in TABLE.markdown()


def test_a_single_value_is_shown_without_a_spread():
    assert shown(Spread(1.0, 0.0, 1), 2) == "1.00"
    assert shown(Spread(1.0, 0.5, 2), 2) == "1.00±0.50"
