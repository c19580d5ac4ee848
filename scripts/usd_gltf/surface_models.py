"""The surface models of MaterialX and Arnold in glTF's terms.

standard_surface (Autodesk), OpenPBR, glTF's own and UsdPreviewSurface as MaterialX defines them, `surface_unlit`; Arnold's
standard_surface, openpbr_surface, standard_hair, lambert, standard, and colours that stand as a surface. What MaterialX's own
translation graphs (`libraries/bxdf/translation`) say of standard_surface and OpenPBR is followed, and what they leave out
is said where it stands. The result has the names of `look_builder`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from .quantities import Canvas, Lost, Quantity, total

Read = dict[str, Quantity]
_WHITE = Quantity.of((1.0, 1.0, 1.0))
_BLACK = Quantity.of((0.0, 0.0, 0.0))
_ONE = Quantity.of(1.0)
_ZERO = Quantity.of(0.0)
_LUMA = Quantity.of((0.2722287, 0.6740818, 0.0536895))
"""MaterialX's, by which its translation graph makes a colour of opacity into a number."""


class Inputs(Protocol):
    """The inputs of one surface shader."""

    canvas: Canvas

    def get(self, name: str) -> Quantity:
        """A colour or a number; its default, which is reported, if it is lost."""

    def normal(self, name: str, read: Read, to: str = "normal") -> None:
        """Put the normal map of an input, if it has one, into `read`, under the name `to`."""

    def changed(self, name: str, why: str) -> None:
        """Report that an input is not carried as it is."""


@dataclass(frozen=True)
class Model:
    """A surface model."""

    read: Callable[[Inputs], Read]
    defaults: dict[str, object] = field(default_factory=dict)
    """Defaults of the inputs, where no definition has them."""
    lost: dict[str, str] = field(default_factory=dict)
    """Inputs without a counterpart, by the input that turns them on (empty: always), which are reported where they are not
    neutral."""
    neutral: dict[str, object] = field(default_factory=dict)
    """What does nothing, where that is not the default."""
    emission: tuple[str, ...] = ()
    """The inputs that make the surface glow."""


def _zero(value: Quantity) -> bool:
    return value.is_constant and not value.constant.any()


def _or(inputs: Inputs, name: str, fallback: Quantity, compute: Callable[[], Quantity]) -> Quantity:
    """What is computed with an input; the fallback, which is reported, if that cannot be computed."""
    try:
        return compute()
    except Lost as lost:
        inputs.changed(name, f"{lost}; left out")
        return fallback


def _times(inputs: Inputs, weight: str, color: str, is_light: bool = False) -> Quantity:
    """A weight times a colour, which is not looked at where the weight is 0."""
    factor = inputs.get(weight)
    if _zero(factor):
        return _BLACK
    value = inputs.get(color).wide(3)
    return _or(inputs, weight, _BLACK if is_light else value, lambda: inputs.canvas.multiply(value, factor))


def _coat_tint(inputs: Inputs, coat: Quantity, base: Quantity) -> Quantity:
    """What is below a coat, seen through its colour."""
    if _zero(coat):
        return base
    tint = inputs.get("coat_color").wide(3)
    return _or(inputs, "coat_color", base, lambda: inputs.canvas.multiply(base, inputs.canvas.mix(_WHITE, tint, coat)))


def _scattered(inputs: Inputs, weight: str, color: str, base: Quantity) -> Quantity:
    """Subsurface scattering as diffuse reflection of its colour."""
    amount = inputs.get(weight)
    if _zero(amount):
        return base
    inputs.changed(weight, "it is drawn as diffuse reflection of the subsurface colour")
    below = inputs.get(color).wide(3)
    return _or(inputs, color, base, lambda: inputs.canvas.mix(base, below, amount))


