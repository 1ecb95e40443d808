"""The same job done several times: found, listed, compared; parts of recordings by their names."""

import numpy as np
import pytest

from armdesign.demonstration import Recording, read_recording, write_plain_csv
from armdesign.demonstration.cycles import find_cycles
from armdesign.demonstration.files.stretch import part_name, part_of
from armdesign.errors import ArmDesignError, RecordingError

RATE = 50.0


def done(lengths, rest=0.4, odd=None, seed=0) -> tuple[Recording, list[float]]:
    """A job done once for each length [s], with rests between, and when each begins; one of them done otherwise."""
    rng = np.random.default_rng(seed)
    pieces, begins, now = [], [], 0.0
    for i, length in enumerate(lengths):
        phase = np.linspace(0.0, 1.0, round(length * RATE), endpoint=False)
        phase = phase**1.2  # not at an even pace
        size = 1.8 if i == odd else 1.0
        job = [0.3 * np.sin(np.pi * phase) * size, 0.2 * np.sin(2 * np.pi * phase), 0 * phase]
        pieces.append(np.stack(job, axis=1))
        begins.append(now)
        pause = np.zeros((round(rest * RATE * rng.uniform(0.7, 1.5)), 3))
        pieces.append(pause)
        now += len(pieces[-2]) / RATE + len(pause) / RATE
    hand = np.concatenate(pieces) + np.array([0.3, 0.0, 1.0])
    hand += rng.normal(0.0, 3e-4, hand.shape)
    time = np.arange(len(hand)) / RATE
    shoulder = np.tile([0.0, 0.0, 1.3], (len(hand), 1)) + 0.01 * np.sin(time)[:, None]
    return Recording(time, {"shoulder": shoulder, "hand": hand + shoulder}, source="take"), begins


def cycles(recording):
    return find_cycles(recording)


@pytest.mark.parametrize("rest", [0.0, 0.4, 3.0])
def test_each_time_is_found_with_its_beginning(rest):
    recording, begins = done([2.0, 2.6, 1.8, 2.2, 2.4], rest)
    found = cycles(recording)
    assert len(found.every) == 5
    for cycle, begin, length in zip(found.every, begins, [2.0, 2.6, 1.8, 2.2, 2.4], strict=True):
        assert begin - 0.8 < cycle.start < begin + 0.3
        assert 0.7 * length < cycle.stop - cycle.start < length + 1.1


def test_the_most_typical_is_not_the_one_done_otherwise():
    found = cycles(done([2.0, 2.0, 2.2, 2.1], odd=2)[0])
    apart = [cycle.apart for cycle in found.every]
    assert int(np.argmax(apart)) == 2
    assert apart[found.typical] == min(apart)


def test_gaps_are_bridged_and_other_motions_refused():
    recording, _ = done([2.0, 2.6, 1.8])
    hand = recording.points["hand"].copy()
    hand[40:60] = np.nan
    assert len(cycles(Recording(recording.time, {**recording.points, "hand": hand})).every) == 3
    rng = np.random.default_rng(1)
    walk = np.cumsum(rng.normal(size=(300, 3)), axis=0)
    for path in (walk, np.linspace([0, 0, 0], [1, 0, 0], 300), np.zeros((300, 3))):
        with pytest.raises(RecordingError, match="take"):
            cycles(Recording(np.arange(300) / RATE, {"shoulder": np.zeros((300, 3)), "hand": path}, source="take"))


def test_a_part_of_a_recording_has_a_name(tmp_path):
    recording, _ = done([2.0, 2.0])
    write_plain_csv(tmp_path / "take.csv", recording)
    part = read_recording(f"{tmp_path / 'take.csv'}@0.5:1.5")
    np.testing.assert_allclose(part.time, np.arange(25, 76) / RATE)
    assert part.source.endswith("take.csv@0.5:1.5")
    with pytest.raises(ArmDesignError, match="frames"):
        read_recording(f"{tmp_path / 'take.csv'}@70:80")
    name = part_name("a/b.c3d@1:2", 0.25, 3.0)
    assert part_of(name) == ("a/b.c3d", 0.25, 3.0)
    odd = tmp_path / "take@1:2"
    write_plain_csv(odd, recording)
    assert read_recording(odd).frames == recording.frames
