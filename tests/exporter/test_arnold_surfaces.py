"""Arnold's surfaces and the shaders that feed them."""

import math

import numpy as np
import pytest
from conftest import Gltf
from networks import link, network, node
from test_materials import QUAD, picture, pixels

RGB = "color3f outputs:out"


def arnold(inputs: str, shaders: str = "", name: str = "standard_surface") -> str:
    return network(inputs, shaders, identifier=f"arnold:{name}", context="arnold:")


def shader(name: str, kind: str, inputs: str = "", outputs: str = RGB) -> str:
    return node(name, f"arnold:{kind}", inputs, outputs)


def base(scene: Gltf) -> list[float]:
    return scene.material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3]


def test_standard_surface(gltf):
    text = """float inputs:base = 0.5
        color3f inputs:base_color = (0.2, 0.4, 0.8)
        float inputs:metalness = 0.25
        float inputs:specular_roughness = 0.6
        float inputs:specular_IOR = 1.33
        float inputs:specular = 0.5
        float inputs:emission = 2
        color3f inputs:emission_color = (1, 0.5, 0)
        float inputs:coat = 0.3
        color3f inputs:opacity = (0.5, 0.5, 0.5)"""
    scene = gltf(arnold(text))
    material = scene.material("/M")
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx([0.1, 0.2, 0.4, 0.5])
    assert material["pbrMetallicRoughness"]["metallicFactor"] == pytest.approx(0.25)
    assert material["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx(0.6)
    assert scene.nits("/M") == pytest.approx([2, 1, 0])
    assert material["extensions"]["KHR_materials_ior"]["ior"] == pytest.approx(1.33)
    assert material["extensions"]["KHR_materials_specular"]["specularFactor"] == pytest.approx(0.5)
    assert material["extensions"]["KHR_materials_clearcoat"] == {
        "clearcoatFactor": pytest.approx(0.3), "clearcoatRoughnessFactor": pytest.approx(0.1)
    }  # fmt: skip
    assert material["alphaMode"] == "BLEND"


def test_defaults(gltf):
    surface = gltf(arnold("")).material("/M")["pbrMetallicRoughness"]
    assert surface["baseColorFactor"] == pytest.approx([0.8, 0.8, 0.8, 1])
    assert (surface["roughnessFactor"], surface["metallicFactor"]) == (pytest.approx(0.2), 0)
    assert base(gltf(arnold("", name="lambert"))) == pytest.approx([0.8] * 3)
    assert base(gltf(arnold("", name="standard"))) == pytest.approx([0.7] * 3)
    assert base(gltf(arnold("", name="openpbr_surface"))) == pytest.approx([0.8] * 3)


def test_what_exporters_write_out_in_full_is_not_lost(export):
    text = """float inputs:coat_affect_color = 0
        float inputs:sheen = 0
        float inputs:subsurface = 0
        float inputs:indirect_diffuse = 1
        bool inputs:caustics = 0
        string inputs:aov_id1 = ""
        color3f inputs:id1 = (0, 0, 0)
        vector3f inputs:normal = (0, 0, 0)
        vector3f inputs:tangent = (0, 0, 0)"""
    assert export(arnold(text)).report["warnings"] == []


@pytest.mark.parametrize(
    ("name", "weight", "color", "depth", "thin"),
    [
        ("standard_surface", "transmission", "transmission_color", "transmission_depth", "thin_walled"),
        ("openpbr_surface", "transmission_weight", "transmission_color", "transmission_depth", "geometry_thin_walled"),
    ],
)
def test_glass(gltf, name, weight, color, depth, thin):
    text = f"float inputs:{weight} = 1\n color3f inputs:{color} = (0.5, 0.25, 1)\n float inputs:{depth} = 2"
    for is_thin in (0, 1):
        scene = gltf(arnold(f"{text}\n bool inputs:{thin} = {is_thin}", name=name))
        extensions = scene.material("/M")["extensions"]
        assert extensions["KHR_materials_transmission"] == {"transmissionFactor": 1.0}
        # A wall without an inside is tinted as a whole.
        assert base(scene) == pytest.approx([0.5, 0.25, 1] if is_thin else [1, 1, 1])
        assert ("KHR_materials_volume" in extensions) == (not is_thin)
        if not is_thin:
            assert extensions["KHR_materials_volume"]["attenuationColor"] == pytest.approx([0.5, 0.25, 1])


def test_lost_inputs_are_listed(export):
    text = "float inputs:sheen = 1\n float inputs:thin_film_thickness = 300\n float inputs:indirect_specular = 0.5"
    expected = {f"standard_surface {name}" for name in ("sheen", "thin_film_thickness", "indirect_specular")}
    assert export(arnold(text)).warned("materials") == expected


def test_a_color_is_a_surface_that_glows(gltf):
    scene = gltf(arnold("color3f inputs:color = (2, 1, 0)", name="flat"))
    assert scene.nits("/M") == pytest.approx([2, 1, 0])
    assert base(scene) == [0, 0, 0]
    layers = "color4f inputs:input1 = (1, 0, 0, 1)\n bool inputs:enable2 = 1\n"
    layers += "color4f inputs:input2 = (0, 1, 0, 1)\n float inputs:mix2 = 0.25"
    assert gltf(arnold(layers, name="layer_rgba")).nits("/M") == pytest.approx([0.75, 0.25, 0])


def test_a_surface_without_a_context(gltf):
    text = network("color3f inputs:base_color = (0.5, 0.25, 1)", identifier="arnold:standard_surface", context="")
    assert base(gltf(text)) == pytest.approx([0.4, 0.2, 0.8])


def test_surfaces_that_hand_on(gltf, export):
    inner = shader("In", "standard_surface", "color3f inputs:base_color = (0.5, 0.25, 1)", "token outputs:out")
    assert base(gltf(arnold(link("front", "In", "token"), inner, "two_sided"))) == pytest.approx([0.4, 0.2, 0.8])
    result = export(arnold(link("camera", "In", "token") + link("shadow", "In", "token"), inner, "ray_switch_shader"))
    assert result.warned("materials") == {"ray_switch_shader shadow"}


@pytest.mark.parametrize(
    ("kind", "inputs", "expected"),
    [
        ("multiply", "color3f inputs:input1 = (0.5, 1, 0)\n color3f inputs:input2 = (0.5, 0.5, 0.5)", (0.25, 0.5, 0)),
        ("add", "color3f inputs:input1 = (0.5, 0.25, 0)\n color3f inputs:input2 = (0.25, 0.25, 0.5)", (0.75, 0.5, 0.5)),
        ("complement", "color3f inputs:input = (0.25, 0.5, 1)", (0.75, 0.5, 0)),
        ("flat", "color3f inputs:color = (0.25, 0.5, 1)", (0.25, 0.5, 1)),
        ("float_to_rgb", "float inputs:r = 0.25\n float inputs:b = 1", (0.25, 0, 1)),
        ("mix_rgba", "color4f inputs:input1 = (1, 0, 0, 1)\n color4f inputs:input2 = (0, 1, 0, 1)\n float inputs:mix = 0.25",
         (0.75, 0.25, 0)),
        ("color_correct", "color4f inputs:input = (0.25, 0.04, 0, 1)\n float inputs:gamma = 2", (0.5, 0.2, 0)),
        ("color_correct", "color4f inputs:input = (0.25, 0.1, 0, 1)\n float inputs:exposure = 1\n color3f inputs:add = (0, 0, 0.1)",
         (0.5, 0.2, 0.1)),
        ("ramp_rgb", "token inputs:type = \"custom\"\n float inputs:input = 0.25\n float[] inputs:position = [0, 0.5, 1]\n"
         "color3f[] inputs:color = [(1, 0, 0), (0, 1, 0), (0, 0, 1)]\n int[] inputs:interpolation = [1, 1, 1]", (0.5, 0.5, 0)),
    ],
)  # fmt: skip
def test_shaders(gltf, kind, inputs, expected):
    text = arnold("float inputs:base = 1\n" + link("base_color", "N"), shader("N", kind, inputs))
    assert base(gltf(text)) == pytest.approx(expected, abs=1e-6)


def test_parts_of_outputs_and_inputs(gltf):
    flat = shader("N", "flat", "color3f inputs:color = (0.25, 0.5, 0.75)", "float outputs:g\n float outputs:b")
    text = link("metalness", "N", "float", "g") + "float inputs:base = 1\n color3f inputs:base_color = (0.1, 0.2, 0.3)\n"
    text += "float inputs:base_color:r.connect = </Mat/N.outputs:b>"
    scene = gltf(arnold(text, flat))
    assert scene.material("/M")["pbrMetallicRoughness"]["metallicFactor"] == pytest.approx(0.5)
    assert base(scene) == pytest.approx([0.75, 0.2, 0.3])


def test_images(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    text = 'asset inputs:filename = @a.png@\n string inputs:swrap = "clamp"\n float inputs:sscale = 2\n'
    text += "color3f inputs:multiply = (0.5, 0.5, 0.5)"
    scene = gltf(arnold("float inputs:base = 1\n" + link("base_color", "I"), shader("I", "image", text)))
    surface = scene.material("/M")["pbrMetallicRoughness"]
    assert pixels(scene, surface["baseColorTexture"])[0, 0, :3].tolist() == [200, 100, 50]
    assert surface["baseColorFactor"][:3] == pytest.approx([0.5] * 3)
    assert scene.json["samplers"][0] == {"wrapS": 33071, "wrapT": 10497}
    assert surface["baseColorTexture"]["extensions"]["KHR_texture_transform"]["scale"] == [2, 1]


def test_an_image_that_glows(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    image = shader("I", "image", "asset inputs:filename = @a.png@")
    scene = gltf(arnold("float inputs:emission = 3\n" + link("emission_color", "I"), image))
    code = np.array([200, 100, 50]) / 255
    assert scene.light_map("/M")[0, 0] == pytest.approx(3 * ((code + 0.055) / 1.055) ** 2.4, rel=1e-3)


def test_normal_maps(gltf, tmp_path):
    picture(tmp_path / "n.png", 128, 128, 255)
    shaders = shader(
        "N", "normal_map", "float inputs:strength = 0.5\n" + link("input", "I", "vector3f"), "vector3f outputs:vector"
    )
    shaders += shader("I", "image", 'asset inputs:filename = @n.png@\n token inputs:color_space = "Raw"')
    info = gltf(arnold(link("normal", "N", "vector3f", "vector"), shaders)).material("/M")["normalTexture"]
    assert info["scale"] == 0.5


def test_checkers(gltf):
    board = shader("C", "checkerboard", "float inputs:u_frequency = 2\n float inputs:v_frequency = 2")
    scene = gltf(arnold(link("base_color", "C"), board))
    found = pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])
    assert (found[:, :, 0] > 0).mean() == pytest.approx(0.5)


@pytest.mark.parametrize(
    ("kind", "inputs"),
    [
        ("noise", ""), ("osl", ""), ("color_correct", "float inputs:saturation = 0.5"), ("range", "float inputs:gain = 0.2"),
        ("ramp_rgb", ""), ("ramp_rgb", "float[] inputs:position = [0, 1]\n color3f[] inputs:color = [(1, 0, 0)]"),
        ("rgb_to_float", 'string inputs:mode = "hue"'), ("image", "asset inputs:filename = @a.png@\n bool inputs:swap_st = 1"),
    ],
)  # fmt: skip
def test_what_has_no_published_formula_is_lost(export, kind, inputs):
    result = export(arnold(link("base_color", "N"), shader("N", kind, inputs)))
    assert result.code == 0, result.err
    assert result.warned("materials") == {"standard_surface base_color"}


def test_primvars(gltf):
    data = 'string inputs:attribute = "hue"\n color3f inputs:default = (0.5, 0.25, 1)'
    text = arnold(link("base_color", "N"), shader("N", "user_data_rgb", data))
    assert base(gltf(text)) == pytest.approx([0.4, 0.2, 0.8])
    primvar = "color3f[] primvars:hue = [(1, 0.5, 0)]\n rel material"
    assert base(gltf(text.replace("rel material", primvar, 1))) == pytest.approx([0.8, 0.4, 0])


@pytest.mark.parametrize("scaled", [False, True])
def test_what_no_prim_has_is_its_default_wherever_it_is_read(export, scaled):
    """A glow of a primvar has no carrier, but where it is the same everywhere because nothing has it."""
    data = shader("N", "user_data_rgb", 'string inputs:attribute = "hue"\n color3f inputs:default = (0.5, 0.25, 1)')
    if scaled:
        data += shader("D", "multiply", link("input1", "N") + "color3f inputs:input2 = (2, 2, 2)")
    text = arnold(link("emission_color", "D" if scaled else "N") + "float inputs:emission = 3\n", data)
    result = export(text, "--strict")
    assert result.code == 0, result.err
    assert Gltf(result.path).nits("/M") == pytest.approx(np.array([1.5, 0.75, 3]) * (1 + scaled))
    for kind in ("def", "class"):
        elsewhere = f'{kind} Scope "Elsewhere" {{ color3f[] primvars:hue = [(1, 0, 0)] }}'
        assert export(f"{text}\n{elsewhere}").warned("lights") == {"standard_surface emission_color"}


def test_equal_meshes_in_instances_keep_their_colors(gltf, tmp_path):
    data = shader("N", "user_data_rgb", 'string inputs:attribute = "hue"')
    text = network(link("base_color", "N"), data, "arnold:standard_surface", "arnold:", quad=QUAD)
    asset = '#usda 1.0\n(defaultPrim = "A")\ndef Xform "A" {\n' + text.replace("/Mat", "/A/Mat").replace("}", "\n}") + "\n}\n"
    (tmp_path / "asset.usda").write_text(asset)
    one = 'def Xform "I{0}" (instanceable = true\n references = @asset.usda@) {{ color3f[] primvars:hue = [({0}, 0, 0)] }}\n'
    scene = gltf(one.format(0) + one.format(1))
    found = [scene.material(f"/I{i}/M")["pbrMetallicRoughness"]["baseColorFactor"][0] for i in (0, 1)]
    assert found == pytest.approx([0, 0.8])


def test_hair_is_a_surface_of_the_colour_that_it_has_as_a_whole(export):
    """Fair hair, dyed; its colour is Chiang's of what MaterialX says that melanin absorbs."""
    inputs = "color3f inputs:base_color = (1, 0.5, 0.25)\n float inputs:melanin = 0.2\n float inputs:melanin_redness = 0.25\n"
    inputs += "float inputs:roughness = 0.3\n float inputs:ior = 1.6\n color3f inputs:specular_tint = (1, 0.5, 0.5)"
    result = export(arnold(inputs, name="standard_hair"))
    assert result.code == 0 and result.warned("materials") == {"standard_hair base_color"}, result.said()
    absorbed = -math.log(0.8) * (0.75 * np.array([0.419, 0.697, 1.37]) + 0.25 * np.array([0.187, 0.4, 1.05]))
    spread = 5.969 - 0.215 * 0.3 + 2.532 * 0.09 - 10.73 * 0.027 + 5.574 * 0.0081 + 0.245 * 0.00243
    scene = Gltf(result.path)
    assert base(scene) == pytest.approx([1, 0.5, 0.25] * np.exp(-np.sqrt(absorbed) * spread), rel=1e-4)
    extensions = scene.material("/M")["extensions"]
    assert extensions["KHR_materials_ior"]["ior"] == pytest.approx(1.6)
    assert extensions["KHR_materials_specular"]["specularColorFactor"] == pytest.approx([1, 0.5, 0.5])
    assert scene.material("/M")["pbrMetallicRoughness"]["roughnessFactor"] == pytest.approx(0.3)


def test_hair_that_is_dull_and_glows(gltf):
    scene = gltf(arnold("float inputs:diffuse = 1\n color3f inputs:diffuse_color = (0.1, 0.2, 0.3)\n float inputs:emission = 2", name="standard_hair"))
    assert base(scene) == pytest.approx([0.1, 0.2, 0.3]) and scene.nits("/M") == pytest.approx([2] * 3)
