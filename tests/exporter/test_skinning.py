"""Skinned meshes and blend shapes against UsdSkel's own baking."""

import numpy as np
import pytest
from conftest import HEADER, Gltf
from pxr import Gf, Usd, UsdGeom, UsdSkel

CAGE = """
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)]
"""
POLYGONS = CAGE + ' uniform token subdivisionScheme = "none"\n'
SKIN = """
    int[] primvars:skel:jointIndices = [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1] (interpolation = "vertex"
        elementSize = 2)
    float[] primvars:skel:jointWeights = [1, 0, 0.5, 0.5, 0, 1, 1, 0, 0.4, 0.6, 0, 1] (interpolation = "vertex"
        elementSize = 2)
    matrix4d primvars:skel:geomBindTransform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 2, 0), (0.1, 0.2, 0, 1))
"""
SKELETON = """
def Skeleton "Bones" {
    uniform token[] joints = ["Root", "Root/Tip"]
    uniform matrix4d[] bindTransforms = [((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
                                         ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 0, 0, 1))]
    uniform matrix4d[] restTransforms = [((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1)),
                                         ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (1, 0, 0, 1))]
    double3 xformOp:translate = (0, 0, 3)
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""
NODDING = "rotations.timeSamples = { 1: [(1, 0, 0, 0), (0.9239, 0, 0.3827, 0)], 2: [(0.7071, 0.7071, 0, 0), (0.8, 0, 0, 0.6)] }"
HELD = "rotations = [(1, 0, 0, 0), (0.8, 0, 0, 0.6)]"


def animation(rotations=NODDING, name="Nod", more="", scales="[(1, 1, 1), (1, 1.5, 1)]"):
    return f"""def SkelAnimation "{name}" {{
        uniform token[] joints = ["Root", "Root/Tip"]
        float3[] translations = [(0, 0.5, 0), (1, 0, 0)]
        quatf[] {rotations}
        half3[] scales = {scales}
        {more}
    }}"""


def figure(meshes, rotations=NODDING, more="", root='"Figure"', **how):
    return f"""def SkelRoot {root} (prepend apiSchemas = ["SkelBindingAPI"]) {{
        rel skel:skeleton = </Figure/Bones>
        rel skel:animationSource = </Figure/Nod>
        {SKELETON}
        {animation(rotations, more=more, **how)}
        {meshes}
    }}"""


def mesh(body, name="M", geometry=POLYGONS):
    return f'def Mesh "{name}" (prepend apiSchemas = ["SkelBindingAPI"]) {{ {geometry} {body}\n }}'


SHAPES = mesh(
    SKIN
    + """normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)] (interpolation = "vertex")
    uniform token[] skel:blendShapes = ["smile", "frown"]
    rel skel:blendShapeTargets = [</Figure/M/Smile>, </Figure/M/Frown>]
    def BlendShape "Smile" {
        uniform vector3f[] offsets = [(0, 0, 1), (0, 1, 0)]
        uniform vector3f[] normalOffsets = [(0, 1, 0), (1, 0, 0)]
        uniform int[] pointIndices = [1, 4]
        uniform vector3f[] inbetweens:half = [(1, 0, 1), (1, 1, 0)] (weight = 0.5)
    }
    def BlendShape "Frown" {
        uniform vector3f[] offsets = [(0, 0, -1), (0, 0, -1), (0, 0, -2), (0, 0, -2), (0, 0, 1), (0, 0, 0)]
    }"""
)
WEIGHTS = """uniform token[] blendShapes = ["frown", "smile"]
    float[] blendShapeWeights.timeSamples = { 1: [0.25, 0.4], 2: [1, 0] }"""


def baked(text, path, code):
    """A mesh's points and normals after UsdSkel.BakeSkinning, in its own space."""
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(HEADER + text.replace("}", "\n}"))
    for prim in list(stage.Traverse()):
        prim.SetInstanceable(False)
    for prim in list(stage.Traverse()):
        if prim.IsA(UsdSkel.Root):
            assert UsdSkel.BakeSkinning(UsdSkel.Root(prim), Gf.Interval(code, code))
    found = UsdGeom.Mesh(stage.GetPrimAtPath(path))
    normals = found.GetNormalsAttr().Get(code)
    points = np.array(found.GetPointsAttr().Get(code), dtype=float)
    matrix = np.array(UsdGeom.XformCache(code).GetLocalToWorldTransform(found.GetPrim()))
    return points @ matrix[:3, :3] + matrix[3, :3], None if normals is None else np.array(normals, dtype=float)


