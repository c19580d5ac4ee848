"""The surface models of MaterialX in glTF's terms."""

import contextlib

import numpy as np
import pytest
from conftest import Gltf
from networks import STANDARD, extension, network
from pxr import Sdf, Usd, UsdShade
from usd_gltf.evaluator import Evaluator
from usd_gltf.network_images import NetworkImages
from usd_gltf.quantities import Lost
from usd_gltf.report import Report
from usd_gltf.shader_network import Link, Network

OPEN_PBR = "ND_open_pbr_surface_surfaceshader"
GLTF = "ND_gltf_pbr_surfaceshader"
COLORS = {"base_color", "specular_color", "transmission_color", "coat_color", "emission_color"}


def authored(values: dict) -> str:
    lines = []
    for name, value in values.items():
        kind = "bool" if isinstance(value, bool) else "color3f" if np.ndim(value) else "float"
        lines.append(
            f"{kind} inputs:{name} = {int(value) if kind == 'bool' else tuple(map(float, value)) if np.ndim(value) else float(value)}"
        )
    return "\n".join(lines)


def translated(identifier: str, values: dict) -> dict:
    """What a translation graph of MaterialX's own library makes of a surface's inputs."""
    stage = Usd.Stage.CreateInMemory()
    shader = UsdShade.Shader.Define(stage, "/T")
    shader.CreateIdAttr(identifier)
    for name, value in values.items():
        if np.ndim(value):
            shader.CreateInput(name, Sdf.ValueTypeNames.Color3f).Set(tuple(map(float, value)))
        else:
            kind = Sdf.ValueTypeNames.Bool if isinstance(value, bool) else Sdf.ValueTypeNames.Float
            shader.CreateInput(name, kind).Set(value)
    surface = Network(shader).surface
    evaluator = Evaluator("/T", NetworkImages(None), 0.0, Report().about("materials"))
    found = {}
    for name in surface.outputs:
        with contextlib.suppress(Lost):  # vectors of the geometry, and anisotropy
            found[name.removesuffix("_out")] = evaluator.output(Link(surface, name)).constant
    return found


@pytest.mark.parametrize("seed", range(12))
def test_standard_surface_is_what_materialx_translates_it_to(gltf, seed):
    random = np.random.default_rng(seed)
    values = {name: random.uniform(0.05, 0.95, 3) for name in sorted(COLORS)}
    names = ("base", "metalness", "specular", "specular_roughness", "coat", "coat_roughness", "emission")
    values |= {name: float(random.uniform(0.05, 0.95)) for name in names}
    values["specular_IOR"] = float(random.uniform(1.1, 2.5))
    values["transmission"] = float(random.choice([0.0, 0.6]))
    values["transmission_depth"] = float(random.choice([0.0, 2.0]))
    values["opacity"] = np.full(3, float(random.choice([1.0, 0.4])))
    # Without a weight nothing of a lobe is left; with one its corners are tried, too.
    for name in names:
        if random.random() < 0.3:
            values[name] = float(random.integers(0, 2))
    expected = translated("ND_standard_surface_to_gltf_pbr", values)
    scene = gltf(network(authored(values)))
    material = scene.material("/M")
    surface = material["pbrMetallicRoughness"]
    is_metal = values["metalness"] == 1.0
    if not is_metal:  # what passes through a metal is nothing
        assert surface["baseColorFactor"][:3] == pytest.approx(expected["base_color"], abs=1e-6)
    assert surface["baseColorFactor"][3] == pytest.approx(expected["alpha"][0], abs=1e-6)
    assert surface["metallicFactor"] == pytest.approx(expected["metallic"][0])
    assert surface["roughnessFactor"] == pytest.approx(values["specular_roughness"])
    assert material.get("alphaMode", "OPAQUE") == ("BLEND" if values["opacity"][0] < 1 else "OPAQUE")
    assert scene.nits("/M") == pytest.approx(expected["emissive"] * expected["emissive_strength"], abs=1e-6)
    assert extension(material, "ior").get("ior", 1.5) == pytest.approx(expected["ior"][0])
    if not is_metal:
        specular = extension(material, "specular")
        assert specular.get("specularFactor", 1.0) == pytest.approx(expected["specular"][0], abs=1e-6)
        assert specular.get("specularColorFactor", [1.0] * 3) == pytest.approx(expected["specular_color"], abs=1e-6)
        assert extension(material, "transmission").get("transmissionFactor", 0.0) == pytest.approx(
            expected["transmission"][0]
        )
        if values["transmission"] and values["transmission_depth"]:
            volume = extension(material, "volume")
            assert volume["attenuationDistance"] == pytest.approx(expected["attenuation_distance"][0])
            assert volume["attenuationColor"] == pytest.approx(expected["attenuation_color"])
    # The graph weighs the coat by its colour, too, which is on what is below it already.
    assert extension(material, "clearcoat").get("clearcoatFactor", 0.0) == pytest.approx(values["coat"])


