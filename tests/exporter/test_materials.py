"""UsdPreviewSurface to metallic-roughness, textures included."""

import io
import math

import numpy as np
import pytest
from PIL import Image
from usd_gltf.textures import flipped_transform

QUAD = """def Mesh "M" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
    texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (interpolation = "vertex")
    rel material:binding = </Mat>
}
"""


def surface(inputs: str, shaders: str = "", shader_id: str = "UsdPreviewSurface") -> str:
    return (
        QUAD
        + f"""def Material "Mat" {{
            token outputs:surface.connect = </Mat/S.outputs:surface>
            def Shader "S" {{
                uniform token info:id = "{shader_id}"
                {inputs}
                token outputs:surface
            }}
            {shaders}
        }}"""
    )


def texture(name: str, file: str, extra: str = "") -> str:
    return f"""def Shader "{name}" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @{file}@
        {extra}
        float outputs:r
        float outputs:g
        float outputs:b
        float outputs:a
        float3 outputs:rgb
    }}
    """


def picture(path, *color, size=(4, 4)) -> None:
    mode = {1: "L", 3: "RGB", 4: "RGBA"}[len(color)]
    Image.new(mode, size, color if len(color) > 1 else color[0]).save(path)


def pixels(scene, info) -> np.ndarray:
    image = scene.json["images"][scene.json["textures"][info["index"]]["source"]]
    view = scene.json["bufferViews"][image["bufferView"]]
    data = scene.buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    return np.asarray(Image.open(io.BytesIO(data)).convert("RGBA"))


def test_constants(gltf):
    scene = gltf(
        surface(
            """color3f inputs:diffuseColor = (0.1, 0.2, 0.3)
            float inputs:metallic = 0.7
            float inputs:roughness = 0.4
            float inputs:opacity = 0.5
            float inputs:ior = 1.33
            float inputs:clearcoat = 0.25
            color3f inputs:emissiveColor = (2, 4, 0)"""
        )
    )
    material = scene.material("/M")
    assert material["name"] == "Mat"
    assert material["pbrMetallicRoughness"] == {
        "baseColorFactor": pytest.approx([0.1, 0.2, 0.3, 0.5]),
        "metallicFactor": pytest.approx(0.7),
        "roughnessFactor": pytest.approx(0.4),
    }
    assert material["alphaMode"] == "BLEND"
    assert scene.nits("/M") == pytest.approx([2, 4, 0])
    assert material["extensions"]["KHR_materials_ior"]["ior"] == pytest.approx(1.33)
    assert material["extensions"]["KHR_materials_clearcoat"]["clearcoatFactor"] == pytest.approx(0.25)
    assert "TEXCOORD_0" not in scene.primitives("/M")[0]["attributes"], "no scene asks for it"


def test_defaults_are_the_specifications(gltf):
    material = gltf(surface("")).material("/M")
    assert material["pbrMetallicRoughness"]["baseColorFactor"] == pytest.approx([0.18, 0.18, 0.18, 1])
    assert material["pbrMetallicRoughness"]["roughnessFactor"] == 0.5


def test_opacity_threshold_is_a_mask(gltf):
    material = gltf(surface("float inputs:opacity = 0.5\n float inputs:opacityThreshold = 0.3")).material("/M")
    assert (material["alphaMode"], material["alphaCutoff"]) == ("MASK", pytest.approx(0.3))


def test_interfaces_are_followed(gltf):
    text = QUAD + """def Material "Mat" {
        color3f inputs:tint = (0.9, 0.8, 0.7)
        token outputs:surface.connect = </Mat/S.outputs:surface>
        def Shader "S" {
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </Mat.inputs:tint>
            token outputs:surface
        }
    }"""
    assert gltf(text).material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([0.9, 0.8, 0.7])


def test_a_color_texture_is_passed_on_and_v_is_flipped(gltf, tmp_path):
    picture(tmp_path / "c.png", 10, 20, 30)
    scene = gltf(
        surface(
            "color3f inputs:diffuseColor.connect = </Mat/T.outputs:rgb>",
            texture("T", "c.png", 'token inputs:wrapS = "clamp"\n token inputs:wrapT = "mirror"'),
        )
    )
    info = scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"]
    assert pixels(scene, info)[0, 0].tolist() == [10, 20, 30, 255]
    assert scene.json["samplers"] == [{"wrapS": 33071, "wrapT": 33648}]
    uv, position = scene.attribute("/M", "TEXCOORD_0"), scene.attribute("/M", "POSITION")
    assert uv == pytest.approx(np.stack([position[:, 0], 1 - position[:, 1]], axis=1))


