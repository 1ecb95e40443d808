import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from armdesign.demonstration.files.quaternions import from_matrices, product, rotation_matrices, slerp, unit_continuous


def unit(rng, count):
    values = rng.normal(size=(count, 4))
    return values / np.linalg.norm(values, axis=1, keepdims=True)


def test_rotation_matrices_agree_with_scipy():
    q = unit(np.random.default_rng(0), 200)
    np.testing.assert_allclose(rotation_matrices(q), Rotation.from_quat(q).as_matrix(), atol=1e-15)


def test_rotation_matrices_are_rotations_even_of_rounded_quaternions():
    R = rotation_matrices(np.round(unit(np.random.default_rng(1), 200), 4))
    np.testing.assert_allclose(R @ R.transpose(0, 2, 1), np.broadcast_to(np.eye(3), R.shape), atol=1e-14)
    np.testing.assert_allclose(np.linalg.det(R), 1.0, atol=1e-14)


def test_slerp_agrees_with_scipy():
    rng = np.random.default_rng(2)
    q = unit_continuous(unit(rng, 30))
    time = np.cumsum(rng.uniform(0.1, 1.0, 30))
    at = np.sort(rng.uniform(time[0], time[-1], 500))
    wanted = Slerp(time, Rotation.from_quat(q))(at).as_matrix()
    np.testing.assert_allclose(rotation_matrices(slerp(time, q, at)), wanted, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 1e-12, 1e-7, 1e-5, 0.5, 3.0])
def test_slerp_turns_at_constant_speed(angle):
    def about_z(phi):
        return np.stack([0 * phi, 0 * phi, np.sin(phi / 2), np.cos(phi / 2)], axis=1)

    s = np.linspace(0.0, 1.0, 11)
    found = slerp(np.array([0.0, 1.0]), about_z(np.array([0.0, angle])), s)
    np.testing.assert_allclose(found, about_z(s * angle), atol=1e-15)


def test_signs_become_continuous_and_rotations_stay():
    rng = np.random.default_rng(4)
    q = 1.7 * unit(rng, 100)
    q[[0, 10, 11, 12, 99]] = np.nan
    result = unit_continuous(q)
    seen = ~np.isnan(q[:, 0])
    np.testing.assert_array_equal(np.isnan(result), np.isnan(q))
    known = result[seen]
    assert (np.sum(known[1:] * known[:-1], axis=1) >= 0).all()
    np.testing.assert_allclose(np.linalg.norm(known, axis=1), 1.0, atol=1e-15)
    np.testing.assert_allclose(rotation_matrices(known), rotation_matrices(q[seen]), atol=1e-14)


def test_nothing_seen():
    assert np.isnan(unit_continuous(np.full((3, 4), np.nan))).all()


def test_products_of_quaternions_are_those_of_the_rotations():
    a, b = unit(np.random.default_rng(6), 80).reshape(2, 40, 4)
    R = rotation_matrices(product(a, b))
    np.testing.assert_allclose(R, rotation_matrices(a) @ rotation_matrices(b), atol=1e-14)


def test_quaternions_come_back_from_their_matrices():
    q = np.concatenate(
        [unit(np.random.default_rng(7), 200), np.eye(4), -np.eye(4), [[1, 1e-9, 0, 0], [0.6, 0, 0, 0.8]]]
    )
    again = from_matrices(rotation_matrices(q))
    np.testing.assert_allclose(np.abs(np.sum(q * again, axis=1)), 1.0, atol=1e-15)
    assert np.isnan(from_matrices(np.full((2, 3, 3), np.nan))).all()
