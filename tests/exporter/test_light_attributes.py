"""Where a light's values are authored: old names, renderers' own, and what is only listed."""

import math

import numpy as np
import pytest

from conftest import HEADER, Gltf

ANIMATED = HEADER.replace("metersPerUnit = 1", "metersPerUnit = 1\n    startTimeCode = 1\n    endTimeCode = 5")


def test_a_light_from_before_usd_21_02_is_what_its_author_wrote(export):
    result = export(
        """def RectLight "keyLight" {
            float intensity = 36000
            color3f color = (1, 0.95, 0.9)
            float width = 6
            float height = 4.5
        }"""
    )
    scene = Gltf(result.path)
    assert scene.nits("/keyLight") == pytest.approx([36000, 34200, 32400])
    assert scene.area("/keyLight") == pytest.approx(27)
    assert {"old attribute intensity", "old attribute width"} <= result.noted()


OLD = {
    "exposure": ("float", "3", lambda s: s.nits("/L"), [8] * 3),
    "radius": ("float", "2", lambda s: s.area("/L"), 4 * math.pi),
    "normalize": ("bool", "1", lambda s: s.nits("/L"), [1 / (0.25 * math.pi)] * 3),
    "diffuse": ("float", "0.5", lambda s: s.lux("/L")["diffuse"], 0.5),
    "specular": ("float", "0", lambda s: s.lux("/L")["specular"], 0),
    "shaping:cone:angle": ("float", "30", lambda s: s.lux("/L")["shaping"]["coneAngle"], 30),
    "shaping:focus": ("float", "2", lambda s: s.lux("/L")["shaping"]["focus"], 2),
}


@pytest.mark.parametrize("name", OLD)
@pytest.mark.parametrize("prefix", ["", "inputs:"])
def test_old_names_read_like_new_ones(gltf, name, prefix):
    kind, value, found, expected = OLD[name]
    scene = gltf(f'def DiskLight "L" {{ {kind} {prefix}{name} = {value} }}')
    assert found(scene) == pytest.approx(expected, rel=1e-5)


def test_old_temperature_and_angle(gltf):
    scene = gltf(
        """def SphereLight "Warm" {
            bool enableColorTemperature = 1
            float colorTemperature = 3200
        }
        def DistantLight "Sun" { float angle = 10
            float intensity = 7 }"""
    )
    assert scene.nits("/Warm") == pytest.approx([1.6799, 0.8660, 0.3256], rel=2e-4)
    assert scene.light("/Sun")["intensity"] == pytest.approx(7 * math.pi * math.sin(math.radians(5)) ** 2)


def test_an_old_name_may_be_animated(gltf):
    scene = gltf(ANIMATED + 'def RectLight "L" { float intensity.timeSamples = { 1: 1, 5: 9 } }')
    assert np.array(scene.lux("/L")["values"]["rgb"])[:, 0] == pytest.approx([1, 3, 5, 7, 9])


def test_the_new_name_rules_and_the_other_is_listed_if_it_differs(export):
    result = export('def RectLight "L" { float inputs:intensity = 5\n float intensity = 6 }')
    assert Gltf(result.path).nits("/L") == pytest.approx([5] * 3)
    assert "intensity overruled" in result.warned("lights")
    same = export('def RectLight "L" { float inputs:intensity = 5\n float intensity = 5 }')
    assert same.warned() == set()


def test_old_shadows_filters_and_textures_are_not_lost_in_silence(export):
    result = export(
        """def RectLight "L" {
            float shadow:distance = 2
            color3f shadow:color = (1, 0, 0)
            asset texture:file = @gone.exr@
            asset shaping:ies:file = @lamp.ies@
            rel filters = </F>
        }
        def PluginLightFilter "F" {}"""
    )
    assert {"shadow:distance", "shadow:color", "missing texture", "IES profile", "light filters"} <= result.warned("lights")


@pytest.mark.parametrize("prefix", ["primvars:arnold:", "arnold:"])
def test_arnolds_parameters_with_a_usdlux_meaning_are_carried_and_listed(export, prefix):
    result = export(
        f"""def RectLight "L" {{
            float {prefix}exposure = 3
            bool {prefix}normalize = 1
            float inputs:width = 4
            color3f[] {prefix}color = [(1, 0.5, 0.25)]
        }}"""
    )
    assert Gltf(result.path).nits("/L") == pytest.approx([2, 1, 0.5])
    assert {f"{prefix}exposure", f"{prefix}normalize", f"{prefix}color"} <= result.noted()


