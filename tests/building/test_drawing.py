"""Drawings: what is projected where, labels that keep apart, numbers that are the design's, files that read."""

import re
import xml.etree.ElementTree as ET
from itertools import combinations
from types import SimpleNamespace

import numpy as np
import pytest

from armdesign.bodies.arm_body import arm_body
from armdesign.building.arm_drawing import Pose, arm_drawing, arm_sheet, arm_views, arranged
from armdesign.building.brackets import corner
from armdesign.building.labels import Labels, crossing
from armdesign.building.part_dimensions import outward
from armdesign.building.part_drawing import draw_scribes
from armdesign.building.projection import (
    FRONT,
    SIDE,
    TOP,
    VIEWS,
    View,
    least_shortened,
    round_solid,
    silhouette,
    slanted,
)
from armdesign.building.sheet import A3, PENS, Box, Sheet, Words, number, svg_of, text_width
from armdesign.building.sheet_figure import figure_of, pdf_of
from armdesign.building.shop import ALUMINIUM, Shop
from armdesign.kinematics.dh import DHTable
from armdesign.settings.sections import Body

SVG = "{http://www.w3.org/2000/svg}"


def some_pose(rng, dof, joints=""):
    rows = rng.uniform([-np.pi, 0.0, -0.1], [np.pi, 0.4, 0.4], (dof + 1, 3))
    rows[:, 1:] *= rng.random((dof + 1, 2)) < 0.7
    rows[-1, 2] = 0.1
    table = DHTable.from_rows(rows, joints=joints)
    return Pose(arm_body(table, Body()), rng.uniform(-0.2 if joints else -3.0, 0.2 if joints else 3.0, dof), np.eye(3))


def value_of(text):
    return float(text.replace("−", "-").rstrip("°"))


@pytest.mark.parametrize("dof", range(2, 9))
def test_labels_keep_apart_on_paper_and_lines_off_them(dof):
    rng = np.random.default_rng(dof)
    for _ in range(4):  # 28 arms in all
        pose = some_pose(rng, dof)
        views = arm_views(pose, 1.0 / float(rng.choice([4, 10, 25])))
        sheet, places = arranged(views)
        boxes = [words.box for words in sheet.words]
        assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))
        assert not any(one.overlaps(other) for one, other in combinations(places, 2))
        for view in views:
            placed = [words for words in view.words if words.cleared]
            lines = [m.points for m in view.marks if not isinstance(m, Words) and m.fill is None and m.pen == "thin"]
            for line in lines:
                hit = [w.text for w in placed if crossing(np.stack([line[:-1], line[1:]], axis=1), w.box).any()]
                assert len(hit) <= 1  # a dimension line is broken by its own number


@pytest.mark.parametrize("joints", ["RRRRR", "RPRPR"])
def test_numbers_are_those_of_the_design(joints):
    pose = some_pose(np.random.default_rng(5), 5, joints)
    table, texts = pose.table, [words.text for view in arm_views(pose, 0.1) for words in view.words]
    columns = (("a", table.a, 1e3, 0.05), ("d", table.d, 1e3, 0.05), ("α", table.alpha, 180 / np.pi, 0.005))
    for symbol, column, size, digits in columns:
        named = {re.split(r" (?=[−\d])", text)[0]: text for text in texts if text[0] == symbol}
        for i, entry in enumerate(column):
            key = f"{symbol} tool" if i == table.dof else symbol + "₀₁₂₃₄₅₆₇₈"[i]
            if key in named:
                said = value_of(named[key].removeprefix(key).removesuffix(" + q"))
                assert said == pytest.approx(size * entry, abs=1.01 * digits)
            else:
                assert entry == 0.0
                assert symbol != "α"
    for j in range(1, 6):
        assert sum(bool(re.match(rf"J{j}\b", text)) for text in texts) == len(VIEWS)


def test_a_dimension_is_as_long_as_it_says_times_the_scale():
    labels = Labels(Sheet())
    box = labels.dimension("d 60", (0.0, 0.0), (60.0, 0.0))
    line = next(m.points for m in labels.sheet.marks if not isinstance(m, Words) and np.ptp(m.points[:, 0]) > 50.0)
    assert np.linalg.norm(line[1] - line[0]) == pytest.approx(60.0)
    assert crossing(line[None], box).all()
    assert labels.dimension("a 2", (0.0, 0.0), (2.0, 0.0)).size[0] > 2.0  # too short for arrows: beside it


def test_a_length_is_seen_at_four_fifths_at_least():
    for direction in np.random.default_rng(1).normal(size=(50, 3)):
        unit = direction / np.linalg.norm(direction)
        seen = np.linalg.norm(VIEWS[least_shortened(unit)].flat(unit))
        assert seen >= np.sqrt(2.0 / 3.0) - 1e-9


