"""The design space: which entries of the DH table are free, their bounds, and the tests of Omega_l (section 6)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import DesignError, SettingsError
from armdesign.kinematics.base_pose import MOUNTINGS, BasePose
from armdesign.kinematics.dh import DHTable, joint_letters
from armdesign.settings.place import Site
from armdesign.settings.sections import Design

COLUMNS = ("alpha", "a", "d")
PLACE = ("base_x", "base_y", "base_z")
"""Entries that say where the base stands, in the task frame [m]."""
SITE = "base_site"
"""Entry that says at which of several sites: k up to k + 1 is site k."""
SAMPLE_BATCH, SAMPLE_BATCHES = 4096, 250


@dataclass(frozen=True)
class DesignSpace:
    """All entries of an n-joint DH table with bounds; the free ones, in order, make up Phi.

    The full vector holds (alpha, a, d) of rows 0..n, then the base yaw: 3 (n + 1) + 1 entries. Where the base is to be
    placed, its position follows, and the site where there are several; the yaw then is the base's, not the table's.

    Attributes:
        dof: Number of joints n.
        names: Name of every entry, such as ``alpha_0`` or ``d_tool``.
        lower: Lower bounds of all entries [rad, m].
        upper: Upper bounds of all entries [rad, m]; an entry with equal bounds is fixed.
        length: L_min, L_max [m].
        coaxial: Twist [rad] and link length [m] below which two consecutive joints count as on one axis.
        sites: Where the base may be placed; none where it stands in the task frame's origin.
        joints: Kinds of the joints, a letter R or P for each.
        travel: Limits of joints that slide, 0 in the rows of others and of the tool, shape (n + 1, 2) [m]; None where
            none slides.
    """

    dof: int
    names: tuple[str, ...]
    lower: Array
    upper: Array
    length: tuple[float, float]
    coaxial: tuple[float, float]
    sites: tuple[Site, ...]
    joints: str
    travel: Array | None = None

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which of all entries belong to Phi."""
        return self.lower < self.upper

    @property
    def free_names(self) -> tuple[str, ...]:
        """Names of the entries of Phi, D of them."""
        return tuple(name for name, free in zip(self.names, self.free, strict=True) if free)

    @property
    def angular(self) -> NDArray[np.bool_]:
        """Which entries of Phi are angles, or no lengths at all, shape (D,)."""
        return np.array([not name.startswith(("a_", "d_", *PLACE)) for name in self.free_names], dtype=bool)

    @property
    def extending(self) -> NDArray[np.bool_]:
        """Which entries of Phi add to the arm's length L, shape (D,)."""
        return np.array([name.startswith(("a_", "d_")) for name in self.free_names], dtype=bool)

    @property
    def cells(self) -> int:
        """Number of entries of the DH table without the base yaw, 3 (n + 1)."""
        return 3 * (self.dof + 1)

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of Phi, shape (D,) each [rad, m]."""
        return self.lower[self.free], self.upper[self.free]

    def full(self, Phi: ArrayLike) -> Array:
        """All entries of designs given by their free ones, shape (N, D) -> (N, E)."""
        designs = np.atleast_2d(np.asarray(Phi, dtype=float))
        entries = np.tile(self.lower, (len(designs), 1))
        entries[:, self.free] = designs
        return entries

    def rows(self, Phi: ArrayLike) -> tuple[Array, Array]:
        """Designs as the evaluator takes them: rows (N, n + 1, 4) of (alpha, a, d, theta = 0) and base yaw (N,).

        Of an arm whose base is placed, the yaw is part of that, see ``bases``, and 0 here.
        """
        entries = self.full(Phi)
        rows = np.zeros((len(entries), self.dof + 1, 4))
        rows[:, :, :3] = entries[:, : self.cells].reshape(len(entries), self.dof + 1, 3)
        return rows, np.zeros(len(entries)) if self.sites else entries[:, self.cells].copy()

    def bases(self, Phi: ArrayLike) -> Array:
        """Base poses in the task frame, shape (N, 12): axes x, y, z, then the origin; see BasePose.columns."""
        designs = np.atleast_2d(np.asarray(Phi, dtype=float))
        if not self.sites:
            return np.tile(BasePose().columns, (len(designs), 1))
        site, standing = self.standing(designs)
        mountings = [MOUNTINGS[each.mounted] for each in self.sites]
        return turned_bases(standing[:, 0], standing[:, 1:], np.array(mountings)[site])

    def first_frames(self, Phi: ArrayLike) -> Array:
        """Poses of the frame before row 0 in the task frame, shape (N, 12): bases, turned by a table's base yaw."""
        if self.sites:
            return self.bases(Phi)
        _, yaw = self.rows(Phi)
        return turned_bases(yaw, np.zeros((len(yaw), 3)), np.broadcast_to(np.eye(3), (len(yaw), 3, 3)))

    def base_pose(self, Phi: ArrayLike) -> BasePose:
        """The base pose of one design in the task frame, to the last bit that of ``bases``."""
        columns = self.bases(Phi)[0]
        mounted = self.sites[int(self.standing(Phi)[0][0])].mounted if self.sites else "floor"
        return BasePose(columns[9:].copy(), columns[:9].reshape(3, 3).T.copy(), mounted)

    def standing(self, Phi: ArrayLike) -> tuple[NDArray[np.intp], Array]:
        """Site of each design, shape (N,), and its base's yaw, x, y, z in that site's box, shape (N, 4) [rad, m]."""
        place = self.full(Phi)[:, self.cells :]
        last = len(self.sites) - 1
        site = np.clip(np.floor(place[:, 4]).astype(np.intp), 0, last) if last else np.zeros(len(place), dtype=np.intp)
        return site, np.clip(place[:, :4], self._boxes[site, :, 0], self._boxes[site, :, 1])

    def moving(self, Phi: ArrayLike) -> Array:
        """1 for the entries whose change changes the arm or its base, 0 for others, shape (N, E).

        The base does not follow an entry beyond the box of its site, nor a change within the same site's number.
        """
        entries = self.full(Phi)
        site, _ = self.standing(Phi)
        place, box = entries[:, self.cells : self.cells + 4], self._boxes[site]
        moves = np.ones(entries.shape)
        moves[:, self.cells : self.cells + 4] = (place >= box[:, :, 0]) & (place <= box[:, :, 1])
        moves[:, self.cells + 4 :] = 0.0
        return moves

    @cached_property
    def _boxes(self) -> Array:
        """Bounds of yaw, x, y, z by site, shape (S, 4, 2)."""
        return np.array([[site.yaw, site.x, site.y, site.z] for site in self.sites])

    def table(self, Phi: ArrayLike) -> DHTable:
        """One design as a DH table."""
        rows, yaw = self.rows(Phi)
        return DHTable.from_rows(rows[0, :, :3], float(yaw[0]), self.joints)

    def place_entries(self, table: DHTable, base: BasePose | None = None) -> Array:
        """The entries behind those of the table's rows: base yaw, and where the base is to be placed the rest.

        Args:
            table: The arm.
            base: Where it stands in the task frame; by default at the lower bounds.
        """
        if not self.sites:
            return np.array([table.base_yaw])
        entries = self.lower[self.cells :].copy()
        if base is None:
            return entries
        misses = []
        for site, box in zip(self.sites, self._boxes, strict=True):
            turn = base.rotation @ MOUNTINGS[site.mounted].T
            yaw = math.atan2(turn[1, 0], turn[0, 0])
            yaw += 2.0 * np.pi * math.ceil((site.yaw[0] - yaw) / (2.0 * np.pi) - 1e-9)  # the first turn in its range
            at = np.r_[yaw, base.translation]
            wrong = 0.0 if site.mounted == base.mounted else np.inf
            misses.append((float(np.abs(at - np.clip(at, *box.T)).max()) + wrong, at))
        k = int(np.argmin([miss for miss, _ in misses]))
        entries[:4] = np.clip(misses[k][1], *self._boxes[k].T)
        entries[4:] = k + 0.5
        return entries

    def phi(self, table: DHTable, base: BasePose | None = None) -> Array:
        """The free entries of an arm, shape (D,).

        Args:
            table: Its DH table.
            base: Where it stands in the task frame, where the base is to be placed; by default at the lower bounds.

        Raises:
            DesignError: The table has another number of joints, or differs in an entry that is fixed here.
        """
        if table.dof != self.dof:
            raise DesignError(f"the design has {table.dof} joints, the search space {self.dof}")
        entries = np.r_[np.stack([table.alpha, table.a, table.d], axis=1).ravel(), self.place_entries(table, base)]
        differing = [
            n for n, x, low, f in zip(self.names, entries, self.lower, self.free, strict=True) if not f and x != low
        ]
        if differing:
            raise DesignError(f"the design differs in entries fixed here: {', '.join(differing)}")
        chosen: Array = entries[self.free]
        return chosen

    def lengths(self, Phi: ArrayLike) -> Array:
        """Total length L = sum(|a_i| + |d_i|) of each design, joints that slide fully extended, shape (N,) [m]."""
        rows, _ = self.rows(Phi)
        total: Array = self._pieces(rows).sum(axis=(1, 2))
        return total

    def _pieces(self, rows: Array) -> Array:
        """Lengths |a_i|, |d_i| of the pieces of designs, fully extended, shape (N, n + 1, 2) [m]."""
        pieces: Array = np.abs(rows[:, :, 1:3])
        if self.travel is not None:
            pieces[:, :, 1] = np.abs(rows[:, :, 2, None] + self.travel).max(axis=2)
        return pieces

    def shell(self, rows: Array) -> tuple[Array, Array]:
        """Inner and outer radius of the shell about the base that arms can span, shape (N,) each [m].

        A row's piece has the length sqrt(a^2 + d^2), since a and d stand at right angles; the pieces stretched out
        give the outer radius, the longest against all others the inner one.

        Args:
            rows: DH rows, shape (N, n + 1, 4).
        """
        longest = shortest = np.hypot(rows[:, :, 1], rows[:, :, 2])
        if self.travel is not None:
            pieces = self._pieces(rows)
            longest = np.hypot(pieces[:, :, 0], pieces[:, :, 1])
            ends = rows[:, :, 2, None] + self.travel
            nearest = np.clip(0.0, ends.min(axis=2), ends.max(axis=2))
            shortest = np.hypot(rows[:, :, 1], nearest)
        outer = longest.sum(axis=1)
        return (shortest + longest).max(axis=1) - outer, outer

    def admissible(self, Phi: ArrayLike) -> NDArray[np.bool_]:
        """Whether each design lies in Omega_l: bounds, L_min < L < L_max, no two consecutive joints on one axis."""
        designs = np.atleast_2d(np.asarray(Phi, dtype=float))
        lower, upper = self.bounds
        rows, _ = self.rows(designs)
        length = self._pieces(rows).sum(axis=(1, 2))
        # section 6: two consecutive joints on one axis, |alpha_i| < 1 deg and a_i < 1 mm, i >= 1
        coaxial = (np.abs(rows[:, 1:-1, 0]) < self.coaxial[0]) & (np.abs(rows[:, 1:-1, 1]) < self.coaxial[1])
        for i in range(1, self.dof if "P" in self.joints else 0):  # a turn and a slide are two motions on one axis
            before, behind = self.joints[i - 1], self.joints[i]
            coaxial[:, i - 1] &= before == behind
            if before == behind == "P":  # parallel slides are one, however far apart
                coaxial[:, i - 1] = np.abs(rows[:, i, 0]) < self.coaxial[0]
        inside = ((designs >= lower) & (designs <= upper)).all(axis=1)
        verdict: NDArray[np.bool_] = (
            inside & (length > self.length[0]) & (length < self.length[1]) & ~coaxial.any(axis=1)
        )
        return verdict

    def sample(self, rng: np.random.Generator, count: int) -> Array:
        """Draw designs uniformly from Omega_l by rejection.

        Lengths are proposed uniformly in the simplex below L_max where that is smaller than the box, which keeps the
        acceptance high for arms of many joints.

        Args:
            rng: Source of randomness.
            count: Number of designs N.

        Returns:
            Shape (N, D).

        Raises:
            SettingsError: Bounds and length limits leave (next to) nothing.
        """
        found: list[Array] = []
        missing = count
        for _ in range(SAMPLE_BATCHES):
            batch = self._propose(rng)
            batch = batch[self.admissible(batch)][:missing]
            found.append(batch)
            missing -= len(batch)
            if missing == 0:
                return np.concatenate(found)
        raise SettingsError(
            f"no arm within the bounds has a length between {self.length[0]:g} and {self.length[1]:g} m "
            "and no two joints on one axis",
            fix="Widen design.length or the bounds of a, d and alpha",
        )

    @property
    def shortest_at(self) -> Array:
        """Where each entry of Phi adds least to L, from which that grows in proportion either way, shape (D,) [m]."""
        centre = np.zeros(len(self.names))
        if self.travel is not None:
            centre[2 : self.cells : 3] = -self.travel.mean(axis=1)
        return centre[self.free]

    @property
    def reachable_lengths(self) -> tuple[float, float]:
        """The shortest and the longest total length L that the bounds of a and d allow [m]."""
        lower, upper = self.bounds
        centre = self.shortest_at
        nearest, farthest = np.clip(centre, lower, upper), np.where(centre - lower > upper - centre, lower, upper)
        return float(self.lengths(nearest)[0]), float(self.lengths(farthest)[0])

    def check_not_empty(self) -> None:
        """Refuse a space without an arm in it, before a search begins.

        Raises:
            SettingsError: Bounds and length limits leave (next to) nothing.
        """
        shortest, longest = self.reachable_lengths
        if not (shortest < self.length[1] and longest > self.length[0]):
            raise SettingsError(
                f"the bounds of a and d make arms of {shortest:g} to {longest:g} m, but design.length asks for "
                f"{self.length[0]:g} to {self.length[1]:g} m",
                fix="Widen one of them",
            )
        self.sample(np.random.default_rng(0), 1)

    def _propose(self, rng: np.random.Generator) -> Array:
        """Uniform designs in the box, or with the lengths in the simplex below L_max."""
        lower, upper = self.bounds
        unit = rng.random((SAMPLE_BATCH, len(lower)))
        lengths = self.extending
        room = self.length[1] - self.reachable_lengths[0]
        low, high, centre = lower[lengths], upper[lengths], self.shortest_at[lengths]
        k = int(lengths.sum())
        designs = lower + unit * (upper - lower)
        both = (low < centre) & (high > centre)
        # volume 2^s room^k / k!, s the number of entries of either sign
        log_simplex = k * np.log(max(room, 1e-300)) - sum(np.log(np.arange(1, k + 1))) + both.sum() * np.log(2.0)
        if k and log_simplex < np.log(high - low).sum():
            spacings = rng.standard_exponential((SAMPLE_BATCH, k + 1))  # ~ uniform in the simplex once normalised
            sizes = room * spacings[:, :k] / spacings.sum(axis=1, keepdims=True)
            if (low < centre).any():
                signs = np.where(both, rng.choice([-1.0, 1.0], (SAMPLE_BATCH, k)), np.where(high <= centre, -1.0, 1.0))
                designs[:, lengths] = np.clip(centre, low, high) + signs * sizes
            else:
                designs[:, lengths] = low + sizes
        return designs