def _transmitted(inputs: Inputs, names: tuple[str, str, str, str], base: Quantity, read: Read) -> Quantity:
    """Transmission; gives the base colour, which is glTF's tint of what passes."""
    weight, color, depth, thin = names
    amount = inputs.get(weight)
    if _zero(amount):
        return base
    read["transmission"], read["thinWalled"] = amount, inputs.get(thin)
    distance, tint = inputs.get(depth), inputs.get(color).wide(3)
    if not _zero(read["thinWalled"]):
        distance = _ZERO  # a wall without an inside is tinted as a whole
    if not (distance.is_constant and tint.is_constant) and not _zero(distance):
        inputs.changed(color, "glTF's attenuation is constant; the tint is put on the surface")
        distance = _ZERO
    if not _zero(distance):
        read["attenuationColor"], read["attenuationDistance"] = tint, distance
        tint = _WHITE
    return _or(inputs, color, base, lambda: inputs.canvas.mix(base, tint, inputs.canvas.multiply(amount, amount)))


def _opacity(inputs: Inputs, name: str) -> Quantity:
    value = inputs.get(name)
    if len(value.parts) == 1:
        return value
    value = Quantity(value.parts[:3])
    first = value.parts[0]
    if all(part.terms == first.terms and part.constant == first.constant for part in value.parts):
        return Quantity([first])
    inputs.changed(name, "glTF's opacity has no colour; its luminance is used")
    return total(inputs.canvas.multiply(value, _LUMA))


def _standard_surface(inputs: Inputs) -> Read:
    """MaterialX's `standard_surface_to_gltf_pbr`; subsurface scattering, which it leaves out, is diffuse here."""
    base = _times(inputs, "base", "base_color")
    metalness, coat = inputs.get("metalness"), inputs.get("coat")
    read: Read = {
        "metallic": metalness,
        "roughness": inputs.get("specular_roughness"),
        "ior": inputs.get("specular_IOR"),
    }
    is_metal = metalness.is_constant and metalness.constant[0] == 1.0
    if not is_metal:
        base = _scattered(inputs, "subsurface", "subsurface_color", base)
    base = _coat_tint(inputs, coat, base)
    names = ("transmission", "transmission_color", "transmission_depth", "thin_walled")
    read["diffuseColor"] = base if is_metal else _transmitted(inputs, names, base, read)
    _specular(inputs, ("specular", "specular_color"), metalness, read, weighs_tint=False)
    if not _zero(coat):
        read["clearcoat"], read["clearcoatRoughness"] = coat, inputs.get("coat_roughness")
        inputs.normal("coat_normal", read, "clearcoatNormal")
    read["emissiveColor"] = _times(inputs, "emission", "emission_color", is_light=True)
    read["opacity"] = _opacity(inputs, "opacity")
    inputs.normal("normal", read)
    return read


def _open_pbr(inputs: Inputs) -> Read:
    """`open_pbr_surface_to_standard_surface`, then as above. The weight of the specular lobe is one of what is reflected
    straight on (OpenPBR 1.1, "Dielectric base"), and of the whole metal."""
    canvas = inputs.canvas
    base = _times(inputs, "base_weight", "base_color")
    metalness, coat = inputs.get("base_metalness"), inputs.get("coat_weight")
    read: Read = {
        "metallic": metalness,
        "roughness": inputs.get("specular_roughness"),
        "ior": inputs.get("specular_ior"),
    }
    is_metal = metalness.is_constant and metalness.constant[0] == 1.0
    if not is_metal:
        base = _scattered(inputs, "subsurface_weight", "subsurface_color", base)
    if not _zero(metalness):
        weight = inputs.get("specular_weight")
        metal = base
        base = _or(
            inputs, "specular_weight", base, lambda: canvas.mix(metal, canvas.multiply(metal, weight), metalness)
        )
    darkening = inputs.get("coat_darkening")
    if not _zero(coat) and not _zero(darkening):
        base = _or(inputs, "coat_darkening", base, lambda: _below_coat(inputs, base, coat, darkening))
    base = _coat_tint(inputs, coat, base)
    names = ("transmission_weight", "transmission_color", "transmission_depth", "geometry_thin_walled")
    read["diffuseColor"] = base if is_metal else _transmitted(inputs, names, base, read)
    _specular(inputs, ("specular_weight", "specular_color"), metalness, read, weighs_tint=True)
    if not _zero(coat):
        read["clearcoat"], read["clearcoatRoughness"] = coat, inputs.get("coat_roughness")
        inputs.normal("geometry_coat_normal", read, "clearcoatNormal")
    read["emissiveColor"] = _times(inputs, "emission_luminance", "emission_color", is_light=True)
    read["opacity"] = _opacity(inputs, "geometry_opacity")
    inputs.normal("geometry_normal", read)
    return read


