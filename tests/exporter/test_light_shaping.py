"""Lights whose shaping changes: at every frame one of the lights in their place shines, shaped as the stage says there."""

import numpy as np
import pytest
from conftest import HEADER, Gltf
from pxr import Usd

SHOT = HEADER.replace("upAxis", "startTimeCode = 1\n endTimeCode = 6\n upAxis")
IES = "IESNA91\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 0\n"
CONE = "float inputs:shaping:cone:angle.timeSamples = { 1: 20, 6: 70 }"
SOFT = "float inputs:shaping:cone:angle = 40\n float inputs:shaping:cone:softness.timeSamples = { 1: 0, 3: 0.5, 6: 1 }"
FOCUS = "float inputs:shaping:focus.timeSamples = { 1: 0, 6: 10 }\n color3f inputs:shaping:focusTint = (1, 0.5, 0)"
TINT = "float inputs:shaping:focus = 3\n color3f inputs:shaping:focusTint.timeSamples = { 1: (0, 0, 0), 6: (1, 1, 0) }"
KINDS = ["RectLight", "DiskLight", "SphereLight", "CylinderLight"]


def lights(scene, path):
    """The lights in the place of one."""
    return [name for name in scene.by_path if name == path or name.startswith(path + "[shaping ")]


def strength(scene, path, times):
    values = scene.lux(path)["values"]
    rows = np.array(values["rgb"])
    return np.array([np.interp(np.float32(times), np.float32(values["times"]), column) for column in rows.T]).T


def shining(scene, path, frame, zero=1):
    """The light that shines at a frame, and how strongly; there is one."""
    time = (frame - zero) / 24
    found = [(name, strength(scene, name, [time])[0]) for name in lights(scene, path)]
    lit = [(name, rgb) for name, rgb in found if rgb.max() > 1e-9]
    assert len(lit) == 1, found
    return lit[0]


def authored(result, frame, path="/L"):
    stage = Usd.Stage.Open(str(result.path.with_name("scene.usda")))
    prim = stage.GetPrimAtPath(path)
    names = {"coneAngle": "cone:angle", "coneSoftness": "cone:softness", "focus": "focus", "focusTint": "focusTint"}
    return {key: prim.GetAttribute(f"inputs:shaping:{name}").Get(frame) for key, name in names.items()}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("shaping", [CONE, SOFT, FOCUS, TINT])
