"""Meshes that deform, as morph targets, against what USD and UsdSkel say at every frame."""

import json
import re

import numpy as np
import pytest
from conftest import HEADER, Gltf
from pxr import Usd
from test_skinning import CAGE, POLYGONS, SHAPES, SKIN, WEIGHTS, baked, figure, mesh
from usd_gltf import deformation
from usd_gltf.deformation import needed_shapes

SHOT = HEADER.replace("upAxis", "startTimeCode = 1\n endTimeCode = 5\n upAxis")
CUBE = """
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
"""
CORNERS = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
SQUASHED = CORNERS * [1, 0.25, 1.5] + [0, 0.5, 0]
SHEARED = CORNERS + CORNERS[:, [1, 2, 0]] * [0.5, 0, 0]
ANGLE = CORNERS[:, 1] / 2
TWISTED = np.stack([
    CORNERS[:, 0] * np.cos(ANGLE) - CORNERS[:, 2] * np.sin(ANGLE), CORNERS[:, 1] * 1.5,
    CORNERS[:, 0] * np.sin(ANGLE) + CORNERS[:, 2] * np.cos(ANGLE),
], axis=1)  # fmt: skip
POLYGON = 'uniform token subdivisionScheme = "none"'


def array(rows):
    return "[" + ", ".join(f"({', '.join(f'{number:.7g}' for number in row)})" for row in rows) + "]"


def sampled(shapes, name="point3f[] points"):
    return f"{name}.timeSamples = {{ " + ", ".join(f"{code}: {array(rows)}" for code, rows in shapes.items()) + " }\n"


def cube(shapes, more=POLYGON, name="M", kind="Mesh"):
    return f'def {kind} "{name}" {{ {CUBE} {sampled(shapes)} {more} }}'


def seconds(code, first=1):
    return (code - first) / 24


def corners_of(found):
    """Sorted corner triples, for comparison whatever their order."""
    return sorted(tuple(sorted(map(tuple, (t.round(4) + 0.0).tolist()))) for t in found)


def same(scene, still, code, path="/M"):
    """Whether the vertices of a scene at a time are those of another one, exported at that frame alone. Neither which
    of them are welded nor the diagonals of bent quads are compared."""
    rows = []
    for found, time in ((scene, seconds(code)), (still, None)):
        world = found.world(path, time)
        points = (found.attribute(path, "POSITION") if time is None else found.deformed(path, time)) @ world[:3, :3].T + world[:3, 3]
        if "NORMAL" in found.primitives(path)[0]["attributes"]:
            normals = found.attribute(path, "NORMAL") if time is None else found.deformed(path, time, "NORMAL")
            # Positions count to 2e-5, normals to 2e-3.
            points = np.hstack([points, 0.01 * normals / np.linalg.norm(normals, axis=1, keepdims=True)])
        rows.append(points)
    far = np.abs(rows[0][:, None] - rows[1]).max(axis=2)
    assert max(far.min(axis=0).max(), far.min(axis=1).max()) < 2e-5


