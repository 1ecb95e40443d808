"""Which links of a body touch along a motion, and how far the base plate stays clear of the rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import coal
import numpy as np
import pinocchio as pin

from armdesign._types import Array
from armdesign.export.solids import LinkBody
from armdesign.kinematics.dh import DHTable
from armdesign.kinematics.models import arm_model

Pair = tuple[int, int]
"""Two links: 0 is base_link, i is link_i."""


class CollisionScene:
    """The collision shapes of an arm in Pinocchio, with every pair of shapes of different links.

    Attributes:
        owners: The pair of links of each pair of shapes.
    """

    def __init__(self, table: DHTable, bodies: Sequence[LinkBody]) -> None:
        """Build the scene.

        Args:
            table: The arm, n joints.
            bodies: Bodies of base_link, link_1, ..., link_n.
        """
        self._model = arm_model(table)
        self._shapes = pin.GeometryModel()
        for link, body in enumerate(bodies):
            for k, part in enumerate(body.collision):
                shape = coal.Cylinder(part.radius, part.length)
                self._shapes.addGeometryObject(pin.GeometryObject(f"{link}_{k}", link, pin.SE3(part.pose), shape))
        self._shapes.addAllCollisionPairs()
        self._data, self._room = self._model.createData(), pin.GeometryData(self._shapes)
        parts = self._shapes.geometryObjects
        pairs = (
            (parts[pair.first].parentJoint, parts[pair.second].parentJoint) for pair in self._shapes.collisionPairs
        )
        self.owners: list[Pair] = [(min(pair), max(pair)) for pair in pairs]

    def touching(self, q: Array) -> dict[Pair, int]:
        """How many frames each pair of links touches in; pairs that never do are left out.

        Args:
            q: Joint angles, shape (T, n) [rad].
        """
        counts: dict[Pair, int] = {}
        for angles in q:
            pin.computeCollisions(self._model, self._data, self._shapes, self._room, angles, False)
            results = zip(self.owners, self._room.collisionResults, strict=True)
            for pair in {pair for pair, result in results if result.isCollision()}:
                counts[pair] = counts.get(pair, 0) + 1
        return counts

    def distance(self, q: Array, wanted: Callable[[Pair], bool]) -> float:
        """Least distance of any wanted pair of links over a motion, negative where they touch [m]; inf for no pair.

        Args:
            q: Joint angles, shape (T, n) [rad].
            wanted: Which pairs count.
        """
        chosen = [k for k, pair in enumerate(self.owners) if wanted(pair)]
        least = np.inf
        for angles in q:
            pin.updateGeometryPlacements(self._model, self._data, self._shapes, self._room, angles)
            for k in chosen:
                least = min(least, pin.computeDistance(self._shapes, self._room, k).min_distance)
        return float(least)
