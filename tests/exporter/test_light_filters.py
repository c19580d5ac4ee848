"""Light filters that stand at nodes of their own: RenderMan's rods, Arnold's blockers and decay."""

import numpy as np
import pytest
from conftest import Gltf
from test_light_networks import FRAMES, node

LAMP = 'def SphereLight "L" { rel light:filters = </F> }\n'
ROD = "PxrRodLightFilter"


def rod(body="", kind=ROD, light=LAMP):
    return f'{light}def {kind} "F" {{ {body} }}\n'


def filter_at(path, at="/F"):
    return Gltf(path).node(at)["extras"]["usdLightFilter"]


def carried(export, text, *options):
    result = export(text, *options)
    assert result.code == 0 and "light filters" not in result.warned(), result.err
    assert Gltf(result.path).lux("/L")["filters"] == ["/F"]
    return filter_at(result.path)


def lost(export, text, why):
    result = export(text)
    assert "light filters" in result.warned("lights") and why in result.said(), result.said()
    assert "filters" not in Gltf(result.path).lux("/L")


# -- rods --------------------------------------------------------------------------------------------


def test_a_rod_without_anything_is_the_ball_of_usds_schema(export):
    found = carried(export, rod(), "--strict")
    ramp = found.pop("ramp")
    assert found == {"type": "rod", "min": [0] * 3, "max": [0] * 3, "radius": 1, "edge": 0.25, "inside": [0] * 3}
    assert ramp[0] == [0, 0] and ramp[-1] == [1, 1] and len(ramp) > 20
    x, y = np.array(ramp).T
    assert (np.diff(x) > 0).all() and (np.diff(y) >= 0).all()
    # The middle of a symmetric spline, and its B-spline at the knots next to it: (0 + 4 * 0.3 + 0.7) / 6 across, (4 * 0.2 + 0.8) / 6 up.
    assert np.interp(0.5, x, y) == pytest.approx(0.5, abs=1e-6)
    assert np.interp(1.9 / 6, x, y) == pytest.approx(1.6 / 6, abs=1e-6)


@pytest.mark.parametrize("names", [
    ("inputs:ri:lightFilter:edge", "inputs:ri:lightFilter:left", "inputs:ri:lightFilter:scaleWidth", "inputs:ri:lightFilter:density"),
    ("inputs:edgeThickness", "inputs:refine:left", "inputs:scale:width", "inputs:ri:density"),
    ("edgeThickness", "refine:left", "scale:width", "ri:density"),
])  # fmt: skip
def test_a_rod_under_the_names_of_three_times(export, names):
    edge, left, scale, density = names
    prefix = edge.rpartition(":")[0] + ":" if "lightFilter" in edge else "inputs:" * edge.startswith("inputs:")
    spline = "falloff_" if "lightFilter" in edge else "falloff:"
    case = str.title if "lightFilter" in edge else str.lower
    body = f"""float {edge} = 0.5\n float {left} = 0.25\n float {scale} = 2\n float {density} = 0.75
        float {prefix}width = 3\n float {prefix}height = 1\n float {prefix}depth = 0.5\n float {prefix}radius = 0.125
        float[] {prefix}{spline}{case("knots")} = [0, 0, 0.5, 1, 1]\n float[] {prefix}{spline}{case("floats")} = [0, 0, 0.25, 1, 1]
        token {prefix}{spline}{case("interpolation")} = "linear" """
    assert carried(export, rod(body), "--strict") == {
        "type": "rod", "min": [-6.25, -1, -0.5], "max": [6, 1, 0.5], "radius": 0.125, "edge": 0.5,
        "ramp": [[0, 0], [0.5, 0.25], [1, 1]], "inside": [0.25] * 3,
    }  # fmt: skip


def test_a_rod_by_its_shader_and_every_side(export):
    names = ("left", "right", "bottom", "top", "back", "front")
    body = "\n".join(f"float inputs:ri:lightFilter:{name} = {i + 1}" for i, name in enumerate(names))
    edges = "\n".join(f"float inputs:ri:lightFilter:{name}Edge = 2" for name in names)
    kind = 'uniform token lightFilter:shaderId = "PxrRodLightFilter"\n'
    found = carried(export, rod(f"{kind}{body}\n{edges}", "LightFilter"))
    assert (found["min"], found["max"], found["edge"]) == ([-1, -3, -5], [2, 4, 6], 0.5)


def test_a_rod_turned_inside_out_and_one_that_brightens(export):
    found = carried(export, rod("bool inputs:ri:invert = 1"))
    assert (found["inside"], found["outside"]) == ([1] * 3, [0] * 3)
    found = carried(export, rod("float inputs:ri:intensity = 3\n float inputs:ri:density = 0.5"))
    assert found["inside"] == [2] * 3 and "outside" not in found


