"""Ways in which files get damaged: bytes, lines, cells, numbers, names, encodings."""

from __future__ import annotations

import json
import re
from collections.abc import Callable

import numpy as np

Rng = np.random.Generator
Mutation = Callable[[bytes, Rng], bytes]

_NUMBER = re.compile(rb"[-+]?\d+\.?\d*(?:[eE][-+]?\d+)?")
_ODD_NUMBERS = (
    *b"nan -NaN inf -Infinity 1e400 1e308 -7e160 1e40 -0 0 -1 1e-320 1_000 0x10 1,5 --1 1e NULL abc #REF!".split(),
    *(
        b"9" * 400,
        b"0." + b"3" * 400,
        b"999999999999",
        b"4294967296",
        b"",
        b" ",
        b'"',
        "\N{FULLWIDTH DIGIT ONE}".encode(),
    ),
)
_DELIMITERS = (b",", b"\t", b";", b" ", b"|", b", ")
_ENDS = (b"\n", b"\r\n", b"\r", b"\n\n", b"\x0b", b"\xe2\x80\xa8")
_ENCODINGS = ("utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp1252", "utf-7", "cp037")
_ODD_LETTERS = "\0\x1a\x7f\ufeff\u2028\x85äß手\U0001f9be\"'"


def flip_bytes(content: bytes, rng: Rng) -> bytes:
    raw = bytearray(content)
    for _ in range(_few(rng)):
        raw[_place(raw, rng)] = int(rng.integers(256))
    return bytes(raw)


def flip_bits(content: bytes, rng: Rng) -> bytes:
    """One bit each of some bytes turned over."""
    raw = bytearray(content)
    for _ in range(_few(rng)):
        raw[_place(raw, rng)] ^= 1 << int(rng.integers(8))
    return bytes(raw)


def extreme_bytes(content: bytes, rng: Rng) -> bytes:
    """A run of bytes set to 0, 127, 128 or 255: the counts and pointers of binary files."""
    raw = bytearray(content)
    at = _place(raw, rng)
    length = int(rng.integers(1, 5))
    raw[at : at + length] = bytes([int(rng.choice([0, 1, 127, 128, 255]))]) * len(raw[at : at + length])
    return bytes(raw)


def truncate(content: bytes, rng: Rng) -> bytes:
    return content[: int(rng.integers(len(content)))]


def drop_beginning(content: bytes, rng: Rng) -> bytes:
    return content[int(rng.integers(min(len(content), 2000))) :]


def delete_block(content: bytes, rng: Rng) -> bytes:
    start, stop = _stretch(content, rng)
    return content[:start] + content[stop:]


def duplicate_block(content: bytes, rng: Rng) -> bytes:
    """A stretch put in once more, somewhere."""
    start, stop = _stretch(content, rng)
    at = _place(content, rng)
    return content[:at] + content[start:stop] + content[at:]


def swap_blocks(content: bytes, rng: Rng) -> bytes:
    """Two halves of a stretch exchanged."""
    start, stop = _stretch(content, rng)
    middle = (start + stop) // 2
    return content[:start] + content[middle:stop] + content[start:middle] + content[stop:]


def insert_zeros(content: bytes, rng: Rng) -> bytes:
    """Zero bytes put in, as a lost page on the disk."""
    at = _place(content, rng)
    return content[:at] + bytes(int(rng.choice([1, 2, 512]))) + content[at:]


def odd_numbers(content: bytes, rng: Rng) -> bytes:
    """Some numbers replaced by odd ones, in the header as likely as in the data."""
    places = [match.span() for match in _NUMBER.finditer(content)]
    header = [span for span in places if span[0] < 600]
    for _ in range(_few(rng)):
        spans = header if header and rng.random() < 0.5 else places
        if not spans:
            return content
        start, stop = spans[int(rng.integers(len(spans)))]
        if stop <= len(content):
            content = content[:start] + _pick(_ODD_NUMBERS, rng) + content[stop:]
    return content


