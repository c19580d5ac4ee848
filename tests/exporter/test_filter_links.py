"""Filter links: for which geometry a light filter filters."""

import json

import pytest
from conftest import Gltf
from test_light_networks import FRAMES
from test_linking import CUBES, only, without

ROD, MULTIPLIER = "PxrRodLightFilter", "PxrIntMultLightFilter"
LAMP = 'def SphereLight "L" { rel light:filters = </F> }\n'
HALF = "float inputs:ri:intensity = 0.5\n"


def rod(body="", kind=ROD, name="F"):
    return f'def {kind} "{name}" {{ {body} }}\n'


def linked(body, **how):
    return CUBES + LAMP + rod(body, **how)


def filtered(scene, path, at="/F"):
    """Whether a filter filters for the geometry at a path."""
    number = scene.node(at)["extras"]["usdLightFilter"].get("filterLink")
    nodes = [n["extras"] for n in scene.nodes if "extras" in n]
    known = [n.get("usdLux", {}).get(link) for n in nodes for link in ("lightLink", "shadowLink")]
    known += [n.get("usdLightFilter", {}).get("filterLink") for n in nodes]
    highest = max((n for n in known if n is not None), default=-1)
    said = scene.node(path)["extras"].get("usdLinks", {"outside": []})
    outside = said["outside"] if "outside" in said else [n for n in range(highest + 1) if n not in said["inside"]]
    return number is None or number not in outside


def members(scene, at="/F"):
    return "".join(cube for cube in "abc" if filtered(scene, f"/Geo/{cube}", at))


LINK = {"link": "filterLink"}
EXPLICIT = '\nuniform token collection:filterLink:expansionRule = "explicitOnly"'
EXPRESSION = 'uniform bool collection:filterLink:includeRoot = 0\npathExpression collection:filterLink:membershipExpression = '


