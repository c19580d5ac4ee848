"""Cameras' shutters, and the keys that motion within them needs, against USD's own evaluation."""

import numpy as np
import pytest
from conftest import ROOT, Gltf, local_matrix
from pxr import Usd, UsdGeom
from usd_gltf.stage import Frames
from usd_gltf.transforms import slerp

HEADER = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 4
    timeCodesPerSecond = 24
    metersPerUnit = 1
    upAxis = "Y"
)
"""
SHUTTERS = [(-0.25, 0.25), (0, 0.5), (-0.6, 0.4), (-2.3, 0.1), (0.1, 1.5)]


def camera(opens=-0.25, closes=0.25):
    return f'def Camera "Cam" {{ double shutter:open = {opens}\n double shutter:close = {closes} }}\n'


def moving(ops: str, order: str, name="M", kind="Cube") -> str:
    return f'def {kind} "{name}" {{ {ops}\n uniform token[] xformOpOrder = [{order}] }}\n'


def turn(degrees: float, x: float) -> np.ndarray:
    """A matrix that turns about (1, 1, 1) and moves."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    a, b = (1 - c) / 3, s / np.sqrt(3)
    return np.array([[c + a, a - b, a + b, x], [a + b, c + a, a - b, 0], [a - b, a + b, c + a, 0], [0, 0, 0, 1]])


def turned(degrees: float, x: float) -> str:
    """The same as usda spells it."""
    return str(tuple(tuple(map(float, row)) for row in turn(degrees, x).T))


MOTIONS = {
    "linear": moving("double3 xformOp:translate.timeSamples = { 0: (0, 0, 0), 5: (10, 5, 0) }", '"xformOp:translate"'),
    "only within the frames": moving(
        "double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 4: (3, 0, 0) }", '"xformOp:translate"'
    ),
    "samples between frames": moving(
        "double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (0, 0, 0), 2.1: (3, 0, 0), 2.25: (4, 0, 0), 3: (0, 0, 0) }",
        '"xformOp:translate"',
    ),
    "before the first frame alone": moving(
        "double3 xformOp:translate.timeSamples = { -2: (5, 0, 0), 0.9: (0, 0, 0) }", '"xformOp:translate"'
    ),
    "turns fast": moving("float xformOp:rotateZ.timeSamples = { 0: 0, 5: 1500 }", '"xformOp:rotateZ"'),
    "once around each frame": moving("float xformOp:rotateZ.timeSamples = { 0: 0, 5: 1800 }", '"xformOp:rotateZ"'),
    "propeller": moving("float xformOp:rotateZ.timeSamples = { 0: 0, 5: -3500 }", '"xformOp:rotateZ"'),
    "goes around": moving(
        "float xformOp:rotateY.timeSamples = { 0: 0, 5: 400 }\n double3 xformOp:translate = (7, 0, 0)",
        '"xformOp:rotateY", "xformOp:translate"',
    ),
    "three angles": moving(
        "float3 xformOp:rotateXYZ.timeSamples = { 0: (0, 0, 0), 2: (80, -40, 20), 5: (-90, 120, 700) }", '"xformOp:rotateXYZ"'
    ),
    "grows": moving("float3 xformOp:scale.timeSamples = { 0: (1, 1, 1), 2.5: (3, 2, 1), 5: (1, 1, 4) }", '"xformOp:scale"'),
    "shears": moving(
        "float3 xformOp:scale.timeSamples = { 0: (1, 1, 1), 5: (6, 1, 1) }\n float xformOp:rotateZ = 30",
        '"xformOp:scale", "xformOp:rotateZ"',
    ),
}


def at(gltf: Gltf, path: str, frame: float) -> np.ndarray:
    """The world matrix that glTF's interpolation gives."""
    usd = gltf.json["asset"]["extras"]["usd"]
    seconds = (frame - usd.get("zeroTimeCode", usd["startTimeCode"])) / usd["timeCodesPerSecond"]
    index, matrix = gltf.by_path[path], np.eye(4)
    while index is not None:
        node = dict(gltf.nodes[index])
        for key, (times, values) in gltf._channels(index).items():
            times, values = times.astype(float), values.astype(float)
            after = int(np.clip(np.searchsorted(times, seconds), 1, len(times) - 1))
            share = np.clip((seconds - times[after - 1]) / (times[after] - times[after - 1]), 0, 1)
            pair = values[after - 1 : after], values[after : after + 1]
            mixed = slerp(*pair, np.array([[share]])) if key == "rotation" else pair[0] + share * (pair[1] - pair[0])
            node[key] = mixed[0].tolist()
        matrix = local_matrix(node) @ matrix
        index = gltf.parents.get(index)
    return matrix


