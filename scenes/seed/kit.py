"""What the scenes of the seed share: a small writer of USD text, a small writer of .glb, a few shapes.

Metres, Z up (the .glb writer turns that to glTF's +Y up). Numbers are rounded and chance is seeded, so a
script writes the same bytes every time.
"""

import json
import math
import struct

import numpy as np

POINT_RADIUS = 0.01
"""Of a light that is treated as a point; its intensity is what matters."""
BINDS = 'prepend apiSchemas = ["MaterialBindingAPI"]'


# -- USD ---------------------------------------------------------------------------------------------


def num(x):
    text = "%.6g" % round(float(x), 5)
    return "0" if text == "-0" else text


def vec(v):
    return "(" + ", ".join(map(num, v)) + ")"


def array(items, fmt=num):
    return "[" + ", ".join(map(fmt, items)) + "]"


class Stage:
    """One .usda file below `/World`. `with stage.prim(...)` puts what is written meanwhile inside it."""

    def __init__(self, doc):
        self.doc, self.depth, self.lines, self.materials, self.frames = doc, 1, [], {}, 0

    def put(self, *lines):
        self.lines += ["    " * self.depth + line for line in lines]

    def prim(self, kind, name, body=(), meta=""):
        return _Prim(self, f'def {kind} "{name}"' + (f" ({meta})" if meta else ""), body)

    def material(self, name, color, roughness=1.0, metallic=0.0, ior=1.5):
        """A UsdPreviewSurface; as good as matt with ior 1. Returns its name."""
        self.materials[name] = {
            "color3f inputs:diffuseColor": vec(color),
            "float inputs:roughness": num(roughness),
            "float inputs:metallic": num(metallic),
            "float inputs:ior": num(ior),
        }
        return name

    def shape(self, kind, name, material, at=(0, 0, 0), scale=(1, 1, 1), turn=0.0, **sizes):
        """A Cube (of 1 m), Sphere, Cylinder, Cone or Plane."""
        if kind == "Cube":
            sizes["size"] = 1
        body = [f"double {key} = {num(value)}" for key, value in sizes.items()]
        with self.prim(kind, name, [*body, *place(at, turn, scale), bind(material)], BINDS):
            pass

    def box(self, name, material, low, high):
        low, high = np.array(low, float), np.array(high, float)
        self.shape("Cube", name, material, (low + high) / 2, high - low)

    def sliding_box(self, name, material, low, high, by, frames):
        """A box that slides from frame 1 to the last."""
        low, high, self.frames = np.array(low, float), np.array(high, float), frames
        body = ["double size = 1", *place((low + high) / 2, 0.0, high - low), bind(material)]
        ends = {1: (low + high) / 2, frames: (low + high) / 2 + by}
        keys = ", ".join(f"{frame}: {vec(at)}" for frame, at in ends.items())
        body[1] = f"double3 xformOp:translate.timeSamples = {{ {keys} }}"
        with self.prim("Cube", name, body, BINDS):
            pass

    def mesh(self, name, points, triangles, material, smooth=False, glow=None):
        """Triangles, counter-clockwise seen from outside. `glow` is (color, nits) and makes a mesh light."""
        body = [
            f"float3[] extent = [{vec(points.min(axis=0))}, {vec(points.max(axis=0))}]",
            f"int[] faceVertexCounts = {array([3] * len(triangles), str)}",
            f"int[] faceVertexIndices = {array(np.ravel(triangles), str)}",
            f"point3f[] points = {array(points, vec)}",
            'uniform token subdivisionScheme = "none"',
            bind(material),
        ]
        if smooth:
            normals = array(vertex_normals(points, triangles), vec)
            body.append(f'normal3f[] normals = {normals} (interpolation = "vertex")')
        if glow:
            body += [f"color3f inputs:color = {vec(glow[0])}", f"float inputs:intensity = {num(glow[1])}"]
            body.append('uniform token light:materialSyncMode = "noMaterialResponse"')
        with self.prim("Mesh", name, body, BINDS.replace("]", ', "MeshLightAPI"]' if glow else "]")):
            pass

    def light(self, kind, name, frame, color, nits, cone=None, extra=(), **inputs):
        """A UsdLux light; it aims along the -Z of its frame. `cone` is (degrees, softness)."""
        body = [f"color3f inputs:color = {vec(color)}", f"float inputs:intensity = {num(nits)}"]
        body += [f"float inputs:{key} = {num(value)}" for key, value in inputs.items()]
        if cone:
            body.append(f"float inputs:shaping:cone:angle = {num(cone[0])}")
            body.append(f"float inputs:shaping:cone:softness = {num(cone[1])}")
        meta = 'prepend apiSchemas = ["ShapingAPI"]' if cone else ""
        with self.prim(kind, name, [*body, *extra, *transform(frame)], meta):
            pass

    def point(self, name, frame, color, candela, cone=None):
        """A sphere light that is treated as a point; a spot if it has a cone."""
        nits = candela / (math.pi * POINT_RADIUS**2)
        self.light("SphereLight", name, frame, color, nits, cone, ["bool treatAsPoint = 1"], radius=POINT_RADIUS)

    def scatter(self, name, at, prototypes, kinds, turns=None, scales=None):
        """A PointInstancer. `prototypes` writes the prims that it names, `turns` are degrees about Z."""
        count = len(at)
        half = np.radians(np.zeros(count) if turns is None else turns) / 2
        quats = [(c, 0, 0, s) for c, s in zip(np.cos(half), np.sin(half), strict=True)]
        scales = np.ones((count, 3)) if scales is None else scales
        paths = array((f"</World/{name}/Prototypes/{p}>" for p in prototypes), str)
        body = [
            f"int[] protoIndices = {array(kinds, str)}",
            f"point3f[] positions = {array(at, vec)}",
            f"quath[] orientations = {array(quats, vec)}",
            f"float3[] scales = {array(scales, vec)}",
            f"rel prototypes = {paths}",
        ]
        with self.prim("PointInstancer", name, body), self.prim("Scope", "Prototypes"):
            for write in prototypes.values():
                write()

    def camera(self, eye, target, wide_deg=50.0):
        """A pinhole of 16:9."""
        body = [
            "float horizontalAperture = 1.6",
            "float verticalAperture = 0.9",
            f"float focalLength = {num(0.8 / math.tan(math.radians(wide_deg) / 2))}",
            *transform(aimed(eye, target)),
        ]
        with self.prim("Camera", "Camera", body):
            pass

    def save(self, path):
        head = ["#usda 1.0", "(", f'    doc = """{self.doc}"""', '    defaultPrim = "World"']
        if self.frames:
            head += ["    startTimeCode = 1", f"    endTimeCode = {self.frames}", "    timeCodesPerSecond = 24"]
        head += ["    metersPerUnit = 1", '    upAxis = "Z"', ")", "", 'def Xform "World"', "{"]
        with self.prim("Scope", "Materials"):
            for name, inputs in self.materials.items():
                out = f"token outputs:surface.connect = </World/Materials/{name}/Surface.outputs:surface>"
                shader = ['uniform token info:id = "UsdPreviewSurface"', "token outputs:surface"]
                shader += [f"{key} = {value}" for key, value in inputs.items()]
                with self.prim("Material", name, [out]), self.prim("Shader", "Surface", shader):
                    pass
        path.write_text("\n".join([*head, *self.lines, "}"]) + "\n", encoding="utf-8", newline="\n")