@pytest.mark.parametrize(
    "line",
    [
        "float primvars:arnold:spread = 0.2",
        "rel primvars:arnold:shaders = </X>",
        'string primvars:arnold:shaders = "/X"',
        "float photometric:lumens = 800",
        "float inputs:photometric:lumens = 800",
        'token ri:light:falloffType = "linear"',
        "float inputs:ri:light:intensityNearDist = 2",
        'string karma:light:contribs = "-diffuse"',
        "float primvars:cycles:light:spread = 1",
        "float redshift:light:volume = 0",
        "int vray:units = 2",
        "bool moonray:two_sided = 1",
        "bool inputs:enableFalloff = 1",
        "asset inputs:gobo = @g.png@",
        "float inputs:nonsense = 3",
    ],
)
@pytest.mark.parametrize("kind", ["SphereLight", "DomeLight", "DistantLight"])
def test_whatever_else_is_authored_on_a_light_is_listed(export, line, kind):
    name = line.split()[1]
    result = export(f'def {kind} "L" {{ {line} }}')
    assert any(w["category"] == "lights" and f"{name} = " in w["why"] for w in result.report["warnings"])
    assert export(f'def {kind} "L" {{ {line} }}', "--strict=lights").code == 1


def test_what_does_not_change_the_picture_is_a_note_and_passes_strict(export):
    result = export(
        """def SphereLight "L" {
            float houdini:guidescale = 2
            int primvars:arnold:samples = 4
            float primvars:arnold:sss = 1
            string primvars:dcc_name = "lamp"
            float barndoorleft = 0
        }""",
        "--strict",
    )
    assert result.code == 0
    for name in ("houdini:guidescale", "primvars:arnold:samples", "primvars:arnold:sss", "primvars:dcc_name", "barndoorleft"):
        assert name in result.said()


def test_a_meshs_own_primvars_and_schema_say_nothing(export):
    result = export(
        """def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {
            int[] faceVertexCounts = [3]
            int[] faceVertexIndices = [0, 1, 2]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]
            uniform token subdivisionScheme = "none"
            texCoord2f[] primvars:UVMap = [(0, 0), (1, 0), (1, 1)] (interpolation = "vertex")
            rel material:binding = </Mat>
        }
        def Material "Mat" {
            token outputs:surface.connect = </Mat/S.outputs:surface>
            def Shader "S" { uniform token info:id = "UsdPreviewSurface"
                color3f inputs:emissiveColor = (1, 1, 1)
                token outputs:surface }
        }
        def Sphere "S" (prepend apiSchemas = ["MeshLightAPI"]) { double radius = 3 }""",
        "--strict",
    )
    assert result.code == 0, result.err


def test_values_of_a_wrong_type_are_reported_and_harmless(export):
    result = export('def RectLight "L" { string intensity = "bright"\n float3[] primvars:arnold:color = [] }')
    assert result.code == 0
    assert "intensity of a wrong type" in result.warned("lights")
    assert Gltf(result.path).nits("/L") == pytest.approx([1] * 3)


def test_a_connected_input_reads_its_constant_or_says_so(export):
    result = export(
        """def Scope "M" {
            def NodeGraph "G" { float inputs:level = 7 }
        }
        def RectLight "L" { float inputs:intensity.connect = </M/G.inputs:level> }
        def RectLight "Q" { color3f inputs:color.connect = </S.outputs:rgb> }
        def Shader "S" { uniform token info:id = "arnold:noise"
            float3 outputs:rgb }"""
    )
    assert Gltf(result.path).nits("/L") == pytest.approx([7] * 3)
    assert "connected inputs:color" in result.warned("lights")


# -- lights of no size -----------------------------------------------------------------------------


