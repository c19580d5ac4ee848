"""Lights whose colour a shader network computes, and light filters that only multiply, against closed forms."""

import io

import numpy as np
import pytest
from conftest import HEADER, Gltf
from PIL import Image
from pxr import Gf

FRAMES = HEADER.replace("upAxis", "startTimeCode = 1\n endTimeCode = 5\n upAxis")
LINEAR = np.arange(1024) / 1024 + 1 / 2048
"""Texture coordinates of the texels of a row."""


def graph(shader, output="out", name="G", extra=""):
    return f'def ArnoldNodeGraph "{name}" {{ token outputs:color.connect = </{name}/S.outputs:{output}>\n {extra}\n {shader} }}\n'


def node(kind, *inputs, name="S"):
    return f'def Shader "{name}" {{ uniform token info:id = "{kind}"\n' + "\n".join(inputs) + "\n color3f outputs:out }\n"


def shaded(kind="RectLight", *inputs, shaders="primvars:arnold:shaders", path="/G"):
    return f'def {kind} "L" {{ string {shaders} = "{path}"\n' + "\n".join(inputs) + "}\n"


def dome_light(scene, folder):
    """Nits of a dome's texels."""
    lux = scene.lux("/L")
    codes = np.asarray(Image.open(io.BytesIO((folder / lux["texture"]).read_bytes())).convert("RGB"), float) / 255
    return np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4) * lux["radiance"]


FLAT = node("arnold:flat", "color3f inputs:color = (0.25, 2, 0)")
RAMP = node("arnold:ramp_rgb", "color3f[] inputs:color = [(1, 0, 0), (0, 4, 0)]", "float[] inputs:position = [0, 1]",
            "int[] inputs:interpolation = [1, 1]", 'token inputs:type = "v"')  # fmt: skip


@pytest.mark.parametrize("shaders", ["primvars:arnold:shaders", "arnold:shaders"])
@pytest.mark.parametrize(("kind", "emitted"), [
    ("RectLight", lambda s: s.nits("/L")), ("DiskLight", lambda s: s.nits("/L")), ("SphereLight", lambda s: s.nits("/L")),
    ("CylinderLight", lambda s: s.nits("/L")), ("DomeLight", lambda s: np.array(s.lux("/L")["radiance"])),
    ("DistantLight", lambda s: np.array(s.light("/L")["color"]) * s.light("/L")["intensity"]),
])  # fmt: skip
def test_a_constant_takes_the_place_of_colour_and_temperature(export, kind, emitted, shaders):
    inputs = ["color3f inputs:color = (1, 1, 9)", "float inputs:exposure = 3", "float inputs:intensity = 0.5",
              "bool inputs:enableColorTemperature = 1", "float inputs:colorTemperature = 2000", "float inputs:angle = 0"]  # fmt: skip
    inputs = inputs if kind == "DistantLight" else inputs[:-1]
    result = export(shaded(kind, *inputs, shaders=shaders) + graph(FLAT), "--strict=lights")
    assert result.code == 0, result.err
    assert emitted(Gltf(result.path)) == pytest.approx(4 * np.array([0.25, 2, 0]), rel=1e-6)
    assert f"{shaders} color" in result.noted()


def test_a_constant_over_time_is_carried_over_time(gltf):
    flat = node("arnold:flat", "color3f inputs:color.timeSamples = { 1: (1, 0, 0), 5: (0, 1, 0) }")
    values = gltf(FRAMES + shaded("RectLight", "float inputs:intensity = 8") + graph(flat)).lux("/L")["values"]
    assert np.array(values["rgb"]) == pytest.approx(np.array([[8 - 2 * step, 2 * step, 0] for step in range(5)]))


def test_a_ramp_lies_on_a_rect_light_as_its_picture_would(gltf):
    scene = gltf(shaded("RectLight", "float inputs:intensity = 3", "float inputs:width = 2", "color3f inputs:color = (0, 0, 1)") + graph(RAMP))
    rows = scene.light_map("/L").mean(axis=1)
    # The first row is on top, where v is 1.
    wanted = 3 * np.stack([LINEAR, 4 * (1 - LINEAR), 0 * LINEAR], axis=1)
    assert rows == pytest.approx(wanted, abs=0.02 * wanted.max())
    assert scene.light_map("/L").mean(axis=(0, 1)) == pytest.approx([1.5, 6, 0], rel=1e-3)
    # USD's +Y is up on the light: there is v = 0 of glTF.
    positions, uvs = scene.attribute("/L", "POSITION"), scene.attribute("/L", "TEXCOORD_0")
    assert (uvs[positions[:, 1] > 0, 1] == 0).all() and (uvs[positions[:, 1] < 0, 1] == 1).all()


