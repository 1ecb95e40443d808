"""The body of an arm as a line, and lines as small pictures."""

from __future__ import annotations

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.line_drawing import MOST_PLACES, SIZE, Line, drawing, shown


@pytest.fixture
def table():
    """An arm with everything: offsets, a turned base, lengths of both signs."""
    rng = np.random.default_rng(3)
    return DHTable.from_rows(rng.uniform(-1.0, 1.0, (5, 4)), base_yaw=0.4)


def test_body_is_as_long_as_the_arm_and_ends_at_the_tool(table):
    q = np.array([0.3, -1.0, 2.0, 0.1])
    body = table.skeleton(q[None])[0]
    assert body.shape == (2 * table.dof + 3, 3)
    assert np.allclose(body[0], 0.0)
    assert np.allclose(body[2::2], table.frames(q)[:, :3, 3])
    assert np.linalg.norm(np.diff(body, axis=0), axis=1).sum() == pytest.approx(table.length)


def test_tables_of_the_same_numbers_are_equal(table):
    same = DHTable(table.alpha.copy(), table.a, table.d, table.theta, table.base_yaw)
    assert (table, hash(table)) == (same, hash(same))
    for name in ("alpha", "a", "d", "theta"):
        other = {each: getattr(table, each).copy() for each in ("alpha", "a", "d", "theta")}
        other[name][1] += 1e-12
        assert DHTable(**other, base_yaw=table.base_yaw) != table
    assert table != DHTable(table.alpha, table.a, table.d, table.theta)
    assert table != "arm"


def places(svg: ET.Element) -> np.ndarray:
    """All places of a picture in pixels."""
    lines = [line.attrib["points"].split() for line in svg.iter("{http://www.w3.org/2000/svg}polyline")]
    return np.array([pair.split(",") for line in lines for pair in line], dtype=float)


def test_picture_shows_two_views_at_one_scale():
    box = np.array([[0.0, 0.0, 0.0], [0.5, 0.25, 1.0]])
    side, above = ET.fromstring(f"<p>{drawing([Line(box)])}</p>")
    assert np.ptp(places(side), axis=0) == pytest.approx([SIZE / 2, SIZE])
    assert np.ptp(places(above), axis=0) == pytest.approx([SIZE / 2, SIZE / 4])
    assert places(side)[0, 1] > places(side)[1, 1]  # up is up


def test_gaps_stay_gaps_and_long_lines_stay_small():
    path = np.tile(np.linspace(0.0, 1.0, 5000)[:, None], 3)
    path[2000:3000] = np.nan
    side, _ = ET.fromstring(f"<p>{drawing([Line(path)])}</p>")
    assert len(side.findall("{*}polyline")) == 2
    assert len(places(side)) <= MOST_PLACES + 1
    assert drawing([]) == drawing([Line(np.full((4, 3), np.nan))]) == ""


def test_names_are_escaped():
    name = '"><script>alert(1)</script>&'
    html = shown(name, drawing([Line(np.zeros((2, 3)), colour=name, name=name)]))
    assert "<script" not in html
    titles = [title.text for title in ET.fromstring(html).iter("{http://www.w3.org/2000/svg}title")]
    assert name in titles
