"""The dragon: a jointed puppet of paper drums that are lit from inside. UsdSkel moves it, one joint for each drum."""

import math

from parts.shapes import ball_profile, cross, prism, tube, turned, unit
from parts.usda import Layer, Mesh, array, vec

from .cages import cage, lofted, turn

# The way that the body goes, from the tail's end to the head and on to the moon, in centimetres.
WAY = [(-216, 292, 300), (-206, 290, 238), (-165, 282, 190), (-95, 272, 172), (-20, 262, 196), (55, 255, 196), (118, 248, 208),
       (158, 246, 262), (138, 244, 326), (76, 240, 352), (10, 236, 332), (-44, 234, 322), (-100, 236, 334), (-160, 240, 350)]  # fmt: skip
DRUMS, LENGTH = 32, 21.0
KEYS = range(1000, 1028, 3)
WIRES = {"WireHead": 0, "WireBack": 6, "WireTail": 29}
"""Which drum each wire holds."""


def spline(points, steps=40):
    """A Catmull-Rom curve through points, as a polyline with the lengths up to each of its corners."""
    ends = [points[0], *points, points[-1]]
    line = []
    for a, b, c, d in zip(ends, ends[1:], ends[2:], ends[3:]):
        for i in range(steps):
            t = i / steps
            line.append(tuple(
                0.5 * (2 * q + (r - p) * t + (2 * p - 5 * q + 4 * r - s) * t**2 + (3 * q - p - 3 * r + s) * t**3)
                for p, q, r, s in zip(a, b, c, d)
            ))  # fmt: skip
    line.append(tuple(points[-1]))
    far = [0.0]
    for a, b in zip(line, line[1:]):
        far.append(far[-1] + math.dist(a, b))
    return line, far


LINE, FAR = spline(WAY)


def along(s, seconds):
    """The place at length s of the way, with the wave that runs through the body."""
    i = max(k for k in range(len(FAR) - 1) if FAR[k] <= max(s, 0))
    t = (s - FAR[i]) / (FAR[i + 1] - FAR[i])
    x, y, z = (p + (q - p) * t for p, q in zip(LINE[i], LINE[i + 1]))
    wave = 2 * math.pi * (s / 230 - seconds)
    return x, y + 5 * math.cos(wave), z + 6 * math.sin(wave)


def girth(k):
    """How large drum k is, from the neck to the tail."""
    u = k / (DRUMS - 1)
    return (0.86 + 0.34 * math.sin(math.pi * min(u / 0.75, 1))) * (1 - u) ** 0.35 + 0.24


def pose(code):
    """Places, turns and sizes of the drums, the head, and the wires at a time code."""
    seconds = (code - 1001) / 24
    s = FAR[-1] - 185 + 48 * seconds
    found = []
    for k in range(-1, DRUMS):
        size = girth(max(k, 0))
        s -= LENGTH * size * (0.5 if k >= 0 else 0)
        at = along(s, seconds)
        ahead = unit(tuple(q - p for p, q in zip(along(s - 4, seconds), along(s + 4, seconds))))
        # Upright above and below; between, where the way goes up, the body rolls over.
        roll = math.pi * min(max((FAR[-1] - 285 - s) / 190, 0), 1)
        left = unit(cross(cross(ahead, (0, -1, 0)), ahead))
        up = cross(ahead, left)
        left, up = ([math.cos(roll) * a + math.sin(roll) * b for a, b in zip(left, up)],
                    [math.cos(roll) * b - math.sin(roll) * a for a, b in zip(left, up)])  # fmt: skip
        found.append((at, quaternion(ahead, left, up), size))
        s -= LENGTH * size * (0.5 if k >= 0 else 0.62)
    head, drums = found[0], found[1:]
    (x, y, z), _, _ = head
    nod = math.radians(6 * math.sin(2 * math.pi * seconds))
    head = (x, y, z + 2), multiplied(head[1], (math.cos(nod / 2), 0, math.sin(nod / 2), 0)), 0.92
    wires = [(drums[k][0], (1, 0, 0, 0), 1) for k in WIRES.values()]
    bite = math.radians(17 + 9 * math.sin(2 * math.pi * 1.5 * seconds))
    jaw = (0, 0, -8), (math.cos(bite / 2), 0, math.sin(bite / 2), 0), 1
    return [*drums, head, jaw, *wires]


def quaternion(x, y, z):
    """Of the rotation whose axes are x, y and z: (w, x, y, z), w >= 0."""
    m = [x, y, z]
    w = math.sqrt(max(0, 1 + m[0][0] + m[1][1] + m[2][2])) / 2
    if w > 0.05:
        return w, (m[1][2] - m[2][1]) / (4 * w), (m[2][0] - m[0][2]) / (4 * w), (m[0][1] - m[1][0]) / (4 * w)
    i = max(range(3), key=lambda k: m[k][k])
    j, k = (i + 1) % 3, (i + 2) % 3
    r = math.sqrt(max(0, 1 + m[i][i] - m[j][j] - m[k][k])) / 2
    q = [0.0] * 3
    q[i], q[j], q[k] = r, (m[i][j] + m[j][i]) / (4 * r), (m[i][k] + m[k][i]) / (4 * r)
    return (m[j][k] - m[k][j]) / (4 * r), *q


