"""Pictures of lights and of what glows: any format and range, never brighter than authored."""

import io

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from conftest import HEADER, Gltf
from test_materials import surface, texture
from usd_gltf.baking import bake
from usd_gltf.pictures import decode, linear_from_srgb

ANIMATED = HEADER.replace("metersPerUnit = 1", "metersPerUnit = 1\n    startTimeCode = 1\n    endTimeCode = 3")


def write_exr(path, channels, **header) -> None:
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage, **header}
    arrays = {name: np.asarray(values, np.float32) for name, values in channels.items()}
    OpenEXR.File(header, arrays).write(str(path))


def write_hdr(path, light) -> None:
    """Radiance RGBE without run lengths."""
    height, width, _ = light.shape
    top = light.max(axis=2)
    _, exponent = np.frexp(np.maximum(top, 1e-30))
    code = np.zeros((height, width, 4), np.uint8)
    code[:, :, :3] = np.floor(light * np.exp2(8.0 - exponent)[:, :, None])
    code[:, :, 3] = exponent + 128
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    path.write_bytes(head.encode() + code.tobytes())


RECT = 'def RectLight "L" { asset inputs:texture:file = @%s@\n float inputs:intensity = 3 }'


def ramp(top: float, height=32, width=64) -> np.ndarray:
    """A picture whose light runs over four decades, another way in each channel."""
    y, x = np.mgrid[:height, :width]
    u, v = (x + 0.5) / width, (y + 0.5) / height
    return np.stack([top * 10 ** (-4 * u), top * v**2, np.full_like(u, 0.23 * top)], axis=2)


@pytest.mark.parametrize("top", [0.2, 1.0, 40.0, 6e4])
@pytest.mark.parametrize("suffix", ["exr", "hdr"])
def test_a_rect_light_of_any_range_keeps_its_light(export, tmp_path, suffix, top):
    light = ramp(top)
    if suffix == "exr":
        write_exr(tmp_path / "p.exr", {"RGB": light})
    else:
        write_hdr(tmp_path / "p.hdr", light)
        light = decode((tmp_path / "p.hdr").read_bytes()).texels[:, :, :3].astype(float)
    result = export(RECT % f"p.{suffix}", "--strict")
    assert result.code == 0, result.err
    assert "picture of a light baked" in result.noted()
    shown = Gltf(result.path).light_map("/L")
    assert shown.mean(axis=(0, 1)) == pytest.approx(3 * light.mean(axis=(0, 1)), rel=1e-5)
    # Every neighbourhood of 8 x 8 texels, however dark, is right within what dither leaves.
    for block, expected in zip(blocks(shown), 3 * blocks(light), strict=True):
        assert block == pytest.approx(expected, rel=0.05, abs=2e-5 * top)