def test_a_ramp_on_a_dome_runs_from_the_nadir_to_the_zenith(gltf, tmp_path):
    scene = gltf(shaded("DomeLight", "float inputs:intensity = 3") + graph(RAMP))
    wanted = 3 * np.stack([LINEAR, 4 * (1 - LINEAR), 0 * LINEAR], axis=1)
    assert dome_light(scene, tmp_path).mean(axis=1) == pytest.approx(wanted, abs=0.02 * wanted.max())


def test_a_pattern_of_two_coordinates(gltf):
    checker = node("arnold:checkerboard", "color3f inputs:color1 = (1, 0, 0)", "color3f inputs:color2 = (0, 0, 2)",
                   "float inputs:u_frequency = 1", "float inputs:v_frequency = 2")  # fmt: skip
    texels = gltf(shaded() + graph(checker)).light_map("/L")
    u, v = LINEAR[None, :], 1 - LINEAR[:, None]
    first = (np.floor(2 * u) + np.floor(4 * v)) % 2 == 0
    assert texels == pytest.approx(np.where(first[:, :, None], [1, 0, 0], [0, 0, 2]), abs=1e-3)


def test_an_image_is_as_texture_file_shows_it(gltf, tmp_path):
    codes = np.random.default_rng(3).integers(0, 256, (6, 8, 3), np.uint8)
    Image.fromarray(codes).save(tmp_path / "p.png")
    image = node("arnold:image", "asset inputs:filename = @p.png@")
    computed = gltf(shaded("RectLight", "float inputs:intensity = 7") + graph(image), out="a.glb")
    plain = gltf('def RectLight "L" { float inputs:intensity = 7\n asset inputs:texture:file = @p.png@ }', out="b.glb")
    wanted = plain.light_map("/L")
    assert computed.light_map("/L").mean(axis=(0, 1)) == pytest.approx(wanted.mean(axis=(0, 1)), rel=1e-3)
    assert computed.light_map("/L") == pytest.approx(wanted, abs=0.02 * wanted.max())


def test_the_network_rules_over_a_picture_that_is_authored_too(gltf, tmp_path):
    Image.new("RGB", (4, 4), (255, 255, 255)).save(tmp_path / "p.png")
    picture = "asset inputs:texture:file = @p.png@"
    assert gltf(shaded("RectLight", picture) + graph(FLAT)).nits("/L") == pytest.approx([0.25, 2, 0])
    lux = gltf(shaded("DomeLight", picture) + graph(FLAT)).lux("/L")
    assert "texture" not in lux and lux["radiance"] == pytest.approx([0.25, 2, 0])


@pytest.mark.parametrize("kind", ["DiskLight", "SphereLight", "CylinderLight", "DistantLight"])
def test_pictures_on_other_lights_are_lost_and_told_of(export, kind):
    result = export(shaded(kind, "color3f inputs:color = (1, 0.5, 1)") + graph(RAMP))
    assert "primvars:arnold:shaders color" in result.warned("lights")
    assert "only rect lights and domes have pictures" in result.said()


@pytest.mark.parametrize(("shader", "why"), [
    (node("arnold:noise"), "this node is not read"),
    (node("arnold:ramp_rgb", "color3f[] inputs:color = [(1, 0, 0)]", "float[] inputs:position = [0]", 'token inputs:type = "v"',
          'string inputs:uvset = "other"') , "not laid on the light as a whole"),
    (node("arnold:ramp_rgb", "color3f[] inputs:color.timeSamples = { 1: [(1, 0, 0), (0, 1, 0)], 5: [(0, 0, 1), (0, 1, 0)] }",
          "float[] inputs:position = [0, 1]", 'token inputs:type = "v"'), "its picture changes"),
    (node("arnold:flat", "color3f inputs:color.connect = </G/S.outputs:out>"), "reads itself"),
    (node("arnold:state_vector", 'string inputs:variable = "P"'), "which no texture can hold"),
])  # fmt: skip
def test_what_is_lost_says_why_and_leaves_the_light_its_own_colour(export, shader, why):
    result = export(FRAMES + shaded("RectLight", "color3f inputs:color = (1, 0.5, 0.25)") + graph(shader))
    assert result.code == 0, result.err
    assert why in result.said() and "primvars:arnold:shaders color" in result.warned("lights")
    assert Gltf(result.path).nits("/L") == pytest.approx([1, 0.5, 0.25])


def test_a_missing_image_is_told_of_under_lights(export):
    result = export(shaded() + graph(node("arnold:image", "asset inputs:filename = @gone.png@")))
    assert "missing texture" in result.warned("lights")
    assert not Gltf(result.path).nits("/L").any()


