import pytest

from armdesign.errors import SettingsError
from armdesign.experiments.sweep.sweep_plan import check_stems, units_of


def test_every_combination_is_one_unit_in_the_order_of_the_lists(ask):
    units = units_of(*ask(dof=(4, 3), seeds=(1, 0), angle_intervals=(3, 2)))
    assert [unit.name for unit in units] == [
        "packaging-pso-n4-seed1",
        "packaging-pso-n4-seed0",
        "packaging-pso-n3-seed1",
        "packaging-pso-n3-seed0",
        "packaging-rapso-n4-D3-seed1",
        "packaging-rapso-n4-D3-seed0",
        "packaging-rapso-n4-D2-seed1",
        "packaging-rapso-n4-D2-seed0",
        "packaging-rapso-n3-D3-seed1",
        "packaging-rapso-n3-D3-seed0",
        "packaging-rapso-n3-D2-seed1",
        "packaging-rapso-n3-D2-seed0",
    ]


def test_units_search_what_their_names_say(ask):
    for unit in units_of(*ask(dof=(3, 4), angle_intervals=(2, 5))):
        search, design = unit.problem.settings.search, unit.problem.settings.design
        interval = "" if search.algorithm == "pso" else f"-D{search.angle_interval}"
        assert unit.name == f"packaging-{search.algorithm}-n{design.dof}{interval}-seed{search.seed}"
        assert unit.angle_interval == (None if search.algorithm == "pso" else search.angle_interval)
        assert search.particles == 8
        assert unit.problem.path_problem.dof == design.dof


def test_settings_that_hang_on_the_joints_are_those_of_a_single_search(ask):
    asked, tasks = ask(dof=(3, 6))
    by_dof = {unit.problem.settings.design.dof: unit.problem.settings.solver for unit in units_of(asked, tasks)}
    assert by_dof == {n: tasks[asked.recordings[0], n].settings.solver for n in (3, 6)}


@pytest.mark.parametrize(
    ("lists", "message"),
    [
        ({"algorithms": ("pso", "cma")}, "'search.algorithm' is 'cma'; allowed: rapso, pso"),
        ({"angle_intervals": (0,)}, "'search.angle_interval' is 0"),
        ({"seeds": (2**63,)}, "'search.seed' is"),
        ({"seeds": tuple(range(60_000))}, "the sweep has 120000 runs; allowed: up to 100000"),
        ({"changes": {"design": {"length": [1.0, 1.0]}}}, "L_min below L_max"),
    ],
)
def test_what_no_search_takes_is_refused_before_any_has_begun(ask, lists, message):
    with pytest.raises(SettingsError, match=message):
        units_of(*ask(**lists))


def test_recordings_of_one_name_are_refused():
    check_stems(["a/task.csv", "b/other.csv"])
    with pytest.raises(SettingsError, match=r"a/task.csv and b/TASK.csv have one name.*Rename one"):
        check_stems(["a/task.csv", "b/TASK.csv"])
