"""Writes the little USD text these scenes need: prims, meshes, lights. Numbers are rounded, so bytes repeat."""

import math


def num(x):
    text = "%.6g" % round(float(x), 3)
    return "0" if text == "-0" else text


def vec(v):
    return "(" + ", ".join(num(x) for x in v) + ")"


def array(items, fmt=num):
    return "[" + ", ".join(fmt(i) for i in items) + "]"


class Layer:
    """One .usda file with one or more root prims; indents by itself."""

    def __init__(self, path, doc, library="../materials.usda"):
        self.path, self.library = path, library
        self.depth, self.lines, self.used, self.roots = 0, [], None, []
        self.doc = doc

    def put(self, text=""):
        self.lines.append("    " * self.depth + text if text else "")

    def prim(self, kind, name, meta=(), body=()):
        """`with layer.prim("Xform", "A"):` opens a prim; `body` lines go in first."""
        return _Prim(self, kind, name, list(meta), list(body))

    def root(self, name, kind="component"):
        """A root prim that carries its own materials, so that a reference to it brings them along."""
        return _Root(self, name, kind)

    def bind(self, material):
        self.used.add(material)
        return f"rel material:binding = <{self.here}/Materials/{material}>"

    def save(self, folder):
        head = [
            "#usda 1.0",
            "(",
            f'    doc = """{self.doc}"""',
            f'    defaultPrim = "{self.roots[0]}"',
            "    metersPerUnit = 0.01",
            '    upAxis = "Z"',
            ")",
            "",
        ]
        target = folder / self.path
        target.parent.mkdir(parents=True, exist_ok=True)
        target.write_text("\n".join(head + self.lines).rstrip() + "\n", encoding="utf-8", newline="\n")


class _Prim:
    def __init__(self, layer, kind, name, meta, body):
        self.layer, self.meta, self.body = layer, meta, body
        self.head = f'def {kind} "{name}"' if kind else f'def "{name}"'

    def __enter__(self):
        layer = self.layer
        if self.meta:
            layer.put(self.head + " (")
            for line in self.meta:
                layer.put("    " + line)
            layer.put(")")
        else:
            layer.put(self.head)
        layer.put("{")
        layer.depth += 1
        for line in self.body:
            layer.put(line)
        return layer

    def __exit__(self, *_):
        self.layer.depth -= 1
        self.layer.put("}")
        self.layer.put()


class _Root(_Prim):
    def __init__(self, layer, name, kind):
        super().__init__(layer, "Xform", name, [f'kind = "{kind}"'], [])
        self.name = name

    def __enter__(self):
        self.layer.roots.append(self.name)
        self.layer.here, self.layer.used = "/" + self.name, set()
        return super().__enter__()

    def __exit__(self, *exc):
        layer = self.layer
        if layer.used:
            with layer.prim("Scope", "Materials"):
                for name in sorted(layer.used):
                    layer.put(
                        f'def Material "{name}" (prepend references = '
                        f"@{layer.library}@</Materials/{name}>) {{}}"
                    )
        super().__exit__(*exc)


class Mesh:
    """Polygons with a material each. Vertices are rounded to `digits` (of a centimetre); equal ones are shared."""

    def __init__(self, uv_size=None, digits=2):
        self.points, self.index, self.faces, self.uvs = [], {}, [], []
        self.uv_size, self.digits = uv_size, digits

    def vertex(self, p):
        key = tuple(round(float(c), self.digits) for c in p)
        if key not in self.index:
            self.index[key] = len(self.points)
            self.points.append(key)
        return self.index[key]

    def face(self, corners, material, hole=False, uv=None):
        """Counter-clockwise seen from outside. Without `uv` a meshwide uv_size projects along the main axis."""
        self.faces.append(([self.vertex(p) for p in corners], material, hole))
        if uv is None and self.uv_size:
            uv = self.project(corners)
        self.uvs.append(uv or [(0, 0)] * len(corners))

    def split(self, wanted):
        """Two meshes: the faces whose material is `wanted`, and the rest without texture coordinates."""
        parts = Mesh(1, self.digits), Mesh(None, self.digits)
        for (face, material, hole), uv in zip(self.faces, self.uvs):
            part = parts[0 if wanted(material) else 1]
            part.face([self.points[i] for i in face], material, hole, uv if part.uv_size else None)
        return parts

    def project(self, corners):
        n = [0.0, 0.0, 0.0]
        for a, b in zip(corners, list(corners[1:]) + [corners[0]]):
            for k in range(3):
                n[k] += (a[k - 2] - b[k - 2]) * (a[k - 1] + b[k - 1])
        main = max(range(3), key=lambda k: abs(n[k]))
        u, v = [(1, 2), (0, 2), (0, 1)][main]
        return [(c[u] / self.uv_size, c[v] / self.uv_size) for c in corners]

    def triangles(self):
        return sum(len(f[0]) - 2 for f in self.faces if not f[2])

    def write(self, layer, name, meta=(), body=(), left_handed=False, light=False, normals=None, vertex_uv=None):
        materials = sorted({m for _, m, _ in self.faces})
        apis = '"MaterialBindingAPI"' + (', "MeshLightAPI"' if light else "")
        with layer.prim("Mesh", name, [f"prepend apiSchemas = [{apis}]", *meta], body):
            faces = [f[::-1] if left_handed else f for f, _, _ in self.faces]
            uvs = [u[::-1] if left_handed else u for u in self.uvs]
            lo, hi = [[pick(p[k] for p in self.points) for k in range(3)] for pick in (min, max)]
            layer.put(f"float3[] extent = [{vec(lo)}, {vec(hi)}]")
            layer.put("int[] faceVertexCounts = " + array(map(len, faces), str))
            layer.put("int[] faceVertexIndices = " + array((i for f in faces for i in f), str))
            holes = [i for i, f in enumerate(self.faces) if f[2]]
            if holes:
                layer.put("int[] holeIndices = " + array(holes, str))
            layer.put("point3f[] points = " + array(self.points, vec))
            if normals:
                layer.put("normal3f[] normals = " + array(normals, vec) + ' (interpolation = "vertex")')
            if vertex_uv:
                layer.put("texCoord2f[] primvars:st = " + array(vertex_uv, vec) + ' (interpolation = "vertex")')
            elif any(any(any(c) for c in uv) for uv in uvs):
                layer.put(
                    "texCoord2f[] primvars:st = "
                    + array((c for uv in uvs for c in uv), vec)
                    + ' (interpolation = "faceVarying")'
                )
            if left_handed:
                layer.put('uniform token orientation = "leftHanded"')
            layer.put('uniform token subdivisionScheme = "none"')
            if len(materials) == 1:
                layer.put(layer.bind(materials[0]))
                return
            layer.put('uniform token subsetFamily:materialBind:familyType = "partition"')
            for m in materials:
                with layer.prim("GeomSubset", m, ['prepend apiSchemas = ["MaterialBindingAPI"]']):
                    layer.put('uniform token elementType = "face"')
                    layer.put('uniform token familyName = "materialBind"')
                    layer.put("int[] indices = " + array((i for i, f in enumerate(self.faces) if f[1] == m), str))
                    layer.put(layer.bind(m))


