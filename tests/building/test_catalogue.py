"""Catalogues: units, sources, every fault in a sentence, and the families that come with the package."""

import math
import random
import re
from contextlib import suppress
from importlib import resources

import pytest
from typer.testing import CliRunner

from armdesign.building.catalogue import FIGURES, examine, find_catalogue, shipped
from armdesign.building.tubes import find_stock
from armdesign.cli import app
from armdesign.errors import CatalogueError

HEAD = """
family = "mine"
maker = "Somebody"
units = { torque = "N m", speed = "rpm", mass = "g", length = "mm" }
[[source]]
document = "data sheet"
date = "2026-03"
figures = ["rated_torque", "peak_torque", "no_load_speed", "mass", "diameter", "length", "width", "height", "depth"]
"""
ONE = """
[[actuator]]
name = "A1"
rated_torque = 1.0
peak_torque = 3.0
no_load_speed = 60.0
mass = 100.0
diameter = 40.0
length = 30.0
"""


BOXED = 'width = 30.0\nheight = 40.0\ndepth = 20.0\naxis = "depth"\n'


@pytest.fixture
def faults(tmp_path):
    """The faults of a catalogue with other text in it."""

    def find(text, old="", new=""):
        assert old in text
        file = tmp_path / "mine.toml"
        file.write_text(text.replace(old, new, 1))
        return examine(file)[1]

    return find


def test_units_become_si(tmp_path):
    file = tmp_path / "mine.toml"
    file.write_text(HEAD.replace('"N m"', '"kgf cm"') + ONE)
    actuator = examine(file)[0].actuators[0]
    assert actuator.peak_torque == pytest.approx(3.0 * 0.0980665)
    assert actuator.no_load_speed == pytest.approx(2.0 * math.pi)
    assert (actuator.mass, actuator.diameter, actuator.length) == pytest.approx((0.1, 0.04, 0.03))


def test_box_becomes_the_cylinder_about_it(tmp_path):
    box = 'width = 30.0\nheight = 40.0\ndepth = 20.0\naxis = "depth"'
    file = tmp_path / "mine.toml"
    file.write_text(HEAD + ONE.replace("diameter = 40.0\nlength = 30.0", box))
    actuator = examine(file)[0].actuators[0]
    assert (actuator.diameter, actuator.length) == pytest.approx((0.05, 0.02))


def test_box_is_in_the_cylinder_that_its_long_end_sweeps(tmp_path):
    text = HEAD.replace('"depth"]', '"depth", "axis_from_end", "horn", "side_holes"]') + ONE
    holes = 'side_holes = { along = [4.0], across = [5.0, 20.0], thread = "M2", depth = 3.0 }'
    file = tmp_path / "mine.toml"
    file.write_text(text.replace("diameter = 40.0\nlength = 30.0", f"{BOXED}axis_from_end = 10.0\nhorn = 2.0\n{holes}"))
    actuator = examine(file)[0].actuators[0]
    assert (actuator.diameter, actuator.length) == pytest.approx((2.0 * math.hypot(0.03, 0.015), 0.022))
    assert actuator.box == pytest.approx((0.01, 0.03, 0.03))
    assert actuator.volume == pytest.approx(0.03 * 0.04 * 0.02)
    assert (actuator.side_holes["across"], actuator.side_holes["depth"]) == (pytest.approx([0.005, 0.02]), 0.003)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("peak_torque = 3.0", "peak_torque = 30.0", ("kgf cm", "looks as if")),
        ("mass = 100.0", "mass = 0.1", ("looks as if", "its mass were not in g")),
        ("diameter = 40.0\nlength = 30.0", "diameter = 0.04\nlength = 0.03", ("its size not in mm",)),
        ("no_load_speed = 60.0", "no_load_speed = 6000.0", ("before the gear",)),
        ("mass = 100.0\n", "", ("'mass' is missing",)),
        ("mass = 100.0", "mas = 100.0", ("unknown figure 'mas'",)),
        ("rated_torque = 1.0\n", "", ("'rated_torque' is missing", "rated_share")),
        ("length = 30.0\n", "", ("housing is missing",)),
        ("length = 30.0", "length = -30.0", ("'length' is -30.0", "above 0")),
        ("mass = 100.0", "mass = 100.0\nprice = 3.0", ("'price' has no source",)),
        ('torque = "N m"', 'torque = "kg cm"', ("'units.torque' is 'kg cm'", "kgf cm")),
        ("rated_torque = 1.0", "rated_torque = 4.0", ("above its peak",)),
        ('maker = "Somebody"\n', "", ("'maker' is missing",)),
        ('date = "2026-03"\n', "", ("[[source]]",)),
        ("mass = 100.0", "mass = 100.0\noutput_screws = 4", ("output has only output_screws", "_thread")),
        ("mass = 100.0", 'mass = 100.0\nhousing_thread = "M7"', ("'housing_thread' is 'M7'", "M2.5")),
        ("mass = 100.0", "mass = 100.0\nhorn = 2.0", ("'horn' is of a housing that is a box", "'horn' has no source")),
        ("diameter = 40.0\nlength = 30.0", f"{BOXED}axis_from_end = 21.0", ("at most 20", "the near end")),
        ("diameter = 40.0\nlength = 30.0", f"{BOXED}horn = 2.0", ("'horn' needs 'axis_from_end'",)),
        ("mass = 100.0", "mass = 100.0\nback_holes = { across = [3.0] }", ("'back_holes' is", "'beside'", "M2.5")),
        ("mass = 100.0", "mass = 100.0\nside_holes = { along = [3.0] }", ("'side_holes' is", "'across'", "M2.5")),
        ("[[source]]", "position = { range = 360.0 }\n[[source]]", ("'position' is", "middle = 180.0")),
    ],
)
def test_every_fault_has_its_sentence(faults, old, new, words):
    found = faults(HEAD + ONE, old, new)
    assert found
    assert all(word in " ".join(found) for word in words)