@pytest.mark.parametrize(("body", "why"), [
    ("bool inputs:ri:invert = 1\n float inputs:ri:density = 0.5", "inverted"),
    ("float inputs:ri:density = 1.5", "its density is 1.5"),
    ("float inputs:ri:intensity = -1", "its intensity is -1"),
    ("float inputs:ri:intensity = 0.5\n float inputs:ri:exposure = 1", "its exposure is 1"),
    ("float inputs:ri:intensity = 0.5\n float inputs:ri:diffuse = 0", "its diffuse is 0"),
    ("float inputs:ri:intensity = 0.5\n float inputs:color:saturation = 0", "its saturation is 0"),
    ("float inputs:ri:intensity = 0.5\n color3f[] inputs:colorRamp:colors = [(1, 0, 0)]", "its colours are not white"),
    ("float inputs:edgeScale:left = 2", "the edges of its sides differ"),
    ("float inputs:radius = -1", "its size is none"),
    ("float inputs:width = -1", "its size is none"),
    ("float inputs:radius = nan", "its size is none"),
    ("string inputs:radius = \"wide\"", "its radius is 'wide'"),
    ('token inputs:falloff:interpolation = "constant"', "its falloff is constant"),
    ("float[] inputs:falloff:floats = [1, 1, 0.8, 0.2, 0, 0]", "its falloff does not ascend"),
    ("float[] inputs:falloff:floats = [0, 1]", "its falloff does not ascend"),
    ("int inputs:falloff = 2", "its falloff does not ascend"),
    ("float inputs:wonder = 1", "nobody knows its wonder"),
    ("float inputs:radius.connect = </F.inputs:x>", "its radius is connected"),
    ('token inputs:ri:combineMode = "max"', "combined with others"),
])  # fmt: skip
def test_rods_whose_meaning_is_not_published_are_lost(export, body, why):
    lost(export, rod(body), why)


def test_a_blocker_of_renderman_says_its_size_or_is_lost(export):
    body = "\n".join(f"float inputs:ri:lightFilter:{name} = 1" for name in ("width", "height", "depth", "radius", "edge", "intensity"))
    found = carried(export, rod(body, "PxrBlockerLightFilter"))
    assert (found["max"], found["radius"], found["edge"], found["inside"]) == ([1] * 3, 1, 1, [1] * 3)
    lost(export, rod("float inputs:ri:lightFilter:width = 1", "PxrBlockerLightFilter"), "its height is not authored")


@pytest.mark.parametrize("above", ["", 'token visibility = "invisible"'])
@pytest.mark.parametrize("own", ["", 'token visibility = "invisible"'])
@pytest.mark.parametrize("inactive", ["", "(active = false)"])
def test_filters_that_are_switched_off_do_nothing(export, above, own, inactive):
    text = f'def SphereLight "L" {{ rel light:filters = </X/F> }}\ndef Xform "X" {{ {above}\n def {ROD} "F" {inactive} {{ {own} }}\n }}'
    result = export(text, "--strict")
    assert result.code == 0, result.err
    is_on = not (above or own or inactive)
    assert Gltf(result.path).lux("/L").get("filters") == (["/X/F"] if is_on else None)


def test_a_rod_moves_with_its_node_and_holds_its_first_shape(export):
    move = "double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 5: (4, 0, 0) }\n uniform token[] xformOpOrder = [\"xformOp:translate\"]"
    result = export(FRAMES + rod(f"{move}\n float inputs:radius.timeSamples = {{ 1: 2, 5: 3 }}"))
    assert result.warned("lights") == {"animated light filter"} and "inputs:radius" in result.said()
    scene = Gltf(result.path)
    assert filter_at(result.path)["radius"] == 2
    assert scene.channels("/F")["translation"][1][-1].tolist() == [4, 0, 0]


def test_filters_in_instances_and_placed_ones_are_those_beside_the_light(gltf, tmp_path):
    lamp = f'def Xform "root" {{ def SphereLight "L" {{ rel light:filters = </root/F> }}\n def {ROD} "F" {{ }}\n }}'
    (tmp_path / "lamp.usda").write_text(f'#usda 1.0\n{lamp}\n'.replace("}", "\n}"))
    instances = "".join(f'def "{name}" (instanceable = true\n references = @lamp.usda@</root>) {{}}\n' for name in "ab")
    scene = gltf(instances)
    assert scene.lux("/a/L")["filters"] == ["/a/F"] and scene.lux("/b/L")["filters"] == ["/b/F"]
    assert "usdLightFilter" in scene.node("/b/F")["extras"]
    placed = f"""def {ROD} "Shared" {{ }}
        def PointInstancer "P" {{
            rel prototypes = </P/Lamp>
            int[] protoIndices = [0, 0]
            point3f[] positions = [(0, 0, 0), (5, 0, 0)]
            def Xform "Lamp" {{
                def SphereLight "L" {{ rel light:filters = [</P/Lamp/F>, </Shared>] }}
                def {ROD} "F" {{ }}
            }}
        }}"""
    scene = gltf(placed)
    assert scene.lux("/P[1]/L")["filters"] == ["/P[1]/F", "/Shared"]
    assert "usdLightFilter" in scene.node("/P[1]/F")["extras"]


# -- Arnold ------------------------------------------------------------------------------------------

BOX = 'token inputs:geometry_type = "box"\n matrix4d inputs:geometry_matrix = ((2, 0, 0, 0), (0, 3, 0, 0), (0, 0, 4, 0), (5, 6, 7, 1))'