def _below_coat(inputs: Inputs, base: Quantity, coat: Quantity, darkening: Quantity) -> Quantity:
    below = inputs.canvas.apply(_darkened, base, inputs.get("coat_ior"))
    return inputs.canvas.mix(base, below, inputs.canvas.multiply(coat, darkening))


def _darkened(base: np.ndarray, ior: np.ndarray) -> np.ndarray:
    """What is left of a base colour below a coat that reflects part of it back inside."""
    f0 = ((ior - 1) / (ior + 1)) ** 2
    kept = 1 - (1 - f0) / ior**2
    return base * (1 - kept) / (1 - base * kept)


def _specular(inputs: Inputs, names: tuple[str, str], metalness: Quantity, read: Read, weighs_tint: bool) -> None:
    """The lobe of a dielectric. glTF's metals have one colour, from straight on to the edge."""
    weight, tint = inputs.get(names[0]), inputs.get(names[1]).wide(3)
    is_white = tint.is_constant and (tint.constant == 1.0).all()
    if not _zero(metalness) and not is_white:
        inputs.changed(names[1], "glTF's metals have no colour of their own at the edge")
    if metalness.is_constant and metalness.constant[0] == 1.0:
        return
    if weighs_tint:
        read["specularTint"] = _or(inputs, names[0], tint, lambda: inputs.canvas.multiply(tint, weight))
    else:
        read["specular"], read["specularTint"] = weight, tint


def _gltf_pbr(inputs: Inputs) -> Read:
    read = {
        "diffuseColor": inputs.get("base_color"), "metallic": inputs.get("metallic"), "roughness": inputs.get("roughness"),
        "occlusion": inputs.get("occlusion"), "specular": inputs.get("specular"), "specularTint": inputs.get("specular_color"),
        "ior": inputs.get("ior"), "emissiveColor": _times(inputs, "emissive_strength", "emissive", is_light=True),
    }  # fmt: skip
    mode = inputs.get("alpha_mode")
    if mode.is_constant and mode.constant[0] == 1.0:
        cutoff = inputs.get("alpha_cutoff")
        read["opacity"], read["opacityThreshold"] = inputs.get("alpha"), cutoff
    elif mode.is_constant and mode.constant[0] == 2.0:
        read["opacity"] = inputs.get("alpha")
    coat = inputs.get("clearcoat")
    if not _zero(coat):
        read["clearcoat"], read["clearcoatRoughness"] = coat, inputs.get("clearcoat_roughness")
        inputs.normal("clearcoat_normal", read, "clearcoatNormal")
    amount = inputs.get("transmission")
    if not _zero(amount):
        read["transmission"] = amount
        read["thinWalled"] = Quantity.of(float(_zero(inputs.get("thickness"))))
        read["attenuationColor"], read["attenuationDistance"] = (
            inputs.get("attenuation_color"),
            inputs.get("attenuation_distance"),
        )
    inputs.normal("normal", read)
    return read


