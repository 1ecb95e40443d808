import pytest

from armdesign.demonstration.files.text_files import HEAD_SIZE, open_text, read_head, text_head
from armdesign.errors import RecordingError

TEXT = "Größe\tMärker\n1\t2\n"


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_text_in_any_usual_encoding(tmp_path, encoding):
    content = TEXT.replace("\n", "\r\n").encode(encoding)
    (tmp_path / "text").write_bytes(content)
    with open_text(tmp_path / "text") as stream:
        assert stream.read() == TEXT
    assert text_head(content) == TEXT


def test_other_utf_16_marks(tmp_path):
    (tmp_path / "text").write_bytes(b"\xfe\xff" + TEXT.encode("utf-16-be"))
    with open_text(tmp_path / "text") as stream:
        assert stream.read() == TEXT


def test_a_letter_cut_in_two_by_the_end_of_the_head_is_still_utf_8():
    content = ("x" * (HEAD_SIZE - 1) + "ö").encode()
    assert text_head(content[:HEAD_SIZE]).startswith("xxx")
    assert "Ã" not in text_head(content[:HEAD_SIZE])


@pytest.mark.parametrize("content", [b"\0\1\2", b"PK\x03\x04\0\0", "text".encode("utf-16-le"), "text".encode("utf-32")])
def test_what_is_no_text_has_no_text(content):
    assert text_head(content).replace("\0", "") in ("", "text")


def test_bytes_outside_the_encoding_are_replaced_not_raised(tmp_path):
    (tmp_path / "text").write_bytes(b"\x81\x8d\xff\nab")
    with open_text(tmp_path / "text") as stream:
        assert stream.read().endswith("ab")


def test_files_of_more_than_a_gibibyte_are_refused(tmp_path):
    with (tmp_path / "huge").open("wb") as stream:
        stream.write(b"time,a_x\n")
        stream.truncate(2 << 30)
    with pytest.raises(RecordingError, match=r"is 2.0 GiB in size; allowed: at most 1 GiB. Export a shorter stretch"):
        read_head(tmp_path / "huge")


def test_a_file_that_is_gone_or_fails_while_it_is_read_is_named(tmp_path):
    with pytest.raises(RecordingError, match=r"cannot read .*gone: No such file"), open_text(tmp_path / "gone"):
        pass
    (tmp_path / "text").write_text(TEXT)
    with pytest.raises(RecordingError, match=r"cannot read .*text: disk"), open_text(tmp_path / "text"):
        raise OSError("disk")