def turned_bases(yaw: Array, origins: Array, mountings: Array) -> Array:
    """Bases mounted somehow, turned about the vertical, as columns (N, 12), see BasePose.columns.

    Args:
        yaw: Turns, shape (N,) [rad].
        origins: Positions, shape (N, 3) [m].
        mountings: Axes at no yaw, shape (N, 3, 3).
    """
    # one by one: the last bit of NumPy's cosine may hang on its neighbours
    cos, sin = (np.array([turn(x) for x in yaw.tolist()])[:, None] for turn in (math.cos, math.sin))
    x, y, z = mountings[:, 0], mountings[:, 1], mountings[:, 2]
    rotations = np.stack([cos * x - sin * y, sin * x + cos * y, z], axis=1)
    return np.concatenate([rotations.transpose(0, 2, 1).reshape(len(yaw), 9), origins], axis=1)


def design_space(settings: Design, sites: Sequence[Site] = ()) -> DesignSpace:
    """The design space of the settings: the default freedom of method section 2, single bounds over it.

    Args:
        settings: Freedom and limits of the arm.
        sites: Where the base may be placed; none where it stands in the task frame's origin. A placed arm may begin
            with an offset d_0.

    Raises:
        SettingsError: An entry in ``bounds`` does not exist, or nothing is free.
    """
    n = settings.dof
    labels = [*map(str, range(n)), "tool"]
    names = [*(f"{column}_{label}" for label in labels for column in COLUMNS), "base_yaw"]
    limits = {name: (0.0, 0.0) for name in names}
    for label in labels:
        limits[f"alpha_{label}"] = settings.alpha
    for label in labels[1:-1]:
        limits[f"a_{label}"], limits[f"d_{label}"] = settings.a, settings.d
    limits["d_tool"] = (settings.tool_length, settings.tool_length)
    limits["base_yaw"] = settings.base_yaw
    if sites:
        limits["d_0"] = (min(0.0, settings.d[0]), max(0.0, settings.d[1]))
    for name, pair in settings.bounds.items():
        if name not in limits:
            raise SettingsError(f"unknown entry 'design.bounds.{name}'", value=name, allowed=list(names))
        if sites and name == "base_yaw":
            raise SettingsError(
                "the base has a place, but 'design.bounds' has its yaw", value=name,
                fix="Give the yaw with the place, as in cell.place = ['x=0..1 y=0 yaw=-90..90']",
            )  # fmt: skip
        limits[name] = pair
    table = np.array([limits[name] for name in names])
    angles = np.array([not name.startswith(("a_", "d_")) for name in names])
    table[angles] = np.deg2rad(table[angles])
    if sites:
        ranges = np.array([(site.yaw, site.x, site.y, site.z) for site in sites])
        hull = np.stack([ranges[:, :, 0].min(axis=0), ranges[:, :, 1].max(axis=0)], axis=1)
        table = np.vstack([table[:-1], hull])
        names += PLACE
        if len(sites) > 1:
            table, names = np.vstack([table, (0.0, len(sites))]), [*names, SITE]
    if settings.length[0] >= settings.length[1]:
        raise SettingsError(
            f"setting 'design.length' is {list(settings.length)}", value=settings.length, allowed="L_min below L_max"
        )
    travel = None
    if any(settings.prismatic):
        travel = np.vstack([joint_limits(settings), (0.0, 0.0)])
        travel[~np.array([*settings.prismatic, False])] = 0.0
    space = DesignSpace(
        n, tuple(names), table[:, 0], table[:, 1], settings.length,
        (float(np.deg2rad(settings.coaxial_twist)), settings.coaxial_offset), tuple(sites),
        joint_letters(settings.prismatic), travel,
    )  # fmt: skip
    if not space.free.any():
        raise SettingsError(
            "every entry of the design is fixed", fix="Free one in [design], or use 'armdesign evaluate'"
        )
    return space


def joint_limits(settings: Design) -> Array:
    """Joint limits of the settings, shape (n, 2) [rad; m of joints that slide].

    Raises:
        SettingsError: The number of pairs is neither one nor n.
    """
    pairs = settings.joint_limits
    if len(pairs) not in (1, settings.dof):
        raise SettingsError(
            f"setting 'design.joint_limits' has {len(pairs)} pairs for {settings.dof} joints",
            allowed=f"1 or {settings.dof} pairs",
        )
    sliding = np.array(settings.prismatic)
    for pair in [*pairs, *([settings.travel] if sliding.any() else [])]:
        if not pair[0] <= 0.0 <= pair[1] or pair[0] == pair[1]:
            raise SettingsError(
                f"setting 'design.{'travel' if pair is settings.travel else 'joint_limits'}' has the pair {list(pair)}",
                value=pair,
                allowed="lower <= 0 <= upper, lower < upper, as tools that read URDF insist on",
            )  # fmt: skip
    each = len(pairs) == settings.dof and settings.dof > 1
    table = np.array(pairs if len(pairs) == settings.dof else pairs * settings.dof)
    limits: Array = np.deg2rad(table)
    limits[sliding] = table[sliding] if each else settings.travel
    return limits
