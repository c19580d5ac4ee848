"""Looks of surfaces that are shader networks: MaterialX's and Arnold's.

`surface_models` says what a surface's inputs mean, `evaluator` what they read, `look_builder` how glTF says that. What has
no counterpart is reported by the material's path and the input's name; the input's default stands in.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable

import numpy as np
from pxr import Usd, UsdShade

from .arnold_nodes import FUNCTIONS as ARNOLD
from .evaluator import Evaluator
from .look_builder import LookBuilder, Value
from .materials import Look
from .network_images import NetworkImages, flattened, single_read
from .preview_surface import PreviewSurfaces
from .quantities import Lost, Part, Primvar, Quantity
from .report import Notebook
from .shader_network import Link, Network, Node, literals
from .stage import PROTOTYPE_PREDICATE, Frames, changes
from .surface_models import COLOR, MODELS, Inputs, Model, Read
from .textures import Textures

_THROUGH = {"arnold:two_sided": "front", "arnold:ray_switch_shader": "camera", "arnold:aov_write_rgb": "passthrough"}
"""Surfaces that hand on one of their inputs."""
_GEOMETRY = ("Nworld", "Tworld", "Bworld", "Nobject", "Pobject", "Pworld", "position")
"""What a network may read of the geometry besides primvars."""
_BASE_COLORS = ("base_color", "diffuseColor", "Kd_color")
_TILES = ((0, 0), (1, 0), (0, 1))


def is_read(identifier: str) -> bool:
    """Whether a surface shader with this `info:id` may be one of these."""
    return identifier.startswith(("ND_", "arnold:"))


class NetworkSurfaces:
    """Reads surfaces that are networks."""

    def __init__(
        self, textures: Textures, builder: LookBuilder, previews: PreviewSurfaces, frames: Frames, report: Notebook
    ) -> None:
        self.images = NetworkImages(textures)
        self.builder, self.previews, self.frames, self.report = builder, previews, frames, report
        self._primvars: set[str] | None = None

    def look(self, path: str, shader: UsdShade.Shader) -> Look | None:
        """The look of a material's surface; None if no model has its shader. Raises `Lost` for networks that are too large."""
        self._stage = shader.GetPrim().GetStage()
        node = self._surface(path, Network(shader).surface)
        model = MODELS.get(node.kind)
        if model is None and node.kind in ARNOLD | {"arnold:image": None}:
            model = COLOR
        if model is None:
            return None
        inputs = _Inputs(self, path, node, model)
        read = model.read(inputs)
        inputs.report_lost()
        values = {name: inputs.value(name, quantity) for name, quantity in read.items() if name != "emissiveColor"}
        values["emissiveColor"] = inputs.emission(read.get("emissiveColor", Quantity.of((0.0,) * 3)))
        if "useSpecularWorkflow" in read:
            return self.previews.look_of(path, values)
        return self.builder.look(path, values)

    def is_anywhere(self, primvar: str) -> bool:
        """Whether any prim of the stage has a primvar."""
        if self._primvars is None:
            self._primvars = {
                name.removeprefix("primvars:")
                for prim in Usd.PrimRange(self._stage.GetPseudoRoot(), PROTOTYPE_PREDICATE)
                for name in prim.GetAuthoredPropertyNames()
                if name.startswith("primvars:")
            }
        return primvar in self._primvars

    def _surface(self, path: str, node: Node) -> Node:
        """The shader that says what the surface is, behind those that only hand it on."""
        for _ in range(64):
            through = _THROUGH.get(node.kind)
            found = node.inputs.get(through) if through else None
            if not isinstance(found, Link):
                break
            others = [name for name in node.inputs if name != through and isinstance(node.inputs[name], Link)]
            if others:
                what = f"{node.kind.removeprefix('arnold:')} {', '.join(sorted(others))}"
                self.report.warn(path, what, f"{through} is used for all")
            node = found.node
        return node


