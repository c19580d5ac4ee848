"""Solids added to a Mesh: boxes, prisms, turned and swept shapes. All faces turn outward."""

import math


def box(mesh, lo, hi, material, skip=""):
    """An axis-aligned box; `skip` leaves out sides, e.g. "z-x+"."""
    (a, b, c), (d, e, f) = lo, hi
    sides = {
        "x-": [(a, e, c), (a, b, c), (a, b, f), (a, e, f)],
        "x+": [(d, b, c), (d, e, c), (d, e, f), (d, b, f)],
        "y-": [(a, b, c), (d, b, c), (d, b, f), (a, b, f)],
        "y+": [(d, e, c), (a, e, c), (a, e, f), (d, e, f)],
        "z-": [(a, e, c), (d, e, c), (d, b, c), (a, b, c)],
        "z+": [(a, b, f), (d, b, f), (d, e, f), (a, e, f)],
    }
    for name, corners in sides.items():
        if name not in skip:
            mesh.face(corners, material)


def room(mesh, lo, hi, material, skip="", floor=None):
    """A box seen from inside."""

    class Inside:
        def face(self, corners, material):
            mesh.face(corners[::-1], material)

    inside = Inside()
    if floor:
        box(inside, lo, hi, floor, "x-x+y-y+z+")
        skip += "z-"
    box(inside, lo, hi, material, skip)


def prism(mesh, outline, z0, z1, material, caps=True, lid=None):
    """A counter-clockwise outline [(x, y)] pulled up from z0 to z1."""
    n = len(outline)
    for i in range(n):
        (x0, y0), (x1, y1) = outline[i], outline[(i + 1) % n]
        mesh.face([(x0, y0, z0), (x1, y1, z0), (x1, y1, z1), (x0, y0, z1)], material)
    if caps:
        mesh.face([(x, y, z1) for x, y in outline], lid or material)
        mesh.face([(x, y, z0) for x, y in outline[::-1]], lid or material)


def turned(mesh, profile, sides, material, centre=(0, 0, 0)):
    """A lathe: profile [(radius, z)] going upward. Radius 0 closes it."""
    cx, cy, cz = centre

    def ring(r, z, k):
        t = 2 * math.pi * k / sides
        return (cx + r * math.cos(t), cy + r * math.sin(t), cz + z)

    for (r0, z0), (r1, z1) in zip(profile, profile[1:]):
        for k in range(sides):
            corners = [ring(r0, z0, k), ring(r0, z0, k + 1), ring(r1, z1, k + 1), ring(r1, z1, k)]
            if r0 == 0:
                corners = [corners[0], corners[2], corners[3]]
            elif r1 == 0:
                corners = corners[:3]
            mesh.face(corners, material)


def ball_profile(radius, steps, squash=1.0):
    return [
        (
            abs(radius * math.sin(math.pi * i / steps)) if 0 < i < steps else 0,
            -squash * radius * math.cos(math.pi * i / steps),
        )
        for i in range(steps + 1)
    ]


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def unit(a):
    length = math.sqrt(sum(c * c for c in a)) or 1.0
    return (a[0] / length, a[1] / length, a[2] / length)


def tube(mesh, path, radius, sides, material, closed=False, caps=True):
    """A tube around a polyline, its rings carried along without twist."""
    n = len(path)
    rings, side = [], None
    for i in range(n):
        before = path[i - 1] if i > 0 or closed else path[i]
        after = path[(i + 1) % n] if i + 1 < n or closed else path[i]
        along = unit(sub(after, before))
        if side is None:
            helper = (0, 0, 1) if abs(along[2]) < 0.9 else (1, 0, 0)
            side = unit(cross(along, helper))
        dot = sum(s * a for s, a in zip(side, along))
        side = unit(tuple(s - dot * a for s, a in zip(side, along)))
        up = cross(along, side)
        rings.append(
            [
                tuple(path[i][c] + radius * (math.cos(t) * side[c] + math.sin(t) * up[c]) for c in range(3))
                for t in (2 * math.pi * k / sides for k in range(sides))
            ]
        )
    spans = range(n if closed else n - 1)
    for i in spans:
        a, b = rings[i], rings[(i + 1) % n]
        for k in range(sides):
            m = (k + 1) % sides
            mesh.face([a[k], a[m], b[m], b[k]], material)
    if caps and not closed:
        mesh.face(rings[0][::-1], material)
        mesh.face(rings[-1], material)


def arc(cx, cy, radius, start, stop, steps, squash=1.0):
    """Points of an arc in a plane; degrees."""
    return [
        (
            cx + radius * math.cos(math.radians(start + (stop - start) * i / steps)),
            cy + squash * radius * math.sin(math.radians(start + (stop - start) * i / steps)),
        )
        for i in range(steps + 1)
    ]


def resample(points, step):
    """Points at even distances of about `step` along a polyline."""
    lengths = [math.dist(a, b) for a, b in zip(points, points[1:])]
    count = max(1, round(sum(lengths) / step))
    out, i, left = [points[0]], 0, 0.0
    for k in range(1, count):
        want = sum(lengths) * k / count
        while left + lengths[i] < want and i < len(lengths) - 1:
            left += lengths[i]
            i += 1
        t = (want - left) / lengths[i]
        out.append(tuple(p + t * (q - p) for p, q in zip(points[i], points[i + 1])))
    return out + [points[-1]]


def rounded(points, rounds=2, closed=False):
    """Cuts corners (Chaikin), keeping the ends of an open line."""
    for _ in range(rounds):
        out = [] if closed else [points[0]]
        pairs = list(zip(points, points[1:] + points[:1])) if closed else list(zip(points, points[1:]))
        for a, b in pairs:
            out.append(tuple(0.78 * p + 0.22 * q for p, q in zip(a, b)))
            out.append(tuple(0.22 * p + 0.78 * q for p, q in zip(a, b)))
        points = out if closed else out + [points[-1]]
    return points


def hanging(a, b, sag, steps):
    """A cable between two points: a parabola that hangs `sag` below its chord."""
    return [
        tuple(p + (q - p) * t for p, q in zip(a[:2], b[:2])) + (a[2] + (b[2] - a[2]) * t - 4 * sag * t * (1 - t),)
        for t in (i / steps for i in range(steps + 1))
    ]