class _Prim:
    def __init__(self, stage, head, body):
        self.stage, self.head, self.body = stage, head, body

    def __enter__(self):
        self.stage.put(self.head, "{")
        self.stage.depth += 1
        self.stage.put(*self.body)

    def __exit__(self, *_):
        self.stage.depth -= 1
        self.stage.put("}")


def bind(material):
    return f"rel material:binding = </World/Materials/{material}>"


def place(at, turn=0.0, scale=(1, 1, 1)):
    return [
        f"double3 xformOp:translate = {vec(at)}",
        f"float xformOp:rotateZ = {num(turn)}",
        f"float3 xformOp:scale = {vec(scale)}",
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateZ", "xformOp:scale"]',
    ]


def transform(frame):
    """The lines of a frame; one that is only a place takes fewer."""
    frame = np.asarray(frame, float)
    if frame.ndim == 1:
        op, line = "xformOp:translate", f"double3 xformOp:translate = {vec(frame)}"
    else:
        op, line = "xformOp:transform", f"matrix4d xformOp:transform = ({', '.join(map(vec, frame))})"
    return [line, f'uniform token[] xformOpOrder = ["{op}"]']


def aimed(eye, target, up=(0, 0, 1)):
    """The frame, rows as USD has them, of something at `eye` whose -Z looks at `target`."""
    eye, back = np.array(eye, float), unit(np.subtract(eye, target))
    right = unit(np.cross(up if abs(np.dot(up, back)) < 0.999 else (0, 1, 0), back))
    frame = np.eye(4)
    frame[:, :3] = right, np.cross(back, right), back, eye
    return frame


# -- glTF --------------------------------------------------------------------------------------------


