"""How much of a light surfaces reflect: `inputs:diffuse` and `inputs:specular`."""

import pytest

from conftest import HEADER, Gltf

ANIMATED = HEADER.replace("metersPerUnit = 1", "metersPerUnit = 1\n    startTimeCode = 1\n    endTimeCode = 5")


@pytest.mark.parametrize("kind", ["RectLight", "SphereLight", "DistantLight", "DomeLight"])
@pytest.mark.parametrize(("diffuse", "specular"), [(0.5, 0.5), (0.25, 1), (1, 0), (0, 3)])
def test_multipliers_are_carried_and_leave_the_light_as_it_is(export, kind, diffuse, specular):
    plain = Gltf(export(f'def {kind} "L" {{}}').path)
    result = export(f'def {kind} "L" {{ float inputs:diffuse = {diffuse}\n float inputs:specular = {specular} }}')
    scene = Gltf(result.path)
    told = {name: scene.lux("/L").get(name, 1) for name in ("diffuse", "specular")}
    assert told == {"diffuse": diffuse, "specular": specular}
    assert scene.json.get("materials") == plain.json.get("materials")
    assert scene.json.get("extensions") == plain.json.get("extensions")
    assert scene.lux("/L").get("radiance") == plain.lux("/L").get("radiance")
    assert not result.warned()


def test_multipliers_that_nobody_can_carry_are_listed(export):
    result = export(
        ANIMATED
        + """def RectLight "Fades" { float inputs:diffuse.timeSamples = { 1: 0.5, 5: 1 } }
        def RectLight "Minus" { float inputs:specular = -2 }"""
    )
    scene = Gltf(result.path)
    assert scene.lux("/Fades")["diffuse"] == 0.5 and scene.lux("/Minus")["specular"] == 0
    assert {"animated inputs:diffuse", "inputs:specular is negative or not finite"} <= result.warned("lights")
