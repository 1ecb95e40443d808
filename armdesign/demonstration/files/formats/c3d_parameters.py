"""The parameter section of a C3D file: named values in groups, each record telling how far on the next one stands."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from armdesign._types import Array
from armdesign.demonstration.files.formats.c3d_numbers import MIPS, ORDERS, floats_of

_SIZES = {-1: 1, 1: 1, 2: 2, 4: 4}  # kinds of values: text, byte, 16 bit integer, float
_MAX_DIMENSIONS = 7


class C3DDamage(Exception):  # noqa: N818 (never leaves the reader of C3D files)
    """Something in a C3D file cannot be right.

    Attributes:
        allowed: What it could be instead; None where there is no telling.
        fix: What to do about it.
    """

    def __init__(self, what: str, allowed: str | None = None, fix: str = "Export the recording again") -> None:
        super().__init__(what)
        self.allowed, self.fix = allowed, fix


class C3DParameter(NamedTuple):
    """One parameter as it stands in the file.

    Attributes:
        kind: -1 text, 1 byte, 2 16 bit integer, 4 float.
        width: Length of each string of a text.
        raw: The bytes of its values.
    """

    kind: int
    width: int
    raw: bytes


class C3DParameters:
    """All parameters of a file, by group and name in capitals.

    Args:
        raw: The section.
        processor: 84 Intel, 85 DEC, 86 MIPS.

    Raises:
        C3DDamage: A record reaches beyond the section or is of no known type.
    """

    def __init__(self, raw: bytes, processor: int) -> None:
        self._processor = processor
        groups: dict[int, str] = {}
        members: dict[int, dict[str, C3DParameter]] = {}
        for number, name, content in _records(raw, processor):
            if number < 0:
                groups[-number] = name
            else:
                members.setdefault(number, {})[name] = _parameter(content, name)
        self._groups: dict[str, Mapping[str, C3DParameter]] = {}
        for number, group in groups.items():
            self._groups[group] = {**self._groups.get(group, {}), **members.get(number, {})}

    def number(self, group: str, name: str, otherwise: float = 0.0) -> float:
        """The first value of a parameter.

        Args:
            group: The group, such as ``POINT``.
            name: The parameter, such as ``RATE``.
            otherwise: What it is where it is absent, empty, a text or not finite.
        """
        values = self._numbers(group, name)
        return float(values[0]) if len(values) and np.isfinite(values[0]) else otherwise

    def long(self, group: str, name: str) -> float:
        """A number of 32 bits stored as two of 16, the low one first; 0 where it is absent.

        Args:
            group: The group, such as ``TRIAL``.
            name: The parameter, such as ``ACTUAL_END_FIELD``.
        """
        parts = self._numbers(group, name)
        return float(parts[0] + 65536.0 * parts[1]) if len(parts) == 2 else float(parts[0]) if len(parts) else 0.0

    def texts(self, group: str, name: str) -> list[str]:
        """The strings of a parameter and of its continuations (``LABELS``, ``LABELS2``, ...); none if it is absent.

        Args:
            group: The group, such as ``POINT``.
            name: The parameter, such as ``LABELS``.
        """
        parameters = self._groups.get(group, {})
        found: list[str] = []
        part, number = name, 1
        while part in parameters:
            kind, width, raw = parameters[part]
            found += [_text(raw[at : at + width]) for at in range(0, len(raw), width)] if kind == -1 and raw else []
            number += 1
            part = f"{name}{number}"
        return found

    def _numbers(self, group: str, name: str) -> Array:
        """Values as floats, integers taken as unsigned; none where the parameter is absent or a text."""
        parameter = self._groups.get(group, {}).get(name)
        if parameter is None or parameter.kind == -1:
            return np.zeros(0)
        if parameter.kind == 4:
            return floats_of(parameter.raw, self._processor).astype(float)
        order = "u1" if parameter.kind == 1 else f"{ORDERS[self._processor]}u2"
        return np.frombuffer(parameter.raw, order).astype(float)


def _records(raw: bytes, processor: int) -> Iterator[tuple[int, str, bytes]]:
    """Group number (negative: a group, positive: a parameter of it), name and content of every record."""
    at = 4
    while at + 2 <= len(raw) and raw[at]:
        length, number = struct.unpack_from("bb", raw, at)  # a negative length means "locked"
        begin = at + 2 + abs(length)
        if begin + 2 > len(raw):
            raise C3DDamage("its parameter section ends within a name")
        name = _text(raw[at + 2 : begin]).upper()
        offset = _offset(raw, begin, number, processor)
        end = begin + offset if offset else len(raw)
        if end > len(raw) or (offset and offset < 2):
            raise C3DDamage(f"parameter '{name[:40]}' points {offset} bytes on, which is not a parameter")
        yield number, name, raw[begin + 2 : end]
        at = end


def _offset(raw: bytes, begin: int, number: int, processor: int) -> int:
    """How far on the next record begins [bytes]; 0 where this is the last.

    Some big-endian files of SGI have the last offset in little-endian order. A record tells its own length, and only
    where it contradicts the offset as the processor writes it, and agrees with the other order, is that one believed.
    """
    (offset,) = struct.unpack_from(f"{ORDERS[processor]}H", raw, begin)
    (swapped,) = struct.unpack_from("<H", raw, begin)
    if processor != MIPS or offset == swapped:
        return int(offset)
    at, end = begin + 2, begin + swapped
    if number > 0 and at + 2 <= len(raw):  # a parameter: kind, number of dimensions, these, values
        extents = raw[at + 2 : at + 2 + raw[at + 1]]
        at += 2 + len(extents) + math.prod(extents) * abs(struct.unpack_from("b", raw, at)[0])
    described = raw[at] if at < len(raw) else 0  # length of the description, which is the end of a record
    return int(swapped) if at + 1 + described == end else int(offset)


def _parameter(raw: bytes, name: str) -> C3DParameter:
    """A parameter out of the content of its record."""
    kind = struct.unpack_from("b", raw)[0] if len(raw) >= 2 else 0
    if kind not in _SIZES or raw[1] > _MAX_DIMENSIONS or len(raw) < 2 + raw[1]:
        raise C3DDamage(f"parameter '{name[:40]}' is of no known type")
    begin = 2 + raw[1]
    extents = raw[2:begin]  # the fastest first
    size = _SIZES[kind] * math.prod(extents)
    if begin + size > len(raw):
        raise C3DDamage(f"parameter '{name[:40]}' claims {size} bytes, but has {len(raw) - begin}")
    return C3DParameter(kind, extents[0] if extents else 1, raw[begin : begin + size])


def _text(raw: bytes) -> str:
    """A string up to its first zero, without blanks around it and with no control characters."""
    raw = raw.split(b"\0")[0]
    try:
        text = raw.decode("utf-8")
    except UnicodeDecodeError:
        text = raw.decode("latin-1")
    return "".join(letter if letter.isprintable() else "?" for letter in text.strip()).strip()