def _preview(inputs: Inputs) -> Read:
    """UsdPreviewSurface by MaterialX's definition; its normal is decoded already."""
    names = (
        "diffuseColor", "emissiveColor", "useSpecularWorkflow", "specularColor", "metallic", "roughness", "clearcoat",
        "clearcoatRoughness", "opacity", "opacityThreshold", "ior", "displacement", "occlusion",
    )  # fmt: skip
    read = {name: inputs.get(name) for name in names}
    normal = inputs.get("normal")
    if not normal.is_constant:
        read["normal"] = normal
    return read


def _unlit(inputs: Inputs) -> Read:
    """A surface that only emits."""
    return {
        **_dark(),
        "emissiveColor": _times(inputs, "emission", "emission_color", is_light=True),
        "opacity": inputs.get("opacity"),
    }


def _dark() -> Read:
    return {"diffuseColor": _BLACK, "specular": _ZERO, "roughness": _ONE, "metallic": _ZERO}


def _lambert(inputs: Inputs) -> Read:
    read = {**_dark(), "diffuseColor": _times(inputs, "Kd", "Kd_color"), "opacity": _opacity(inputs, "opacity")}
    inputs.normal("normal", read)
    return read


def _old_standard(inputs: Inputs) -> Read:
    """Arnold 4's `standard`: its diffuse part and its glow."""
    return {**_lambert(inputs), "emissiveColor": _times(inputs, "emission", "emission_color", is_light=True)}


def _hair(inputs: Inputs) -> Read:
    """Arnold's `standard_hair` as a surface: the colour that many hairs have together, and the highlight of one."""
    inputs.changed("base_color", "hair is drawn as a surface of the colour that it has as a whole, which light does not pass")
    is_uneven = not _zero(inputs.get("roughness_anisotropic"))
    across = inputs.get("roughness_azimuthal" if is_uneven else "roughness")
    color = _times(inputs, "base", "base_color")
    pigment = (inputs.get("melanin"), inputs.get("melanin_redness"), across)
    color = _or(inputs, "melanin", color, lambda: inputs.canvas.multiply(color, inputs.canvas.apply(_pigmented, *pigment)))
    diffuse = inputs.get("diffuse")
    if not _zero(diffuse):
        dull = inputs.get("diffuse_color").wide(3)
        color = _or(inputs, "diffuse", color, lambda: inputs.canvas.mix(color, dull, diffuse))
    return {
        "diffuseColor": color, "metallic": _ZERO, "roughness": inputs.get("roughness"), "ior": inputs.get("ior"),
        "specular": _ONE, "specularTint": inputs.get("specular_tint").wide(3), "opacity": _opacity(inputs, "opacity"),
        "emissiveColor": _times(inputs, "emission", "emission_color", is_light=True),
    }  # fmt: skip


def _pigmented(melanin: np.ndarray, redness: np.ndarray, roughness: np.ndarray) -> np.ndarray:
    """The colour of hair with melanin: what it absorbs (MaterialX's `deon_hair_absorption_from_melanin`), and the colour of
    many hairs that absorb so (Chiang et al. 2016, "A Practical and Controllable Hair and Fur Model", section 4.2)."""
    amount = -np.log(np.maximum(1.0 - melanin, 0.0001))
    shape = (3, *(1,) * (np.ndim(amount) - 1))
    brown, red = (np.reshape(absorbed, shape) for absorbed in ((0.419, 0.697, 1.37), (0.187, 0.4, 1.05)))
    absorbed = amount * ((1.0 - redness) * brown + redness * red)
    b = roughness
    spread = 5.969 - 0.215 * b + 2.532 * b**2 - 10.73 * b**3 + 5.574 * b**4 + 0.245 * b**5
    return np.exp(-np.sqrt(np.maximum(absorbed, 0.0)) * spread)


def _color(inputs: Inputs) -> Read:
    """A colour that stands as a surface glows, whatever falls on it."""
    return {**_dark(), "emissiveColor": Quantity(inputs.get("").parts[:3]).wide(3)}


