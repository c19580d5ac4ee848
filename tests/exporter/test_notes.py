"""What the report says of things that do not matter: one line for a stage, or nothing; and never in the place of a loss."""

import numpy as np
import pytest
from conftest import HEADER, Gltf
from pxr import Gf, UsdLux

FRAMES = HEADER.replace("upAxis", "startTimeCode = 1\n endTimeCode = 3\n upAxis")
IDLE = "float houdini:guidescale = 2\n string primvars:dcc_name = \"x\"\n int primvars:arnold:samples = 4"


def test_attributes_without_effect_are_one_note_for_all_prims(export):
    lamps = "".join(f'def SphereLight "L{number}" {{ {IDLE} }}\n' for number in range(5))
    result = export(lamps + f'def Camera "C" {{ {IDLE} }}', "--strict")
    assert result.code == 0, result.err
    notes = [note for note in result.report["notes"] if note["what"] == "attributes without effect"]
    assert [note["category"] for note in notes] == ["cameras", "lights"]
    assert notes[1]["path"] == "/L0" and "those of 5 prims" in notes[1]["why"]
    for name in ("houdini:guidescale", "primvars:dcc_name", "primvars:arnold:samples"):
        assert all(note["why"].count(name) == 1 for note in notes)
    assert "note: lights: attributes without effect: /L0" in result.err


def test_the_note_is_the_same_whatever_the_order(export):
    one, two = (export("".join(f'def SphereLight "{n}" {{ {line} }}\n' for n, line in rows), out=f"{k}.glb") for k, rows in enumerate(
        ([("A", "float houdini:b = 1"), ("B", "float houdini:a = 1")], [("A", "float houdini:a = 1"), ("B", "float houdini:b = 1")])
    ))  # fmt: skip
    assert one.report["notes"] == two.report["notes"]


@pytest.mark.parametrize("line", [
    "float[] primvars:arnold:fov = [39.597752]", "vector3f[] primvars:arnold:look_at = [(0, 0, -1)]",
    "float primvars:arnold:near_clip = 2", "float primvars:arnold:far_clip = 900", "float primvars:arnold:focus_distance = 5",
    "float primvars:arnold:shutter_start = -0.25", "float primvars:arnold:shutter_end = 0.5",
])  # fmt: skip
def test_arnolds_copies_of_what_a_camera_says_are_no_losses(export, line):
    camera = """def Camera "C" { float horizontalAperture = 36\n float focalLength = 50\n float2 clippingRange = (2, 900)
        float focusDistance = 5\n double shutter:open = -0.25\n double shutter:close = 0.5\n %s }"""
    fixed = camera.replace("%s", "%s\n double3 xformOp:translate = (0, 0, 1)\n uniform token[] xformOpOrder = [\"xformOp:translate\"]")
    name, value = line.split()[1], line.split("= ")[1]
    result = export(fixed % line, "--strict")
    assert result.code == 0 and name in result.said(), result.err
    # Any other value is a loss.
    other = line.replace(value, "[(0, 0.1, -1)]" if "(" in value else "[7]" if "[" in value else "7")
    result = export(fixed % other)
    assert result.warned("cameras") == {"arnold attributes"}
    if "look_at" not in line:
        assert "beside USD's own, which count" in result.said()


def test_arnolds_copies_of_what_a_light_says_are_no_losses(export):
    rect = 'def RectLight "R" { float inputs:width = 4\n float inputs:height = 2\n vector3f[] primvars:arnold:vertices = [%s] }'
    same = "(2, -1, 0), (-2, -1, 0), (-2, 1, 0), (2, 1, 0)"
    assert export(rect % same, "--strict").code == 0
    for other in (same.replace("(2, 1, 0)", "(2, 1.01, 0)"), "(2, -1, 0)", same + ", (0, 0, 0)"):
        assert "arnold attributes" in export(rect % other).warned("lights")


