"""Triangulation, primvars, normals, gprims, subsets."""

import numpy as np
import pytest
from usd_gltf.triangulate import clip_ears, newell, triangulate

L_SHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
STAR = [
    (np.cos(a) * r, np.sin(a) * r)
    for a, r in zip(np.arange(16) * np.pi / 8, [3, 1] * 8, strict=True)
]
COMB = [(0, 0), (7, 0), (7, 3), (6, 3), (6, 1), (5, 1), (5, 3), (4, 3), (4, 1), (3, 1), (3, 3), (0, 3)]
COLLINEAR = [(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (3, 2), (1.5, 2), (0, 2), (0, 1)]
KEYHOLE = [(0, 0), (4, 0), (4, 4), (0, 4), (0, 0), (1, 1), (1, 3), (3, 3), (3, 1), (1, 1)]
DART = [(0, 0), (2, 1), (0, 2), (0.5, 1)]


def plane_area(polygon) -> float:
    x, y = np.array(polygon, dtype=float).T
    return float(x @ np.roll(y, -1) - y @ np.roll(x, -1)) / 2


@pytest.mark.parametrize("polygon", [L_SHAPE, STAR, COMB, COLLINEAR, KEYHOLE, DART])
@pytest.mark.parametrize("start", range(4))
@pytest.mark.parametrize("reverse", [False, True])
def test_concave_faces_are_covered_once(polygon, start, reverse):
    flat = np.roll(np.array(polygon, dtype=float), start, axis=0)
    flat = flat[::-1] if reverse else flat
    # Tilted in space, to be sure that no axis matters.
    x, y = np.array([1, 2, 2]) / 3, np.array([2, 1, -2]) / 3
    points = flat[:, :1] * x + flat[:, 1:] * y
    count = len(points)
    triangles, faces = triangulate(points, np.array([count]), np.arange(count))
    assert len(triangles) == count - 2
    assert (faces == 0).all()
    corners = points[triangles]
    vectors = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    signed = vectors @ newell(points[None])[0] / abs(plane_area(flat))
    assert signed.min() > -1e-9, "a flipped triangle"
    assert signed.sum() == pytest.approx(abs(plane_area(flat)))


def test_degenerate_faces_end():
    for polygon in ([(0, 0)] * 6, [(i, 0) for i in range(6)], [(0, 0), (1, 1), (0, 1), (1, 0), (2, 2), (0.3, 2)]):
        points = np.column_stack([np.array(polygon, dtype=float), np.zeros(6)])
        triangles, _ = triangulate(points, np.array([6]), np.arange(6))
        assert len(triangles) == 4
    assert len(clip_ears(np.zeros((5, 2)))) == 3


def test_mixed_faces_keep_their_order():
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [2, 0.5, 0]], dtype=float)
    counts = np.array([4, 2, 3])
    triangles, faces = triangulate(points, counts, np.array([0, 1, 2, 3, 0, 1, 1, 4, 2]))
    assert faces.tolist() == [0, 0, 2]
    assert triangles[2].tolist() == [6, 7, 8]


GRID = """
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)]
"""
FACETED = GRID + ' uniform token subdivisionScheme = "none"\n'


def test_holes_are_left_out(gltf):
    scene = gltf(f'def Mesh "M" {{ {FACETED} int[] holeIndices = [0] }}')
    assert scene.area("/M") == pytest.approx(1)
    assert scene.attribute("/M", "POSITION")[:, 0].min() == 1


def test_left_handed_faces_are_turned(gltf):
    right = gltf(f'def Mesh "M" {{ {FACETED} }}').area_vectors("/M")
    left = gltf(f'def Mesh "M" {{ {FACETED} uniform token orientation = "leftHanded" }}').area_vectors("/M")
    assert (right[:, 2] > 0).all()
    assert (left[:, 2] < 0).all()


def test_a_polygon_mesh_is_flat_and_a_cage_is_smooth_and_reported(export):
    from conftest import Gltf

    result = export(f'def Mesh "Flat" {{ {FACETED} }}\ndef Mesh "Cage" {{ {GRID} }}', "--complexity", "low")
    scene = Gltf(result.path)
    assert "NORMAL" not in scene.primitives("/Flat")[0]["attributes"]
    assert scene.attribute("/Cage", "NORMAL") == pytest.approx(np.tile([0, 0, 1], (6, 1)))
    assert [w["path"] for w in result.report["warnings"] if w["what"] == "subdivision surface"] == ["/Cage"]


@pytest.mark.parametrize(
    ("interpolation", "values", "indices", "vertices"),
    [
        ("vertex", "[(0, 0), (1, 0), (2, 0), (0, 1), (1, 1), (2, 1)]", None, 6),
        ("vertex", "[(0, 0), (1, 0)]", "[0, 1, 0, 1, 0, 1]", 6),
        ("faceVarying", "[(0, 0), (1, 0), (1, 1), (0, 1), (0, 0), (1, 0), (1, 1), (0, 1)]", None, 8),
        ("faceVarying", "[(0, 0), (1, 0), (1, 1), (0, 1)]", "[0, 1, 2, 3, 0, 1, 2, 3]", 8),
        ("uniform", "[(0, 0), (1, 1)]", None, 8),
        ("constant", "[(0.5, 0.5)]", None, 6),
    ],
)
def test_texture_coordinates_of_every_interpolation(gltf, tmp_path, interpolation, values, indices, vertices):
    from PIL import Image

    Image.new("RGB", (2, 2), (9, 9, 9)).save(tmp_path / "t.png")
    indexed = f"int[] primvars:st:indices = {indices}" if indices else ""
    scene = gltf(
        TEXTURED
        + f"""def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {FACETED}
            rel material:binding = </Mat>
            texCoord2f[] primvars:st = {values} (interpolation = "{interpolation}")
            {indexed}
        }}"""
    )
    uv = scene.attribute("/M", "TEXCOORD_0")
    assert len(uv) == vertices
    assert ((uv >= 0) & (uv <= 2)).all()


