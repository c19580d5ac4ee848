"""Units, axes, instances, visibility, purpose, variants, cameras, animation."""

import math

import numpy as np
import pytest

CUBE = 'def Cube "C" { double size = 1 }'


def test_units_and_axes(gltf):
    scene = gltf(
        """#usda 1.0
        (
            metersPerUnit = 0.01
            upAxis = "Z"
        )
        def SphereLight "L" {
            float inputs:radius = 10
            double3 xformOp:translate = (100, 200, 300)
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }"""
    )
    assert scene.world("/L")[:3, 3] == pytest.approx([1, 3, -2], abs=1e-6)
    assert scene.area("/L") == pytest.approx(4 * math.pi * 0.01, rel=1e-5)
    assert scene.nits("/L") == pytest.approx([1, 1, 1])
    usd = scene.json["asset"]["extras"]["usd"]
    assert (usd["metersPerUnit"], usd["upAxis"], usd["normalizeArea"]) == (0.01, "Z", "stage")


def test_native_instances_show_their_insides_and_share_meshes(gltf):
    scene = gltf(
        f"""def "Lib" {{ {CUBE}\n def SphereLight "L" {{}} }}
        def "A" (instanceable = true
            references = </Lib>) {{}}
        def "B" (instanceable = true
            references = </Lib>) {{}}"""
    )
    assert {"/A/L", "/B/L", "/Lib/L", "/A/C", "/B/C"} <= set(scene.by_path)
    assert scene.node("/A/C")["mesh"] == scene.node("/B/C")["mesh"]
    assert scene.node("/A/L")["mesh"] == scene.node("/B/L")["mesh"]


INSTANCER = """def PointInstancer "Lamps" {
    rel prototypes = [</Lamps/Lamp>, </Lamps/Box>]
    int[] protoIndices = [0, 1, 0, 0]
    point3f[] positions = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0)]
    float3[] scales = [(1, 1, 1), (1, 1, 1), (2, 2, 2), (1, 1, 1)]
    int64[] invisibleIds = [3]
    def Xform "Lamp" {
        double3 xformOp:translate = (0, 5, 0)
        uniform token[] xformOpOrder = ["xformOp:translate"]
        def SphereLight "Bulb" { bool inputs:normalize = 1 }
    }
    def Cube "Box" {}
}"""


def test_point_instancers_multiply_their_prototypes(gltf):
    scene = gltf(INSTANCER)
    assert "/Lamps/Lamp/Bulb" not in scene.by_path
    lights = sorted(path for path in scene.by_path if "usdLux" in scene.node(path)["extras"])
    assert lights == ["/Lamps[0]/Bulb", "/Lamps[2]/Bulb"]
    assert "/Lamps[1]" in scene.by_path and "/Lamps[3]" not in scene.by_path
    assert scene.world("/Lamps[2]/Bulb")[:3, 3] == pytest.approx([2, 10, 0])
    # normalize sees the instance's scale.
    assert scene.nits("/Lamps[0]/Bulb") == pytest.approx([1 / math.pi] * 3)
    assert scene.nits("/Lamps[2]/Bulb") == pytest.approx([1 / (4 * math.pi)] * 3)


def test_nested_instancers(gltf):
    scene = gltf(
        """def PointInstancer "Outer" {
            rel prototypes = [</Outer/Inner>]
            int[] protoIndices = [0, 0, 0]
            point3f[] positions = [(0, 0, 0), (10, 0, 0), (20, 0, 0)]
            def PointInstancer "Inner" {
                rel prototypes = [</Outer/Inner/L>]
                int[] protoIndices = [0, 0]
                point3f[] positions = [(0, 0, 0), (0, 1, 0)]
                def RectLight "L" {}
            }
        }"""
    )
    lights = [path for path in scene.by_path if "usdLux" in scene.node(path)["extras"]]
    assert len(lights) == 6
    assert scene.world("/Outer[2][1]")[:3, 3] == pytest.approx([20, 1, 0])
    assert len(scene.json["meshes"]) == 1