@pytest.mark.parametrize("normalize", [0, 1])
@pytest.mark.parametrize("point", [0, 1])
def test_a_sphere_of_radius_0_is_the_point_that_arnold_and_cycles_make_of_it(export, normalize, point):
    result = export(
        f"""def SphereLight "L" {{
            float inputs:intensity = 200
            float inputs:radius = 0
            bool treatAsPoint = {point}
            bool inputs:normalize = {normalize}
        }}"""
    )
    scene = Gltf(result.path)
    assert (scene.light("/L")["type"], scene.light("/L")["intensity"]) == ("point", pytest.approx(50))
    # Only what no hint and no schema asks for is reported.
    assert result.warned() == (set() if normalize or point else {"SphereLight of radius 0"})


def test_a_radius_keeps_its_power_under_the_hint(gltf):
    scene = gltf('def SphereLight "L" { bool treatAsPoint = 1\n float inputs:radius = 2 }')
    assert scene.light("/L")["intensity"] == pytest.approx(4 * math.pi)


@pytest.mark.parametrize("line", [0, 1])
def test_a_cylinder_of_radius_0_is_a_thin_line_of_the_same_power(export, line):
    result = export(
        f"""def CylinderLight "L" {{
            float inputs:radius = 0
            float inputs:length = 4
            float inputs:intensity = 10
            bool treatAsLine = {line}
        }}"""
    )
    scene = Gltf(result.path)
    assert scene.nits("/L")[0] * scene.area("/L") == pytest.approx(10, rel=1e-5)
    assert result.warned() == (set() if line else {"CylinderLight of radius 0"})


def test_a_cylinder_of_no_size_at_all_is_a_point(gltf):
    scene = gltf('def CylinderLight "L" { float inputs:radius = 0\n float inputs:length = 0\n bool treatAsLine = 1 }')
    assert scene.light("/L")["intensity"] == pytest.approx(0.25)


FLAT = [
    ("RectLight", "float inputs:width = 0"),
    ("RectLight", "float inputs:width = 0\n float inputs:height = 0"),
    ("DiskLight", "float inputs:radius = 0"),
    ("CylinderLight", "float inputs:length = 0"),
    ("SphereLight", "float3 xformOp:scale = (0, 0, 0)\n uniform token[] xformOpOrder = [\"xformOp:scale\"]"),
]


@pytest.mark.parametrize(("kind", "size"), FLAT)
def test_other_lights_without_area_emit_nothing_and_say_so(export, kind, size):
    result = export(f'def {kind} "L" {{ {size} }}')
    assert f"{kind} emits nothing" in result.warned("lights")


# -- visibility ------------------------------------------------------------------------------------

SEEN = [
    ("custom bool visibleInPrimaryRay = 0", {"camera": False}),
    ("bool inputs:visibleInPrimaryRay = 1", {"camera": True}),
    ("bool inputs:visibility:camera = 0", {"camera": False}),
    ("float primvars:arnold:camera = 0", {"camera": False}),
    ("float primvars:arnold:camera = 1", {"camera": True}),
    ("bool primvars:arnold:visibility:camera = 0", {"camera": False}),
    ("bool arnold:visibility:camera = 0", {"camera": False}),
    ("bool primvars:arnold:visibility:shadow = 0", {"shadows": False}),
    ("int primvars:arnold:visibility = 252", {"camera": False, "shadows": False}),
    ("int primvars:arnold:visibility = 255", {}),
    ("int primvars:ri:attributes:visibility:camera = 0", {"camera": False}),
    ("int primvars:ri:attributes:visibility:indirect = 0", {"reflections": False}),
    ("int primvars:ri:attributes:visibility:transmission = 1", {"shadows": True}),
    ("bool karma:light:renderlightgeo = 1", {"camera": True}),
    ('string primvars:karma:object:rendervisibility = "-primary"', {"camera": False}),
    ('string primvars:karma:object:rendervisibility = "* ^shadow"', {"shadows": False}),
    ('string primvars:karma:object:rendervisibility = "primary|shadow"', {"camera": True, "reflections": False, "shadows": True}),
    ('string primvars:karma:object:rendervisibility = ""', {"camera": False, "reflections": False, "shadows": False}),
    ('string primvars:karma:object:rendervisibility = "*"', {}),
    ('token moonray:visible_in_camera = "force off"', {"camera": False}),
    ('token moonray:visible_in_camera = "use default"', {}),
    ("int moonray:visible_in_camera = 2", {}),
    ("int moonray:visible_in_camera = 0", {"camera": False}),
    ("bool ospray:visibleToCamera = 1", {"camera": True}),
    ("bool primvars:cycles:object:visibility:glossy = 0", {"reflections": False}),
]


