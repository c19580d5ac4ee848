"""USD prims compiled into a plain tree, each prototype once.

What is invisible, of another purpose, or not there at all is left out here; what has no carrier is
reported here. The tree knows nothing of glTF nodes: `node_writer` stamps it, as often as instances
ask for it.
"""

from __future__ import annotations

import bisect
import functools
import math
import re
from dataclasses import dataclass, field, replace

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade

from . import curves, gprims
from .arnold_placement import placement
from .cameras import read_camera
from .filter_kinds import RODS, kind_of, world_matrix
from .fog import is_fog, read_fog
from .instancers import Placements, Room, read_placements
from .light_attributes import arnold_names
from .light_filters import FilterReader
from .light_inputs import SIZES, Light, light_type, read_light
from .light_networks import LightNetworks
from .mesh import MeshReader, MeshSource
from .progress import Progress
from .report import Notebook
from .stage import PREDICATE, PROTOTYPE_PREDICATE, Frames, changes
from .transforms import between, column
from .vanishing import dark_while_hidden, holds_camera, holds_light, is_darkened, is_drawn, seen_over_time

_POLE_Z = np.array([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]], dtype=float)
"""DomeLight_1 with its pole along Z: local +Y goes to +Z, +Z to -Y (usdLux/schema.usda)."""
_SETTINGS = re.compile(r"Arnold(NodeGraph|Options|\w+Filter|Driver\w+|ColorManager\w+|Imager\w+)(?<!LightFilter)")
"""arnold-usd's types that are nothing in the scene: graphs of shaders, of which those that read them say what is lost, and
how Arnold renders and writes pictures."""


@dataclass(frozen=True)
class Seen:
    """At which of the sampled time codes a prim is seen, as far as its visibility and that above it change."""

    at: np.ndarray | None = None
    drawn: np.ndarray | None = None
    """The same, of the nodes that hide what is drawn below them."""
    is_left_out: bool = False
    """Whether what is drawn is hidden at the first frame, which counts."""


_ALWAYS = Seen()


@dataclass
class Prim:
    """A prim to be exported, in its parent's space."""

    path: str
    name: str
    local: np.ndarray
    """(4, 4), or (times, 4, 4) if it moves: one for each of `Frames.codes`."""
    resets: bool = False
    mesh: MeshSource | None = None
    light: Light | None = None
    light_path: str = ""
    """The path of the light's own prim, whose collections link it."""
    filters: tuple[str, ...] = ()
    """The paths of the filters of its light that stand at nodes of their own."""
    camera: tuple[dict, dict] | None = None
    fog: dict | None = None
    filter: dict | None = None
    instances: list[tuple[Prim, Placements]] = field(default_factory=list)
    children: list[Prim] = field(default_factory=list)
    seen: np.ndarray | None = None
    """At which of `Frames.codes` it is seen, with all below it, if that changes and is drawn."""
    lit: bool = False
    """Whether there is a light in the subtree (then world matrices matter)."""

    @property
    def is_empty(self) -> bool:
        """Whether nothing would be exported."""
        return not (self.mesh or self.light or self.camera or self.fog or self.filter or self.instances or self.children)


