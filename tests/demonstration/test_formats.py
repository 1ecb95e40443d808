"""What holds for a recording in any format: the same arm comes out, and what is wrong is one sentence."""

from __future__ import annotations

import codecs
import re

import numpy as np
import pytest
from made_recordings import ARM, DATA, FRAMES, HAND, MADE, RATE, SEEN, Made
from scipy.spatial.transform import Rotation
from tasks import task_of

from armdesign.demonstration import Hints, Recording, read_recording, read_take
from armdesign.demonstration.files.formats import FORMATS
from armdesign.demonstration.summary import summarise
from armdesign.errors import RecordingError

HINTS = Hints(rate=RATE)  # some have no times
TOLD = {
    "angles",
    "blocks",
    "rate",
    "time-unit",
    "camera",
    "hips",
    "columns",
    "confidence",
    "zeros",
    "people",
}  # as usual for the format
TEXT = [made for made in MADE if made.text]
every_format = pytest.mark.parametrize("made", MADE, ids=lambda made: made.name)
every_text = pytest.mark.parametrize("made", TEXT, ids=lambda made: made.name)


def content_of(made: Made) -> bytes:
    return (DATA / made.name).read_bytes()


def read(folder, content: bytes, made: Made) -> Recording:
    """The recording in a file of another name, in metres where the format says none."""
    path = folder / "take.any"
    path.write_bytes(content)
    return read_recording(path, units="m" if made.form == "bone CSV" else None, hints=HINTS)


def refusal(folder, content: bytes, made: Made) -> str:
    with pytest.raises(RecordingError) as caught:
        read(folder, content, made)
    text = str(caught.value)
    assert "take.any" in text
    assert text.isprintable()
    assert len(text) < 1000
    return text


def part_or_sentence(folder, content: bytes, made: Made) -> Recording | None:
    """What is left of a damaged file; None where it is refused."""
    try:
        return read(folder, content, made)
    except RecordingError:
        refusal(folder, content, made)
        return None


def points_of(recording: Recording, made: Made) -> np.ndarray:
    """The arm's points that the file holds, shape (T, k, 3); a bone is called after its file."""
    renamed = {"hand": "take"} if made.form == "bone CSV" else {}
    return np.stack([recording.points[renamed.get(name, name)] for name in made.points if name], axis=1)


def same(recording: Recording, other: Recording) -> None:
    assert list(recording.points) == list(other.points)
    np.testing.assert_allclose(recording.time, other.time, rtol=1e-12)
    for ours, theirs in ((recording.points, other.points), (recording.orientations, other.orientations)):
        for name, values in ours.items():
            np.testing.assert_allclose(values, theirs[name], rtol=1e-12)


@every_format
def test_the_arm_comes_out(tmp_path, made):
    recording = read(tmp_path, content_of(made), made)
    wanted = (SEEN if made.gap else ARM)[:, [name is not None for name in made.points]]
    np.testing.assert_allclose(points_of(recording, made), wanted, atol=made.digits)  # NaN just where it was not seen
    np.testing.assert_allclose(recording.time - recording.time[0], np.arange(FRAMES) / RATE, atol=1e-9)
    assert recording.about.format.startswith(made.form)
    assert recording.about.rate in (None, pytest.approx(RATE))
    if made.turned:
        turns = recording.orientations["take" if made.form == "bone CSV" else made.turned]
        assert (Rotation.from_quat(turns) * HAND.inv()).magnitude().max() < 1e-5


@pytest.mark.parametrize("made", [made for made in MADE if None not in made.points], ids=lambda made: made.name)
def test_the_arm_is_known_by_its_names_and_becomes_the_same_task(tmp_path, made):
    recording = read(tmp_path, content_of(made), made)
    (arm,) = summarise(recording).arms
    lengths = [segment.mean for segment in arm.segments]
    np.testing.assert_allclose(lengths[:2], [0.3, 0.25], atol=1e-4)  # upper arm and forearm [m]
    task = task_of(recording, base=arm.base, points=arm.points[:2], low_pass="off")
    np.testing.assert_allclose(task.P, ARM[:, 1:3] - ARM[:, :1], atol=0.002)  # the gap is filled


@every_format
def test_the_take_has_the_files_own_words(made):
    take = read_take(DATA / made.name, HINTS)
    assert take.units == made.units
    assert take.captured == (made.form != "plain CSV")
    assert take.up in (None, "z", "-y")
    assert set(filter(None, made.points)) <= set(take.points)
    assert not {step.name for step in take.steps} - TOLD


@every_format
def test_a_format_is_told_by_its_first_bytes_alone(made):
    head = content_of(made)[:8192]
    taken = [form.name for form in FORMATS if form.matches(head)]
    assert made.form.startswith(taken[0])
    # plain CSV takes any text, to say what is wrong with it; these ask after others with a closer look
    assert set(taken[1:]) <= {"Qualisys TSV", "long CSV", "tracker CSV", "plain CSV"}


@pytest.mark.parametrize(
    "head", [b"", b"P", b"\0\1\2", bytes(600), b"PK\x03\x04" + bytes(600), b"\0HIERARCHY", b"\0x,y,z", b"HIERARCHYX\n"]
)
@pytest.mark.parametrize("form", FORMATS[:-1], ids=lambda form: form.name)
def test_other_bytes_are_of_no_format(form, head):
    assert not form.matches(head)


@every_text
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r", "\r\r\n"])
@pytest.mark.parametrize("mark", [b"", codecs.BOM_UTF8])
def test_line_ends_and_byte_order_marks_change_nothing(tmp_path, made, end, mark):
    content = content_of(made)
    changed = mark + re.sub(b"\r?\n", end.encode(), content.removeprefix(codecs.BOM_UTF8))
    same(read(tmp_path, changed, made), read(tmp_path, content, made))