def test_roughness_and_metallic_are_packed(gltf, tmp_path):
    picture(tmp_path / "rough.png", 51)
    picture(tmp_path / "metal.png", 204, size=(8, 8))
    scene = gltf(
        surface(
            "float inputs:roughness.connect = </Mat/R.outputs:r>\n float inputs:metallic.connect = </Mat/N.outputs:r>",
            texture("R", "rough.png") + texture("N", "metal.png", "float4 inputs:scale = (0.5, 1, 1, 1)"),
        )
    )
    surface_ = scene.material("/M")["pbrMetallicRoughness"]
    packed = pixels(scene, surface_["metallicRoughnessTexture"])
    assert packed.shape == (8, 8, 4)
    assert packed[0, 0, 1:3].tolist() == [51, 102]
    assert (surface_["metallicFactor"], surface_["roughnessFactor"]) == (1, 1)


def test_a_file_that_is_already_packed_is_passed_on(gltf, tmp_path):
    picture(tmp_path / "orm.png", 255, 100, 200)
    scene = gltf(
        surface(
            "float inputs:roughness.connect = </Mat/R.outputs:g>\n float inputs:metallic.connect = </Mat/R.outputs:b>\n"
            "float inputs:occlusion.connect = </Mat/R.outputs:r>",
            texture("R", "orm.png"),
        )
    )
    assert len(scene.json["images"]) == 1
    assert "occlusionTexture" in scene.material("/M")


def test_opacity_from_another_file_goes_into_alpha(gltf, tmp_path):
    picture(tmp_path / "c.png", 10, 20, 30)
    picture(tmp_path / "a.png", 128)
    scene = gltf(
        surface(
            "color3f inputs:diffuseColor.connect = </Mat/T.outputs:rgb>\n float inputs:opacity.connect = </Mat/A.outputs:r>",
            texture("T", "c.png") + texture("A", "a.png", 'token inputs:sourceColorSpace = "raw"'),
        )
    )
    packed = pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])
    assert packed[0, 0].tolist() == [10, 20, 30, 128]


def test_normal_maps(gltf, tmp_path):
    picture(tmp_path / "n.png", 128, 128, 255)
    scene = gltf(
        surface(
            "normal3f inputs:normal.connect = </Mat/N.outputs:rgb>",
            texture("N", "n.png", "float4 inputs:scale = (2, 2, 2, 1)\n float4 inputs:bias = (-1, -1, -1, 0)"),
        )
    )
    assert pixels(scene, scene.material("/M")["normalTexture"])[0, 0].tolist() == [128, 128, 255, 255]


def test_bright_emissive_textures_keep_their_scale(gltf, tmp_path):
    picture(tmp_path / "e.png", 255, 128, 0)
    scene = gltf(
        surface(
            "color3f inputs:emissiveColor.connect = </Mat/E.outputs:rgb>",
            texture("E", "e.png", "float4 inputs:scale = (50, 50, 50, 1)"),
        )
    )
    assert scene.nits("/M") == pytest.approx([50] * 3)
    assert "emissiveTexture" in scene.material("/M")


def test_texture_transforms_agree_with_usd():
    rotation, sx, sy, tx, ty = 30.0, 2.0, 3.0, 0.25, -0.5
    transform = flipped_transform(rotation, sx, sy, tx, ty)
    angle, (ox, oy), (gx, gy) = transform["rotation"], transform["offset"], transform["scale"]
    for u, v in [(0, 0), (1, 0), (0.3, 0.7)]:
        c, s = math.cos(math.radians(rotation)), math.sin(math.radians(rotation))
        usd = (c * sx * u - s * sy * v + tx, s * sx * u + c * sy * v + ty)
        # KHR_texture_transform: offset * rotation (counter-clockwise where v runs down) * scale.
        c, s, w = math.cos(angle), math.sin(angle), 1 - v
        gltf = (c * gx * u + s * gy * w + ox, -s * gx * u + c * gy * w + oy)
        assert gltf == pytest.approx((usd[0], 1 - usd[1]))


