"""Denavit-Hartenberg tables: modified (Craig) inside, classic (distal) in and out.

A table of an n-joint arm has n + 1 rows. Row i < n carries joint i + 1, row n is the fixed tool (eq. 2):

    T_i = Rx(alpha_i) Tx(a_i) Tz(d_i) Rz(theta_i + q_i),    q_n = 0,
    T_i = Rx(alpha_i) Tx(a_i) Tz(d_i + q_i) Rz(theta_i)     where joint i + 1 slides (is prismatic),
    T_base_tool = Rz(base_yaw) T_0 T_1 ... T_n.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from armdesign._types import Array
from armdesign.errors import DesignError, counted
from armdesign.kinematics.line_drawing import Line, drawing, shown


@dataclass(frozen=True, eq=False, repr=False)
class DHTable:
    """Modified DH parameters of a serial arm; two tables of the same numbers and joints are equal.

    Attributes:
        alpha: Link twists, shape (n + 1,) [rad].
        a: Link lengths along x_{i-1}, shape (n + 1,) [m].
        d: Link offsets along z_i, shape (n + 1,) [m].
        theta: Constant joint offsets, shape (n + 1,) [rad]; zeros where left out.
        base_yaw: Rotation about z before row 0 [rad].
        joints: Kind of every joint from the base on: R turns (revolute), P slides along z (prismatic); all turn where
            left out.
    """

    alpha: Array
    a: Array
    d: Array
    theta: Array = field(default_factory=lambda: np.zeros(0))
    base_yaw: float = 0.0
    joints: str = ""

    def __post_init__(self) -> None:
        """Normalise to read-only float arrays and check the shapes.

        Raises:
            DesignError: Fewer than one joint, columns of unequal length, a value that is not finite, or an unknown
                kind of joint.
        """
        if len(self.theta) == 0:
            object.__setattr__(self, "theta", np.zeros(len(self.alpha)))
        for name in ("alpha", "a", "d", "theta"):
            column = np.array(getattr(self, name), dtype=float)
            if column.ndim != 1 or len(column) != len(self.alpha):
                raise DesignError(f"DH column '{name}' has shape {column.shape}, but alpha has {len(self.alpha)} rows")
            if not np.isfinite(column).all():
                raise DesignError(f"DH column '{name}' holds a value that is not finite", value=column)
            column.setflags(write=False)
            object.__setattr__(self, name, column)
        if len(self.alpha) < 2:
            raise DesignError(f"a DH table needs a row per joint and a tool row, got {len(self.alpha)} row(s)")
        if not np.isfinite(self.base_yaw):
            raise DesignError("base_yaw is not finite", value=self.base_yaw)
        object.__setattr__(self, "joints", self.joints or "R" * self.dof)
        if len(self.joints) != self.dof or not set(self.joints) <= {"R", "P"}:
            what = f"the joints are {self.joints!r}, but the DH table has {counted(self.dof, 'joint')}"
            raise DesignError(what, value=self.joints, allowed="a letter R or P for each joint")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, DHTable):
            return NotImplemented
        return self.numbers() == other.numbers() and self.joints == other.joints

    def __hash__(self) -> int:
        return hash((self.numbers(), self.joints))

    def numbers(self) -> tuple[float, ...]:
        """All values: alpha, a, d and theta row by row, then the base yaw."""
        return (*np.stack([self.alpha, self.a, self.d, self.theta], axis=1).ravel().tolist(), float(self.base_yaw))

    def __repr__(self) -> str:
        offsets = bool(self.theta.any())
        lines = [f"arm of {counted(self.dof, 'joint')}, {self.length:.3f} m long"]
        lines.append("  row  alpha [deg]   a [mm]   d [mm]" + ("  theta [deg]" if offsets else ""))
        for i in range(self.dof + 1):
            row = f"{'tool' if i == self.dof else i:>5}  {np.degrees(self.alpha[i]):11.2f}"
            row += f"{1e3 * self.a[i]:9.1f}{1e3 * self.d[i]:9.1f}"
            slides = i < self.dof and self.prismatic[i]
            row += f"{np.degrees(self.theta[i]):13.2f}" if offsets else ""
            lines.append(row + ("  slides along z" if slides else ""))
        if self.base_yaw:
            lines.append(f"  turned by {np.degrees(self.base_yaw):.2f} deg about z at the base")
        return "\n".join(lines)

    def _repr_html_(self) -> str:
        return shown(
            repr(self), drawing([Line(self.skeleton(np.zeros((1, self.dof)))[0], name="all joints at 0", width=3.0)])
        )

    @property
    def dof(self) -> int:
        """Number of joints n."""
        return len(self.alpha) - 1

    @property
    def prismatic(self) -> tuple[bool, ...]:
        """Which joints slide, n of them."""
        return tuple(kind == "P" for kind in self.joints)

    @property
    def length(self) -> float:
        """Total length L = sum(|a_i| + |d_i|), tool included, with all joints at 0 [m]."""
        return float(np.sum(np.abs(self.a) + np.abs(self.d)))  # section 2

    def base(self) -> Array:
        """Base frame before row 0, Rz(base_yaw), shape (4, 4)."""
        return rot_z(self.base_yaw)

    def placements(self) -> Array:
        """Constant part of every row, Rx(alpha) Tx(a) Tz(d) Rz(theta), shape (n + 1, 4, 4).

        The base yaw is part of the first one, so that their product with the joint rotations is the whole arm.
        """
        rows = np.stack(
            [
                rot_x(alpha) @ translation(a, 0.0, d) @ rot_z(theta)
                for alpha, a, d, theta in zip(self.alpha, self.a, self.d, self.theta, strict=True)
            ]
        )
        rows[0] = self.base() @ rows[0]
        return rows

    def frames(self, q: ArrayLike) -> Array:
        """Frames of the joints and the tool relative to the base (eq. 2), by plain matrix products.

        Args:
            q: Joint angles, shape (n,) [rad; m of joints that slide].

        Returns:
            Homogeneous transforms, shape (n + 1, 4, 4); the last is the tool.
        """
        angles = np.asarray(q, dtype=float)
        if angles.shape != (self.dof,):
            raise DesignError(f"q has shape {angles.shape}, but the arm has {self.dof} joints")
        pose = np.eye(4)
        frames = np.empty((self.dof + 1, 4, 4))
        for i, placement in enumerate(self.placements()):
            if i == self.dof:
                motion = np.eye(4)
            else:
                motion = translation(0.0, 0.0, angles[i]) if self.joints[i] == "P" else rot_z(angles[i])
            pose = pose @ placement @ motion
            frames[i] = pose
        return frames

    def skeleton(self, q: ArrayLike) -> Array:
        """The corners of the arm, base to tool: per row a piece along x_{i-1} by a_i, then one along z_i by d_i.

        Args:
            q: Joint angles along a path, shape (T, n) [rad; m of joints that slide, whose piece along z is d_i + q_i].

        Returns:
            Shape (T, 2 n + 3, 3) [m]; pieces of no length are kept. Every second corner from the third on is a joint's
            origin, the last is the tool.
        """
        angles = np.asarray(q, dtype=float)
        pose = np.broadcast_to(self.base(), (len(angles), 4, 4))
        corners = [pose[:, :3, 3]]
        for i in range(self.dof + 1):
            pose = pose @ translation(self.a[i], 0.0, 0.0)
            corners.append(pose[:, :3, 3])
            pose = pose @ rot_x(self.alpha[i]) @ translation(0.0, 0.0, self.d[i])
            motion = angles[:, i] if i < self.dof else np.zeros(len(angles))
            if i < self.dof and self.joints[i] == "P":
                pose, motion = pose @ np.stack([translation(0.0, 0.0, way) for way in motion]), 0.0 * motion
            corners.append(pose[:, :3, 3])
            pose = pose @ np.stack([rot_z(angle) for angle in self.theta[i] + motion])
        return np.stack(corners, axis=1)

    @classmethod
    def from_rows(cls, rows: ArrayLike, base_yaw: float = 0.0, joints: str = "") -> DHTable:
        """Build a table from rows of (alpha, a, d) or (alpha, a, d, theta).

        Args:
            rows: Shape (n + 1, 3) or (n + 1, 4) [rad, m, m(, rad)], tool row last.
            base_yaw: Rotation about z before row 0 [rad].
            joints: Kinds of the joints, such as RRPR; all turn where left out.
        """
        table = np.asarray(rows, dtype=float)
        if table.ndim != 2 or table.shape[1] not in (3, 4):
            raise DesignError(f"DH rows have shape {table.shape}", allowed="(n + 1, 3) or (n + 1, 4)")
        theta = table[:, 3] if table.shape[1] == 4 else np.zeros(len(table))
        return cls(table[:, 0], table[:, 1], table[:, 2], theta, base_yaw, joints)

    @classmethod
    def from_classic(cls, rows: ArrayLike, joints: str = "") -> DHTable:
        """Convert a classic table, A_i = Rz(theta_i + q_i) Tz(d_i) Tx(a_i) Rx(alpha_i), exactly.

        The twist and length behind joint i move to the next row, since
        Rz Tz (Tx Rx) Rz Tz (Tx Rx) = (Tz Rz) (Rx Tx Tz Rz) (Rx Tx).

        Args:
            rows: Shape (n, 3) or (n, 4): (alpha, a, d) or (alpha, a, d, theta), one row a joint [rad, m, m(, rad)].
            joints: Kinds of the joints, such as RRPR; all turn where left out.

        Returns:
            The modified table; its tool row carries the last twist and length.
        """
        table = np.asarray(rows, dtype=float)
        if table.ndim != 2 or table.shape[1] not in (3, 4) or len(table) < 1:
            raise DesignError(f"classic DH rows have shape {table.shape}", allowed="(n, 3) or (n, 4)")
        alpha, a, d = table[:, :3].T
        theta = table[:, 3] if table.shape[1] == 4 else np.zeros(len(table))
        return cls(np.r_[0.0, alpha], np.r_[0.0, a], np.r_[d, 0.0], np.r_[theta, 0.0], 0.0, joints)

    def to_classic(self) -> ClassicDH:
        """This arm in classic form; what does not fit a joint's row is kept as a base and a tool frame."""
        first = rot_x(self.alpha[0]) @ translation(self.a[0], 0.0, 0.0)
        last = translation(0.0, 0.0, self.d[-1]) @ rot_z(self.theta[-1])
        rows = np.stack([self.alpha[1:], self.a[1:], self.d[:-1], self.theta[:-1]], axis=1)
        return ClassicDH(rows=rows, base=self.base() @ first, tool=last, joints=self.joints)


