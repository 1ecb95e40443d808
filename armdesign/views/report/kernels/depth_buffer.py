"""Triangles into a depth buffer."""

from __future__ import annotations

from armdesign.kinematics.compilation import entry


@entry
def fill(depth, chosen, corners):
    """Draw triangles into a depth buffer.

    Args:
        depth: Depth of what is seen in every sample, shape (H, W), written.
        chosen: Number of the triangle seen there, shape (H, W), written.
        corners: Two coordinates in samples and the depth of each corner, shape (K, 3, 3).
    """
    rows, columns = depth.shape
    for k in range(len(corners)):
        ax, ay, az = corners[k, 0, 0], corners[k, 0, 1], corners[k, 0, 2]
        bx, by, bz = corners[k, 1, 0], corners[k, 1, 1], corners[k, 1, 2]
        cx, cy, cz = corners[k, 2, 0], corners[k, 2, 1], corners[k, 2, 2]
        area = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
        if area == 0.0:
            continue
        left, right = max(int(min(ax, bx, cx)), 0), min(int(max(ax, bx, cx)) + 1, columns)
        low, high = max(int(min(ay, by, cy)), 0), min(int(max(ay, by, cy)) + 1, rows)
        for i in range(low, high):
            y = i + 0.5
            for j in range(left, right):
                x = j + 0.5
                u = ((bx - x) * (cy - y) - (by - y) * (cx - x)) / area  # shares of the corners
                v = ((cx - x) * (ay - y) - (cy - y) * (ax - x)) / area
                w = 1.0 - u - v
                z = u * az + v * bz + w * cz
                if u >= 0.0 and v >= 0.0 and w >= 0.0 and z > depth[i, j]:
                    depth[i, j], chosen[i, j] = z, k
