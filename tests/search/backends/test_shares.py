"""How many workers a batch gets: as many as pay, and all of them where it is long."""

import pytest

from armdesign.search.backends.shares import AGAIN, SHORT, Shares


def run(shares, seconds, *, count=24, workers=4, batches=200, kind="steps"):
    """How often a batch went to how many workers, where it takes ``seconds(workers)``."""
    chosen = []
    for _ in range(batches):
        few = shares.choose(kind, count, workers)
        shares.learn(kind, count, few, seconds(few))
        chosen.append(few)
    return chosen


def test_batches_that_do_not_gain_go_to_one_worker():
    chosen = run(Shares(), lambda workers: 0.002 + 0.003 * workers)
    assert chosen[:3] == [4, 2, 1]  # each is tried
    assert chosen.count(1) > 180


def test_batches_that_gain_go_to_all():
    chosen = run(Shares(), lambda workers: 0.02 / workers + 0.001)
    assert chosen.count(4) > 180


def test_the_best_may_lie_between():
    chosen = run(Shares(), lambda workers: 0.02 / workers + 0.004 * workers)
    assert chosen.count(2) > 180


def test_what_was_worse_gets_another_chance_and_wins_once_it_is_better():
    shares = Shares()
    run(shares, lambda workers: 0.002 * workers)
    chosen = run(shares, lambda workers: 0.02 / workers, batches=20 * AGAIN)
    assert chosen[-AGAIN:].count(4) >= AGAIN - 1


def test_long_batches_go_to_all_without_a_trial():
    assert set(run(Shares(), lambda workers: 2.0 * SHORT)) == {4}


def test_kinds_and_sizes_are_told_apart():
    shares = Shares()
    run(shares, lambda workers: 0.002 * workers, kind="small")
    assert shares.choose("large", 24, 4) == 4
    assert shares.choose("small", 600, 4) == 4


@pytest.mark.parametrize(("count", "workers", "most"), [(1, 4, 1), (3, 8, 3), (10, 0, 1), (0, 2, 1)])
def test_no_more_than_there_are_candidates_or_workers(count, workers, most):
    assert Shares().choose("steps", count, workers) == most
