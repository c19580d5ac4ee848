"""The surface models of MaterialX, and its images, in glTF's terms."""

import contextlib
import math

import numpy as np
import OpenEXR
import pytest
from conftest import Gltf
from networks import STANDARD, image, link, network, node
from PIL import Image
from pxr import Sdf, Usd, UsdShade
from test_materials import picture, pixels
from usd_gltf.color_spaces import to_rec709
from usd_gltf.evaluator import Evaluator
from usd_gltf.network_images import NetworkImages
from usd_gltf.quantities import Lost
from usd_gltf.report import Report
from usd_gltf.shader_network import Link, Network

OPEN_PBR = "ND_open_pbr_surface_surfaceshader"
GLTF = "ND_gltf_pbr_surfaceshader"
COLORS = {"base_color", "specular_color", "transmission_color", "coat_color", "emission_color"}


def linear(codes: np.ndarray) -> np.ndarray:
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)


def extension(material: dict, name: str) -> dict:
    return material.get("extensions", {}).get(f"KHR_materials_{name}", {})


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


# -- images --------------------------------------------------------------------------------------


def test_a_file_that_gltf_can_read_is_passed_on(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    scene = gltf(network(link("base_color", "I"), image("I", "a.png")))
    surface = scene.material("/M")["pbrMetallicRoughness"]
    view = scene.json["bufferViews"][scene.json["images"][0]["bufferView"]]
    data = scene.buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    assert data == (tmp_path / "a.png").read_bytes()
    assert surface.get("baseColorFactor", [1] * 4) == pytest.approx([1] * 4)
    assert "extensions" not in surface["baseColorTexture"]


def test_weights_become_factors(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    text = (
        "float inputs:base = 0.5\n float inputs:emission = 8\n" + link("base_color", "I") + link("emission_color", "I")
    )
    scene = gltf(network(text, image("I", "a.png")))
    material = scene.material("/M")
    assert material["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([0.5] * 3)
    assert scene.nits("/M") == pytest.approx([8] * 3)
    assert len(scene.json["images"]) == 1
    assert scene.light_map("/M")[0, 0] == pytest.approx(8 * linear(np.array([200, 100, 50]) / 255), rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "space", "expected"),
    [
        ("color3", "", 128 / 255), ("color3", "srgb_texture", 128 / 255), ("color3", "raw", None),
        ("color3", "lin_rec709", None), ("color3", "g22_rec709", "2.2"),
    ],
)  # fmt: skip
def test_color_spaces_of_files(gltf, tmp_path, kind, space, expected):
    picture(tmp_path / "a.png", 128, 128, 128)
    meta = f'(colorSpace = "{space}")' if space else ""
    shader = node("I", f"ND_image_{kind}", f"asset inputs:file = @a.png@ {meta}")
    scene = gltf(network(link("base_color", "I"), shader))
    code = pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[0, 0, 0] / 255
    light = {None: 128 / 255, "2.2": (128 / 255) ** 2.2}.get(expected, linear(np.array(128 / 255)))
    assert linear(np.array(code)) == pytest.approx(light, abs=3e-3)


def test_numbers_of_float_images_are_not_decoded(gltf, tmp_path):
    picture(tmp_path / "a.png", 10, 128, 30)
    scene = gltf(
        network(
            link("specular_roughness", "E", "float") + link("metalness", "I", "float"),
            image("I", "a.png", "float")
            + image("V", "a.png", "vector3")
            + node(
                "E", "ND_extract_vector3", "int inputs:index = 1\n" + link("in", "V", "float3"), "float outputs:out"
            ),
        )
    )
    info = scene.material("/M")["pbrMetallicRoughness"]["metallicRoughnessTexture"]
    assert pixels(scene, info)[0, 0, 1:3].tolist() == [128, 10]


def test_colors_of_other_spaces_are_converted(gltf):
    text = 'color3f inputs:base_color = (0.5, 0.5, 0.5) (colorSpace = "srgb_texture")\n float inputs:base = 1'
    surface = gltf(network(text)).material("/M")["pbrMetallicRoughness"]
    assert surface["baseColorFactor"][0] == pytest.approx(float(linear(np.array(0.5))), abs=1e-6)
    white = gltf(network('color3f inputs:base_color = (1, 1, 1) (colorSpace = "acescg")')).material("/M")
    assert white["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([1, 1, 1], abs=1e-4)


def transformed(info: dict, u: float, v: float) -> tuple[float, float]:
    """Where a glTF texture is read for USD's coordinates, in USD's coordinates."""
    found = info.get("extensions", {}).get("KHR_texture_transform", {})
    (sx, sy), angle, (ox, oy) = found.get("scale", (1, 1)), found.get("rotation", 0.0), found.get("offset", (0, 0))
    x, y = sx * u, sy * (1 - v)
    return math.cos(angle) * x + math.sin(angle) * y + ox, 1 - (-math.sin(angle) * x + math.cos(angle) * y + oy)


PLACE = "float2 inputs:pivot = (0.5, 0.25)\n float2 inputs:scale = (2, 4)\n float inputs:rotate = 30\n float2 inputs:offset = (0.1, 0.2)\n"


def placed(u: float, v: float) -> tuple[float, float]:
    """MaterialX's place2d with PLACE, operationorder 0."""
    x, y = (u - 0.5) / 2, (v - 0.25) / 4
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    return c * x + s * y - 0.1 + 0.5, -s * x + c * y - 0.2 + 0.25


TEXCOORD = node("T", "ND_texcoord_vector2", "", "float2 outputs:out")
TILED = node(
    "I",
    "ND_tiledimage_color3",
    "asset inputs:file = @a.png@\n float2 inputs:uvtiling = (3, 2)\n float2 inputs:uvoffset = (0.5, 0.25)",
)
PLACED = (
    image("I", "a.png", extra=link("texcoord", "P", "float2"))
    + node("P", "ND_place2d_vector2", PLACE + link("texcoord", "T", "float2"), "float2 outputs:out")
    + TEXCOORD
)
COMPUTED = (
    image("I", "a.png", extra=link("texcoord", "A", "float2"))
    + node("A", "ND_add_vector2", "float2 inputs:in2 = (0.25, 0)\n" + link("in1", "X", "float2"), "float2 outputs:out")
    + node("X", "ND_multiply_vector2", "float2 inputs:in2 = (-2, 5)\n" + link("in1", "T", "float2"), "float2 outputs:out")
    + TEXCOORD
)


@pytest.mark.parametrize(
    ("shaders", "expected"),
    [
        (TILED, lambda u, v: (3 * u - 0.5, 2 * v - 0.25)),
        (PLACED, placed),
        (COMPUTED, lambda u, v: (-2 * u + 0.25, 5 * v)),
    ],
)
def test_affine_coordinates_become_a_texture_transform(gltf, tmp_path, shaders, expected):
    picture(tmp_path / "a.png", 200, 100, 50)
    info = gltf(network(link("base_color", "I"), shaders)).material("/M")["pbrMetallicRoughness"]["baseColorTexture"]
    for u, v in ((0, 0), (1, 0), (0, 1), (0.3, 0.7)):
        assert transformed(info, u, v) == pytest.approx(expected(u, v), abs=1e-6)


SHEARED = (
    node("C", "ND_combine2_vector2", link("in1", "X", "float") + link("in2", "Sum", "float"), "float2 outputs:out")
    + node("Sum", "ND_add_float", link("in1", "X", "float") + link("in2", "Y", "float"), "float outputs:out")
    + node("X", "ND_extract_vector2", link("in", "T", "float2"), "float outputs:out")
    + node("Y", "ND_extract_vector2", "int inputs:index = 1\n" + link("in", "T", "float2"), "float outputs:out")
)
BENT = node("C", "ND_power_vector2", "float2 inputs:in2 = (2, 2)\n" + link("in1", "T", "float2"), "float2 outputs:out")
PLACES = node("C", "ND_position_vector3", "", "float3 outputs:out")


@pytest.mark.parametrize(
    ("coordinates", "why"),
    [(SHEARED, "sheared"), (BENT, "computed of other things"), (PLACES, "computed of other things")],
)
def test_other_coordinates_are_lost(export, tmp_path, coordinates, why):
    picture(tmp_path / "a.png", 200, 100, 50)
    shaders = (
        image("I", "a.png", extra=link("texcoord", "C", "float2"))
        + coordinates
        + node("T", "ND_texcoord_vector2", "", "float2 outputs:out")
    )
    result = export(network(link("base_color", "I"), shaders))
    assert result.code == 0
    assert result.warned("materials") == {"standard_surface base_color"}
    assert why in result.said()


def test_wraps_and_uv_sets(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    extra = 'string inputs:uaddressmode = "clamp"\n string inputs:vaddressmode = "mirror"\n' + link(
        "texcoord", "U", "float2"
    )
    shaders = image("I", "a.png", extra=extra) + node(
        "U", "ND_geompropvalue_vector2", 'string inputs:geomprop = "map2"', "float2 outputs:out"
    )
    result = gltf(network(link("base_color", "I"), shaders))
    sampler = result.json["samplers"][0]
    assert (sampler["wrapS"], sampler["wrapT"]) == (33071, 33648)


def test_images_on_the_same_coordinates_are_computed_texel_by_texel(gltf, tmp_path):
    random = np.random.default_rng(7)
    a, b = (random.integers(0, 256, (8, 8, 3), dtype=np.uint8) for _ in range(2))
    Image.fromarray(a).save(tmp_path / "a.png")
    Image.fromarray(b).save(tmp_path / "b.png")
    shaders = (
        image("A", "a.png") + image("B", "b.png") + node("X", "ND_multiply_color3", link("in1", "A") + link("in2", "B"))
    )
    shaders += node("Y", "ND_mix_color3", "float inputs:mix = 0.25\n color3f inputs:fg = (1, 0, 0)\n" + link("bg", "X"))
    scene = gltf(network(link("base_color", "Y") + "float inputs:base = 1", shaders))
    found = linear(pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[:, :, :3] / 255)
    expected = 0.75 * linear(a / 255) * linear(b / 255) + 0.25 * np.array([1, 0, 0])
    assert np.abs(found - expected).max() < 5e-3


def test_images_on_different_coordinates_are_lost(export, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    tiled = node("B", "ND_tiledimage_color3", "asset inputs:file = @a.png@\n float2 inputs:uvtiling = (2, 2)")
    shaders = image("A", "a.png") + tiled + node("X", "ND_multiply_color3", link("in1", "A") + link("in2", "B"))
    result = export(network(link("base_color", "X"), shaders))
    assert result.warned("materials") == {"standard_surface base_color"}
    assert "different coordinates" in result.said()


def test_normal_maps(gltf, tmp_path):
    picture(tmp_path / "n.png", 128, 128, 255)
    shaders = image("I", "n.png", "vector3") + node(
        "N", "ND_normalmap_float", "float inputs:scale = 0.5\n" + link("in", "I", "float3"), "float3 outputs:out"
    )
    scene = gltf(network(link("normal", "N", "float3"), shaders))
    info = scene.material("/M")["normalTexture"]
    assert info["scale"] == 0.5
    assert pixels(scene, info)[0, 0].tolist() == [128, 128, 255, 255]


def test_bumps_are_lost(export):
    result = export(network(link("normal", "B", "float3"), node("B", "ND_bump_vector3", "", "float3 outputs:out")))
    assert result.warned("materials") == {"standard_surface normal"}


def test_textures_of_coats_and_specular_lobes(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    text = link("specular_color", "I") + link("coat", "F", "float") + link("transmission", "F", "float")
    material = (scene := gltf(network(text, image("I", "a.png") + image("F", "a.png", "float")))).material("/M")
    color = pixels(scene, extension(material, "specular")["specularColorTexture"])[0, 0]
    assert color[:3].tolist() == [200, 100, 50]
    assert pixels(scene, extension(material, "clearcoat")["clearcoatTexture"])[0, 0, 0] == 200
    assert pixels(scene, extension(material, "transmission")["transmissionTexture"])[0, 0, 0] == 200


def test_a_missing_file_is_its_default(export, tmp_path):
    result = export(
        network(link("base_color", "I"), image("I", "gone.png", extra="color3f inputs:default = (0.1, 0.2, 0.3)"))
    )
    assert result.warned("materials") == {"missing texture"}
    assert Gltf(result.path).material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx(
        [0.1, 0.2, 0.3]
    )
    light = export(
        network("float inputs:emission = 1\n" + link("emission_color", "I"), image("I", "gone.png")), out="light.glb"
    )
    assert light.warned("lights") == {"missing texture"}
    empty = export(
        network(link("base_color", "I"), node("I", "ND_image_color3", "color3f inputs:default = (0.1, 0.2, 0.3)")),
        out="empty.glb",
    )
    assert empty.report["warnings"] == []


def test_primvars_are_colors_of_the_mesh(gltf):
    text = network(
        link("base_color", "P") + "float inputs:base = 0.5",
        node("P", "ND_geompropvalue_color3", 'string inputs:geomprop = "hue"'),
    )
    text = text.replace(
        "rel material",
        'color3f[] primvars:hue = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)] (interpolation = "vertex")\n rel material',
        1,
    )
    scene = gltf(text)
    assert sorted(map(tuple, scene.attribute("/M", "COLOR_0").astype(float)))[-1][:3] == pytest.approx(
        [0.5] * 3, abs=1e-2
    )


def test_checkers_repeat_and_gradients_do_not(gltf, export):
    board = node("C", "ND_checkerboard_color3", "float2 inputs:uvtiling = (4, 2)")
    scene = gltf(network(link("base_color", "C"), board))
    found = pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[:, :, 0]
    height, width = found.shape
    # The first square at (0, 0) is the second colour, black; v runs up.
    assert found[height - 1, 0] == 0 and found[height - 1, width // 4] == 255 and found[0, 0] == 255
    assert (found == 255).mean() == 0.5
    result = export(
        network(link("base_color", "R"), node("R", "ND_ramplr_color3", "color3f inputs:valuer = (1, 1, 1)")),
        out="ramp.glb",
    )
    assert "does not repeat" in result.said()


@pytest.mark.parametrize("is_named", [False, True])
def test_primaries_of_a_file_are_converted_once(gltf, tmp_path, is_named):
    ap1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    header |= {"chromaticities": ap1} if is_named else {}
    color = np.broadcast_to(np.array([0.5, 0.25, 0.125], np.float32), (4, 4, 3)).copy()
    OpenEXR.File(header, {"RGB": color}).write(str(tmp_path / "a.exr"))
    shader = node("I", "ND_image_color3", 'asset inputs:file = @a.exr@ (colorSpace = "acescg")')
    scene = gltf(network("float inputs:base = 1\n" + link("base_color", "I"), shader))
    code = pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[0, 0, :3] / 255
    expected = to_rec709("acescg", np.array([0.5, 0.25, 0.125]))
    assert linear(code) == pytest.approx(expected, abs=6e-3)