@every_text
@pytest.mark.parametrize("encoding", ["utf-16", "cp1252"])
def test_encodings_change_nothing(tmp_path, made, encoding):
    content = content_of(made).removeprefix(codecs.BOM_UTF8)
    changed = content.decode().replace("elbow", "Ellbögen").encode(encoding)
    if made.form == "FreeMoCap CSV":  # which is known by its names
        changed = content.decode().encode(encoding)
    if made.form == "plain CSV" and ("utf-16" in encoding or changed != content):
        assert "UTF-8" in refusal(tmp_path, changed, made)
        return
    recording, plain = read(tmp_path, changed, made), read(tmp_path, content, made)
    assert [name.replace("Ellbögen", "elbow") for name in recording.points] == list(plain.points)
    np.testing.assert_array_equal(list(recording.points.values()), list(plain.points.values()))


@every_text
def test_blank_lines_around_the_file_change_nothing(tmp_path, made):
    content = content_of(made)
    more = b"" if made.form in ("bone CSV", "FreeMoCap CSV") else b"\n  \n"  # there each line below the header counts
    around = content + more if content.startswith(codecs.BOM_UTF8) else b"\n \n" + content + more
    same(read(tmp_path, around, made), read(tmp_path, content, made))


@every_format
def test_a_file_cut_off_anywhere_is_shorter_or_refused(tmp_path, made):
    content = content_of(made)
    whole = read(tmp_path, content, made)
    for share in np.linspace(0.02, 0.98, 25):
        part = part_or_sentence(tmp_path, content[: int(share * len(content))], made)
        if part is not None:
            assert (
                made.text or made.name.endswith((".csv", ".mvnx")) or part.frames == FRAMES
            )  # the last block of a C3D file is filled up
            for name, values in part.points.items():  # the last row may end within its last number
                np.testing.assert_array_equal(values[:-1], whole.points[name][: part.frames - 1])


@every_text
def test_a_row_cut_off_at_the_end_is_left_out(tmp_path, made):
    content = content_of(made).rstrip()
    cut = content[: content.rindex(b"\n") + 9]
    if made.form == "plain CSV":
        assert f"line {FRAMES + 1}" in refusal(tmp_path, cut, made)
        return
    recording = read(tmp_path, cut, made)
    assert recording.frames == FRAMES - 1
    assert "cut" in [step.name for step in recording.about.steps]


@every_text
@pytest.mark.parametrize("word", ["zero", "1.2.3", "1_0", "inf", "1e999"])
def test_a_cell_that_is_no_number_names_its_line(tmp_path, made, word):
    lines = content_of(made).decode().splitlines()
    mark = next(mark for mark in "\t;, " if mark in lines[-3])
    cells = lines[-3].split(mark)
    cells[4] = word
    lines[-3] = mark.join(cells)
    text = refusal(tmp_path, "\n".join(lines).encode() + b"\n", made)
    assert f"line {len(lines) - 2}, column" in text
    assert f"'{word}'" in text


@every_text
def test_a_number_beyond_any_room_is_refused(tmp_path, made):
    lines = content_of(made).decode().splitlines()
    mark = next(mark for mark in "\t;, " if mark in lines[-3])
    cells = lines[-3].split(mark)
    cells[4] = "1e30"
    lines[-3] = mark.join(cells)
    if made.turned or made.form == "MediaPipe landmarks":  # it may be an angle, or how sure a point is, of any size
        part_or_sentence(tmp_path, "\n".join(lines).encode() + b"\n", made)
        return
    assert "1e+30" in refusal(tmp_path, "\n".join(lines).encode() + b"\n", made)


@pytest.mark.parametrize("made", [made for made in TEXT if None not in made.points], ids=lambda made: made.name)
def test_a_point_that_is_named_twice_is_told_apart_or_refused(tmp_path, made):
    third, second = (made.points[i].rpartition(":")[2] for i in (2, 1))
    content = content_of(made)
    for line in content.decode().splitlines():
        if third in line:
            content = content.replace(line.encode(), line.replace(third, second).encode())
    recording = part_or_sentence(tmp_path, content, made)
    if recording is None:
        assert second in refusal(tmp_path, content, made)
        return
    twice = [name for name in recording.points if second in name and not name.endswith("(end)")]
    assert len(twice) > 1 or made.form == "FreeMoCap CSV"  # which is not known without all its names


@every_text
def test_a_cell_too_many_names_its_line(tmp_path, made):
    lines = content_of(made).decode().splitlines()
    lines[-3] += next(mark for mark in "\t;, " if mark in lines[-3]) + "7.5"
    assert f"line {len(lines) - 2}: too many cells" in refusal(tmp_path, "\n".join(lines).encode() + b"\n", made)


@every_text
def test_without_frames_it_is_refused(tmp_path, made):
    lines = content_of(made).decode().splitlines(keepends=True)
    assert "frame" in refusal(tmp_path, "".join(lines[:-FRAMES]).encode(), made)
    assert "two frames" in refusal(tmp_path, "".join(lines[: 2 - FRAMES]).encode(), made)


@every_format
def test_empty_and_damaged_files_are_refused_in_a_sentence(tmp_path, made):
    assert "empty" in refusal(tmp_path, b"", made)
    assert "empty" in refusal(tmp_path, b" \n\n", made)
    content = content_of(made)
    refusal(tmp_path, content[:200] + bytes(200) + content[400:] if made.text else content[:512] + bytes(512), made)