def multiplied(a, b):
    """The rotation b, then a."""
    aw, av, bw, bv = a[0], a[1:], b[0], b[1:]
    turned_by = cross(av, bv)
    dot = sum(p * q for p, q in zip(av, bv))
    return aw * bw - dot, *(aw * q + bw * p + c for p, q, c in zip(av, bv, turned_by))


def exact(values):
    """Quaternions need more digits than lengths."""
    return "(" + ", ".join(f"{v:.6f}".rstrip("0").rstrip(".") if abs(v) > 5e-7 else "0" for v in values) + ")"


JOINTS = [f"drum{k:02}" for k in range(DRUMS)] + ["head", "head/jaw", *(f"wire{k}" for k in range(len(WIRES)))]
REST = [(-LENGTH * k, 0, 0) for k in range(DRUMS)] + [(30, 0, 0), (0, 0, -8), *((-LENGTH * k, 0, 0) for k in WIRES.values())]
"""Where the joints are in the puppet that was built: stretched out. The jaw's place is relative to the head."""
HEAD, JAW = DRUMS, DRUMS + 1


def matrices(places):
    return array((f"((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), {vec((*p, 1))})" for p in places), str)


def skeleton(layer):
    bound = [*REST[:JAW], tuple(a + b for a, b in zip(REST[HEAD], REST[JAW])), *REST[JAW + 1 :]]
    names = array((f'"{j}"' for j in JOINTS), str)
    body = [
        "rel skel:animationSource = </Dragon/Puppet/Flight>",
        f"uniform token[] joints = {names}",
        f"uniform matrix4d[] bindTransforms = {matrices(bound)}",
        f"uniform matrix4d[] restTransforms = {matrices(REST)}",
    ]
    with layer.prim("Skeleton", "Skeleton", ['prepend apiSchemas = ["SkelBindingAPI"]'], body):
        pass
    poses = {code: pose(code) for code in KEYS}
    places = ", ".join(f"{code}: {array((p for p, _, _ in rows), vec)}" for code, rows in poses.items())
    turns = ", ".join(f"{code}: {array((q for _, q, _ in rows), exact)}" for code, rows in poses.items())
    sizes = array((vec((s, s, s)) for _, _, s in poses[KEYS[0]]), str)
    body = [
        f"uniform token[] joints = {names}",
        f"half3[] scales = {sizes}",
        f"quatf[] rotations.timeSamples = {{ {turns} }}",
        f"float3[] translations.timeSamples = {{ {places} }}",
    ]
    with layer.prim("SkelAnimation", "Flight", body=body):
        pass


def bound(joint, at=None):
    """The lines of a mesh that follows a joint as a whole; it stands where the joint is at rest."""
    return [
        f'int[] primvars:skel:jointIndices = [{joint}] (elementSize = 1; interpolation = "constant")',
        'float[] primvars:skel:jointWeights = [1] (elementSize = 1; interpolation = "constant")',
        f"matrix4d primvars:skel:geomBindTransform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), {vec((*(at or REST[joint]), 1))})",
        "rel skel:skeleton = </Dragon/Puppet/Skeleton>",
    ]


SKINNED = 'append apiSchemas = ["SkelBindingAPI"]'


def write_rigid(mesh, layer, name, joint):
    """Mesh.write with a binding."""
    mesh.write(layer, name, [SKINNED], bound(joint))


def drum():
    """A paper drum along X with pleats, and a gold fin on its back."""
    profile = [(18.5, -11), (21.5, -8.5), (19.5, -6), (23.5, -3), (21.5, 0), (23.5, 3), (19.5, 6), (21.5, 8.5), (18.5, 11)]
    mesh, sides = Mesh(), 14
    for j, ((r0, x0), (r1, x1)) in enumerate(zip(profile, profile[1:])):
        for k in range(sides):
            corners = [(x, *turn(360 * t / sides + 90, r)) for r, x, t in ((r0, x0, k), (r0, x0, k + 1), (r1, x1, k + 1), (r1, x1, k))]
            uv = [((t + 0.5 * sides) / sides, j_ / (len(profile) - 1)) for t, j_ in ((k, j), (k + 1, j), (k + 1, j + 1), (k, j + 1))]
            mesh.face(corners, "Scales", uv=uv)
    fin = [(-9, 20), (6, 20), (0, 30), (-12, 38), (-8, 30)]
    prism(_Standing(mesh), fin, -0.7, 0.7, "CardGold")
    return mesh


class _Standing:
    """A mesh into which a shape of the plane (x, z) is pulled along y."""

    def __init__(self, mesh):
        self.mesh = mesh

    def face(self, corners, material):
        self.mesh.face([(x, -d, z) for x, z, d in corners], material)


def ring(x, half, top, bottom, n=10):
    """A rounded cross section, from the left over the top: it turns to the left about +X."""
    points = []
    for k in range(n):
        y, z = turn(360 * k / n + 18, 1)
        points.append((x, half * y, (top + bottom) / 2 + (top - bottom) / 2 * z))
    return points


