"""Meshes that emit: MeshLightAPI, GeometryLight and light:materialSyncMode."""

import numpy as np
import pytest
from conftest import Gltf
from test_deformation import CORNERS, POLYGON, SHOT, SQUASHED, cube
from usd_gltf.mesh import MeshSource

QUAD = """
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (2, 0, 0), (2, 3, 0), (0, 3, 0)]
    uniform token subdivisionScheme = "none"
"""
NEON = """
def Material "Neon" {
    token outputs:surface.connect = </Neon/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.2, 0.3, 0.4)
        color3f inputs:emissiveColor = (1, 0.5, 0)
        token outputs:surface
    }
}
"""
BOUND = '["MeshLightAPI", "MaterialBindingAPI"]'


def test_material_glow_tints_light(gltf):
    scene = gltf(
        NEON + f'def Mesh "M" (prepend apiSchemas = {BOUND}) {{ {QUAD} rel material:binding = </Neon>\n'
        " float inputs:intensity = 10\n color3f inputs:color = (1, 1, 0.5) }"
    )
    assert scene.nits("/M") == pytest.approx([10, 5, 0])
    assert scene.lux("/M")["type"] == "MeshLight"
    assert scene.material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([0.2, 0.3, 0.4])


@pytest.mark.parametrize(("mode", "base"), [("independent", 0.2), ("noMaterialResponse", 0.0)])
def test_other_sync_modes_take_the_lights_color(gltf, mode, base):
    scene = gltf(
        NEON + f'def Mesh "M" (prepend apiSchemas = {BOUND}) {{ {QUAD} rel material:binding = </Neon>\n'
        f' uniform token light:materialSyncMode = "{mode}"\n color3f inputs:color = (0, 0, 1) }}'
    )
    assert scene.nits("/M") == pytest.approx([0, 0, 1])
    assert scene.material("/M")["pbrMetallicRoughness"]["baseColorFactor"][0] == pytest.approx(base)


def test_a_mesh_light_without_material_takes_the_lights_color(gltf):
    scene = gltf(f'def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {{ {QUAD} float inputs:intensity = 4 }}')
    assert scene.nits("/M") == pytest.approx([4] * 3)


def test_normalize_divides_by_the_area_of_the_mesh(gltf):
    scene = gltf(
        f"""def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {{ {QUAD}
            bool inputs:normalize = 1
            float3 xformOp:scale = (2, 1, 1)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }}"""
    )
    assert scene.nits("/M") == pytest.approx([1 / 12] * 3)


def test_double_sided_meshes_emit_from_both_sides(gltf):
    scene = gltf(f'def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {{ {QUAD} uniform bool doubleSided = 1 }}')
    assert scene.material("/M")["doubleSided"] is True


def test_a_geometry_light_lights_its_mesh(gltf):
    scene = gltf(f'def Mesh "M" {{ {QUAD} }}\ndef GeometryLight "G" {{ rel geometry = </M>\n float inputs:intensity = 7 }}')
    assert scene.nits("/M") == pytest.approx([7] * 3)
    assert scene.lux("/M")["type"] == "MeshLight"


@pytest.mark.parametrize(
    "prims",
    [
        f'def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {{ {QUAD} custom bool candelabra:force = 1 }}',
        f'def Mesh "M" {{ {QUAD} }}\ndef GeometryLight "G" {{ rel geometry = </M>\n custom bool candelabra:force = 1 }}',
    ],
)
def test_force_is_carried(gltf, prims):
    assert gltf(prims).lux("/M")["force"] is True


def test_subsets_glow_each_by_its_material(gltf):
    scene = gltf(
        NEON
        + """def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {
            int[] faceVertexCounts = [3, 3]
            int[] faceVertexIndices = [0, 1, 2, 0, 2, 3]
            point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
            uniform token subdivisionScheme = "none"
            def GeomSubset "Tube" (prepend apiSchemas = ["MaterialBindingAPI"]) {
                uniform token elementType = "face"
                uniform token familyName = "materialBind"
                int[] indices = [1]
                rel material:binding = </Neon>
            }
        }"""
    )
    first, second = scene.primitives("/M")
    assert "extras" not in first
    assert second["extras"]["usdPath"] == "/M/Tube"
    assert scene.nits("/M", 0) == pytest.approx([1, 1, 1])
    assert scene.nits("/M", 1) == pytest.approx([1, 0.5, 0])


