"""Light links and shadow links: whose sets, of which geometry, in which form."""

import json

import pytest
from conftest import Gltf

CUBES = """
def Xform "Geo" {
    def Cube "a" {}
    def Cube "b" {}
    def Cube "c" {}
}
"""


def light(name, body="", kind="SphereLight"):
    return f'def {kind} "{name}" {{ {body} }}\n'


def only(*paths, link="lightLink"):
    targets = ", ".join(f"<{path}>" for path in paths)
    return f"uniform bool collection:{link}:includeRoot = 0\nrel collection:{link}:includes = [{targets}]"


def without(*paths, link="lightLink"):
    return f"rel collection:{link}:excludes = [{', '.join(f'<{path}>' for path in paths)}]"


def links(scene, path):
    """The sets that the geometry at a path is not in."""
    said = scene.node(path)["extras"].get("usdLinks", {"outside": []})
    return sets_outside(scene, said)


def sets_outside(scene, said):
    named = [n["extras"].get("usdLux", {}) for n in scene.nodes if "extras" in n]
    count = 1 + max((lux[key] for lux in named for key in ("lightLink", "shadowLink") if key in lux), default=-1)
    if "outside" in said:
        return said["outside"]
    return [number for number in range(count) if number not in said["inside"]]


def lit(scene, light_path, path, link="lightLink"):
    """Whether a light lights (or is shadowed by) the geometry at a path."""
    number = scene.lux(light_path).get(link)
    return number is None or number not in links(scene, path)


def test_a_stage_without_links_is_what_it_was(gltf):
    scene = gltf(CUBES + light("L") + light("M", without(link="shadowLink")))
    text = json.dumps(scene.json)
    assert "usdLinks" not in text and "Link\"" not in text


@pytest.mark.parametrize(
    "everything",
    [
        "uniform bool collection:lightLink:includeRoot = 1",
        "uniform bool collection:lightLink:includeRoot = 0\nrel collection:lightLink:includes = [</Geo>]",
        without("/Nowhere"),
        'uniform token collection:lightLink:expansionRule = "expandPrimsAndProperties"',
        'pathExpression collection:lightLink:membershipExpression = "//"\n'
        "uniform bool collection:lightLink:includeRoot = 0",
    ],
)
def test_collections_of_everything_are_no_links(gltf, everything):
    scene = gltf(CUBES + light("L", everything))
    assert "lightLink" not in scene.lux("/L")
    assert "usdLinks" not in json.dumps(scene.json)


def test_members_are_lit_and_others_are_not(gltf):
    scene = gltf(
        CUBES + light("A", only("/Geo/a")) + light("B", without("/Geo/a")) + light("S", only("/Geo/b", link="shadowLink"))
    )
    assert [lit(scene, "/A", f"/Geo/{c}") for c in "abc"] == [True, False, False]
    assert [lit(scene, "/B", f"/Geo/{c}") for c in "abc"] == [False, True, True]
    assert all(lit(scene, "/S", f"/Geo/{c}") for c in "abc")
    assert [lit(scene, "/S", f"/Geo/{c}", "shadowLink") for c in "abc"] == [False, True, False]


def test_equal_sets_are_one(gltf):
    scene = gltf(
        CUBES
        + light("A", only("/Geo/a", "/Geo/b"))
        + light("B", without("/Geo/c"))
        + light("C", without("/Geo/c", link="shadowLink"), "RectLight")
        + light("D", only("/Geo/c"), "DomeLight")
    )
    assert [scene.lux(f"/{name}").get("lightLink") for name in "ABCD"] == [0, 0, None, 1]
    assert scene.lux("/C")["shadowLink"] == 0
    assert scene.node("/Geo/a")["extras"]["usdLinks"] == {"outside": [1]}
    assert scene.node("/Geo/c")["extras"]["usdLinks"] == {"outside": [0]}


def test_the_shorter_list_is_written(gltf):
    cubes = "".join(f'def Cube "c{i}" {{}}\n' for i in range(9))
    lamps = "".join(light(f"l{i}", only(f"/Geo/c{i}")) for i in range(9))
    scene = gltf(f'def Xform "Geo" {{\n{cubes} }}\ndef Cube "free" {{}}\n' + lamps)
    for i in range(9):
        assert scene.node(f"/Geo/c{i}")["extras"]["usdLinks"] == {"inside": [i]}
        assert [lit(scene, f"/l{k}", f"/Geo/c{i}") for k in range(9)] == [k == i for k in range(9)]
    assert scene.node("/free")["extras"]["usdLinks"] == {"inside": []}