class PrimTree:
    """Compiles a stage."""

    def __init__(
        self,
        stage: Usd.Stage,
        meshes: MeshReader,
        frames: Frames,
        purposes: tuple[str, ...],
        meters_per_unit: float,
        networks: LightNetworks,
        report: Notebook,
        progress: Progress,
    ) -> None:
        self.stage, self.meshes, self.frames, self.progress = stage, meshes, frames, progress
        self.purposes, self.meters_per_unit, self.networks, self.report = purposes, meters_per_unit, networks, report
        self.lights = report.about("lights")
        self._prototypes: dict[tuple, Prim | None] = {}
        self._open: set[str] = set()
        self._lights: dict[tuple[str, str], Light] = {}
        self._dark: dict[tuple[str, bytes], Light] = {}
        self._geometry_lights: dict[str, Usd.Prim] = {}
        self._lit_geometry: set[str] = set()
        self._has_fog = False
        self._room = Room()
        self._filters = FilterReader(frames, meters_per_unit)
        self._world_filters: dict[str, Prim] = {}
        """Arnold's light filters, which stand by matrices of their own, by path."""
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), PREDICATE):
            progress.total += 1
            self._has_fog |= is_fog(prim)
            if prim.GetTypeName() == "GeometryLight":
                light = UsdGeom.Imageable(prim)
                if light.ComputeVisibility(frames.first) == UsdGeom.Tokens.invisible:
                    continue
                for target in prim.GetRelationship("geometry").GetTargets():
                    self._geometry_lights[str(target)] = prim

    def roots(self) -> list[Prim]:
        """The exported prims at the top of the stage."""
        top = self.stage.GetPseudoRoot().GetFilteredChildren(PREDICATE)
        found = [self._compile(prim, None, PREDICATE) for prim in top]
        for target, light in self._geometry_lights.items():
            if target not in self._lit_geometry:
                there = bool(self.stage.GetPrimAtPath(target))
                why = f"its geometry {target} is {'not shown, or no mesh' if there else 'not there'}"
                self.lights.warn(light.GetPath(), "GeometryLight emits nothing", why)
        return [prim for prim in found if prim is not None] + list(self._world_filters.values())

    def _compile(self, prim: Usd.Prim, purpose, predicate, above: Seen = _ALWAYS) -> Prim | None:
        """The tree below `prim`, or None if there is nothing in it to export. `above` says how what is above hides it."""
        if prim.IsA(UsdShade.Material) or prim.IsA(UsdShade.NodeGraph):
            return None
        path = prim.GetPath()
        self.progress.read(str(path))
        shown, seen, own = True, above, None
        if prim.IsA(UsdGeom.Imageable):
            imageable = UsdGeom.Imageable(prim)
            if changes(imageable.GetVisibilityAttr(), self.frames):
                seen, own = self._seen(prim, imageable, above)
            elif imageable.GetVisibilityAttr().Get(self.frames.first) == UsdGeom.Tokens.invisible:
                seen = replace(above, at=np.zeros(len(self.frames.codes), bool), is_left_out=True)
            if seen.at is not None and not seen.at.any() and not holds_camera(prim):
                self.report.count("invisible prims")
                return None
            purpose = imageable.ComputePurposeInfo(purpose) if purpose else imageable.ComputePurposeInfo()
            shown = str(purpose.purpose) in self.purposes
        compiled = Prim(str(path), prim.GetName(), np.eye(4))
        if prim.IsA(UsdGeom.Xformable) or kind_of(prim) in RODS:
            compiled.local, compiled.resets = self._local(prim)
            if not (np.abs(compiled.local) < 3e38).all():
                self.report.warn(path, "transform that is not finite", "the prim and all below it are left out")
                return None
        if prim.IsA(UsdGeom.PointInstancer):
            if shown:
                self._instances(prim, compiled, seen)
        else:
            if shown and (not seen.is_left_out or is_darkened(prim) or prim.IsA(UsdGeom.Camera)):
                self._content(prim, compiled, seen)
            for child in prim.GetFilteredChildren(predicate):
                below = self._compile(child, purpose, predicate, seen)
                if below is not None:
                    compiled.children.append(below)
        if compiled.camera is not None or compiled.light is not None:
            placed = placement(prim, self.frames, self.report.about("cameras") if compiled.camera else self.lights)
            if placed is not None:
                _insert(compiled, placed)
        if compiled.light is not None and compiled.light.pole_z:
            _insert(compiled, _POLE_Z)
        if compiled.light is not None and compiled.light.stretch is not None:
            _insert(compiled, compiled.light.stretch)
        if compiled.mesh is not None:
            movement = self.meshes.skinning.movement(prim)
            if movement is not None:
                _insert(compiled, movement)
        if compiled.is_empty:
            return None
        mask = seen.drawn if compiled.resets else own
        compiled.seen = mask if mask is not None and is_drawn(prim) else None
        if compiled.light is not None and compiled.light.type in SIZES and compiled.light.visibility.get("shadows"):
            compiled.seen = seen.at  # its shape is there even while it is dark
        compiled.lit = (
            compiled.light is not None
            or any(child.lit for child in compiled.children)
            or any(prototype.lit for prototype, _ in compiled.instances)
        )
        return compiled

    def _seen(self, prim: Usd.Prim, imageable: UsdGeom.Imageable, above: Seen) -> tuple[Seen, np.ndarray | None]:
        """How a prim whose visibility changes is seen, and when a node around it is to be; None if there is to be none."""
        own = seen_over_time(imageable, self.frames)
        at = own if above.at is None else above.at & own
        if not at.any():
            return replace(above, at=at, is_left_out=True), None
        if not is_drawn(prim):
            return replace(above, at=at), None
        if holds_camera(prim):
            report = self.lights if holds_light(prim) else self.report.about("animation")
            why = "with a camera below it, it has no carrier; the first frame's is used, but by lights without a mesh"
            report.warn(prim.GetPath(), "animated visibility", why)
            return replace(above, at=at, is_left_out=above.is_left_out or not own[self.frames.rest]), None
        return replace(above, at=at, drawn=own if above.drawn is None else above.drawn & own), own

    def _local(self, prim: Usd.Prim) -> tuple[np.ndarray, bool]:
        """The local matrix, or one for each frame, and whether it ignores the parents'."""
        xformable = UsdGeom.Xformable(prim)
        resets = xformable.GetResetXformStack()
        if xformable.TransformMightBeTimeVarying() and len(self.frames.codes) > 1:
            matrices = _over_time(xformable, self.frames)
            if not np.array_equal(matrices.max(axis=0), matrices.min(axis=0)):
                return matrices, resets
            return matrices[0], resets
        return column(xformable.GetLocalTransformation(self.frames.first)), resets

    def _content(self, prim: Usd.Prim, compiled: Prim, seen: Seen) -> None:
        """What the prim itself is: a mesh, a light, a camera, fog, or something without a carrier."""
        path = prim.GetPath()
        kind = str(prim.GetTypeName())
        geometry_light = self._geometry_lights.get(str(path))
        if kind == "Volume":
            compiled.fog = read_fog(prim, self.frames, self.report.about("other"))
        if prim.IsA(UsdGeom.Mesh) or kind in gprims.TYPES or kind == curves.TYPE:
            light_prim = geometry_light or prim
            is_light = light_type(light_prim) is not None
            compiled.mesh = self.meshes.read(prim)
            for name in filter(prim.HasAttribute, () if is_light else arnold_names("light")):
                if prim.GetAttribute(name).Get(self.frames.first):
                    why = f"a {kind} is no mesh light of Arnold's here; all that it emits is the glow of its material"
                    self.lights.warn(path, name, why)
            if compiled.mesh is not None and is_light:
                compiled.light = self._light(light_prim, "MeshLight")
                compiled.light_path = str(light_prim.GetPath())
                compiled.filters = self._placed(light_prim, "MeshLight")
                self._lit_geometry.add(str(path))
        elif prim.IsA(UsdGeom.Camera):
            is_hidden = seen.at is not None and not seen.at.any()
            compiled.camera = read_camera(prim, self.frames, self.meters_per_unit, is_hidden, self.report.about("cameras"))
        elif kind == "GeometryLight":
            if not prim.GetRelationship("geometry").GetTargets():
                self.lights.warn(path, "GeometryLight emits nothing", "its geometry relationship is empty")
        elif light_type(prim) is not None:
            compiled.light = self._light(prim, light_type(prim))
            compiled.light_path = str(path)
            compiled.filters = self._placed(prim, light_type(prim))
            if seen.at is not None and is_darkened(prim) and not seen.at.all():
                compiled.light = self._vanishing(compiled.light, seen.at)
        elif kind.endswith("LightFilter"):
            compiled.filter = self._filter(prim)  # a light that names it says what becomes of it
        elif compiled.fog is None and (prim.IsA(UsdGeom.Gprim) or kind == "Volume"):
            self.report.warn(path, kind, "this kind of geometry has no carrier; it is left out")
        elif kind and not prim.GetPrimTypeInfo().GetSchemaType() and not _SETTINGS.fullmatch(kind):
            report = self.lights if "Light" in kind else self.report.about("other")
            report.warn(path, f"unknown type {kind}", "no schema is registered for it")

    def _light(self, prim: Usd.Prim, kind: str) -> Light:
        """The light read once for all instances that share its prim."""
        source = prim.GetPrimInPrototype() if prim.IsInstanceProxy() else prim
        key = (str(source.GetPath()), kind)
        if key not in self._lights:
            self._lights[key] = read_light(prim, kind, self.frames, self.networks, self._filters, self._has_fog, self.lights)
        return self._lights[key]

    def _filter(self, prim: Usd.Prim) -> dict | None:
        """`extras.usdLightFilter`, if a filter can be carried."""
        read = self._filters.carrier(prim)
        return None if isinstance(read, str) else read

    def _placed(self, light: Usd.Prim, kind: str) -> tuple[str, ...]:
        """The paths of a light's filters that are carried, in the instance that it is in; Arnold's are put at the top."""
        filters = self._filters.carried(light, kind)
        for prim in filters:
            path = str(prim.GetPath())
            if prim.GetTypeName() == "Shader" and path not in self._world_filters:
                matrix = world_matrix(prim, self.frames)
                local = np.eye(4) if matrix is None else matrix
                self._world_filters[path] = Prim(path, prim.GetName(), local, filter=self._filter(prim))
        return tuple(str(prim.GetPath()) for prim in filters)

    def _vanishing(self, light: Light, seen: np.ndarray) -> Light | None:
        """The light, dark while it is hidden; None if it is never seen."""
        key = (light.path, seen.tobytes())
        if key not in self._dark:
            self._dark[key] = dark_while_hidden(light, seen)
        return self._dark[key] if seen.any() else None

    def _instances(self, prim: Usd.Prim, compiled: Prim, seen: Seen) -> None:
        """The prototypes of a PointInstancer, which is `seen` so, and where they are put."""
        path = str(prim.GetPath())
        targets = UsdGeom.PointInstancer(prim).GetPrototypesRel().GetForwardedTargets()
        for number, groups in read_placements(prim, self.frames, self._room, self.report).items():
            if number < 0 or number >= len(targets):
                why = f"protoIndices name {number}, but there are {len(targets)} prototypes; they are left out"
                self.report.warn(path, "instances without a prototype", why)
                continue
            prototype = self._prototype(str(targets[number]), path, seen)
            if prototype is None:
                continue
            drawn = is_drawn(self.stage.GetPrimAtPath(targets[number]))
            for placements in groups:
                own, at = prototype, placements.seen
                if at is not None and (prototype.lit or _resets(prototype)):
                    masks = (at if mask is None else mask & at for mask in (seen.at, seen.drawn))
                    own = self._prototype(str(targets[number]), path, Seen(*masks, seen.is_left_out))
                if own is not None:
                    compiled.instances.append((own, placements if drawn else replace(placements, seen=None)))
                    self.report.count("instances", len(placements.numbers))

    def _prototype(self, target: str, instancer: str, seen: Seen) -> Prim | None:
        """A prototype compiled once for all instancers that are `seen` alike. What hides them hides it, not what
        is above it."""
        key = (target, *(None if mask is None else mask.tobytes() for mask in (seen.at, seen.drawn)), seen.is_left_out)
        if target in self._open:
            self.report.warn(instancer, "PointInstancer inside its own prototype", f"{target} is left out there")
            return None
        if key not in self._prototypes:
            prim = self.stage.GetPrimAtPath(target)
            if not prim:
                why = f"there is no prim {target}; its instances are left out"
                self.report.warn(instancer, "missing prototype", why)
                return None
            self._open.add(target)
            self._prototypes[key] = self._compile(prim, None, PROTOTYPE_PREDICATE, seen)
            self._open.discard(target)
        return self._prototypes[key]