@pytest.mark.parametrize(("line", "expected"), SEEN)
def test_visibility_is_carried_as_each_renderer_says_it(export, line, expected):
    result = export(f'def RectLight "L" {{ {line} }}', "--strict")
    assert result.code == 0, result.err
    assert Gltf(result.path).lux("/L").get("visibility", {}) == expected
    for ray, seen in expected.items():
        # What is so anyhow needs no note.
        assert (f"visibility.{ray} is {seen}" in result.said()) == (seen != (ray == "reflections"))


def test_visibilities_that_disagree_or_are_weights_are_reported(export):
    result = export(
        'def RectLight "L" { float primvars:arnold:camera = 0.4\n int primvars:ri:attributes:visibility:camera = 0 }'
    )
    assert Gltf(result.path).lux("/L")["visibility"] == {"camera": True}
    assert {"primvars:arnold:camera between 0 and 1",
            "primvars:ri:attributes:visibility:camera overruled"} <= result.warned("lights")  # fmt: skip


# -- what changes over time ------------------------------------------------------------------------

SIZES = {
    "SphereLight": ("radius",),
    "DiskLight": ("radius",),
    "RectLight": ("width", "height"),
    "CylinderLight": ("radius", "length"),
}
GROWING = [(kind, name) for kind, names in SIZES.items() for name in names]


@pytest.mark.parametrize(("kind", "name"), GROWING)
@pytest.mark.parametrize("normalize", [0, 1])
def test_a_light_that_grows_has_its_power_at_every_frame(gltf, kind, name, normalize):
    """Power is nits times area; both are in the file, one as keys and one as a scale."""
    size = np.array([0.5, 1, 2, 4, 2.5])
    keys = ", ".join(f"{code}: {value}" for code, value in enumerate(size, 1))
    light = f"float inputs:{name}.timeSamples = {{ {keys} }}\n bool inputs:normalize = {normalize}"
    light += "\n float inputs:intensity.timeSamples = { 1: 1, 5: 5 }"
    scene = gltf(ANIMATED + f'def {kind} "L" {{ {light}\n def Cube "Child" {{ double size = 1 }} }}')
    intensity = np.arange(1, 6)
    area = {"SphereLight": 4 * np.pi * size**2, "DiskLight": np.pi * size**2}.get(kind)
    if kind == "RectLight":
        area = size
    if kind == "CylinderLight":
        area = 2 * np.pi * (size if name == "radius" else 0.5 * size)
    values = np.array(scene.lux("/L")["values"]["rgb"])[:, 0]
    local = np.linalg.norm(scene.area_vectors("/L"), axis=1)
    for frame in range(5):
        linear = scene.world("/L", frame / 24)[:3, :3]
        corners = scene.triangles("/L") @ linear.T
        cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        assert len(local) == len(cross)
        shown = np.linalg.norm(cross, axis=1).sum() / 2
        assert shown == pytest.approx(area[frame], rel=2e-5)
        expected = intensity[frame] * (1 if normalize else area[frame])
        assert values[frame] * shown == pytest.approx(expected, rel=2e-5)
        assert scene.world("/L/Child", frame / 24) == pytest.approx(np.eye(4), abs=1e-5), "children do not grow"


def test_a_light_that_grows_from_nothing(gltf):
    scene = gltf(ANIMATED + 'def SphereLight "L" { float inputs:radius.timeSamples = { 1: 0, 5: 4 } }')
    assert scene.world("/L", 0)[0, 0] == pytest.approx(1e-6)
    assert scene.area("/L") < 1e-6
    assert scene.world("/L", 4 / 24)[0, 0] == pytest.approx(1)


def test_a_size_that_only_may_vary_is_still(gltf):
    scene = gltf(ANIMATED + 'def SphereLight "L" { float inputs:radius.timeSamples = { 1: 2, 3: 2, 5: 2 } }')
    assert scene.channels("/L") == {}
    assert scene.lux("/L")["radius"] == 2


