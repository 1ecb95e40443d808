import os
import subprocess
import sys

import numpy as np
import pytest

from armdesign.demonstration import read_plain_csv, read_recording, read_recordings, read_take
from armdesign.demonstration.files import formats
from armdesign.demonstration.files.formats import Format
from armdesign.demonstration.files.readers import MOST_LETTERS, legible, legible_text
from armdesign.demonstration.recording import Take
from armdesign.errors import ArmDesignError, RecordingError

TEXT = "time,hand_x,hand_y,hand_z\n0,0,0,1\n1,0,0,2\n2,0,0,3\n"
BONE = "x,y,z,q0,q1,q2,q3\n1,2,3,0,0,0,1\n1,2,3.1,0,0,0,1\n1,2,3.2,0,0,0,1\n"


def saved(tmp_path, content, name="recording.csv"):
    file = tmp_path / name
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return file


@pytest.mark.parametrize("name", ["recording.csv", "recording.trc", "recording", "my.recording.C3D"])
def test_the_ending_does_not_matter(tmp_path, name):
    assert read_recording(str(saved(tmp_path, TEXT, name))).frames == 3


def test_a_new_format_is_one_entry(tmp_path, monkeypatch):
    points = {"a": np.array([[0.0, 0, 1500], [0, 0, 1600], [0, 0, 1700]])}
    other = Take(np.arange(3.0), points, {}, "other", "Other 1.0", "mm", "z")
    entry = Format("other", lambda head: head.startswith(b"\0OTHER"), lambda _path: other)
    monkeypatch.setattr(formats, "FORMATS", (entry, *formats.FORMATS))
    file = saved(tmp_path, b"\0OTHER 1.0")
    assert read_take(file) is other
    np.testing.assert_allclose(read_recording(file).points["a"][:, 2], [1.5, 1.6, 1.7])
    np.testing.assert_allclose(read_recording(file, units="m", up="y", mirror=True).points["a"][0], [0, 1500, 0])
    assert read_recording(saved(tmp_path, TEXT)).frames == 3


def test_plain_csv_is_taken_as_it_stands(tmp_path):
    file = saved(tmp_path, TEXT)
    recording = read_recording(file)
    assert recording.points["hand"].tobytes() == read_plain_csv(file).points["hand"].tobytes()
    assert {step.name for step in recording.about.steps} == {"time"}  # one frame a second is doubted
    assert not recording.about.captured


@pytest.mark.parametrize("read", [read_recording, read_plain_csv, read_take])
def test_files_that_cannot_be_recordings(tmp_path, read):
    with pytest.raises(RecordingError, match=r"absent\.csv does not exist"):
        read(tmp_path / "absent.csv")
    with pytest.raises(RecordingError, match="is a folder"):
        read(tmp_path)
    with pytest.raises(RecordingError, match="is empty"):
        read(saved(tmp_path, b""))
    with pytest.raises(RecordingError, match=r"does not exist|cannot read"):
        read(tmp_path / "a\0b")
    with pytest.raises(RecordingError, match=r"does not exist|cannot read"):
        read(saved(tmp_path, b"x") / "below")


def test_a_file_the_system_refuses(tmp_path, monkeypatch):
    def refuse(*_args, **_kwargs):
        raise PermissionError(13, "Permission denied")

    file = saved(tmp_path, TEXT)
    monkeypatch.setattr(type(file), "open", refuse)
    with pytest.raises(RecordingError, match=r"cannot read .*recording.csv: Permission denied. Check the path"):
        read_recording(file)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_a_pipe_does_not_block(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RecordingError, match="not a regular file"):
        read_recording(tmp_path / "pipe")


BINARY = {
    "spreadsheet": (b"PK\x03\x04\x14\0\0\0", "looks like a spreadsheet"),
    "noise": (b"\x03\x9f\x3c\0\x01\0\xff", "Export the recording"),
}


@pytest.mark.parametrize(("content", "message"), BINARY.values(), ids=BINARY.keys())
def test_binary_files_name_the_known_formats(tmp_path, content, message):
    with pytest.raises(RecordingError, match=f"known format; allowed: C3D, .*plain CSV. .*{message}"):
        read_recording(saved(tmp_path, content))


def test_text_by_the_name_of_another_format_is_not_taken_for_a_table(tmp_path):
    with pytest.raises(RecordingError, match="not a recording of a known format"):
        read_recording(saved(tmp_path, "not a recording", "bad.C3D"))


