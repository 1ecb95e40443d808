"""Capsules about the solids of an arm, and the distance between two of them: the body as the search sees it.

The solids and the pairs that have to stay clear are those of ``armdesign.bodies.arm_body``, in the same order; see
there for points, links and pairs. Each is wrapped in a capsule, a segment with a radius: a tube in that of its own axis
and radius, any other cylinder of length l and radius r in one of half the length, l / 2, and the radius
sqrt((l / 4)^2 + r^2), which reaches its rims. What keeps the capsules apart keeps the solids apart.

Ends of capsules are points of their link, and each knows how many of the arm's coordinates move it, in the order

    yaw, then per row alpha, a, d and, for rows that carry a joint, q

of ``armdesign.fitness.kernels.variations``: a module is moved by all up to the a piece before it, since it sits on its
joint's axis where the slide, not d, has put it.
"""

from __future__ import annotations

import numpy as np

from armdesign.kinematics.compilation import branch, leaf
from armdesign.kinematics.kernels.skeleton import MAX_DOF

MAX_PARTS = 4 * (MAX_DOF + 1)
MAX_CAPSULES = MAX_PARTS + 12 * MAX_DOF
MAX_PAIRS = 1536
SHORTEST = 1e-6
"""Pieces shorter than this are left out [m], as in armdesign.bodies.cylinder."""
NO_LENGTH = 1e-20
"""Square of a length that counts as none [m^2]."""
PARALLEL = 1e-14
"""Square of the sine of an angle below which two segments count as parallel."""
WHOLE, APART = 0, -1
"""In place of the joint whose sphere cuts a pair: no sphere does; it is no pair."""

SIZES = np.dtype(
    [
        ("tube", np.float64),  # radius of the tubes [m]
        ("housing_half", np.float64, MAX_DOF),  # half length of the segment inside a module's housing [m]
        ("housing", np.float64, MAX_DOF),  # radius of its capsule [m]
        ("reach", np.float64, MAX_DOF),  # radius of the sphere about a joint that cuts its two links [m], Body.reaches
        ("slide", np.float64),  # how far a module may sit beyond the piece along its axis [m]
        ("placed", np.int64),  # 1: there is a base plate
        ("plate_centre", np.float64),  # its height above the base's origin [m]
        ("plate_half", np.float64),
        ("plate", np.float64),
        ("prismatic", np.int64, MAX_DOF),
        ("lower", np.float64, MAX_DOF),  # joint limits; used of prismatic joints [m]
        ("upper", np.float64, MAX_DOF),
    ]
)
"""What all arms of a search are built of."""

BODY = np.dtype(
    [
        ("dof", np.int64),
        ("parts", np.int64),  # capsules about whole solids, which come first
        ("capsules", np.int64),  # with those about what a joint's sphere leaves of a tube
        ("pairs", np.int64),
        # of every capsule
        ("link", np.int64, MAX_CAPSULES),
        ("module", np.int64, MAX_CAPSULES),  # number of the joint whose module it is; 0: it is none
        ("fixed", np.int64, MAX_CAPSULES),  # 1: no sphere cuts it
        ("radius", np.float64, MAX_CAPSULES),
        ("end", np.float64, (MAX_CAPSULES, 2, 3)),  # in the link's frame [m]
        ("movers", np.int64, (MAX_CAPSULES, 2)),  # number of coordinates that move the end
        ("part", np.int64, MAX_CAPSULES),  # the whole solid
        ("cut", np.int64, MAX_CAPSULES),  # joint whose sphere has cut it; 0: none
        ("cut_end", np.int64, (MAX_CAPSULES, 2)),  # 1: this end lies where the sphere cuts
        (
            "lever",
            np.float64,
            (MAX_CAPSULES, MAX_DOF),
        ),  # farthest it can be from a joint's axis [m]; 1 where that slides
        # of every pair: capsules, and the joints low..high - 1 (from 0) that move one against the other
        ("first", np.int64, MAX_PAIRS),
        ("second", np.int64, MAX_PAIRS),
        ("low", np.int64, MAX_PAIRS),
        ("high", np.int64, MAX_PAIRS),
        # while it is built
        ("corner", np.float64, (4, 3)),
        ("corner_movers", np.int64, 4),
        ("piece", np.int64, (MAX_PARTS, 2, 2)),  # of a part at its link's own joint and the next one: first, number
    ]
)
"""The body of one arm: everything that does not depend on the joint angles."""

