"""Networks of shaders: what nodes compute, and networks that are broken, odd or huge."""

import colorsys
import time

import numpy as np
import pytest
from conftest import Gltf
from networks import image, link, network, node
from test_materials import QUAD, picture

MULTIPLY, ADD = "ND_multiply_color3", "ND_add_color3"


def base(scene: Gltf) -> list[float]:
    return scene.material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3]


def computed(
    gltf, identifier: str, inputs: str, outputs: str = "color3f outputs:out", output: str = "out", kind: str = "color3f"
):
    """The base colour that a single node of constants makes."""
    return base(gltf(network(link("base_color", "N", kind, output), node("N", identifier, inputs, outputs))))


def red(inputs: str) -> str:
    return f"color3f inputs:in = (0.8, 0.4, 0.2)\n{inputs}"


HUE, SATURATION, VALUE = colorsys.rgb_to_hsv(0.8, 0.4, 0.2)
NODES = [
    ("ND_invert_color3", red(""), (0.2, 0.6, 0.8)),
    ("ND_clamp_color3", red("color3f inputs:high = (0.5, 0.3, 0.3)"), (0.5, 0.3, 0.2)),
    ("ND_power_color3", "color3f inputs:in1 = (0.5, 0.25, 1)\n color3f inputs:in2 = (2, 0.5, 3)", (0.25, 0.5, 1)),
    ("ND_modulo_color3", "color3f inputs:in1 = (1.75, -0.25, 2)\n color3f inputs:in2 = (1, 1, 1)", (0.75, 0.75, 0)),
    ("ND_rgbtohsv_color3", red(""), (HUE, SATURATION, VALUE)),
    ("ND_hsvtorgb_color3", f"color3f inputs:in = ({HUE}, {SATURATION}, {VALUE})", (0.8, 0.4, 0.2)),
    ("ND_remap_color3", red("color3f inputs:outlow = (1, 1, 1)\n color3f inputs:outhigh = (0, 0, 0)"), (0.2, 0.6, 0.8)),
    ("ND_range_color3", red("color3f inputs:gamma = (2, 2, 2)"), (0.8**0.5, 0.4**0.5, 0.2**0.5)),
    ("ND_contrast_color3", red("color3f inputs:amount = (0.5, 0.5, 0.5)"), (0.65, 0.45, 0.35)),
    ("ND_saturate_color3", red("float inputs:amount = 0"), (0.8 * 0.2722287 + 0.4 * 0.6740818 + 0.2 * 0.0536895,) * 3),
    ("ND_screen_color3", "color3f inputs:fg = (0.5, 0, 1)\n color3f inputs:bg = (0.5, 0.25, 0)", (0.75, 0.25, 1)),
    ("ND_difference_color3", "color3f inputs:fg = (0.5, 0, 1)\n color3f inputs:bg = (0.25, 0.25, 0)", (0.25, 0.25, 1)),
    ("ND_swizzle_color3_color3", red('string inputs:channels = "bg1"'), (0.2, 0.4, 1)),
    (
        "ND_ifgreater_color3",
        "float inputs:value1 = 2\n float inputs:value2 = 1\n color3f inputs:in1 = (0.1, 0.2, 0.3)",
        (0.1, 0.2, 0.3),
    ),
    ("ND_switch_color3", "float inputs:which = 1\n color3f inputs:in2 = (0.1, 0.2, 0.3)", (0.1, 0.2, 0.3)),
    ("ND_combine3_color3", "float inputs:in1 = 0.1\n float inputs:in3 = 0.3", (0.1, 0, 0.3)),
    ("ND_smoothstep_color3", "color3f inputs:in = (0.5, -1, 2)", (0.5, 0, 1)),
    ("ND_hsvadjust_color3", red("vector3f inputs:amount = (0, 1, 0.5)"), (0.4, 0.2, 0.1)),
    ("ND_divide_color3FA", "color3f inputs:in1 = (0.5, 0.25, 1)\n float inputs:in2 = 2", (0.25, 0.125, 0.5)),
]


@pytest.mark.parametrize(("identifier", "inputs", "expected"), NODES)
def test_nodes(gltf, identifier, inputs, expected):
    assert computed(gltf, identifier, inputs) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("identifier", "inputs", "expected"), [row for row in NODES if "inputs:in =" in row[1]])
def test_nodes_compute_on_texels_what_they_compute_on_constants(gltf, tmp_path, identifier, inputs, expected):
    picture(tmp_path / "white.png", 255, 255, 255)
    name = "in"
    value = next(line for line in inputs.splitlines() if "inputs:in =" in line).split("=")[1]
    rest = "\n".join(line for line in inputs.splitlines() if "inputs:in =" not in line)
    shaders = image("W", "white.png") + node("T", MULTIPLY, f"color3f inputs:in2 = {value}\n" + link("in1", "W"))
    scene = gltf(network(link("base_color", "N"), shaders + node("N", identifier, link(name, "T") + "\n" + rest)))
    surface = scene.material("/M")["pbrMetallicRoughness"]
    codes = scene.image(surface["baseColorTexture"])[0, 0]
    found = (
        np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
        * surface.get("baseColorFactor", [1] * 4)[:3]
    )
    assert found == pytest.approx(expected, abs=6e-3)