TEXTURED = """
def Material "Mat" {
    token outputs:surface.connect = </Mat/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </Mat/T.outputs:rgb>
        token outputs:surface
    }
    def Shader "T" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @t.png@
        float2 inputs:st.connect = </Mat/R.outputs:result>
        float3 outputs:rgb
    }
    def Shader "R" {
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "st"
        float2 outputs:result
    }
}
"""


def test_display_color(gltf):
    scene = gltf(
        f"""def Mesh "One" {{ {FACETED} color3f[] primvars:displayColor = [(0.1, 0.2, 0.3)]
            float[] primvars:displayOpacity = [0.5] }}
        def Mesh "Many" {{ {FACETED}
            color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0)] (interpolation = "uniform") }}
        def Mesh "None" {{ {FACETED} }}"""
    )
    assert scene.material("/One")["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx([0.1, 0.2, 0.3, 0.5])
    assert scene.material("/One")["alphaMode"] == "BLEND"
    assert scene.attribute("/Many", "COLOR_0")[:, :2].sum() == pytest.approx(8)
    assert scene.material("/Many")["pbrMetallicRoughness"]["baseColorFactor"] == [1, 1, 1, 1]
    assert scene.material("/None")["pbrMetallicRoughness"]["baseColorFactor"] == [0.5, 0.5, 0.5, 1]


@pytest.mark.parametrize(
    ("prim", "area", "tolerance"),
    [
        ('Cube "G" { double size = 3 }', 54, 1e-6),
        ('Sphere "G" { double radius = 2 }', 16 * np.pi, 0.02),
        ('Cylinder "G" { double radius = 1\n double height = 4\n uniform token axis = "X" }', 10 * np.pi, 0.02),
        ('Cone "G" { double radius = 3\n double height = 4 }', 24 * np.pi, 0.02),
        ('Capsule "G" { double radius = 1\n double height = 2\n uniform token axis = "Y" }', 8 * np.pi, 0.02),
        ('Plane "G" { double width = 2\n double length = 5\n uniform token axis = "Y" }', 10, 1e-6),
    ],
)
def test_intrinsic_gprims(gltf, prim, area, tolerance):
    scene = gltf(f"def {prim}")
    assert scene.area("/G") == pytest.approx(area, rel=tolerance)
    vectors, centres = scene.area_vectors("/G"), scene.triangles("/G").mean(axis=1)
    if not prim.startswith("Plane"):
        assert np.einsum("ti,ti->t", vectors, centres).min() > -1e-6, "outward"
    else:
        extent = np.ptp(scene.attribute("/G", "POSITION"), axis=0)
        assert extent == pytest.approx([2, 0, 5])
        assert (vectors[:, 1] > 0).all()
    indices = scene.accessor(scene.primitives("/G")[0]["indices"]).reshape(-1, 3)
    normals = scene.attribute("/G", "NORMAL")[indices].mean(axis=1)
    assert np.einsum("ti,ti->t", vectors, normals).min() > -1e-6


@pytest.mark.parametrize(
    "body",
    [
        "int[] faceVertexCounts = [3]\n int[] faceVertexIndices = [0, 1, 9]\n point3f[] points = [(0,0,0),(1,0,0),(0,1,0)]",
        "int[] faceVertexCounts = [4]\n int[] faceVertexIndices = [0, 1, 2]\n point3f[] points = [(0,0,0),(1,0,0),(0,1,0)]",
        "int[] faceVertexCounts = [-3]\n int[] faceVertexIndices = [0, 1, 2]\n point3f[] points = [(0,0,0),(1,0,0),(0,1,0)]",
    ],
)
def test_broken_meshes_are_left_out_and_reported(export, body):
    result = export(f'def Mesh "M" {{ {body} }}')
    assert result.code == 0
    assert "mesh with a broken topology" in result.warned()


def test_faces_at_non_finite_points_are_left_out(export):
    from conftest import Gltf

    result = export(
        """def Mesh "M" {
            int[] faceVertexCounts = [3, 3]
            int[] faceVertexIndices = [0, 1, 2, 1, 2, 3]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (nan, 0, inf)]
        }"""
    )
    assert "points that are not finite" in result.warned()
    assert Gltf(result.path).area("/M") == pytest.approx(0.5)


def test_kinds_without_a_carrier_are_reported(export):
    result = export(
        """def NurbsCurves "C" {}
        def Points "P" {}
        def NurbsPatch "N" {}
        def Volume "V" {}"""
    )
    assert {"NurbsCurves", "Points", "NurbsPatch", "Volume"} <= result.warned()