def counts_changed(content: bytes, rng: Rng) -> bytes:
    """A whole number near the beginning made larger or smaller."""
    places = [match.span() for match in re.finditer(rb"\d+", content[:1200])]
    if not places:
        return content
    start, stop = places[int(rng.integers(len(places)))]
    value = int(content[start:stop][:18])
    changed = (value + 1, max(0, value - 1), 10 * value, value // 10, 0, 2**31, -value)[int(rng.integers(7))]
    return content[:start] + str(changed).encode() + content[stop:]


def drop_lines(content: bytes, rng: Rng) -> bytes:
    lines = content.splitlines(keepends=True)
    for _ in range(_few(rng)):
        if lines:
            del lines[_line(lines, rng)]
    return b"".join(lines)


def duplicate_lines(content: bytes, rng: Rng) -> bytes:
    lines = content.splitlines(keepends=True)
    for _ in range(_few(rng)):
        if lines:
            at = _line(lines, rng)
            lines.insert(at, lines[at])
    return b"".join(lines)


def shuffle_lines(content: bytes, rng: Rng) -> bytes:
    """A few neighbouring lines in another order."""
    lines = content.splitlines(keepends=True)
    if not lines:
        return content
    at = _line(lines, rng)
    part = lines[at : at + 6]
    return b"".join(lines[:at] + [part[i] for i in rng.permutation(len(part))] + lines[at + 6 :])


def blank_lines(content: bytes, rng: Rng) -> bytes:
    """Lines of nothing, of blanks or of delimiters put in."""
    lines = content.splitlines(keepends=True) or [b""]
    at = _line(lines, rng)
    return b"".join([*lines[:at], _pick((b"\n", b"   \n", b",,,,,,\n", b"\t\t\t\n", b"\r\n"), rng), *lines[at:]])


def change_cells(content: bytes, rng: Rng) -> bytes:
    """A cell added to, taken from, emptied or repeated in some lines."""
    lines = content.splitlines(keepends=True)
    for _ in range(_few(rng)):
        if lines:
            at = _line(lines, rng)
            delimiter = b"\t" if b"\t" in lines[at] else b"," if b"," in lines[at] else b" "
            cells = lines[at].split(delimiter)
            which = int(rng.integers(len(cells)))
            choice = int(rng.integers(4))
            cells[which : which + 1] = ([], [b""], [cells[which]] * 2, [cells[which], b"x"])[choice]
            lines[at] = delimiter.join(cells)
    return b"".join(lines)


def exchange_delimiters(content: bytes, rng: Rng) -> bytes:
    old, new = _pick(_DELIMITERS, rng), _pick(_DELIMITERS, rng)
    return content.replace(old, new, -1 if rng.random() < 0.5 else int(rng.integers(1, 40)))


def exchange_line_ends(content: bytes, rng: Rng) -> bytes:
    plain = content.replace(b"\r\n", b"\n")
    return plain.replace(b"\n", _pick(_ENDS, rng), -1 if rng.random() < 0.5 else int(rng.integers(1, 9)))


def change_encoding(content: bytes, rng: Rng) -> bytes:
    text = content.decode("utf-8", "replace")
    return text.encode(_pick(_ENCODINGS, rng), "replace")


def odd_letters(content: bytes, rng: Rng) -> bytes:
    for _ in range(_few(rng)):
        at = int(rng.integers(min(len(content), 800 if rng.random() < 0.5 else len(content)) + 1))
        letter = _ODD_LETTERS[int(rng.integers(len(_ODD_LETTERS)))]
        content = content[:at] + letter.encode() + content[at:]
    return content


def same_names(content: bytes, rng: Rng) -> bytes:
    words = list(re.finditer(rb"[A-Za-z_:#][\w:#. -]*", content[:1500]))
    if len(words) < 2:
        return content
    old, new = words[int(rng.integers(len(words)))], words[int(rng.integers(len(words)))]
    return content[: old.start()] + new.group() + content[old.end() :]


def long_names(content: bytes, rng: Rng) -> bytes:
    """A word of the header of great length, or none."""
    words = list(re.finditer(rb"[A-Za-z_]\w*", content[:1500]))
    if not words:
        return content
    word = words[int(rng.integers(len(words)))]
    return content[: word.start()] + _pick((b"", b"N" * 5000, b" ", "Ä".encode() * 300), rng) + content[word.end() :]


def json_values(content: bytes, rng: Rng) -> bytes:
    """Some values of a JSON file replaced by others of any kind, taken out, or put in twice."""
    try:
        root = [json.loads(content)]
    except (ValueError, RecursionError):
        return content
    for _ in range(_few(rng)):
        place, key = root, 0
        for _ in range(int(rng.integers(1, 9))):  # down into it
            inner = place[key]
            if not isinstance(inner, (dict, list)) or not inner or rng.random() < 0.15:
                break
            keys = list(inner) if isinstance(inner, dict) else list(range(len(inner)))
            place, key = inner, keys[int(rng.integers(min(len(keys), 4) if rng.random() < 0.5 else len(keys)))]
        odd = (None, True, -1, 1e308, float("nan"), float("inf"), "", "x", [], {}, [[]], [None], {"x": 1}, "1", 10**400)
        choice = int(rng.integers(4))
        if choice == 0 and place is not root:
            del place[key]
        elif choice == 1 and isinstance(place, list):
            place.append(place[key])
        else:
            place[key] = odd[int(rng.integers(len(odd)))]
        if not root[0]:
            break
    return json.dumps(root[0]).encode()


BINARY: tuple[Mutation, ...] = (
    *(flip_bytes, flip_bits, extreme_bytes, truncate, drop_beginning),
    *(delete_block, duplicate_block, swap_blocks, insert_zeros),
)
TEXT: tuple[Mutation, ...] = (
    *(*BINARY, odd_numbers, counts_changed, drop_lines, duplicate_lines, shuffle_lines, blank_lines, change_cells),
    *(exchange_delimiters, exchange_line_ends, change_encoding, odd_letters, same_names, long_names),
)
JSON: tuple[Mutation, ...] = (*TEXT, *[json_values] * len(TEXT))


def mutations_of(content: bytes) -> tuple[Mutation, ...]:
    """The ways in which a file of this kind gets damaged."""
    if b"\0" in content[:400]:
        return BINARY
    return JSON if content[:1] in (b"{", b"[") else TEXT


def mutated(content: bytes, rng: Rng, mutations: tuple[Mutation, ...]) -> tuple[bytes, str]:
    """A content damaged in one to three ways, and the names of those."""
    names = []
    for _ in range(int(rng.choice([1, 1, 1, 2, 3]))):
        mutation = mutations[int(rng.integers(len(mutations)))]
        content = mutation(content, rng) if content else content
        names.append(mutation.__name__)
    return content, "+".join(names)


def _few(rng: Rng) -> int:
    return int(rng.choice([1, 1, 2, 3, 8]))


def _pick(values, rng: Rng):
    return values[int(rng.integers(len(values)))]


def _place(content: bytes | bytearray, rng: Rng) -> int:
    """An index, near the beginning half of the time: there stands the header."""
    return int(rng.integers(min(len(content), 1500 if rng.random() < 0.5 else len(content))))


def _line(lines: list[bytes], rng: Rng) -> int:
    return int(rng.integers(min(len(lines), 8 if rng.random() < 0.5 else len(lines))))


def _stretch(content: bytes, rng: Rng) -> tuple[int, int]:
    start = _place(content, rng)
    return start, min(len(content), start + int(rng.choice([1, 4, 30, 512, 3000])))
