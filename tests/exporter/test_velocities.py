"""Points and instances that move by their velocities, against usd-core's own computation at every sampled time."""

import numpy as np
import pytest
from conftest import HEADER, Gltf, local_matrix
from pxr import Usd, UsdGeom
from usd_gltf.transforms import slerp

START = 224
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
FACES = """
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
    uniform token subdivisionScheme = "none"
"""
TURNS = np.stack([-CORNERS[:, 2], CORNERS[:, 0] ** 2, CORNERS[:, 0]], axis=1)
FALLS = np.tile([0, -9.81, 0], (8, 1))
SHUTTER = 'def Camera "C" { double shutter:open = -0.4\n double shutter:close = 0.4 }\n'


def shot(end=START, per_second=24):
    times = f"startTimeCode = {START}\n endTimeCode = {end}\n timeCodesPerSecond = {per_second}\n upAxis"
    return HEADER.replace("upAxis", times) + SHUTTER


def rows(array):
    return "[" + ", ".join(f"({', '.join(f'{number:.9g}' for number in row)})" for row in array) + "]"


def at(name, array, code=START):
    """An attribute of vectors with one time sample, or a default."""
    return f"{name} = {rows(array)}\n" if code is None else f"{name}.timeSamples = {{ {code}: {rows(array)} }}\n"


def cube(*attributes, more=FACES):
    return f'def Mesh "M" {{ {more} {" ".join(attributes)} }}'


def sampled_codes(end=START):
    return [frame + step for frame in range(START, end + 1) for step in (-0.4, -0.25, 0, 0.25, 0.4)]


def shown(scene, path, code, per_second=24):
    zero = scene.json["asset"]["extras"]["usd"].get("zeroTimeCode", START)
    seconds = (code - zero) / per_second
    world = scene.world(path, seconds)
    return scene.deformed(path, seconds) @ world[:3, :3].T + world[:3, 3]


def corners_of(points):
    return np.unique(np.round(points, 4) + 0.0, axis=0)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 24.0, 1e3])