@pytest.mark.parametrize("name", ["volume = 0", "cast_volumetric_shadows = 0"])
def test_what_is_about_fog_is_a_loss_where_there_is_fog(export, name):
    light = f'def SphereLight "L" {{ float primvars:arnold:{name} }}\n'
    assert export(light, "--strict").code == 0
    fog = 'def Volume "Fog" { custom float candelabra:fog:extinction = 0.5 }'
    assert "arnold attributes" in export(light + fog).warned("lights")


@pytest.mark.parametrize(("kind", "line", "is_lost"), [
    ("SphereLight", "float primvars:arnold:angle = 3", False),
    ("DomeLight", 'token primvars:arnold:portal_mode = "interior_exterior"', False),
    ("DomeLight", 'token primvars:arnold:portal_mode = "interior_only"', True),
])  # fmt: skip
def test_parameters_that_a_light_has_no_use_for(export, kind, line, is_lost):
    assert ("arnold attributes" in export(f'def {kind} "L" {{ {line} }}').warned("lights")) == is_lost


def test_what_has_an_effect_later_is_a_loss(export):
    body = "float barndoorleft.timeSamples = { 1: 0, 3: 40 }\n float primvars:arnold:sss.timeSamples = { 1: 1, 2: 1 }"
    result = export(FRAMES + f'def RectLight "L" {{ {body} }}')
    assert result.warned("lights") == {"attributes that USD does not know"}
    assert "primvars:arnold:sss" in result.report["notes"][0]["why"]


@pytest.mark.parametrize("kind", [
    "ArnoldNodeGraph", "ArnoldOptions", "ArnoldBoxFilter", "ArnoldDriverExr", "ArnoldColorManagerOcio",
    "ArnoldUsdLuxLightFilter",  # no light names it
])  # fmt: skip
def test_types_that_are_nothing_in_the_scene_say_nothing(export, kind):
    assert export(f'def {kind} "X" {{}}', "--strict").code == 0


@pytest.mark.parametrize("kind", ["ArnoldUsd", "ArnoldProcedural", "ArnoldSomething", "PxrMystery"])
def test_other_types_without_a_schema_are_losses(export, kind):
    assert f"unknown type {kind}" in export(f'def {kind} "X" {{}}').warned("other")


@pytest.mark.parametrize("kelvin", [500, 999, 10001, 12000, 1e6])
def test_a_temperature_out_of_range_has_the_colour_that_usd_gives_it(export, kelvin):
    result = export(f'def RectLight "L" {{ bool inputs:enableColorTemperature = 1\n float inputs:colorTemperature = {kelvin} }}', "--strict")
    assert result.code == 0, result.err
    assert "color temperature out of range" in result.noted()
    nearer = UsdLux.BlackbodyTemperatureAsRgb(min(max(kelvin, 1000), 10000))
    assert Gltf(result.path).nits("/L") == pytest.approx(np.clip(nearer, 0, None), rel=1e-5)


MESH = """def Mesh "M" { int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 2]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]\n uniform token subdivisionScheme = "none"
    color3f[] primvars:displayColor (interpolation = "vertex")
    color3f[] primvars:displayColor.timeSamples = { %s } }"""


@pytest.mark.parametrize(("samples", "is_lost"), [
    ("1: [(1, 0, 0), (0, 1, 0), (0, 0, 1)], 3: [(1, 0, 0), (0, 1, 0), (0, 0, 1)]", False),
    ("1: [(1, 0, 0), (0, 1, 0), (0, 0, 1)], 9: [(1, 0, 0), (0, 1, 0), (0, 1, 1)]", True),
    ("-9: [(0, 0, 0), (0, 1, 0), (0, 0, 1)], 0: [(1, 0, 0), (0, 1, 0), (0, 0, 1)]", False),
])  # fmt: skip
def test_primvars_are_animated_if_they_differ_among_the_frames(export, samples, is_lost):
    assert ("animated primvars:displayColor" in export(FRAMES + MESH % samples).warned("animation")) == is_lost


# -- Arnold's own placement --------------------------------------------------------------------------