def test_a_texture_transform_is_carried(gltf, tmp_path):
    picture(tmp_path / "c.png", 10, 20, 30)
    scene = gltf(
        surface(
            "color3f inputs:diffuseColor.connect = </Mat/T.outputs:rgb>",
            texture("T", "c.png", "float2 inputs:st.connect = </Mat/X.outputs:result>")
            + """def Shader "X" {
                uniform token info:id = "UsdTransform2d"
                float2 inputs:scale = (2, 2)
                float2 outputs:result
            }""",
        )
    )
    info = scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"]
    assert info["extensions"]["KHR_texture_transform"]["scale"] == [2, 2]
    assert "KHR_texture_transform" in scene.json["extensionsUsed"]


def test_a_gltf_names_textures_inside_its_folder_only(gltf, tmp_path):
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "here").mkdir()
    picture(tmp_path / "elsewhere" / "c.png", 10, 20, 30)
    text = surface(
        "color3f inputs:diffuseColor.connect = </Mat/T.outputs:rgb>", texture("T", "./elsewhere/c.png")
    )
    outside = gltf(text, out="here/scene.gltf")
    assert outside.json["images"] == [{"uri": "scene_textures/c.png"}]
    assert (tmp_path / "here" / "scene_textures" / "c.png").is_file()
    assert gltf(text, out="scene.gltf").json["images"] == [{"uri": "elsewhere/c.png"}]


def test_a_missing_texture_is_named_and_its_fallback_used(export):
    from conftest import Gltf

    text = surface(
        "color3f inputs:diffuseColor.connect = </Mat/T.outputs:rgb>",
        texture("T", "gone.png", "float4 inputs:fallback = (0.1, 0.6, 0.1, 1)"),
    )
    result = export(text)
    assert result.code == 0
    (warning,) = [w for w in result.report["warnings"] if w["what"] == "missing texture"]
    assert warning["path"] == "/Mat" and "gone.png" in warning["why"]
    base = Gltf(result.path).material("/M")["pbrMetallicRoughness"]["baseColorFactor"]
    assert base[:3] == pytest.approx([0.1, 0.6, 0.1])
    assert export(text, "--strict").code == 1


def test_unreadable_textures_are_reported(export, tmp_path):
    (tmp_path / "c.exr").write_bytes(b"\x76\x2f\x31\x01 and so on")
    result = export(surface("color3f inputs:diffuseColor.connect = </Mat/T.outputs:rgb>", texture("T", "c.exr")))
    assert result.code == 0
    assert "texture that cannot be read" in result.warned()


def test_other_formats_become_png(gltf, tmp_path):
    Image.new("RGB", (2, 2), (1, 2, 3)).save(tmp_path / "c.tga")
    scene = gltf(surface("color3f inputs:diffuseColor.connect = </Mat/T.outputs:rgb>", texture("T", "c.tga")))
    info = scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"]
    assert pixels(scene, info)[0, 0].tolist() == [1, 2, 3, 255]


@pytest.mark.parametrize("ior", ["", "float inputs:ior = 1.5", "float inputs:ior = 1", "float inputs:ior = 2.4", "float inputs:ior = 0"])
@pytest.mark.parametrize("color", [(0.04, 0.08, 0.04), (0, 0, 0), (1, 0.5, 1e-4), (0.9, 0.9, 0.9)])
def test_in_the_specular_workflow_the_specular_colour_is_what_is_reflected_straight_on(export, ior, color):
    """Whatever the index of refraction and the metalness; at grazing angles everything is."""
    from conftest import Gltf

    inputs = f"int inputs:useSpecularWorkflow = 1\n color3f inputs:specularColor = {color}\n float inputs:metallic = 1\n {ior}"
    result = export(surface(inputs), "--strict")
    assert result.code == 0, result.err
    material = Gltf(result.path).material("/M")
    index = material["extensions"].get("KHR_materials_ior", {}).get("ior", 1.5)
    specular = material["extensions"]["KHR_materials_specular"]
    assert ((index - 1) / (index + 1)) ** 2 * np.array(specular["specularColorFactor"]) == pytest.approx(color, rel=1e-5, abs=1e-9)
    assert specular["specularFactor"] == 1 and material["pbrMetallicRoughness"]["metallicFactor"] == 0


@pytest.mark.parametrize("name", ["PxrSurface", "ND_surface", "ND_gone_surfaceshader", "arnold:toon", ""])
def test_unknown_shaders_are_reported_and_look_like_display_color(export, name):
    from conftest import Gltf

    result = export(surface("", shader_id=name))
    assert (f"surface shader {name}" if name else "material without a surface shader") in result.warned()
    assert Gltf(result.path).material("/M")["pbrMetallicRoughness"]["baseColorFactor"][0] == 0.5