class _Inputs(Inputs):
    """The inputs of one surface (`surface_models.Inputs`), at one frame and on one tile of texture coordinates."""

    def __init__(
        self, surfaces: NetworkSurfaces, path: str, node: Node, model: Model, code: float | None = None,
        tile: tuple[int, int] = (0, 0), quiet: bool = False,
    ) -> None:  # fmt: skip
        self.surfaces, self.path, self.node, self.model, self.quiet = surfaces, path, node, model, quiet
        self.code = surfaces.frames.first if code is None else code
        report = surfaces.report
        self.evaluator = Evaluator(path, surfaces.images, self.code, report, tile)
        self.canvas = self.evaluator.canvas
        self.name = node.kind.removeprefix("arnold:") if node.kind in MODELS else "surface"
        self._lights = report.about("lights")

    # -- surface_models.Inputs -------------------------------------------------------------------

    def get(self, name: str) -> Quantity:
        """See `surface_models.Inputs`."""
        self.evaluator.report = self._lights if name in self.model.emission else self.surfaces.report
        if not name:  # the shader itself is the colour
            return self._or_default(name, lambda: self._held(name, self.evaluator.output(Link(self.node, "out"))))
        return self._or_default(
            name, lambda: self._held(name, self.evaluator.input(self.node, name, self._default(name)))
        )

    def _held(self, name: str, value: Quantity) -> Quantity:
        """A quantity that glTF may hold: of the primvars only colours of a mesh, and those that nothing has."""
        value = _by_default(value, lambda primvar: bool(primvar.default) and not self.surfaces.is_anywhere(primvar.name))
        for basis in value.bases():
            if isinstance(basis, Primvar) and (name not in _BASE_COLORS or _primvar_color(value.wide(3)) is None):
                raise Lost(f"it depends on {basis.name}, which no texture can hold")
        return value

    def normal(self, name: str, read: Read, to: str = "normal") -> None:
        """See `surface_models.Inputs`."""
        try:
            found = self.evaluator.normal(self.node, name)
        except Lost as lost:
            self._say(name, f"{lost}; the surface's own normals are used")
            return
        if found is not None and not found[0].is_constant:
            coded, scale = found
            read[to] = Quantity([part.scaled(2.0).plus(Part(-1.0)) for part in coded.parts])
            read[f"{to}Scale"] = Quantity.of(scale)

    def changed(self, name: str, why: str) -> None:
        """See `surface_models.Inputs`."""
        self._say(name, why)

    # -- the rest --------------------------------------------------------------------------------

    def report_lost(self) -> None:
        """Report the inputs without a counterpart, and those that are animated."""
        for key, why in self.model.lost.items():
            gate, _, name = key.rpartition("|")
            try:
                if gate and not self._matters(gate, 0.0):
                    continue
                neutral = self.model.neutral.get(name, self._default(name))
                if self._matters(name, neutral):
                    self._say(name, f"{why}; left out")
            except Lost:
                self._say(name, f"{why}; left out")
        still = [name for name in self.node.inputs if name not in self.model.emission]
        for name in still:
            if any(self._varies(literal.attribute) for literal in literals(self.node, [name])):
                self._say(name, "materials have no animation; the first frame is used", "animated ")

    def value(self, name: str, quantity: Quantity) -> Value:
        """A quantity as what `look_builder` reads."""
        try:
            return self._value(name, quantity)
        except Lost as lost:
            report = self._lights if name == "emissiveColor" else self.surfaces.report
            instead = "its light is left out" if name == "emissiveColor" else "a default is used"
            report.warn(self.path, f"{self.name} {name}", f"{lost}; {instead}")
            return Value()

    def emission(self, quantity: Quantity) -> Value:
        """The glow, over time if it is the same all over the surface."""
        names = self.model.emission
        varying = [
            literal for literal in literals(self.node, [n for n in names if n]) if self._varies(literal.attribute)
        ]
        if names == ("",):
            varying = [literal for literal in literals(self.node, self.node.inputs) if self._varies(literal.attribute)]
        if not varying:
            return self.value("emissiveColor", quantity)
        rows = []
        for code in self.surfaces.frames.codes:
            at = _Inputs(self.surfaces, self.path, self.node, self.model, code, quiet=True)
            read = self.model.read(at)["emissiveColor"]
            if not read.is_constant:
                self._lights.warn(
                    self.path, f"animated {self.name} emission", "it has a texture; the first frame is used"
                )
                return self.value("emissiveColor", quantity)
            rows.append(tuple(read.constant))
        return Value(rows[self.surfaces.frames.rest], keys=rows)

    def _value(self, name: str, quantity: Quantity) -> Value:
        if quantity.is_constant:
            numbers = quantity.constant
            return Value(tuple(numbers) if len(numbers) > 1 else float(numbers[0]))
        if name == "diffuseColor" and (found := _primvar_color(quantity)):
            return found
        read = single_read(quantity)
        if read is not None:
            return Value(texture=read)
        planes, mapping = self.canvas.planes(quantity)
        if self.canvas.depends_on_coordinates:
            self._check_tiles(name, planes)
        digest = hashlib.blake2b(self.path.encode(), digest_size=4).hexdigest()
        stem = f"{self.path.rsplit('/', 1)[-1]}_{name}_{digest}"
        return Value(texture=flattened(stem, planes, mapping))

    def _check_tiles(self, name: str, planes: np.ndarray) -> None:
        """A pattern that is computed of texture coordinates is one texture only if it repeats."""
        for tile in _TILES[1:]:
            other = _Inputs(self.surfaces, self.path, self.node, self.model, self.code, tile, quiet=True)
            shifted, _ = other.canvas.planes(self.model.read(other)[name])
            if shifted.shape != planes.shape or np.mean(np.abs(shifted - planes)) > 1e-3 * max(
                1.0, float(np.abs(planes).max())
            ):
                raise Lost("it is computed of texture coordinates and does not repeat with them")
        height, width = planes.shape[1:]
        why = f"it is computed of texture coordinates; it becomes an image of {width} x {height} pixels"
        self.surfaces.report.note(self.path, f"{self.name} {name}", why)

    def _or_default(self, name: str, evaluate: Callable[[], Quantity]) -> Quantity:
        try:
            return evaluate()
        except Lost as lost:
            if name in self.model.emission:
                self._say(name, f"{lost}; its light is left out")
                return Quantity.of(0.0)
            default = Quantity.of(self._default(name))
            self._say(name, f"{lost}; the default is used")
            return default

    def _default(self, name: str) -> object:
        definition = self.node.definition
        port = definition.inputs.get(name) if definition else None
        value = port.value if port else self.model.defaults.get(name)
        return 0.0 if value is None else value

    def _matters(self, name: str, neutral: object) -> bool:
        found = self.node.inputs.get(name)
        if isinstance(found, Link) and name.endswith(("normal", "tangent")):
            return found.node.kind not in ("normal", "tangent", "bitangent")
        if name.endswith(("normal", "tangent")):
            return False
        value = self.evaluator.input(self.node, name, self._default(name))
        return not value.is_constant or not np.allclose(value.constant, np.asarray(neutral, dtype=float))

    def _varies(self, attribute) -> bool:
        return attribute is not None and changes(attribute, self.surfaces.frames)

    def _say(self, name: str, why: str, prefix: str = "") -> None:
        if not self.quiet:
            report = self._lights if name in self.model.emission else self.surfaces.report
            report.warn(self.path, f"{prefix}{self.name} {name}".strip(), why)


