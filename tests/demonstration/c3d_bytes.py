"""C3D files written byte by byte, odd ones too."""

from __future__ import annotations

import struct
from collections.abc import Mapping

import numpy as np

INTEL, DEC, MIPS = 84, 85, 86
Raw = tuple[int, list[int], bytes]  # kind, dimensions, bytes of a parameter


def c3d_bytes(
    points,
    *,
    residual=None,
    analog=None,
    rotations=None,
    rate=100.0,
    scale=-1.0,
    processor=INTEL,
    first=1,
    groups: Mapping[str, Mapping[str, object]] | None = None,
    header: Mapping[str, float] | None = None,
) -> bytes:
    """A C3D file.

    Args:
        points: Shape (T, n, 3).
        residual: Shape (T, n); negative = missing.
        analog: Shape (T, samples, channels).
        rotations: Shape (T, ratio, k, 4, 4); NaN = missing.
        rate: Frames per second.
        scale: Factor of integers; negative for floats.
        processor: 84, 85 or 86.
        first: Number of the first frame.
        groups: Parameters to add, replace or (None) leave out.
        header: Header fields to replace: points, analog, first, last, gap, scale, start, samples, rate.
    """
    frames, count = points.shape[:2]
    analog = np.zeros((frames, 0, 0)) if analog is None else analog
    samples, channels = analog.shape[1:]
    known = _parameters(frames, count, samples, channels, rate, scale)
    if rotations is not None:
        known["ROTATION"] = {"USED": rotations.shape[2], "RATIO": rotations.shape[1], "DATA_START": 0}
        known["ROTATION"]["LABELS"] = [f"s{i}_4X4" for i in range(rotations.shape[2])]
    for group, values in (groups or {}).items():
        known.setdefault(group, {}).update(values)
    data = _padded(_data(points, residual, analog, scale, processor))
    start = 2 + len(_section(known, processor)) // 512
    for group, block in (("POINT", start), ("ROTATION", start + len(data) // 512)):
        if known.get(group, {}).get("DATA_START") == 0:
            known[group]["DATA_START"] = block
    stated = {"points": count, "analog": samples * channels, "first": first, "last": min(first + frames - 1, 65535)}
    stated |= {"gap": 10, "scale": scale, "start": start, "samples": samples, "rate": rate} | dict(header or {})
    turns = b"" if rotations is None else _rotations(rotations, processor)
    return _padded(_header(stated, processor)) + _section(known, processor) + data + turns


def _parameters(frames, count, samples, channels, rate, scale) -> dict[str, dict[str, object]]:
    point = {"USED": count, "FRAMES": min(frames, 65535), "SCALE": float(scale), "RATE": float(rate), "UNITS": "mm"}
    point |= {"LABELS": [f"M{i}" for i in range(count)], "DATA_START": 0}
    analog = {"USED": channels, "RATE": float(rate * samples), "SCALE": [1.0] * channels, "OFFSET": [0] * channels}
    return {"POINT": point, "ANALOG": analog}


def _order(processor: int) -> str:
    return ">" if processor == MIPS else "<"


def floats(values, processor: int) -> bytes:
    """Floats of 32 bits as the processor stores them."""
    array = np.asarray(values, dtype=float)
    if processor != DEC:
        return array.astype(f"{_order(processor)}f4").tobytes()
    return (array * 4).astype("<f4").reshape(-1).view("<u2").reshape(-1, 2)[:, ::-1].tobytes()


def _header(stated: dict[str, float], processor: int) -> bytes:
    order = _order(processor)
    head = struct.pack("2B", 2, 0x50)
    head += struct.pack(f"{order}5H", *(stated[name] for name in ("points", "analog", "first", "last", "gap")))
    head += floats(stated["scale"], processor) + struct.pack(f"{order}2H", stated["start"], stated["samples"])
    return head + floats(stated["rate"], processor)


def _section(groups: Mapping[str, Mapping[str, object]], processor: int) -> bytes:
    order = _order(processor)
    records = b""
    for number, (group, values) in enumerate(groups.items(), 1):
        records += struct.pack("bb", len(group), -number) + group.encode() + struct.pack(f"{order}HB", 3, 0)
        for name, value in values.items():
            if value is not None:
                content = _content(value, processor)
                records += struct.pack("bb", len(name), number) + name.encode()
                records += struct.pack(f"{order}H", len(content) + 2) + content
    blocks = -(-(len(records) + 6) // 512)
    return (bytes([1, 0x50, blocks % 256, processor]) + records).ljust(512 * blocks, b"\0")


def _content(value: object, processor: int) -> bytes:
    kind, dimensions, raw = value if isinstance(value, tuple) else _raw(value, processor)
    return struct.pack("bB", kind, len(dimensions)) + bytes(dimensions) + raw + b"\0"


def _raw(value: object, processor: int) -> Raw:
    if isinstance(value, str):
        return -1, [len(value.encode())], value.encode()
    items = value if isinstance(value, list) else [value]
    dimensions = [len(items)] if isinstance(value, list) else []
    if items and isinstance(items[0], str):
        width = max(len(item.encode()) for item in items)
        return -1, [width, *dimensions], b"".join(item.encode().ljust(width) for item in items)
    if items and isinstance(items[0], float):
        return 4, dimensions, floats(items, processor)
    return 2, dimensions, struct.pack(f"{_order(processor)}{len(items)}H", *items)


def _data(points, residual, analog, scale, processor) -> bytes:
    frames = len(points)
    residual = np.zeros(points.shape[:2]) if residual is None else residual
    if scale < 0:
        numbers = np.concatenate([points, residual[..., None]], axis=2).reshape(frames, -1)
        return floats(np.concatenate([numbers, analog.reshape(frames, -1)], axis=1), processor)
    numbers = np.concatenate([np.round(points / scale), np.sign(residual)[..., None]], axis=2).reshape(frames, -1)
    return np.concatenate([numbers, analog.reshape(frames, -1)], axis=1).astype(f"{_order(processor)}i2").tobytes()


def _rotations(rotations, processor) -> bytes:
    seen = ~np.isnan(rotations).any(axis=(3, 4))
    numbers = np.nan_to_num(rotations).transpose(0, 1, 2, 4, 3).reshape(*seen.shape, 16)  # column by column
    return _padded(floats(np.concatenate([numbers, np.where(seen, 0.0, -1.0)[..., None]], axis=3), processor))


def _padded(raw: bytes) -> bytes:
    return raw + bytes(-len(raw) % 512)
