"""Subdivision surfaces through the whole exporter: levels, attributes, lights, bounds."""

import numpy as np
import pytest
from conftest import Gltf
from test_geometry import FACETED, GRID, TEXTURED
from usd_gltf import subdivision

CUBE = """
    int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]
    point3f[] points = [(-1, -1, -1), (-1, -1, 1), (-1, 1, -1), (-1, 1, 1), (1, -1, -1), (1, -1, 1), (1, 1, -1), (1, 1, 1)]
"""
INWARD = CUBE.replace("[0, 1, 3, 2, 4, 6, 7, 5, 0, 4, 5, 1, 2, 3, 7, 6, 0, 2, 6, 4, 1, 5, 7, 3]",
                      "[2, 3, 1, 0, 5, 7, 6, 4, 1, 5, 4, 0, 6, 7, 3, 2, 4, 6, 2, 0, 3, 7, 5, 1]")  # fmt: skip
TOP = "int[] creaseIndices = [0, 1, 3, 2, 0]\n int[] creaseLengths = [5]\n"


def contents(result) -> tuple:
    scene = Gltf(result.path)
    del scene.json["asset"]["extras"]["usd"]["sourceHash"]
    return scene.json, scene.buffer


@pytest.mark.parametrize(("complexity", "triangles"), [("low", 12), ("medium", 48), ("high", 192), ("veryhigh", 768)])
def test_complexity_is_usdrecords(export, complexity, triangles):
    result = export(f'def Mesh "M" {{ {CUBE} }}', "--complexity", complexity)
    assert len(Gltf(result.path).triangles("/M")) == triangles
    assert ("subdivision surface" in result.warned()) == (complexity == "low")
    assert result.report["counts"]["triangles"] == triangles


def test_high_is_the_default_and_strict_has_nothing_to_say(export):
    text = f'def Mesh "M" {{ {CUBE} }}'
    result = export(text, "--strict")
    assert (result.code, result.report["warnings"]) == (0, [])
    assert result.report["counts"]["subdivision surfaces"] == 1
    assert "up to date" in export(text, "--complexity", "high").out
    assert "written" in export(text, "--complexity", "medium").out
    assert export(text, "--complexity", "1.2").code == 2


def test_what_is_not_subdivided_has_the_same_bytes_at_every_complexity(export):
    text = f'def Mesh "M" {{ {FACETED} normal3f[] normals = [(0, 0, 1)] (interpolation = "constant") }}\ndef Sphere "S" {{}}'
    assert contents(export(text, "--complexity", "low")) == contents(export(text, "--complexity", "veryhigh"))


def test_the_surface_is_the_limit_and_authored_normals_are_ignored(export):
    authored = 'normal3f[] normals = [(0, 0, 9)] (interpolation = "constant")'
    result = export(f'def Mesh "M" {{ {CUBE} {authored} }}', "--strict")
    assert result.noted() == {"authored normals of a subdivision surface are not used"}
    scene = Gltf(result.path)
    points, normals = scene.attribute("/M", "POSITION"), scene.attribute("/M", "NORMAL")
    assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(len(normals)))
    assert np.abs(points).max() == pytest.approx(0.8395061728)
    assert len(points) == 98, "one vertex for each point: nothing is torn"
    # A cube's symmetry: on the diagonal and the axes normals point outward exactly.
    for point, normal in zip(points, normals, strict=True):
        if np.count_nonzero(np.abs(point) > 1e-6) == 1 or np.ptp(np.abs(point)) < 1e-6:
            assert normal == pytest.approx(point / np.linalg.norm(point), abs=1e-6)
    assert (scene.area_vectors("/M") * scene.triangles("/M").mean(axis=1)).sum(axis=1).min() > 0


