"""Triangles into a depth buffer, and a depth buffer into a picture."""

from __future__ import annotations

import numpy as np

from armdesign.kinematics.compilation import entry


@entry
def fill(depth, chosen, corners, first):
    """Draw triangles into a depth buffer.

    Args:
        depth: Depth of what is seen in every sample, shape (H, W), written.
        chosen: Number of the triangle seen there, shape (H, W), written.
        corners: Two coordinates in samples and the depth of each corner, shape (K, 3, 3).
        first: Number of the first of them.
    """
    rows, columns = depth.shape
    for k in range(len(corners)):
        ax, ay, az = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
        bx, by, bz = corners[k, 1, 0], corners[k, 1, 1], corners[k, 1, 2]
        cx, cy, cz = corners[k, 2, 0], corners[k, 2, 1], corners[k, 2, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        for i in range(max(int(min(ay, by, cy)), 0), min(int(max(ay, by, cy)) + 1, rows)):
            y = i + 0.5
            least, most = np.inf, -np.inf  # where the row meets the sides
            for side in range(3):
                px, py = corners[k, side, 0], corners[k, side, 1]
                qx, qy = corners[k, side - 2, 0], corners[k, side - 2, 1]
                if (py - y) * (qy - y) <= 0.0 and py != qy:
                    x = px + (y - py) / (qy - py) * (qx - px)
                    least, most = min(least, x), max(most, x)
            if least > most:
                continue
            for j in range(int(max(least - 1.0, 0.0)), int(min(most + 1.0, columns - 1.0)) + 1):
                x = j + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area  # shares of the corners
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                w = 1.0 - u - v
                z = u * az + v * bz + w * cz
                if u >= 0.0 and v >= 0.0 and w >= 0.0 and z > depth[i, j]:
                    depth[i, j], chosen[i, j] = z, first + k


@entry
def shade(picture, depth, chosen, colours, edge, ink):
    """Make a picture of a depth buffer: the mean of a pixel's samples, lines where depth steps back.

    Args:
        picture: Red, green, blue, shape (H, W, 3), written.
        depth: Depth of what is seen in every sample, shape (F H, F W), -inf for nothing.
        chosen: Number of the triangle seen there, -1 for nothing.
        colours: Colours of the triangles, and in the last row of nothing, shape (K + 1, 3).
        edge: What steps back by so much from a sample to the next has a line about it.
        ink: Brightness of that line.
    """
    rows, columns = depth.shape
    finer = rows // len(picture)
    empty = np.inf  # nothing is a little further than all
    for i in range(rows):
        for j in range(columns):
            if chosen[i, j] >= 0:
                empty = min(empty, depth[i, j])
    empty = -2.0 * edge + (empty if empty < np.inf else 0.0)
    for i in range(rows):
        for j in range(columns):
            if chosen[i, j] < 0:
                depth[i, j] = empty
    picture[:] = 0.0
    for i in range(rows):
        above, below = min(i + 1, rows - 1), max(i - 1, 0)
        for j in range(columns):
            right, left = min(j + 1, columns - 1), max(j - 1, 0)
            # the smaller second difference, so that a floor seen at a flat angle has no lines
            bend = min(depth[above, j] + depth[below, j], depth[i, right] + depth[i, left]) - 2.0 * depth[i, j]
            light = (ink if bend < -edge else 1.0) / finer**2
            for k in range(3):
                picture[i // finer, j // finer, k] += colours[chosen[i, j], k] * light