WITNESS = np.dtype(
    [
        ("s", np.float64),  # place on the first segment, 0..1
        ("t", np.float64),  # place on the second
        ("distance", np.float64),  # [m]
        ("normal", np.float64, 3),  # unit vector from the second segment to the first
    ]
)
"""Where two segments are nearest to each other."""


@leaf
def nearest(ux, uy, uz, vx, vy, vz, wx, wy, wz):
    """Where two segments a + s u and c + t v, s and t from 0 to 1, are nearest to each other.

    w is a - c. Returns s, t and the square of the distance.
    """
    uu, vv, uv = ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz
    uw, vw = ux * wx + uy * wy + uz * wz, vx * wx + vy * wy + vz * wz
    s, t = 0.0, 0.0
    if vv <= NO_LENGTH:
        if uu > NO_LENGTH:
            s = min(max(-uw / uu, 0.0), 1.0)
    else:
        across = uu * vv - uv * uv
        if uu > NO_LENGTH and across > PARALLEL * uu * vv:
            s = min(max((uv * vw - uw * vv) / across, 0.0), 1.0)
        t = (uv * s + vw) / vv
        if t < 0.0 or t > 1.0:
            t = 0.0 if t < 0.0 else 1.0
            if uu > NO_LENGTH:
                s = min(max((t * uv - uw) / uu, 0.0), 1.0)
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    return s, t, x * x + y * y + z * z


@branch
def segment_segment(a, b, c, d, witness):
    """Distance of two segments, with where they are nearest; either may have no length, they may be parallel.

    Where they cross, the normal is one that stands on both of them.

    Args:
        a: One end of the first segment, shape (3,) [m].
        b: Its other end.
        c: One end of the second segment.
        d: Its other end.
        witness: WITNESS record, written.

    Returns:
        The distance [m].
    """
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    vx, vy, vz = d[0] - c[0], d[1] - c[1], d[2] - c[2]
    wx, wy, wz = a[0] - c[0], a[1] - c[1], a[2] - c[2]
    s, t, square = nearest(ux, uy, uz, vx, vy, vz, wx, wy, wz)
    distance = np.sqrt(square)
    x, y, z = wx + s * ux - t * vx, wy + s * uy - t * vy, wz + s * uz - t * vz
    size = distance
    if size < 1e-12:
        x, y, z = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        size = np.sqrt(x * x + y * y + z * z)
        if size < 1e-12:
            x, y, z, size = 0.0, 0.0, 1.0, 1.0
    witness.s, witness.t, witness.distance = s, t, distance
    witness.normal[0], witness.normal[1], witness.normal[2] = x / size, y / size, z / size
    return distance


@branch
def build_body(body, sizes, rows, slides):
    """Wrap the solids of an arm in capsules and find the pairs that have to stay clear.

    Args:
        body: Record of type BODY, written.
        sizes: Record of type SIZES.
        rows: DH rows (alpha, a, d, theta), tool last, shape (n + 1, 4) [rad, m, m, rad].
        slides: s_j of every joint, shape (n,) [m].
    """
    n = len(rows) - 1
    body.dof, body.capsules, body.pairs = n, 0, 0
    if sizes.placed == 1:
        k = new_capsule(body, 0, sizes.plate)
        set_on_axis(body, k, sizes.plate_centre, sizes.plate_half, 1)
        body.fixed[k] = 1
    for link in range(n + 1):
        if link > 0:
            k = new_capsule(body, link, sizes.housing[link - 1])
            slides_itself = sizes.prismatic[link - 1] == 1
            lifted = 0.0 if slides_itself else slides[link - 1] - rows[link - 1, 2]
            set_on_axis(body, k, lifted, sizes.housing_half[link - 1], 4 * link + 1 if slides_itself else 4 * link - 1)
            body.module[k], body.fixed[k] = link, 1
        add_tubes(body, sizes, rows, slides, link)
    body.parts = body.capsules
    find_pairs(body, sizes, rows, slides)
    for k in range(body.capsules):
        set_levers(body, sizes, rows, k)


@leaf
def new_capsule(body, link, radius):
    """Append a capsule; returns its number."""
    k = body.capsules
    body.capsules = k + 1
    body.link[k], body.radius[k], body.part[k] = link, radius, k
    body.module[k] = body.fixed[k] = body.cut[k] = body.cut_end[k, 0] = body.cut_end[k, 1] = 0
    return k