def test_left_handed_meshes_face_outward(gltf):
    one = gltf(f'def Mesh "M" {{ {CUBE} }}')
    other = gltf(f'def Mesh "M" {{ {INWARD} uniform token orientation = "leftHanded" }}')
    assert other.area("/M") == pytest.approx(one.area("/M"))
    assert (other.area_vectors("/M") * other.triangles("/M").mean(axis=1)).sum(axis=1).min() > 0
    outward = (other.attribute("/M", "NORMAL") * other.attribute("/M", "POSITION")).sum(axis=1)
    assert outward.min() > 0


def test_creases_and_corners_are_read(export):
    per_crease = export(f'def Mesh "M" {{ {CUBE} {TOP} float[] creaseSharpnesses = [10] }}')
    scene = Gltf(per_crease.path)
    assert scene.attribute("/M", "POSITION")[:, 0].min() == pytest.approx(-1), "the face amid sharp edges stays flat"
    per_edge = export(f'def Mesh "M" {{ {CUBE} {TOP} float[] creaseSharpnesses = [10, 10, 10, 10] }}')
    assert contents(per_crease) == contents(per_edge)
    semi = Gltf(export(f'def Mesh "M" {{ {CUBE} {TOP} float[] creaseSharpnesses = [0.5] }}').path)
    assert -1 < semi.attribute("/M", "POSITION")[:, 0].min() < -0.8396
    fixed = Gltf(export(f'def Mesh "M" {{ {CUBE} int[] cornerIndices = [7]\n float[] cornerSharpnesses = [10] }}').path)
    assert fixed.attribute("/M", "POSITION").max(axis=0) == pytest.approx([1, 1, 1])


@pytest.mark.parametrize(
    ("body", "what"),
    [
        (TOP, "creases that do not fit their mesh"),
        (TOP + "float[] creaseSharpnesses = [1, 2]", "creases that do not fit their mesh"),
        (TOP.replace("[5]", "[4]") + "float[] creaseSharpnesses = [1]", "creases that do not fit their mesh"),
        (TOP.replace("[5]", "[5, 0]") + "float[] creaseSharpnesses = [1, 1]", "creases that do not fit their mesh"),
        (TOP.replace("3, 2", "7, 99") + "float[] creaseSharpnesses = [1]", "creases that do not fit their mesh"),
        (TOP + "float[] creaseSharpnesses = [nan]", "creases that do not fit their mesh"),
        ("int[] cornerIndices = [1, 2]\n float[] cornerSharpnesses = [1]", "corners that do not fit their mesh"),
        ("int[] cornerIndices = [-1]\n float[] cornerSharpnesses = [1]", "corners that do not fit their mesh"),
        ('uniform token subdivisionScheme = "loop"', "subdivision surface"),
        ('uniform token subdivisionScheme = "doo"', "subdivision surface"),
    ],
)
def test_what_cannot_be_followed_is_left_out_and_reported(export, body, what):
    result = export(f'def Mesh "M" {{ {CUBE} {body} }}')
    assert result.code == 0
    assert result.warned() == {what}
    assert np.isfinite(Gltf(result.path).attribute("/M", "POSITION")).all()


def test_loop(gltf):
    solid = """int[] faceVertexCounts = [3, 3, 3, 3]
        int[] faceVertexIndices = [0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]
        point3f[] points = [(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)]
        uniform token subdivisionScheme = "loop"
    """
    scene = gltf(f'def Mesh "M" {{ {solid} }}')
    assert len(scene.triangles("/M")) == 64
    assert np.linalg.norm(scene.attribute("/M", "POSITION"), axis=1).min() > 0.2


