"""The example cells: the demonstrated arm moves clear of all that stands in them."""

import csv
from pathlib import Path

import numpy as np
import pytest

from armdesign.cell.obstacle_file import read_obstacles

EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize("name", ["packaging", "welding"])
def test_the_demonstrated_arm_clears_the_example_cell(name):
    with (EXAMPLES / f"{name}.csv").open(newline="") as file:
        header, *rows = csv.reader(file)
    hand = header.index("hand_x")
    points = np.array(rows, dtype=float)[:, 1 : hand + 3].reshape(len(rows), -1, 3)
    for obstacle in read_obstacles([EXAMPLES / f"{name}_cell.toml"]).each:
        clear = [obstacle.distances(points[:, i]).min() for i in range(points.shape[1])]
        assert min(clear) > 0.05, obstacle.name  # [m], more than a tube's radius