def place(translate=None, rotate=None, scale=None):
    """The lines of a transform; `rotate` is degrees about X, Y, Z or one number about Z."""
    out, order = [], []
    if translate is not None:
        out.append(f"double3 xformOp:translate = {vec(translate)}")
        order.append("xformOp:translate")
    if rotate is not None:
        if isinstance(rotate, (int, float)):
            out.append(f"float xformOp:rotateZ = {num(rotate)}")
            order.append("xformOp:rotateZ")
        else:
            out.append(f"float3 xformOp:rotateXYZ = {vec(rotate)}")
            order.append("xformOp:rotateXYZ")
    if scale is not None:
        out.append(f"float3 xformOp:scale = {vec(scale)}")
        order.append("xformOp:scale")
    out.append("uniform token[] xformOpOrder = [" + ", ".join(f'"{o}"' for o in order) + "]")
    return out


def light(layer, kind, name, translate=None, rotate=None, kelvin=None, cone=None, **inputs):
    """A UsdLux light. Keywords become inputs (`treatAsPoint`, `width`, ...); `cone` is (angle, softness)."""
    types = {"color": "color3f", "normalize": "bool", "treatAsPoint": "bool", "texture": "asset"}
    body = place(translate, rotate) if translate is not None or rotate is not None else []
    if kelvin:
        body += ["bool inputs:enableColorTemperature = 1", f"float inputs:colorTemperature = {kelvin}"]
    if cone:
        body += [
            f"float inputs:shaping:cone:angle = {num(cone[0])}",
            f"float inputs:shaping:cone:softness = {num(cone[1])}",
        ]
    for key, value in inputs.items():
        if key == "treatAsPoint":
            body.append(f"bool treatAsPoint = {int(value)}")
            continue
        kind_of = types.get(key, "float")
        text = vec(value) if kind_of == "color3f" else f"@{value}@" if kind_of == "asset" else num(value)
        spot = f"{kind_of} inputs:texture:file" if key == "texture" else f"{kind_of} inputs:{key}"
        body.append(f"{spot} = {text}")
    with layer.prim(kind, name, ['prepend apiSchemas = ["ShapingAPI"]'] if cone else [], body):
        pass


class Dice:
    """A small deterministic generator (PCG-like), so that the layers do not depend on Python's library."""

    def __init__(self, seed):
        self.state = (seed * 0x9E3779B97F4A7C15 + 0x1234567) & (2**64 - 1)

    def __call__(self, lo=0.0, hi=1.0):
        self.state = (self.state * 6364136223846793005 + 1442695040888963407) & (2**64 - 1)
        x = self.state >> 11
        x ^= x >> 25
        return lo + (hi - lo) * ((x * 0x2545F4914F6CDD1D >> 16 & (2**32 - 1)) / 2**32)

    def pick(self, items):
        return items[min(int(self() * len(items)), len(items) - 1)]


def smooth(x):
    x = min(max(x, 0.0), 1.0)
    return x * x * (3 - 2 * x)


def noise(x, y, seed=0):
    """Value noise in [0, 1]."""

    def corner(i, j):
        h = (i * 374761393 + j * 668265263 + seed * 974711) & 0xFFFFFFFF
        h = ((h ^ (h >> 13)) * 1274126177) & 0xFFFFFFFF
        return ((h ^ (h >> 16)) & 0xFFFFFF) / 0xFFFFFF

    i, j = math.floor(x), math.floor(y)
    a, b = smooth(x - i), smooth(y - j)
    low = corner(i, j) * (1 - a) + corner(i + 1, j) * a
    high = corner(i, j + 1) * (1 - a) + corner(i + 1, j + 1) * a
    return low * (1 - b) + high * b