def test_bilinear_keeps_its_shape_and_its_normals(export):
    bilinear = 'uniform token subdivisionScheme = "bilinear"'
    result = export(f'def Mesh "M" {{ {CUBE} {bilinear} }}', "--strict")
    scene = Gltf(result.path)
    assert scene.area("/M") == pytest.approx(24)
    assert "NORMAL" not in scene.primitives("/M")[0]["attributes"], "flat"
    assert len(scene.triangles("/M")) == 12, "what refining leaves as it is is not refined"
    warped = GRID.replace("(1, 1, 0)", "(1, 1, 1)")
    normals = 'normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (1, 0, 0), (1, 0, 0)] (interpolation = "vertex")'
    scene = Gltf(export(f'def Mesh "M" {{ {warped} {bilinear}\n {normals} }}', "--strict").path)
    assert len(scene.triangles("/M")) == 64
    points, found = scene.attribute("/M", "POSITION"), scene.attribute("/M", "NORMAL")
    # The bilinear patches of the points, and of the normals before they are made unit.
    u, v = points[:, 0] - (points[:, 0] > 1), points[:, 1]
    assert points[:, 2] == pytest.approx(v * np.where(points[:, 0] > 1, 1 - u, u))
    x = v * np.minimum(points[:, 0], 1)
    unit = np.stack([x, 0 * x, 1 - x], axis=1)
    assert found == pytest.approx(unit / np.linalg.norm(unit, axis=1, keepdims=True), abs=1e-6)


