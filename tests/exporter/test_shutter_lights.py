"""Light within the shutter: strengths, glows and sizes that change while it is open."""

import numpy as np
import pytest
from conftest import Gltf
from test_shutters import HEADER, SHUTTERS, at, camera


def test_light_changes_within_the_shutter(gltf):
    keys = "{ 0.5: 0, 1: 2, 2: 4, 2.25: 40, 3: 3, 4: 3 }"
    scene = gltf(HEADER + camera() + f'def RectLight "L" {{ float inputs:intensity.timeSamples = {keys} }}')
    values = scene.lux("/L")["values"]
    frames = np.array(values["times"]) * 24
    assert frames == pytest.approx([0.75, 1, 2, 2.25, 2.75, 3, 4])
    assert np.array(values["rgb"])[:, 0] == pytest.approx([1, 2, 4, 40, 3 + 37 / 3, 3, 3], rel=1e-6)
    assert scene.nits("/L") == pytest.approx([2] * 3), "the material has the first frame's"


LIT = {
    "RectLight": 'def RectLight "L" {',
    "SphereLight": 'def SphereLight "L" {',
    "point": 'def SphereLight "L" { bool treatAsPoint = 1\n bool inputs:normalize = 1',
    "spot": 'def SphereLight "L" (prepend apiSchemas = ["ShapingAPI"]) { float inputs:radius = 0\n float inputs:shaping:cone:angle = 30',
    "DistantLight": 'def DistantLight "L" {',
    "DomeLight": 'def DomeLight "L" {',
    "mesh light": 'def Cube "L" (prepend apiSchemas = ["MeshLightAPI"]) { uniform token light:materialSyncMode = "noMaterialResponse"',
    "mesh light of a material": """
        def Material "Mat" {
            token outputs:surface.connect = </Mat/S.outputs:surface>
            def Shader "S" {
                uniform token info:id = "UsdPreviewSurface"
                color3f inputs:emissiveColor = (1, 1, 1)
                token outputs:surface
            }
        }
        def Cube "L" (prepend apiSchemas = ["MeshLightAPI", "MaterialBindingAPI"]) {
            uniform token light:materialSyncMode = "materialGlowTintsLight"
            rel material:binding = </Mat>""",
}


def at_rest(scene: Gltf) -> float:
    """The strength of the light, whatever carries it, that a reader without `values` sees."""
    lux = scene.lux("/L")
    if lux["type"] == "DomeLight":
        return lux["radiance"][0]
    return scene.nits("/L")[0] if "mesh" in scene.node("/L") else scene.light("/L")["intensity"]


@pytest.mark.parametrize("light", LIT)
@pytest.mark.parametrize("opening", SHUTTERS)
def test_a_light_at_rest_is_the_first_frames(gltf, light, opening):
    """Not that of when the first shutter opens, before it."""
    keys = "float inputs:intensity.timeSamples = { 0.9: 0, 1: 100, 1.1: 7, 4: 20 }"
    moving, still = (gltf(f"{HEADER} {camera(*opening)} {LIT[light]}\n {lines} }}") for lines in (keys, "float inputs:intensity = 100"))
    assert at_rest(still) > 0
    assert at_rest(moving) == pytest.approx(at_rest(still), rel=1e-6)


def test_a_glow_changes_within_the_shutter(gltf):
    from test_mesh_lights import ANIMATED_GLOW

    cube = 'def Cube "C" (prepend apiSchemas = ["MaterialBindingAPI"]) { rel material:binding = </Mat> }'
    scene = gltf(ANIMATED_GLOW + camera(0, 0.5) + cube, "--frames", "2")
    values = scene.lux("/C")["values"]
    assert np.array(values["times"]) * 24 == pytest.approx([0, 0.5])
    assert values["rgb"] == [[2, 1, 0], [3, 1.5, 0]]
    assert scene.nits("/C") == pytest.approx([2, 1, 0])


def test_a_normalized_light_that_grows_keeps_its_power_within_the_shutter(gltf):
    light = 'def SphereLight "L" { bool inputs:normalize = 1\n float inputs:radius.timeSamples = { 0: 1, 5: 6 } }'
    scene = gltf(HEADER + camera() + light)
    values = scene.lux("/L")["values"]
    codes, nits = np.array(values["times"]) * 24, np.array(values["rgb"])[:, 0]
    assert {0.75, 1.25, 4.25} <= set(codes.round(4))
    radius = np.array([scene.lux("/L")["radius"] * np.cbrt(np.linalg.det(at(scene, "/L", code)[:3, :3])) for code in codes])
    assert radius == pytest.approx(1 + codes, rel=1e-5)
    assert nits * 4 * np.pi * radius**2 == pytest.approx(np.ones(len(codes)), rel=1e-4)


GROWTH = {
    "eightfold": ('{ 0: 1, 1: 1, 2: 8, 5: 8 }', 0.02),
    "shrinks": ('{ 0: 9, 1: 9, 2: 0.5, 5: 0.5 }', 0.02),
    "from nothing": ('{ 0: 0, 1: 0, 5: 4 }', 2.0),
}


@pytest.mark.parametrize("growth", GROWTH)
@pytest.mark.parametrize("scale", ["(1, 1, 1)", "(1, 3, 0.5)"])
def test_a_normalized_light_has_its_power_all_the_while_the_shutter_is_open(gltf, growth, scale):
    """Straight lines between the radiance of two keys would give it up to any power in between."""
    radii, tolerance = GROWTH[growth]
    light = f"bool inputs:normalize.timeSamples = {{ 0: 1, 3: 0 }}\n float inputs:radius.timeSamples = {radii}"
    scene = gltf(HEADER + camera(-0.5, 0.5) + f"""def Xform "Rig" {{
        float3 xformOp:scale = {scale}
        uniform token[] xformOpOrder = ["xformOp:scale"]
        def SphereLight "L" {{ {light} }}
    }}""")  # fmt: skip
    values = scene.lux("/Rig/L")["values"]
    assert (np.diff(np.float32(values["times"])) > 0).all()
    codes, nits = np.array(values["times"]) * 24, np.array(values["rgb"])[:, 0]
    corners = scene.triangles("/Rig/L")

    def area(code):
        shown = corners @ at(scene, "/Rig/L", code)[:3, :3].T
        return np.linalg.norm(np.cross(shown[:, 1] - shown[:, 0], shown[:, 2] - shown[:, 0]), axis=1).sum() / 2

    power = np.array([np.interp(code, codes, nits) * area(code) for code in np.linspace(0.5, 2.5, 401)])
    assert power.min() > 0.99 and power.max() < 1.01 + tolerance
    assert power.mean() == pytest.approx(1, abs=0.02)
    assert np.interp([3, 3.5, 4.5], codes, nits) == pytest.approx([1] * 3, rel=1e-6), "not normalized any more"
