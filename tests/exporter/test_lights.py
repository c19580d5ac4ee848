"""UsdLux's formulas, carriers, areas and orientations."""

import math

import numpy as np
import pytest

from conftest import HEADER

CM_Z_UP = '#usda 1.0\n(\n    metersPerUnit = 0.01\n    upAxis = "Z"\n)\n'


def test_the_default_sun_gives_3_3602_lux(gltf):
    scene = gltf('def DistantLight "Sun" {}')
    assert scene.light("/Sun")["type"] == "directional"
    assert scene.light("/Sun")["intensity"] == pytest.approx(3.3602, abs=5e-5)
    assert scene.lux("/Sun")["angle"] == pytest.approx(0.53)


@pytest.mark.parametrize(
    ("angle", "normalize", "lux"),
    [
        (0, 0, 7.0),
        (0, 1, 7.0),
        (10, 0, 7 * math.pi * math.sin(math.radians(5)) ** 2),
        (10, 1, 7.0),
        (180, 0, 7 * math.pi),
        (270, 1, 7 / (2 - math.sin(math.radians(135)) ** 2)),
    ],
)
def test_suns(gltf, angle, normalize, lux):
    scene = gltf(
        f'def DistantLight "Sun" {{ float inputs:angle = {angle}\n float inputs:intensity = 7\n'
        f" bool inputs:normalize = {normalize} }}"
    )
    assert scene.light("/Sun")["intensity"] == pytest.approx(lux, rel=1e-6)


def test_intensity_exposure_color_and_temperature_multiply(gltf):
    scene = gltf(
        """def RectLight "L" {
            float inputs:intensity = 3
            float inputs:exposure = 2
            color3f inputs:color = (1, 0.5, 0.25)
            bool inputs:enableColorTemperature = 1
            float inputs:colorTemperature = 3200
        }"""
    )
    # 1.6799, .8660, .3256 is UsdLux's blackbody at 3200 K.
    expected = 12 * np.array([1.6799, 0.8660 * 0.5, 0.3256 * 0.25])
    assert scene.nits("/L") == pytest.approx(expected, rel=2e-4)
    assert scene.lux("/L")["inputs"]["colorTemperature"] == 3200


def test_6500_kelvin_is_what_the_code_says_not_white(gltf):
    scene = gltf('def RectLight "L" { bool inputs:enableColorTemperature = 1 }')
    assert scene.nits("/L") == pytest.approx([1.0433, 0.9836, 1.0346], abs=1e-4)


AREAS = {
    "RectLight": ("float inputs:width = 2\n float inputs:height = 3", 6.0),
    "DiskLight": ("float inputs:radius = 2", 4 * math.pi),
    "SphereLight": ("float inputs:radius = 2", 16 * math.pi),
    "CylinderLight": ("float inputs:radius = 2\n float inputs:length = 3", 12 * math.pi),
}


@pytest.mark.parametrize("kind", AREAS)
@pytest.mark.parametrize("scale", [0.5, 1.0, 20.0])
def test_tessellations_have_the_lights_area(gltf, kind, scale):
    inputs, area = AREAS[kind]
    scene = gltf(f'def {kind} "L" {{ {inputs}\n float3 xformOp:scale = ({scale}, {scale}, {scale})\n'
                 ' uniform token[] xformOpOrder = ["xformOp:scale"] }')  # fmt: skip
    assert scene.area("/L") == pytest.approx(area * scale**2, rel=1e-5)


@pytest.mark.parametrize("kind", AREAS)
@pytest.mark.parametrize("scale", [0.5, 20.0])
@pytest.mark.parametrize(("unit", "divisor"), [("stage", 1.0), ("metre", 1e-4)])
def test_normalize_divides_by_the_world_area(gltf, kind, scale, unit, divisor):
    inputs, area = AREAS[kind]
    scene = gltf(
        CM_Z_UP + f'def {kind} "L" {{ {inputs}\n float inputs:intensity = 5\n bool inputs:normalize = 1\n'
        f" float3 xformOp:scale = ({scale}, {scale}, {scale})\n"
        ' uniform token[] xformOpOrder = ["xformOp:scale"] }',
        "--normalize-area",
        unit,
    )
    expected = 5 / (area * scale**2 * divisor)
    assert scene.nits("/L") == pytest.approx([expected] * 3, rel=1e-6)