def _by_default(quantity: Quantity, is_default: Callable[[Primvar], bool]) -> Quantity:
    """A quantity with what primvars are by default in the place of some of them."""
    by_default = {basis: basis.default[basis.index] for basis in quantity.bases() if isinstance(basis, Primvar) and is_default(basis)}
    if not by_default:
        return quantity
    return Quantity([
        Part(
            part.constant + sum(weight * by_default.get(basis, 0.0) for basis, weight in part.terms.items()),
            {basis: weight for basis, weight in part.terms.items() if basis not in by_default},
        )
        for part in quantity.parts
    ])


def _primvar_color(quantity: Quantity) -> Value | None:
    """A colour that is a primvar of the mesh, perhaps scaled; None if it is none."""
    scale, names = [], set()
    for index, part in enumerate(quantity.parts):
        if part.constant != 0.0 or len(part.terms) != 1:
            return None
        ((basis, weight),) = part.terms.items()
        if not isinstance(basis, Primvar) or basis.index != index:
            return None
        names.add((basis.name, basis.default))
        scale.append(weight)
    if len(names) != 1 or len(scale) != 3:
        return None
    ((name, default),) = names
    if name in _GEOMETRY or " " in name:
        return None
    if name == "displayColor" and scale == [1.0] * 3:
        return Value(display_color=True)
    default = (*default[:3], 0.0, 0.0, 0.0)[:3]
    return Value(default, display_color=True, primvar=name, primvar_scale=tuple(scale))
