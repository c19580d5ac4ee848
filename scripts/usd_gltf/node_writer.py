"""Stamps the prim tree into glTF nodes: one node for each prim, and again for each instance.

Every node carries `extras.usdPath`. Instances of a PointInstancer are named by their number in it:
`/World/Lamps[12]` is the twelfth instance, `/World/Lamps[12]/Bulb` what its prototype holds.
"""

from __future__ import annotations

import numpy as np

from .animation import animate, strength_keys, varies
from .gltf_document import Document, numbers
from .instancers import Placements
from .light_carriers import LightCarriers
from .linking import Linking, Place
from .materials import Materials
from .mesh import MeshSource
from .prim_tree import Prim
from .report import Notebook
from .stage import Frames
from .transforms import SHEAR_TOLERANCE, decompose, split_shear
from .vanishing import hide

_DEFAULTS = {"translation": [0.0] * 3, "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0] * 3}


class NodeWriter:
    """Writes nodes below one root that turns stage units and axes into metres and +Y up."""

    def __init__(
        self,
        document: Document,
        materials: Materials,
        carriers: LightCarriers,
        linking: Linking,
        frames: Frames,
        report: Notebook,
    ) -> None:
        self.document, self.materials, self.carriers = document, materials, carriers
        self.linking = linking
        self.frames, self.report = frames, report
        self._meshes: dict[int, int] = {}
        self._still: dict[int, tuple[dict, dict | None]] = {}
        self._top: list[int] = []
        self._placed_at: list[tuple[str, str]] = []
        """The prototypes around what is written, by path, and where they are placed."""

    def write(self, prims: list[Prim], root: dict) -> None:
        """Write all prims under the node `root`."""
        while root["name"] in {prim.name for prim in prims}:
            root["name"] += "_"
        index = self.document.node(root)
        children = [self._prim(prim, prim.path, np.eye(4), ()) for prim in prims]
        children = [child for child in children if child >= 0] + self._top
        if children:
            root["children"] = children
        self.document.roots = [index]

    def _prim(self, prim: Prim, path: str, above: np.ndarray, chain: Place) -> int:
        """The node of a prim that stands under the world matrices `above`, placed by a chain of
        PointInstancers."""
        world = (prim.local if prim.resets else above @ prim.local) if prim.lit else above
        if prim.local.ndim == 3:
            index, outer = self._moving(path, prim.name, prim.local)
        else:
            if id(prim) not in self._still:
                self._still[id(prim)] = _still(prim.local)
            index, outer = self._placed(path, prim.name, *self._still[id(prim)])
        self._fill(index, prim, path, world, chain)
        outer = self._seen(prim, outer)
        if not prim.resets:
            return outer
        # The child of no one: it stands by its own matrix alone.
        self._top.append(outer)
        return -1

    def _fill(self, index: int, prim: Prim, path: str, world: np.ndarray, chain: Place) -> None:
        """Content and children of a node."""
        node, others = self.document.nodes[index], []
        if prim.camera is not None:
            camera, extras = prim.camera
            node["camera"] = self.document.shared("cameras", camera)
            node["extras"]["usdCamera"] = extras
        if prim.fog is not None:
            node["extras"]["usdFog"] = prim.fog
        if prim.filter is not None:
            node["extras"]["usdLightFilter"] = prim.filter | self.linking.filter(prim)
            self.report.count("light filters")
        node["extras"].update(self.linking.node(prim, chain))
        mesh = self.linking.mesh(prim, chain)
        if prim.light is not None:
            self.carriers.carry(prim.light, node, world, mesh)
            node["extras"]["usdLux"].update(self._told(prim))
            others = self._others(prim, path, world, chain)
        elif mesh is not None:
            node["mesh"] = self._mesh(mesh)
            keys = prim.mesh.glow_keys()
            if keys is not None:
                values = strength_keys(self.frames, keys)
                node["extras"]["usdLux"] = {"type": "MeshLight", "inputs": {}, "values": values}
            else:
                prim.mesh.report_still_glow(self.report.about("lights"))
        if mesh is not None and mesh.motion is not None:
            mesh.motion.animate(self.document, index)
            self.report.count("animation channels")
        children = others + [self._prim(child, path + child.path[len(prim.path) :], world, chain) for child in prim.children]
        for prototype, placements in prim.instances:
            children += self._instances(prototype, placements, path, world, (prim.path, *chain))
        children = [child for child in children if child >= 0]
        if children:
            node["children"] = children

    def _others(self, prim: Prim, path: str, world: np.ndarray, chain: Place) -> list[int]:
        """Nodes of the lights that a light of several shapings is at other times."""
        nodes = []
        for light in prim.light.others:
            extras = {"usdPath": f"{path}[shaping {light.lit_at:.9g}]", **self.linking.node(prim, chain)}
            node = {"name": prim.name, "extras": extras}
            nodes.append(self.document.node(node))
            self.carriers.carry(light, node, world, None)
            node["extras"]["usdLux"].update(self._told(prim))
        return nodes

    def _told(self, prim: Prim) -> dict:
        """What the `usdLux` extras of a prim's light get of links and filters. A filter in the prototype that the light is in
        is placed with it."""
        told = self.linking.light(prim)
        for path in prim.filters:
            around = (place for place in reversed(self._placed_at) if path.startswith(f"{place[0]}/"))
            prototype, at = next(around, ("", ""))
            told.setdefault("filters", []).append(at + path[len(prototype) :])
        return told

    def _mesh(self, mesh: MeshSource) -> int:
        if id(mesh) not in self._meshes:
            body = {"name": mesh.name, "primitives": mesh.primitives(self.materials)}
            if mesh.motion is not None:
                body["extras"] = {"targetNames": mesh.motion.names}
            self._meshes[id(mesh)] = self.document.shared("meshes", body)
        return self._meshes[id(mesh)]

    def _instances(
        self, prototype: Prim, placements: Placements, path: str, world: np.ndarray, chain: Place
    ) -> list[int]:
        """Nodes of all instances of one prototype; the prototype's root is the instance's node."""
        local = prototype.local if prototype.local.ndim == 2 else prototype.local[:, None]
        matrices = placements.matrices @ local
        moving = matrices.ndim == 4
        static = None if moving else decompose(matrices)
        nodes = []
        for position, number in enumerate(placements.numbers):
            name = f"{path}[{number}]"
            matrix = matrices[:, position] if moving else matrices[position]
            if moving:
                index, outer = self._moving(name, prototype.name, matrix)
            elif static[3][position] > SHEAR_TOLERANCE:
                index, outer = self._placed(name, prototype.name, *_still(matrix))
            else:
                place = _place(*(part[position] for part in static[:3]))
                index, outer = self._placed(name, prototype.name, place, None)
            self._placed_at.append((prototype.path, name))
            self._fill(index, prototype, name, world @ matrix if prototype.lit else world, chain)
            self._placed_at.pop()
            outer = self._seen(prototype, outer)
            if placements.seen is not None:
                outer = hide(self.document, self.frames, outer, prototype.name, placements.seen)
                self.report.count("animation channels")
            nodes.append(outer)
        return nodes

    def _seen(self, prim: Prim, node: int) -> int:
        """The index of a prim's outermost node, which hides it where it vanishes."""
        if prim.seen is None:
            return node
        self.report.count("animation channels")
        return hide(self.document, self.frames, node, prim.name, prim.seen)

    def _placed(self, path: str, name: str, place: dict, outside: dict | None) -> tuple[int, int]:
        """The index of a node that stands still, and that of the node to hang under the parent."""
        node = {"name": name, "extras": {"usdPath": path}, **place}
        index = self.document.node(node)
        if outside is None:
            return index, index
        return index, self.document.node({"name": f"{name}_shear", "children": [index], **outside})

    def _moving(self, path: str, name: str, local: np.ndarray) -> tuple[int, int]:
        """The index of a node that follows `local` (times, 4, 4), and that of the node to hang under the
        parent. Shear takes two nodes, and is exact at every frame."""
        sheared = decompose(local)[3].max() > SHEAR_TOLERANCE
        outside, inside = split_shear(local) if sheared else (None, local)
        node = {"name": name, "extras": {"usdPath": path}}
        index = self._following(node, inside)
        if outside is None:
            return index, index
        return index, self._following({"name": f"{name}_shear", "children": [index]}, outside)

    def _following(self, node: dict, local: np.ndarray) -> int:
        """Index of `node`, made to follow matrices without shear."""
        translation, rotation, scale, _ = decompose(local)
        node.update(_place(*(part[self.frames.rest] for part in (translation, rotation, scale))))
        index = self.document.node(node)
        tracks = {"translation": translation, "rotation": rotation, "scale": scale}
        for key, values in tracks.items():
            if varies(values):
                node.setdefault(key, list(_DEFAULTS[key]))
        self.report.count("animation channels", animate(self.document, index, self.frames, tracks))
        return index


def _still(local: np.ndarray) -> tuple[dict, dict | None]:
    """Node properties that hold a matrix; a second set, for a node around it, if it has shear."""
    translation, rotation, scale, shear = decompose(local[None])
    if shear[0] <= SHEAR_TOLERANCE:
        return _place(translation[0], rotation[0], scale[0]), None
    outer, inner = (decompose(matrix) for matrix in split_shear(local[None]))
    return _place(*(part[0] for part in inner[:3])), _place(*(part[0] for part in outer[:3]))


def _place(translation: np.ndarray, rotation: np.ndarray, scale: np.ndarray) -> dict:
    """What differs from glTF's defaults."""
    place = {}
    for key, value in (("translation", translation), ("rotation", rotation), ("scale", scale)):
        rounded = numbers(value)
        if rounded != _DEFAULTS[key]:
            place[key] = rounded
    return place


def root_node(meters_per_unit: float, z_up: bool) -> dict:
    """The node that turns stage units into metres and the stage's up axis into +Y."""
    node: dict = {"name": "stage"}
    if z_up:
        node["rotation"] = numbers((-np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)))
    if meters_per_unit != 1.0:
        node["scale"] = numbers([meters_per_unit] * 3)
    return node