_WORD = {
    "sheen": "glTF's base has no sheen", "fuzz_weight": "glTF's base has no fuzz", "diffuse_roughness": "glTF's diffuse part is Lambert's",
    "anisotropy": "glTF's base has no anisotropy", "film": "glTF's base has no thin film", "scatter": "glTF's volume does not scatter",
    "coat": "glTF's coat has none", "dispersion": "glTF's base has no dispersion",
}  # fmt: skip
_STANDARD_LOST = {
    "sheen": _WORD["sheen"], "diffuse_roughness": _WORD["diffuse_roughness"], "specular_anisotropy": _WORD["anisotropy"],
    "thin_film_thickness": _WORD["film"], "transmission|transmission_scatter": _WORD["scatter"],
    "transmission|transmission_dispersion": _WORD["dispersion"],
    "transmission|transmission_extra_roughness": "glTF's transmission is as rough as its reflection",
    "coat|coat_anisotropy": _WORD["coat"], "coat|coat_IOR": "glTF's coat has an index of refraction of 1.5",
    "coat|coat_affect_color": _WORD["coat"],
    "coat|coat_affect_roughness": _WORD["coat"], "tangent": "tangents follow the texture coordinates",
}  # fmt: skip
"""`gate|input`: an input that matters where the gate is not 0."""
_OPEN_PBR_LOST = {
    "fuzz_weight": _WORD["fuzz_weight"], "base_diffuse_roughness": _WORD["diffuse_roughness"],
    "specular_roughness_anisotropy": _WORD["anisotropy"], "thin_film_weight": _WORD["film"],
    "transmission_weight|transmission_scatter": _WORD["scatter"],
    "transmission_weight|transmission_dispersion_scale": _WORD["dispersion"],
    "coat_weight|coat_roughness_anisotropy": _WORD["coat"], "coat_weight|coat_ior": "glTF's coat has an index of refraction of 1.5",
    "geometry_tangent": "tangents follow the texture coordinates",
}  # fmt: skip
_GLTF_LOST = {
    "sheen_color": _WORD["sheen"], "iridescence": _WORD["film"], "anisotropy_strength": _WORD["anisotropy"],
    "dispersion": _WORD["dispersion"],
    "tangent": "tangents follow the texture coordinates",
}  # fmt: skip
_ARNOLD_STANDARD = {
    "base": 0.8, "base_color": (1.0,) * 3, "metalness": 0.0, "diffuse_roughness": 0.0, "specular": 1.0, "specular_color": (1.0,) * 3,
    "specular_roughness": 0.2, "specular_IOR": 1.5, "specular_anisotropy": 0.0, "transmission": 0.0, "transmission_color": (1.0,) * 3,
    "transmission_depth": 0.0, "transmission_scatter": (0.0,) * 3, "transmission_dispersion": 0.0, "transmission_extra_roughness": 0.0,
    "subsurface": 0.0, "subsurface_color": (1.0,) * 3, "coat": 0.0, "coat_color": (1.0,) * 3, "coat_roughness": 0.1, "coat_IOR": 1.5,
    "coat_anisotropy": 0.0, "coat_affect_color": 0.0, "coat_affect_roughness": 0.0, "sheen": 0.0, "emission": 0.0,
    "emission_color": (1.0,) * 3, "opacity": (1.0,) * 3, "thin_walled": 0.0, "thin_film_thickness": 0.0,
    "indirect_diffuse": 1.0, "indirect_specular": 1.0,
}  # fmt: skip
"""Arnold's defaults."""
_INDIRECT = dict.fromkeys(
    ("indirect_diffuse", "indirect_specular"), "light that was reflected before counts as any other"
)
_ARNOLD_OPEN_PBR = {
    "base_weight": 1.0, "base_color": (0.8,) * 3, "base_metalness": 0.0, "base_diffuse_roughness": 0.0, "specular_weight": 1.0,
    "specular_color": (1.0,) * 3, "specular_roughness": 0.3, "specular_ior": 1.5, "specular_roughness_anisotropy": 0.0,
    "transmission_weight": 0.0, "transmission_color": (1.0,) * 3, "transmission_depth": 0.0, "transmission_scatter": (0.0,) * 3,
    "transmission_dispersion_scale": 0.0, "subsurface_weight": 0.0, "subsurface_color": (0.8,) * 3, "fuzz_weight": 0.0,
    "coat_weight": 0.0, "coat_color": (1.0,) * 3, "coat_roughness": 0.0, "coat_ior": 1.6, "coat_roughness_anisotropy": 0.0,
    "coat_darkening": 1.0, "thin_film_weight": 0.0, "emission_luminance": 0.0, "emission_color": (1.0,) * 3, "geometry_opacity": 1.0,
    "geometry_thin_walled": 0.0,
}  # fmt: skip
"""OpenPBR's defaults."""
_OLD_LOST = dict.fromkeys(
    ("Ks", "Kr", "Kt", "Ksss", "Kb", "diffuse_roughness"), "Arnold 4's shader is read for its diffuse part and its glow"
)
_OLD = {"Kd": 0.7, "Kd_color": (1.0,) * 3, "opacity": (1.0,) * 3, "emission": 0.0, "emission_color": (1.0,) * 3}
_OLD |= dict.fromkeys(_OLD_LOST, 0.0)