def blocks(light: np.ndarray) -> np.ndarray:
    height, width, _ = light.shape
    return light.reshape(height // 8, 8, width // 8, 8, 3).mean(axis=(1, 3)).reshape(-1, 3)


@pytest.mark.parametrize("decades", range(0, 10, 3))
def test_baking_is_exact_in_total_and_says_how_coarse_it_is(decades):
    light = np.full((64, 64, 3), 10.0**-decades)
    light[5, 7] = 1.0
    baked = bake(light)
    code = np.asarray(Image.open(io.BytesIO(baked.png)).convert("RGB"), float) / 255
    shown = linear_from_srgb(code) * baked.factor
    assert shown.sum(axis=(0, 1)) == pytest.approx(light.sum(axis=(0, 1)), rel=1e-9)
    assert (baked.grain > 0.1) == (decades == 3), "where the dark part has both range and light"


def test_a_picture_with_a_sun_in_it_is_reported_as_coarse(export, tmp_path):
    light = np.full((64, 64, 3), 1.0)
    light[5, 7] = 1e6
    light[6:30] = 100.0
    write_exr(tmp_path / "p.exr", {"RGB": light})
    result = export(RECT % "p.exr")
    assert "picture of a light baked coarsely" in result.warned("lights")
    shown = Gltf(result.path).light_map("/L")
    assert shown.mean(axis=(0, 1)) == pytest.approx(3 * light.mean(axis=(0, 1)), rel=1e-5)


def test_tiff_and_other_formats_become_png(gltf, tmp_path):
    Image.new("RGB", (4, 4), (188, 10, 0)).save(tmp_path / "p.tif")
    scene = gltf(RECT % "p.tif")
    assert scene.light_map("/L")[0, 0] == pytest.approx(3 * linear_from_srgb(np.array([188, 10, 0]) / 255), rel=1e-6)


UNREADABLE = ["missing.exr", "broken.exr", "text.tx", "folder.exr", "deep.psd"]


@pytest.mark.parametrize("name", UNREADABLE)
@pytest.mark.parametrize("kind", ["RectLight", "DomeLight"])
def test_a_light_whose_picture_cannot_be_read_is_dark_and_an_error_under_strict(export, tmp_path, name, kind):
    (tmp_path / "broken.exr").write_bytes(b"\x76\x2f\x31\x01 and so on")
    (tmp_path / "text.tx").write_text("no picture")
    (tmp_path / "deep.psd").write_bytes(b"8BPS\0\1")
    (tmp_path / "folder.exr").mkdir()
    text = f'def {kind} "L" {{ asset inputs:texture:file = @{name}@\n float inputs:intensity = 3 }}'
    result = export(text)
    assert result.code == 0
    assert name in result.said() and "left dark" in result.said()
    scene = Gltf(result.path)
    if kind == "DomeLight":
        assert scene.lux("/L")["radiance"] == [0, 0, 0]
        assert "texture" not in scene.lux("/L")
    else:
        assert "mesh" not in scene.node("/L")
    assert export(text, "--strict=lights").code == 1
    assert export(text, "--strict=materials,cameras").code == 0


def test_what_a_message_says_of_a_file_is_what_is_so(export, tmp_path):
    (tmp_path / "folder.exr").mkdir()
    assert "folder.exr is a folder" in export(RECT % "folder.exr").said()
    assert "gone.exr cannot be found" in export(RECT % "gone.exr").said()


# -- what an OpenEXR file says of itself -------------------------------------------------------------

ACES = (0.7347, 0.2653, 0.0, 1.0, 0.0001, -0.077, 0.32168, 0.33767)


def test_chromaticities_are_brought_to_rec_709(gltf, tmp_path):
    write_exr(tmp_path / "p.exr", {"RGB": np.full((4, 4, 3), 0.5)}, chromaticities=ACES)
    assert gltf(RECT % "p.exr").light_map("/L")[0, 0] == pytest.approx([1.5] * 3, rel=1e-3), "white stays white"
    write_exr(tmp_path / "q.exr", {"RGB": np.broadcast_to([0.2, 0.3, 0.1], (4, 4, 3)).copy()}, chromaticities=ACES)
    # AP0 to Rec. 709 with Bradford adaptation (colour-science's matrix_RGB_to_RGB).
    matrix = [[2.5216, -1.1341, -0.3876], [-0.2765, 1.3727, -0.0962], [-0.0154, -0.1530, 1.1684]]
    expected = 3 * np.array(matrix) @ [0.2, 0.3, 0.1]
    assert gltf(RECT % "q.exr").light_map("/L")[0, 0] == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("name", ["Y", "R", "luminance"])
def test_a_picture_of_one_channel_is_grey(gltf, tmp_path, name):
    write_exr(tmp_path / "p.exr", {name: np.full((4, 4), 0.25)})
    assert gltf(RECT % "p.exr").light_map("/L")[0, 0] == pytest.approx([0.75] * 3)


def test_a_data_window_stands_in_its_display_window(gltf, tmp_path):
    write_exr(
        tmp_path / "p.exr",
        {"RGB": np.full((2, 4, 3), 1.0)},
        dataWindow=(np.array([2, 1], np.int32), np.array([5, 2], np.int32)),
        displayWindow=(np.array([0, 0], np.int32), np.array([7, 3], np.int32)),
    )
    shown = gltf(RECT % "p.exr").light_map("/L")
    assert shown.shape == (4, 8, 3)
    assert shown[1:3, 2:6].min() == pytest.approx(3) and shown.sum() == pytest.approx(3 * 8 * 3)


REFUSED = {
    "cube": ({"RGB": np.ones((12, 2, 3))}, {"envmap": OpenEXR.ENVMAP_CUBE}, "cube map"),
    "layers": ({"beauty.R": np.ones((2, 4)), "beauty.G": np.ones((2, 4)), "Z": np.ones((2, 4))}, {}, "beauty.R"),
    "no colours": ({"RGB": np.ones((2, 4, 3))}, {"chromaticities": (0.3,) * 8}, "chromaticities"),
}


@pytest.mark.parametrize("case", REFUSED)
@pytest.mark.parametrize("kind", ["RectLight", "DomeLight"])
def test_what_is_no_flat_picture_is_refused_clearly(export, tmp_path, case, kind):
    channels, header, hint = REFUSED[case]
    write_exr(tmp_path / "p.exr", channels, **header)
    result = export(f'def {kind} "L" {{ asset inputs:texture:file = @p.exr@ }}')
    assert "picture of a light that cannot be read" in result.warned("lights")
    assert hint in result.said()


@pytest.mark.parametrize("layout", ["mirroredBall", "angular", "cubeMapVerticalCross"])
@pytest.mark.parametrize("prefix", ["", "inputs:"])
def test_domes_of_other_layouts_are_dark_and_say_so(export, tmp_path, layout, prefix):
    Image.new("RGB", (4, 2), (255, 0, 0)).save(tmp_path / "p.png")
    result = export(f'def DomeLight "L" {{ asset {prefix}texture:file = @p.png@\n token {prefix}texture:format = "{layout}" }}')
    assert f"texture:format {layout}" in result.warned("lights")
    assert Gltf(result.path).lux("/L")["radiance"] == [0, 0, 0]


@pytest.mark.parametrize(("size", "crossed"), [((6, 8), True), ((8, 6), True), ((8, 8), False), ((8, 4), None)])
def test_a_dome_picture_of_odd_shape_is_listed_and_a_cross_warned_of(export, tmp_path, size, crossed):
    Image.new("RGB", size, (255, 0, 0)).save(tmp_path / "p.png")
    result = export('def DomeLight "L" { asset inputs:texture:file = @p.png@ }')
    what = "dome picture that is not twice as wide as high"
    assert (what in result.warned("lights"), what in result.noted()) == (crossed is True, crossed is False)


# -- sequences, surfaces that glow, tiles ------------------------------------------------------------


@pytest.mark.parametrize("kind", ["RectLight", "DomeLight"])
def test_a_sequence_has_the_brightness_of_each_of_its_pictures(export, tmp_path, kind):
    for frame, level in ((1, 255), (2, 128), (3, 0)):
        Image.new("RGB", (4, 2), (level, level, level)).save(tmp_path / f"p{frame}.png")
    samples = ", ".join(f"{frame}: @p{frame}.png@" for frame in (1, 2, 3))
    result = export(ANIMATED + f'def {kind} "L" {{ asset inputs:texture:file.timeSamples = {{ {samples} }} }}')
    lux = Gltf(result.path).lux("/L")
    expected = linear_from_srgb(np.array([255, 128, 0]) / 255)
    assert np.array(lux["values"]["rgb"])[:, 0] == pytest.approx(expected, rel=1e-6)
    assert "animated inputs:texture:file" in result.warned("lights")


GLOW = "color3f inputs:emissiveColor.connect = </Mat/T.outputs:rgb>"


@pytest.mark.parametrize("top", [0.5, 30.0, 5e3])
def test_emissive_pictures_of_any_range_keep_their_light(export, tmp_path, top):
    light = ramp(top)
    write_exr(tmp_path / "e.exr", {"RGB": light})
    result = export(surface(GLOW, texture("T", "e.exr", "float4 inputs:scale = (2, 1, 1, 1)")), "--strict")
    assert result.code == 0, result.err
    shown = Gltf(result.path).light_map("/M")
    assert shown.mean(axis=(0, 1)) == pytest.approx(light.mean(axis=(0, 1)) * [2, 1, 1], rel=1e-5)


def test_an_emissive_picture_of_codes_with_a_bias_keeps_its_light(gltf, tmp_path):
    Image.new("RGB", (4, 4), (128, 128, 128)).save(tmp_path / "e.png")
    scene = gltf(surface(GLOW, texture("T", "e.png", "float4 inputs:scale = (4, 4, 4, 1)\n float4 inputs:bias = (1, 1, 1, 0)")))
    assert scene.light_map("/M").mean(axis=(0, 1)) == pytest.approx([1 + 4 * float(linear_from_srgb(np.array(128 / 255)))] * 3, rel=1e-5)


def test_a_missing_emissive_picture_is_a_matter_of_lights(export):
    result = export(surface(GLOW, texture("T", "gone.png", "float4 inputs:fallback = (0, 0, 0, 1)")))
    assert "missing texture" in result.warned("lights")
    assert Gltf(result.path).nits("/M") == pytest.approx([0, 0, 0])


def test_udim_tiles_become_one_image(export, tmp_path):
    from test_materials import QUAD

    for tile, level in ((1002, 255), (1013, 51)):
        Image.new("RGB", (4, 4), (level, 0, 0)).save(tmp_path / f"e.{tile}.png")
    quad = QUAD.replace("(0, 0), (1, 0), (1, 1), (0, 1)] (", "(1.2, 0.2), (1.8, 0.2), (1.8, 0.8), (1.2, 0.8)] (")
    text = surface(GLOW, texture("T", "e.<UDIM>.png")).replace(QUAD, quad)
    result = export(text, "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    codes = scene.image(scene.material("/M")["emissiveTexture"])
    assert codes.shape == (8, 8, 3)
    # Columns 1 and 2, rows 0 and 1: tile 1002 is at the lower left, 1013 at the upper right.
    assert codes[4:, :4, 0] == pytest.approx(1.0) and codes[:4, 4:, 0] == pytest.approx(0.2)
    assert codes[:4, :4].max() == 0
    transform = scene.material("/M")["emissiveTexture"]["extensions"]["KHR_texture_transform"]
    uv = scene.attribute("/M", "TEXCOORD_0") * transform["scale"] + transform["offset"]
    assert uv[:, 0].min() > 0 and uv[:, 0].max() < 0.5 and uv[:, 1].min() > 0.5 and uv[:, 1].max() < 1