@pytest.mark.parametrize("more", ["", "float inputs:intensity.timeSamples = { 1: 1, 6: 11 }", "bool treatAsPoint = 1"])
def test_at_every_frame_the_light_is_shaped_as_authored(export, kind, shaping, more):
    api = '(prepend apiSchemas = ["ShapingAPI"])'
    result = export(SHOT + f'def {kind} "L" {api} {{ {shaping}\n {more} }}', "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    assert len(lights(scene, "/L")) == len({str(authored(result, f)) for f in range(1, 7)})
    first = shining(scene, "/L", 1)
    assert first[0] == "/L"
    for frame in range(1, 7):
        name, rgb = shining(scene, "/L", frame)
        wanted, lux = authored(result, frame), scene.lux(name)
        found = lux.get("shaping", {"coneAngle": 180, "coneSoftness": 0, "focus": 0, "focusTint": [0] * 3})
        if "shaping" in lux:
            assert found["coneAngle"] == pytest.approx(wanted["coneAngle"])
            assert found["coneSoftness"] == pytest.approx(wanted["coneSoftness"])
            assert found["focusTint"] == pytest.approx(list(wanted["focusTint"]))
        assert found["focus"] == pytest.approx(wanted["focus"])
        assert rgb == pytest.approx(first[1] * (1 + 2 * (frame - 1) if "intensity" in more else 1), rel=1e-5)
        assert scene.world(name) == pytest.approx(scene.world("/L"))


def test_between_two_frames_the_light_of_one_fades_into_the_other(gltf):
    scene = gltf(SHOT + f'def RectLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {CONE} }}')
    for time in np.linspace(0, 5 / 24, 23):
        both = sorted(strength(scene, name, [time])[0, 0] for name in lights(scene, "/L"))
        assert sum(both) == pytest.approx(1, abs=1e-5) and both[:-2] == [0.0] * (len(both) - 2)


def test_what_is_shaped_alike_is_one_light(gltf):
    held = "float inputs:shaping:cone:angle.timeSamples = { 1: 20, 2: 20, 3: 50, 4: 50, 5: 20 }"
    scene = gltf(SHOT + f'def RectLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {held} }}')
    assert lights(scene, "/L") == ["/L", "/L[shaping 3]"]
    assert [shining(scene, "/L", frame)[0] for frame in range(1, 7)] == ["/L", "/L", "/L[shaping 3]", "/L[shaping 3]", "/L", "/L"]


@pytest.mark.parametrize("body", ["float inputs:shaping:cone:angle.timeSamples = { 1: 20, 6: 20 }", "float inputs:shaping:cone:angle = 20"])
def test_a_shaping_that_rests_is_one_light_as_it_was(gltf, body):
    scene = gltf(SHOT + f'def RectLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {body} }}')
    assert lights(scene, "/L") == ["/L"] and "values" not in scene.lux("/L")


def test_dark_keys_are_few(gltf):
    many = SHOT.replace("= 6", "= 200") + f'def RectLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {CONE.replace("6:", "200:")} }}'
    scene = gltf(many)
    assert len(lights(scene, "/L")) == 200
    assert max(len(scene.lux(name)["values"]["times"]) for name in lights(scene, "/L")) <= 3
    assert all(shining(scene, "/L", frame) for frame in (1, 2, 77, 199, 200))


def test_too_many_are_the_first_frames(export):
    many = SHOT.replace("= 6", "= 2100") + f'def RectLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {CONE.replace("6:", "2100:")} }}'
    result = export(many)
    assert result.warned("lights") == {"animated shaping"}
    scene = Gltf(result.path)
    assert lights(scene, "/L") == ["/L"] and scene.lux("/L")["shaping"]["coneAngle"] == pytest.approx(20)


def test_profiles_and_their_scales_change(gltf, tmp_path):
    for name in ("a", "b"):
        (tmp_path / f"{name}.ies").write_text(IES)
    body = """asset inputs:shaping:ies:file.timeSamples = { 1: @a.ies@, 3: @b.ies@, 5: @@ }
        float inputs:shaping:ies:angleScale.timeSamples = { 1: 0, 2: 0, 6: 2 }"""
    scene = gltf(SHOT + f'def SphereLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {body} }}')
    for frame, file, scale in ((1, "a.ies", 0), (2, "a.ies", 0), (3, "b.ies", 0.5), (4, "b.ies", 1), (5, None, 0), (6, None, 0)):
        ies = scene.lux(shining(scene, "/L", frame)[0]).get("shaping", {}).get("ies")
        assert (ies and ies["file"].endswith(file) and ies.get("angleScale", 0) == pytest.approx(scale)) if file else ies is None


def test_links_groups_visibility_and_places_are_those_of_the_light(gltf):
    text = f"""def Cube "A" {{}}\n def Cube "B" {{}}
        def Xform "X" {{ double3 xformOp:translate.timeSamples = {{ 1: (0, 0, 0), 6: (5, 0, 0) }}
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def RectLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {CONE}
                string candelabra:lightGroup = "key"\n bool visibleInPrimaryRay = 1\n bool cycles:visibility:shadow = 1
                rel collection:lightLink:excludes = [</A>]
                token visibility.timeSamples = {{ 1: "inherited", 4: "invisible", 5: "inherited" }}
                float3 xformOp:scale = (2, 1, 1)\n uniform token[] xformOpOrder = ["xformOp:scale"] }} }}
        def SphereLight "M" {{ rel collection:shadowLink:excludes = [</X/L>] }}"""
    scene = gltf(SHOT + text)
    names = lights(scene, "/X/L")
    assert len(names) == 5 and "/X/L[shaping 4]" not in names  # which would never shine
    for name in names:
        lux = scene.lux(name)
        assert (lux["group"], lux["lightLink"]) == ("key", 0)
        assert lux["visibility"] == {"camera": True, "shadows": True}
        assert scene.node(name)["extras"]["usdLinks"] == scene.node("/X/L")["extras"]["usdLinks"]
        assert scene.world(name, 5 / 24) == pytest.approx(scene.world("/X/L", 5 / 24)) and scene.area(name) == pytest.approx(2)
    lit = [max(strength(scene, name, [step / 24]).max() for name in names) > 0 for step in range(6)]
    assert lit == [True, True, True, False, True, True]


def test_instances_have_their_own(gltf, tmp_path):
    lamp = f'#usda 1.0\ndef Xform "Lamp" {{ def RectLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {CONE} }} }}'
    (tmp_path / "lamp.usda").write_text(lamp.replace("}", "\n}"))
    scene = gltf(SHOT + "".join(f'def "{n}" (instanceable = true\n references = @lamp.usda@</Lamp>) {{}}\n' for n in "ab"))
    assert len(lights(scene, "/a/L")) == len(lights(scene, "/b/L")) == 6 == len(lights(scene, "/a/L"))
    assert len(set(scene.by_path)) == len([n for n in scene.nodes if "extras" in n])


@pytest.mark.parametrize("kind", ["DomeLight", "DistantLight"])
def test_what_is_not_shaped_says_what_it_said(export, kind):
    result = export(SHOT + f'def {kind} "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {CONE} }}')
    assert result.warned("lights") == {"animated inputs:shaping:cone:angle", f"shaping of a {kind}"}


def test_a_mesh_light_keeps_the_shaping_of_the_first_frame(export):
    api = '(prepend apiSchemas = ["MeshLightAPI", "ShapingAPI"])'
    result = export(SHOT + f'def Cube "L" {api} {{ {CONE} }}')
    assert result.warned("lights") == {"animated inputs:shaping:cone:angle"}
    assert lights(Gltf(result.path), "/L") == ["/L"]


def test_a_shutter_samples_more_of_them(gltf):
    camera = 'def Camera "V" { double shutter:open = 0\n double shutter:close = 0.5 }\n'
    light = f'def RectLight "L" (prepend apiSchemas = ["ShapingAPI"]) {{ {CONE} }}'
    scene = gltf(SHOT.replace("endTimeCode = 6", "endTimeCode = 1") + camera + light)
    for code, angle in ((1, 20), (1.25, 22.5), (1.5, 25)):
        assert scene.lux(shining(scene, "/L", code)[0])["shaping"]["coneAngle"] == pytest.approx(angle)
