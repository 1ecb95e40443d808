"""The skeleton is the polyline of the DH arm: along x by a, then along z by d, row by row."""

from __future__ import annotations

import numpy as np
import pytest
from kinematics_kernels import load, load_block, pose
from scipy.spatial.transform import Rotation

from armdesign.kinematics.dh import DHTable


def random_table(rng, n, zeros=0.3, joints=""):
    lengths = rng.uniform(-0.5, 0.5, (2, n + 1)) * (rng.random((2, n + 1)) >= zeros)
    lengths[1, -1] = 0.1
    return DHTable(rng.uniform(-3, 3, n + 1), *lengths, rng.uniform(-3, 3, n + 1), rng.uniform(-3, 3), joints)


def plain_vertices(table, q):
    """Walk along the arm with plain rotations; also the tool's rotation, and the joints that move each piece."""
    R, p = Rotation.from_euler("z", table.base_yaw), np.zeros(3)
    vertices, movers = [p], []
    for i, motion in enumerate([*q, 0.0]):
        slides = f"{table.joints}R"[i] == "P"
        way, angle = (motion, 0.0) if slides else (0.0, motion)
        R = R * Rotation.from_euler("x", table.alpha[i])
        for step in (np.array([table.a[i], 0, 0]), np.array([0, 0, table.d[i] + way])):
            if step.any():
                p = p + R.apply(step)
                vertices.append(p)
                movers.append(i)
        R = R * Rotation.from_euler("z", table.theta[i] + angle)
    return np.array(vertices), R.as_matrix(), movers


@pytest.fixture(scope="module", params=[*(n * "R" for n in (1, 2, 3, 5, 8, 10)), "P", "RPR", "PPRRP"])
def posed(request):
    """Random arms of n joints with their poses and records."""
    n = len(request.param)
    rng = np.random.default_rng(n)
    tables = [random_table(rng, n, joints=request.param) for _ in range(8)]
    q = rng.uniform(-4, 4, (8, n))
    block, chains = load(tables)
    pose(block, chains, q)
    return list(zip(tables, q, chains, strict=True))


def test_vertices_are_those_of_a_plain_walk(posed):
    for table, q, chain in posed:
        vertices, _, movers = plain_vertices(table, q)
        count = chain["segments"]
        assert count == len(vertices) - 1
        np.testing.assert_allclose(chain["start"][:count], vertices[:-1], atol=1e-13)
        ends = chain["start"][:count] + chain["extent"][:count, None] * chain["direction"][:count]
        np.testing.assert_allclose(ends, vertices[1:], atol=1e-13)
        assert chain["row"][:count].tolist() == movers


def test_the_tip_is_the_tool_frame(posed):
    for table, q, chain in posed:
        vertices, R, _ = plain_vertices(table, q)
        tool = table.frames(q)[-1]
        np.testing.assert_allclose(chain["tip"], vertices[-1], atol=1e-13)
        np.testing.assert_allclose(chain["tip"], tool[:3, 3], atol=1e-13)
        np.testing.assert_allclose(chain["tip_rotation"], R, atol=1e-13)
        np.testing.assert_allclose(chain["tip_rotation"], tool[:3, :3], atol=1e-13)


def test_arc_lengths_and_directions(posed):
    for table, q, chain in posed:
        vertices, _, _ = plain_vertices(table, q)
        count = chain["segments"]
        lengths = np.linalg.norm(np.diff(vertices, axis=0), axis=1)
        np.testing.assert_allclose(chain["extent"][:count], lengths, atol=1e-14)
        np.testing.assert_allclose(chain["arc"][: count + 1], np.r_[0.0, np.cumsum(lengths)], atol=1e-14)
        np.testing.assert_allclose(np.linalg.norm(chain["direction"][:count], axis=1), 1.0, atol=1e-14)
        assert (chain["extent"][:count] > 0.0).all()


def test_the_length_is_the_table_s(posed):
    for table, q, chain in posed:
        lengths = np.abs(table.a).sum() + np.abs(table.d + np.r_[np.where(table.prismatic, q, 0.0), 0.0]).sum()
        assert chain["length"] == pytest.approx(lengths, abs=1e-14)
        assert chain["arc"][chain["segments"]] == chain["length"]


def test_pieces_of_no_length_are_left_out():
    table = DHTable(np.full(4, 0.3), [0.0, 0.2, 0.0, 0.0], [0.0, 0.0, 0.3, 0.1])
    block, chains = load([table])
    pose(block, chains, [[0.1, 0.2, 0.3]])
    assert chains[0]["segments"] == 3
    assert chains[0]["extent"][:3].tolist() == [0.2, 0.3, 0.1]


def test_an_arm_may_begin_with_lengths_before_its_first_joint():
    table = DHTable([0.4, 0.3], [0.2, 0.1], [0.3, 0.1], base_yaw=0.5)
    block, chains = load([table, table])
    first = []
    for q in ([0.0, 0.0], [1.0, 2.0]):
        pose(block, chains, q)
        first.append(chains[0]["start"][:3].copy())
    np.testing.assert_array_equal(first[0], first[1])  # row 0 stands before joint 1
    np.testing.assert_allclose(first[0][1], [0.2 * np.cos(0.5), 0.2 * np.sin(0.5), 0.0], atol=1e-15)


def test_a_reused_place_forgets_the_arm_before():
    rng = np.random.default_rng(7)
    old, new, q = random_table(rng, 5, zeros=0.0), random_table(rng, 5, zeros=0.6), rng.uniform(-3, 3, (1, 5))
    block, chains = load([old])
    pose(block, chains, q)
    rows = np.stack([new.alpha, new.a, new.d, new.theta], axis=1)[None]
    load_block(chains, block.placements, rows, np.array([new.base_yaw]))
    pose(block, chains, q)
    vertices, R, _ = plain_vertices(new, q[0])
    count = chains[0]["segments"]
    np.testing.assert_allclose(chains[0]["start"][:count], vertices[:-1], atol=1e-13)
    np.testing.assert_allclose(chains[0]["tip"], vertices[-1], atol=1e-13)
    np.testing.assert_allclose(chains[0]["tip_rotation"], R, atol=1e-13)