def in_usd(text: str, path: str, frame: float, interpolation=Usd.InterpolationTypeLinear) -> np.ndarray:
    stage = Usd.Stage.CreateInMemory()
    stage.SetInterpolationType(interpolation)
    stage.GetRootLayer().ImportFromString(text.replace("}", "\n}"))
    return np.array(UsdGeom.XformCache(frame).GetLocalToWorldTransform(stage.GetPrimAtPath(path))).T


# -- the camera ------------------------------------------------------------------------------------


def shutter(gltf, lines):
    return gltf(f'{HEADER} def Camera "Cam" {{ {lines} }}').node("/Cam")["extras"]["usdCamera"].get("shutter")


def test_a_shutter_is_carried_as_it_is_authored(gltf):
    assert shutter(gltf, "double shutter:open = -0.25\n double shutter:close = 0.5") == [-0.25, 0.5]
    assert shutter(gltf, "double shutter:close = 0.5") == [0, 0.5]
    assert shutter(gltf, "double shutter:open = -0.5") == [-0.5, 0]
    assert shutter(gltf, "") is None


def test_a_shutter_that_never_opens_is_nothing_to_speak_of(export):
    result = export(HEADER + camera(0.1, 0.1) + MOTIONS["linear"])
    assert "shutter" not in Gltf(result.path).node("/Cam")["extras"]["usdCamera"]
    assert "shutter" not in result.said()
    assert len(Gltf(result.path).channels("/M")["translation"][0]) == 4


@pytest.mark.parametrize(("opens", "closes"), [(0.25, -0.25), ("nan", 0.5), (0, "inf"), ("-inf", "inf"), (0, 1e12)])
def test_a_shutter_that_is_no_interval_is_reported(export, opens, closes):
    result = export(HEADER + camera(opens, closes) + MOTIONS["linear"])
    assert "shutter" not in Gltf(result.path).node("/Cam")["extras"]["usdCamera"]
    assert "camera shutter is no interval" in result.warned("cameras")
    assert len(Gltf(result.path).channels("/M")["translation"][0]) == 4


def test_of_a_shutter_over_time_the_first_frames_is_used(export):
    lines = "double shutter:open = 0\n double shutter:close.timeSamples = { 1: 0.25, 4: 0.5 }"
    result = export(f'{HEADER} def Camera "Cam" {{ {lines} }}')
    assert Gltf(result.path).node("/Cam")["extras"]["usdCamera"]["shutter"] == [0, 0.25]
    assert result.warned("cameras") == {"animated camera shutter:close"}


# -- motion ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("opening", SHUTTERS)
@pytest.mark.parametrize("motion", MOTIONS)
def test_things_are_where_usd_has_them_when_shutters_open_and_close(gltf, motion, opening):
    text = HEADER + camera(*opening) + MOTIONS[motion]
    scene = gltf(text)
    for frame in (1, 2, 4):
        for code in (frame, *(frame + end for end in opening)):
            assert at(scene, "/M", code) == pytest.approx(in_usd(text, "/M", code), abs=2e-5), code
    assert scene.world("/M") == pytest.approx(in_usd(text, "/M", 1), abs=1e-5), "at rest it is where the first frame has it"
    for times, _ in scene.channels("/M").values():
        assert times[0] >= 0 and (np.diff(times) > 0).all()


@pytest.mark.parametrize("opening", SHUTTERS)
@pytest.mark.parametrize("motion", ["linear", "turns fast", "once around each frame", "propeller"])
def test_motion_that_is_even_is_right_at_all_times_in_between(gltf, motion, opening):
    text = HEADER + camera(*opening) + MOTIONS[motion]
    scene = gltf(text)
    for code in np.linspace(opening[0], opening[1], 13) + 2:
        assert at(scene, "/M", code) == pytest.approx(in_usd(text, "/M", code), abs=2e-5), code


@pytest.mark.parametrize("motion", ["only within the frames", "linear"])
def test_even_motion_takes_no_more_keys(gltf, motion):
    """But for one on either side, where it goes on there."""
    plain, blurred = (gltf(HEADER + eye + MOTIONS[motion]) for eye in ('def Camera "Cam" {}\n', camera()))
    (times, values), (blurred_times, blurred_values) = (s.channels("/M")["translation"] for s in (plain, blurred))
    inner = slice(1, -1) if motion == "linear" else slice(None)
    assert blurred_times[inner] == pytest.approx(times + 1 / 24)
    assert (blurred_values[inner] == values).all()
    assert plain.json["asset"]["extras"]["usd"].get("zeroTimeCode") is None
    assert blurred.json["asset"]["extras"]["usd"]["zeroTimeCode"] == 0
    assert (blurred.json["asset"]["extras"]["usd"]["startTimeCode"], plain.json["asset"]["extras"]["usd"]["endTimeCode"]) == (1, 4)


