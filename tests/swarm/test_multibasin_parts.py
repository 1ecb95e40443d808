"""Parts of a many-basin search that others carry out: in whatever order and however far, the search stays the same."""

import numpy as np
import pytest
from swarm_problem import SPACE, answer, build, bumpy_slope, evaluate, run

from armdesign.swarm import Part
from armdesign.swarm.part import DESCEND, LEAD, SAMPLE

SIZES = {"budget": 1200, "effort": "normal"}


def carried_out(search, rng, most):
    """Carry a search on by its parts, which come back as states, now and then late, or not at all."""
    late = []
    while not search.done:
        if search.unread:
            search.read()
            continue
        parts = search.parts(most)
        if not parts or rng.random() < 0.1:  # or by itself, batch by batch
            answer(search, search.ask())
            continue
        for part in [Part.from_state(part.state(), SPACE) for part in parts]:
            for _ in range(int(rng.integers(1, 9))):
                if not part.done:
                    answer(part, part.ask())
            late.append(part)
        for k in rng.permutation(len(late))[: 1 + len(late) // 2][::-1]:
            search.put(Part.from_state(late[k].state(), SPACE))
        late = [part for part in late if rng.random() < 0.5]  # some come twice, some never
    return search


@pytest.mark.parametrize(("seed", "most"), [(0, 1), (1, 2), (2, 5)])
def test_who_carries_parts_out_and_how_many_at_a_time_changes_nothing(seed, most):
    alone = build("multibasin", seed, **SIZES)
    run(alone)
    search = carried_out(build("multibasin", seed, **SIZES), np.random.default_rng(100 * seed + most), most)
    for name, column in vars(alone.history).items():
        np.testing.assert_array_equal(getattr(search.history, name), column, err_msg=name)
    np.testing.assert_array_equal(search.best_position, alone.best_position)
    np.testing.assert_array_equal(search.basins[0], alone.basins[0])
    assert search.agreement == alone.agreement
    assert search.ending == alone.ending


def test_a_beginning_that_comes_back_when_the_beginnings_are_over_is_let_go():
    search = build("multibasin", 1, budget=600)
    first, second = (Part.from_state(part.state(), SPACE) for part in search.parts(2))
    while not search.done:
        answer(search, search.ask())
        answer(second, second.ask())
        search.put(second)
        if second.done:
            break
    before = search.evaluations
    search.put(first)
    search.put(second)
    assert search.evaluations == before
    while not search.done:
        search.read() if search.unread else answer(search, search.ask())
    alone = build("multibasin", 1, budget=600)
    run(alone)
    np.testing.assert_array_equal(search.history.best, alone.history.best)


def test_what_is_gathered_at_an_early_end_counts():
    search = build("multibasin", 2, **SIZES)
    parts = [Part.from_state(part.state(), SPACE) for part in search.parts(3)]
    assert len({part.label for part in parts}) == 3
    for part in parts:
        for _ in range(30):
            answer(part, part.ask())
        search.put(part)
    gathered = sum(1 for _ in search.gather())
    assert gathered == 90
    assert search.evaluations == sum(part.evaluations for part in parts)
    assert search.best_fitness == min(part.best_fitness for part in parts)
    assert search.done


def told_stages(*, doubted):
    """A search with coarse looks: of every batch its stage, whether it was in full, and whether without hints."""
    search, told = build("multibasin", 3, budget=3000, coarse=10, doubted=doubted), []
    while not search.done:
        X, stage = search.ask(), search._parts[0].stage(10**6)
        told.append((stage, search.coarse == 0, search.hints is None, len(X)))
        answer(search, X)
    return told


def test_samples_are_evaluated_in_full_where_a_coarse_look_misleads():
    for doubted, in_full in ((False, {True, False}), (True, {True})):
        samples = [full for stage, full, *_ in told_stages(doubted=doubted) if stage == SAMPLE]
        assert samples[0]
        assert set(samples) == in_full


def test_the_coarse_descent_in_the_lead_is_evaluated_in_full_where_a_coarse_look_misleads():
    assert all(stage != LEAD for stage, *_ in told_stages(doubted=False))
    told = told_stages(doubted=True)
    leads = [k for k, (stage, *_) in enumerate(told) if stage == LEAD]
    assert leads
    for k in leads:
        assert told[k] == (LEAD, True, True, 1)
        assert told[k - 1][:2] == (DESCEND, False)
        assert told[k + 1][0] == DESCEND


@pytest.mark.parametrize("seed", range(4))
def test_where_next_to_nothing_is_valid_in_full_it_goes_on_sampling(seed):
    search = build("multibasin", seed, budget=3000, coarse=10)
    while not search.done:
        X = search.ask()
        values, valid, hints = evaluate(X)
        if not search.coarse:
            valid &= np.abs(np.sin(1e5 * X[:, 0])) < 0.02
        values = np.where(valid, values, np.inf)
        search.tell(values, valid, hints, bumpy_slope(X) if search.wants_slopes else None)
    assert search.evaluations <= 3000
    assert len(search.basins[1]) == 0 or np.isfinite(search.basins[1]).all()
