"""Obstacles as a run folder keeps them: one JSON file that needs none of the files they came from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from armdesign.cell.obstacles import Box, Cylinder, Mesh, Obstacle, Obstacles, Plane, Shape, Sphere
from armdesign.errors import RunFolderError
from armdesign.files import read_json

SCHEMA_VERSION = 1


def obstacles_json(obstacles: Obstacles) -> str:
    """Obstacles as JSON: room coordinates, metres; of a moving one a pose for every frame."""
    entries = [
        {
            "name": one.name,
            "shape": type(one.shape).__name__.lower(),
            **shape_content(one.shape),
            "pose": one.pose.tolist(),
            "carried_by": one.carried_by,
            "source": one.source,
        }
        for one in obstacles.each
    ]
    return json.dumps({"schema_version": SCHEMA_VERSION, "obstacles": entries}, allow_nan=False) + "\n"


def shape_content(shape: Shape) -> dict[str, Any]:
    """The sizes of a shape [m]."""
    match shape:
        case Box():
            return {"size": shape.size.tolist()}
        case Sphere():
            return {"radius": shape.radius}
        case Cylinder():
            return {"radius": shape.radius, "length": shape.length}
        case Mesh():
            return {"vertices": shape.vertices.tolist(), "faces": shape.faces.tolist()}
    return {}


def read_obstacle_record(path: Path) -> Obstacles:
    """The obstacles of a run folder.

    Args:
        path: The file.

    Raises:
        RunFolderError: It is damaged.
    """
    entries = read_json(path, "Search again").get("obstacles")
    try:
        if not isinstance(entries, list):
            raise TypeError("'obstacles' is no list")
        return Obstacles(tuple(obstacle_from(entry) for entry in entries))
    except (TypeError, ValueError, KeyError) as error:
        raise RunFolderError(f"{path} is damaged: {error}", value=str(path), fix="Search again") from error


def obstacle_from(entry: Mapping[str, Any]) -> Obstacle:
    """One obstacle out of its entry; KeyError, TypeError or ValueError where it is damaged."""
    shape: Shape
    match entry["shape"]:
        case "box":
            shape = Box(np.array(entry["size"], dtype=float).reshape(3))
        case "sphere":
            shape = Sphere(float(entry["radius"]))
        case "cylinder":
            shape = Cylinder(float(entry["radius"]), float(entry["length"]))
        case "plane":
            shape = Plane()
        case "mesh":
            faces = np.array(entry["faces"], dtype=np.int64).reshape(-1, 3)
            shape = Mesh(np.array(entry["vertices"], dtype=float).reshape(-1, 3), faces)
        case other:
            raise ValueError(f"unknown shape {other!r}")
    pose = np.array(entry["pose"], dtype=float)
    pose = pose.reshape(4, 4) if pose.ndim == 2 else pose.reshape(-1, 4, 4)
    carried = entry.get("carried_by")
    return Obstacle(str(entry["name"]), shape, pose, None if carried is None else str(carried), str(entry["source"]))
