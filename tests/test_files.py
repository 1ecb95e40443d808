import errno
import os

import pytest

from armdesign.errors import RunFolderError
from armdesign.files import write_whole


def test_text_and_bytes_arrive_unchanged(tmp_path):
    write_whole(tmp_path / "text", "é\n\r\n")
    write_whole(str(tmp_path / "bytes"), b"\0\r\n")
    assert (tmp_path / "text").read_bytes() == b"\xc3\xa9\n\r\n"
    assert (tmp_path / "bytes").read_bytes() == b"\0\r\n"


def test_replaces_and_leaves_nothing_beside(tmp_path):
    write_whole(tmp_path / "file", "old, and longer")
    write_whole(tmp_path / "file", "new")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("file", "new")]


def test_gets_the_usual_permissions(tmp_path):
    (tmp_path / "usual").write_text("")
    write_whole(tmp_path / "whole", "")
    assert (tmp_path / "whole").stat().st_mode == (tmp_path / "usual").stat().st_mode


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "real").write_text("old")
    (tmp_path / "link").symlink_to(tmp_path / "real")
    write_whole(tmp_path / "link", "new")
    assert (tmp_path / "link").is_symlink()
    assert (tmp_path / "real").read_text() == "new"


def test_a_long_name_fits(tmp_path):
    write_whole(tmp_path / ("n" * 255), "x")
    assert len(list(tmp_path.iterdir())) == 1


FAILURES = {
    errno.ENOSPC: "the disk is full. Free some space",
    errno.EACCES: "the folder cannot be written to",
    errno.EROFS: "the disk is read-only",
    errno.EIO: os.strerror(errno.EIO),
}


@pytest.mark.parametrize(("number", "message"), FAILURES.items())
@pytest.mark.parametrize("function", ["open", "fsync", "replace"])
def test_a_failure_leaves_the_old_file(tmp_path, monkeypatch, function, number, message):
    def fail(*_args, **_kwargs):
        raise OSError(number, os.strerror(number))

    (tmp_path / "file").write_text("old")
    with monkeypatch.context() as patched:
        patched.setattr(os, function, fail)
        with pytest.raises(RunFolderError, match=f"cannot write .*file: {message}"):
            write_whole(tmp_path / "file", "new")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("file", "old")]


def test_an_interrupt_leaves_the_old_file(tmp_path, monkeypatch):
    def interrupt(_descriptor):
        raise KeyboardInterrupt

    (tmp_path / "file").write_text("old")
    with monkeypatch.context() as patched:
        patched.setattr(os, "fsync", interrupt)
        with pytest.raises(KeyboardInterrupt):
            write_whole(tmp_path / "file", "new")
    assert [(file.name, file.read_text()) for file in tmp_path.iterdir()] == [("file", "old")]


def test_places_that_cannot_hold_a_file(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(RunFolderError, match="the folder does not exist"):
        write_whole(tmp_path / "absent" / "file", "x")
    with pytest.raises(RunFolderError, match="part of the path is a file"):
        write_whole(tmp_path / "file" / "file", "x")
    with pytest.raises(RunFolderError, match="it is a folder"):
        write_whole(tmp_path, "x")
    with pytest.raises(RunFolderError, match="the name is too long"):
        write_whole(tmp_path / ("n" * 256), "x")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="no pipes here")
def test_a_device_is_not_replaced(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(RunFolderError, match="not a regular file"):
        write_whole(tmp_path / "pipe", "x")
    assert (tmp_path / "pipe").is_fifo()
