"""Options that usdrecord has too: --mask, --purposes, --variant PRIM:SET=NAME."""

import pytest
from test_scene import VARIANTS

SET = """
def Material "Red" {
    token outputs:surface.connect = </Red/S.outputs:surface>
    def Shader "S" {
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (1, 0, 0)
        token outputs:surface
    }
}
def Xform "World" {
    def Xform "Lamps" {
        def SphereLight "Key" {}
        def SphereLight "Fill" {}
    }
    def Cube "Wall" (prepend apiSchemas = ["MaterialBindingAPI"]) { rel material:binding = </Red> }
    def Cube "Floor" {}
}
"""


def test_a_mask_exports_its_prims_and_what_they_refer_to(gltf):
    assert sorted(gltf(SET, "--mask", "/World/Lamps").by_path) == [
        "/World", "/World/Lamps", "/World/Lamps/Fill", "/World/Lamps/Key",
    ]  # fmt: skip
    scene = gltf(SET, "--mask", "/World/Lamps/Key,/World/Wall")
    assert sorted(scene.by_path) == ["/World", "/World/Lamps", "/World/Lamps/Key", "/World/Wall"]
    assert scene.material("/World/Wall")["pbrMetallicRoughness"]["baseColorFactor"] == [1, 0, 0, 1], "from outside the mask"


def test_a_mask_does_not_follow_collections(gltf):
    linked = SET.replace('def SphereLight "Key" {}', """def SphereLight "Key" (prepend apiSchemas = ["LightAPI"]) {
            rel collection:lightLink:includes = </World/Floor>
            uniform bool collection:lightLink:includeRoot = 0
        }""")
    assert "/World/Floor" not in gltf(linked, "--mask", "/World/Lamps").by_path


def test_a_mask_names_what_is_not_there(export):
    result = export(SET, "--mask", "/World/Lamps/Kay,/World/Wall")
    assert result.code == 1
    assert "--mask: there is no prim /World/Lamps/Kay (/World/Lamps has: Key, Fill)" in result.err
    assert "/ has: Red, World" in export(SET, "--mask", "/Werld/Lamps/Key").err
    many = "\n".join(f'def Cube "C{number:03d}" {{}}' for number in range(300))
    assert len(export(many, "--mask", "/D").err) < 400


@pytest.mark.parametrize("wrong", ["World", "/World,", "/World.prop", "/", "/World Lamps", "", "/World/../Red"])
def test_a_mask_is_of_absolute_paths(export, wrong):
    result = export(SET, "--mask", wrong)
    assert result.code == 2 and "no path of a prim" in result.err


def test_the_order_of_a_mask_does_not_matter_and_the_mask_does(export):
    assert "written" in export(SET, "--mask", "/World/Wall,/World/Floor").out
    assert "up to date" in export(SET, "--mask", "/World/Floor,/World/Wall").out
    assert "written" in export(SET, "--mask", "/World/Floor").out
    assert "written" in export(SET).out


def test_a_mask_reaches_into_instances(gltf):
    text = """
        class "Kit" { def Cube "A" {}
            def Cube "B" {} }
        def "One" (instanceable = true
            inherits = </Kit>) {}
    """
    assert sorted(gltf(text, "--mask", "/One/B").by_path) == ["/One", "/One/B"]


PURPOSES = "\n".join(f'def Cube "{p}" {{ uniform token purpose = "{p}" }}' for p in ("default", "render", "proxy", "guide"))


@pytest.mark.parametrize(
    ("arguments", "shown"),
    [
        ([], ["default", "render"]),
        (["--purposes", "default,render"], ["default", "render"]),
        (["--purposes", "proxy"], ["default", "proxy"]),
        (["--purposes", "guide,render"], ["default", "guide", "render"]),
        (["--purpose", "proxy"], ["proxy"]),
    ],
)
def test_purposes(gltf, arguments, shown):
    assert sorted(gltf(PURPOSES, *arguments).by_path) == [f"/{name}" for name in shown]


def test_an_unknown_purpose_is_told_which_there_are(export):
    result = export(PURPOSES, "--purposes", "prxy")
    assert result.code == 2 and "choose of default, render, proxy, guide" in result.err


NESTED = """
def Xform "Set" (
    variants = { string place = "street" }
    prepend variantSets = "place"
) {
    variantSet "place" = {
        "street" { }
        "room" (
            variants = { string lamp = "off" }
            prepend variantSets = "lamp"
        ) {
            variantSet "lamp" = {
                "off" { }
                "on" { def SphereLight "L" {} }
            }
        }
    }
}
"""


def test_variants_in_either_spelling_and_in_their_order(gltf, export):
    for spelling in ("/Set:size=large", "/Set{size=large}"):
        assert gltf(VARIANTS, "--variant", spelling).area("/Set/C") == pytest.approx(54)
    on = gltf(NESTED, "--variant", "/Set:place=room", "--variant", "/Set:lamp=on")
    assert "/Set/L" in on.by_path
    assert export(NESTED, "--variant", "/Set:lamp=on").code == 1, "the room's set is not there in the street"


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ("/Sat:size=large", "there is no prim /Sat (/ has: Set)"),
        ("/Set/D:size=large", "there is no prim /Set/D (/Set has: C)"),
        ("/Set:sise=large", "/Set has no variant set 'sise' (it has: size)"),
        ("/Set:size=huge", "/Set{size} has no 'huge' (it has: large, small)"),
    ],
)
def test_a_wrong_variant_is_told_what_there_is(export, wrong, said):
    result = export(VARIANTS, "--variant", wrong)
    assert result.code == 1 and said in result.err


@pytest.mark.parametrize("wrong", ["Set:size=large", "/Set:size", "/Set:=large", "/Set size=large", "/Set.x:size=large"])
def test_what_is_no_selection_is_a_usage_error(export, wrong):
    assert export(VARIANTS, "--variant", wrong).code == 2


def test_variants_inside_instances_and_outside_the_mask_say_so(export):
    text = VARIANTS.replace('"Set"', '"Kit"') + '\ndef "One" (instanceable = true\n references = </Kit>) { }\n'
    inside = 'def "All" (instanceable = true\n references = </Kits>) {}\ndef "Kits" { def "One" (references = </Kit>) {} }'
    result = export(text + inside, "--variant", "/All/One:size=large")
    assert result.code == 1 and "is inside the instance /All" in result.err
    result = export(text, "--mask", "/One", "--variant", "/Kit:size=large")
    assert result.code == 1 and "/Kit is outside the prims of --mask" in result.err