def test_a_point_that_grows_changes_its_candela(gltf):
    scene = gltf(
        ANIMATED + 'def SphereLight "L" { bool treatAsPoint = 1\n float inputs:radius.timeSamples = { 1: 1, 5: 5 } }'
    )
    candela = np.array(scene.lux("/L")["values"]["rgb"])[:, 0]
    assert candela == pytest.approx(np.pi * np.arange(1, 6) ** 2, rel=1e-6)


@pytest.mark.parametrize("normalize", [0, 1])
def test_a_sun_that_grows_has_its_illuminance_at_every_frame(export, normalize):
    result = export(
        ANIMATED + f"""def DistantLight "Sun" {{
            float inputs:angle.timeSamples = {{ 1: 1, 5: 9 }}
            float inputs:intensity = 100
            bool inputs:normalize = {normalize}
        }}"""
    )
    scene = Gltf(result.path)
    assert not result.warned()
    angles = np.array([1, 3, 5, 7, 9])
    wanted = np.full(5, 100.0) if normalize else 100 * np.pi * np.sin(np.radians(angles / 2)) ** 2
    for frame, (angle, lux) in enumerate(zip(angles, wanted, strict=True)):
        path = "/Sun" if frame == 0 else f"/Sun[shaping {frame + 1}]"
        values = scene.lux(path)["values"]
        strength = np.interp(np.float32(np.arange(5) / 24), np.float32(values["times"]), np.array(values["rgb"])[:, 0])
        assert scene.lux(path)["angle"] == pytest.approx(angle)
        assert strength == pytest.approx(np.where(np.arange(5) == frame, lux, 0), rel=1e-6)


def test_normalize_that_is_switched_over_time(gltf):
    scene = gltf(
        ANIMATED + """def RectLight "L" {
            bool inputs:normalize.timeSamples = { 1: 0, 3: 1 }
            float inputs:width = 4
        }"""
    )
    assert np.array(scene.lux("/L")["values"]["rgb"])[:, 0] == pytest.approx([1, 1, 0.25, 0.25, 0.25])


def test_temperature_and_its_switch_over_time(gltf):
    scene = gltf(
        ANIMATED + """def RectLight "L" {
            bool inputs:enableColorTemperature.timeSamples = { 1: 0, 3: 1 }
            float inputs:colorTemperature = 3200
        }"""
    )
    rows = np.array(scene.lux("/L")["values"]["rgb"])
    assert rows[1] == pytest.approx([1, 1, 1])
    assert rows[2] == pytest.approx([1.6799, 0.8660, 0.3256], rel=2e-4)


GROUPS = {
    "candelabra:lightGroup": "string",
    "primvars:arnold:aov": "string",
    "karma:light:lpetag": "string",
    "inputs:karma:light:lpetag": "string",
    "ri:light:lightGroup": "string",
    "inputs:ri:light:lightGroup": "string",
    "primvars:ri:attributes:identifier:lpegroup": "string",
    "cycles:lightgroup": "string",
    "moonray:label": "token",
}


@pytest.mark.parametrize("name", GROUPS)
def test_a_light_group_is_carried_whoever_names_it(export, name):
    result = export(f'def RectLight "L" {{ {GROUPS[name]} {name} = "key" }}')
    assert Gltf(result.path).lux("/L")["group"] == "key"
    assert name in result.noted() and not result.warned()


def test_an_array_of_one_name_is_the_name(gltf):
    assert gltf('def RectLight "L" { string[] primvars:arnold:aov = ["rim"] }').lux("/L")["group"] == "rim"


@pytest.mark.parametrize("none", ["", "default"])
def test_the_default_group_is_none(gltf, none):
    assert "group" not in gltf(f'def RectLight "L" {{ string primvars:arnold:aov = "{none}" }}').lux("/L")


def test_groups_that_contradict_are_warned_of(export):
    result = export(
        """def SphereLight "L" {
            string karma:light:lpetag = "fill"
            string ri:light:lightGroup = "rim"
            int moonray:label = 3
        }"""
    )
    assert Gltf(result.path).lux("/L")["group"] == "fill"
    assert {"ri:light:lightGroup overruled", "moonray:label of a wrong type"} <= result.warned("lights")