def test_a_light_of_nothing_lights_nothing(gltf):
    scene = gltf(CUBES + light("L", "uniform bool collection:lightLink:includeRoot = 0"))
    assert not any(lit(scene, "/L", f"/Geo/{c}") for c in "abc")


def test_expansion_rules_and_nested_collections(gltf):
    scene = gltf(
        """def Xform "Geo" (prepend apiSchemas = ["CollectionAPI:some"]) {
            uniform token collection:some:expansionRule = "expandPrims"
            rel collection:some:includes = [</Geo/a>, </Geo/under>]
            def Cube "a" {}
            def Cube "b" {}
            def Xform "under" { def Cube "c" {} }
        }
        """
        + light("Nested", only("/Geo.collection:some"))
        + light("Listed", only("/Geo", "/Geo/b") + '\nuniform token collection:lightLink:expansionRule = "explicitOnly"')
        + light("Parent", only("/Geo/under"))
    )
    paths = ["/Geo/a", "/Geo/b", "/Geo/under/c"]
    assert [lit(scene, "/Nested", path) for path in paths] == [True, False, True]
    assert [lit(scene, "/Listed", path) for path in paths] == [False, True, False]
    assert [lit(scene, "/Parent", path) for path in paths] == [False, False, True]


def test_expressions_are_evaluated(gltf):
    expression = 'pathExpression collection:lightLink:membershipExpression = "/Geo/a /Geo/b"'
    body = f"uniform bool collection:lightLink:includeRoot = 0\n{expression}"
    scene = gltf(CUBES + light("L", body))
    assert [lit(scene, "/L", f"/Geo/{c}") for c in "abc"] == [True, True, False]


def test_two_expressions_are_two_sets(gltf):
    body = 'uniform bool collection:lightLink:includeRoot = 0\npathExpression collection:lightLink:membershipExpression = "/Geo/{}"'
    scene = gltf(CUBES + "".join(light(name, body.format(name)) for name in "ab"))
    assert [[lit(scene, f"/{name}", f"/Geo/{c}") for c in "abc"] for name in "ab"] == [
        [True, False, False],
        [False, True, False],
    ]


def test_instances_are_told_apart(gltf):
    scene = gltf(
        """def Xform "Proto" (active = false) {}
        class Xform "P" { def Cube "c" {}
            def SphereLight "lamp" {
                uniform bool collection:lightLink:includeRoot = 0
                rel collection:lightLink:includes = [</P/c>]
            } }
        def Xform "One" (instanceable = true
            inherits = </P>) {}
        def Xform "Two" (instanceable = true
            inherits = </P>) {}
        """
        + light("L", only("/Two"))
    )
    assert [lit(scene, "/L", path) for path in ("/One/c", "/Two/c")] == [False, True]
    # What a light in an instance is linked to is in the same instance.
    for own, other in (("One", "Two"), ("Two", "One")):
        assert lit(scene, f"/{own}/lamp", f"/{own}/c") and not lit(scene, f"/{own}/lamp", f"/{other}/c")


INSTANCER = """def PointInstancer "I" {
    rel prototypes = [</I/P/p>, </I/P/q>]
    int[] protoIndices = [0, 1, 0]
    point3f[] positions = [(0, 0, 0), (3, 0, 0), (6, 0, 0)]
    def Scope "P" { def Cube "p" {}
        def Cube "q" {} }
}
def Xform "Far" { def Cube "r" {} }
def PointInstancer "J" {
    rel prototypes = [</Far/r>]
    int[] protoIndices = [0]
    point3f[] positions = [(9, 0, 0)]
}
"""


def test_point_instances_are_their_instancers_or_their_prototypes(gltf):
    scene = gltf(
        INSTANCER
        + light("OfI", only("/I"))
        + light("OfQ", only("/I/P/q"))
        + light("OfJ", only("/J"))
        + light("OfR", only("/Far/r"))
        + light("NotI", without("/I"))
        + light("NotRButJ", only("/J") + "\n" + without("/Far"))
    )
    of = {
        "/OfI": [True, True, True, False],
        "/OfQ": [False, True, False, False],
        "/OfJ": [False, False, False, True],
        "/OfR": [False, False, False, True],
        "/NotI": [False, False, False, True],
        "/NotRButJ": [False, False, False, False],
    }
    for lamp, expected in of.items():
        assert [lit(scene, lamp, path) for path in ("/I[0]", "/I[1]", "/I[2]", "/J[0]")] == expected, lamp