def test_sampled_points_are_targets_between_which_points_are_linear(export):
    result = export(SHOT + cube({1: CORNERS, 3: SQUASHED, 5: SHEARED}), "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    # Frames 2 and 4 are what linear interpolation gives.
    times, weights = scene.channels("/M")["weights"]
    assert times == pytest.approx([seconds(1), seconds(3), seconds(5)])
    assert weights.reshape(3, 2).tolist() == [[0, 0], [1, 0], [0, 1]]
    targets = scene.primitives("/M")[0]["targets"]
    assert [set(target) for target in targets] == [{"POSITION"}] * 2
    for target in targets:
        accessor, rows = scene.json["accessors"][target["POSITION"]], scene.accessor(target["POSITION"])
        assert accessor["min"] == rows.min(axis=0).tolist() and accessor["max"] == rows.max(axis=0).tolist()
        assert accessor["count"] == len(scene.attribute("/M", "POSITION"))
    found = scene.json["meshes"][scene.node("/M")["mesh"]]
    assert found["extras"]["targetNames"] == ["3", "5"]
    assert "weights" not in found
    stage = Usd.Stage.Open(str(result.path.with_name("scene.usda")))
    quads = np.array(stage.GetPrimAtPath("/M").GetAttribute("faceVertexIndices").Get()).reshape(-1, 4)
    for code in (1, 1.5, 2, 3, 4.25, 5, 9):
        points = np.array(stage.GetPrimAtPath("/M").GetAttribute("points").Get(code), float)
        cut = {tuple(sorted(map(tuple, (points[q[list(t)]].round(4) + 0.0).tolist()))) for q in quads
               for t in ((0, 1, 2), (0, 2, 3), (0, 1, 3), (1, 2, 3))}  # fmt: skip
        assert set(corners_of(scene.deformed_triangles("/M", seconds(code)))) <= cut
    assert result.report["counts"]["deforming meshes"] == 1
    assert result.report["counts"]["morph targets"] == 2


def test_shapes_that_come_again_have_one_target_and_the_first_has_none(gltf):
    scene = gltf(SHOT + cube({1: CORNERS, 2: SQUASHED, 3: CORNERS, 4: SQUASHED, 5: CORNERS}))
    times, weights = scene.channels("/M")["weights"]
    assert weights.tolist() == [0, 1, 0, 1, 0]
    assert len(times) == 5 and len(scene.primitives("/M")[0]["targets"]) == 1


def test_what_rests_before_and_after_has_no_keys_there(gltf):
    scene = gltf(SHOT.replace("= 5", "= 50") + cube({10: CORNERS, 12: SQUASHED}))
    times, weights = scene.channels("/M")["weights"]
    assert times == pytest.approx([seconds(10), seconds(12)])
    assert weights.tolist() == [0, 1]


def test_the_base_is_the_first_frame_though_a_shutter_opens_before_it(gltf):
    camera = 'def Camera "C" { double shutter:open = -0.5\n double shutter:close = 0.5 }\n'
    scene = gltf(SHOT + camera + cube({-3: SHEARED, 1: CORNERS, 2: SQUASHED, 5: CORNERS}))
    zero = scene.json["asset"]["extras"]["usd"]["zeroTimeCode"]
    wanted = {0.5: CORNERS + (SHEARED - CORNERS) / 8, 1: CORNERS, 1.5: (CORNERS + SQUASHED) / 2, 2: SQUASHED, 5: CORNERS}
    assert set(map(tuple, scene.attribute("/M", "POSITION").tolist())) == set(map(tuple, CORNERS.tolist()))
    for code, points in wanted.items():
        found = np.unique(scene.deformed("/M", seconds(code, zero)).round(4), axis=0)
        assert found == pytest.approx(np.unique(points.round(4), axis=0), abs=1e-4)


@pytest.mark.parametrize("more", [POLYGON, 'uniform token subdivisionScheme = "bilinear"', "", "uniform token orientation = \"leftHanded\""])
@pytest.mark.parametrize("complexity", ["low", "medium", "high"])
def test_a_cage_that_moves_is_refined_at_every_time(gltf, more, complexity):
    text = SHOT + cube({1: CORNERS, 2: SQUASHED, 3: SHEARED, 5: TWISTED + [0, 0, 3]}, more)
    # A bilinear mesh that is flat, and stays so, is not refined.
    codes = (4, 5) if "bilinear" in more else (1, 2, 3, 4, 5)
    still = {code: gltf(text, "--frames", f"{code}", "--complexity", complexity) for code in codes}
    scene = gltf(text, "--complexity", complexity)
    assert len(scene.primitives("/M")[0]["targets"]) >= 3
    for code, wanted in still.items():
        same(scene, wanted, code)


def test_creases_and_holes_stay_where_they_are(gltf):
    more = """int[] creaseIndices = [0, 1, 3, 2, 0]\n int[] creaseLengths = [5]\n float[] creaseSharpnesses = [2.5]
        int[] holeIndices = [3]\n int[] cornerIndices = [7]\n float[] cornerSharpnesses = [10]"""
    text = SHOT + cube({1: CORNERS, 5: TWISTED}, more)
    scene = gltf(text)
    for code in (1, 2, 5):
        same(scene, gltf(text, "--frames", f"{code}"), code)


def test_normals_over_time_split_the_corners_that_part_later(export):
    """At the first frame all normals of a point are alike, and would share a vertex."""
    radial = CORNERS / np.sqrt(3)
    index = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
    flat = np.repeat([[-1, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0], [0, 0, -1], [0, 0, 1]], 4, axis=0)
    normals = sampled({1: radial[index], 5: flat}, "normal3f[] primvars:normals").rstrip() + ' \n uniform token subdivisionScheme = "none"'
    text = SHOT + cube({1: CORNERS, 5: CORNERS * 2}, normals).replace(
        "normal3f[] primvars:normals.time", 'normal3f[] primvars:normals (interpolation = "faceVarying")\n normal3f[] primvars:normals.time'
    )
    result = export(text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    assert len(scene.attribute("/M", "POSITION")) == 24
    indices = scene.accessor(scene.primitives("/M")[0]["indices"])
    found = scene.deformed("/M", seconds(5), "NORMAL")[indices].reshape(-1, 3, 3)
    corners = scene.deformed_triangles("/M", seconds(5))
    facing = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    assert found == pytest.approx(np.repeat(facing[:, None], 3, axis=1), abs=1e-6)
    first = scene.attribute("/M", "NORMAL")[indices].reshape(-1, 3, 3)
    assert first == pytest.approx(scene.triangles("/M") / np.sqrt(3), abs=1e-6)


def test_uvs_and_parts_keep_their_vertices(gltf):
    material = """def Material "Red" { token outputs:surface.connect = </Red/S.outputs:surface>
        def Shader "S" { uniform token info:id = "UsdPreviewSurface"\n token outputs:surface } }
    """
    more = POLYGON + """
        def GeomSubset "Side" (prepend apiSchemas = ["MaterialBindingAPI"]) {
            uniform token elementType = "face"\n uniform token familyName = "materialBind"
            int[] indices = [1, 4]\n rel material:binding = </Red>
        }
        color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1), (1, 0, 1)] (interpolation = "uniform")"""
    scene = gltf(SHOT + material + cube({1: CORNERS, 5: SQUASHED}, more))
    assert len(scene.primitives("/M")) == 2
    for number, primitive in enumerate(scene.primitives("/M")):
        assert len(primitive["targets"]) == 1
        base = scene.attribute("/M", "POSITION", number)
        found = scene.deformed("/M", seconds(5), primitive=number)
        assert found == pytest.approx(base * [1, 0.25, 1.5] + [0, 0.5, 0], abs=1e-6)


TURNS = ["(1, 0, 0, 0), (0.9239, 0, 0.3827, 0)", "(0.7071, 0.7071, 0, 0), (0.8, 0, 0, 0.6)", "(0.7071, 0, 0.7071, 0), (0.8, 0.6, 0, 0)",
         "(0.8, 0, 0, -0.6), (1, 0, 0, 0)", "(1, 0, 0, 0), (0, 1, 0, 0)"]  # fmt: skip
NOD = "rotations.timeSamples = { " + ", ".join(f"{code}: [{turns}]" for code, turns in enumerate(TURNS, 1)) + " }"
POSED = 'double3 xformOp:translate = (5, 6, 7)\n float3 xformOp:scale = (1, 2, 3)\n uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]'


@pytest.mark.parametrize("body", [SKIN, SKIN + 'uniform token primvars:skel:skinningMethod = "dualQuaternion"', SKIN + POSED, "blended"])
def test_a_skinned_mesh_is_where_usdskel_bakes_it_at_every_frame(export, body):
    text = figure(mesh(body), NOD)
    if body == "blended":
        text = figure(SHAPES, NOD, WEIGHTS.replace("2: [1, 0]", "2: [0.5, 0.8], 3: [1, 0], 4: [0, 0], 5: [0, 0.6]"))
    result = export(text, "--frames", "1-5", "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    world, first = scene.world("/Figure/M"), baked(text, "/Figure/M", 1)[0]
    place = scene.attribute("/Figure/M", "POSITION") @ world[:3, :3].T + world[:3, 3]
    point = np.linalg.norm(first - place[:, None], axis=2).argmin(axis=1)
    assert set(point) == set(range(6))
    shapes = []
    for code in (1, 2, 3, 4, 5):
        wanted, normals = baked(text, "/Figure/M", code)
        found = scene.deformed("/Figure/M", seconds(code)) @ world[:3, :3].T + world[:3, 3]
        assert found == pytest.approx(wanted[point], abs=2e-5)
        shapes.append(found)
        if normals is not None:
            turned = scene.deformed("/Figure/M", seconds(code), "NORMAL")
            turned /= np.linalg.norm(turned, axis=1, keepdims=True)
            assert turned == pytest.approx((normals / np.linalg.norm(normals, axis=1, keepdims=True))[point], abs=1e-5)
    assert min(np.abs(a - b).max() for a, b in zip(shapes, shapes[1:], strict=False)) > 0.1


def test_a_skinned_cage_is_refined_as_it_is_posed(gltf):
    text = figure(mesh(SKIN, geometry=CAGE), NOD)
    scene = gltf(text, "--frames", "1-5")
    for code in range(1, 6):
        same(scene, gltf(text, "--frames", f"{code}"), code, "/Figure/M")


def test_points_that_move_below_the_skin(gltf):
    points = CAGE[CAGE.index("points = ") + 9 :].strip()
    moved = points.replace("(2, 0, 0)", "(2, 0, 1)").replace("(1, 1, 0)", "(1, 2, 0)")
    geometry = POLYGONS.replace(f"points = {points}", f"points.timeSamples = {{ 1: {points}, 5: {moved} }}")
    assert geometry != POLYGONS
    text = figure(mesh(SKIN, geometry=geometry), NOD)
    scene = gltf(text, "--frames", "1-5")
    for code in range(1, 6):
        same(scene, gltf(text, "--frames", f"{code}"), code, "/Figure/M")


@pytest.mark.parametrize("gprim", ["Sphere", "Cylinder", "Capsule"])
def test_gprims_that_grow(gltf, gprim):
    text = SHOT + f'def {gprim} "M" {{ double radius.timeSamples = {{ 1: 1, 5: 3 }} }}'
    scene = gltf(text)
    assert len(scene.primitives("/M")[0]["targets"]) == 1
    for code in (1, 2, 5):
        same(scene, gltf(text, "--frames", f"{code}"), code)


def test_a_cone_whose_slope_changes_has_its_normals(gltf):
    text = SHOT + 'def Cone "M" { double radius.timeSamples = { 1: 1, 5: 6 } }'
    scene = gltf(text)
    for code in (1, 2, 3, 5):
        same(scene, gltf(text, "--frames", f"{code}"), code)


def test_all_instances_deform_by_one_sampler(gltf):
    text = SHOT + """def PointInstancer "I" {
        point3f[] positions = [(0, 0, 0), (5, 0, 0), (9, 0, 0)]\n int[] protoIndices = [0, 0, 0]\n rel prototypes = </I/M>
        """ + cube({1: CORNERS, 5: SQUASHED}) + "}"  # fmt: skip
    scene = gltf(text)
    (animation,) = scene.json["animations"]
    assert len(animation["samplers"]) == 1
    assert len(animation["channels"]) == 3
    for number in range(3):
        found = scene.deformed_triangles(f"/I[{number}]", seconds(5))
        assert found.reshape(-1, 3).max(axis=0) == pytest.approx([[1, 0.75, 1.5], [6, 0.75, 1.5], [10, 0.75, 1.5]][number])


def test_a_mesh_that_moves_and_deforms_does_both(gltf):
    move = POLYGON + """\n double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 5: (4, 0, 0) }
        float3 xformOp:scale = (1, 2, 1)\n float3 xformOp:rotateXYZ.timeSamples = { 1: (0, 0, 0), 5: (0, 90, 0) }
        uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"]"""
    text = SHOT + cube({1: CORNERS, 5: SQUASHED}, move)
    scene = gltf(text)
    assert set(scene.channels("/M")) == {"translation", "rotation", "weights"}
    for code in (1, 5):
        same(scene, gltf(text, "--frames", f"{code}"), code)


GLOWING = """def Material "Glow" { token outputs:surface.connect = </Glow/S.outputs:surface>
    def Shader "S" { uniform token info:id = "UsdPreviewSurface"\n color3f inputs:emissiveColor = (2, 1, 0)\n token outputs:surface } }
"""


@pytest.mark.parametrize(
    ("text", "what", "why"),
    [
        (cube({1: CORNERS, 5: SQUASHED}).replace(
            "int[] faceVertexIndices = [0, 1, 3, 2", "int[] faceVertexIndices.timeSamples = { 1: [0, 1, 3, 2").replace(
            "1, 5, 7, 3]", "1, 5, 7, 3], 3: [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 2] }"),
         "animated points", "topology"),
        (cube({1: CORNERS, 5: CORNERS[:7]}), "animated points", "8 points at the first frame, 7 at frame 5"),
    ],
)  # fmt: skip
def test_what_has_no_carrier_keeps_the_shape_of_the_first_frame(export, text, what, why):
    result = export(SHOT + text)
    assert result.code == 0
    lines = [w for w in result.report["warnings"] if w["category"] == "animation" and w["what"] == what]
    assert [w["path"] for w in lines] == ["/M"]
    assert why in lines[0]["why"] and "the shape of frame 1 is used" in lines[0]["why"]
    scene = Gltf(result.path)
    assert "targets" not in scene.primitives("/M")[0]
    assert "animations" not in scene.json
    assert set(map(tuple, scene.attribute("/M", "POSITION").tolist())) == set(map(tuple, CORNERS.tolist()))


LIGHTS = {
    "a material that glows": GLOWING + cube({1: CORNERS, 5: SQUASHED}, POLYGON + "\n rel material:binding = </Glow>").replace(
        '"M" {', '"M" (prepend apiSchemas = ["MaterialBindingAPI"]) {'),
    "a mesh light": cube({1: CORNERS, 5: SQUASHED}).replace('"M" {', '"M" (prepend apiSchemas = ["MeshLightAPI"]) {'),
}  # fmt: skip


@pytest.mark.parametrize("light", LIGHTS)
def test_what_emits_light_deforms_like_any_other_mesh(export, gltf, light):
    text = SHOT + LIGHTS[light]
    result = export(text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    material = scene.json["materials"][scene.primitives("/M")[0]["material"]]
    assert any(material["emissiveFactor"])
    assert set(scene.channels("/M")) == {"weights"}
    for code in (1, 2, 5):
        same(scene, gltf(text, "--frames", f"{code}"), code)


def test_a_skinned_light_is_posed_at_every_frame(export, gltf):
    light = mesh(SKIN).replace('"SkelBindingAPI"]) { ', '"SkelBindingAPI", "MeshLightAPI"]) { ', 1)
    text = figure(light, NOD)
    result = export(text, "--frames", "1-5")
    assert not result.warned("animation")
    scene = Gltf(result.path)
    assert scene.primitives("/Figure/M")[0]["targets"]
    same(scene, gltf(text, "--frames", "4"), 4, "/Figure/M")


def test_a_normalized_light_has_its_power_whatever_its_shape(export):
    """Its radiance is that over its area at each frame, which scale, too, changes."""
    text = LIGHTS["a mesh light"].replace(POLYGON, POLYGON + """
        bool inputs:normalize = 1\n float inputs:intensity = 12
        float3 xformOp:scale.timeSamples = { 1: (1, 1, 1), 5: (2, 2, 2) }\n uniform token[] xformOpOrder = ["xformOp:scale"]""")
    result = export(SHOT + text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    values = scene.node("/M")["extras"]["usdLux"]["values"]
    times, nits = (np.array(values[name], float) for name in ("times", "rgb"))
    assert len(times) == 5
    for time, own in zip(times, nits.reshape(-1, 3), strict=True):
        found = scene.deformed_triangles("/M", time)
        cross = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
        assert own * np.linalg.norm(cross, axis=1).sum() / 2 == pytest.approx([12] * 3, rel=1e-4)


def test_too_many_bytes_keep_the_first_frame(export, monkeypatch):
    text = SHOT + cube({1: CORNERS, 2: SQUASHED, 3: SHEARED, 4: CORNERS * 3, 5: SQUASHED}) + "\n" + cube({1: CORNERS, 5: SHEARED}, name="N")
    monkeypatch.setattr(deformation, "MOST_BYTES", 300)
    result = export(text)
    assert result.code == 0
    lines = [w for w in result.report["warnings"] if w["what"] == "animated points"]
    assert [w["path"] for w in lines] == ["/M"] and "more than 300 bytes" in lines[0]["why"]
    scene = Gltf(result.path)
    assert "targets" not in scene.primitives("/M")[0] and "weights" not in scene.channels("/M")
    assert len(scene.primitives("/N")[0]["targets"]) == 1
    monkeypatch.setattr(deformation, "MOST_BYTES", 1 << 30)
    monkeypatch.setattr(deformation, "MOST_BYTES_OF_A_STAGE", 300)
    result = export(text, out="again.glb")
    assert [w["path"] for w in result.report["warnings"] if w["what"] == "animated points"] == ["/M"]
    assert len(Gltf(result.path).primitives("/N")[0]["targets"]) == 1


def test_keys_are_fewer_where_all_are_too_many_bytes(export, monkeypatch):
    angles = {code: code / 50 for code in range(1, 33)}
    text = SHOT.replace("= 5", "= 32") + cube(
        {code: CORNERS + [[0, 3e-3 * np.sin(angle * np.pi), 0]] for code, angle in angles.items()}
    )
    full = Gltf(export(text, "--strict").path)
    assert len(full.primitives("/M")[0]["targets"]) > 20
    monkeypatch.setattr(deformation, "MOST_BYTES", 2000)
    result = export(text, out="fewer.glb")
    assert result.warned("animation") == {"deformation with fewer keys"}
    scene = Gltf(result.path)
    targets = scene.primitives("/M")[0]["targets"]
    assert 1 < len(targets) * 8 * 12 < 2000
    for code in angles:
        assert scene.deformed("/M", seconds(code)) == pytest.approx(full.deformed("/M", seconds(code)), abs=1.1e-4)


def test_points_that_only_wander_where_no_face_is_change_no_byte(export):
    def written(last, out):
        result = export(SHOT + cube({1: np.vstack([CORNERS, [[0, 0, 9]]]), 5: np.vstack([CORNERS, [last]])}), "--strict", out=out)
        assert result.code == 0, result.err
        return re.sub(rb'"sourceHash":"\w+"', b"", result.path.read_bytes())

    assert written([0, 0, 9], "still.glb") == written([0, 9, 9], "loose.glb")


def test_points_that_are_no_numbers_later_stay(export):
    lost = SQUASHED.copy()
    lost[3] = np.nan
    result = export(SHOT + cube({1: CORNERS, 5: lost}))
    assert result.code == 0
    assert "points that are not finite over time" in result.warned("geometry")
    scene = Gltf(result.path)
    base, found = scene.attribute("/M", "POSITION"), scene.deformed("/M", seconds(5))
    stays = (base == CORNERS[3].astype(np.float32)).all(axis=1)
    assert found[stays] == pytest.approx(base[stays])
    assert found[~stays] == pytest.approx(base[~stays] * [1, 0.25, 1.5] + [0, 0.5, 0], abs=1e-6)


def test_a_pose_that_is_no_number_is_that_of_the_first_frame(export):
    text = figure(mesh(SKIN), NOD).replace(
        "double3 xformOp:translate = (0, 0, 3)", "double3 xformOp:translate.timeSamples = { 1: (0, 0, 3), 2: (0, 0, 3), 3: (nan, 0, 3), 4: (0, 0, 3) }"
    )
    result = export(text, "--frames", "1-5")
    assert result.code == 0, result.err
    assert "points that are not finite over time" in result.warned("geometry")
    scene = Gltf(result.path)
    assert scene.deformed("/Figure/M", seconds(3)) == pytest.approx(scene.attribute("/Figure/M", "POSITION"))
    world = scene.world("/Figure/M")[:3, 3]
    wanted, _ = baked(figure(mesh(SKIN), NOD), "/Figure/M", 5)
    far = np.linalg.norm(wanted[:, None] - (scene.deformed("/Figure/M", seconds(5)) + world), axis=2)
    assert max(far.min(axis=0).max(), far.min(axis=1).max()) < 2e-5


def test_equal_runs_are_equal_bytes(export):
    text = figure(SHAPES, NOD, WEIGHTS)
    first = export(text, "--frames", "1-5").path.read_bytes()
    assert export(text, "--frames", "1-5", out="again.glb").path.read_bytes() == first
    assert json.loads(first[20 : 20 + int.from_bytes(first[12:16], "little")])["animations"]


def test_the_keys_that_are_kept_show_all_others():
    rng = np.random.default_rng(7)
    for _ in range(50):
        codes = np.cumsum(rng.uniform(0.1, 2, 30))
        knots = np.sort(rng.choice(30, 6, replace=False))
        rows = np.stack([np.interp(codes, codes[knots], rng.normal(size=6)) for _ in range(12)], axis=1).reshape(30, 4, 3)
        rows = (rows + rng.normal(size=rows.shape) * 1e-7).astype(np.float32)
        near = np.full(3, 1e-5, np.float32)
        first = codes[rng.integers(30)]
        kept = list(needed_shapes(zip(codes, rows, strict=True), near, first))
        times = np.array([code for code, _ in kept])
        assert first in times and (np.diff(times) > 0).all()
        assert len(kept) <= 6 + 3 + 4
        shown = np.stack([np.interp(codes, times, column) for column in np.array([row for _, row in kept]).reshape(len(kept), -1).T], 1)
        assert np.abs(shown.reshape(rows.shape) - rows).max() <= 1.2e-5
