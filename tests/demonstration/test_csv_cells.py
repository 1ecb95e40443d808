import io
from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration.files import text_files
from armdesign.demonstration.files.csv_cells import BLOCK, MISSING, Dialect, read_cells, read_rows
from armdesign.demonstration.files.text_files import Place, read_line, shown
from armdesign.errors import RecordingError

FIRST = Place(Path("file"), 5)
NAMES = ["a", "b", "c"]
LOOSE = Dialect("\t", MISSING, ragged=True, may_be_cut=True)


def rows(text, dialect=LOOSE, names=NAMES, block=1 << 20):
    return read_rows(io.StringIO(text), names, FIRST, dialect, block)


def awkward_table(rng, count, delimiter):
    """Text and numbers of a table with gaps in all spellings, padding, exponents and empty lines."""
    values, lines, numbers = [], [], []
    while len(values) < count:
        if rng.random() < 0.2:
            lines.append("  " if rng.random() < 0.5 else delimiter * 2)
        else:
            value = rng.normal(size=3) * 10.0 ** rng.integers(-5, 6)
            cells = [repr(float(v)) if rng.random() < 0.5 else f"{v:.17E}" for v in value]
            for i in range(3):
                if rng.random() < 0.2:
                    value[i], cells[i] = np.nan, str(rng.choice(["", "nan", "NaN", "NULL", "n/a", "-1.#IND", "  "]))
            if all(not cell.strip() for cell in cells):
                continue
            numbers.append(FIRST.line + len(lines))
            values.append(value)
            lines.append(delimiter.join(f"{' ' * int(rng.integers(3))}{cell} " for cell in cells))
    return "\n".join(lines) + "\n", np.array(values), numbers


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("block", [1, 37, 1 << 20])
def test_numbers_and_line_numbers_come_back_whatever_the_block(delimiter, block):
    text, values, numbers = awkward_table(np.random.default_rng(block), 60, delimiter)
    found = rows(text, Dialect(delimiter, MISSING), block=block)
    np.testing.assert_array_equal(found.values, values)
    assert found.lines.tolist() == numbers
    assert str(found.place(3)) == f"file, line {numbers[3]}"


@pytest.mark.parametrize("word", [*MISSING, "NULL", "Nan", "NAN", " nan ", ""])
def test_words_for_not_seen(word):
    found = rows(f"1,{word},3\n{word},5,6\n7,8,{word}", Dialect(",", MISSING)).values
    np.testing.assert_array_equal(np.isnan(found), [[0, 1, 0], [1, 0, 0], [0, 0, 1]])


@pytest.mark.parametrize("word", ["nul", "nanx", "1null", "--", "1_0", "0x10"])
def test_other_words_are_refused_by_line_and_column(word):
    with pytest.raises(RecordingError, match=f"file, line 6, column 'b': '{word}' is not a number"):
        rows(f"1,2,3\n4,{word},6\n", Dialect(",", MISSING))


def test_without_words_only_nan_and_empty_cells_are_not_seen():
    with pytest.raises(RecordingError, match="'NULL' is not a number"):
        rows("1,NULL,3\n", Dialect())
    np.testing.assert_array_equal(rows("1\tnan\t\n", Dialect("\t")).values, [[1, np.nan, np.nan]])


def test_short_lines_are_filled_up_and_counted():
    found = rows("1\t2\n1\t2\t3\t\t \n1\n1\t2\t3\n")
    np.testing.assert_array_equal(found.values, [[1, 2, np.nan], [1, 2, 3], [1, np.nan, np.nan], [1, 2, 3]])
    assert (found.short, found.cut) == (2, None)


def test_lines_may_not_go_on_with_values():
    with pytest.raises(RecordingError, match="line 6: too many cells, 5 where the header has 3 columns"):
        rows("1\t2\t3\n1\t2\t3\t\t5\n1\t2\t3\n")


