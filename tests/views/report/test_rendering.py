"""The shaded picture: what is in front hides what is behind, faces are lit by where they look, the arm is seen."""

import base64
import dataclasses
import io
import re

import numpy as np
import pytest
from matplotlib.image import imread

from armdesign.cell.obstacles import Box, Obstacle, Obstacles, Plane
from armdesign.kinematics.base_pose import placed_base
from armdesign.views.report.cell_rendering import ARM, arm_faces, cell_rendering, mount_faces
from armdesign.views.report.rendering import (
    AMBIENT,
    FINER,
    LIGHT,
    cylinder_faces,
    drawn,
    image_svg,
    painted,
    prism_faces,
    rendered,
    see_through,
    shot_of,
    together,
)

FRONT = np.eye(3)[:2]
"""A viewer on the z axis: right is x, up is y."""


def square(z, half=1.0):
    a, b, c, d = (np.array([x * half, y * half, z]) for x, y in ((-1, -1), (1, -1), (1, 1), (-1, 1)))
    return np.array([[a, b, c], [a, c, d]])


def test_what_is_in_front_hides_what_is_behind_in_either_order():
    near, far = painted(square(1.0, 0.5), "#ff0000", 1), painted(square(0.0), "#0000ff", 2)
    for faces in (together([near, far]), together([far, near])):
        drawing = drawn(faces, shot_of(faces, FRONT, 40))
        picture, marks = rendered(drawing), drawing.marks[drawing.chosen]
        assert marks.shape == (FINER * picture.shape[0], FINER * picture.shape[1])
        height, width = marks.shape
        assert marks[height // 2, width // 2] == 1
        assert marks[height // 2, width // 8] in (2, -1)
        assert (marks == 1).sum() == pytest.approx((marks != -1).sum() / 4.0, rel=0.1)
        assert picture[0, 0] == pytest.approx(np.ones(3)) or marks[0, 0] == 2  # white beside it


def test_a_face_is_lit_by_where_it_looks_whatever_the_scale():
    for size in (0.01, 1.0, 1000.0):
        faces = painted(size * square(0.0), "#ffffff")
        drawing = drawn(faces, shot_of(faces, FRONT, 20))
        picture = rendered(drawing)
        middle = picture[picture.shape[0] // 2, picture.shape[1] // 2]
        assert (drawing.chosen >= 0).mean() > 0.7
        assert middle == pytest.approx(np.full(3, AMBIENT + (1.0 - AMBIENT) * LIGHT[2]), abs=1e-12)


def test_a_cylinder_is_closed_and_encloses_its_volume():
    start, end, sides = np.array([1.0, 2.0, 3.0]), np.array([1.5, 2.5, 2.0]), 400
    faces = cylinder_faces(start, end, 0.2, sides=sides) - start
    volume = np.abs(np.sum(np.einsum("ki,ki->k", faces[:, 0], np.cross(faces[:, 1], faces[:, 2])))) / 6.0
    assert volume == pytest.approx(np.pi * 0.2**2 * np.linalg.norm(end - start), rel=1e-3)
    edges = np.round(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3), axis=1), 9)
    _, counts = np.unique(edges.reshape(len(edges), 6), axis=0, return_counts=True)
    assert (counts % 2 == 0).all()
    assert len(cylinder_faces(start, start, 0.2)) == 0


def test_the_picture_is_the_png_it_holds():
    picture = np.random.default_rng(0).random((12, 30, 3))
    svg = image_svg(picture)
    assert svg == image_svg(picture)
    assert 'viewBox="0 0 30 12"' in svg
    data = base64.b64decode(re.search(r"base64,([^\"]*)", svg).group(1))
    assert imread(io.BytesIO(data), format="png")[:, :, :3] == pytest.approx(picture, abs=0.5 / 255.0 + 1e-6)


def test_the_arm_stands_where_its_frames_are_and_is_seen(invented):
    run = invented(4)
    q, base = run.evaluation.path.q[-1], run.base_pose.matrix
    faces = together(arm_faces(run, q))
    tip = 1e3 * (base @ run.table.frames(q)[-1])[:3, 3]
    assert np.linalg.norm(faces.corners - tip, axis=2).min() < 40.0  # within its tube
    assert (faces.marks == ARM).all()
    shown = cell_rendering(run)
    assert shown.key == "rendering"
    assert f"{run.table.dof} joints" in shown.alt


def test_a_prism_is_closed_and_encloses_its_volume():
    corners = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.5, 1.5]])
    faces = prism_faces(np.stack([np.insert(corners, 2, z, axis=1) for z in (-1.0, 2.0)]))
    edges = np.array([sorted(map(tuple, edge)) for edge in faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2, 3)])
    _, counts = np.unique(edges.reshape(len(edges), 6), axis=0, return_counts=True)
    assert (counts == 2).all()