def head(layer):
    """Skull and jaw are subdivided; the brows, the nostrils and the lips are creases."""
    skull = [ring(*row) for row in (
        (-24, 15, 16, -13), (-14, 23, 24, -15), (6, 26, 29, -12), (20, 25, 30, -7), (27, 17, 19, -5),
        (46, 15, 13, -4), (58, 18, 17, -4), (66, 16, 15, -4), (70, 9, 9, -1),
    )]  # fmt: skip
    points, faces = lofted(skull)
    brow = [([10 * j + k for j in (1, 2, 3, 4)], 2.5) for k in (1, 3)]
    lip = [([10 * j + k for j in range(2, 9)], 3) for k in (6, 8)]
    cage(layer, "Skull", points, faces, "HeadPaper", [*brow, *lip, ([30 + k for k in (0, 1, 2, 3, 4)], 2)],
         [(81, 2), (83, 2)], bound(HEAD), [SKINNED])  # fmt: skip
    jaw = [ring(*row) for row in ((-8, 17, 2, -9), (14, 17, 1, -10), (36, 13, 0, -9), (52, 12, 1, -8), (60, 7, 1, -5))]
    points, faces = lofted(jaw)
    rim = [([10 * j + k for j in range(5)], 3) for k in (0, 4)]
    at = tuple(a + b for a, b in zip(REST[HEAD], REST[JAW]))
    cage(layer, "Jaw", points, faces, "HeadPaper", rim, [(k, 3) for k in (40, 44)], bound(JAW, at), [SKINNED])
    mesh = Mesh()
    for side in (-1, 1):
        horn = [(2, side * 13, 26), (-12, side * 18, 40), (-30, side * 22, 50), (-50, side * 21, 54)]
        for k, (a, b) in enumerate(zip(horn, horn[1:])):
            tube(mesh, [a, b], 4.2 - 1.1 * k, 7, "Ivory")
        tube(mesh, [horn[1], (-6, side * 26, 56)], 2, 6, "Ivory")
        for k in range(5):
            x = 34 + 7 * k
            tooth = (x, side * (11.5 + 0.8 * (k > 2)), -4)
            turned(mesh, [(0, -8 if k in (1, 4) else -5), (2.2, 0)], 5, "Ivory", tooth)
        whisker = [(66 + 6 * math.sin(t / 2), side * (14 + 9 * t), 4 + 10 * math.sin(t * 0.9)) for t in (0, 1, 2, 3, 4, 5)]
        tube(mesh, [(x - 6 * i, y, z) for i, (x, y, z) in enumerate(whisker)], 0.9, 5, "CardGold")
    for row, (x, radius, long, material) in enumerate(((-14, 20, 34, "CardGold"), (-20, 17, 44, "Flame"))):
        for k in range(13):
            angle = 360 * (k + 0.5 * row) / 13
            if 230 < angle < 310:
                continue
            a, b = turn(angle - 11, radius), turn(angle + 11, radius)
            tip = turn(angle, radius + long * 0.62)
            front, back = [(x, *a), (x, *b), (x - long, *tip)], [(x - 1.5, *b), (x - 1.5, *a), (x - 1 - long, *tip)]
            mesh.face(front, material)
            mesh.face(back, material)
    write_rigid(mesh, layer, "Headdress", HEAD)
    mesh = Mesh()
    for side in (-1, 1):
        turned(mesh, ball_profile(5.6, 6), 10, "Eye", (21, side * 19.5, 15))
    write_rigid(mesh, layer, "Eyes", HEAD)
    mesh = Mesh()
    for angle, long in ((-44, 52), (-22, 66), (0, 84), (22, 66), (44, 52)):
        x, z = turn(180 + angle, 1)
        edges = [(0.45 * long * x - w * z, 0.45 * long * z + w * x) for w in (9, -9)]
        blade = [(-6, 0), edges[0], (long * x, long * z), edges[1]]
        prism(_Standing(mesh), blade, -0.6 - angle / 90, 0.6 - angle / 90, "Flame" if angle % 44 else "CardGold")
    write_rigid(mesh, layer, "Tail", DRUMS - 1)


def write(folder):
    layer = Layer("layers/dragon.usda", "The paper dragon, and how it flies. Written by make.py.")
    with layer.root("Dragon"), layer.prim("SkelRoot", "Puppet", ['prepend apiSchemas = ["SkelBindingAPI"]']):
        skeleton(layer)
        with layer.prim("Scope", "Skin"):
            write_rigid(drum(), layer, "Drum00", 0)
            for k in range(1, DRUMS):
                lines = bound(k)
                meta = ["prepend inherits = </Dragon/Puppet/Skin/Drum00>"]
                with layer.prim("Mesh", f"Drum{k:02}", meta, [lines[0], lines[2]]):
                    pass
            head(layer)
        with layer.prim("Scope", "Wires"):
            for i, (name, k) in enumerate(WIRES.items()):
                mesh = Mesh()
                tube(mesh, [(0, 0, 14), (0, 0, 320)], 0.35, 4, "Black")
                write_rigid(mesh, layer, name, JAW + 1 + i)
    layer.save(folder)