def exported(result, path="/Figure/M"):
    """World places of the corners, face after face."""
    scene = Gltf(result.path)
    world = scene.world(path)
    return scene.triangles(path) @ world[:3, :3].T + world[:3, 3]


def triangles(points):
    """The corners of the two quads of `CAGE`, as they are cut."""
    quads = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
    return {tuple(sorted(map(tuple, points[list(c)].round(4) + 0.0))) for q in quads
            for c in (q[[0, 1, 2]], q[[0, 2, 3]], q[[0, 1, 3]], q[[1, 2, 3]])}  # fmt: skip


METHODS = ["classicLinear", "dualQuaternion"]
RIGID = """
    int[] primvars:skel:jointIndices = [1] (interpolation = "constant")
    float[] primvars:skel:jointWeights = [1] (interpolation = "constant")
"""
FEW_JOINTS = RIGID.replace("= [1] (interpolation = \"constant\")\n    float", "= [0] (interpolation = \"constant\")\n    float")


@pytest.mark.parametrize("code", [1, 2])
@pytest.mark.parametrize(
    "body",
    [
        SKIN,
        SKIN + 'uniform token primvars:skel:skinningMethod = "dualQuaternion"',
        SKIN + 'double3 xformOp:translate = (5, 6, 7)\n float3 xformOp:scale = (1, 2, 3)\n'
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]',
        RIGID,
        FEW_JOINTS + 'uniform token[] skel:joints = ["Root/Tip"]',
    ],
)  # fmt: skip
def test_points_are_where_usdskel_bakes_them(export, body, code):
    text = figure(mesh(body))
    found = exported(export(text, "--frames", f"{code}"))
    wanted, _ = baked(text, "/Figure/M", code)
    assert {tuple(sorted(map(tuple, t.round(4) + 0.0))) for t in found} <= triangles(wanted)
    assert np.abs(wanted - [[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]]).max() > 0.3


@pytest.mark.parametrize("code", [1, 2])
def test_blend_shapes_come_first(export, code):
    text = figure(SHAPES, more=WEIGHTS)
    result = export(text, "--frames", f"{code}")
    wanted, normals = baked(text, "/Figure/M", code)
    assert {tuple(sorted(map(tuple, t.round(4) + 0.0))) for t in exported(result)} <= triangles(wanted)
    plain, _ = baked(figure(mesh(SKIN)), "/Figure/M", code)
    assert np.abs(wanted - plain).max() > 0.2
    scene = Gltf(result.path)
    unit = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    place = scene.attribute("/Figure/M", "POSITION") @ scene.world("/Figure/M")[:3, :3].T + scene.world("/Figure/M")[:3, 3]
    for position, normal in zip(place, scene.attribute("/Figure/M", "NORMAL"), strict=True):
        assert normal == pytest.approx(unit[np.linalg.norm(wanted - position, axis=1).argmin()], abs=1e-5)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize(
    "normals",
    [
        '[(0, 0, 1), (0, 1, 1), (1, 0, 1), (0, 0, 1), (1, 1, 0), (0, 0, 1)] (interpolation = "vertex")',
        '[(0, 0, 1), (0, 1, 1), (1, 0, 1), (0, 0, 1), (0, 1, 1), (0, 0, 1), (0, 2, 1), (1, 0, 1)] (interpolation = "faceVarying")',
    ],
)
def test_normals_turn_as_usdskel_turns_them(export, normals, method):
    text = figure(mesh(SKIN + f'normal3f[] normals = {normals}\n uniform token primvars:skel:skinningMethod = "{method}"'))
    result = export(text, "--frames", "1")
    _, wanted = baked(text, "/Figure/M", 1)
    wanted = wanted / np.linalg.norm(wanted, axis=1, keepdims=True)
    found = Gltf(result.path).attribute("/Figure/M", "NORMAL")
    for normal in wanted:
        assert np.linalg.norm(found - normal, axis=1).min() < 2e-5
    for normal in found:
        assert np.linalg.norm(wanted - normal, axis=1).min() < 2e-5