def filtered(shader, kind="SphereLight", name="primvars:arnold:shaders", body=""):
    graph = f'def ArnoldNodeGraph "G" {{ token outputs:filters:i1.connect = </G/F.outputs:out>\n {shader} }}'
    return f'def {kind} "L" {{ string {name} = "/G"\n {body} }}\n{graph}'


def blocker(body):
    return node("arnold:light_blocker", body, name="F")


def test_a_blocker_of_arnold_stands_by_its_matrix(export):
    body = f"{BOX}\n float inputs:density = 0.5\n color3f inputs:shader = (0, 1, 0.5)"
    text = '#usda 1.0\n(metersPerUnit = 0.01)\ndef Xform "X" { double3 xformOp:translate = (9, 9, 9)\n uniform token[] xformOpOrder = ["xformOp:translate"]\n'
    text += filtered(blocker(body)).replace('"/G"', '"/X/G"').replace("</G", "</X/G") + "\n}"
    result = export(text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    assert scene.lux("/X/L")["filters"] == ["/X/G/F"]
    found = scene.node("/X/G/F")["extras"]["usdLightFilter"]
    assert found == {"type": "blocker", "shape": "box", "through": [0.5, 1, 0.75]}
    # In the world, whatever is above it.
    place = scene.world("/X/G/F")
    assert np.diag(place)[:3] == pytest.approx([0.02, 0.03, 0.04]) and place[:3, 3] == pytest.approx([0.05, 0.06, 0.07])


def test_a_blocker_of_a_material_that_a_light_names(export):
    material = f'def Material "M" {{ token outputs:surface.connect = </M/F.outputs:out>\n {blocker(BOX)} }}'
    result = export(f'def DomeLight "L" {{ rel light:filters = </M>\n rel filters = </M> }}\n{material}', "--strict")
    assert result.code == 0, result.err
    assert Gltf(result.path).lux("/L")["filters"] == ["/M/F"]


def test_nothing_hides_a_shader(export):
    light, _, graph = filtered(blocker(BOX)).partition("\ndef ")
    text = light.replace('"/G"', '"/X/G"') + '\ndef Xform "X" { token visibility = "invisible"\n def ' + graph.replace("</G", "</X/G") + "\n}"
    assert Gltf(export(text, "--strict").path).lux("/L")["filters"] == ["/X/G/F"]


def test_a_blocker_moves(export):
    moving = BOX.replace("geometry_matrix = ", "geometry_matrix.timeSamples = { 1: ") + ", 5: ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)) }"
    result = export(FRAMES + filtered(blocker(moving)), "--strict")
    assert result.code == 0, result.err
    assert Gltf(result.path).channels("/G/F")["translation"][1][[0, -1]].tolist() == [[5, 6, 7], [0, 0, 0]]


@pytest.mark.parametrize(("body", "why"), [
    (BOX.replace('"box"', '"cylinder"'), "the place of a cylinder is not published"),
    (BOX.partition("\n")[2], "its geometry_type is not authored"),
    (BOX.partition("\n")[0], "its geometry_matrix is not authored"),
    (BOX + "\n float inputs:width_edge = 0.5", "its width_edge is 0.5"),
    (BOX + "\n float inputs:ramp = 0.5", "its ramp is 0.5"),
    (BOX.replace('"box"', '"plane"') + "\n float inputs:roundness = 1", "its roundness is 1"),
    (BOX + "\n float inputs:density = 2", "its density is 2"),
    (BOX + "\n color3f inputs:shader.connect = </G/S.outputs:out>", "its shader is connected"),
])  # fmt: skip
def test_blockers_whose_meaning_is_not_published_are_lost(export, body, why):
    lost(export, filtered(blocker(body)), why)


def decay(body):
    return node("arnold:light_decay", body, name="F")


def test_decay_is_in_metres_and_its_ramp_is_told_of(export):
    near = "bool inputs:use_near_atten = 1\n float inputs:near_start = 100\n float inputs:near_end = 200\n"
    far = "bool inputs:use_far_atten = 1\n float inputs:far_start = 300\n float inputs:far_end = 300"
    head = "#usda 1.0\n(metersPerUnit = 0.01)\n"
    result = export(head + filtered(decay(near + far)))
    assert result.warned("lights") == {"ramp of a light_decay"}
    assert filter_at(result.path, "/G/F") == {"type": "decay", "near": [1, 2], "far": [3, 3]}
    # A hard edge is no ramp.
    assert export(head + filtered(decay(far)), "--strict").code == 0


@pytest.mark.parametrize(("body", "kind", "why"), [
    ("bool inputs:use_far_atten = 1", "SphereLight", "its far_start or far_end is not authored"),
    ("bool inputs:use_far_atten = 1\n float inputs:far_start = 3\n float inputs:far_end = 2", "SphereLight", "its far_end 2"),
    ("bool inputs:use_far_atten = 1\n float inputs:far_start = 1\n float inputs:far_end = 2", "DistantLight", "at no distance"),
])  # fmt: skip
def test_decays_that_cannot_be_are_lost(export, body, kind, why):
    lost(export, filtered(decay(body), kind), why)