def test_without_an_open_shutter_the_clock_begins_with_the_first_frame(gltf):
    scene = gltf(HEADER + camera(0, 0.5) + MOTIONS["linear"])
    assert "zeroTimeCode" not in scene.json["asset"]["extras"]["usd"]
    assert scene.channels("/M")["translation"][0] == pytest.approx(np.array([0, 1, 2, 3, 3.5]) / 24)


def test_a_still_frame_of_a_moving_scene_moves_while_the_shutter_is_open(gltf):
    text = HEADER + camera() + MOTIONS["turns fast"]
    scene = gltf(text, "--frames", "2")
    usd = scene.json["asset"]["extras"]["usd"]
    assert (usd["startTimeCode"], usd["endTimeCode"], usd["zeroTimeCode"]) == (2, 2, 1)
    assert scene.channels("/M")["rotation"][0] == pytest.approx(np.array([0.75, 1, 1.25]) / 24)
    for code in (1.75, 2, 2.25):
        assert at(scene, "/M", code) == pytest.approx(in_usd(text, "/M", code), abs=1e-5)
    assert scene.world("/M") == pytest.approx(in_usd(text, "/M", 2), abs=1e-5)


def test_sampled_matrices_turn_between_frames_and_do_not_shrink(gltf):
    """A light that is a sphere at every frame is one in between."""
    samples = ", ".join(f"{code}: {turned(50 * code, 2 * code)}" for code in range(0, 6))
    text = HEADER + camera() + moving(f"matrix4d xformOp:transform.timeSamples = {{ {samples} }}",
                                      '"xformOp:transform"', kind="SphereLight")  # fmt: skip
    scene = gltf(text)
    assert set(scene.channels("/M")) == {"translation", "rotation"}
    assert scene.parents[scene.by_path["/M"]] == scene.json["scenes"][0]["nodes"][0]
    assert scene.channels("/M")["rotation"][0] == pytest.approx(np.array([0.75, 1, 2, 3, 4, 4.25]) / 24)
    for code in np.arange(0.75, 4.26, 0.25):
        linear = at(scene, "/M", code)[:3, :3]
        assert linear @ linear.T == pytest.approx(np.eye(3), abs=1e-6)
        assert np.trace(linear) == pytest.approx(1 + 2 * np.cos(np.radians(50 * code)), abs=1e-5)


def test_sampled_matrices_between_frames_are_kept(gltf):
    samples = ", ".join(f"{code}: {turned(code**3, code**2)}" for code in (0, 0.75, 1, 1.25, 2, 3, 4))
    ops = f"matrix4d xformOp:transform.timeSamples = {{ {samples} }}"
    text = HEADER + camera() + moving(ops, '"xformOp:transform"')
    scene = gltf(text)
    for code in (0.75, 1, 1.25, 2, 3, 4, 4.25):
        assert at(scene, "/M", code) == pytest.approx(in_usd(text, "/M", code), abs=1e-5)


def matrices(samples: dict[float, float | None]) -> str:
    """A sampled matrix op that turns and moves by these; None is a value block."""
    spelled = ", ".join(f"{code}: {x if x is None else turned(10 * x, x)}" for code, x in samples.items())
    return f"matrix4d xformOp:transform.timeSamples = {{ {spelled} }}\n"


JUMPS = {
    "translate": ("double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 2: (8, 0, 0) }", '"xformOp:translate"'),
    "transform": (matrices({1: 0, 2: 8}), '"xformOp:transform"'),
    "transform between frames": (matrices({0.5: 3, 1: 0, 1.75: 4, 2: 8, 3.6: 1}), '"xformOp:transform"'),
    "two ops": (
        matrices({1: 0, 2: 8}) + "float xformOp:rotateY.timeSamples = { 1: 0, 3: 50 }",
        '"xformOp:transform", "xformOp:rotateY", "!invert!xformOp:transform"',
    ),
}
"""What jumps in a stage of held interpolation, which is no part of a file."""
HOLDS = {
    "a matrix before a value block": (matrices({1: 4, 2: None, 3: 8}), '"xformOp:transform"'),
    "a matrix before a value block, and its inverse": (
        matrices({1: 4, 2: None, 3: 8}) + "double3 xformOp:translate = (1, 2, 3)",
        '"xformOp:transform", "xformOp:translate", "!invert!xformOp:transform"',
    ),
    "a held matrix beside what goes on": (
        matrices({1: 4, 2: None, 3: 8}) + "double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 4: (6, 0, 0) }",
        '"xformOp:translate", "xformOp:transform"',
    ),
    "a held spline beside a matrix that stands in between": (
        matrices({0: 0, 3: 0, 4: 8}) + "double xformOp:translateX.spline = {\n 1: 0; post held,\n 2: 8; post held,\n}",
        '"xformOp:translateX", "xformOp:transform"',
    ),
}
"""What stays where it is in a stage of any interpolation, from the first frame at least until the second."""