def test_a_joint_of_no_size_hides_what_it_moves_and_nothing_else(export):
    """Riggers hide things so. It has no inverse, which normals and children of what it moves would need."""
    normals = 'normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1), (0, 0, 1)] (interpolation = "vertex")'
    rigid = mesh(RIGID + 'def Cube "Below" { double size = 1 }', name="Rigid")
    text = figure(mesh(SKIN + normals) + "\n" + rigid, scales="[(1, 1, 1), (0, 0, 0)]")
    result = export(text, "--frames", "1")
    assert result.code == 0, result.err
    wanted, _ = baked(text, "/Figure/M", 1)
    found = {tuple(sorted(map(tuple, corners.round(4) + 0.0))) for corners in exported(result)}
    assert found and found <= triangles(wanted)


def test_a_subdivision_surface_is_refined_as_it_is_posed(export):
    text = figure(mesh(SKIN, geometry=CAGE))
    points, _ = baked(text, "/Figure/M", 1)
    low = exported(export(text, "--frames", "1", "--complexity", "low"))
    assert {tuple(sorted(map(tuple, t.round(4) + 0.0))) for t in low} <= triangles(points)
    corners = exported(export(text, "--frames", "1")).reshape(-1, 3)
    assert len(corners) == 64 * 3
    # The sheet's corners stay put under edgeAndCorner.
    for corner in points[[0, 2, 3, 5]]:
        assert np.linalg.norm(corners - corner, axis=1).min() < 1e-5


def test_what_deforms_has_targets_and_what_is_held_has_none(export):
    moving = export(figure(mesh(SKIN) + "\n" + mesh("", "Still")), "--frames", "1-2", "--strict")
    assert moving.code == 0, moving.err
    assert [len(Gltf(moving.path).primitives(f"/Figure/{name}")[0].get("targets", [])) for name in ("M", "Still")] == [1, 0]
    for text, frames in ((figure(mesh(SKIN)), "1"), (figure(mesh(SKIN), HELD), "1-2")):
        still = export(text, "--frames", frames, "--strict")
        assert still.code == 0
        assert "targets" not in still.path.read_bytes().decode("latin-1")
    # It follows the joint that stands still, softly; another mesh follows the one that moves.
    tip = "rotations.timeSamples = { 1: [(1, 0, 0, 0), (1, 0, 0, 0)], 2: [(1, 0, 0, 0), (0.8, 0, 0, 0.6)] }"
    rooted = SKIN.replace("[1, 0, 0.5, 0.5, 0, 1, 1, 0, 0.4, 0.6, 0, 1]", "[1, 0, 0.5, 0, 1, 0, 1, 0, 0.4, 0, 1, 0]")
    assert rooted != SKIN
    apart = Gltf(export(figure(mesh(rooted, "Root") + "\n" + mesh(SKIN), tip), "--frames", "1-2").path)
    assert [len(apart.primitives(f"/Figure/{name}")[0].get("targets", [])) for name in ("Root", "M")] == [0, 1]


def test_joints_that_move_a_mesh_as_a_whole_move_its_node_over_time(export):
    body = RIGID + 'double3 xformOp:translate = (5, 6, 7)\n uniform token[] xformOpOrder = ["xformOp:translate"]\n def Cube "Child" {}'
    text = figure(mesh(body))
    result = export(text, "--frames", "1-2", "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    for code in (1, 2):
        world = scene.world("/Figure/M", (code - 1) / 24)
        found = scene.triangles("/Figure/M") @ world[:3, :3].T + world[:3, 3]
        wanted, _ = baked(text, "/Figure/M", code)
        assert {tuple(sorted(map(tuple, t.round(3) + 0.0))) for t in found} <= {
            tuple(sorted(map(tuple, np.round(t, 3) + 0.0))) for t in triangles(wanted)
        }
        # What hangs below the mesh is no part of it: it stays.
        assert scene.world("/Figure/M/Child", (code - 1) / 24)[:3, 3] == pytest.approx([5, 6, 7], abs=1e-4)


def test_without_animation_the_skeleton_rests(export):
    text = figure(mesh(SKIN)).replace("rel skel:animationSource = </Figure/Nod>", "")
    wanted, _ = baked(text, "/Figure/M", 1)
    assert {tuple(sorted(map(tuple, t.round(4) + 0.0))) for t in exported(export(text, "--strict"))} <= triangles(wanted)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (figure(mesh(SKIN)).replace("</Figure/Bones>", "</Figure/Gone>"), "no SkelRoot"),
        (figure(mesh(SKIN)).replace("def SkelRoot", "def Xform"), "no SkelRoot"),
        (figure(mesh(SKIN.replace("[0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1]", "[0, 1, 0, 1]"))), ""),
        (figure(mesh(SKIN.replace("[0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1]", "[0, 1, 0, 7, 0, 1, 0, 1, 0, 1, 0, 1]"))), ""),
    ],
)  # fmt: skip
def test_what_cannot_be_posed_is_reported_and_left_as_it_stands(export, text, why):
    result = export(text, "--frames", "1")
    assert result.code == 0
    assert result.warned("geometry") == {"skinned mesh"}
    assert why in result.said()
    points = Gltf(result.path).attribute("/Figure/M", "POSITION")
    assert points.max(axis=0) == pytest.approx([2, 1, 0])