@pytest.mark.parametrize("end", ["1", "1\t2", "1\t2\t", "1\t2\t-", "1\t2\t3e"])
def test_an_incomplete_last_line_is_dropped(end):
    found = rows(f"1\t2\t3\n4\t5\t6\n{end}")
    if end == "1\t2\t":  # complete, with an empty cell
        assert (len(found.values), found.cut) == (3, None)
    else:
        assert (len(found.values), found.cut) == (2, 7)


def test_a_short_line_before_the_last_is_an_error_where_all_are_full():
    strict = Dialect("\t", may_be_cut=True)
    assert rows("1\t2\t3\n1\t2\n", strict).cut == 6
    with pytest.raises(RecordingError, match="line 6: too few cells"):
        rows("1\t2\t3\n1\t2\n1\t2\t3\n", strict)
    with pytest.raises(RecordingError, match="line 6: too few cells"):
        rows("1\t2\t3\n1\t2", Dialect("\t"))


def test_lines_of_delimiters_count_where_wanted():
    assert len(rows("1\t2\t3\n\t\t\n\n1\t2\t3\n").values) == 2
    found = rows("1\t2\t3\n\t\t\n\n1\t2\t3\n", Dialect("\t", keep_empty=True))
    assert np.isnan(found.values).all(axis=1).tolist() == [False, True, False]
    assert found.lines.tolist() == [5, 6, 8]


def test_decimal_commas():
    found = rows("1,5;-2,25e1;\n", Dialect(";", MISSING, ","))
    np.testing.assert_array_equal(found.values, [[1.5, -22.5, np.nan]])


def test_quoted_cells_and_odd_quotation_marks():
    assert read_cells('"a,b",c\n') == ["a,b", "c"]
    assert read_cells('a",b') == ['a"', "b"]
    assert read_cells('"a\tb"\tc\r\n', "\t") == ["a\tb", "c"]


def test_a_line_without_end_does_not_fill_the_memory(monkeypatch):
    class Endless:
        asked = 0

        def readline(self, size=-1):
            assert size > 0
            self.asked += size
            return "1," * (size // 2)

        read = readline

    endless = Endless()
    with pytest.raises(RecordingError, match="file, line 5: the line is longer than 2,097,152 characters"):
        read_rows(endless, NAMES, FIRST, LOOSE)
    assert endless.asked <= text_files.MAX_LINE + BLOCK
    with pytest.raises(RecordingError, match="line 8: the line is longer"):
        read_line(Endless(), FIRST, 3)


def test_tables_beyond_all_measure_are_refused(monkeypatch):
    with pytest.raises(RecordingError, match=r"line 5: the table has 30,001 columns; allowed: at most 30,000"):
        rows("1\n", names=["x"] * 30_001)
    monkeypatch.setattr(text_files, "MAX_NUMBERS", 10)
    with pytest.raises(RecordingError, match="file holds more than 10 numbers"):
        rows("1\t2\t3\n" * 4)
    monkeypatch.setattr(text_files, "MAX_LINES", 20)
    with pytest.raises(RecordingError, match="file holds more than 20 lines"):
        rows("\n" * 30, block=5)


def test_messages_show_only_what_can_be_seen():
    assert shown("a\x1b[2Jb") == "a?[2Jb"
    assert shown("x" * 50) == "x" * 40 + "..."
    with pytest.raises(RecordingError) as caught:
        rows("\x1b" + "x" * 5000 + ",2,3\n", Dialect(","))
    assert len(str(caught.value)) < 200
    assert str(caught.value).isprintable()


@pytest.mark.slow
@pytest.mark.parametrize("gap", [("", "", ""), ("nan", "nan", "nan"), ("NULL", "NULL", "NULL")])
def test_ten_minutes_of_sixty_markers_in_seconds(tmp_path, gap):
    row = "\t".join([*(f"-{i}23.456789" for i in range(100, 277)), *gap])
    with (tmp_path / "large").open("w") as stream:
        stream.writelines(f"{i}\t{row}\n" for i in range(120_000))
    with (tmp_path / "large").open() as stream:
        found = read_rows(stream, ["n"] * 181, FIRST, LOOSE)
    assert found.values.shape == (120_000, 181)
    assert np.isnan(found.values[:, -3:]).all()
