"""Whatever happens to a file, reading it gives a sound recording or one sentence: no crash, no hang, no warning."""

from __future__ import annotations

import signal
import sys
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest
from made_recordings import DATA, MADE
from mutations import mutated, mutations_of

from armdesign.demonstration.files.hints import Hints
from armdesign.demonstration.files.readers import legible, read_take
from armdesign.demonstration.points.standard import to_recording
from armdesign.errors import ArmDesignError

SHARED = Path(__file__).resolve().parents[3] / "shared" / "recordings"
SECONDS = 20  # for one small file
MOST_GROWTH = 500  # [MiB] of this process, over all files
FEW, MANY, PARTS = 30, 1_000, 4  # damaged files of each format: 20,000 and more in all
HINTS = Hints(rate=50.0)  # some have no times


def seeds() -> dict[str, list[bytes]]:
    """Sound contents by format: those made by us, and beginnings of real ones where they are at hand."""
    contents: dict[str, list[bytes]] = {}
    for made in MADE:
        contents.setdefault(made.form.rpartition(" ")[0] if made.form[-1].isdigit() else made.form, []).append(
            (DATA / made.name).read_bytes()
        )
    for path in sorted(path for path in SHARED.rglob("*") if path.suffix in (".trc", ".csv", ".tsv", ".bvh")):
        contents.setdefault("real", []).append(b"".join(path.read_bytes().splitlines(keepends=True)[:20]))
    return contents


SEEDS = seeds()
resource = pytest.importorskip("resource", reason="needs alarm signals and memory counts")


@pytest.mark.parametrize("kind", sorted(SEEDS))
def test_damaged_files_give_a_recording_or_a_sentence(kind, tmp_path, capfd):
    fuzz(kind, FEW, tmp_path, capfd, seed=1)


@pytest.mark.slow
@pytest.mark.parametrize("part", range(PARTS))
@pytest.mark.parametrize("kind", sorted(SEEDS))
def test_many_damaged_files(kind, part, tmp_path, capfd):
    fuzz(kind, MANY // PARTS, tmp_path, capfd, seed=100 + part)


def fuzz(kind: str, count: int, folder: Path, capfd, seed: int) -> None:
    """Read ``count`` damaged files of a kind; every problem is listed with what it takes to see it again."""
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    problems = []
    for number in range(count):
        content, how = damaged(kind, seed, number)
        found = problem(written(folder, content))
        if found:
            problems.append(f"damaged({kind!r}, {seed}, {number}) [{how}]: {found}")
    printed = capfd.readouterr()
    assert not problems, f"{len(problems)} of {count}:\n" + "\n".join(problems[:20])
    assert not printed.out
    assert not printed.err
    grown = (resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / (
        1 << 10 if sys.platform != "darwin" else 1 << 20
    )
    assert grown < MOST_GROWTH


def damaged(kind: str, seed: int, number: int) -> tuple[bytes, str]:
    """One damaged file, the same in every run."""
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode()), number])
    content = SEEDS[kind][number % len(SEEDS[kind])]
    return mutated(content, rng, mutations_of(content))


def written(folder: Path, content: bytes) -> Path:
    path = folder / "take.bin"
    path.write_bytes(content)
    return path


def problem(path: Path) -> str:
    """What is wrong with how a file is read; empty if nothing is."""
    try:
        with warnings.catch_warnings(), time_limit(SECONDS):
            warnings.simplefilter("error")
            take = read_take(path, HINTS)
            return unsound(take) or unsound(legible(to_recording)(take))  # as read_recording does, reading but once
    except ArmDesignError as error:
        return ill_said(error, path)
    except BaseException as error:
        if isinstance(error, KeyboardInterrupt):
            raise
        last = error.__traceback__
        while last and last.tb_next:
            last = last.tb_next
        where = f"{Path(last.tb_frame.f_code.co_filename).name}:{last.tb_lineno}" if last else "?"
        return f"{type(error).__name__} at {where}: {str(error)[:200]}"


def unsound(take) -> str:
    """Why a take or recording is none; empty if it is one."""
    frames = len(take.time)
    if take.time.shape != (frames,) or not np.isfinite(take.time).all() or not (np.diff(take.time) > 0).all():
        return "times that do not increase"
    if not take.points and not take.orientations:
        return "neither points nor orientations"
    for width, series in ((3, take.points), (4, take.orientations)):
        for name, values in series.items():
            if values.shape != (frames, width) or values.dtype != float:
                return f"shape {values.shape} of {name!r}"
            if np.isinf(values).any():
                return f"an infinite value of {name!r}"
            if not name or name != name.strip():
                return f"the name {name!r}"
    return ""


def ill_said(error: ArmDesignError, path: Path) -> str:
    """What is wrong with an error's text; empty if nothing is."""
    text = str(error)
    if path.name not in text:
        return f"the file is not named in: {text[:300]}"
    if any(not letter.isprintable() for letter in text):
        return f"letters that cannot be printed in: {text[:300]!r}"
    if "while it was read" in text:  # the layout of a C3D file reached beyond its end
        return text
    return f"{len(text)} letters: {text[:300]}" if len(text) >= 1000 else ""


@contextmanager
def time_limit(seconds: int) -> Iterator[None]:
    """Raise TimeoutError after so many seconds of computing."""

    def stop(*_: object) -> None:
        raise TimeoutError(f"still reading after {seconds} s")

    old = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, old)