@pytest.fixture
def held_stages(monkeypatch):
    """Stages are opened with held interpolation."""
    from usd_gltf import export as module

    def open_held(*arguments):
        stage = module.open_stage.opened(*arguments)
        stage.SetInterpolationType(Usd.InterpolationTypeHeld)
        return stage

    open_held.opened = module.open_stage
    monkeypatch.setattr(module, "open_stage", open_held)


@pytest.mark.parametrize("jump", JUMPS)
def test_what_is_held_is_not_blurred_while_a_shutter_is_open_after_the_frame(gltf, held_stages, jump):
    """It jumps while the shutter is closed: keys are linear, and the ramp of the jump is from closing to the next frame."""
    text = HEADER + camera(0, 0.5) + moving(*JUMPS[jump])
    scene = gltf(text)
    for code in np.add.outer([1, 2, 3, 4], [0, 0.125, 0.25, 0.375, 0.5]).ravel():
        expected = in_usd(text, "/M", code, Usd.InterpolationTypeHeld)
        assert at(scene, "/M", code) == pytest.approx(expected, abs=2e-5), code


@pytest.mark.parametrize("opening", SHUTTERS)
@pytest.mark.parametrize("jump", JUMPS)
def test_what_is_held_is_where_usd_has_it_when_shutters_open_and_close(gltf, held_stages, jump, opening):
    text = HEADER + camera(*opening) + moving(*JUMPS[jump])
    scene = gltf(text)
    for frame in (1, 2, 4):
        for code in (frame, *(frame + end for end in opening)):
            expected = in_usd(text, "/M", code, Usd.InterpolationTypeHeld)
            assert at(scene, "/M", code) == pytest.approx(expected, abs=2e-5), code


@pytest.mark.parametrize("hold", HOLDS)
def test_sampled_matrices_that_usd_holds_are_held(gltf, hold):
    text = HEADER + camera(0, 0.5) + moving(*HOLDS[hold])
    scene = gltf(text)
    for code in np.add.outer([1, 2, 3], [0, 0.25, 0.5]).ravel()[:-2]:
        assert at(scene, "/M", code) == pytest.approx(in_usd(text, "/M", code), abs=2e-5), code


