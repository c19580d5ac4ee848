"""Lights that are hidden for some frames, against what UsdGeomImageable computes."""

import numpy as np
import pytest
from conftest import HEADER, Gltf
from pxr import Usd, UsdGeom

SHOT = HEADER.replace("upAxis", "startTimeCode = 1\n endTimeCode = 6\n upAxis")
BLINK = 'token visibility.timeSamples = { 1: "inherited", 2: "invisible", 4: "inherited", 6: "invisible" }'
LATE = 'token visibility.timeSamples = { 1: "invisible", 3: "inherited" }'


def strengths(scene, path):
    """A light's strength at each frame."""
    lux = scene.lux(path)
    times = (np.arange(6) / 24).astype(np.float32)
    return np.array([np.interp(times, np.float32(lux["values"]["times"]), column) for column in np.array(lux["values"]["rgb"]).T]).T


def visible(result, path):
    stage = Usd.Stage.Open(str(result.path.with_name("scene.usda")))
    imageable = UsdGeom.Imageable(stage.GetPrimAtPath(path))
    return np.array([imageable.ComputeVisibility(code) != "invisible" for code in range(1, 7)])


@pytest.mark.parametrize("kind", ["RectLight", "DiskLight", "SphereLight", "CylinderLight", "DistantLight", "DomeLight"])
@pytest.mark.parametrize("visibility", [BLINK, LATE])
@pytest.mark.parametrize("more", ["", "bool treatAsPoint = 1", "float inputs:intensity.timeSamples = { 1: 2, 6: 12 }"])
def test_a_light_is_dark_while_it_is_hidden(export, kind, visibility, more):
    angle = "float inputs:angle = 0" if kind == "DistantLight" else ""
    body = f"float inputs:intensity = 3\n {angle}\n {more}" if "inputs:intensity" not in more else f"{angle}\n {more}"
    result = export(SHOT + f'def {kind} "L" {{ {visibility}\n {body} }}', "--strict")
    assert result.code == 0, result.err
    shown = export(SHOT + f'def {kind} "L" {{ {body} }}', out="shown.glb")
    lit = Gltf(shown.path)
    still = "values" not in lit.lux("/L")
    if not still:
        wanted = strengths(lit, "/L")
    elif kind == "DomeLight":
        wanted = np.tile(lit.lux("/L")["radiance"], (6, 1))
    elif kind == "DistantLight" or (kind == "SphereLight" and more):
        wanted = np.tile(np.array(lit.light("/L")["color"]) * lit.light("/L")["intensity"], (6, 1))
    else:
        wanted = np.tile(lit.nits("/L"), (6, 1))
    seen = visible(export(SHOT + f'def {kind} "L" {{ {visibility}\n {body} }}'), "/L")
    assert 0 < seen.sum() < 6
    assert strengths(Gltf(result.path), "/L") == pytest.approx(np.where(seen[:, None], wanted, 0), rel=1e-5)


