import os
import subprocess
import sys

import pytest

from armdesign.demonstration import READERS, Reader, Recording, read_plain_csv, read_recording, readers
from armdesign.errors import RecordingError

TEXT = "time,hand_x,hand_y,hand_z\n0,0,0,1\n1,0,0,2\n2,0,0,3\n"


def saved(tmp_path, content, name="recording.csv"):
    file = tmp_path / name
    file.write_bytes(content)
    return file


@pytest.mark.parametrize("name", ["recording.csv", "recording.trc", "recording", "my.recording.C3D"])
def test_the_ending_does_not_matter(tmp_path, name):
    assert read_recording(str(saved(tmp_path, TEXT.encode(), name))).frames == 3


def test_a_new_format_is_one_entry(tmp_path, monkeypatch):
    other = Recording([0, 1, 2], {}, source="other")
    entry = Reader("other", lambda head: head.startswith(b"\0OTHER"), lambda _path: other)
    monkeypatch.setattr(readers, "READERS", (entry, *READERS))
    assert read_recording(saved(tmp_path, b"\0OTHER 1.0")) is other
    assert read_recording(saved(tmp_path, TEXT.encode())).frames == 3


@pytest.mark.parametrize("read", [read_recording, read_plain_csv])
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

    file = saved(tmp_path, TEXT.encode())
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
    "UTF-16": (TEXT.encode("utf-16"), "looks like UTF-16 text: save it as UTF-8"),
    "C3D": (b"\x02P\x3c\0\x01\0", "Export the recording as comma separated values"),
}


@pytest.mark.parametrize(("content", "message"), BINARY.values(), ids=BINARY.keys())
def test_binary_files_name_the_known_formats(tmp_path, content, message):
    with pytest.raises(RecordingError, match=f"not a recording of a known format; allowed: plain CSV. .*{message}"):
        read_recording(saved(tmp_path, content))
    with pytest.raises(RecordingError, match=f"is not a text file. .*{message}"):
        read_plain_csv(saved(tmp_path, content))


def test_the_import_is_light():
    code = (
        "import sys, armdesign.demonstration; sys.exit(any(m.startswith(('scipy', 'pinocchio')) for m in sys.modules))"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