def test_an_instancer_inside_its_own_prototype_ends(export):
    result = export(
        """def PointInstancer "I" {
            rel prototypes = [</I/P>]
            int[] protoIndices = [0]
            point3f[] positions = [(0, 0, 0)]
            def Xform "P" {
                def PointInstancer "J" {
                    rel prototypes = [</I/P>]
                    int[] protoIndices = [0]
                    point3f[] positions = [(0, 0, 0)]
                }
                def Cube "C" {}
            }
        }"""
    )
    assert result.code == 0
    assert "PointInstancer inside its own prototype" in result.warned()


def test_prototypes_may_be_overs(gltf):
    scene = gltf(
        """def PointInstancer "I" {
            rel prototypes = [</Hidden/P>]
            int[] protoIndices = [0]
            point3f[] positions = [(7, 0, 0)]
        }
        over "Hidden" { def Cube "P" {} }"""
    )
    assert sorted(scene.by_path) == ["/I", "/I[0]"]


def test_animated_instancers_move_their_instances(gltf):
    scene = gltf(
        ANIMATED
        + """def PointInstancer "I" {
            rel prototypes = [</I/P>]
            int[] protoIndices = [0, 0]
            point3f[] positions.timeSamples = { 1: [(0, 0, 0), (5, 0, 0)], 3: [(0, 2, 0), (5, 0, 0)] }
            def Cube "P" {}
        }"""
    )
    times, values = scene.channels("/I[0]")["translation"]
    assert times == pytest.approx([0, 1 / 24, 2 / 24])
    assert values[:, 1] == pytest.approx([0, 1, 2])
    assert scene.channels("/I[1]") == {}


def test_visibility_and_purpose(gltf):
    text = """
        def Xform "Off" { token visibility = "invisible"
            def RectLight "L" {} }
        def Cube "Proxy" { uniform token purpose = "proxy" }
        def Cube "Render" { uniform token purpose = "render" }
        def Xform "Guides" { uniform token purpose = "guide"
            def Cube "C" {} }
        def Cube "Shown" {}"""
    assert sorted(gltf(text).by_path) == ["/Render", "/Shown"]
    assert sorted(gltf(text, "--purpose", "default,proxy,guide").by_path) == [
        "/Guides", "/Guides/C", "/Proxy", "/Shown"
    ]  # fmt: skip


VARIANTS = """def Xform "Set" (
    variants = { string size = "small" }
    prepend variantSets = "size"
) {
    variantSet "size" = {
        "small" { def Cube "C" { double size = 1 } }
        "large" { def Cube "C" { double size = 3 } }
    }
}"""


def test_variants(gltf, export):
    assert gltf(VARIANTS).area("/Set/C") == pytest.approx(6)
    assert gltf(VARIANTS, "--variant", "/Set{size=large}").area("/Set/C") == pytest.approx(54)
    for wrong, hint in [("/Set{size=huge}", "small"), ("/Set{mood=dark}", "size"), ("/No{size=small}", "/No")]:
        result = export(VARIANTS, "--variant", wrong)
        assert result.code == 1
        assert hint in result.err
    assert export(VARIANTS, "--variant", "nonsense").code == 2


def test_cameras(gltf):
    scene = gltf(
        """#usda 1.0
        (
            metersPerUnit = 0.01
            upAxis = "Y"
        )
        def Camera "Cam" {
            float focalLength = 35
            float horizontalAperture = 36
            float verticalAperture = 20.25
            float horizontalApertureOffset = 3.6
            float fStop = 2.8
            float focusDistance = 400
        }"""
    )
    camera = scene.json["cameras"][scene.node("/Cam")["camera"]]["perspective"]
    assert camera["yfov"] == pytest.approx(0.5632, abs=1e-4)
    assert camera["aspectRatio"] == pytest.approx(16 / 9)
    extras = scene.node("/Cam")["extras"]["usdCamera"]
    assert extras == {
        "fStop": pytest.approx(2.8),
        "focalLength_m": pytest.approx(0.035),
        "focusDistance_m": pytest.approx(4.0),
        "filmOffset": [pytest.approx(0.1), 0],
    }


def camera(gltf, lines: str, header: str = "metersPerUnit = 0.01"):
    scene = gltf(f'#usda 1.0\n(\n{header}\n)\ndef Camera "Cam" {{ {lines} }}')
    return scene.json["cameras"][scene.node("/Cam")["camera"]], scene.node("/Cam")["extras"]["usdCamera"]