def test_normalize_counts_a_non_uniform_scale(gltf):
    scene = gltf(
        """def SphereLight "L" {
            float inputs:radius = 1
            bool inputs:normalize = 1
            float3 xformOp:scale = (1, 1, 3)
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }"""
    )
    # A prolate spheroid: 2 pi a^2 (1 + c/(a e) asin e).
    e = math.sqrt(1 - 1 / 9)
    area = 2 * math.pi * (1 + 3 / e * math.asin(e))
    assert scene.nits("/L") == pytest.approx([1 / area] * 3, rel=1e-7)


def test_flat_lights_face_minus_z_and_round_ones_outward(gltf):
    scene = gltf(
        'def RectLight "Rect" {}\ndef DiskLight "Disk" {}\ndef SphereLight "Ball" {}\ndef CylinderLight "Tube" {}'
    )
    for path in ("/Rect", "/Disk"):
        assert (scene.area_vectors(path)[:, 2] < 0).all()
        assert scene.attribute(path, "NORMAL") == pytest.approx(
            np.tile([0, 0, -1], (len(scene.attribute(path, "NORMAL")), 1))
        )
    for path in ("/Ball", "/Tube"):
        centres = scene.triangles(path).mean(axis=1)
        centres[:, 0] *= path == "/Ball"
        assert (np.einsum("ti,ti->t", centres, scene.area_vectors(path)) > 0).all()
    assert np.abs(scene.area_vectors("/Tube")[:, 0]).max() < 1e-7, "no end caps"


def test_a_light_is_black_and_only_emits(gltf):
    material = gltf('def RectLight "L" { float inputs:intensity = 100 }').material("/L")
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == [0, 0, 0, 1]
    assert material["pbrMetallicRoughness"]["metallicFactor"] == 0
    assert material["pbrMetallicRoughness"]["roughnessFactor"] == 1
    assert material["extensions"]["KHR_materials_specular"] == {"specularFactor": 0}
    assert material["extensions"]["KHR_materials_emissive_strength"] == {"emissiveStrength": 100}


def test_treat_as_point_is_candela(gltf):
    scene = gltf(
        CM_Z_UP + """def SphereLight "L" {
            bool treatAsPoint = 1
            float inputs:radius = 20
            float inputs:intensity = 1000
        }"""
    )
    assert scene.light("/L")["type"] == "point"
    assert scene.light("/L")["intensity"] == pytest.approx(1000 * math.pi * 0.2**2, rel=1e-6)
    assert "mesh" not in scene.node("/L")


@pytest.mark.parametrize("radius", [0, 0.001, 4])
@pytest.mark.parametrize(("unit", "factor"), [("stage", 1e-4), ("metre", 1.0)])
def test_a_normalized_point_has_a_quarter_of_its_intensity_whatever_its_radius(gltf, radius, unit, factor):
    scene = gltf(
        CM_Z_UP + f'def SphereLight "L" {{ bool treatAsPoint = 1\n float inputs:radius = {radius}\n'
        " float inputs:intensity = 8\n bool inputs:normalize = 1 }",
        "--normalize-area",
        unit,
    )
    assert scene.light("/L")["intensity"] == pytest.approx(2 * factor, rel=1e-6)


def test_a_normalized_flat_light_without_size_keeps_its_cosine(gltf):
    scene = gltf('def DiskLight "L" { float inputs:radius = 0\n bool inputs:normalize = 1\n float inputs:intensity = 6 }')
    assert scene.light("/L")["type"] == "spot"
    assert scene.light("/L")["intensity"] == pytest.approx(6)
    assert scene.lux("/L")["shaping"] == {
        "coneAngle": 90, "coneSoftness": 0, "focus": 1, "focusTint": [0, 0, 0]
    }  # fmt: skip