def _resets(prim: Prim) -> bool:
    """Whether something below a prim is not moved with it."""
    return any(child.resets or _resets(child) for child in prim.children)


def _over_time(xformable: UsdGeom.Xformable, frames: Frames) -> np.ndarray:
    """Local matrices (times, 4, 4)."""
    ops = xformable.GetOrderedXformOps()
    if frames.is_number.all() or not any(_is_sampled_matrix(op) for op in ops):
        return np.array([column(xformable.GetLocalTransformation(code)) for code in frames.codes])
    return functools.reduce(np.matmul, [_op_over_time(op, frames) for op in ops])


def _is_sampled_matrix(op: UsdGeom.XformOp) -> bool:
    return op.GetOpType() == UsdGeom.XformOp.TypeTransform and op.MightBeTimeVarying()


def _op_over_time(op: UsdGeom.XformOp, frames: Frames) -> np.ndarray:
    """Matrices (times, 4, 4) of one op.

    USD interpolates a sampled matrix by its numbers, which shrinks what turns. So time codes that are no frames lie
    between their neighbours among frames and authored samples, as `between` goes. Where USD holds the matrix
    (all over a stage of held interpolation; before a sample that is a value block), it is held.
    """
    found = np.array([column(op.GetOpTransform(code)) for code in frames.codes])
    if not _is_sampled_matrix(op):
        return found
    at, samples = UsdGeom.XformOp(op.GetAttr()).GetOpTransform, op.GetTimeSamples()
    rows, share, starts, ends = [], [], [], []
    for row in np.flatnonzero(~frames.is_number):
        code = frames.codes[row]
        whole = frames.first + math.floor(code - frames.first)
        upto, since = bisect.bisect_right(samples, code), bisect.bisect_left(samples, code)
        low = max([whole, *samples[max(upto - 1, 0) : upto]])
        high = min([whole + 1, *samples[since : since + 1]])
        start = at(low)
        if at(code) != start:
            rows.append(row)
            share.append((code - low) / (high - low))
            starts.append(column(start))
            ends.append(column(at(high)))
    if rows:
        means = between(np.array(starts), np.array(ends), np.array(share))
        found[rows] = [column(Gf.Matrix4d(mean.T).GetInverse()) for mean in means] if op.IsInverseOp() else means
    return found


def _insert(compiled: Prim, matrix: np.ndarray) -> None:
    """Put a matrix, or one for each frame, between a prim and its own content, but not its children. They collapse
    with a matrix that is singular, as of a joint of scale 0."""
    compiled.local = compiled.local @ matrix
    for child in compiled.children:
        if not child.resets:
            child.local = np.linalg.pinv(matrix) @ child.local