def test_separated_outputs(gltf):
    shaders = node(
        "N",
        "ND_separate3_color3",
        "color3f inputs:in = (0.1, 0.2, 0.3)",
        "float outputs:outr\n float outputs:outg\n float outputs:outb",
    )
    scene = gltf(
        network(link("specular_roughness", "N", "float", "outb") + link("metalness", "N", "float", "outr"), shaders)
    )
    surface = scene.material("/M")["pbrMetallicRoughness"]
    assert (surface["roughnessFactor"], surface["metallicFactor"]) == (pytest.approx(0.3), pytest.approx(0.1))


def test_interfaces_and_node_graphs_are_followed(gltf):
    graph = """def NodeGraph "G" {
        color3f inputs:tint.connect = </Mat.inputs:tint>
        color3f outputs:result.connect = </Mat/G/N.outputs:out>
        def Shader "N" {
            uniform token info:id = "ND_multiply_color3"
            color3f inputs:in1.connect = </Mat/G.inputs:tint>
            color3f inputs:in2 = (0.5, 0.5, 1)
            color3f outputs:out
        }
    }"""
    text = network(
        "color3f inputs:base_color.connect = </Mat/G.outputs:result>",
        graph,
        interface="color3f inputs:tint = (0.8, 0.4, 0.2)",
    )
    assert base(gltf(text)) == pytest.approx([0.4, 0.2, 0.2])


def test_a_surface_behind_a_node_graph(gltf):
    text = (
        QUAD
        + """def Material "Mat" {
        token outputs:mtlx:surface.connect = </Mat/G.outputs:out>
        def NodeGraph "G" {
            token outputs:out.connect = </Mat/G/S.outputs:out>
            def Shader "S" {
                uniform token info:id = "ND_standard_surface_surfaceshader"
                color3f inputs:base_color = (0.1, 0.2, 0.3)
                token outputs:out
            }
        }
    }"""
    )
    assert base(gltf(text)) == pytest.approx([0.1, 0.2, 0.3])


def test_the_surface_of_a_renderer_comes_before_the_universal_one(gltf):
    preview = """token outputs:surface.connect = </Mat/P.outputs:surface>"""
    shader = node("P", "UsdPreviewSurface", "color3f inputs:diffuseColor = (1, 0, 0)", "token outputs:surface")
    text = network("color3f inputs:base_color = (0.1, 0.2, 0.3)", shader, interface=preview)
    assert base(gltf(text)) == pytest.approx([0.1, 0.2, 0.3])
    unread = network("", shader, identifier="ND_surface", interface=preview)
    assert base(gltf(unread)) == pytest.approx([1, 0, 0])


BROKEN = {
    "cycle": (
        link("base_color", "A"),
        node("A", ADD, link("in1", "B")) + node("B", ADD, link("in1", "A")),
        "reads itself",
    ),
    "self": (link("base_color", "A"), node("A", ADD, link("in1", "A")), "reads itself"),
    "unknown": (link("base_color", "A"), node("A", "ND_gone_color3"), "nobody knows this node"),
    "noise": (link("base_color", "A"), node("A", "ND_fractal3d_color3"), "this node is not read"),
    "no id": (link("base_color", "A"), 'def Shader "A" { color3f outputs:out }', "nobody knows this node"),
    "other": (link("base_color", "A"), node("A", "PxrTexture"), "nobody knows this node"),
    "position": (link("base_color", "A"), node("A", "ND_position_vector3", "", "vector3f outputs:out"), "position"),
    "connected file": (
        link("base_color", "A"),
        node("A", "ND_image_color3", link("file", "B", "asset"))
        + node("B", "ND_constant_filename", "", "asset outputs:out"),
        "its file is connected",
    ),
}


@pytest.mark.parametrize("name", BROKEN)
def test_what_cannot_be_computed_is_lost_alone(export, name):
    inputs, shaders, why = BROKEN[name]
    result = export(network(inputs + "float inputs:specular_roughness = 0.7", shaders))
    assert result.code == 0, result.err
    assert result.warned("materials") == {"standard_surface base_color"}, result.said()
    (line,) = result.report["warnings"]
    assert line["path"] == "/Mat" and why in line["why"]
    surface = Gltf(result.path).material("/M")["pbrMetallicRoughness"]
    assert surface["baseColorFactor"][0] == pytest.approx(0.8) and surface["roughnessFactor"] == pytest.approx(0.7)


@pytest.mark.parametrize("name", BROKEN)
def test_a_lost_glow_is_no_light(export, name):
    inputs, shaders, _ = BROKEN[name]
    result = export(network(inputs.replace("base_color", "emission_color") + "float inputs:emission = 5", shaders))
    assert result.code == 0
    assert result.warned("lights") == {"standard_surface emission_color"}
    assert Gltf(result.path).nits("/M") == pytest.approx([0] * 3)
    # What has no weight is not looked at.
    dark = export(network(inputs.replace("base_color", "emission_color"), shaders), out="dark.glb")
    assert dark.report["warnings"] == []


