"""What a base stands on, cells that make no sense, and obstacles as a run folder keeps them."""

import numpy as np
import pytest
import trimesh

from armdesign.cell.obstacle_record import obstacles_json, read_obstacle_record
from armdesign.cell.obstacles import Box, Cylinder, Mesh, Obstacle, Obstacles, Plane, Sphere
from armdesign.cell.standing import check_hand, check_places, standing_surface
from armdesign.errors import ObstacleError, RunFolderError, SettingsError
from armdesign.settings.place import Site

TURN = (-np.pi, np.pi)


def at(x, y, z):
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


TABLE = Obstacle("table", Box(np.array([1.0, 1.0, 0.1])), at(0.0, 0.0, 0.5))


@pytest.mark.parametrize(
    ("stand", "site", "free", "behind"),
    [
        ("floor", Site("floor", (0.0, 1.0), (0.0, 1.0), (0.2, 0.2), TURN), (5.0, 5.0, 0.3), (0.0, 0.0, 0.1)),
        ("ceiling", Site("ceiling", (0.0, 1.0), (0.0, 1.0), (2.5, 2.5), TURN), (5.0, 5.0, 2.4), (0.0, 0.0, 2.6)),
        ("wall", Site("wall", (0.3, 0.3), (0.0, 1.0), (0.5, 1.5), (0.0, 0.0)), (0.4, 9.0, 0.0), (0.2, 0.0, 0.0)),
    ],
)
def test_a_base_stands_on_a_half_space(stand, site, free, behind):
    surface = standing_surface(stand, [site]).each[0]
    assert surface.name == stand
    assert surface.distances(np.array([free, behind])) == pytest.approx([0.1, -0.1])


def test_a_surface_that_is_not_known_is_refused():
    assert not standing_surface(None, [Site("floor", (0.0, 1.0), (0.0, 1.0), (0.0, 1.0))]).each
    for stand, *sites in (
        ("floor", Site("floor", (0.0, 1.0), (0.0, 1.0), (0.0, 0.5), TURN)),
        ("wall", Site("wall", (0.0, 0.0), (0.0, 1.0), (0.0, 0.5), TURN)),
        ("wall", Site("wall", (0.0, 0.1), (0.0, 1.0), (0.0, 0.5), (0.0, 0.0))),
        ("floor", *(Site("floor", (0.0, 1.0), (0.0, 1.0), (z, z), TURN) for z in (0.0, 0.1))),
    ):
        with pytest.raises(SettingsError, match=stand):
            standing_surface(stand, sites)


def test_a_hand_that_goes_through_an_obstacle_is_told_with_time_and_depth():
    hand, time = np.linspace([0.0, 0.0, 1.0], [0.0, 0.0, 0.52], 13), 10.0 + 0.1 * np.arange(13)
    check_hand(Obstacles((TABLE,)), hand[:10], time[:10])
    with pytest.raises(ObstacleError, match=r"'table': at 1.20 s it is 30 mm deep in it, in 1 of 13 frames"):
        check_hand(Obstacles((TABLE,)), hand, time)


def test_a_place_inside_an_obstacle_is_refused():
    on_top, inside = (Site("floor", (0.0, 0.2), (0.0, 0.2), (z, z), TURN) for z in (0.55, 0.5))
    check_places(Obstacles((TABLE,)), [on_top])
    check_places(Obstacles((TABLE,)), [Site("floor", (0.0, 2.0), (0.0, 0.2), (0.5, 0.5), TURN)])
    with pytest.raises(SettingsError, match="'table'"):
        check_places(Obstacles((TABLE,)), [inside])


def test_a_run_folder_gives_obstacles_back_to_the_last_bit(tmp_path):
    made = trimesh.creation.icosphere(1, 0.1)
    turned = np.tile(at(0.1, 0.2, 0.3), (4, 1, 1))
    turned[:, 0, 3] += 0.01 * np.arange(4)
    shapes = [
        Box(np.array([0.1, 0.2, 1 / 3])),
        Sphere(0.1),
        Cylinder(0.1, 0.7),
        Plane(),
        Mesh(made.vertices, made.faces),
    ]
    room = Obstacles((*(Obstacle(f"<{k}>", s, at(k, 0.1, 1 / 3)) for k, s in enumerate(shapes)),
                      Obstacle("moving", Sphere(0.05), turned, "tray", "cell.toml")))  # fmt: skip
    path = tmp_path / "obstacles.json"
    path.write_text(obstacles_json(room))
    again = read_obstacle_record(path)
    for before, after in zip(room.each, again.each, strict=True):
        assert (after.name, after.carried_by, after.source) == (before.name, before.carried_by, before.source)
        np.testing.assert_array_equal(after.pose, before.pose)
    for before, after in zip(room.arrays(), again.arrays(), strict=True):
        np.testing.assert_array_equal(after, before)


@pytest.mark.parametrize("text", ["{}", '{"obstacles": [{}]}', '{"obstacles": [{"name": "a", "shape": "cone"}]}', "["])
def test_a_damaged_record_is_named(tmp_path, text):
    path = tmp_path / "obstacles.json"
    path.write_text(text)
    with pytest.raises(RunFolderError, match=r"obstacles\.json"):
        read_obstacle_record(path)