@pytest.mark.parametrize("accelerations", [None, 100 * FALLS])
@pytest.mark.parametrize(("end", "per_second"), [(START, 24), (START + 3, 24), (START, 1), (START, 1000)])
def test_points_are_where_usd_puts_them_at_every_time(export, scale, accelerations, end, per_second):
    velocities = scale * TURNS
    extra = [] if accelerations is None else [at("vector3f[] accelerations", scale * accelerations)]
    mesh = cube(at("point3f[] points", CORNERS), at("vector3f[] velocities", velocities), *extra)
    result = export(shot(end, per_second) + mesh, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    stage = Usd.Stage.Open(str(result.path.with_name("scene.usda")))
    moving = UsdGeom.PointBased(stage.GetPrimAtPath("/M"))
    size = 0.0
    for code in sampled_codes(end):
        wanted = np.array(moving.ComputePointsAtTime(code, code), float)
        seconds = (code - START) / per_second
        closed = CORNERS + velocities * seconds + scale * (0 if accelerations is None else accelerations) * seconds**2 / 2
        size = max(size, np.abs(closed).max())
        assert wanted == pytest.approx(closed, rel=1e-5, abs=1e-5 * size)
        found = shown(scene, "/M", code, per_second)
        # Keys that linear interpolation shows to 1e-6 of the largest coordinate are left out.
        far = np.abs(found[:, None] - wanted).max(axis=2)
        assert max(far.min(axis=0).max(), far.min(axis=1).max()) < 2e-5 * size
    moved = np.abs(velocities).max() * 0.4 / per_second > 1e-5
    assert ("targets" in scene.primitives("/M")[0]) == bool(moved)


def test_a_cage_moves_by_its_velocities_before_it_is_refined(gltf):
    mesh = at("point3f[] points", CORNERS) + at("vector3f[] velocities", 24 * TURNS)
    scene = gltf(shot() + cube(mesh, more=FACES.replace('"none"', '"catmullClark"')))
    for step in (-0.4, 0.25, 0.4):
        wanted = at("point3f[] points", CORNERS + step * TURNS)
        still = gltf(shot() + cube(wanted, more=FACES.replace('"none"', '"catmullClark"')), out="still.glb")
        far = np.abs(shown(scene, "/M", START + step)[:, None] - shown(still, "/M", START)).max(axis=2)
        assert max(far.min(axis=0).max(), far.min(axis=1).max()) < 2e-5


def test_points_with_further_samples_are_linear_whatever_the_velocities(gltf):
    points = f"point3f[] points.timeSamples = {{ {START}: {rows(CORNERS)}, {START + 1}: {rows(2 * CORNERS)} }}\n"
    velocities = f"vector3f[] velocities.timeSamples = {{ {START}: {rows(TURNS)}, {START + 1}: {rows(TURNS)} }}\n"
    with_, without = (gltf(shot() + cube(points, more), out=f"{name}.glb") for name, more in (("a", velocities), ("b", "")))
    assert with_.buffer == without.buffer
    assert shown(with_, "/M", START + 0.4).max() == pytest.approx(1.4)


@pytest.mark.parametrize(("points", "velocities", "why"), [
    (at("point3f[] points", CORNERS), at("vector3f[] velocities", TURNS, 223), "they are sampled at time code 223, points at time code 224"),
    (at("point3f[] points", CORNERS), at("vector3f[] velocities", TURNS, None), "they are sampled at no time code, points at time code 224"),
    (at("point3f[] points", CORNERS, None), at("vector3f[] velocities", TURNS, 224), "they are sampled at time code 224, points at no time code"),
    (at("point3f[] points", CORNERS, None), at("vector3f[] velocities", TURNS, None), "they are sampled at no time code, points at no time code"),
    (at("point3f[] points", CORNERS), at("vector3f[] velocities", TURNS[:5]), "they are 5, but points are 8"),
])  # fmt: skip
def test_velocities_that_usd_does_not_use_are_told_of(export, points, velocities, why):
    result = export(shot() + cube(points, velocities))
    scene = Gltf(result.path)
    stage = Usd.Stage.Open(str(result.path.with_name("scene.usda")))
    moving = UsdGeom.PointBased(stage.GetPrimAtPath("/M"))
    assert np.array(moving.ComputePointsAtTime(START + 0.4, START + 0.4)) == pytest.approx(CORNERS)
    assert result.warned("animation") == {"velocities without effect"} and why in result.said()
    assert "targets" not in scene.primitives("/M")[0]


@pytest.mark.parametrize("velocities", [at("vector3f[] velocities", 0 * TURNS), "vector3f[] velocities = []\n", ""])
def test_a_mesh_that_rests_is_as_one_without_velocities(export, velocities):
    result = export(shot() + cube(at("point3f[] points", CORNERS), velocities), "--strict")
    still = export(shot() + cube(at("point3f[] points", CORNERS)), "--strict", out="still.glb")
    assert result.code == still.code == 0
    found, wanted = Gltf(result.path), Gltf(still.path)
    for scene in (found, wanted):
        del scene.json["asset"]["extras"]["usd"]["sourceHash"]
    assert (found.json, found.buffer) == (wanted.json, wanted.buffer)


def test_what_emits_light_says_that_its_velocities_are_lost(export):
    light = '(prepend apiSchemas = ["MeshLightAPI"])'
    mesh = cube(at("point3f[] points", CORNERS), at("vector3f[] velocities", TURNS)).replace('"M"', f'"M" {light}')
    result = export(shot() + mesh)
    assert "animated points (velocities)" in result.said() or "targets" in Gltf(result.path).primitives("/M")[0]


PLACES = np.array([[0, 0, 0], [3, 0, 1], [0, 5, -2]], float)
SPEEDS = np.array([[24, 0, 0], [0, -48, 12], [0, 0, 0]], float)
SPINS = np.array([[0, 360, 0], [90, 0, 0], [0, 0, 0]], float)


def instancer(*attributes):
    return f"""def PointInstancer "I" {{
        rel prototypes = </I/P>
        int[] protoIndices = [0, 0, 0]
        {" ".join(attributes)}
        def Mesh "P" {{ {FACES} {at("point3f[] points", CORNERS, None)} }}
    }}"""


@pytest.mark.parametrize("attributes", [
    [at("point3f[] positions", PLACES), at("vector3f[] velocities", SPEEDS)],
    [at("point3f[] positions", PLACES), at("vector3f[] velocities", SPEEDS), at("vector3f[] accelerations", 1000 * SPEEDS[:, [1, 2, 0]])],
    [at("point3f[] positions", PLACES), f"quath[] orientations.timeSamples = {{ {START}: [(1, 0, 0, 0), (0.6, 0.8, 0, 0), (1, 0, 0, 0)] }}\n",
     at("vector3f[] angularVelocities", 10 * SPINS)],
    [at("point3f[] positions", PLACES), f"quatf[] orientationsf.timeSamples = {{ {START}: [(1, 0, 0, 0), (0.6, 0.8, 0, 0), (1, 0, 0, 0)] }}\n",
     at("vector3f[] angularVelocities", 10 * SPINS), at("vector3f[] velocities", SPEEDS)],
])  # fmt: skip
@pytest.mark.parametrize("end", [START, START + 2])
def test_instances_are_where_usd_puts_them_at_every_time(export, attributes, end):
    result = export(shot(end) + instancer(*attributes), "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    stage = Usd.Stage.Open(str(result.path.with_name("scene.usda")))
    placed = UsdGeom.PointInstancer(stage.GetPrimAtPath("/I"))
    zero = scene.json["asset"]["extras"]["usd"]["zeroTimeCode"]
    seen = []
    for code in sampled_codes(end):
        wanted = np.array(placed.ComputeInstanceTransformsAtTime(code, code, placed.ExcludeProtoXform, placed.IgnoreMask))
        for number in range(3):
            found = interpolated(scene, f"/I[{number}]", (code - zero) / 24)
            assert found == pytest.approx(wanted[number].T, abs=1e-4)
        seen.append(wanted[1])
    assert np.ptp(seen, axis=0).max() > 0.1
    assert "rotation" not in scene.node("/I[2]") and not scene.channels("/I[2]")


def interpolated(scene, path, seconds):
    """A node's own matrix at a time: its tracks linear, rotations slerped."""
    node = dict(scene.node(path))
    for key, (times, values) in scene.channels(path).items():
        node[key] = [np.interp(seconds, times, column) for column in values.T]
        if key == "rotation" and times[0] < seconds < times[-1]:
            after = np.searchsorted(times, seconds)
            share = (seconds - times[after - 1]) / (times[after] - times[after - 1])
            node[key] = slerp(values[None, after - 1], values[None, after], np.array([[share]]))[0].tolist()
    return local_matrix(node)


def test_velocities_of_instances_that_usd_does_not_use_are_told_of(export):
    """As arnold-usd's test 1868 has them: positions without a time, velocities with one."""
    result = export(shot() + instancer(at("point3f[] positions", PLACES, None), at("vector3f[] velocities", SPEEDS)))
    assert result.warned("animation") == {"velocities without effect"}
    assert "positions at no time code" in result.said()
    assert not Gltf(result.path).json.get("animations")


def test_no_time_but_one_is_sampled_without_a_shutter(export):
    mesh = cube(at("point3f[] points", CORNERS), at("vector3f[] velocities", TURNS, 223))
    result = export(shot().replace(SHUTTER, "") + mesh, "--strict")
    assert result.code == 0, result.err
    assert not Gltf(result.path).json.get("animations")


FLAT = np.repeat([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], 4, axis=0).astype(float)
ROUND = CORNERS / np.sqrt(3)
INDEX = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]


def normals(kind, name, first, last):
    return (f'normal3f[] {name} (interpolation = "{kind}")\n'
            f"normal3f[] {name}.timeSamples = {{ {START}: {rows(first)}, {START + 4}: {rows(last)} }}\n")  # fmt: skip


@pytest.mark.parametrize("points", [
    at("point3f[] points", CORNERS, None),
    # What moves by less than single precision tells.
    f"point3f[] points.timeSamples = {{ {START}: {rows(CORNERS)}, {START + 4}: {rows(CORNERS * 1.0000002)} }}\n",
])  # fmt: skip
@pytest.mark.parametrize("name", ["normals", "primvars:normals"])
@pytest.mark.parametrize(("kind", "first", "last"), [("faceVarying", FLAT, ROUND[INDEX]), ("vertex", ROUND, -ROUND)])
def test_normals_of_polygons_that_rest_turn_as_authored(export, name, kind, first, last, points):
    mesh = cube(points, normals(kind, name, first, last))
    result = export(shot(START + 4).replace(SHUTTER, "") + mesh, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    spread = (lambda array: array) if kind == "faceVarying" else (lambda array: array[INDEX])
    for step in range(5):
        # Linear between samples, as UsdGeom has it; compared where the corner is and by what it has there.
        wanted = spread(first) + step / 4 * (spread(last) - spread(first))
        length = np.linalg.norm(wanted, axis=1, keepdims=True)
        seconds = step / 24
        places, found = (scene.deformed("/M", seconds, key) for key in ("POSITION", "NORMAL"))
        found = found / np.maximum(np.linalg.norm(found, axis=1, keepdims=True), 1e-9)
        for corner, normal, size in zip(CORNERS[INDEX], wanted, length[:, 0], strict=True):
            if size > 0.1:
                here = found[np.abs(places - corner).max(axis=1) < 1e-5]
                assert np.abs(here - normal / size).max(axis=1).min() < 2e-3
        assert corners_of(places) == pytest.approx(corners_of(CORNERS))


@pytest.mark.parametrize("last", [FLAT, None])
def test_normals_that_are_the_same_do_not_turn(export, last):
    text = normals("faceVarying", "primvars:normals", FLAT, FLAT if last is None else last)
    scene = Gltf(export(shot(START + 4) + cube(at("point3f[] points", CORNERS, None), text), "--strict").path)
    assert "targets" not in scene.primitives("/M")[0]


@pytest.mark.parametrize("per_second", ["0", "-24"])
def test_without_seconds_nothing_moves_and_it_is_told(export, per_second):
    """usd-core divides by `timeCodesPerSecond`."""
    mesh = cube(at("point3f[] points", CORNERS), at("vector3f[] velocities", TURNS))
    placed = instancer(at("point3f[] positions", PLACES), at("vector3f[] velocities", SPEEDS), "float3[] scales = [(1, 2, 3), (1, 1, 1), (2, 2, 2)]\n",
                       "quath[] orientations = [(1, 0, 0, 0), (0.6, 0.8, 0, 0), (1, 0, 0, 0)]\n")  # fmt: skip
    result = export(shot(START + 1, per_second) + mesh + "\n" + placed)
    assert result.code == 0
    assert {"velocities without effect", "timeCodesPerSecond is not positive"} <= result.warned("animation")
    scene = Gltf(result.path)
    assert corners_of(shown(scene, "/M", START)) == pytest.approx(CORNERS) and "targets" not in scene.primitives("/M")[0]
    still = Gltf(export(shot(START + 1) + placed.replace("vector3f[] velocities", "custom vector3f[] unused"), out="still.glb").path)
    for number in range(3):
        path = f"/I[{number}]"
        assert scene.world(path) == pytest.approx(still.world(path), abs=1e-5) and not scene.channels(path)