@leaf
def set_on_axis(body, k, centre, half, movers):
    """Put the ends of a capsule on the z axis of its link, as far above and below a centre."""
    for e in range(2):
        body.end[k, e, 0] = body.end[k, e, 1] = 0.0
        body.end[k, e, 2] = centre + (half if e == 1 else -half)
        body.movers[k, e] = movers


@leaf
def set_corner(body, count, x, y, z, movers):
    """Append a corner to the polyline of a link; returns how many there are then."""
    body.corner[count, 0], body.corner[count, 1], body.corner[count, 2] = x, y, z
    body.corner_movers[count] = movers
    return count + 1


@branch
def add_tubes(body, sizes, rows, slides, link):
    """Append the tubes of a link, and the rail of the next joint where that slides."""
    n, count = len(rows) - 1, 0
    if link == 0:
        count = set_corner(body, count, 0.0, 0.0, 0.0, 1)
    elif sizes.prismatic[link - 1] == 1:
        count = set_corner(body, count, 0.0, 0.0, 0.0, 4 * link + 1)
    else:
        d = rows[link - 1, 2]
        lifted = slides[link - 1] - d
        count = set_corner(body, count, 0.0, 0.0, lifted, 4 * link - 1)
        if lifted * (-1.0 if d < 0.0 else 1.0) <= 0.0:
            count = set_corner(body, count, 0.0, 0.0, 0.0, 4 * link)
    a, d = rows[link, 1], rows[link, 2]
    sin, cos = np.sin(rows[link, 0]), np.cos(rows[link, 0])
    slides_next = link < n and sizes.prismatic[link] == 1
    ahead = d if link == n else slides[link]
    if link == n or slides_next or ahead * (-1.0 if d < 0.0 else 1.0) >= 0.0:
        count = set_corner(body, count, a, 0.0, 0.0, 4 * link + 3)
    if not slides_next:
        count = set_corner(body, count, a, -ahead * sin, ahead * cos, 4 * link + (4 if link == n else 3))
    for i in range(count - 1):
        square = 0.0
        for r in range(3):
            square += (body.corner[i + 1, r] - body.corner[i, r]) ** 2
        if np.sqrt(square) >= SHORTEST:
            k = new_capsule(body, link, sizes.tube)
            for e in range(2):
                body.movers[k, e] = body.corner_movers[i + e]
                for r in range(3):
                    body.end[k, e, r] = body.corner[i + e, r]
    if slides_next:
        k = new_capsule(body, link, sizes.tube)
        body.fixed[k] = 1
        for e in range(2):
            limit = d + (sizes.upper[link] if e == 1 else sizes.lower[link])
            z = max(limit, 0.0) if e == 1 else min(limit, 0.0)
            body.movers[k, e] = 4 * link + (3 if z == 0.0 else 4)
            body.end[k, e, 0], body.end[k, e, 1], body.end[k, e, 2] = a, -z * sin, z * cos


@branch
def find_pairs(body, sizes, rows, slides):
    """Write the pairs that have to stay clear, and append what the joints' spheres leave of tubes that they cut."""
    for i in range(body.parts):
        body.piece[i, 0, 0] = body.piece[i, 1, 0] = -1
    for i in range(body.parts):
        for j in range(i + 1, body.parts):
            joint = meeting(body, i, j)
            if joint == WHOLE:
                add_pair(body, sizes, i, j)
            elif joint > WHOLE:
                cut_part(body, sizes, rows, slides, i, joint)
                cut_part(body, sizes, rows, slides, j, joint)
                at_i, at_j = joint - body.link[i], joint - body.link[j]
                for k in range(body.piece[i, at_i, 0], body.piece[i, at_i, 0] + body.piece[i, at_i, 1]):
                    for m in range(body.piece[j, at_j, 0], body.piece[j, at_j, 0] + body.piece[j, at_j, 1]):
                        add_pair(body, sizes, k, m)


@leaf
def meeting(body, i, j):
    """How two parts, the second of the same link or a later one, count as a pair.

    Returns:
        The joint whose sphere cuts them, WHOLE for none, or APART where they do not count.
    """
    if body.module[i] > 0 and body.module[j] > 0:
        return WHOLE
    for e in range(2):
        module = body.module[i] if e == 0 else body.module[j]
        other = body.link[j] if e == 0 else body.link[i]
        if module > 0:
            return APART if other == module - 1 or other == module else WHOLE
    apart = body.link[j] - body.link[i]
    if apart == 0:
        return APART
    return body.link[j] if apart == 1 else WHOLE