def test_what_is_above_hides_too(export):
    text = SHOT + f"""def Xform "A" {{ {BLINK}
        def Xform "B" {{ {LATE}
            def SphereLight "L" {{ token visibility.timeSamples = {{ 1: "inherited", 5: "invisible" }} }}
            def Xform "Off" {{ token visibility = "invisible"\n def SphereLight "N" {{}} }}
        }}
    }}"""
    result = export(text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    seen = visible(result, "/A/B/L")
    assert seen.tolist() == [False, False, False, True, False, False]
    assert (strengths(scene, "/A/B/L")[:, 0] > 0).tolist() == seen.tolist()
    assert "/A/B/Off/N" not in scene.by_path


def test_a_light_that_is_never_seen_is_not_there(export):
    text = SHOT + f'def Xform "A" {{ {LATE}\n def SphereLight "L" {{ token visibility.timeSamples = {{ 1: "inherited", 3: "invisible" }} }} }}'
    assert "/A/L" not in Gltf(export(text, "--strict").path).by_path


def test_instances_vanish_by_themselves(gltf, tmp_path):
    (tmp_path / "lamp.usda").write_text('#usda 1.0\ndef Xform "Lamp" {\n def RectLight "L" { float inputs:intensity = 5\n }\n}')
    one = f'def Xform "%s" {{ %s\n def "I" (instanceable = true\n references = @lamp.usda@</Lamp>) {{}} }}\n'
    scene = gltf(SHOT + one % ("A", BLINK) + one % ("B", LATE) + one % ("C", ""))
    assert (strengths(scene, "/A/I/L")[:, 0] > 0).tolist() == [True, False, False, True, True, False]
    assert (strengths(scene, "/B/I/L")[:, 0] > 0).tolist() == [False, False, True, True, True, True]
    assert "values" not in scene.lux("/C/I/L") and scene.nits("/C/I/L") == pytest.approx([5] * 3)


def sizes(scene, path):
    """How large a prim's node is at each frame."""
    return np.array([np.abs(np.linalg.det(scene.world(path, step / 24)[:3, :3])) for step in range(6)])


INSTANCER = """def PointInstancer "I" { rel prototypes = </X/I/P>\n int[] protoIndices = [0]\n point3f[] positions = [(1, 0, 0)]
    def Cube "P" {} }"""


@pytest.mark.parametrize(("inside", "drawn"), [
    ('def Cube "C" {}', "/X/C"), ('def Xform "A" { def Cube "C" {} }', "/X/A/C"),
    ('def Cube "C" (prepend apiSchemas = ["MeshLightAPI"]) {}', "/X/C"), (INSTANCER, "/X/I[0]"),
    ('def Cube "C" { float3 xformOp:scale.timeSamples = { 1: (1, 2, 3), 6: (4, 1, 1) }\n uniform token[] xformOpOrder = ["xformOp:scale"] }', "/X/C"),
    ('def Cube "C" { double3 xformOp:translate = (1, 0, 0)\n uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"] }', "/X/C"),
])  # fmt: skip
@pytest.mark.parametrize("visibility", [BLINK, LATE])
def test_what_is_drawn_is_of_no_size_while_it_is_hidden(export, inside, drawn, visibility):
    result = export(SHOT + f'def Xform "X" {{ {visibility}\n {inside}\n def SphereLight "L" {{}} }}', "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    seen = visible(result, drawn.split("[")[0])
    assert (sizes(scene, drawn) > 0).tolist() == seen.tolist()
    assert (strengths(scene, "/X/L")[:, 0] > 0).tolist() == seen.tolist()
    # What is seen is as large as without.
    plain = Gltf(export(SHOT + f'def Xform "X" {{ {inside}\n def SphereLight "L" {{}} }}', out="plain.glb").path)
    assert sizes(scene, drawn)[seen] == pytest.approx(sizes(plain, drawn)[seen])
    assert not any("_seen" in node["name"] for node in plain.nodes)


def test_hidden_things_in_hidden_things(export):
    inner = f'def Xform "B" {{ {LATE}\n def Cube "C" {{}}\n def Cube "D" {{ token visibility = "invisible" }} }}'
    result = export(SHOT + f'def Xform "A" {{ {BLINK}\n {inner} }}', "--strict")
    scene = Gltf(result.path)
    seen = visible(result, "/A/B/C")
    assert seen.tolist() == [False, False, False, True, True, False]
    assert (sizes(scene, "/A/B/C") > 0).tolist() == seen.tolist() and "/A/B/D" not in scene.by_path


def test_prototypes_vanish_in_their_instances(export):
    text = f"""def PointInstancer "I" {{ rel prototypes = </I/P>\n int[] protoIndices = [0, 0]\n point3f[] positions = [(1, 0, 0), (2, 0, 0)]
        def Xform "P" {{ {BLINK}\n def Cube "C" {{}}\n def SphereLight "L" {{}} }} }}"""
    scene = Gltf(export(SHOT + text, "--strict").path)
    for number in (0, 1):
        assert (sizes(scene, f"/I[{number}]/C") > 0).tolist() == [True, False, False, True, True, False]
        assert (strengths(scene, f"/I[{number}]/L")[:, 0] > 0).tolist() == [True, False, False, True, True, False]


def sampled(name, values):
    return f"{name}.timeSamples = {{ " + ", ".join(f"{code}: {value}" for code, value in values.items()) + " }\n"


BOTH = """def Xform "P" { def Cube "C" {}
    def SphereLight "L" {}
    def SphereLight "T" { bool treatAsPoint = 1 }
    }"""


def particles(*attributes, prototypes="</I/P>", inside=BOTH):
    return SHOT + f'def PointInstancer "I" {{ rel prototypes = [{prototypes}]\n {"".join(attributes)} {inside}\n }}'


def is_there(scene, name):
    """At which frames an instance's cube and its lights are there, which must be the same."""
    found = (sizes(scene, f"/I[{name}]/C") > 0).tolist()
    for light in ("L", "T"):
        given = scene.lux(f"/I[{name}]/{light}").get("values")
        lit = [True] * 6 if given is None else (strengths(scene, f"/I[{name}]/{light}")[:, 0] > 0).tolist()
        assert lit == found
    return found


def test_instances_that_appear_and_vanish_are_there_in_their_time(export):
    text = particles(sampled("int[] protoIndices", {1: "[]", 2: "[0]", 4: "[0, 0]", 6: "[0]"}),
                     sampled("point3f[] positions", {1: "[]", 2: "[(1, 0, 0)]", 4: "[(1, 2, 0), (5, 0, 0)]", 6: "[(1, 2, 0)]"}))  # fmt: skip
    result = export(text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    assert is_there(scene, 0) == [False, True, True, True, True, True]
    assert is_there(scene, 1) == [False, False, False, True, True, False]
    # Where they are is what USD says at each time; beyond it they stay.
    stage = Usd.Stage.Open(str(result.path.with_name("scene.usda")))
    instancer = UsdGeom.PointInstancer(stage.GetPrimAtPath("/I"))
    for number in (0, 1):
        for code in range(1, 7):
            placed = instancer.ComputeInstanceTransformsAtTime(code, code)
            if number < len(placed):
                # What hides it has a size of 0 or 1 and moves nothing.
                assert scene.world(f"/I[{number}]/C", (code - 1) / 24)[:3, 3] == pytest.approx(list(placed[number].ExtractTranslation()))
    assert result.report["counts"]["instances"] == 2


def test_instances_are_who_they_are_by_their_ids(export):
    """Their order in the arrays says nothing."""
    places = {7: [(k, 0, 0) for k in range(6)], 3: [(0, k, 0) for k in range(6)]}
    order = {1: (7, 3), 2: (3, 7), 3: (7,), 4: (3,), 5: (3, 7), 6: (7, 3)}
    rows = {code: ", ".join(str(places[i][code - 1]) for i in ids) for code, ids in order.items()}
    text = particles(sampled("int64[] ids", {code: list(ids) for code, ids in order.items()}),
                     sampled("int[] protoIndices", {code: [0] * len(ids) for code, ids in order.items()}),
                     sampled("point3f[] positions", {code: f"[{row}]" for code, row in rows.items()}))  # fmt: skip
    result = export(text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    for identity in (7, 3):
        seen = is_there(scene, identity)
        assert seen == [identity in order[code] for code in range(1, 7)]
        for step in np.flatnonzero(seen):
            assert scene.world(f"/I[{identity}]/C", step / 24)[:3, 3] == pytest.approx(places[identity][step])


def test_a_mask_and_a_changed_prototype_hide_what_they_hide(export):
    two = BOTH + "\n" + BOTH.replace('"P"', '"Q"')
    text = particles("int[] protoIndices.timeSamples = { 1: [0, 0, 1], 3: [1, 0, 1] }\n", "int64[] invisibleIds.timeSamples = { 1: [], 2: [1], 5: [] }\n",
                     "point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0)]\n", prototypes="</I/P>, </I/Q>", inside=two)  # fmt: skip
    result = export(text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    assert is_there(scene, "0 of prototype 0") == [True, True, False, False, False, False]
    assert is_there(scene, "0 of prototype 1") == [False, False, True, True, True, True]
    assert is_there(scene, 1) == [True, False, False, False, True, True]
    assert is_there(scene, 2) == [True] * 6
    assert sum("_seen" in node["name"] for node in scene.nodes) == 3


def test_what_hides_the_instancer_hides_instances_too(export):
    text = particles("int[] protoIndices.timeSamples = { 1: [0], 5: [] }\n", "point3f[] positions.timeSamples = { 1: [(0, 0, 0)], 5: [] }\n", BLINK + "\n")
    scene = Gltf(export(text, "--strict").path)
    assert is_there(scene, 0) == [True, False, False, True, False, False]


def test_instances_that_make_no_sense_for_a_while_are_not_there_then(export):
    text = particles("int[] protoIndices.timeSamples = { 1: [0, 0], 3: [-7, 0], 4: [0, 0] }\n",
                     "point3f[] positions.timeSamples = { 1: [(0, 0, 0), (1, 0, 0)], 5: [(0, 0, 0)] }\n")  # fmt: skip
    result = export(text)
    assert result.warned() == {"instances without a prototype", "PointInstancer without usable instances"}
    assert "1 positions and 2 protoIndices do not fit each other at frame 5" in result.said()
    scene = Gltf(result.path)
    assert is_there(scene, "0 of prototype 0") == [True, True, False, True, False, False]
    assert is_there(scene, 1) == [True, True, True, True, False, False]


def test_prims_of_a_prototype_that_are_not_moved_with_it_vanish_with_it(export):
    inside = 'def Xform "P" { def Cube "C" { uniform token[] xformOpOrder = ["!resetXformStack!"] } }'
    text = particles("int[] protoIndices.timeSamples = { 1: [0], 3: [] }\n", "point3f[] positions.timeSamples = { 1: [(0, 0, 0)], 3: [] }\n", inside=inside)
    assert (sizes(Gltf(export(text, "--strict").path), "/I[0]/C") > 0).tolist() == [True, True, False, False, False, False]


def test_a_jump_within_an_open_shutter_is_held_until_the_next_sampled_time(export):
    camera = 'def Camera "V" { double shutter:open = 0\n double shutter:close = 0.5 }\n'
    times = 'token visibility.timeSamples = { 1: "inherited", 3: "invisible", 4.25: "inherited" }'
    scene = Gltf(export(SHOT + camera + f'def Cube "C" {{ {times} }}', "--strict").path)
    node = scene.parents[scene.by_path["/C"]]
    found, values = scene._channels(node)["scale"]
    assert found * 24 + 1 == pytest.approx([1, 3, 4.25], abs=1e-5) and values[:, 0].tolist() == [1, 0, 1]


@pytest.mark.parametrize(("inside", "category"), [
    ('def Cube "C" {}', "animation"), ('def Cube "C" (prepend apiSchemas = ["MeshLightAPI"]) {}', "lights"),
])  # fmt: skip
@pytest.mark.parametrize("visibility", [BLINK, LATE])
def test_beside_a_camera_the_first_frame_counts_but_for_lights(export, inside, category, visibility):
    result = export(SHOT + f'def Xform "X" {{ {visibility}\n {inside}\n def Camera "V" {{}}\n def SphereLight "L" {{}} }}')
    assert result.warned(category) == {"animated visibility"}
    scene = Gltf(result.path)
    assert 0 < (strengths(scene, "/X/L")[:, 0] > 0).sum() < 6
    assert ("/X/C" in scene.by_path) == (visibility == BLINK) and not scene.json.get("animations")


def test_a_shape_that_casts_shadows_vanishes_with_its_light(export):
    result = export(SHOT + f'def RectLight "L" {{ {BLINK}\n bool cycles:visibility:shadow = 1 }}', "--strict")
    assert result.code == 0, result.err
    assert (sizes(Gltf(result.path), "/L") > 0).tolist() == [True, False, False, True, True, False]


@pytest.mark.parametrize("kind", ["SphereLight", "SphereLight point", "DistantLight", "DomeLight", "RectLight"])
@pytest.mark.parametrize("above", [True, False])
@pytest.mark.parametrize("visibility", [BLINK, LATE])
def test_lights_that_a_vanishing_instancer_places_are_dark(export, kind, above, visibility):
    def placed(name, hidden):
        own, around = ("", hidden) if above else (hidden, "")
        return f"""def Xform "{name}" {{ {around}\n def PointInstancer "I" {{ {own}\n rel prototypes = </P>
            int[] protoIndices = [0]\n point3f[] positions = [(1, 0, 0)] }} }}\n"""
    more = "bool treatAsPoint = 1" if "point" in kind else ""
    prototype = f'def Xform "P" {{\n def {kind.split()[0]} "L" {{ {more} }} }}\n'
    result = export(SHOT + placed("A", visibility) + placed("B", "") + prototype, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    seen = visible(result, "/A/I")
    assert 0 < seen.sum() < 6
    assert (strengths(scene, "/A/I[0]/L")[:, 0] > 0).tolist() == seen.tolist()
    assert "values" not in scene.lux("/B/I[0]/L")


@pytest.mark.parametrize("visibility", [BLINK, LATE, 'token visibility = "invisible"', 'token visibility.timeSamples = { 1: "invisible", 2: "invisible" }'])
@pytest.mark.parametrize("beside", ["", 'def Cube "C" {}', 'def SphereLight "L" {}'])
@pytest.mark.parametrize("own", [True, False])
def test_a_camera_is_there_whatever_its_visibility(export, visibility, beside, own):
    outer, inner = ("", visibility) if own else (visibility, "")
    scene = Gltf(export(SHOT + f'def Xform "X" {{ {outer}\n {beside}\n def Camera "V" {{ {inner} }} }}').path)
    assert "camera" in scene.node("/X/V")
    never = not own and "inherited" not in visibility
    assert ("/X/L" in scene.by_path) == ("Light" in beside and not never)
    assert ("/X/C" in scene.by_path) == ("Cube" in beside and (own or visibility == BLINK))