SUBSETS = """def Mesh "M" {
    uniform token subdivisionScheme = "none"
    int[] faceVertexCounts = [4, 4, 4]
    int[] faceVertexIndices = [0, 1, 5, 4, 1, 2, 6, 5, 2, 3, 7, 6]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (3, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0), (3, 1, 0)]
    def GeomSubset "left" {
        uniform token elementType = "face"
        uniform token familyName = "{FAMILY}"
        int[] indices = [0]
    }
    def GeomSubset "right" {
        uniform token elementType = "face"
        uniform token familyName = "{FAMILY}"
        int[] indices = [2]
    }
}
"""


@pytest.mark.parametrize("family", ["materialBind", "", "parts"])
def test_subsets_have_links_of_their_own(gltf, family):
    scene = gltf(SUBSETS.replace("{FAMILY}", family) + light("L", only("/M/left")) + light("R", without("/M/right")))
    own = scene.node("/M")["extras"]["usdLinks"]
    by_name = {}
    for primitive in scene.primitives("/M"):
        extras = primitive.get("extras", {})
        name = extras.get("usdPath", "/M").rsplit("/", 1)[-1]
        by_name[name] = sets_outside(scene, extras.get("usdLinks", own))
    left, right = scene.lux("/L")["lightLink"], scene.lux("/R")["lightLink"]
    assert by_name == {"M": [left], "left": [], "right": [left, right]}


def test_subsets_that_nobody_names_do_not_divide(gltf):
    scene = gltf(SUBSETS.replace("{FAMILY}", "") + CUBES + light("L", only("/Geo/a")))
    assert len(scene.primitives("/M")) == 1


def test_faces_in_two_subsets_are_reported(export):
    text = SUBSETS.replace("{FAMILY}", "").replace("[2]\n", "[0, 2]\n")
    result = export(text + light("L", only("/M/left")) + light("R", only("/M/right")))
    assert "linked faces that are in two subsets" in result.warned("lights")


def test_mesh_lights_light_and_are_lit(gltf):
    scene = gltf(
        CUBES
        + 'def Cube "Lamp" (prepend apiSchemas = ["MeshLightAPI"]) { float inputs:intensity = 5\n'
        + only("/Geo/a") + "}\n" + light("L", without("/Lamp"))
    )  # fmt: skip
    assert [lit(scene, "/Lamp", f"/Geo/{c}") for c in "abc"] == [True, False, False]
    assert not lit(scene, "/L", "/Lamp") and not lit(scene, "/Lamp", "/Lamp")
    assert scene.lux("/Lamp")["type"] == "MeshLight"


def test_domes_suns_and_fog_are_linked(gltf):
    scene = gltf(
        CUBES
        + light("Dome", only("/Geo/a"), "DomeLight")
        + light("Sun", without("/Fog"), "DistantLight")
        + 'def Volume "Fog" { custom float candelabra:fog:extinction = 0.5 }'
    )
    assert not lit(scene, "/Dome", "/Geo/b") and not lit(scene, "/Dome", "/Fog")
    assert lit(scene, "/Sun", "/Geo/b") and not lit(scene, "/Sun", "/Fog")


def test_only_shapes_that_cast_shadows_are_geometry(gltf):
    shown = "custom bool cycles:visibility:shadow = {}"
    body = without("/R1", "/R0", link="shadowLink")
    rects = "".join(light(f"R{i}", shown.format(i), "RectLight") for i in (0, 1))
    scene = gltf(CUBES + rects + light("L", body))
    assert lit(scene, "/L", "/R0", "shadowLink") and not lit(scene, "/L", "/R1", "shadowLink")


OFF = "bool inputs:shadow:enable = 0"