@leaf
def add_pair(body, sizes, i, j):
    """Append a pair, the second on a later link; a module that turns is as good as one on the link before."""
    p = body.pairs
    body.pairs = p + 1
    body.first[p], body.second[p], body.low[p], body.high[p] = i, j, body.link[i], body.link[j]
    if body.module[j] > 0 and sizes.prismatic[body.module[j] - 1] == 0:
        body.high[p] -= 1


@branch
def cut_part(body, sizes, rows, slides, i, joint):
    """Find what is left of a part beyond the sphere about a joint's module, once; see Cylinder.outside."""
    at = joint - body.link[i]
    if body.piece[i, at, 0] >= 0:
        return
    body.piece[i, at, 0], body.piece[i, at, 1] = i, 1
    if body.fixed[i] == 1 or (at == 1 and sizes.prismatic[joint - 1] == 1):
        return
    cx, cy, cz = sphere_of(sizes, rows, slides, joint, at)
    a, b = body.end[i, 0], body.end[i, 1]
    ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    length = np.sqrt(ux * ux + uy * uy + uz * uz)
    ux, uy, uz = ux / length, uy / length, uz / length
    x, y, z = cx - a[0], cy - a[1], cz - a[2]
    foot = x * ux + y * uy + z * uz
    x, y, z = x - foot * ux, y - foot * uy, z - foot * uz
    gap = max(np.sqrt(x * x + y * y + z * z) - body.radius[i], 0.0)
    reach = sizes.reach[joint - 1]
    if gap >= reach:
        return
    inside = np.sqrt(reach * reach - gap * gap)
    if foot - inside >= length or foot + inside <= 0.0:
        return
    body.piece[i, at, 0], body.piece[i, at, 1] = body.capsules, 0
    for side in range(2):
        low, high = (0.0, foot - inside) if side == 0 else (foot + inside, length)
        if high - low >= SHORTEST:
            k = new_capsule(body, body.link[i], body.radius[i])
            body.piece[i, at, 1] += 1
            body.part[k], body.cut[k] = i, joint
            body.cut_end[k, 1 - side] = 1
            for e in range(2):
                place = low if e == 0 else high
                body.movers[k, e] = body.movers[i, e]
                body.end[k, e, 0] = a[0] + place * ux
                body.end[k, e, 1] = a[1] + place * uy
                body.end[k, e, 2] = a[2] + place * uz


@leaf
def sphere_of(sizes, rows, slides, joint, at):
    """Centre of the sphere about a joint's module, in the joint's own link's frame (at = 0) or the one before (1)."""
    if at == 0:
        return 0.0, 0.0, 0.0 if sizes.prismatic[joint - 1] == 1 else slides[joint - 1] - rows[joint - 1, 2]
    s, alpha = slides[joint - 1], rows[joint - 1, 0]
    return rows[joint - 1, 1], -s * np.sin(alpha), s * np.cos(alpha)


@branch
def set_levers(body, sizes, rows, k):
    """Write how far a capsule's ends can be from every joint's axis that moves it; from its own they are as far always.

    The origins of two joints in a row are sqrt(a^2 + d^2) apart.
    """
    link, axial, far = body.link[k], 0.0, 0.0
    for e in range(2):
        x, y, z = body.end[k, e, 0], body.end[k, e, 1], body.end[k, e, 2]
        axial = max(axial, np.sqrt(x * x + y * y))
        far = max(far, np.sqrt(x * x + y * y + z * z))
    for j in range(body.dof):
        body.lever[k, j] = 0.0
    for j in range(link - 1, -1, -1):
        body.lever[k, j] = 1.0 if sizes.prismatic[j] == 1 else axial
        d = abs(rows[j, 2])
        if sizes.prismatic[j] == 1:
            d += max(abs(sizes.lower[j]), abs(sizes.upper[j]))
        far += np.sqrt(rows[j, 1] ** 2 + d * d)
        axial = far


@leaf
def place_capsule(ends, body, poses, k):
    """Write where the ends of a capsule are.

    Args:
        ends: Shape (6,), one end after the other [m], written.
        body: Record of type BODY.
        poses: Pose of the frame before row 0, then of the joints, shape (n + 1, 12): axes x, y, z, then the origin.
        k: The capsule.
    """
    pose = poses[body.link[k]]
    for e in range(2):
        x, y, z = body.end[k, e, 0], body.end[k, e, 1], body.end[k, e, 2]
        for r in range(3):
            ends[3 * e + r] = pose[r] * x + pose[3 + r] * y + pose[6 + r] * z + pose[9 + r]
