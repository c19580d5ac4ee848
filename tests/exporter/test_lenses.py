"""Lenses over time, against what UsdGeomCamera says at each time code."""

import math

import numpy as np
import pytest
from conftest import Gltf
from pxr import Usd, UsdGeom

HEADER = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 6
    timeCodesPerSecond = 24
    metersPerUnit = 0.01
)
"""
WIDTH, HEIGHT = 20.955, 15.2908
"""The fallback apertures."""


def camera(lines: str) -> str:
    return f'{HEADER} def Camera "Cam" {{ {lines} }}'


def usd(scene: Gltf) -> dict:
    return scene.node("/Cam")["extras"]["usdCamera"]


def shown(scene: Gltf, code: float) -> dict:
    """The lens at a time code: the constants of the file, or the values that take their place, linear and held."""
    extras, gltf = usd(scene), scene.json["cameras"][scene.node("/Cam")["camera"]]
    lens = {name: extras[name] for name in ("fStop", "focalLength_m", "focusDistance_m", "filmOffset")}
    lens["exposureScale"] = extras.get("exposureScale", 1.0)
    lens["clippingRange_m"] = extras.get("clippingRange_m", [0, math.inf])
    kind = gltf["type"]
    lens["height"] = gltf[kind]["yfov" if kind == "perspective" else "ymag"]
    values = dict(extras.get("values", {"times": []}))
    times = values.pop("times")
    assert all(after > before for before, after in zip(np.float32(times), np.float32(times)[1:]))
    zero = scene.json["asset"]["extras"]["usd"].get("zeroTimeCode", scene.json["asset"]["extras"]["usd"]["startTimeCode"])
    for name, rows in values.items():
        rows = np.array(rows).reshape(len(times), -1)
        assert len(rows) == len(times)
        found = [float(np.interp((code - zero) / 24, times, column)) for column in rows.T]
        lens["height" if name in ("yfov", "ymag") else name] = found[0] if len(found) == 1 else found
    return lens


def expected(path, code: float, name: str = "/Cam") -> dict:
    """The same, computed of the stage."""
    stage = Usd.Stage.Open(str(path))
    prim = UsdGeom.Camera(stage.GetPrimAtPath(name))
    found = prim.GetCamera(code)
    unit = 0.01
    parallel = found.projection == found.Orthographic
    tenths = 0.1 * unit
    return {
        "fStop": found.fStop,
        "focalLength_m": found.focalLength * tenths,
        "focusDistance_m": found.focusDistance * unit,
        "filmOffset": [found.horizontalApertureOffset / found.horizontalAperture,
                       found.verticalApertureOffset / found.verticalAperture],
        "exposureScale": prim.ComputeLinearExposureScale(code),
        "clippingRange_m": [found.clippingRange.min * unit, found.clippingRange.max * unit],
        "height": found.verticalAperture * tenths / 2 if parallel else math.radians(found.GetFieldOfView(found.FOVVertical)),
    }  # fmt: skip


VARYING = {
    "focal length": ("float focalLength.timeSamples = { 2: 35, 5: 70 }", {"yfov", "focalLength_m"}),
    "apertures": (
        "float horizontalAperture.timeSamples = { 1: 36, 4: 24 }\n float verticalAperture.timeSamples = { 1: 24, 4: 16 }",
        {"yfov"},
    ),
    "offsets": ("float horizontalApertureOffset.timeSamples = { 1: 0, 6: 5 }", {"filmOffset"}),
    "both offsets": (
        "float horizontalApertureOffset.timeSamples = { 2: 1, 3: -2 }\n float verticalApertureOffset.timeSamples = { 1: 0, 6: 5 }",
        {"filmOffset"},
    ),
    "f-stop": ("float focusDistance = 300\n float fStop.timeSamples = { 1: 0, 4: 2.8 }", {"fStop"}),
    "focus": ("float fStop = 2\n float focusDistance.timeSamples = { 1: 100, 2.5: 300, 6: 20 }", {"focusDistance_m"}),
    "exposure": ("float exposure.timeSamples = { 3: -2, 4: 3 }", {"exposureScale"}),
    "dark exposure": ("float exposure.timeSamples = { 3: -30, 4: -34 }", {"exposureScale"}),
    "exposure's parts": ("float exposure:iso.timeSamples = { 1: 100, 6: 400 }\n float exposure:time = 0.5", {"exposureScale"}),
    "clipping": ("float2 clippingRange.timeSamples = { 1: (1, 1000000), 6: (5, 300) }", {"clippingRange_m"}),
    "orthographic": ('token projection = "orthographic"\n float verticalAperture.timeSamples = { 1: 20, 6: 80 }\n '
                     "float horizontalAperture.timeSamples = { 1: 30, 6: 120 }", {"ymag"}),
    "held": ("float focalLength.timeSamples = { 1: 35, 3: 35, 4: 50, 6: 50 }", {"yfov", "focalLength_m"}),
}  # fmt: skip
FOCUSED = "\n float fStop = 4\n float focusDistance = 100\n float2 clippingRange = (2, 900)"


@pytest.mark.parametrize("case", VARYING)
def test_a_lens_is_usds_at_every_frame(export, case, tmp_path):
    lines, names = VARYING[case]
    # What is authored already is not authored twice.
    more = "\n".join(line for line in FOCUSED.strip().splitlines() if line.split()[1] not in lines)
    result, source = export(camera(f"{lines}\n {more}")), tmp_path / "scene.usda"
    scene = Gltf(result.path)
    assert result.warned() == set()
    assert set(usd(scene)["values"]) - {"times"} == names
    for code in range(1, 7):
        found, want = shown(scene, code), expected(source, code)
        for name, value in want.items():
            assert found[name] == pytest.approx(value, rel=2e-6, abs=1e-9 * abs(np.max(value))), (name, code)


def test_a_lens_that_stands_still_has_no_values(gltf):
    lines = "float focalLength.timeSamples = { 1: 35, 6: 35 }\n float fStop.timeSamples = { 2: 2.8 }\n float exposure.timeSamples = { 1: 1, 2: 1 }"
    assert "values" not in usd(gltf(camera(lines)))
    # One frame has no time for more.
    zoom = camera("float focalLength.timeSamples = { 1: 35, 5: 70 }")
    assert "values" not in usd(gltf(zoom, "--frames", "3"))
    assert usd(gltf(zoom, "--frames", "3"))["focalLength_m"] == pytest.approx(0.0525)
    # And a pinhole's focus means nothing.
    assert "values" not in usd(gltf(camera("float focusDistance.timeSamples = { 1: 35, 5: 70 }")))


def test_keys_are_only_where_something_changes(gltf):
    values = usd(gltf(camera("float exposure.timeSamples = { 3: 0, 4: 1 }")))["values"]
    assert values["times"] == pytest.approx([2 / 24, 3 / 24])
    assert values["exposureScale"] == pytest.approx([1, 2])


def test_of_animated_projections_the_first_frames_is_used(export):
    result = export(camera('token projection.timeSamples = { 1: "perspective", 3: "orthographic" }'))
    assert result.warned("cameras") == {"animated camera projection"}


def test_a_picture_keeps_its_shape(export):
    lines = "float horizontalAperture.timeSamples = { 1: 30, 6: 60 }\n float horizontalApertureOffset = 3\n float verticalAperture = 20"
    result = export(camera(lines), "--strict")
    assert result.code == 0 and "animated camera aspect" in result.noted()
    scene = Gltf(result.path)
    assert scene.json["cameras"][0]["perspective"]["aspectRatio"] == pytest.approx(1.5)
    # As wide as the aperture, and so much more high.
    for code, width in ((1, 30), (6, 60)):
        lens = shown(scene, code)
        assert lens["height"] == pytest.approx(2 * math.atan(width / 1.5 / (2 * 50)))
        assert lens["filmOffset"] == pytest.approx([3 / width, 0])


def test_a_film_that_becomes_narrow_is_seen_to_its_full_height(export):
    lines = "float horizontalAperture.timeSamples = { 1: 60, 6: 15 }\n float horizontalApertureOffset = 3\n float verticalAperture = 20"
    result = export(camera(lines + "\n float verticalApertureOffset = 2"), "--strict")
    assert result.code == 0, result.err
    for code in (1, 3, 6):
        lens = shown(Gltf(result.path), code)
        assert lens["height"] == pytest.approx(2 * math.atan(20 / (2 * 50)))
        assert lens["filmOffset"] == pytest.approx([3 / 60, 2 / 20])


ARNOLDS = {
    # (USD's lines, Arnold's parameters): aperture, focal length, offsets as a fraction; tenths of the unit.
    "float[] primvars:arnold:fov = [60]": (2 * 50 * math.tan(math.pi / 6), 0.729697, (0, 0)),
    "float2[] primvars:arnold:screen_window_min = [(-0.5, -0.5)]\n float2[] primvars:arnold:screen_window_max = [(0.5, 0.5)]":
        (20.955 / 2, 0.729697, (0, 0)),
    "float2 arnold:screen_window_min = (-1, 0)\n float2 arnold:screen_window_max = (0, 1)": (20.955 / 2, 0.729697, (-0.5, 0.5)),
    "float primvars:arnold:fov = 90\n float2[] primvars:arnold:screen_window_max = [(2, 2)]": (150, 0.729697, (1 / 6, 1 / 6)),
    "float2[] primvars:arnold:screen_window_max = [(1, 3)]": (20.955, 2 * 0.729697, (0, 0.25)),
}  # fmt: skip


@pytest.mark.parametrize("lines", ARNOLDS)
def test_arnolds_lens_counts_where_usd_says_nothing(export, lines):
    width, shape, offset = ARNOLDS[lines]
    result = export(f'def Camera "C" {{ {lines} }}', "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    lens = scene.json["cameras"][0]["perspective"]
    assert lens["yfov"] == pytest.approx(2 * math.atan(width * shape / 100), rel=1e-5)
    assert lens["aspectRatio"] == pytest.approx(1 / shape, rel=1e-5)
    assert scene.node("/C")["extras"]["usdCamera"]["filmOffset"] == pytest.approx(offset, abs=1e-6)


def test_arnolds_window_of_an_orthographic_camera_is_in_scene_units(export):
    lines = """token projection = "orthographic"
        float2[] primvars:arnold:screen_window_min = [(-3, -1)]
        float2[] primvars:arnold:screen_window_max = [(1, 3)]"""
    result = export(f'def Camera "C" {{ {lines} }}', "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    window = scene.json["cameras"][0]["orthographic"]
    assert window["xmag"] == pytest.approx(2) and window["ymag"] == pytest.approx(2 * 0.729697, rel=1e-5)
    assert scene.node("/C")["extras"]["usdCamera"]["filmOffset"] == pytest.approx([-0.25, 0.25])


def test_arnolds_focus_and_planes_count_where_usd_says_nothing_over_time_too(export):
    lines = """float fStop = 2
        float primvars:arnold:focus_distance.timeSamples = { 1: 2, 6: 7 }
        float[] primvars:arnold:near_clip = [0.25]
        float primvars:arnold:far_clip = 90"""
    result = export(camera("").split("def")[0] + f'def Camera "C" {{ {lines} }}', "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    extras = scene.node("/C")["extras"]["usdCamera"]
    unit = 0.01
    assert np.array(extras["clippingRange_m"]) == pytest.approx([0.25 * unit, 90 * unit])
    assert extras["values"]["focusDistance_m"] == pytest.approx(np.arange(2, 8) * unit)


def test_a_window_that_is_all_of_the_field_of_view_says_nothing(export):
    lines = "float2[] primvars:arnold:screen_window_min = [(-1, -1)]\n float2[] primvars:arnold:screen_window_max"
    assert "Arnold's" not in export(f'def Camera "C" {{ {lines} = [(1, 1)] }}', "--strict").said()
    assert "Arnold's" in export(f'def Camera "C" {{ {lines}.timeSamples = {{ 1: [(1, 1)], 2: [(2, 2)] }} }}', "--strict").said()


def test_a_window_that_is_empty_leaves_its_camera_out(export):
    result = export('def Camera "C" { float2[] primvars:arnold:screen_window_max = [(-1, 1)] }')
    assert result.warned("cameras") == {"camera without a field of view"} and "screen_window" in result.said()


@pytest.mark.parametrize(
    ("lines", "what", "name", "held"),
    [
        ("float focalLength.timeSamples = { 1: 50, 3: 0, 4: 20 }", "camera without a field of view", "focalLength_m", [0.05, 0.025, 0.025, 0.02]),
        ("float exposure:fStop.timeSamples = { 1: 1, 3: 0, 4: 2 }", "camera exposure is no factor", "exposureScale", [1, 4, 4, 0.25]),
        (
            "float2 clippingRange.timeSamples = { 1: (100, 500), 3: (300, 300), 4: (100, 900) }",
            "clippingRange is no range", "clippingRange_m", [[1, 5], [2, 4], [2, 4], [1, 9]],
        ),
    ],
)  # fmt: skip
def test_what_makes_no_sense_is_held_and_reported(export, lines, what, name, held):
    result = export(camera(f"{lines}\n float fStop = 2\n float focusDistance = 100"))
    assert result.warned("cameras") == {what} and "at time code 3" in result.said()
    values = usd(Gltf(result.path))["values"]
    assert np.array(values[name][:4]) == pytest.approx(np.array(held), rel=1e-6)


@pytest.mark.parametrize("first", ["focalLength = 0", "verticalAperture = -1", "horizontalAperture = nan"])
def test_a_camera_that_sees_nothing_at_first_is_left_out(export, first):
    name, _, value = first.split()
    result = export(camera(f"float {name}.timeSamples = {{ 1: {value}, 3: 20 }}"))
    assert result.warned("cameras") == {"camera without a field of view"}
    assert "cameras" not in Gltf(result.path).json


@pytest.mark.parametrize("opening", [(-0.25, 0.25), (0, 0.5), (-1, 2)])
def test_a_lens_is_usds_while_the_shutter_is_open(export, opening, tmp_path):
    shutter = f"double shutter:open = {opening[0]}\n double shutter:close = {opening[1]}\n"
    # Faster and faster before the first frame, and bent between frames.
    lines = f"{shutter} float focalLength.timeSamples = {{ -2: 10, 0.75: 30, 1.25: 32, 2.5: 90, 4.75: 20, 9: 60 }}"
    scene, source = Gltf(export(camera(lines)).path), tmp_path / "scene.usda"
    for frame in range(1, 7):
        for offset in (opening[0], 0, opening[1], *np.arange(math.ceil(4 * opening[0]), 4 * opening[1]) / 4):
            code = frame + offset
            assert shown(scene, code)["height"] == pytest.approx(expected(source, code)["height"], rel=2e-6), code


def test_hidden_cameras_are_told_from_others(gltf):
    scene = gltf(
        f"""{HEADER}
        def Camera "Seen" {{}}
        def Camera "Off" {{ token visibility = "invisible" }}
        def Xform "Rig" {{ token visibility = "invisible"
            def Camera "Below" {{}}
        }}
        def Camera "Comes" {{ token visibility.timeSamples = {{ 1: "invisible", 4: "inherited" }} }}
        def Camera "Never" {{ token visibility.timeSamples = {{ 1: "invisible", 4: "invisible" }} }}
        """
    )
    hidden = {path for path in scene.by_path if scene.node(path)["extras"].get("usdCamera", {}).get("hidden")}
    assert hidden == {"/Off", "/Rig/Below", "/Never"}
    assert all("hidden" not in scene.node(path)["extras"]["usdCamera"] for path in ("/Seen", "/Comes"))