@pytest.mark.parametrize(
    ("lines", "scale"),
    [
        ("", None),
        ("float exposure = 0", None),
        ("float exposure = 2", 4),
        ("float exposure = -3", 1 / 8),
        ("float exposure:iso = 400", 4),
        ("float exposure:time = 0.02", 0.02),
        ("float exposure:fStop = 2", 1 / 4),
        ("float exposure:responsivity = 3", 3),
        ("float exposure = 1\n float exposure:iso = 200\n float exposure:time = 0.5\n float exposure:fStop = 4", 2 / 16),
    ],
)
def test_a_cameras_exposure_is_a_factor(gltf, lines, scale):
    extras = camera(gltf, lines)[1]
    assert extras.get("exposureScale") == (None if scale is None else pytest.approx(scale))


@pytest.mark.parametrize("lines", ["float exposure = nan", "float exposure = 1e6", "float exposure:fStop = 0", "float exposure:iso = -1"])
def test_an_exposure_that_is_no_factor_is_reported(export, lines):
    result = export(f'def Camera "Cam" {{ {lines} }}')
    assert result.code == 0
    assert "camera exposure is no factor" in result.warned("cameras")


def test_clipping_ranges_are_metres_and_the_fallback_is_none(gltf):
    assert "clippingRange_m" not in camera(gltf, "")[1]
    assert "clippingRange_m" not in camera(gltf, "float2 clippingRange = (1, 1000000)")[1]
    gltf_camera, extras = camera(gltf, "float2 clippingRange = (10, 5000)")
    assert extras["clippingRange_m"] == pytest.approx([0.1, 50])
    assert (gltf_camera["perspective"]["znear"], gltf_camera["perspective"]["zfar"]) == pytest.approx((0.1, 50))


@pytest.mark.parametrize("clip", ["(5, 5)", "(9, 2)", "(nan, 3)"])
def test_a_clipping_range_that_is_none_is_reported(export, clip):
    result = export(f'def Camera "Cam" {{ float2 clippingRange = {clip} }}')
    assert "clippingRange is no range" in result.warned("cameras")


def test_orthographic_cameras_have_half_their_aperture_in_metres(gltf):
    lines = """token projection = "orthographic"
        float horizontalAperture = 4000
        float verticalAperture = 1000
        float focalLength = 0
        float2 clippingRange = (-20, 500)"""
    gltf_camera, extras = camera(gltf, lines)
    assert gltf_camera["type"] == "orthographic"
    assert gltf_camera["orthographic"] == {
        "xmag": pytest.approx(2), "ymag": pytest.approx(0.5), "znear": 0, "zfar": pytest.approx(5)
    }  # fmt: skip
    assert extras["clippingRange_m"] == pytest.approx([-0.2, 5])


def test_what_a_camera_loses_is_listed(export):
    text = """def Camera "Cam" {
        float4[] clippingPlanes = [(0, 1, 0, 2)]
        float focusDistance = 4
        float primvars:arnold:focus_distance = 3
        float houdini:guidescale = 1
    }"""
    still = export(text)
    assert still.warned("cameras") == {"clippingPlanes", "arnold attributes"}
    assert "attributes without effect" in still.noted() and "houdini:guidescale" in still.said()
    assert export(text, "--strict=cameras").code == 1
    assert export(text, "--strict=lights,materials,geometry,animation,other").code == 0