def bones(tmp_path, *contents):
    return {f"b{i}": saved(tmp_path, content, f"{i}.csv") for i, content in enumerate(contents)}


def test_several_files_are_one_recording(tmp_path):
    files = bones(tmp_path, BONE, BONE.replace("1,2,", "1,2.5,"))
    joined = read_recordings(files, rate=50.0)
    assert list(joined.points) == list(joined.orientations) == ["b0", "b1"]
    np.testing.assert_allclose(joined.time, [0, 0.02, 0.04])
    np.testing.assert_allclose(joined.points["b1"][:, 1] - joined.points["b0"][:, 1], 0.5)
    names = [step.name for step in joined.about.steps]
    assert names[0] == "joined"
    assert len(set(names)) == len(names)
    assert joined.about.rate == 50.0


def test_files_with_times_are_joined_by_them(tmp_path):
    files = bones(tmp_path, TEXT, TEXT.replace("hand", "elbow"))
    assert list(read_recordings(files).points) == ["b0", "b1"]
    files["b1"] = saved(tmp_path, TEXT.replace("\n2,", "\n2.5,"), "later.csv")
    with pytest.raises(RecordingError, match=r"0.csv and .*later.csv differ in their times, .* frame 3 \(2 s and"):
        read_recordings(files)


def test_units_up_and_mirror_hold_for_all_files(tmp_path):
    files = bones(tmp_path, BONE, BONE)
    joined = read_recordings(files, rate=50.0, units="cm", up="y", mirror=True)
    np.testing.assert_allclose(joined.points["b1"][0], [0.01, 0.03, 0.02])


def test_files_that_do_not_fit_are_refused(tmp_path):
    short = BONE.rsplit("\n", 2)[0] + "\n"
    two = "time,a_x,a_y,a_z,b_x,b_y,b_z\n0,0,0,1,1,1,1\n1,0,0,2,1,1,1\n2,0,0,3,1,1,1\n"
    with pytest.raises(RecordingError, match=r"0.csv and .*1.csv have 3 and 2 frames. Export the same stretch"):
        read_recordings(bones(tmp_path, BONE, short), rate=50.0)
    with pytest.raises(RecordingError, match=r"1.csv holds 2 points, but is to give the one point 'b1'"):
        read_recordings(bones(tmp_path, TEXT, two))
    with pytest.raises(RecordingError, match=r"differ in their unit of length \(not said and m\)"):
        read_recordings(bones(tmp_path, BONE, TEXT), rate=1.0)
    with pytest.raises(RecordingError, match="no file is named"):
        read_recordings({})
    with pytest.raises(RecordingError, match="rate is unknown"):
        read_recordings(bones(tmp_path, BONE, BONE))
    for rate in (0.0, -1.0, float("nan")):
        with pytest.raises(ArmDesignError, match="rate"):
            read_recordings(bones(tmp_path, BONE, BONE), rate=rate)


def test_the_import_is_light():
    heavy = ("scipy.signal", "scipy.interpolate", "pinocchio", "matplotlib")
    code = f"import sys, armdesign.demonstration; sys.exit(any(m.startswith({heavy}) for m in sys.modules))"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_what_is_legible_stays():
    text = "take.csv, line 3: 'Ellbögen' 手 is odd. Mend it"
    assert legible_text(text) == text


@pytest.mark.parametrize("letter", list("\0\x07\x1b\x7f\x85\u2028\ufeff\n\r\t\x0b"))
def test_nothing_in_it_moves_the_cursor(letter):
    text = legible_text(f"a{letter}b")
    assert text.isprintable()
    assert len(text) == 3


def test_long_quotations_lose_their_middle():
    text = legible_text(f"take.csv, line 3: '{'N' * 5000}'. Mend it")
    assert len(text) <= MOST_LETTERS
    assert text.startswith("take.csv, line 3: 'NNN")
    assert text.endswith("'. Mend it")


def test_the_error_stays_itself():
    @legible
    def read() -> None:
        raise RecordingError("a\nb", value=7, allowed="c\0", fix="d")

    with pytest.raises(RecordingError, match=r"^a b; allowed: c\?. d$") as caught:
        read()
    assert (caught.value.value, caught.value.fix) == (7, "d")