_HAIR = {
    "base": 1.0, "base_color": (1.0,) * 3, "melanin": 1.0, "melanin_redness": 0.5, "melanin_randomize": 0.0, "roughness": 0.2,
    "roughness_azimuthal": 0.2, "roughness_anisotropic": 0.0, "ior": 1.55, "diffuse": 0.0, "diffuse_color": (1.0,) * 3,
    "specular_tint": (1.0,) * 3, "emission": 0.0, "emission_color": (1.0,) * 3, "opacity": (1.0,) * 3,
}  # fmt: skip
"""Arnold's, as its exporters write them out; `melanin` is that of NVIDIA's OmniHair, which has the same parameters."""
_HAIR_LOST = {"melanin_randomize": "all hairs have the mean"}

MODELS: dict[str, Model] = {
    "standard_surface": Model(
        _standard_surface, lost=_STANDARD_LOST, neutral={"coat_IOR": 1.5}, emission=("emission", "emission_color")
    ),
    "open_pbr_surface": Model(
        _open_pbr, lost=_OPEN_PBR_LOST, neutral={"coat_ior": 1.5}, emission=("emission_luminance", "emission_color")
    ),
    "gltf_pbr": Model(_gltf_pbr, lost=_GLTF_LOST, emission=("emissive_strength", "emissive")),
    "UsdPreviewSurface": Model(_preview, emission=("emissiveColor",)),
    "surface_unlit": Model(
        _unlit, lost={"transmission": "an unlit surface is seen, not seen through"}, emission=("emission", "emission_color")
    ),
    "arnold:standard_surface": Model(
        _standard_surface, _ARNOLD_STANDARD, {**_STANDARD_LOST, **_INDIRECT}, {"coat_IOR": 1.5}, ("emission", "emission_color")
    ),
    "arnold:openpbr_surface": Model(
        _open_pbr, _ARNOLD_OPEN_PBR, _OPEN_PBR_LOST, {"coat_ior": 1.5}, ("emission_luminance", "emission_color")
    ),
    "arnold:standard_hair": Model(_hair, _HAIR, _HAIR_LOST, emission=("emission", "emission_color")),
    "arnold:lambert": Model(_lambert, {"Kd": 0.8, "Kd_color": (1.0,) * 3, "opacity": (1.0,) * 3}),
    "arnold:standard": Model(_old_standard, _OLD, _OLD_LOST, emission=("emission", "emission_color")),
}  # fmt: skip
"""Models by the kind of their shader."""
COLOR = Model(_color, emission=("",))
"""A shader that gives a colour."""