ANIMATED = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 5
    timeCodesPerSecond = 24
    metersPerUnit = 1
    upAxis = "Y"
)
"""


def test_moving_things_move_and_static_things_stand_still(gltf):
    scene = gltf(
        ANIMATED
        + """def Cube "Moves" {
            double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (0, 0, 0), 4: (4, 0, 0), 5: (4, 0, 0) }
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }
        def Cube "Still" {
            double3 xformOp:translate.timeSamples = { 1: (1, 0, 0), 5: (1, 0, 0) }
            uniform token[] xformOpOrder = ["xformOp:translate"]
        }"""
    )
    channels = scene.channels("/Moves")
    assert list(channels) == ["translation"]
    times, values = channels["translation"]
    # One key a frame, from the last one before the change to the first one after it.
    assert times == pytest.approx([1 / 24, 2 / 24, 3 / 24])
    assert values[:, 0] == pytest.approx([0, 2, 4])
    assert scene.channels("/Still") == {}
    assert scene.world("/Still")[0, 3] == 1


def test_frames_choose_the_range_and_its_zero(gltf):
    text = ANIMATED + """def Cube "M" {
        double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 5: (4, 0, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate"]
    }"""
    scene = gltf(text, "--frames", "2-4")
    times, values = scene.channels("/M")["translation"]
    assert times == pytest.approx([0, 1 / 24, 2 / 24])
    assert values[:, 0] == pytest.approx([1, 2, 3])
    usd = scene.json["asset"]["extras"]["usd"]
    assert (usd["startTimeCode"], usd["endTimeCode"]) == (2, 4)
    assert gltf(text, "--frames", "3").channels("/M") == {}


def test_rotations_take_the_short_way(gltf):
    scene = gltf(
        ANIMATED
        + """def Cube "Spin" {
            float xformOp:rotateZ.timeSamples = { 1: 0, 5: 720 }
            uniform token[] xformOpOrder = ["xformOp:rotateZ"]
        }"""
    )
    _, values = scene.channels("/Spin")["rotation"]
    assert len(values) == 5
    assert (np.einsum("ki,ki->k", values[1:], values[:-1]) >= -1e-6).all()
    assert np.linalg.norm(values, axis=1) == pytest.approx(1, abs=1e-6)


def test_shear_is_carried_exactly_by_two_nodes(gltf):
    scene = gltf(
        """def Cube "S" {
            matrix4d xformOp:transform = ((1, 0, 0, 0), (0.5, 1, 0, 0), (0, 0, -2, 0), (3, 4, 5, 1))
            uniform token[] xformOpOrder = ["xformOp:transform"]
        }"""
    )
    expected = np.array([[1, 0.5, 0, 3], [0, 1, 0, 4], [0, 0, -2, 5], [0, 0, 0, 1]])
    assert scene.world("/S") == pytest.approx(expected, abs=1e-6)


def test_animated_shear_is_exact_at_every_frame(gltf):
    """A direction goes through the matrix, also below a moving, unevenly scaled rig."""
    rows = {1: (0.5, 1, 0.2), 2: (0.9, 1.4, -0.3), 3: (-0.6, 0.4, 0), 4: (0, 1, 0), 5: (2, 1, 1)}
    samples = ", ".join(
        f"{code}: ((1, 0, 0, 0), ({a}, {b}, {c}, 0), (0, 0.3, -2, 0), ({code}, 4, 5, 1))" for code, (a, b, c) in rows.items()
    )
    scene = gltf(
        ANIMATED
        + f"""def Xform "Rig" {{
            matrix4d xformOp:transform.timeSamples = {{ {samples} }}
            uniform token[] xformOpOrder = ["xformOp:transform"]
            def DistantLight "Sun" {{}}
        }}"""
    )
    for code, (a, b, c) in rows.items():
        expected = np.array([[1, a, 0, code], [0, b, 0.3, 4], [0, c, -2, 5], [0, 0, 0, 1]])
        assert scene.world("/Rig/Sun", (code - 1) / 24) == pytest.approx(expected, abs=1e-5)


def test_reset_xform_stack(gltf):
    scene = gltf(
        """def Xform "P" {
            double3 xformOp:translate = (9, 9, 9)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def Cube "C" {
                double3 xformOp:translate = (1, 0, 0)
                uniform token[] xformOpOrder = ["!resetXformStack!", "xformOp:translate"]
            }
        }"""
    )
    assert scene.world("/P/C")[:3, 3] == pytest.approx([1, 0, 0])


def test_a_mirrored_prim_keeps_its_matrix(gltf):
    scene = gltf(
        """def RectLight "L" {
            float3 xformOp:scale = (1, -1, 1)
            float3 xformOp:rotateXYZ = (10, 20, 30)
            uniform token[] xformOpOrder = ["xformOp:rotateXYZ", "xformOp:scale"]
        }"""
    )
    world = scene.world("/L")[:3, :3]
    assert np.linalg.det(world) == pytest.approx(-1)
    assert world @ world.T == pytest.approx(np.eye(3), abs=1e-6)