def test_a_shaped_point_is_a_spot_with_its_usd_shaping(gltf):
    scene = gltf(
        """def SphereLight "L" (prepend apiSchemas = ["ShapingAPI"]) {
            bool treatAsPoint = 1
            float inputs:shaping:cone:angle = 40
            float inputs:shaping:cone:softness = 0.25
            float inputs:shaping:focus = 2
        }"""
    )
    spot = scene.light("/L")["spot"]
    assert spot["outerConeAngle"] == pytest.approx(math.radians(40))
    assert spot["innerConeAngle"] == pytest.approx(math.radians(30))
    assert scene.lux("/L")["shaping"] == {
        "coneAngle": 40, "coneSoftness": 0.25, "focus": 2, "focusTint": [0, 0, 0]
    }  # fmt: skip


def test_a_sphere_keeps_its_local_radius(gltf):
    assert gltf('def SphereLight "L" { float inputs:radius = 0.3 }').lux("/L")["radius"] == pytest.approx(0.3)


def test_domes_keep_radiance_and_texture_beside(gltf, tmp_path):
    (tmp_path / "src").mkdir()
    source = tmp_path / "src" / "dome.usda"
    source.write_text(
        '#usda 1.0\ndef DomeLight "Sky" { float inputs:intensity = 2\n asset inputs:texture:file = @sky map.hdr@\n}'
    )
    (tmp_path / "src" / "sky map.hdr").write_bytes(b"#?RADIANCE\n")
    scene = gltf(source, out="out.glb")
    assert scene.lux("/Sky")["radiance"] == [2, 2, 2]
    assert scene.lux("/Sky")["texture"] == "out_textures/sky_map.hdr"
    assert (tmp_path / "out_textures" / "sky_map.hdr").read_bytes() == b"#?RADIANCE\n"


def test_dome_1_follows_its_pole(gltf):
    scene = gltf('#usda 1.0\n(\n upAxis = "Z"\n metersPerUnit = 1\n)\ndef DomeLight_1 "Sky" {}\ndef DomeLight "Old" {}')
    # The pole (local +Y) of a scene-oriented dome on a Z-up stage ends up along glTF's +Y;
    # longitude 0 (local +Z) looks along the stage's -Y, which is glTF's +Z.
    assert scene.world("/Sky")[:3, 1] == pytest.approx([0, 1, 0], abs=1e-6)
    assert scene.world("/Sky")[:3, 2] == pytest.approx([0, 0, 1], abs=1e-6)
    assert scene.world("/Old")[:3, 1] == pytest.approx([0, 0, -1], abs=1e-6)


@pytest.mark.parametrize("bad", ["nan", "-1", "inf"])
def test_bad_emission_is_reported_and_never_written(export, bad):
    from conftest import Gltf

    result = export(f'def RectLight "L" {{ float inputs:intensity = {bad} }}')
    assert result.code == 0
    assert "emission is negative or not finite" in result.warned()
    assert "NaN" not in str(Gltf(result.path).json["materials"])


LIGHTS = ["RectLight", "DiskLight", "SphereLight", "CylinderLight", "DistantLight", "DomeLight", "DomeLight_1"]


@pytest.mark.parametrize("kind", LIGHTS)
@pytest.mark.parametrize("force", [0, 1])
def test_force_is_carried(gltf, kind, force):
    lux = gltf(f'def {kind} "L" {{ custom bool candelabra:force = {force} }}').lux("/L")
    assert lux.get("force", False) is bool(force)


def test_lights_without_a_carrier_are_reported(export):
    from conftest import Gltf

    result = export(
        """def PortalLight "P" { float inputs:width = 2 }
        def PluginLight "X" {}
        def PluginLightFilter "F" {}
        def RectLight "Filtered" {
            asset inputs:shaping:ies:file = @lamp.ies@
            rel light:filters = </F>
        }"""
    )
    assert {"PortalLight", "PluginLight", "IES profile", "light filters"} <= result.warned()  # fmt: skip
    assert Gltf(result.path).lux("/P")["inputs"] == {"width": 2}


IES = "IESNA91\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n1 0\n"