def test_instances_of_a_mesh_light_share_their_mesh(gltf):
    scene = gltf(
        f"""def "Lib" {{ def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {{ {QUAD} }} }}
        def "A" (instanceable = true
            references = </Lib>) {{}}
        def "B" (instanceable = true
            references = </Lib>) {{}}"""
    )
    assert scene.node("/A/M")["mesh"] == scene.node("/B/M")["mesh"]
    assert scene.lux("/B/M")["type"] == "MeshLight"


ANIMATED_GLOW = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 3
    metersPerUnit = 1
    upAxis = "Y"
)
def Material "Mat" {
    token outputs:surface.connect = </Mat/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:emissiveColor.timeSamples = { 1: (0, 0, 0), 3: (4, 2, 0) }
        token outputs:surface
    }
}
"""


def test_a_glow_that_is_animated_has_keys(gltf):
    scene = gltf(ANIMATED_GLOW + 'def Cube "C" (prepend apiSchemas = ["MaterialBindingAPI"]) { rel material:binding = </Mat> }')
    assert scene.lux("/C")["type"] == "MeshLight"
    assert scene.lux("/C")["values"]["rgb"] == [[0, 0, 0], [2, 1, 0], [4, 2, 0]]


def test_a_glow_that_cannot_be_animated_is_a_matter_of_lights(export):
    apis = '["MeshLightAPI", "MaterialBindingAPI"]'
    result = export(ANIMATED_GLOW + f'def Cube "C" (prepend apiSchemas = {apis}) {{ rel material:binding = </Mat> }}')
    assert "animated emissiveColor" in result.warned("lights")


def test_one_instance_is_a_light_and_both_deform(export):
    text = SHOT + 'def "Kit" { ' + cube({1: CORNERS, 5: SQUASHED}) + """ }
        def Xform "A" (instanceable = true\n references = </Kit>) {}
        def Xform "B" (instanceable = true\n references = </Kit>) {}
        def GeometryLight "L" { rel geometry = </A/M> }"""  # fmt: skip
    result = export(text)
    scene = Gltf(result.path)
    for path in ("/A/M", "/B/M"):
        assert len(scene.primitives(path)[0]["targets"]) == 1
        assert set(scene.channels(path)) == {"weights"}
    assert not result.warned("animation")


@pytest.mark.parametrize(("scale", "poses"), [("(2, 2, 2)", 1), ("(1, 2, 1)", 2)])
def test_a_normalized_light_is_posed_once_for_all_its_instances(gltf, monkeypatch, scale, poses):
    asked, area = [], MeshSource.area
    monkeypatch.setattr(MeshSource, "area", lambda mesh, linear, code=None: asked.append(code) or area(mesh, linear, code))
    light = cube({1: CORNERS, 5: SQUASHED}, POLYGON + "\n bool inputs:normalize = 1").replace('"M" {', '"M" (prepend apiSchemas = ["MeshLightAPI"]) {')
    op = 'float3 xformOp:scale = %s\n uniform token[] xformOpOrder = ["xformOp:scale"]'
    copy = 'def Xform "%s" (instanceable = true\n references = </Kit>) { %s }\n'
    text = SHOT + f'def "Kit" {{ {light} }}\n' + "".join(copy % (f"I{n}", op % (scale if n % 2 else "(1, 1, 1)")) for n in range(12))
    scene = gltf(text)
    per_mesh = 2 if "/Kit/M" in scene.by_path else 1  # the kit is a mesh of its own
    assert 0 < len(asked) <= 5 * poses * per_mesh
    whole, larger = (np.array(scene.lux(f"/I{n}/M")["values"]["rgb"]) for n in (0, 1))
    if poses == 1:
        assert larger == pytest.approx(whole / 4, rel=1e-5)
    for name in ("I0", "I1"):
        values = scene.lux(f"/{name}/M")["values"]
        for time, nits in zip(values["times"], values["rgb"], strict=True):
            found = scene.deformed_triangles(f"/{name}/M", time)
            cross = np.cross(found[:, 1] - found[:, 0], found[:, 2] - found[:, 0])
            assert nits[0] * np.linalg.norm(cross, axis=1).sum() / 2 == pytest.approx(1, rel=1e-4)


# -- Arnold ------------------------------------------------------------------------------------------

ARNOLD = "primvars:arnold:light"


def arnolds(body="", kind="Mesh"):
    camera = f"float {ARNOLD}:camera = 1"
    text = f'def {kind} "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {QUAD} bool {ARNOLD} = 1\n {camera}\n {body} }}'
    return text.replace(f" {camera}\n", "") if ":camera = 0" in body else text


def test_a_mesh_light_of_arnolds_is_normalized_and_keeps_its_material(export):
    """Its parameters are below `light`; those of the mesh are not the light's."""
    dull = NEON.replace("color3f inputs:emissiveColor = (1, 0.5, 0)", "")
    body = f"""float {ARNOLD}:intensity = 3\n float {ARNOLD}:exposure = 2\n color3f {ARNOLD}:color = (1, 0.5, 0)
        string {ARNOLD}:aov = "key"\n int {ARNOLD}:samples = 4\n float {ARNOLD}:sss = 1\n float primvars:arnold:intensity = 50
        float inputs:intensity = 70\n rel material:binding = </Neon>"""
    result = export(dull + arnolds(body), "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    assert scene.nits("/M") == pytest.approx([2, 1, 0])
    assert scene.lux("/M")["group"] == "key"
    assert scene.material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([0.2, 0.3, 0.4])


def test_a_mesh_light_of_arnolds_over_time_and_by_its_radiance(gltf):
    body = f"bool {ARNOLD}:normalize = 0\n float {ARNOLD}:intensity.timeSamples = {{ 1: 1, 3: 5 }}"
    values = gltf(SHOT + arnolds(body)).lux("/M")["values"]
    assert values["rgb"][0] == [1] * 3 and max(row[0] for row in values["rgb"]) == 5


@pytest.mark.parametrize(("body", "what"), [
    (f"float {ARNOLD}:camera = 0", "camera of a mesh light"),
    (f"float {ARNOLD}:shadow_density = 0.5", "arnold attributes"),
])  # fmt: skip
def test_what_a_mesh_light_of_arnolds_loses_is_told(export, body, what):
    assert what in export(arnolds(body)).warned("lights")


def test_a_mesh_light_of_arnolds_has_its_own_multipliers(export):
    body = f"float {ARNOLD}:specular = 0\n float {ARNOLD}:diffuse = 0.5\n float primvars:arnold:diffuse = 7"
    lux = Gltf(export(arnolds(body)).path).lux("/M")
    assert (lux["diffuse"], lux["specular"]) == (0.5, 0)


def test_a_mesh_light_of_arnolds_is_filtered_by_its_own_graph(export):
    box = 'token inputs:geometry_type = "box"\n matrix4d inputs:geometry_matrix = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))'
    shader = f'def Shader "F" {{ uniform token info:id = "arnold:light_blocker"\n {box}\n color3f outputs:out }}'
    graph = f'\ndef ArnoldNodeGraph "G" {{ token outputs:filters:i1.connect = </G/F.outputs:out>\n {shader} }}'
    result = export(arnolds(f'string {ARNOLD}:shaders = "/G"') + graph, "--strict")
    assert result.code == 0, result.err
    assert Gltf(result.path).lux("/M")["filters"] == ["/G/F"]


def test_usds_own_mesh_light_counts_before_arnolds(gltf):
    scene = gltf(f'def Mesh "M" (prepend apiSchemas = ["MeshLightAPI"]) {{ {QUAD} bool {ARNOLD} = 1\n float {ARNOLD}:intensity = 9 }}')
    assert scene.nits("/M") == pytest.approx([1] * 3)
