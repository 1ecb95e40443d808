"""The design space: which entries of the DH table are free, their bounds, and the tests of Omega_l (section 6)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from armdesign._types import Array
from armdesign.errors import DesignError, SettingsError
from armdesign.kinematics.dh import DHTable
from armdesign.settings.sections import Design

COLUMNS = ("alpha", "a", "d")
SAMPLE_BATCH, SAMPLE_BATCHES = 4096, 250


@dataclass(frozen=True)
class DesignSpace:
    """All entries of an n-joint DH table with bounds; the free ones, in order, make up Phi.

    The full vector holds (alpha, a, d) of rows 0..n, then the base yaw: 3 (n + 1) + 1 entries.

    Attributes:
        dof: Number of joints n.
        names: Name of every entry, such as ``alpha_0`` or ``d_tool``.
        lower: Lower bounds of all entries [rad, m].
        upper: Upper bounds of all entries [rad, m]; an entry with equal bounds is fixed.
        length: L_min, L_max [m].
        coaxial: Twist [rad] and link length [m] below which two consecutive joints count as on one axis.
    """

    dof: int
    names: tuple[str, ...]
    lower: Array
    upper: Array
    length: tuple[float, float]
    coaxial: tuple[float, float]

    @property
    def free(self) -> NDArray[np.bool_]:
        """Which of all entries belong to Phi."""
        return self.lower < self.upper

    @property
    def angular(self) -> NDArray[np.bool_]:
        """Which entries of Phi are angles, shape (D,)."""
        return np.array([not name.startswith(("a_", "d_")) for name in self.names])[self.free]

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper bounds of Phi, shape (D,) each [rad, m]."""
        return self.lower[self.free], self.upper[self.free]

    def full(self, Phi: ArrayLike) -> Array:
        """All entries of designs given by their free ones, shape (N, D) -> (N, 3 (n + 1) + 1)."""
        designs = np.atleast_2d(np.asarray(Phi, dtype=float))
        entries = np.tile(self.lower, (len(designs), 1))
        entries[:, self.free] = designs
        return entries

    def rows(self, Phi: ArrayLike) -> tuple[Array, Array]:
        """Designs as the evaluator takes them: rows (N, n + 1, 4) of (alpha, a, d, theta = 0) and base yaw (N,)."""
        entries = self.full(Phi)
        rows = np.zeros((len(entries), self.dof + 1, 4))
        rows[:, :, :3] = entries[:, :-1].reshape(len(entries), self.dof + 1, 3)
        return rows, entries[:, -1].copy()

    def table(self, Phi: ArrayLike) -> DHTable:
        """One design as a DH table."""
        rows, yaw = self.rows(Phi)
        return DHTable.from_rows(rows[0, :, :3], float(yaw[0]))

    def phi(self, table: DHTable) -> Array:
        """The free entries of a DH table, shape (D,).

        Raises:
            DesignError: The table has another number of joints, or differs in an entry that is fixed here.
        """
        if table.dof != self.dof:
            raise DesignError(f"the design has {table.dof} joints, the search space {self.dof}")
        entries = np.r_[np.stack([table.alpha, table.a, table.d], axis=1).ravel(), table.base_yaw]
        differing = [
            n for n, x, low, f in zip(self.names, entries, self.lower, self.free, strict=True) if not f and x != low
        ]
        if differing:
            raise DesignError(f"the design differs in entries fixed here: {', '.join(differing)}")
        chosen: Array = entries[self.free]
        return chosen

    def lengths(self, Phi: ArrayLike) -> Array:
        """Total length L = sum(a_i + d_i) of each design, shape (N,) [m]."""
        rows, _ = self.rows(Phi)
        total: Array = np.abs(rows[:, :, 1:3]).sum(axis=(1, 2))
        return total

    def admissible(self, Phi: ArrayLike) -> NDArray[np.bool_]:
        """Whether each design lies in Omega_l: bounds, L_min < L < L_max, no two consecutive joints on one axis."""
        designs = np.atleast_2d(np.asarray(Phi, dtype=float))
        lower, upper = self.bounds
        rows, _ = self.rows(designs)
        length = np.abs(rows[:, :, 1:3]).sum(axis=(1, 2))
        # section 6: two consecutive joints on one axis, |alpha_i| < 1 deg and a_i < 1 mm, i >= 1
        coaxial = (np.abs(rows[:, 1:-1, 0]) < self.coaxial[0]) & (np.abs(rows[:, 1:-1, 1]) < self.coaxial[1])
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

    def check_not_empty(self) -> None:
        """Refuse a space without an arm in it, before a search begins.

        Raises:
            SettingsError: Bounds and length limits leave (next to) nothing.
        """
        lower, upper = self.bounds
        shortest, longest = (float(self.lengths(corner)[0]) for corner in (lower, upper))
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
        lengths = ~self.angular
        room = self.length[1] - float(self.lengths(lower)[0])
        widths = (upper - lower)[lengths]
        k = int(lengths.sum())
        designs = lower + unit * (upper - lower)
        log_simplex = k * np.log(max(room, 1e-300)) - sum(np.log(np.arange(1, k + 1)))  # volume room^k / k!
        if k and log_simplex < np.log(widths).sum():
            spacings = rng.standard_exponential((SAMPLE_BATCH, k + 1))  # ~ uniform in the simplex once normalised
            designs[:, lengths] = lower[lengths] + room * spacings[:, :k] / spacings.sum(axis=1, keepdims=True)
        return designs