def test_views_are_rotations_in_third_angle():
    for view in (*VIEWS, slanted(), slanted(-70.0, 60.0)):
        assert view.axes @ view.axes.T == pytest.approx(np.eye(2))
    point = np.array([1.0, 2.0, 3.0])
    assert FRONT.flat(point)[0] == TOP.flat(point)[0]  # one above the other
    assert FRONT.flat(point)[1] == SIDE.flat(point)[1]  # one beside the other
    assert FRONT.towards == pytest.approx([0, -1, 0])
    assert SIDE.towards == pytest.approx([1, 0, 0])  # what is on the right stands on the right


def test_silhouettes_of_a_cylinder():
    lying = round_solid(np.array([[0.0, 0, 0], [0.4, 0, 0]]), 0.05, 0, "tube")
    for view, size in ((FRONT, (0.4, 0.1)), (TOP, (0.4, 0.1)), (SIDE, (0.1, 0.1))):
        assert np.ptp(silhouette(lying, view), axis=0) == pytest.approx(size, rel=5e-3)
    assert np.linalg.norm(silhouette(lying, SIDE), axis=1) == pytest.approx(0.05)
    tilt = np.deg2rad(30.0)
    leaning = round_solid(0.4 * np.array([[0, 0, 0], [np.cos(tilt), 0, np.sin(tilt)]]), 0.05, 0, "tube")
    assert np.ptp(silhouette(leaning, SIDE)[:, 1]) == pytest.approx(0.4 * np.sin(tilt) + 0.1 * np.cos(tilt), rel=5e-3)


def test_lines_through_boxes():
    box = Box((0.0, 0.0, 2.0, 1.0))
    ends = [(-1, 0.5, 3, 0.5), (1, 2, 1, 1.1), (0.5, 0.5, 0.6, 0.6), (-1, 1.5, 1, 1.5), (-1, -1, 3, 3)]
    lines = np.reshape(ends, (-1, 2, 2))
    assert crossing(lines, box).tolist() == [True, False, True, False, True]


def test_files_are_whole_and_texts_stay_texts():
    sheet = arm_sheet(some_pose(np.random.default_rng(2), 4), 'a<b> & "c" $x$', [("material", "EN AW-6060")])
    assert sheet.size == A3
    root = ET.fromstring(svg_of(sheet))
    assert (root.get("width"), root.get("height")) == ("420mm", "297mm")
    assert [text.text for text in root.iter(f"{SVG}text")] == [words.text for words in sheet.words]
    assert 'a<b> & "c" $x$' in [words.text for words in sheet.words]
    left, bottom, right, top = sheet.extent
    assert (left, bottom, right, top) == pytest.approx((20.0, 10.0, 410.0, 287.0))
    assert len([text for text in figure_of(sheet).axes[0].texts]) == len(sheet.words)
    pdf = pdf_of([sheet, sheet])
    assert pdf[:5] == b"%PDF-"
    assert pdf == pdf_of([sheet, sheet])
    assert pdf.count(b"/Type /Page ") == 2
    assert b"/Subtype /Type0" in pdf or b"/CIDFontType2" in pdf
    assert all(words.size >= 2.2 for words in sheet.words)
    assert min(width for width, _ in PENS.values()) >= 0.25


def test_the_drawing_for_a_page_fits_it():
    for dof in (2, 8):
        sheet, cut = arm_drawing(some_pose(np.random.default_rng(dof), dof))
        for mark in sheet.marks:
            across = np.reshape(mark.box, (2, 2))[:, 0] if isinstance(mark, Words) else mark.points[:, 0]
            assert not across.min() < cut < across.max()
        left, bottom, right, top = sheet.extent
        assert left >= 0.0
        assert bottom >= 0.0
        assert right <= sheet.size[0] == 180.0
        assert top <= sheet.size[1] <= 155.0


def test_numbers_of_drawings():
    assert [number(x) for x in (100.0, -1.04, 0.04, -0.001, 12.55)] == ["100", "−1", "0", "0", "12.6"]
    assert number(2700.0, 0) == "2700"
    assert text_width("MM", 3.5) == pytest.approx(2.0 * text_width("M", 3.5))


@pytest.mark.parametrize("opening", [100.0, 130.0])
def test_a_scribe_line_on_the_far_side_of_a_corner_is_not_drawn(opening):
    turn = np.radians(opening)
    ways = np.array([1.0, 0.0, 0.0]), np.array([np.cos(turn), np.sin(turn), 0.0])
    part = corner("L1-C1", np.zeros(3), ways, 1, Shop(0.025, 0.002, ("tube", 2700.0), ALUMINIUM))[0].part
    nothing = SimpleNamespace(sheet=SimpleNamespace(line=lambda *_, **__: None), keep_clear=lambda *_: None)
    for k, way in enumerate(outward(part)):
        view = View("onto a side", (0.0, 0.0, 1.0), tuple(np.cross(way, [0.0, 0.0, 1.0])))
        ((words, place),) = draw_scribes(nothing, part, view, 1000.0)
        assert words == "S"
        assert place == pytest.approx(1000.0 * view.flat(part.scribes[k]).mean(axis=0))