def test_a_mesh_that_its_node_makes_flat_is_posed_all_the_same(export):
    flat = 'double3 xformOp:scale = (0, 1, 1)\n uniform token[] xformOpOrder = ["xformOp:scale"]'
    result = export(figure(mesh(SKIN + flat)), "--frames", "1")
    assert result.code == 0
    assert result.warned("geometry") == set()



CROWD = f"""
def "Kit" {{
    def Xform "Body" {{
        {SKELETON}
        def Mesh "M" (prepend apiSchemas = ["SkelBindingAPI"]) {{ {POLYGONS} {SKIN}
            rel skel:skeleton = </Kit/Body/Bones>
        }}
    }}
}}
""" + "\n".join(
    f"""def SkelRoot "{name}" (prepend apiSchemas = ["SkelBindingAPI"]) {{
        rel skel:animationSource = </{name}/Nod>
        float3 xformOp:scale = ({scale}, {scale}, {scale})
        uniform token[] xformOpOrder = ["xformOp:scale"]
        {animation(rotations)}
        def "Body" (instanceable = true
            references = </Kit/Body>) {{}}
    }}"""
    for name, rotations, scale in (("Ann", NODDING, 1), ("Bob", HELD, 3), ("Cid", HELD, 2))
)


def test_instances_of_one_mesh_are_posed_each_by_its_own_animation(export):
    result = export(CROWD, "--frames", "1")
    for name in ("Ann", "Bob", "Cid"):
        path = f"/{name}/Body/M"
        wanted, _ = baked(CROWD, path, 1)
        found = exported(result, path)
        assert {tuple(sorted(map(tuple, t.round(3) + 0.0))) for t in found} <= {
            tuple(sorted(map(tuple, np.round(t, 3) + 0.0))) for t in triangles(wanted)
        }
    assert len(np.unique([Gltf(result.path).area(f"/{name}/Body/M") for name in ("Ann", "Bob", "Cid")])) == 3


def test_the_source_is_not_written_to(export, tmp_path):
    export(figure(SHAPES, more=WEIGHTS), "--frames", "1-2")
    before = (tmp_path / "scene.usda").read_bytes()
    assert export(figure(SHAPES, more=WEIGHTS), "--frames", "2").code == 0
    assert (tmp_path / "scene.usda").read_bytes() == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["scene.glb", "scene.glb.report.json", "scene.usda"]


def test_a_skinned_mesh_light_has_the_area_of_its_pose(gltf):
    light = mesh(SKIN + "bool inputs:normalize = 1\n float inputs:intensity = 2").replace(
        '"SkelBindingAPI"]) { ', '"SkelBindingAPI", "MeshLightAPI"]) { ', 1
    )
    scene = gltf(figure(light), "--frames", "1")
    assert scene.nits("/Figure/M") * scene.area("/Figure/M") == pytest.approx([2] * 3, rel=1e-5)
    assert abs(scene.area("/Figure/M") - 2) > 0.05


def test_a_skeleton_is_nothing_to_be_drawn_and_no_loss(export):
    result = export(figure(mesh(SKIN)), "--frames", "1")
    assert result.report["warnings"] == []