@dataclass(frozen=True)
class ClassicDH:
    """Classic DH rows between two constant frames: base A_1(q_1) ... A_n(q_n) tool.

    Attributes:
        rows: (alpha, a, d, theta) per joint, shape (n, 4) [rad, m, m, rad].
        base: Constant frame before the first row, shape (4, 4).
        tool: Constant frame after the last row, shape (4, 4).
        joints: Kinds of the joints, see DHTable; of one that slides d is what changes.
    """

    rows: Array
    base: Array
    tool: Array
    joints: str = ""

    def pose(self, q: ArrayLike) -> Array:
        """Tool frame relative to the base, shape (4, 4)."""
        pose = self.base
        kinds = self.joints or "R" * len(self.rows)
        for (alpha, a, d, theta), x, kind in zip(self.rows, np.asarray(q, dtype=float), kinds, strict=True):
            turn, shift = (theta, d + x) if kind == "P" else (theta + x, d)
            pose = pose @ rot_z(turn) @ translation(a, 0.0, shift) @ rot_x(alpha)
        return pose @ self.tool


def joint_letters(prismatic: Iterable[bool]) -> str:
    """Kinds of the joints as a table has them: P for those that slide, R for those that turn."""
    return "".join("P" if slides else "R" for slides in prismatic)


def rot_x(angle: float) -> Array:
    """Homogeneous rotation about x, shape (4, 4)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[1.0, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])


def rot_z(angle: float) -> Array:
    """Homogeneous rotation about z, shape (4, 4)."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0.0, 0], [s, c, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def translation(x: float, y: float, z: float) -> Array:
    """Homogeneous translation, shape (4, 4)."""
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose
