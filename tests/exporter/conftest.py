"""Exports small stages in this process and reads the glTF back."""

import io
import json
import os
import struct
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "scripts"))

from usd_gltf.cli import main  # noqa: E402

_COMPONENTS = {5126: np.float32, 5125: np.uint32, 5123: np.uint16}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass
class Export:
    """What one run of the exporter left behind."""

    code: int
    out: str
    err: str
    path: Path
    report_path: Path

    @property
    def report(self) -> dict:
        return json.loads(self.report_path.read_text())

    def warned(self, category: str | None = None) -> set[str]:
        lines = self.report["warnings"]
        return {line["what"] for line in lines if category in (None, line["category"])}

    def noted(self) -> set[str]:
        return {note["what"] for note in self.report["notes"]}

    def said(self) -> str:
        """All warnings and notes as one text."""
        return "\n".join(f"{line['what']}: {line['why']}" for line in self.report["warnings"] + self.report["notes"])


class Gltf:
    """A glTF file read plainly: nodes by USD path, accessors as arrays, world matrices."""

    def __init__(self, path: Path) -> None:
        data = path.read_bytes()
        if data[:4] == b"glTF":
            (length,) = struct.unpack_from("<I", data, 12)
            self.json = json.loads(data[20 : 20 + length])
            self.buffer = data[28 + length :]
        else:
            self.json = json.loads(data)
            uri = self.json.get("buffers", [{}])[0].get("uri")
            self.buffer = (path.parent / uri).read_bytes() if uri else b""
        self.held: set[tuple[int, str]] = set()
        """Channels of nodes whose values are held from key to key."""
        self.nodes = self.json.get("nodes", [])
        self.parents = {c: i for i, n in enumerate(self.nodes) for c in n.get("children", [])}
        self.by_path = {n["extras"]["usdPath"]: i for i, n in enumerate(self.nodes) if "extras" in n}

    def node(self, path: str) -> dict:
        return self.nodes[self.by_path[path]]

    def lux(self, path: str) -> dict:
        return self.node(path)["extras"]["usdLux"]

    def light(self, path: str) -> dict:
        index = self.node(path)["extensions"]["KHR_lights_punctual"]["light"]
        return self.json["extensions"]["KHR_lights_punctual"]["lights"][index]

    def primitives(self, path: str) -> list[dict]:
        return self.json["meshes"][self.node(path)["mesh"]]["primitives"]

    def material(self, path: str, primitive: int = 0) -> dict:
        return self.json["materials"][self.primitives(path)[primitive]["material"]]

    def nits(self, path: str, primitive: int = 0) -> np.ndarray:
        material = self.material(path, primitive)
        strength = material.get("extensions", {}).get("KHR_materials_emissive_strength", {})
        factor = np.array(material.get("emissiveFactor", [0.0] * 3))
        assert (factor <= 1).all()
        return factor * strength.get("emissiveStrength", 1.0)

    def accessor(self, index: int) -> np.ndarray:
        accessor = self.json["accessors"][index]
        view = self.json["bufferViews"][accessor["bufferView"]]
        width = _WIDTHS[accessor["type"]]
        array = np.frombuffer(
            self.buffer, _COMPONENTS[accessor["componentType"]], accessor["count"] * width, view["byteOffset"]
        )
        return array.reshape(-1, width) if width > 1 else array

    def attribute(self, path: str, name: str, primitive: int = 0) -> np.ndarray:
        return self.accessor(self.primitives(path)[primitive]["attributes"][name])

    def triangles(self, path: str, primitive: int = 0) -> np.ndarray:
        """Local corner positions (t, 3, 3)."""
        indices = self.accessor(self.primitives(path)[primitive]["indices"]).reshape(-1, 3)
        return self.attribute(path, "POSITION", primitive)[indices].astype(float)

    def weights(self, path: str, seconds: float) -> np.ndarray:
        """Weights of a node's morph targets, linear between keys and held outside."""
        count = len(self.primitives(path)[0].get("targets", []))
        if "weights" not in self.channels(path):
            return np.zeros(count)
        times, values = self.channels(path)["weights"]
        return np.array([np.interp(seconds, times, column) for column in values.reshape(len(times), count).T])

    def deformed(self, path: str, seconds: float, name: str = "POSITION", primitive: int = 0) -> np.ndarray:
        """An attribute with the morph targets of a time added."""
        found = self.attribute(path, name, primitive).astype(float)
        for weight, target in zip(self.weights(path, seconds), self.primitives(path)[primitive].get("targets", []), strict=True):
            found = found + weight * self.accessor(target[name])
        return found

    def deformed_triangles(self, path: str, seconds: float, primitive: int = 0) -> np.ndarray:
        """World corner positions (t, 3, 3) at a time."""
        indices = self.accessor(self.primitives(path)[primitive]["indices"]).reshape(-1, 3)
        world = self.world(path, seconds)
        return self.deformed(path, seconds, primitive=primitive)[indices] @ world[:3, :3].T + world[:3, 3]

    def area_vectors(self, path: str, primitive: int = 0) -> np.ndarray:
        corners = self.triangles(path, primitive)
        return np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2

    def area(self, path: str) -> float:
        """World-space area in square metres."""
        linear = self.world(path)[:3, :3]
        total = 0.0
        for primitive in range(len(self.primitives(path))):
            corners = self.triangles(path, primitive) @ linear.T
            cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
            total += np.linalg.norm(cross, axis=1).sum() / 2
        return total

    def world(self, path: str, seconds: float | None = None) -> np.ndarray:
        """World matrix, at the nearest animation key if a time is given (the last one where keys are held)."""
        index, matrix = self.by_path[path], np.eye(4)
        while index is not None:
            node = dict(self.nodes[index])
            if seconds is not None:
                for key, (times, values) in self._channels(index).items():
                    held = max(np.searchsorted(times, np.float32(seconds), side="right") - 1, 0)
                    near = held if (index, key) in self.held else np.abs(times - seconds).argmin()
                    node[key] = values[near].tolist()
            matrix = local_matrix(node) @ matrix
            index = self.parents.get(index)
        return matrix

    def channels(self, path: str) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        return self._channels(self.by_path[path])

    def image(self, info: dict) -> np.ndarray:
        """Codes in [0, 1] of a texture's embedded picture, (h, w, 3)."""
        image = self.json["images"][self.json["textures"][info["index"]]["source"]]
        view = self.json["bufferViews"][image["bufferView"]]
        data = self.buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB"), dtype=float) / 255

    def light_map(self, path: str) -> np.ndarray:
        """Nits of an emissive texture's texels."""
        code = self.image(self.material(path)["emissiveTexture"])
        linear = np.where(code <= 0.04045, code / 12.92, ((code + 0.055) / 1.055) ** 2.4)
        return linear * self.nits(path)

    def _channels(self, node: int) -> dict[str, tuple[np.ndarray, np.ndarray]]:
        found = {}
        for animation in self.json.get("animations", []):
            for channel in animation["channels"]:
                if channel["target"]["node"] == node:
                    sampler = animation["samplers"][channel["sampler"]]
                    if sampler["interpolation"] == "STEP":
                        self.held.add((node, channel["target"]["path"]))
                    else:
                        assert sampler["interpolation"] == "LINEAR"
                    found[channel["target"]["path"]] = (
                        self.accessor(sampler["input"]),
                        self.accessor(sampler["output"]),
                    )
        return found


def local_matrix(node: dict) -> np.ndarray:
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    rotation = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * np.array(node.get("scale", (1, 1, 1)))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


@pytest.fixture
def export(tmp_path, capsys):
    """`export(usda_or_path, *arguments, out=...)` runs the exporter; text becomes scene.usda."""

    def run(source, *arguments: str, out: str = "scene.glb") -> Export:
        if isinstance(source, str):
            text = source if source.startswith("#usda") else HEADER + source
            source = tmp_path / "scene.usda"
            # A statement must end before the brace: lets tests write one-line prims.
            source.write_text(text.replace("}", "\n}"))
        output = tmp_path / out
        try:
            code = main([str(source), str(output), *arguments])
        except SystemExit as stop:
            code = stop.code
        captured = capsys.readouterr()
        report = output.with_name(output.name + ".report.json")
        return Export(code, captured.out, captured.err, output, report)

    return run


@pytest.fixture
def gltf(export):
    """The same, read back; the export must succeed."""

    def run(source, *arguments: str, out: str = "scene.glb") -> Gltf:
        result = export(source, *arguments, out=out)
        assert result.code == 0, result.err
        return Gltf(result.path)

    return run


@pytest.fixture
def shared() -> Path:
    """The folder of real inputs, if it is here."""
    folder = Path(os.environ.get("CANDELABRA_SHARED", ROOT.parent / "shared"))
    if not folder.is_dir():
        pytest.skip("no folder of real inputs (CANDELABRA_SHARED)")
    return folder


HEADER = """#usda 1.0
(
    metersPerUnit = 1
    upAxis = "Y"
)
"""