@pytest.mark.parametrize(("eye", "target", "up"), [
    ((0.0035, 12.3, 6.4), (0.0035, 12.3, -0.01), (0, 1, 0)), ((1, 2, 3), (-4, 0.5, 9), (0, 1, 0)),
    ((0, 0, 0), (0, -5, 0), (0, 0, 1)), ((1e4, -2e3, 7), (1e4, -2e3, 8), (1, 3, 0)), ((0, 0, 5), (0, 0, -1), (0, -1, 0)),
])  # fmt: skip
@pytest.mark.parametrize("kind", ["Camera", "SphereLight"])
@pytest.mark.parametrize("prefix", ["primvars:arnold:", "arnold:"])
def test_what_has_no_transform_stands_where_arnold_puts_it(export, eye, target, up, kind, prefix):
    lines = "\n".join(f"vector3f[] {prefix}{name} = [{value}]" for name, value in (("position", eye), ("look_at", target), ("up", up)))
    op = 'double3 xformOp:translate = (3, 0, 1)\n uniform token[] xformOpOrder = ["xformOp:translate"]'
    result = export(f'def Xform "X" {{ {op}\n def {kind} "P" {{ {lines} }} }}', "--strict")
    assert result.code == 0, result.err
    wanted = Gf.Matrix4d().SetLookAt(Gf.Vec3d(*eye), Gf.Vec3d(*target), Gf.Vec3d(*up)).GetInverse()
    moved = np.array(wanted).T + np.array([[0, 0, 0, 3], [0, 0, 0, 0], [0, 0, 0, 1], [0, 0, 0, 0]])
    assert Gltf(result.path).world("/X/P") == pytest.approx(moved, abs=1e-6 * max(1, np.abs(moved).max()))


@pytest.mark.parametrize("direction", [(6.4, -3.2, -6.4), (0, 1, 0), (0, -1, 0), (1e-3, 0, 0), (0, 0, 5)])
def test_a_distant_light_shines_along_arnolds_direction(export, direction):
    result = export(f'def DistantLight "L" {{ vector3f[] primvars:arnold:direction = [{direction}] }}', "--strict")
    assert result.code == 0, result.err
    aim = Gltf(result.path).world("/L")[:3, :3] @ [0, 0, -1]
    assert aim == pytest.approx(np.array(direction) / np.linalg.norm(direction), abs=1e-6)


def test_usds_own_transform_rules_and_arnolds_placement_is_a_loss(export):
    op = 'double3 xformOp:translate = (0, 0, 4)\n uniform token[] xformOpOrder = ["xformOp:translate"]'
    result = export(f'def DistantLight "L" {{ {op}\n vector3f[] primvars:arnold:direction = [(1, 0, 0)] }}')
    assert "arnold attributes" in result.warned("lights")
    assert Gltf(result.path).world("/L")[:3, :3] == pytest.approx(np.eye(3))


@pytest.mark.parametrize("line", ["vector3f[] primvars:arnold:direction = [(0, 0, -1)]", "vector3f[] primvars:arnold:direction = []"])
def test_a_placement_that_does_nothing_is_none(export, line):
    scene = Gltf(export(f'def DistantLight "L" {{ {line} }}').path)
    assert "rotation" not in scene.node("/L")


@pytest.mark.parametrize(("kind", "lines"), [
    ("DistantLight", "vector3f[] primvars:arnold:direction = [(0, 0, 0)]"),
    ("Camera", "vector3f[] primvars:arnold:look_at = [(0, 0, 0)]"),
    ("Camera", "vector3f[] primvars:arnold:look_at = [(0, 4, 0)]\n vector3f[] primvars:arnold:up = [(0, 1, 0)]"),
])  # fmt: skip
def test_a_placement_that_is_no_view_is_reported(export, kind, lines):
    result = export(f'def {kind} "P" {{ {lines} }}')
    assert result.code == 0 and "there is no view" in result.said()
    assert Gltf(result.path).world("/P") == pytest.approx(np.eye(4))


