"""How many independent beginnings agree, what that is taken to mean, and that a search ends by it."""

import numpy as np
import pytest
from swarm_problem import SPACE, build, run, through_json

from armdesign.errors import SettingsError
from armdesign.swarm import algorithm_from_state
from armdesign.swarm.agreement import LEVELS, agreement, chance


def test_those_within_one_percent_of_the_best_agree():
    found = agreement([0.2, 0.2019, 0.2021, 0.5, np.inf], 8)
    assert (found.agreeing, found.beginnings) == (2, 5)
    assert agreement([], 8).agreeing == 0
    assert agreement([], 8).chance == agreement([0.3], 8).chance == 1.0


def test_the_chance_of_a_better_basin_falls_with_agreement_and_rises_with_what_is_free():
    for k in range(2, 9):
        for entries in range(4, 20):
            assert 0.0 < chance(k + 1, entries) < chance(k, entries) < 1.0
            assert chance(k, entries) <= chance(k, entries + 1)
    assert LEVELS["quick"] > LEVELS["normal"] > LEVELS["thorough"] > LEVELS["budget"] == 0.0


def test_the_chance_is_that_of_taking_another_basin_for_the_best():
    """Beginnings that end in the best basin as often as in the hardest task, simulated to the end of the search."""
    rng, best = np.random.default_rng(0), 1.0 - chance(2, 11) ** 0.5
    for agreeing in (2, 3, 4):
        wrong = sum(misses(rng, best, agreeing) for _ in range(20_000)) / 20_000
        assert wrong == pytest.approx(chance(agreeing, 11), rel=0.15)


def misses(rng, best, agreeing):
    """Whether so many beginnings end in the second best basin before any ends in the best."""
    return not (rng.random(agreeing) < best).any()


def short(effort):
    """A search with gradients, of short beginnings, at its end."""
    search = build("multibasin", budget=6_000, effort=effort, scale=300)
    run(search)
    return search


def test_it_ends_once_beginnings_agree_and_later_where_it_has_to_be_surer():
    quick, surer, never = (short(effort) for effort in ("quick", "thorough", "budget"))
    assert quick.evaluations < surer.evaluations < never.evaluations
    assert [each.ending for each in (quick, surer, never)] == ["agreement", "agreement", "budget"]
    assert quick.agreement.chance <= LEVELS["quick"]
    assert surer.agreement.agreeing > quick.agreement.agreeing
    assert quick.agreement.descents > quick.agreement.once
    assert quick.best_fitness == pytest.approx(never.best_fitness, abs=1e-3)


def test_with_more_effort_it_goes_on_where_it_had_ended():
    quick = short("quick")
    settings = {"effort": "thorough"}
    surer = algorithm_from_state(through_json(quick.state()), SPACE, settings=settings)
    assert not surer.done
    run(surer)
    assert surer.ending == "agreement"
    assert surer.agreement.beginnings > quick.agreement.beginnings
    assert algorithm_from_state(through_json(quick.state()), SPACE).done


def test_an_unknown_effort_is_refused():
    with pytest.raises(SettingsError, match="effort"):
        build("multibasin", effort="utmost")