@pytest.mark.parametrize("seed", range(8))
def test_open_pbr_is_what_materialx_translates_it_to(gltf, seed):
    random = np.random.default_rng(100 + seed)
    values = {name: random.uniform(0.05, 0.95, 3) for name in ("base_color", "specular_color", "emission_color")}
    values |= {
        "base_weight": 0.7,
        "specular_roughness": 0.35,
        "specular_ior": 1.7,
        "emission_luminance": float(random.uniform(0, 900)),
    }
    values |= {
        "coat_weight": float(random.choice([0.0, 0.5, 1.0])),
        "coat_darkening": float(random.choice([0.0, 0.5, 1.0])),
    }
    values |= {"coat_ior": float(random.uniform(1.2, 2.0)), "geometry_opacity": 0.25}
    # The graph knows a base before its weight; so it is told the product.
    told = {**values, "base_color": values["base_color"] * 0.7, "base_weight": 1.0}
    expected = translated("ND_open_pbr_surface_to_standard_surface", told)
    scene = gltf(network(authored(values), identifier=OPEN_PBR))
    surface = scene.material("/M")["pbrMetallicRoughness"]
    assert surface["baseColorFactor"][:3] == pytest.approx(expected["base"] * expected["base_color"], abs=1e-6)
    assert surface["baseColorFactor"][3] == pytest.approx(0.25)
    assert scene.nits("/M") == pytest.approx(expected["emission"] * expected["emission_color"], rel=1e-6)
    assert extension(scene.material("/M"), "ior")["ior"] == pytest.approx(expected["specular_IOR"][0])


def test_defaults_are_those_of_the_definition(gltf):
    for identifier, base, roughness, metallic in (
        (STANDARD, 0.8, 0.2, 0.0),
        (OPEN_PBR, 0.8, 0.3, 0.0),
        (GLTF, 1.0, 1.0, 1.0),
    ):
        surface = gltf(network("", identifier=identifier)).material("/M")["pbrMetallicRoughness"]
        assert surface["baseColorFactor"] == pytest.approx([base] * 3 + [1])
        assert (surface["roughnessFactor"], surface["metallicFactor"]) == (pytest.approx(roughness), metallic)
    surface = gltf(network("", identifier="ND_UsdPreviewSurface_surfaceshader")).material("/M")["pbrMetallicRoughness"]
    assert surface["baseColorFactor"] == pytest.approx([0.18] * 3 + [1])


def test_the_dielectric_weight_of_open_pbr_scales_what_is_reflected_straight_on(gltf):
    material = gltf(
        network("float inputs:specular_weight = 0.4\n color3f inputs:specular_color = (1, 0.5, 1)", identifier=OPEN_PBR)
    ).material("/M")
    assert extension(material, "specular") == {
        "specularFactor": 1.0,
        "specularColorFactor": pytest.approx([0.4, 0.2, 0.4]),
    }
    metal = gltf(
        network("float inputs:specular_weight = 0.5\n float inputs:base_metalness = 1", identifier=OPEN_PBR)
    ).material("/M")
    assert metal["pbrMetallicRoughness"]["baseColorFactor"][0] == pytest.approx(0.4)


@pytest.mark.parametrize(("mode", "expected"), [(0, (None, 1.0)), (1, ("MASK", 0.5)), (2, ("BLEND", 0.5))])
def test_alpha_modes_of_gltf_pbr(gltf, mode, expected):
    text = f"float inputs:alpha = 0.5\n int inputs:alpha_mode = {mode}\n float inputs:alpha_cutoff = 0.3"
    material = gltf(network(text, identifier=GLTF)).material("/M")
    assert (material.get("alphaMode"), material["pbrMetallicRoughness"]["baseColorFactor"][3]) == expected
    assert mode != 1 or material["alphaCutoff"] == pytest.approx(0.3)


def test_a_surface_that_glows_is_a_mesh_light(gltf):
    scene = gltf(network("float inputs:emission = 3\n color3f inputs:emission_color = (1, 2, 0)"))
    assert scene.nits("/M") == pytest.approx([3, 6, 0])
    unlit = gltf(
        network(
            "float inputs:emission = 4\n color3f inputs:emission_color = (1, 0.5, 0)", identifier="ND_surface_unlit"
        )
    )
    assert unlit.nits("/M") == pytest.approx([4, 2, 0])
    assert unlit.material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3] == [0, 0, 0]


def test_a_glow_over_time_is_carried(export):
    text = "float inputs:emission.timeSamples = { 1: 1, 3: 5 }\n color3f inputs:emission_color = (1, 2, 0)"
    result = export(network(text), "--frames", "1-3")
    assert result.report["warnings"] == []
    keys = Gltf(result.path).lux("/M")["values"]
    assert keys["rgb"] == [[1, 2, 0], [3, 6, 0], [5, 10, 0]]


def test_lost_inputs_are_listed_by_name(export):
    text = """float inputs:sheen = 0.5
        float inputs:coat = 1
        float inputs:coat_IOR = 2
        float inputs:subsurface = 1
        color3f inputs:subsurface_color = (1, 0, 0)
        float inputs:diffuse_roughness = 0
        float inputs:transmission_dispersion = 4"""
    result = export(network(text))
    assert result.warned("materials") == {
        "standard_surface sheen",
        "standard_surface coat_IOR",
        "standard_surface subsurface",
    }
    assert {line["path"] for line in result.report["warnings"]} == {"/Mat"}
