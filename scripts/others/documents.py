"""glTF for scenes that are rendered by others too: a small writer, and a reader of meshes, points and the camera.

Everything is in glTF's own axes, +Y up. Written scenes are matt or of materials that are given as they stand in glTF.
"""

import argparse
import json
import math
import struct
from pathlib import Path

import numpy as np

MATT = {"KHR_materials_specular": {"specularFactor": 0.0}}
TYPES = {5120: "i1", 5121: "u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
PARTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def matt(color, glow=(0, 0, 0), two_sided=True):
    """A material that reflects by Lambert's law, and shines with a radiance."""
    most = max(*glow, 0.0)
    row = {
        "pbrMetallicRoughness": {"baseColorFactor": [*map(float, color), 1.0], "metallicFactor": 0.0},
        "extensions": dict(MATT),
        "doubleSided": two_sided,
    }
    if most > 0:
        row["emissiveFactor"] = [float(part) / most for part in glow]
        row["extensions"]["KHR_materials_emissive_strength"] = {"emissiveStrength": float(most)}
    return row


def looking(eye, target, up=(0, 1, 0)):
    """The matrix, columns as axes, of what stands at `eye` and looks along its -Z at `target`."""
    eye, target = np.array(eye, float), np.array(target, float)
    back = (eye - target) / np.linalg.norm(eye - target)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :3] = np.stack([right, np.cross(back, right), back], axis=1)
    matrix[:3, 3] = eye
    return matrix


class Document:
    """A glTF file in the making."""

    def __init__(self):
        self.binary, self.rows = bytearray(), {}

    def add(self, table, row):
        """Puts a row into one of the file's tables and returns its number."""
        rows = self.rows.setdefault(table, [])
        rows.append(row)
        return len(rows) - 1

    def mesh(self, points, triangles, material, uv=None, normals=None):
        attributes = {"POSITION": self._accessor(points, "<f4", "VEC3")}
        if normals is not None:
            attributes["NORMAL"] = self._accessor(normals, "<f4", "VEC3")
        if uv is not None:
            attributes["TEXCOORD_0"] = self._accessor(uv, "<f4", "VEC2")
        indices = self._accessor(np.ravel(triangles)[:, None], "<u4", "SCALAR")
        primitive = {"attributes": attributes, "indices": indices, "material": material}
        return self.add("meshes", {"primitives": [primitive]})

    def node(self, matrix=None, **row):
        if matrix is not None:
            row["matrix"] = np.asarray(matrix, float).T.ravel().tolist()
        return self.add("nodes", row)

    def light(self, kind, color, intensity, matrix, extras=None, **more):
        number = self.add("lights", {"type": kind, "color": [*map(float, color)], "intensity": float(intensity), **more})
        row = {"extras": extras} if extras else {}
        self.node(matrix, extensions={"KHR_lights_punctual": {"light": number}}, **row)

    def camera(self, matrix, tall_rad, aspect):
        lens = {"yfov": float(tall_rad), "aspectRatio": float(aspect), "znear": 0.01}
        self.node(matrix, camera=self.add("cameras", {"type": "perspective", "perspective": lens}))

    def save(self, path):
        lights = self.rows.pop("lights", [])
        used = {name for row in self.rows.get("materials", []) for name in row.get("extensions", {})}
        used |= {"KHR_lights_punctual"} if lights else set()
        document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": list(range(len(self.rows["nodes"])))}]}
        document |= self.rows | {"buffers": [{"byteLength": len(self.binary)}], "extensionsUsed": sorted(used)}
        if lights:
            document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
        text = json.dumps(document).encode()
        chunks = [(b"JSON", text + b" " * (-len(text) % 4)), (b"BIN\0", bytes(self.binary))]
        with Path(path).open("wb") as file:
            file.write(struct.pack("<4sII", b"glTF", 2, 12 + sum(8 + len(data) for _, data in chunks)))
            for kind, data in chunks:
                file.write(struct.pack("<I4s", len(data), kind) + data)

    def _accessor(self, rows, kind, shape):
        data = np.ascontiguousarray(rows, kind)
        view = self.add("bufferViews", {"buffer": 0, "byteOffset": len(self.binary), "byteLength": data.nbytes})
        self.binary += data.tobytes()
        row = {"bufferView": view, "componentType": 5126 if kind == "<f4" else 5125, "type": shape, "count": len(data)}
        bounds = {"min": data.min(axis=0).tolist(), "max": data.max(axis=0).tolist()}
        return self.add("accessors", row | bounds)


# -- reading -----------------------------------------------------------------------------------------