@pytest.mark.parametrize("kind", [ROD, MULTIPLIER, "LightFilter"])
@pytest.mark.parametrize(("body", "held"), [
    (only("/Geo/a", **LINK), "a"),
    (without("/Geo/a", **LINK), "bc"),
    (without("/Geo", **LINK) + "\n" + "rel collection:filterLink:includes = </Geo/b>", "b"),
    (only("/Geo", **LINK) + EXPLICIT, ""),
    (only("/Geo/b", **LINK) + EXPLICIT, "b"),
    ("uniform bool collection:filterLink:includeRoot = 0", ""),
    (only(**LINK), ""),
    (without("/Gone", **LINK), "abc"),
    (EXPRESSION + '"/Geo/a /Geo/c"', "ac"),
])  # fmt: skip
def test_members_are_filtered_and_others_are_not(export, kind, body, held):
    shader = f'uniform token lightFilter:shaderId = "{ROD}"\n' if kind == "LightFilter" else ""
    result = export(linked(shader + HALF + body, kind=kind), "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    assert scene.lux("/L")["filters"] == ["/F"] and members(scene) == held
    is_note = "filterLink of nothing" in json.dumps(result.report) and "/Gone" in json.dumps(result.report)
    assert is_note == ("Gone" in body)


def test_a_linked_multiplier_stands_at_a_node_and_the_light_is_as_it_is(export):
    plain = Gltf(export(CUBES + 'def SphereLight "L" { }').path).nits("/L").tolist()
    body = HALF + "float inputs:ri:exposure = 2\n" + without("/Geo/a", **LINK)
    scene = Gltf(export(linked(body, kind=MULTIPLIER), "--strict").path)
    assert scene.node("/F")["extras"]["usdLightFilter"] == {"type": "multiplier", "share": [2] * 3, "filterLink": 0}
    assert scene.nits("/L").tolist() == plain
    # One that is put into the light needs no node.
    scene = Gltf(export(linked(HALF, kind=MULTIPLIER), "--strict").path)
    assert "filters" not in scene.lux("/L") and scene.nits("/L") == pytest.approx([half / 2 for half in plain])


def test_a_linked_multiplier_holds_the_first_frame_and_is_lost_if_it_is_no_share(export):
    over_time = "float inputs:ri:intensity.timeSamples = { 1: 2, 5: 3 }\n" + without("/Geo/a", **LINK)
    result = export(FRAMES + linked(over_time, kind=MULTIPLIER))
    assert result.warned("lights") == {"animated light filter"}
    assert Gltf(result.path).node("/F")["extras"]["usdLightFilter"]["share"] == [2] * 3
    for broken, why in (("intensity = -1", "by -1"), ("exposure = 3000", "by nan"), ("diffuse = 0.5", "its diffuse is 0.5")):
        result = export(linked(f"float inputs:ri:{broken}\n" + without("/Geo/a", **LINK), kind=MULTIPLIER))
        assert "light filters" in result.warned("lights") and why in result.said()
        assert "filters" not in Gltf(result.path).lux("/L")


def test_equal_sets_of_lights_and_filters_are_one(gltf):
    lamp = f'def SphereLight "L" {{ rel light:filters = [</F>, </G>]\n {without("/Geo/c")} }}\n'
    scene = gltf(CUBES + lamp + rod(only("/Geo/a", "/Geo/b", **LINK)) + rod(only("/Geo/a", **LINK), name="G"))
    assert scene.lux("/L")["lightLink"] == 0
    assert [scene.node(at)["extras"]["usdLightFilter"]["filterLink"] for at in ("/F", "/G")] == [0, 1]
    assert (members(scene), members(scene, "/G")) == ("ab", "a")


def test_a_filter_that_no_light_names_links_nothing(gltf):
    scene = gltf(CUBES + 'def SphereLight "L" { }\n' + rod(only("/Geo/a", **LINK)))
    assert "usdLinks" not in json.dumps(scene.json) and "filterLink" not in json.dumps(scene.json)


def test_filters_of_instances_filter_for_their_own(gltf, tmp_path):
    lamp = f"""def Xform "root" {{
        def SphereLight "L" {{
            rel light:filters = </root/F>
        }}
        def {ROD} "F" {{
            {only("/root/card", **LINK)}
        }}
        def Cube "card" {{
        }}
    }}"""
    (tmp_path / "lamp.usda").write_text(f"#usda 1.0\n{lamp}\n")
    instances = "".join(f'def "{name}" (instanceable = true\n references = @lamp.usda@</root>) {{}}\n' for name in "xy")
    scene = gltf(CUBES + instances)
    for own, other in ("xy", "yx"):
        assert filtered(scene, f"/{own}/card", f"/{own}/F") and not filtered(scene, f"/{other}/card", f"/{own}/F")
        assert not filtered(scene, "/Geo/a", f"/{own}/F")


def test_subsets_of_faces_and_fog_may_be_filtered_alone(gltf):
    mesh = """def Mesh "m" {
        int[] faceVertexCounts = [3, 3]
        int[] faceVertexIndices = [0, 1, 2, 2, 1, 3]
        point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (1, 1, 0)]
        uniform token subdivisionScheme = "none"
        def GeomSubset "half" {
            uniform token elementType = "face"
            int[] indices = [1]
        }
    }
    def Volume "fog" {
        float candelabra:fog:extinction = 0.5
    }
    """
    scene = gltf(mesh + LAMP + rod(only("/m/half", **LINK)))
    parts = {part["extras"]["usdPath"]: part["extras"].get("usdLinks") for part in scene.primitives("/m") if "extras" in part}
    assert scene.node("/F")["extras"]["usdLightFilter"]["filterLink"] == 0
    assert len(scene.primitives("/m")) == 2 and parts["/m/half"] in ({"outside": []}, {"inside": [0]})
    assert not filtered(scene, "/m") and not filtered(scene, "/fog")