class Glb:
    """A .glb of plain meshes; the nodes and lights of a million points go in as they are."""

    def __init__(self, extensions):
        self.binary, self.nodes, self.roots = bytearray(), [], []
        self.document = {
            "asset": {"version": "2.0", "generator": "scenes/seed"},
            "extensionsUsed": extensions,
            "materials": [], "meshes": [], "accessors": [], "bufferViews": [],
        }  # fmt: skip

    def node(self, **row):
        self.roots.append(len(self.nodes))
        self.nodes.append(row)

    def mesh(self, name, points, triangles, color, smooth=False, nits=0.0):
        """A mesh with a matt material of its own; one that glows reflects nothing."""
        attributes = {"POSITION": self._accessor(turned(points), "<f4", "VEC3")}
        if smooth:
            attributes["NORMAL"] = self._accessor(turned(vertex_normals(points, triangles)), "<f4", "VEC3")
        indices = self._accessor(np.ravel(triangles)[:, None], "<u4", "SCALAR")
        material = {
            "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": 0},
            "extensions": {"KHR_materials_specular": {"specularFactor": 0}},
        }
        if nits:
            material["emissiveFactor"] = [1, 1, 1]
            material["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": nits}
        self.document["materials"].append(material)
        number = len(self.document["meshes"])
        self.document["meshes"].append(
            {"primitives": [{"attributes": attributes, "indices": indices, "material": number}]}
        )
        self.node(name=name, mesh=number)

    def camera(self, eye, target, wide_deg=50.0):
        tall = 2 * math.atan(math.tan(math.radians(wide_deg) / 2) * 9 / 16)
        lens = {"yfov": tall, "aspectRatio": 16 / 9, "znear": 0.01}
        self.document["cameras"] = [{"type": "perspective", "perspective": lens}]
        frame = aimed(eye, target)
        frame[:, :3] = turned(frame[:, :3])
        self.node(name="Camera", camera=0, matrix=[float(num(x)) for x in frame.ravel()])

    def save(self, path):
        self.document |= {"scene": 0, "scenes": [{"nodes": self.roots}], "nodes": self.nodes}
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document, separators=(",", ":")).encode()
        chunks = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", bytes(self.binary))]
        size = 12 + sum(8 + len(data) for _, data in chunks)
        with path.open("wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, size))
            for kind, data in chunks:
                file.write(struct.pack("<I4s", len(data), kind) + data)

    def _accessor(self, rows, kind, shape):
        data = np.asarray(rows, kind)
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": data.nbytes}
        self.binary += data.tobytes()
        self.document["bufferViews"].append(view)
        self.document["accessors"].append({
            "bufferView": len(self.document["bufferViews"]) - 1,
            "componentType": 5126 if kind == "<f4" else 5125, "type": shape, "count": len(data),
            "min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist(),
        })  # fmt: skip
        return len(self.document["accessors"]) - 1


def turned(points):
    """Z up to +Y up."""
    x, y, z = np.asarray(points, float).T
    return np.stack([x, z, -y], axis=1)


# -- shapes and chance -------------------------------------------------------------------------------


def unit(v):
    v = np.asarray(v, float)
    return v / np.linalg.norm(v, axis=-1, keepdims=True)


def vertex_normals(points, triangles):
    a, b, c = (points[np.asarray(triangles)[:, k]] for k in range(3))
    normals = np.zeros_like(points, dtype=float)
    for k in range(3):
        np.add.at(normals, np.asarray(triangles)[:, k], np.cross(b - a, c - a))
    return unit(normals)


def ball(times):
    """The unit sphere: an icosahedron of which each triangle was divided in four so many times."""
    g = (1 + 5**0.5) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g)]
    points += [(0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    triangles = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4)]
    triangles += [(11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8)]
    triangles += [(3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
    points = [tuple(unit(p)) for p in points]
    for _ in range(times):
        middle, finer = {}, []

        def between(i, j):
            key = (min(i, j), max(i, j))
            if key not in middle:
                middle[key] = len(points)
                points.append(tuple(unit(np.add(points[i], points[j]))))
            return middle[key]

        for a, b, c in triangles:
            ab, bc, ca = between(a, b), between(b, c), between(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        triangles = finer
    return np.array(points), np.array(triangles)


def lathe(profile, sides=48):
    """A profile of (radius, height), from the bottom up, turned about Z."""
    angle = np.arange(sides) * 2 * np.pi / sides
    points = [(r * np.cos(a), r * np.sin(a), z) for r, z in profile for a in angle]
    triangles = []
    for ring in range(len(profile) - 1):
        for i in range(sides):
            a, b = ring * sides + i, ring * sides + (i + 1) % sides
            triangles += [(a, b, b + sides), (a, b + sides, a + sides)]
    return np.array(points), np.array(triangles)


def brick(low, high):
    """A box of its own corners for each side."""
    low, high = np.array(low, float), np.array(high, float)
    points, triangles = [], []
    for axis in range(3):
        for side in (0, 1):
            u, v = (axis + 1) % 3, (axis + 2) % 3
            corners = [(0, 0), (1, 0), (1, 1), (0, 1)] if side else [(0, 0), (0, 1), (1, 1), (1, 0)]
            first = len(points)
            for a, b in corners:
                p = np.empty(3)
                p[axis], p[u], p[v] = (low, high)[side][axis], (low, high)[a][u], (low, high)[b][v]
                points.append(p)
            triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    return np.array(points), np.array(triangles)


def spread(count, low, high, shift=0.5):
    """`count` places between two corners, evenly spread (the R sequence of Roberts), whatever the count."""
    low, high = np.array(low, float), np.array(high, float)
    root = 2.0
    for _ in range(40):
        root = (1 + root) ** (1 / (len(low) + 1))
    steps = root ** -np.arange(1, len(low) + 1)
    return low + (high - low) * ((shift + np.arange(1, count + 1)[:, None] * steps) % 1)


def blend(colors, t):
    """The colour at each t in [0, 1] along a ramp of colours."""
    colors = np.array(colors, float)
    at = np.linspace(0, 1, len(colors))
    return np.stack([np.interp(t, at, colors[:, k]) for k in range(3)], axis=-1)
