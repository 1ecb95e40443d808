"""Regions the base may stand in: what they allow, and what is wrong with them."""

import math

import numpy as np
import pytest

from armdesign.errors import SettingsError
from armdesign.settings import Cell, Settings, read_settings
from armdesign.settings.place import ANY_YAW, MOUNTINGS, NEAR_TASK, Site, near_task, sites


@pytest.mark.parametrize(
    "text",
    [
        "x=-0.2..0.6 y=0.3..0.9 z=0 yaw=-90..90",
        "yaw=-90..90,z=0, x = -0.2 .. 0.6,y=0.3..0.9",
        "x=-200mm..60cm y=0.3m..0.9m yaw=-90deg..90deg",
    ],
)
def test_a_region_however_written(text):
    (site,) = sites(Cell(place=(text,)))
    assert site.mounted == "floor"
    np.testing.assert_allclose(site.box, [[-0.2, 0.3, 0.0], [0.6, 0.9, 0.0]], atol=1e-12)
    np.testing.assert_allclose(site.yaw, [-math.pi / 2.0, math.pi / 2.0])
    assert sites(Cell(place=(str(site),))) == (site,)


def test_what_is_left_out():
    assert sites(Cell()) == ()
    assert sites(Cell(place=("x=1",))) == (Site("floor", (1.0, 1.0), (0.0, 0.0), (0.0, 0.0), ANY_YAW),)
    assert sites(Cell(base_at=(0.5, 0.0, 0.7), mounted="ceiling")) == (
        Site("ceiling", (0.5, 0.5), (0.0, 0.0), (0.7, 0.7)),
    )


def test_mountings_of_a_region_go_over_those_of_the_cell():
    cell = Cell(place=("x=1 mounted=wall", "x=2", "x=3 mounted=any"), mounted="ceiling")
    assert [(site.x[0], site.mounted) for site in sites(cell)] == [
        (1.0, "wall"), (2.0, "ceiling"), *((3.0, each) for each in MOUNTINGS),
    ]  # fmt: skip
    assert [site.mounted for site in sites(Cell(base_at=(0, 0, 0), mounted="any"))] == list(MOUNTINGS)


def test_on_the_floor_is_wherever_an_arm_comes_to_the_whole_path():
    hand = np.array([[0.0, 0.0, 0.5], [0.4, 0.1, 0.7]])
    (site,) = near_task(sites(Cell(stand="floor")), hand, 1.0)
    assert sites(Cell(stand="floor")) == (NEAR_TASK,)
    np.testing.assert_allclose(site.box, [[-0.6, -0.9, 0.0], [1.0, 1.0, 0.0]])
    (site,) = near_task((NEAR_TASK,), hand, 0.1)  # longer than any arm
    np.testing.assert_allclose(site.box, [[-0.1, -0.1, 0.0], [0.5, 0.2, 0.0]])
    placed = sites(Cell(place=("x=1",), stand="floor"))
    assert near_task(placed, hand, 1.0) == placed


@pytest.mark.parametrize(
    ("entries", "value"),
    [
        ({"place": ["x=0.6..-0.2"]}, "0.6..-0.2"),
        ({"place": ["x=1 x=2"]}, "2"),
        ({"place": ["yow=3"]}, "yow"),
        ({"place": ["x=far"]}, "far"),
        ({"place": ["x=nan"]}, "nan"),
        ({"place": ["x=1/0mm"]}, "1/0mm"),
        ({"place": ["x=1..2..3"]}, "1..2..3"),
        ({"place": ["x=0..101"]}, "0..101"),
        ({"place": ["yaw=-400..0"]}, "-400..0"),
        ({"place": ["somewhere"]}, "somewhere"),
        ({"place": ["x=1 here"]}, "x=1 here"),
        ({"place": [" , "]}, " , "),
        ({"place": ["x=1 mounted=roof"]}, "roof"),
        ({"place": ["x=1 mounted=wall"], "stand": "floor"}, "wall"),
        ({"stand": "floor", "mounted": "wall"}, "wall"),
        ({"place": ["x=1"], "stand": "wall", "mounted": "any"}, "any"),
        ({"stand": "wall"}, "wall"),
        ({"mounted": "ceiling"}, "ceiling"),
        ({"place": ["x=1"], "base_at": (1.0, 0.0, 0.0)}, (1.0, 0.0, 0.0)),
        ({"base_at": (1.0, 0.0, 101.0)}, 101.0),
    ],
)
def test_what_cannot_be(entries, value):
    with pytest.raises(SettingsError) as caught:
        Cell(**entries)
    assert caught.value.value == value
    assert "\n" not in str(caught.value)


def test_a_file_of_settings_says_the_same_and_its_obstacles_lie_beside_it(tmp_path):
    text = '[cell]\nplace = ["x=0..1 mounted=any"]\nobstacles = ["cell.toml"]\n'
    (tmp_path / "settings.toml").write_text(text)
    cell = read_settings(tmp_path / "settings.toml").cell
    assert len(sites(cell)) == 3
    assert cell.obstacles == (str(tmp_path / "cell.toml"),)
    assert Settings().replace({"cell": {"place": cell.place}}).cell.place == cell.place