def test_several_faults_are_all_found(faults):
    found = faults(HEAD + ONE + ONE.replace("mass = 100.0", "mass = -1") + ONE.replace("A1", "A2").replace("3.0", "90"))
    assert len(found) == 2
    assert "there is more than one" in faults(HEAD + ONE + ONE)[0]


@pytest.mark.parametrize("name", shipped())
def test_shipped_catalogues_are_whole(name):
    found = find_catalogue(name)
    assert found.family == name
    for figure in FIGURES:
        if f"\n{figure} = " in shipped()[name].read_text():
            assert found.source(figure) is not None
    for actuator in found.actuators:
        assert actuator.slope > 0.0


def test_three_families_have_five_sizes():
    assert sum(len(find_catalogue(name).actuators) >= 5 for name in shipped()) >= 3


def test_figures_are_those_of_the_data_sheets():
    by_name = {a.name: a for name in shipped() for a in find_catalogue(name).actuators}
    servo, drive = by_name["XM540-W270"], by_name["X8-25"]
    assert (servo.peak_torque, servo.rated_torque, servo.mass) == pytest.approx((10.6, 2.12, 0.165))
    assert (drive.rated_torque, drive.diameter, drive.price) == pytest.approx((10.0, 0.098, 470.0))
    near, far, width = servo.box
    assert (near, far, width, servo.horn) == pytest.approx((0.01375, 0.04475, 0.0335, 0.0026))
    # half the speed at half the torque of a servo; through the rated point of a drive
    assert servo.no_load_speed - servo.slope * 5.3 == pytest.approx(servo.no_load_speed / 2.0)
    assert drive.no_load_speed - drive.slope * 10.0 == pytest.approx(drive.rated_speed)


def test_unknown_family_names_those_there_are():
    with pytest.raises(CatalogueError) as error:
        find_catalogue("nobody")
    assert error.value.value == "nobody"
    assert "rmd" in error.value.allowed


def test_commands(tmp_path):
    run = CliRunner().invoke
    assert all(name in run(app, ["catalogue", "list"]).stdout for name in shipped())
    assert "X8-25" in run(app, ["catalogue", "show", "rmd"]).stdout
    good, bad = tmp_path / "good.toml", tmp_path / "bad.toml"
    good.write_text(HEAD + ONE)
    bad.write_text(HEAD + ONE.replace("mass = 100.0\n", ""))
    assert run(app, ["catalogue", "check", str(good)]).exit_code == 0
    outcome = run(app, ["catalogue", "check", str(bad)])
    assert (outcome.exit_code, "'mass' is missing" in outcome.stderr) == (2, True)


WRONG = ("0", "-1", "nan", "inf", "1e400", "9" * 400, "true", "'x'", "''", "[]", "[1]", "[{}]", "{}", "{a = 1}", "")


@pytest.mark.parametrize("name", ["dynamixel-x", "hebi", "rmd", "stock"])
def test_damaged_files_are_refused_in_words_or_read(name, tmp_path):
    """Lines of a file that is shipped go, or get a wrong value or key: nothing but a CatalogueError comes of it."""
    stock = resources.files("armdesign.building") / "stock" / "aluminium.toml"
    lines = (stock if name == "stock" else shipped()[name]).read_text().splitlines()
    rng, file = random.Random(0), tmp_path / "damaged.toml"
    for _ in range(200):
        damaged = list(lines)
        for _ in range(rng.randint(1, 3)):
            i = rng.randrange(len(damaged))
            new = [re.sub("=.*", f"= {rng.choice(WRONG)}", damaged[i])] if rng.random() < 0.6 else []
            damaged[i : i + 1] = new
        file.write_text("\n".join(damaged))
        with suppress(CatalogueError):
            find_stock(str(file)) if name == "stock" else examine(file)