@pytest.mark.parametrize("kind", ["RectLight", "DiskLight", "SphereLight", "CylinderLight", "DistantLight", "DomeLight"])
@pytest.mark.parametrize("off", [OFF, "bool shadow:enable = 0", "bool primvars:arnold:cast_shadows = 0",
                                 OFF + "\ncolor3f inputs:shadow:color = (1, 0, 0)\nfloat inputs:shadow:distance = 2"])  # fmt: skip
def test_nothing_casts_shadows_of_a_light_whose_shadows_are_off(export, kind, off):
    fog = 'def Volume "Fog" { custom float candelabra:fog:extinction = 0.5 }'
    result = export(CUBES + light("L", off, kind) + light("M", "bool inputs:shadow:enable = 1") + light("N", OFF) + fog, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    places = [*(f"/Geo/{c}" for c in "abc"), "/Fog"]
    assert not any(lit(scene, "/L", place, "shadowLink") for place in places)
    assert all(lit(scene, "/L", place) and lit(scene, "/M", place, "shadowLink") for place in places)
    # Both lights are of one set.
    assert scene.lux("/L")["shadowLink"] == scene.lux("/N")["shadowLink"] == 0
    assert "shadowLink" not in scene.lux("/M")


def test_shadows_that_are_off_beside_links(gltf):
    body = "\n".join([OFF, only("/Geo/a"), only("/Geo/b", link="shadowLink")])
    mesh = f'def Cube "Lamp" (prepend apiSchemas = ["MeshLightAPI"]) {{ {OFF} }}\n'
    scene = gltf(CUBES + light("L", body) + light("S", only("/Geo/b", link="shadowLink")) + mesh)
    assert [lit(scene, "/L", f"/Geo/{c}") for c in "abc"] == [True, False, False]
    assert [lit(scene, "/S", f"/Geo/{c}", "shadowLink") for c in "abc"] == [False, True, False]
    for lamp in ("/L", "/Lamp"):
        assert not any(lit(scene, lamp, place, "shadowLink") for place in ("/Geo/a", "/Geo/b", "/Geo/c", "/Lamp"))


def test_shadows_over_time_are_those_of_the_first_frame(export):
    times = "bool inputs:shadow:enable.timeSamples = { 1: 0, 2: 1 }"
    result = export(CUBES + light("L", times), "--frames", "1-2")
    assert not lit(Gltf(result.path), "/L", "/Geo/a", "shadowLink")
    assert "animated inputs:shadow:enable" in result.warned("lights")


def test_links_are_no_losses(export):
    result = export(CUBES + light("L", only("/Geo/a")) + light("S", only("/Geo/b", link="shadowLink")), "--strict")
    assert result.code == 0, result.err
    result = export(CUBES + light("L", without("/Geo/z")))
    assert not result.warned() and "lightLink of nothing" in result.noted()


def test_the_same_stage_gives_the_same_bytes(export):
    text = CUBES + "".join(light(f"l{i}", only(f"/Geo/{'abc'[i % 3]}")) for i in range(20))
    first = export(text, out="one.glb").path.read_bytes()
    assert first == export(text, out="two.glb").path.read_bytes()


def test_linked_stages_of_other_people(gltf, shared):
    tests = shared / "real" / "openusd_usdlux_tests"
    scene = gltf(tests / "usd/usdLux/testenv/testUsdLuxLinkingAPI/linking_example.usda")
    lamps = {"SimpleInclude/include_a": "a", "SimpleInclude/include_b": "b", "MultiInclude/include_ab": "ab",
             "SimpleExclude/exclude_a": "b", "SimpleExclude/exclude_b": "a", "DefaultLinkage/include_all": "ab"}  # fmt: skip
    for lamp, members in lamps.items():
        assert "".join(g for g in "ab" if lit(scene, f"/Lights/{lamp}", f"/Geom/{g}")) == members, lamp
    # The rule of the nested instances is in their names: Li light link, Sh shadow link, In includes, Ex excludes.
    scene = gltf(tests / "usdImaging/usdImaging/testenv/testUsdImagingNestedInstancingCategories/scene.usda")
    for name in ("LiInAA", "LiExBB", "ShInAB", "ShExBA"):
        link = "lightLink" if name.startswith("Li") else "shadowLink"
        for place in ("AA", "AB", "BA", "BB"):
            expected = (place == name[4:]) == (name[2:4] == "In")
            assert lit(scene, f"/W/{name}", f"/W/{place[0]}/{place[1]}/Sphere", link) == expected, (name, place)