def design_space(settings: Design) -> DesignSpace:
    """The design space of the settings: the default freedom of method section 2, single bounds over it.

    Raises:
        SettingsError: An entry in ``bounds`` does not exist, or nothing is free.
    """
    n = settings.dof
    labels = [*map(str, range(n)), "tool"]
    names = (*(f"{column}_{label}" for label in labels for column in COLUMNS), "base_yaw")
    limits = {name: (0.0, 0.0) for name in names}
    for label in labels:
        limits[f"alpha_{label}"] = settings.alpha
    for label in labels[1:-1]:
        limits[f"a_{label}"], limits[f"d_{label}"] = settings.a, settings.d
    limits["d_tool"] = (settings.tool_length, settings.tool_length)
    limits["base_yaw"] = settings.base_yaw
    for name, pair in settings.bounds.items():
        if name not in limits:
            raise SettingsError(f"unknown entry 'design.bounds.{name}'", value=name, allowed=list(names))
        if name.startswith(("a_", "d_")) and pair[0] < 0.0:
            raise SettingsError(
                f"setting 'design.bounds.{name}' is {list(pair)}", value=pair, allowed="lengths from 0 up",
                fix="A negative length is the same arm with its twists turned by 180 deg",
            )  # fmt: skip
        limits[name] = pair
    table = np.array([limits[name] for name in names])
    angles = np.array([not name.startswith(("a_", "d_")) for name in names])
    table[angles] = np.deg2rad(table[angles])
    if settings.length[0] >= settings.length[1]:
        raise SettingsError(
            f"setting 'design.length' is {list(settings.length)}", value=settings.length, allowed="L_min below L_max"
        )
    space = DesignSpace(
        n, names, table[:, 0], table[:, 1], settings.length,
        (float(np.deg2rad(settings.coaxial_twist)), settings.coaxial_offset),
    )  # fmt: skip
    if not space.free.any():
        raise SettingsError(
            "every entry of the design is fixed", fix="Free one in [design], or use 'armdesign evaluate'"
        )
    return space


def joint_limits(settings: Design) -> Array:
    """Joint limits of the settings, shape (n, 2) [rad].

    Raises:
        SettingsError: The number of pairs is neither one nor n.
    """
    pairs = settings.joint_limits
    if len(pairs) not in (1, settings.dof):
        raise SettingsError(
            f"setting 'design.joint_limits' has {len(pairs)} pairs for {settings.dof} joints",
            allowed=f"1 or {settings.dof} pairs",
        )
    for pair in pairs:
        if not pair[0] <= 0.0 <= pair[1] or pair[0] == pair[1]:
            raise SettingsError(
                f"setting 'design.joint_limits' has the pair {list(pair)}", value=pair,
                allowed="lower <= 0 <= upper, lower < upper, as tools that read URDF insist on",
            )  # fmt: skip
    limits: Array = np.deg2rad(np.array(pairs if len(pairs) == settings.dof else pairs * settings.dof))
    return limits