def test_ops_beside_a_sampled_matrix_go_as_usd_has_them(gltf):
    """A lamp that spins a turn and more each frame on an arm that is sampled as matrices."""
    ops = matrices({code: 2 * code for code in range(0, 6)}) + "float xformOp:rotateZ.timeSamples = { 0: 0, 5: 2500 }"
    scene = gltf(HEADER + camera() + moving(ops, '"xformOp:transform", "xformOp:rotateZ"'))
    for code in np.add.outer([1, 2, 3, 4], [-0.25, 0, 0.25]).ravel():
        angle, spin = np.radians(500 * code), np.eye(4)
        spin[:2, :2] = [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
        assert at(scene, "/M", code) == pytest.approx(turn(20 * code, 2 * code) @ spin, abs=2e-5), code


def test_a_sampled_pivot_and_its_inverse_go_together(gltf):
    ops = matrices({code: 2 * code for code in range(0, 6)}) + "float xformOp:rotateZ = 90"
    scene = gltf(HEADER + camera() + moving(ops, '"xformOp:transform", "xformOp:rotateZ", "!invert!xformOp:transform"'))
    quarter = np.array([[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    for code in np.add.outer([1, 2, 3, 4], [-0.25, 0, 0.25]).ravel():
        pivot = turn(20 * code, 2 * code)
        assert at(scene, "/M", code) == pytest.approx(pivot @ quarter @ np.linalg.inv(pivot), abs=2e-5), code


def test_instances_move_within_the_shutter(gltf):
    text = """def PointInstancer "I" {
        rel prototypes = [</I/P>]
        int[] protoIndices = [0, 0]
        point3f[] positions.timeSamples = { 1: [(0, 0, 0), (5, 0, 0)], 2: [(0, 2, 0), (5, 0, 0)] }
        vector3f[] velocities.timeSamples = { 1: [(0, 48, 0), (0, 0, 0)], 2: [(0, -24, 0), (0, 0, 0)] }
        def Cube "P" {}
    }"""
    scene = gltf(HEADER + camera() + text, "--frames", "1-2")
    heights = {0.75: -0.5, 1: 0, 1.25: 0.5, 1.75: 1.5, 2: 2, 2.25: 1.75}
    assert {code: at(scene, "/I[0]", code)[1, 3] for code in heights} == pytest.approx(heights, abs=1e-5)
    assert scene.channels("/I[1]") == {}


def test_rigidly_skinned_meshes_move_within_the_shutter(gltf):
    from test_skinning import POLYGONS, figure, mesh

    rigid = ' int[] primvars:skel:jointIndices = [1] (interpolation = "constant")'
    rigid += '\n float[] primvars:skel:jointWeights = [1] (interpolation = "constant")'
    text = HEADER + camera() + figure(mesh(rigid, geometry=POLYGONS))
    scene = gltf(text)
    frames = gltf(text.replace("shutter", "unread"))
    for code in (1, 2):
        assert at(scene, "/Figure/M", code) == pytest.approx(at(frames, "/Figure/M", code), abs=1e-6)
    assert at(scene, "/Figure/M", 0.75) == pytest.approx(at(scene, "/Figure/M", 1), abs=1e-6)
    assert np.abs(at(scene, "/Figure/M", 1.25) - at(scene, "/Figure/M", 1)).max() > 0.05


# -- time codes ------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", [0, 1, 1001, 86_400, -50])
@pytest.mark.parametrize("count", [1, 2, 24, 20_000])
@pytest.mark.parametrize("shutters", [(), ((-0.25, 0.25),), ((-0.6, 0.4), (-0.5, 0.5)), ((-15.3, 2.0005),), ((0.2, 0.3),)])
def test_time_codes_ascend_and_hold_all_frames_and_shutters(first, count, shutters):
    numbers = tuple(float(first + at) for at in range(count))
    frames = Frames(numbers, 24.0, shutters)
    codes, seconds = np.array(frames.codes), frames.seconds.astype(np.float32)
    assert seconds[0] >= 0 and (np.diff(seconds) > 0).all()
    assert set(numbers) <= set(frames.codes) and codes[frames.rest] == first
    assert tuple(codes[frames.is_number]) == numbers
    assert (first - frames.zero) % 1 == 0
    for shutter in shutters:
        for end in shutter:
            wanted = numbers + np.float64(end)
            nearest = np.abs(codes[np.clip(np.searchsorted(codes, wanted)[:, None] + [-1, 0], 0, len(codes) - 1)] - wanted[:, None])
            assert nearest.min(axis=1).max() < 0.03 if count > 1000 else nearest.min(axis=1).max() < 1.001e-3


def test_the_scene_of_spinning_lamps_is_carried_whole(export):
    result = export(ROOT / "scenes/spinning_lamps/spinning_lamps.usda")
    scene, root = Gltf(result.path), "/World/"
    assert result.warned() == set()
    assert scene.node(f"{root}Camera")["extras"]["usdCamera"]["shutter"] == [-0.25, 0.25]
    assert scene.json["asset"]["extras"]["usd"]["zeroTimeCode"] == 1000
    values = scene.lux(f"{root}Balloon")["values"]
    codes, nits = 1000 + np.array(values["times"]) * 24, np.array(values["rgb"])
    for code in (1000.75, 1001, 1008.25, 1016, 1024):
        # Its radius, and radiance over the area in square centimetres, the stage's unit.
        radius = 3 + 37 * (code - 1000) / 24
        shown = scene.lux(f"{root}Balloon")["radius"] * np.cbrt(np.linalg.det(at(scene, f"{root}Balloon", code)[:3, :3]))
        assert shown == pytest.approx(radius / 100, rel=1e-5)
        expected = 12000 * np.array([1, 0.3, 0.35]) / (4 * np.pi * radius**2)
        assert [np.interp(code, codes, part) for part in nits.T] == pytest.approx(expected, rel=1e-3)
        angle = np.radians((code - 1000) * 40)
        bulb = at(scene, f"{root}Wheel/Bulbs[0]", code)[:3, 3]
        # Z up becomes Y up.
        assert bulb == pytest.approx([np.cos(angle) - 0.4, 1.5 - np.sin(angle), 0], abs=1e-4)