def test_a_connected_colour_is_multiplied_by_the_temperature(gltf):
    """UsdLux's formula, whatever gives the colour its value."""
    inputs = "bool inputs:enableColorTemperature = 1\n float inputs:colorTemperature = 3000\n float inputs:intensity = 2"
    constant = node("ND_constant_color3", "color3f inputs:value = (0.5, 1, 0.25)")
    scene = gltf(f'def RectLight "L" {{ color3f inputs:color.connect = </S.outputs:out>\n {inputs} }}\n{constant}')
    plain = gltf(f'def RectLight "L" {{ color3f inputs:color = (0.5, 1, 0.25)\n {inputs} }}', out="plain.glb")
    assert scene.nits("/L") == pytest.approx(plain.nits("/L"), rel=1e-6)


def test_a_connected_colour_beside_a_picture_is_lost(export, tmp_path):
    Image.new("RGB", (4, 4), (255, 255, 255)).save(tmp_path / "p.png")
    light = 'def RectLight "L" { color3f inputs:color.connect = </G/S.outputs:out>\n asset inputs:texture:file = @p.png@ }\n'
    assert "it would multiply a picture" in export(light + graph(RAMP)).said()
    flat = export(light + graph(FLAT), "--strict=lights")
    assert flat.code == 0 and Gltf(flat.path).light_map("/L")[0, 0] == pytest.approx([0.25, 2, 0])


def test_a_graph_that_is_named_in_a_referenced_layer(gltf, tmp_path):
    """As in arnold-usd's test 2645: the string has the path in the layer, not that on the stage."""
    inner = f'#usda 1.0\ndef Xform "root" {{ {shaded(path="/root/G")} {graph(FLAT).replace("</G/", "</root/G/")} }}'
    (tmp_path / "lamp.usda").write_text(inner.replace("}", "\n}"))
    scene = gltf('def "a" (references = @lamp.usda@</root>) {}\ndef Xform "b" { def "c" (references = @lamp.usda@</root>) {} }')
    assert scene.nits("/a/L") == pytest.approx([0.25, 2, 0]) and scene.nits("/b/c/L") == pytest.approx([0.25, 2, 0])


@pytest.mark.parametrize("path", ["/Gone", "G", "not a path"])
def test_a_graph_that_is_not_there_is_listed(export, path):
    result = export(shaded(path=path) + graph(FLAT))
    assert "arnold attributes" in result.warned("lights") and Gltf(result.path).nits("/L") == pytest.approx([1] * 3)


# -- filters -----------------------------------------------------------------------------------------


def filtered(*filters, light="float inputs:intensity = 3"):
    names = ", ".join(f"</F{number}>" for number in range(len(filters)))
    prims = "".join(f'def {kind} "F{number}" {{ {body} }}\n' for number, (kind, body) in enumerate(filters))
    return f'def RectLight "L" {{ rel light:filters = [{names}]\n {light} }}\n{prims}'


MULTIPLIER = "PxrIntMultLightFilter"


@pytest.mark.parametrize("prefix", ["inputs:ri:", "ri:", "inputs:ri:light:", "inputs:"])
@pytest.mark.parametrize("intensity", [1e-4, 0.5, 1, 40])
@pytest.mark.parametrize("exposure", [-9, 0, 2.5])
@pytest.mark.parametrize("invert", [0, 1])
def test_a_filter_that_multiplies_is_put_into_the_light(export, prefix, intensity, exposure, invert):
    body = f"float {prefix}intensity = {intensity}\n float {prefix}exposure = {exposure}\n bool {prefix}invert = {invert}"
    result = export(filtered((MULTIPLIER, body)), "--strict")
    assert result.code == 0, result.err
    factor = intensity * 2.0**exposure
    assert Gltf(result.path).nits("/L") == pytest.approx([3 * (1 / factor if invert else factor)] * 3, rel=1e-5)


def test_filters_multiply_one_another_and_over_time(gltf):
    one = "float inputs:ri:intensity.timeSamples = { 1: 1, 5: 3 }\n float inputs:ri:density = 0.5"
    two = "float inputs:ri:exposure = 2\n float inputs:ri:diffuse = 1\n float inputs:colorSaturation = 1"
    values = gltf(FRAMES + filtered((MULTIPLIER, one), (MULTIPLIER, two))).lux("/L")["values"]
    assert np.array(values["rgb"])[:, 0] == pytest.approx(12 * np.array([1, 1.5, 2, 2.5, 3]))


