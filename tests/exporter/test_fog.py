"""Homogeneous fog: Volume prims with `candelabra:fog` attributes."""

import pytest

THICK = "custom float candelabra:fog:extinction = 0.5"
CM_Z_UP = '#usda 1.0\n(\n    metersPerUnit = 0.01\n    upAxis = "Z"\n)\n'


def fog(scene, path):
    return scene.node(path)["extras"]["usdFog"]


def test_a_volume_with_an_extent_is_a_box_at_its_node(gltf):
    scene = gltf(
        CM_Z_UP
        + """def Xform "Room" {
            double3 xformOp:translate = (100, 200, 300)
            uniform token[] xformOpOrder = ["xformOp:translate"]
            def Volume "Mist" {
                custom color3f candelabra:fog:extinction = (0.25, 0.5, 1)
                custom color3f candelabra:fog:albedo = (0.5, 0.75, 1)
                custom float candelabra:fog:anisotropy = -0.5
                float3[] extent = [(-1, -2, -3), (1, 2, 300)]
                float3 xformOp:scale = (2, 3, 4)
                uniform token[] xformOpOrder = ["xformOp:scale"]
            }
        }"""
    )
    # The box is in the prim's own space; the coefficients are per metre, whatever the stage's unit.
    assert fog(scene, "/Room/Mist") == {
        "extinction": [0.25, 0.5, 1],
        "albedo": [0.5, 0.75, 1],
        "anisotropy": -0.5,
        "min": [-1, -2, -3],
        "max": [1, 2, 300],
    }
    corner = scene.world("/Room/Mist") @ [1, 2, 300, 1]
    assert corner[:3] == pytest.approx([1.02, 15.0, -2.06])


def test_fog_without_an_extent_is_everywhere(gltf):
    scene = gltf(f'def Volume "Mist" {{ {THICK} }}')
    assert fog(scene, "/Mist") == {"extinction": [0.5] * 3, "albedo": [1] * 3, "anisotropy": 0}


def test_a_volume_without_these_attributes_is_left_out(export):
    from conftest import Gltf

    result = export('def Volume "V" { custom color3f candelabra:fog:albedo = (1, 1, 1) }\ndef Xform "X" {}')
    assert "Volume" in result.warned()
    assert "/V" not in Gltf(result.path).by_path


def test_invisible_fog_is_left_out(gltf):
    assert "/V" not in gltf(f'def Volume "V" {{ {THICK}\n token visibility = "invisible" }}').by_path


@pytest.mark.parametrize(
    ("attributes", "what"),
    [
        ("custom float candelabra:fog:extinction = -1", "fog extinction is negative or not finite"),
        ("custom float candelabra:fog:extinction = inf", "fog extinction is negative or not finite"),
        ('custom string candelabra:fog:extinction = "thick"', "candelabra:fog:extinction is no number or colour"),
        (f"{THICK}\n float3[] extent = [(0, 0, 0), (1, 0, 1)]", "fog extent is no box"),
        (f"{THICK}\n float3[] extent = []", "fog extent is no box"),
    ],
)
def test_fog_without_sense_is_reported_and_left_out(export, attributes, what):
    from conftest import Gltf

    result = export(f'def Volume "V" {{ {attributes} }}')
    assert result.code == 0
    assert what in result.warned()
    assert "/V" not in Gltf(result.path).by_path


def test_numbers_out_of_range_are_reported_and_moved_into_it(export):
    from conftest import Gltf

    result = export(
        f"""def Volume "V" {{ {THICK}
            custom color3f candelabra:fog:albedo = (0.5, 1.5, nan)
            custom float candelabra:fog:anisotropy = -1
        }}"""
    )
    assert {"candelabra:fog:albedo out of range", "candelabra:fog:anisotropy out of range"} <= result.warned()
    written = fog(Gltf(result.path), "/V")
    assert written["albedo"] == [0.5, 1, 1]
    assert -1 < written["anisotropy"] < -0.99


def test_fog_is_as_it_is_in_the_first_frame(export):
    from conftest import Gltf

    result = export(
        """#usda 1.0
        (
            startTimeCode = 1
            endTimeCode = 3
        )
        def Volume "V" {
            custom float candelabra:fog:extinction.timeSamples = { 1: 1, 3: 3 }
            rel field:density = </V/D>
        }"""
    )
    assert {"animated candelabra:fog:extinction", "density field"} <= result.warned()
    assert fog(Gltf(result.path), "/V")["extinction"] == [1] * 3
