from pathlib import Path

import numpy as np
import pytest

from armdesign.demonstration.files.csv_cells import Rows
from armdesign.demonstration.files.formats.frame_clock import frame_clock, read_rate
from armdesign.errors import RecordingError


def clock(numbers, times, rate, counted=False):
    """Frame numbers in column 0, times in column 1, on the lines from 10 on."""
    count = len(numbers if numbers is not None else times)
    columns = [np.full(count, np.nan) if column is None else column for column in (numbers, times)]
    rows = Rows(np.array(columns, dtype=float).T, np.arange(10, 10 + count), Path("file"))
    return frame_clock(rows, None if numbers is None else 0, None if counted or times is None else 1, rate)


def names(found):
    return [step.name for step in found.steps]


@pytest.mark.parametrize("first", [0, 1, 185])
@pytest.mark.parametrize("rate", [24.0, 60.0, 69.9926, 100.0, 119.88, 240.0, 1000.0])
def test_rounded_times_become_even_at_any_start(first, rate):
    numbers = np.arange(first, first + 500)
    exact = numbers / rate
    found = clock(numbers, np.round(exact, 3), rate)
    np.testing.assert_allclose(np.diff(found.time), 1 / rate, rtol=1e-9)
    assert np.abs(found.time - exact).max() < 1.1e-3
    assert found.rate == rate
    rounded = np.abs(np.round(exact, 3) - exact).max() > 1e-9
    assert names(found) == (["times"] if rounded else [])


def test_times_that_were_cut_off_become_even_too():
    numbers = np.arange(1, 400)
    found = clock(numbers, np.floor(numbers / 120 * 1000) / 1000, 120.0)
    np.testing.assert_allclose(np.diff(found.time), 1 / 120)


def test_exact_times_stay_to_the_last_bit():
    times = np.arange(300) / 120 + 7.25
    found = clock(np.arange(300), times, 120.0)
    assert found.time.tobytes() == times.tobytes()
    assert found.steps == ()


@pytest.mark.parametrize("declared", [250.0, None])
def test_times_count_where_the_rate_does_not_fit(declared):
    times = np.arange(100) * 0.04
    found = clock(np.arange(1, 101), times, declared)
    np.testing.assert_array_equal(found.time, times)
    assert found.rate == (declared and pytest.approx(25.0))
    assert names(found) == (["rate"] if declared else [])
    assert not declared or "declares 250 frames/s, but the times tell 25" in found.steps[0].sentence


def test_rounded_times_with_a_wrong_rate_are_even_at_the_rate_they_tell():
    numbers = np.arange(2000)
    found = clock(numbers, np.round(numbers / 59.94, 3), 250.0)
    np.testing.assert_allclose(np.diff(found.time), 1 / 59.94, rtol=1e-5)
    assert names(found) == ["times", "rate"]


def test_uneven_times_are_taken_as_they_are():
    times = np.cumsum(np.random.default_rng(0).uniform(0.005, 0.02, 50))
    found = clock(np.arange(50), times, 100.0)
    np.testing.assert_array_equal(found.time, times)


def test_frames_left_out_leave_a_hole_in_the_times():
    numbers = np.r_[1:50, 80:120]
    for found in (clock(numbers, None, 100.0), clock(numbers, np.round(numbers / 100, 3), 100.0)):
        assert np.diff(found.time).max() == pytest.approx(0.31)
        assert names(found) == ["holes"]
    assert "0.480 s to 0.790 s" in clock(numbers, None, 100.0).steps[0].sentence


def test_every_second_frame_is_half_the_rate():
    found = clock(np.arange(1, 41, 2), None, 100.0)
    np.testing.assert_allclose(np.diff(found.time), 0.02)
    assert found.rate == 50.0


def test_without_times_the_first_frame_is_at_zero():
    found = clock(np.arange(185, 195), None, 200.0)
    np.testing.assert_allclose(found.time, np.arange(10) / 200)
    assert found.rate == 200.0


@pytest.mark.parametrize("times", [[np.nan] * 4, [0.0] * 4])
def test_a_column_without_times_in_it_is_none(times):
    np.testing.assert_allclose(clock(np.arange(4), times, 50.0).time, np.arange(4) / 50)


def test_a_missing_time_is_made_of_its_frame_number():
    times = np.arange(6) / 50
    times[2] = np.nan
    np.testing.assert_allclose(clock(np.arange(6), times, 50.0).time, np.arange(6) / 50)


def test_times_count_where_frame_numbers_do_not_increase():
    found = clock([1, 1, 1, 1], [0.0, 0.1, 0.2, 0.3], 10.0)
    np.testing.assert_array_equal(found.time, [0.0, 0.1, 0.2, 0.3])
    assert names(found) == ["frames"]


BAD = {
    "frame again": ([1, 2, 2, 3], None, 100.0, "line 12: the frame number does not increase, 2 comes after 2"),
    "frame back": ([5, 6, 4, 7], None, 100.0, "line 12: the frame number does not increase, 4 comes after 6"),
    "frame missing": ([1, np.nan, 3, 4], None, 100.0, "line 11: the frame number is missing"),
    "frame too large": ([1, 2, 3, 1e300], None, 100.0, r"line 13: the frame number is 1e\+300"),
    "time again": ([1, 2, 3, 4], [0.0, 0.3, 0.3, 0.4], 100.0, "line 12: the time does not increase, 0.3 comes after"),
    "two takes": ([1, 2, 1, 2], [0.0, 0.1, 0.0, 0.1], 10.0, "line 12: the time does not increase"),
    "time too large": ([1, 2, 3, 4], [0.0, 0.1, 0.2, 1e200], 10.0, "line 13: the time is 1e"),
    "no rate": ([1, 2, 3, 4], None, None, "neither the times of the frames nor a frame rate"),
    "no frames": ([], None, 100.0, "holds no frame"),
}


@pytest.mark.parametrize(("numbers", "times", "rate", "message"), BAD.values(), ids=BAD.keys())
def test_what_makes_no_times(numbers, times, rate, message):
    with pytest.raises(RecordingError, match=message):
        clock(numbers, times, rate)


def test_rates_as_headers_have_them():
    assert read_rate(" 100.000 Hz") == 100.0
    assert read_rate("69,9926") == 69.9926
    for text in ("", "EXT", "nan", "inf", "0", "-100", "1e9"):
        assert read_rate(text) is None