def test_a_connection_to_nothing_is_the_default(gltf):
    assert base(gltf(network("color3f inputs:base_color.connect = </Gone.outputs:out>"))) == pytest.approx([0.8] * 3)
    assert base(gltf(network(link("base_color", "A"), node("A", ADD)))) == pytest.approx([0] * 3)


def test_values_of_wrong_types_are_lost(export):
    result = export(network('string inputs:base_color = "red"\n float[] inputs:metalness = []'))
    assert result.code == 0
    assert result.warned("materials") == {"standard_surface base_color", "standard_surface metalness"}


def test_numbers_that_are_none_are_harmless(gltf):
    text = "color3f inputs:base_color = (inf, -1, nan)\n float inputs:specular_roughness = nan\n float inputs:emission = nan"
    surface = gltf(network(text)).material("/M")["pbrMetallicRoughness"]
    assert all(0 <= part <= 1 for part in surface["baseColorFactor"])


def test_a_network_of_many_paths_is_evaluated_once(gltf):
    shaders = "".join(node(f"N{i}", ADD, link("in1", f"N{i + 1}") + link("in2", f"N{i + 1}")) for i in range(60))
    shaders += node("N60", "ND_constant_color3", f"color3f inputs:value = ({2.0**-60}, 0, 0)")
    started = time.monotonic()
    assert base(gltf(network(link("base_color", "N0"), shaders))) == pytest.approx([1, 0, 0])
    assert time.monotonic() - started < 10


@pytest.mark.parametrize(("count", "why"), [(1000, None), (2500, "nodes deep"), (20_001, "more than 20000 shaders")])
def test_long_networks(export, count, why):
    shaders = [
        node(f"N{i}", ADD, link("in1", f"N{i + 1}") + "color3f inputs:in2 = (0.0001, 0, 0)") for i in range(count - 1)
    ]
    text = network(link("base_color", "N0"), "".join(shaders) + node(f"N{count - 1}", "ND_constant_color3"))
    result = export(text)
    assert result.code == 0, result.err
    if why is None:
        assert base(Gltf(result.path))[0] == pytest.approx((count - 1) * 1e-4, rel=1e-3)
    else:
        assert why in result.said()


def test_materials_and_shaders_of_equal_names_are_told_apart(gltf):
    text = network("color3f inputs:base_color = (0.1, 0, 0)")
    other = text.replace('"M"', '"M2"').replace('"Mat"', '"Mat2"').replace("/Mat", "/Mat2").replace("0.1", "0.9")
    scene = gltf(text + "\n" + other)
    assert base(scene)[0] == pytest.approx(0.1)
    assert scene.material("/M2")["pbrMetallicRoughness"]["baseColorFactor"][0] == pytest.approx(0.9)


def test_a_baked_texture_of_each_material_is_its_own(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    shaders = image("I", "a.png") + node("N", "ND_power_color3FA", "float inputs:in2 = 2\n" + link("in1", "I"))
    text = network(link("base_color", "N"), shaders)
    other = (
        text.replace('"M"', '"M2"').replace('"Mat"', '"Mat2"').replace("/Mat", "/Mat2").replace("in2 = 2", "in2 = 3")
    )
    scene = gltf(text + "\n" + other)
    infos = [scene.material(path)["pbrMetallicRoughness"]["baseColorTexture"] for path in ("/M", "/M2")]
    assert scene.image(infos[0])[0, 0, 0] > scene.image(infos[1])[0, 0, 0] > 0


def test_stages_without_materialx_do_not_load_it(tmp_path):
    import subprocess
    import sys

    from conftest import ROOT
    from test_materials import surface

    (tmp_path / "s.usda").write_text("#usda 1.0\n" + surface("float inputs:metallic = 1").replace("}", "\n}"))
    program = "import sys; sys.path.insert(0, sys.argv[1]); from usd_gltf.cli import main"
    program += "; print(main(sys.argv[2:]), 'MaterialX' in sys.modules)"
    arguments = [str(ROOT / "scripts"), str(tmp_path / "s.usda"), str(tmp_path / "s.glb")]
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "0 False"


def test_weights_and_colors_on_different_coordinates(export, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    tiled = node(
        "B", "ND_tiledimage_float", "asset inputs:file = @a.png@\n float2 inputs:uvtiling = (2, 2)", "float outputs:out"
    )
    text = "".join(link(name, "A") for name in ("base_color", "emission_color")) + "".join(
        link(n, "B", "float") for n in ("base", "emission")
    )
    result = export(network(text, image("A", "a.png") + tiled))
    assert result.code == 0
    assert result.warned("materials") == {"standard_surface base"}
    assert result.warned("lights") == {"standard_surface emission"}
    scene = Gltf(result.path)
    assert "baseColorTexture" in scene.material("/M")["pbrMetallicRoughness"]
    assert scene.nits("/M") == pytest.approx([0] * 3)