@pytest.mark.parametrize("out", ["scene.glb", "scene.gltf"])
def test_an_ies_profile_is_carried_as_a_file_beside(export, tmp_path, out):
    from conftest import Gltf

    (tmp_path / "a lamp.IES").write_text(IES)
    result = export(
        """def RectLight "Rect" (prepend apiSchemas = ["ShapingAPI"]) {
            asset inputs:shaping:ies:file = @a lamp.IES@
        }
        def SphereLight "Point" (prepend apiSchemas = ["ShapingAPI"]) {
            bool treatAsPoint = 1
            float inputs:shaping:cone:angle = 30
            float inputs:shaping:ies:angleScale = -0.5
            bool inputs:shaping:ies:normalize = 1
            asset inputs:shaping:ies:file = @a lamp.IES@
        }
        def DiskLight "Dot" {
            float inputs:radius = 0
            bool inputs:normalize = 1
            asset inputs:shaping:ies:file = @a lamp.IES@
        }
        def DistantLight "Sun" {
            asset inputs:shaping:ies:file = @a lamp.IES@
        }""",
        out=out,
    )
    scene = Gltf(result.path)
    rect, point, dot = (scene.lux(path)["shaping"] for path in ("/Rect", "/Point", "/Dot"))
    assert rect["coneAngle"] == 180 and set(rect["ies"]) == {"file"}
    assert point["coneAngle"] == 30
    assert point["ies"] == {"file": rect["ies"]["file"], "angleScale": -0.5, "normalize": True}
    # The cosine of a flat light that has become a point is in its focus.
    assert dot["focus"] == 1 and dot["coneAngle"] == 90 and dot["ies"] == rect["ies"]
    assert (result.path.parent / rect["ies"]["file"]).read_text() == IES
    assert result.warned() == {"shaping of a DistantLight"} and "shaping" not in scene.lux("/Sun")


def test_a_profile_that_is_gone_is_written_again(export, tmp_path):
    from conftest import Gltf

    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "lamp.ies").write_text(IES)
    text = """def SphereLight "L" (prepend apiSchemas = ["ShapingAPI"]) {
        asset inputs:shaping:ies:file = @in/lamp.ies@
    }"""
    first = export(text, out="out/scene.glb")
    assert "up to date" in export(text, out="out/scene.glb").out
    carried = first.path.parent / Gltf(first.path).lux("/L")["shaping"]["ies"]["file"]
    carried.unlink()
    assert "up to date" not in export(text, out="out/scene.glb").out
    assert carried.read_text() == IES


def test_a_profile_of_many_lights_is_read_once(export, tmp_path, monkeypatch):
    from conftest import Gltf
    from usd_gltf.asset_files import AssetFiles

    read, names = AssetFiles.read, []

    def reading(self, owner, attribute, *arguments):
        names.append(attribute.Get().path)
        return read(self, owner, attribute, *arguments)

    monkeypatch.setattr(AssetFiles, "read", reading)
    for name in ("a", "b"):
        (tmp_path / f"{name}.ies").write_text(IES.replace("1 0\n", f"{ord(name)} 0\n"))
    result = export(
        "".join(
            f"""def SphereLight "L{at}" (prepend apiSchemas = ["ShapingAPI"]) {{
                asset inputs:shaping:ies:file = @{"ab"[at % 2]}.ies@
                float inputs:shaping:ies:angleScale = {at}
            }}
            """
            for at in range(20)
        )
        + """def SphereLight "Gone" (prepend apiSchemas = ["ShapingAPI"]) { asset inputs:shaping:ies:file = @gone.ies@ }
        def SphereLight "Gone2" (prepend apiSchemas = ["ShapingAPI"]) { asset inputs:shaping:ies:file = @gone.ies@ }"""
    )
    assert sorted(set(names)) == ["a.ies", "b.ies", "gone.ies"]
    assert names.count("a.ies") == names.count("b.ies") == 1
    scene = Gltf(result.path)
    carried = [scene.lux(f"/L{at}")["shaping"]["ies"] for at in range(20)]
    assert [ies.get("angleScale", 0) for ies in carried] == list(range(20))
    assert len({ies["file"] for ies in carried[::2]}) == len({ies["file"] for ies in carried[1::2]}) == 1
    assert carried[0]["file"] != carried[1]["file"]
    assert [line["path"] for line in result.report["warnings"]] == ["/Gone", "/Gone2"]