def test_a_point_is_where_a_shot_says_and_faint_bodies_let_through():
    red, blue = painted(square(0.0), "#ff0000"), painted(square(1.0, 0.5), "#0000ff")
    shot = shot_of(red, FRONT, 40)
    assert shot.at(np.zeros(3)) == pytest.approx([shot.width / 2.0, shot.height / 2.0])
    assert shot.at(np.array([1.0, 0.0, 0.0]))[0] > shot.width / 2.0
    assert shot.at(np.array([0.0, 1.0, 0.0]))[1] < shot.height / 2.0
    middle = see_through(red, [(blue, 0.6), (blue, 0.5)], shot, 1)[shot.height // 2, shot.width // 2]
    assert middle[0] == pytest.approx(0.6 * 0.5 * AMBIENT + 0.6 * 0.5 * (1.0 - AMBIENT) * LIGHT[2])
    both, after = drawn(together([red, blue]), shot), drawn(blue, shot, drawn(red, shot))
    for whole, stepwise in zip(both, after, strict=True):
        np.testing.assert_array_equal(whole, stepwise)
    assert see_through(red, [(blue, 0.65)], shot, 0) == pytest.approx(
        rendered(drawn(red, shot))
    )  # not over what has the mark 0


def test_a_line_is_about_what_is_in_front_and_not_on_a_floor_at_a_flat_angle():
    near, far = painted(square(100.0, 10.0), "#ff0000"), painted(square(0.0, 20.0), "#ff0000")
    shot = shot_of(far, FRONT, 40)
    red = rendered(drawn(together([near, far]), shot))[shot.height // 2, :, 0]
    row = np.flatnonzero(red < 0.95 * red[shot.width // 2])
    assert {abs(x - (shot.width - 1) / 2.0) for x in row.tolist()} == {7.5, 14.5}  # at the edges of either square
    turn = np.array([[1.0, 0.0, 0.0], [0.0, 0.1, np.sqrt(0.99)]])
    shot = shot_of(painted(square(0.0, 1000.0), "#ff0000"), turn, 40)
    inside = rendered(drawn(painted(square(0.0, 1000.0), "#ff0000"), shot))[1:-1, 3:-3]
    assert inside == pytest.approx(np.broadcast_to(inside[0, 0], inside.shape))


@pytest.mark.parametrize("mounted", ["wall", "ceiling", "floor"])
def test_what_a_base_is_mounted_on_is_drawn_where_nothing_else_shows_it(invented, mounted):
    run = invented()
    base = placed_base((0.4, 0.1, 0.9), 0.3, mounted)
    plane = np.eye(4)  # a half space that is the very face
    plane[:3, :3], plane[:3, 3] = base.rotation, base.translation
    far = np.eye(4)
    far[:3, 3] = 9.0, 9.0, 0.5
    box = Obstacle("far", Box(np.array([0.1, 0.1, 0.1])), far)
    for obstacles, shows in (((box,), True), ((box, Obstacle("face", Plane(), plane)), mounted != "floor")):
        first = dataclasses.replace(run.problem.first, base=base, obstacles=Obstacles(obstacles))
        placed = dataclasses.replace(run, problem=dataclasses.replace(run.problem, demonstrations=(first,)))
        found = mount_faces(placed, 0, 0)
        assert bool(found) == shows
        if shows:  # flat on the face, behind it
            depth = (found[0].corners.reshape(-1, 3) - 1e3 * base.translation) @ base.rotation[:, 2]
            assert depth.max() == pytest.approx(0.0, abs=1e-6)
            assert depth.min() < -1.0