@pytest.mark.parametrize(("kind", "body", "why"), [
    (MULTIPLIER, "float inputs:ri:intensity = 5\n float inputs:ri:diffuse = 0.5", "its diffuse is 0.5"),
    (MULTIPLIER, "float inputs:ri:intensity = 5\n float inputs:ri:specular = 0", "its specular is 0"),
    (MULTIPLIER, "float inputs:ri:intensity = 5\n float inputs:colorSaturation = 0", "its colorSaturation is 0"),
    (MULTIPLIER, "float inputs:ri:intensity = 5\n float inputs:ri:wonder = 0", "nobody knows its wonder"),
    (MULTIPLIER, "float inputs:ri:intensity.connect = </F0.inputs:x>", "its intensity is connected"),
    ("PxrBarnLightFilter", "float inputs:width = 2", "PxrBarnLightFilter"),
    ("LightFilter", 'uniform token lightFilter:shaderId = "SomeFilter"', "SomeFilter"),
])  # fmt: skip
def test_other_filters_are_told_of_and_leave_the_light_as_it_is(export, kind, body, why):
    result = export(filtered((kind, body)))
    assert "light filters" in result.warned("lights") and why in result.said()
    assert Gltf(result.path).nits("/L") == pytest.approx([3] * 3)


@pytest.mark.parametrize(("kind", "body"), [
    ("LightFilter", ""), (MULTIPLIER, ""), (MULTIPLIER, "uniform bool collection:filterLink:includeRoot = 1"),
])  # fmt: skip
def test_filters_that_do_nothing_are_no_losses(export, kind, body):
    result = export(filtered((kind, body)), "--strict")
    assert result.code == 0, result.err
    assert Gltf(result.path).nits("/L") == pytest.approx([3] * 3)


@pytest.mark.parametrize(("shader", "is_lost"), [
    (node("arnold:light_decay", name="F"), False),
    (node("arnold:light_decay", "bool inputs:use_near_atten = 1", name="F"), True),
    (node("arnold:light_decay", "bool inputs:use_far_atten = 1", name="F"), True),
    (node("arnold:light_decay", "bool inputs:use_far_atten.connect = </G/S.outputs:out>", name="F"), True),
    (node("arnold:light_blocker", "float inputs:density = 0", name="F"), False),
    (node("arnold:light_blocker", name="F"), True),
    (node("arnold:barndoor", name="F"), True),
])  # fmt: skip
def test_arnolds_filters(export, shader, is_lost):
    result = export(shaded() + graph(FLAT, extra="token outputs:filters:i1.connect = </G/F.outputs:out>\n" + shader))
    assert ("light filters" in result.warned("lights")) == is_lost
    assert not is_lost or "/G/F" in result.said()
    assert Gltf(result.path).nits("/L") == pytest.approx([0.25, 2, 0])


def test_a_filter_that_is_not_there_is_told_of(export):
    result = export('def RectLight "L" { rel light:filters = </Gone> }')
    assert "light filters" in result.warned("lights") and "it is not there" in result.said()


def test_a_graph_inside_an_instance(gltf, tmp_path):
    inner = f'#usda 1.0\ndef Xform "root" {{ {shaded(path="/root/G")} {graph(FLAT).replace("</G/", "</root/G/")} }}'
    (tmp_path / "lamp.usda").write_text(inner.replace("}", "\n}"))
    instances = "".join(f'def "{name}" (instanceable = true\n references = @lamp.usda@</root>) {{}}\n' for name in "ab")
    scene = gltf(instances)
    assert scene.nits("/a/L") == pytest.approx([0.25, 2, 0]) and scene.nits("/b/L") == pytest.approx([0.25, 2, 0])


# -- colour spaces -----------------------------------------------------------------------------------

SPACES = sorted({str(getattr(Gf.ColorSpaceNames, name)) for name in dir(Gf.ColorSpaceNames) if name[0].isupper()})
COLOR = (0.6, 0.5, 0.4)


@pytest.mark.parametrize("space", SPACES)
@pytest.mark.parametrize("above", [False, True])
def test_a_colour_is_converted_from_its_space_as_usd_does_it(export, space, above):
    """The space of the attribute, or that of ColorSpaceAPI on a prim above."""
    said = "" if above else f'(colorSpace = "{space}")'
    api = f'(prepend apiSchemas = ["ColorSpaceAPI"]) {{ uniform token colorSpace:name = "{space}"' if above else "{"
    text = f'def Xform "X" {api}\n def RectLight "L" {{ float inputs:intensity = 2\n color3f inputs:color = {COLOR} {said}\n }} }}'
    result = export(text, "--strict")
    assert result.code == 0, result.err
    same = space in ("raw", "data", "unknown", "identity")
    wanted = COLOR if same else Gf.Color(Gf.Color(Gf.Vec3f(*COLOR), Gf.ColorSpace(space)), Gf.ColorSpace("lin_rec709_scene")).GetRGB()
    assert Gltf(result.path).nits("/X/L") == pytest.approx(2 * np.array(list(wanted)), rel=1e-4)


def test_a_colour_space_that_nobody_knows_is_told_of(export):
    result = export(f'def RectLight "L" {{ color3f inputs:color = {COLOR} (colorSpace = "my_space")\n }}')
    assert "color space my_space" in result.warned("lights")
    assert Gltf(result.path).nits("/L") == pytest.approx(COLOR)