def test_a_profile_over_time_is_that_of_each_frame(export, tmp_path):
    from conftest import Gltf

    (tmp_path / "lamp.ies").write_text(IES)
    result = export(
        """#usda 1.0
        (
            startTimeCode = 1
            endTimeCode = 2
        )
        def SphereLight "L" (prepend apiSchemas = ["ShapingAPI"]) {
            asset inputs:shaping:ies:file.timeSamples = { 1: @lamp.ies@, 2: @gone.ies@ }
            float inputs:shaping:ies:angleScale.timeSamples = { 1: 2, 2: 3 }
        }
        def SphereLight "Bad" (prepend apiSchemas = ["ShapingAPI"]) {
            asset inputs:shaping:ies:file = @lamp.ies@
            float inputs:shaping:ies:angleScale = inf
        }"""
    )
    scene = Gltf(result.path)
    ies = scene.lux("/L")["shaping"]["ies"]
    assert ies["angleScale"] == 2 and ies["file"].endswith("lamp.ies")
    # At frame 2 another light shines in its place, without the file that is not there.
    assert "ies" not in scene.lux("/L[shaping 2]").get("shaping", {})
    assert [scene.lux(path)["values"]["rgb"][key] for path, key in (("/L", 0), ("/L[shaping 2]", 1))] == [[1.0] * 3] * 2
    assert "angleScale" not in Gltf(result.path).lux("/Bad")["shaping"]["ies"]
    assert result.warned() == {"IES profile", "shaping:ies:angleScale is not finite"}


def test_animated_light_values(gltf):
    scene = gltf(
        """#usda 1.0
        (
            startTimeCode = 1001
            endTimeCode = 1003
            timeCodesPerSecond = 24
            metersPerUnit = 1
            upAxis = "Y"
        )
        def RectLight "L" {
            float inputs:intensity.timeSamples = { 1001: 1, 1003: 3 }
        }
        def RectLight "Same" {
            float inputs:intensity.timeSamples = { 1001: 1, 1003: 1 }
        }
        def RectLight "Grows" {
            bool inputs:normalize = 1
            float3 xformOp:scale.timeSamples = { 1001: (1, 1, 1), 1003: (2, 2, 2) }
            uniform token[] xformOpOrder = ["xformOp:scale"]
        }"""
    )
    values = scene.lux("/L")["values"]
    assert values["times"] == pytest.approx([0, 1 / 24, 2 / 24])
    assert np.array(values["rgb"]) == pytest.approx(np.array([[1] * 3, [2] * 3, [3] * 3]))
    assert "values" not in scene.lux("/Same")
    grows = np.array(scene.lux("/Grows")["values"]["rgb"])[:, 0]
    assert grows == pytest.approx([1, 1 / 2.25, 1 / 4])
    assert scene.json["asset"]["extras"]["usd"]["startTimeCode"] == 1001


def test_a_textured_light_that_is_dark_at_first_keeps_its_picture(gltf, tmp_path):
    from PIL import Image

    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "t.png")
    light = 'def RectLight "L" {{ asset inputs:texture:file = @t.png@\n float inputs:intensity{} }}'
    varying = gltf('#usda 1.0\n(\n startTimeCode = 1\n endTimeCode = 2\n)\n'
                   + light.format(".timeSamples = { 1: 0, 2: 3 }"))  # fmt: skip
    assert "emissiveTexture" in varying.material("/L")
    assert "emissiveFactor" not in varying.material("/L")
    assert varying.lux("/L")["values"]["rgb"] == [[0] * 3, [3] * 3]
    assert "emissiveTexture" not in gltf(HEADER + light.format(" = 0")).material("/L")


def test_a_textured_rect_shows_its_picture_upright_from_the_front(gltf, tmp_path):
    from PIL import Image

    Image.new("RGB", (2, 2), (255, 0, 0)).save(tmp_path / "t.png")
    scene = gltf('def RectLight "L" { asset inputs:texture:file = @t.png@ }')
    uv = scene.attribute("/L", "TEXCOORD_0")
    position = scene.attribute("/L", "POSITION")
    # The first pixel (0, 0) at (+X, +Y), the last (1, 1) at (-X, -Y).
    assert uv == pytest.approx(np.stack([0.5 - position[:, 0], 0.5 - position[:, 1]], axis=1))
    assert "emissiveTexture" in scene.material("/L")
    assert scene.json["images"][0]["mimeType"] == "image/png"