@pytest.mark.parametrize("kind", ["Camera", "SphereLight"])
@pytest.mark.parametrize("array", [True, False])
def test_arnolds_placement_over_time_is_carried(export, kind, array):
    typed = "vector3f[]" if array else "point3f"
    eyes = [(0, 0, 5), (3, 1, 5), (9, 0, 5)] if array else [(0, 0, 5), (4.5, 0, 5), (9, 0, 5)]
    samples = [f"{code}: [{eye}]" if array else f"{code}: {eye}" for code, eye in zip((1, 2, 3), eyes, strict=True)]
    lines = f"{typed} primvars:arnold:position.timeSamples = {{ {', '.join(samples)} }}\n"
    lines += f"{typed} primvars:arnold:look_at = {'[(1, 0, 0)]' if array else '(1, 0, 0)'}"
    result = export(FRAMES + f'def {kind} "P" {{ {lines} }}', "--frames", "1-3", "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    for step, eye in enumerate(eyes):
        wanted = Gf.Matrix4d().SetLookAt(Gf.Vec3d(*eye), Gf.Vec3d(1, 0, 0), Gf.Vec3d(0, 1, 0)).GetInverse()
        assert scene.world("/P", step / 24) == pytest.approx(np.array(wanted).T, abs=1e-5)


@pytest.mark.parametrize(("line", "what", "at"), [
    ("vector3f[] primvars:arnold:position = [(0, 0, 5), (9, 0, 5)]", "primvars:arnold:position with motion keys", [0, 0, 5]),
    ("float primvars:arnold:position = 4", "primvars:arnold:position is no vector", [0, 0, 0]),
    ("vector3f[] arnold:position = [(0, nan, 5)]", "arnold:position is no vector", [0, 0, 0]),
])  # fmt: skip
@pytest.mark.parametrize(("kind", "category"), [("Camera", "cameras"), ("SphereLight", "lights")])
def test_a_placement_that_is_no_single_vector_is_told(export, line, what, at, kind, category):
    result = export(f'def {kind} "P" {{ {line} }}')
    assert what in result.warned(category)
    assert Gltf(result.path).world("/P")[:3, 3] == pytest.approx(at)


@pytest.mark.parametrize("name", ["primvars:arnold:light", "arnold:light"])
def test_arnolds_lights_of_other_shapes_are_not_lost_in_silence(export, name):
    assert name in export(f'def Cube "C" {{ bool {name} = 1 }}').warned("lights")
    assert export(f'def Cube "C" {{ bool {name} = 0 }}', "--strict").code == 0
    # USD's own API says all.
    assert name not in export(f'def Cube "C" (prepend apiSchemas = ["MeshLightAPI"]) {{ bool {name} = 1 }}').warned("lights")


# What is left of their lights, cameras and motion is what the files lack, or `docs/what_is_read.md` names.
REAL = {
    "test_0047/data/scene.usda": set(),  # a network's colour on a dome
    "test_0181/data/test.usda": set(),  # a ramp on a dome, a filter that does nothing
    "test_0193/data/scene.usda": {"shadow:color"},  # shadow:enable
    "test_1427.3/data/test.usd": set(),  # a lens that zooms within the shutter, and changes its shape
    "test_1442/data/test.usd": set(),  # instances with velocities
    "test_1521/data/test.usda": set(),  # a camera where Arnold puts it
    "test_2477.1/data/test.usda": {"IES profile"},  # shaping over time; one profile's file is not there
    "test_2477.2/data/test.usda": {"IES profile"},
    "test_2477.3/data/test.usda": {"IES profile"},
    "test_2477.4/data/test.usda": {"IES profile"},
    "test_1906/data/test.usda": set(),  # a light blocker
    "test_1940/data/test.usda": {"sda attributes"},  # a light blocker before a sun and a dome
    "test_2645/data/test.usda": set(),  # a network that is named in a referenced layer
}


@pytest.mark.parametrize("stage", REAL)
def test_real_stages_with_these_features_lose_nothing_of_them(export, shared, stage):
    result = export(shared / "real" / "arnold_usd_lux" / stage)
    assert result.code == 0, result.err
    assert set().union(*(result.warned(category) for category in ("lights", "cameras", "animation"))) == REAL[stage]
