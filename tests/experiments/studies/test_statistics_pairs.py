"""Paired changes in percent and their bootstrap intervals."""

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.experiments.studies.statistics import Pairs, change


def drawn(rng, size=12, effect=0.8, luck=0.5, noise=0.05):
    """Fitness of two methods whose seeds share their luck."""
    base = np.exp(luck * rng.standard_normal(size))
    return base, effect * base * np.exp(noise * rng.standard_normal(size))


def test_a_constant_factor_is_certain():
    base = np.random.default_rng(1).random(9) + 0.1
    found = change([Pairs(base, np.outer(base, [1.0, 0.9, 2.0]))])
    assert found.percent == pytest.approx([0.0, -10.0, 100.0])
    assert found.low == pytest.approx(found.percent)
    assert found.high == pytest.approx(found.percent)
    assert found.least.tolist() == [0.0, 1.0, 0.0]


def test_change_of_the_means_not_mean_of_the_changes():
    assert change([Pairs([1.0, 3.0], [[2.0], [3.0]])]).percent == pytest.approx([25.0])


def test_groups_count_the_same():
    a, b = Pairs([1.0] * 2, [[2.0]] * 2), Pairs([1.0] * 20, [[1.5]] * 20)
    assert change([a, b]).percent == pytest.approx([75.0])
    assert change([a, b]).pairs == 22


def test_neither_unit_nor_order_matters():
    base, other = drawn(np.random.default_rng(2))
    one, scaled = change([Pairs(base, other[:, None])]), change([Pairs(1e3 * base, 1e3 * other[:, None])])
    assert scaled.low == pytest.approx(one.low)
    both = change([Pairs(base, np.stack([other, base], axis=1))])
    swapped = change([Pairs(base, np.stack([base, other], axis=1))])
    assert swapped.low == pytest.approx(both.low[::-1])
    assert swapped.least == pytest.approx(both.least[::-1])


def test_same_seed_same_interval():
    base, other = drawn(np.random.default_rng(3))
    a, b, c = (change([Pairs(base, other[:, None])], seed) for seed in (7, 7, 8))
    assert a.low.tolist() == b.low.tolist() != c.low.tolist()


def test_pairs_take_out_the_luck_of_a_seed():
    rng = np.random.default_rng(4)
    base, other = drawn(rng, 40)
    paired, mixed = change([Pairs(base, other[:, None])]), change([Pairs(base, rng.permutation(other)[:, None])])
    assert (paired.high - paired.low)[0] < 0.4 * (mixed.high - mixed.low)[0]


def test_interval_covers_the_truth_about_as_often_as_it_says():
    rng, covered = np.random.default_rng(5), 0
    for trial in range(200):
        base, other = drawn(rng, 30, noise=0.2)
        found = change([Pairs(base, other[:, None])], trial, draws=400)
        covered += found.low[0] <= 100.0 * (0.8 * np.exp(0.02) - 1.0) <= found.high[0]
    assert 170 <= covered <= 199


def test_a_single_pair_has_no_interval():
    found = change([Pairs([1.0], [[0.5]])])
    assert found.percent == pytest.approx([-50.0])
    assert np.isnan([found.low, found.high]).all()


@pytest.mark.parametrize(
    ("base", "others"), [([], np.zeros((0, 1))), ([1.0], [[1.0], [2.0]]), ([0.0], [[1.0]]), ([1.0], [[np.nan]])]
)
def test_what_makes_no_pairs_is_refused(base, others):
    with pytest.raises(SettingsError):
        Pairs(base, others)