class Plain:
    """What other renderers are given of a .glb: matt meshes with their places, points, the camera.

    `meshes` are (points, triangles, colour, radiance, whether two-sided), `places` (mesh, matrix), `points` (place,
    candela), `camera` (matrix, vertical angle). Lengths are metres of world space.
    """

    def __init__(self, path):
        data = Path(path).read_bytes()
        size = struct.unpack_from("<I", data, 12)[0]
        self.document, self.binary = json.loads(data[20 : 20 + size]), data[28 + size :]
        self.meshes, self.places, self.points, self.camera = [], [], [], None
        self.first = []
        for mesh in self.document.get("meshes", []):
            self.first.append(len(self.meshes))
            self.meshes += [self._primitive(primitive) for primitive in mesh["primitives"]]
        self.first.append(len(self.meshes))
        for root in self.document["scenes"][self.document.get("scene", 0)]["nodes"]:
            self._walk(root, np.eye(4))

    def _walk(self, number, above):
        node = self.document["nodes"][number]
        matrix = above @ local(node)
        if "mesh" in node:
            self.places += [(mesh, matrix) for mesh in range(*self.first[node["mesh"] : node["mesh"] + 2])]
        if "camera" in node:
            self.camera = (matrix, self.document["cameras"][node["camera"]]["perspective"]["yfov"])
        light = node.get("extensions", {}).get("KHR_lights_punctual")
        if light:
            row = self.document["extensions"]["KHR_lights_punctual"]["lights"][light["light"]]
            candela = np.array(row.get("color", (1, 1, 1)), float) * row.get("intensity", 1.0)
            if row["type"] == "spot":
                outer = row.get("spot", {}).get("outerConeAngle", math.pi / 4)
                candela *= (1 - math.cos(outer)) / 2
            self.points.append((matrix[:3, 3], candela))
        for child in node.get("children", []):
            self._walk(child, matrix)

    def _primitive(self, primitive):
        material = self.document["materials"][primitive["material"]]
        extensions = material.get("extensions", {})
        strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
        glow = np.array(material.get("emissiveFactor", (0, 0, 0)), float) * strength
        color = material["pbrMetallicRoughness"].get("baseColorFactor", (1, 1, 1, 1))[:3]
        points = self._rows(primitive["attributes"]["POSITION"])
        triangles = self._rows(primitive["indices"]).reshape(-1, 3)
        return points, triangles.astype("u4"), np.array(color, float), glow, material.get("doubleSided", False)

    def _rows(self, number):
        row = self.document["accessors"][number]
        view = self.document["bufferViews"][row["bufferView"]]
        start = view.get("byteOffset", 0) + row.get("byteOffset", 0)
        parts, kind = PARTS[row["type"]], np.dtype(TYPES[row["componentType"]])
        step = view.get("byteStride", parts * kind.itemsize)
        return np.ndarray((row["count"], parts), kind, self.binary, start, (step, kind.itemsize)).copy()

    def saved(self, path):
        """Writes it as a .glb, which has nothing but what `Plain` reads; returns the path."""
        document = Document()
        for points, triangles, color, glow, two_sided in self.meshes:
            material = document.add("materials", matt(color, glow, two_sided or not glow.any()))
            document.mesh(points, triangles, material)
        for i, (mesh, matrix) in enumerate(self.places):
            document.node(matrix, name=f"mesh_{i}", mesh=mesh)
        for at, candela in self.points:
            most = max(candela.max(), 1e-30)
            place = np.eye(4)
            place[:3, 3] = at
            document.light("point", candela / most, most, place)
        document.camera(*self.camera, 16 / 9)
        document.save(path)
        return path


def local(node):
    """The matrix of a node."""
    if "matrix" in node:
        return np.array(node["matrix"], float).reshape(4, 4).T
    matrix = np.eye(4)
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    matrix[:3, :3] = [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]
    matrix[:3, :3] *= node.get("scale", (1, 1, 1))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def asked(doc):
    """The options of a program that renders a plain scene by another renderer."""
    parser = argparse.ArgumentParser(description=doc.splitlines()[0])
    parser.add_argument("scene")
    parser.add_argument("output")
    parser.add_argument("--samples", type=int, default=64)
    parser.add_argument("--seeds", type=int, nargs="+", default=[0])
    parser.add_argument("--size", type=lambda text: tuple(map(int, text.split("x"))), default=(160, 90))
    parser.add_argument("--depth", type=int, default=1)
    parser.add_argument("--threads", type=int, default=1)
    return parser.parse_args()
