"""Images and texture coordinates of MaterialX's networks."""

import math

import numpy as np
import OpenEXR
import pytest
from conftest import Gltf
from networks import extension, image, linear, link, network, node
from PIL import Image
from test_materials import picture, pixels
from usd_gltf import network_images, pictures
from usd_gltf.color_spaces import to_rec709


def test_a_file_that_gltf_can_read_is_passed_on(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    scene = gltf(network(link("base_color", "I"), image("I", "a.png")))
    surface = scene.material("/M")["pbrMetallicRoughness"]
    view = scene.json["bufferViews"][scene.json["images"][0]["bufferView"]]
    data = scene.buffer[view["byteOffset"] : view["byteOffset"] + view["byteLength"]]
    assert data == (tmp_path / "a.png").read_bytes()
    assert surface.get("baseColorFactor", [1] * 4) == pytest.approx([1] * 4)
    assert "extensions" not in surface["baseColorTexture"]


def test_weights_become_factors(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    text = (
        "float inputs:base = 0.5\n float inputs:emission = 8\n" + link("base_color", "I") + link("emission_color", "I")
    )
    scene = gltf(network(text, image("I", "a.png")))
    material = scene.material("/M")
    assert material["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([0.5] * 3)
    assert scene.nits("/M") == pytest.approx([8] * 3)
    assert len(scene.json["images"]) == 1
    assert scene.light_map("/M")[0, 0] == pytest.approx(8 * linear(np.array([200, 100, 50]) / 255), rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "space", "expected"),
    [
        ("color3", "", 128 / 255), ("color3", "srgb_texture", 128 / 255), ("color3", "raw", None),
        ("color3", "lin_rec709", None), ("color3", "g22_rec709", "2.2"),
    ],
)  # fmt: skip
def test_color_spaces_of_files(gltf, tmp_path, kind, space, expected):
    picture(tmp_path / "a.png", 128, 128, 128)
    meta = f'(colorSpace = "{space}")' if space else ""
    shader = node("I", f"ND_image_{kind}", f"asset inputs:file = @a.png@ {meta}")
    scene = gltf(network(link("base_color", "I"), shader))
    code = pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[0, 0, 0] / 255
    light = {None: 128 / 255, "2.2": (128 / 255) ** 2.2}.get(expected, linear(np.array(128 / 255)))
    assert linear(np.array(code)) == pytest.approx(light, abs=3e-3)


def test_numbers_of_float_images_are_not_decoded(gltf, tmp_path):
    picture(tmp_path / "a.png", 10, 128, 30)
    scene = gltf(
        network(
            link("specular_roughness", "E", "float") + link("metalness", "I", "float"),
            image("I", "a.png", "float")
            + image("V", "a.png", "vector3")
            + node(
                "E", "ND_extract_vector3", "int inputs:index = 1\n" + link("in", "V", "float3"), "float outputs:out"
            ),
        )
    )
    info = scene.material("/M")["pbrMetallicRoughness"]["metallicRoughnessTexture"]
    assert pixels(scene, info)[0, 0, 1:3].tolist() == [128, 10]


def test_colors_of_other_spaces_are_converted(gltf):
    text = 'color3f inputs:base_color = (0.5, 0.5, 0.5) (colorSpace = "srgb_texture")\n float inputs:base = 1'
    surface = gltf(network(text)).material("/M")["pbrMetallicRoughness"]
    assert surface["baseColorFactor"][0] == pytest.approx(float(linear(np.array(0.5))), abs=1e-6)
    white = gltf(network('color3f inputs:base_color = (1, 1, 1) (colorSpace = "acescg")')).material("/M")
    assert white["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx([1, 1, 1], abs=1e-4)


def transformed(info: dict, u: float, v: float) -> tuple[float, float]:
    """Where a glTF texture is read for USD's coordinates, in USD's coordinates."""
    found = info.get("extensions", {}).get("KHR_texture_transform", {})
    (sx, sy), angle, (ox, oy) = found.get("scale", (1, 1)), found.get("rotation", 0.0), found.get("offset", (0, 0))
    x, y = sx * u, sy * (1 - v)
    return math.cos(angle) * x + math.sin(angle) * y + ox, 1 - (-math.sin(angle) * x + math.cos(angle) * y + oy)


PLACE = "float2 inputs:pivot = (0.5, 0.25)\n float2 inputs:scale = (2, 4)\n float inputs:rotate = 30\n float2 inputs:offset = (0.1, 0.2)\n"


def placed(u: float, v: float) -> tuple[float, float]:
    """MaterialX's place2d with PLACE, operationorder 0."""
    x, y = (u - 0.5) / 2, (v - 0.25) / 4
    c, s = math.cos(math.radians(30)), math.sin(math.radians(30))
    return c * x + s * y - 0.1 + 0.5, -s * x + c * y - 0.2 + 0.25


TEXCOORD = node("T", "ND_texcoord_vector2", "", "float2 outputs:out")
TILED = node(
    "I",
    "ND_tiledimage_color3",
    "asset inputs:file = @a.png@\n float2 inputs:uvtiling = (3, 2)\n float2 inputs:uvoffset = (0.5, 0.25)",
)
PLACED = (
    image("I", "a.png", extra=link("texcoord", "P", "float2"))
    + node("P", "ND_place2d_vector2", PLACE + link("texcoord", "T", "float2"), "float2 outputs:out")
    + TEXCOORD
)
COMPUTED = (
    image("I", "a.png", extra=link("texcoord", "A", "float2"))
    + node("A", "ND_add_vector2", "float2 inputs:in2 = (0.25, 0)\n" + link("in1", "X", "float2"), "float2 outputs:out")
    + node("X", "ND_multiply_vector2", "float2 inputs:in2 = (-2, 5)\n" + link("in1", "T", "float2"), "float2 outputs:out")
    + TEXCOORD
)


@pytest.mark.parametrize(
    ("shaders", "expected"),
    [
        (TILED, lambda u, v: (3 * u - 0.5, 2 * v - 0.25)),
        (PLACED, placed),
        (COMPUTED, lambda u, v: (-2 * u + 0.25, 5 * v)),
    ],
)
def test_affine_coordinates_become_a_texture_transform(gltf, tmp_path, shaders, expected):
    picture(tmp_path / "a.png", 200, 100, 50)
    info = gltf(network(link("base_color", "I"), shaders)).material("/M")["pbrMetallicRoughness"]["baseColorTexture"]
    for u, v in ((0, 0), (1, 0), (0, 1), (0.3, 0.7)):
        assert transformed(info, u, v) == pytest.approx(expected(u, v), abs=1e-6)


SHEARED = (
    node("C", "ND_combine2_vector2", link("in1", "X", "float") + link("in2", "Sum", "float"), "float2 outputs:out")
    + node("Sum", "ND_add_float", link("in1", "X", "float") + link("in2", "Y", "float"), "float outputs:out")
    + node("X", "ND_extract_vector2", link("in", "T", "float2"), "float outputs:out")
    + node("Y", "ND_extract_vector2", "int inputs:index = 1\n" + link("in", "T", "float2"), "float outputs:out")
)
BENT = node("C", "ND_power_vector2", "float2 inputs:in2 = (2, 2)\n" + link("in1", "T", "float2"), "float2 outputs:out")
PLACES = node("C", "ND_position_vector3", "", "float3 outputs:out")


@pytest.mark.parametrize(
    ("coordinates", "why"),
    [(SHEARED, "sheared"), (BENT, "computed of other things"), (PLACES, "computed of other things")],
)
def test_other_coordinates_are_lost(export, tmp_path, coordinates, why):
    picture(tmp_path / "a.png", 200, 100, 50)
    shaders = (
        image("I", "a.png", extra=link("texcoord", "C", "float2"))
        + coordinates
        + node("T", "ND_texcoord_vector2", "", "float2 outputs:out")
    )
    result = export(network(link("base_color", "I"), shaders))
    assert result.code == 0
    assert result.warned("materials") == {"standard_surface base_color"}
    assert why in result.said()


def test_wraps_and_uv_sets(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    extra = 'string inputs:uaddressmode = "clamp"\n string inputs:vaddressmode = "mirror"\n' + link(
        "texcoord", "U", "float2"
    )
    shaders = image("I", "a.png", extra=extra) + node(
        "U", "ND_geompropvalue_vector2", 'string inputs:geomprop = "map2"', "float2 outputs:out"
    )
    result = gltf(network(link("base_color", "I"), shaders))
    sampler = result.json["samplers"][0]
    assert (sampler["wrapS"], sampler["wrapT"]) == (33071, 33648)


def test_images_on_the_same_coordinates_are_computed_texel_by_texel(gltf, tmp_path):
    random = np.random.default_rng(7)
    a, b = (random.integers(0, 256, (8, 8, 3), dtype=np.uint8) for _ in range(2))
    Image.fromarray(a).save(tmp_path / "a.png")
    Image.fromarray(b).save(tmp_path / "b.png")
    shaders = (
        image("A", "a.png") + image("B", "b.png") + node("X", "ND_multiply_color3", link("in1", "A") + link("in2", "B"))
    )
    shaders += node("Y", "ND_mix_color3", "float inputs:mix = 0.25\n color3f inputs:fg = (1, 0, 0)\n" + link("bg", "X"))
    scene = gltf(network(link("base_color", "Y") + "float inputs:base = 1", shaders))
    found = linear(pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[:, :, :3] / 255)
    expected = 0.75 * linear(a / 255) * linear(b / 255) + 0.25 * np.array([1, 0, 0])
    assert np.abs(found - expected).max() < 5e-3


def test_images_on_different_coordinates_are_lost(export, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    tiled = node("B", "ND_tiledimage_color3", "asset inputs:file = @a.png@\n float2 inputs:uvtiling = (2, 2)")
    shaders = image("A", "a.png") + tiled + node("X", "ND_multiply_color3", link("in1", "A") + link("in2", "B"))
    result = export(network(link("base_color", "X"), shaders))
    assert result.warned("materials") == {"standard_surface base_color"}
    assert "different coordinates" in result.said()


def test_normal_maps(gltf, tmp_path):
    picture(tmp_path / "n.png", 128, 128, 255)
    shaders = image("I", "n.png", "vector3") + node(
        "N", "ND_normalmap_float", "float inputs:scale = 0.5\n" + link("in", "I", "float3"), "float3 outputs:out"
    )
    scene = gltf(network(link("normal", "N", "float3"), shaders))
    info = scene.material("/M")["normalTexture"]
    assert info["scale"] == 0.5
    assert pixels(scene, info)[0, 0].tolist() == [128, 128, 255, 255]


COATS = {
    "ND_standard_surface_surfaceshader": ("normal", "coat", "coat_normal"),
    "ND_open_pbr_surface_surfaceshader": ("geometry_normal", "coat_weight", "geometry_coat_normal"),
    "ND_gltf_pbr_surfaceshader": ("normal", "clearcoat", "clearcoat_normal"),
}


@pytest.mark.parametrize("identifier", COATS)
def test_coats_have_normal_maps_of_their_own(export, tmp_path, identifier):
    base, coat, own = COATS[identifier]
    picture(tmp_path / "n.png", 128, 128, 255)
    picture(tmp_path / "c.png", 140, 128, 250)
    shaders = "".join(
        image(f"{name}I", f"{name}.png", "vector3")
        + node(name, "ND_normalmap_float", f"float inputs:scale = {scale}\n" + link("in", f"{name}I", "float3"), "float3 outputs:out")
        for name, scale in (("n", 1.0), ("c", 0.25))
    )

    def look(*lines):
        result = export(network("\n".join(lines), shaders, identifier))
        assert not [what for what in result.warned("materials") if "normal" in what]
        scene = Gltf(result.path)
        return scene, scene.material("/M")

    on = f"float inputs:{coat} = 1"
    scene, material = look(on, link(base, "n", "float3"), link(own, "c", "float3"))
    info = extension(material, "clearcoat")["clearcoatNormalTexture"]
    assert info["scale"] == 0.25
    assert pixels(scene, info)[0, 0, :3].tolist() == [140, 128, 250]
    assert pixels(scene, material["normalTexture"])[0, 0, :3].tolist() == [128, 128, 255]
    # Without one the coat is as smooth as the mesh, in MaterialX and in glTF.
    _, material = look(on, link(base, "n", "float3"))
    assert "normalTexture" in material and "clearcoatNormalTexture" not in extension(material, "clearcoat")
    _, material = look(on, link(own, "c", "float3"))
    assert "normalTexture" not in material and "clearcoatNormalTexture" in extension(material, "clearcoat")
    # And without a coat there is nothing.
    _, material = look(f"float inputs:{coat} = 0", link(own, "c", "float3"))
    assert not extension(material, "clearcoat")


def test_the_coat_of_a_preview_surface_has_the_normals_of_all(gltf, tmp_path):
    picture(tmp_path / "n.png", 128, 128, 255)
    lines = link("normal", "N", "normal3f", "rgb") + "float inputs:clearcoat = 0.5"
    texture = """def Shader "N" {
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @n.png@
        token inputs:sourceColorSpace = "raw"
        float4 inputs:scale = (2, 2, 2, 1)
        float4 inputs:bias = (-1, -1, -1, 0)
        float3 outputs:rgb
    }"""
    scene = gltf(network(lines, texture, "UsdPreviewSurface", ""))
    material = scene.material("/M")
    assert material["normalTexture"]["index"] == extension(material, "clearcoat")["clearcoatNormalTexture"]["index"]


def test_bumps_are_lost(export):
    result = export(network(link("normal", "B", "float3"), node("B", "ND_bump_vector3", "", "float3 outputs:out")))
    assert result.warned("materials") == {"standard_surface normal"}


def test_textures_of_coats_and_specular_lobes(gltf, tmp_path):
    picture(tmp_path / "a.png", 200, 100, 50)
    text = link("specular_color", "I") + link("coat", "F", "float") + link("transmission", "F", "float")
    material = (scene := gltf(network(text, image("I", "a.png") + image("F", "a.png", "float")))).material("/M")
    color = pixels(scene, extension(material, "specular")["specularColorTexture"])[0, 0]
    assert color[:3].tolist() == [200, 100, 50]
    assert pixels(scene, extension(material, "clearcoat")["clearcoatTexture"])[0, 0, 0] == 200
    assert pixels(scene, extension(material, "transmission")["transmissionTexture"])[0, 0, 0] == 200


def test_a_missing_file_is_its_default(export, tmp_path):
    result = export(
        network(link("base_color", "I"), image("I", "gone.png", extra="color3f inputs:default = (0.1, 0.2, 0.3)"))
    )
    assert result.warned("materials") == {"missing texture"}
    assert Gltf(result.path).material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3] == pytest.approx(
        [0.1, 0.2, 0.3]
    )
    light = export(
        network("float inputs:emission = 1\n" + link("emission_color", "I"), image("I", "gone.png")), out="light.glb"
    )
    assert light.warned("lights") == {"missing texture"}
    empty = export(
        network(link("base_color", "I"), node("I", "ND_image_color3", "color3f inputs:default = (0.1, 0.2, 0.3)")),
        out="empty.glb",
    )
    assert empty.report["warnings"] == []


def test_primvars_are_colors_of_the_mesh(gltf):
    text = network(
        link("base_color", "P") + "float inputs:base = 0.5",
        node("P", "ND_geompropvalue_color3", 'string inputs:geomprop = "hue"'),
    )
    text = text.replace(
        "rel material",
        'color3f[] primvars:hue = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)] (interpolation = "vertex")\n rel material',
        1,
    )
    scene = gltf(text)
    assert sorted(map(tuple, scene.attribute("/M", "COLOR_0").astype(float)))[-1][:3] == pytest.approx(
        [0.5] * 3, abs=1e-2
    )


def test_checkers_repeat_and_gradients_do_not(gltf, export):
    board = node("C", "ND_checkerboard_color3", "float2 inputs:uvtiling = (4, 2)")
    scene = gltf(network(link("base_color", "C"), board))
    found = pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[:, :, 0]
    height, width = found.shape
    # The first square at (0, 0) is the second colour, black; v runs up.
    assert found[height - 1, 0] == 0 and found[height - 1, width // 4] == 255 and found[0, 0] == 255
    assert (found == 255).mean() == 0.5
    result = export(
        network(link("base_color", "R"), node("R", "ND_ramplr_color3", "color3f inputs:valuer = (1, 1, 1)")),
        out="ramp.glb",
    )
    assert "does not repeat" in result.said()


@pytest.mark.parametrize("is_named", [False, True])
def test_primaries_of_a_file_are_converted_once(gltf, tmp_path, is_named):
    ap1 = (0.713, 0.293, 0.165, 0.830, 0.128, 0.044, 0.32168, 0.33767)
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    header |= {"chromaticities": ap1} if is_named else {}
    color = np.broadcast_to(np.array([0.5, 0.25, 0.125], np.float32), (4, 4, 3)).copy()
    OpenEXR.File(header, {"RGB": color}).write(str(tmp_path / "a.exr"))
    shader = node("I", "ND_image_color3", 'asset inputs:file = @a.exr@ (colorSpace = "acescg")')
    scene = gltf(network("float inputs:base = 1\n" + link("base_color", "I"), shader))
    code = pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[0, 0, :3] / 255
    expected = to_rec709("acescg", np.array([0.5, 0.25, 0.125]))
    assert linear(code) == pytest.approx(expected, abs=6e-3)


# -- memory and time -----------------------------------------------------------------------------


def squared(index: int, file: str, extra: str = "") -> str:
    """A quad under a material of its own, whose base colour is the square of an image."""
    shaders = image("I", file, extra=extra) + node("X", "ND_multiply_color3", link("in1", "I") + link("in2", "I"))
    text = network(link("base_color", "X") + "float inputs:base = 1", shaders)
    return text.replace('"Mat"', f'"Mat{index}"').replace("/Mat", f"/Mat{index}").replace('Mesh "M"', f'Mesh "M{index}"') + "\n"


@pytest.fixture
def opened(monkeypatch):
    """What the exporter decodes, and the images that it keeps."""

    class Opened:
        decoded: list[bytes] = []
        images: list[network_images.NetworkImages] = []
        most = 0

    found = Opened()
    found.decoded, found.images = [], []
    decode, start, put = pictures.decode, network_images.NetworkImages.__init__, network_images.Kept.put

    def decoding(data):
        found.decoded.append(data)
        return decode(data)

    def starting(self, *arguments):
        start(self, *arguments)
        found.images.append(self)

    def putting(self, *arguments):
        put(self, *arguments)
        found.most = max(found.most, self.bytes)

    monkeypatch.setattr(pictures, "decode", decoding)
    monkeypatch.setattr(network_images.NetworkImages, "__init__", starting)
    monkeypatch.setattr(network_images.Kept, "put", putting)
    return found


def test_a_file_that_many_materials_read_is_decoded_once(gltf, tmp_path, opened):
    picture(tmp_path / "a.png", 200, 100, 50)
    scene = gltf("".join(squared(index, "a.png") for index in range(100)))
    assert len(opened.decoded) == 1
    for index in (0, 99):
        code = pixels(scene, scene.material(f"/M{index}")["pbrMetallicRoughness"]["baseColorTexture"])[0, 0, :3] / 255
        assert linear(code) == pytest.approx(linear(np.array([200, 100, 50]) / 255) ** 2, abs=5e-3)


def test_reads_of_one_file_that_differ_are_kept_apart(gltf, tmp_path):
    """In colour space, in coordinates and in wraps."""
    picture(tmp_path / "a.png", 200, 100, 50)
    raw = squared(0, "a.png").replace("@a.png@", '@a.png@ (colorSpace = "raw")')
    clamped = squared(2, "a.png", 'string inputs:uaddressmode = "clamp"\n')
    tiled = squared(3, "a.png", "float2 inputs:uvtiling = (2, 2)\n").replace("ND_image_color3", "ND_tiledimage_color3")
    scene = gltf(raw + squared(1, "a.png") + clamped + tiled)
    infos = [scene.material(f"/M{index}")["pbrMetallicRoughness"]["baseColorTexture"] for index in range(4)]
    codes = [float(linear(pixels(scene, info)[0, 0, 0] / 255)) for info in infos]
    once = float(linear(np.array(200 / 255)))
    assert codes == pytest.approx([(200 / 255) ** 2, once**2, once**2, once**2], abs=5e-3)
    samplers = [scene.json["samplers"][scene.json["textures"][info["index"]]["sampler"]] for info in infos]
    assert [sampler["wrapS"] for sampler in samplers] == [10497, 10497, 33071, 10497]
    assert ["extensions" in info for info in infos] == [False, False, False, True]


@pytest.mark.parametrize("suffix", ["png", "exr"])
def test_what_is_kept_of_many_images_is_bounded(export, tmp_path, opened, monkeypatch, suffix):
    random = np.random.default_rng(3)
    for index in range(12):
        texels = random.random((16, 16, 3), dtype=np.float32)
        if suffix == "png":
            Image.fromarray((texels * 255).astype(np.uint8)).save(tmp_path / f"{index}.png")
        else:
            header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
            OpenEXR.File(header, {"RGB": texels}).write(str(tmp_path / f"{index}.exr"))
    # Each file is read by two materials, far from each other.
    text = "".join(squared(index, f"{index % 12}.{suffix}") for index in range(24))
    whole = export(text, out="whole.glb")
    assert len(opened.decoded) == 12
    opened.most = 0
    limit = 3 * 16 * 16 * 4 * 4
    monkeypatch.setattr(network_images, "_MOST_BYTES", limit)
    few = export(text, out="few.glb")
    assert len(opened.decoded) == 12 + 24
    assert 0 < opened.images[-1].kept.bytes <= limit
    assert opened.most <= limit
    assert Gltf(few.path).buffer == Gltf(whole.path).buffer


def test_one_picture_beyond_the_bound_is_kept_while_it_is_read(export, tmp_path, opened, monkeypatch):
    picture(tmp_path / "a.png", 200, 100, 50)
    monkeypatch.setattr(network_images, "_MOST_BYTES", 0)
    result = export(squared(0, "a.png"))
    assert result.code == 0, result.err
    assert len(opened.decoded) == 1


def test_a_missing_file_is_reported_for_each_material(export):
    result = export("".join(squared(index, "gone.png") for index in range(3)))
    lines = [line["path"] for line in result.report["warnings"] if line["what"] == "missing texture"]
    assert lines == ["/Mat0", "/Mat1", "/Mat2"]