def test_subsets_holes_and_uniform_values_follow_their_faces(export):
    result = export(
        TEXTURED.replace("t.png", "none.png")
        + f"""def Mesh "M" {{ {CUBE}
            int[] holeIndices = [0]
            color3f[] primvars:displayColor = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 1, 1)] (interpolation = "uniform")
            def GeomSubset "S" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
                uniform token elementType = "face"
                uniform token familyName = "materialBind"
                int[] indices = [1, 2]
                rel material:binding = </Mat>
            }}
        }}"""
    )
    scene = Gltf(result.path)
    rest, subset = (scene.accessor(p["indices"]).size // 3 for p in scene.primitives("/M"))
    assert (rest, subset) == (3 * 32, 2 * 32)
    assert scene.attribute("/M", "POSITION")[:, 0].min() > -0.8, "the hole's middle is gone, not its share in the surface"
    colors = scene.attribute("/M", "COLOR_0")
    assert {tuple(row) for row in colors[:, :3]} == {(0, 0, 1), (1, 1, 0), (0, 1, 1)}


@pytest.mark.parametrize(("interpolation", "smooth"), [("vertex", True), ("varying", False)])
def test_vertex_values_are_smooth_and_varying_ones_linear(gltf, interpolation, smooth):
    colors = "[(0, 0, 0), (1, 0, 0), (0, 0, 0), (0, 0, 0), (1, 0, 0), (0, 0, 0)]"
    scene = gltf(f'def Mesh "M" {{ {GRID} color3f[] primvars:displayColor = {colors} (interpolation = "{interpolation}") }}')
    place, red = scene.attribute("/M", "POSITION")[:, 0], scene.attribute("/M", "COLOR_0")[:, 0]
    assert red[np.abs(place - 1) < 1e-6] == pytest.approx([2 / 3 if smooth else 1] * 5)
    if not smooth:
        assert sorted(set(red.round(4))) == [0, 0.25, 0.5, 0.75, 1]


@pytest.mark.parametrize("boundary", ["none", "edgeOnly", "edgeAndCorner"])
def test_the_boundary_rule_is_read(export, boundary):
    result = export(f'def Mesh "M" {{ {GRID} uniform token interpolateBoundary = "{boundary}" }}')
    bilinear = f'uniform token subdivisionScheme = "bilinear"\n uniform token interpolateBoundary = "{boundary}"'
    flat = export(f'def Mesh "M" {{ {GRID} {bilinear} }}', out="bilinear.glb")
    assert Gltf(flat.path).area("/M") == pytest.approx(2)
    if boundary == "none":
        assert result.warned() == {"mesh without faces"}
        return
    area = Gltf(result.path).area("/M")
    assert area == pytest.approx(2) if boundary == "edgeAndCorner" else area < 1.95


def test_faces_at_points_that_are_not_finite_go_before_the_rest_is_refined(export):
    result = export(
        """def Mesh "M" {
            int[] faceVertexCounts = [4, 4, 2]
            int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4, 0, 1]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (nan, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)]
        }"""
    )
    assert "points that are not finite" in result.warned()
    assert Gltf(result.path).area("/M") == pytest.approx(1)


def test_a_mesh_light_has_the_area_of_its_surface(gltf):
    text = f'def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {{ {CUBE} float inputs:intensity = 3\n bool inputs:normalize = 1 }}'
    for complexity in ("low", "medium", "high"):
        scene = gltf(text, "--complexity", complexity)
        assert scene.nits("/M") * scene.area("/M") == pytest.approx([3] * 3, rel=1e-5)
        assert scene.lux("/M")["type"] == "MeshLight"


def test_too_many_faces_are_refined_less_and_reported(export, monkeypatch):
    other = CUBE.replace("(1, 1, 1)", "(1, 1, 2)")
    text = f'def Mesh "A" {{ {CUBE} }}\ndef Mesh "B" {{ {other} }}\ndef Mesh "C" {{ {CUBE} }}'
    monkeypatch.setattr(subdivision, "MOST_FACES", 50)
    result = export(text)
    assert result.warned() == {"subdivision surface that is refined less"}
    assert [len(Gltf(result.path).triangles(path)) for path in ("/A", "/B", "/C")] == [48, 48, 48]
    assert [line["path"] for line in result.report["warnings"]] == ["/A", "/B", "/C"]
    assert "level 2 has 96 faces" in result.said()
    monkeypatch.setattr(subdivision, "MOST_FACES", 23)
    assert export(text, "--complexity", "medium").warned() == {"subdivision surface"}
    monkeypatch.setattr(subdivision, "MOST_FACES", 1000)
    monkeypatch.setattr(subdivision, "MOST_FACES_OF_A_STAGE", 100)
    result = export(text, "--complexity", "veryhigh")
    assert [len(Gltf(result.path).triangles(path)) for path in ("/A", "/B", "/C")] == [192, 12, 192]


def test_equal_meshes_are_refined_once_and_unequal_ones_are_not_mistaken(export, monkeypatch):
    made = []
    monkeypatch.setattr(subdivision, "Surface", lambda *a, make=subdivision.Surface: made.append(a) or make(*a))
    sharp = f"{TOP} float[] creaseSharpnesses"
    turned = CUBE + 'uniform token orientation = "leftHanded"'
    bodies = [CUBE, CUBE, CUBE.replace("(1, 1, 1)", "(1, 1, 2)"), f"{CUBE} {sharp} = [3]", f"{CUBE} {sharp} = [2]", turned, CUBE]
    result = export("\n".join(f'def Mesh "M{number}" {{ {body} }}' for number, body in enumerate(bodies)))
    scene = Gltf(result.path)
    assert len(made) == 5
    assert result.report["counts"]["subdivision surfaces"] == 7
    areas = [round(scene.area(f"/M{number}"), 4) for number in range(7)]
    assert areas[0] == areas[1] == areas[5] == areas[6] and len(set(areas[1:5])) == 4
    assert (scene.attribute("/M5", "NORMAL") == -scene.attribute("/M0", "NORMAL")).all()


def test_points_that_fall_together_have_normals_of_length_one(gltf):
    flat = CUBE.replace("(-1, -1, -1), (-1, -1, 1), (-1, 1, -1), (-1, 1, 1)", "(0, 0, 0), (0, 0, 0), (0, 0, 0), (0, 0, 0)")
    everything = CUBE.replace("-1", "0").replace("1", "0").replace("[0, 0, 3", "[0, 1, 3")
    for text in (flat, everything):
        normals = gltf(f'def Mesh "M" {{ {text} }}').attribute("/M", "NORMAL")
        assert np.linalg.norm(normals, axis=1) == pytest.approx(np.ones(len(normals)))


def test_animated_creases_are_reported(export):
    result = export(
        f'def Mesh "M" {{ {CUBE} {TOP} float[] creaseSharpnesses.timeSamples = {{ 1: [1], 2: [3] }} }}', "--frames", "1-2"
    )
    assert result.warned("animation") == {"animated creaseSharpnesses"}
