"""MaterialX documents that stages refer to."""

import sys

import numpy as np
import pytest
from conftest import Gltf
from networks import link, network, node
from pxr import Sdf
from test_materials import QUAD, picture, pixels
from usd_gltf import materialx_layers, materialx_library

STAGE = QUAD.replace("</Mat>", "</Looks/gold>") + 'def "Looks" (references = @looks/a.mtlx@</MaterialX/Materials>) {}\n'
GOLD = """<?xml version="1.0"?>
<materialx version="1.38"{attributes}>
  {before}
  <standard_surface name="SR" type="surfaceshader">
    {inputs}
  </standard_surface>
  <surfacematerial name="gold" type="material">
    <input name="surfaceshader" type="surfaceshader" nodename="SR" />
  </surfacematerial>
</materialx>
"""
COLOR = '<input name="base_color" type="color3" value="0.1, 0.2, 0.3" />'


def document(folder, inputs: str = COLOR, before: str = "", attributes: str = "", name: str = "a.mtlx"):
    (folder / "looks").mkdir(exist_ok=True)
    path = folder / "looks" / name
    path.write_text(GOLD.format(inputs=inputs, before=before, attributes=attributes))
    return path


def base(scene: Gltf) -> list[float]:
    return scene.material("/M")["pbrMetallicRoughness"]["baseColorFactor"][:3]


def test_a_reference_composes(export, tmp_path):
    document(tmp_path)
    result = export(STAGE)
    assert result.report["warnings"] == []
    assert base(Gltf(result.path)) == pytest.approx([0.1, 0.2, 0.3])
    assert "looks/a.mtlx" in result.report["dependencies"]
    assert not [name for name in result.report["dependencies"] if "anon" in name]


def test_a_document_that_changed_is_read_again(export, tmp_path):
    path = document(tmp_path)
    export(STAGE)
    assert "up to date" in export(STAGE).out
    path.write_text(path.read_text().replace("0.1, 0.2", "0.7, 0.2"))
    result = export(STAGE)
    assert base(Gltf(result.path))[0] == pytest.approx(0.7)


@pytest.mark.parametrize("arc", ["payload", "references"])
def test_payloads_and_default_prims(gltf, tmp_path, arc):
    document(tmp_path)
    text = QUAD.replace("</Mat>", "</X/Materials/gold>") + f'def "X" (prepend {arc} = @looks/a.mtlx@) {{}}'
    assert base(gltf(text)) == pytest.approx([0.1, 0.2, 0.3])


def test_a_document_as_a_sublayer(gltf, tmp_path):
    document(tmp_path)
    text = "#usda 1.0\n( subLayers = [@looks/a.mtlx@] )\n" + QUAD.replace("</Mat>", "</MaterialX/Materials/gold>")
    assert base(gltf(text)) == pytest.approx([0.1, 0.2, 0.3])


def test_overrides_are_stronger(gltf, tmp_path):
    document(tmp_path)
    over = """def "Looks" (references = @looks/a.mtlx@</MaterialX/Materials>) {
        over "gold" { color3f inputs:base_color = (0.9, 0.8, 0.7) }
    }"""
    assert base(gltf(STAGE.split('def "Looks"')[0] + over)) == pytest.approx([0.9, 0.8, 0.7])
    inner = over.replace(
        "color3f inputs:base_color = (0.9, 0.8, 0.7)", 'over "SR" { color3f inputs:base_color = (0.5, 0, 0) }'
    )
    # The shader reads its material's input: a value of its own is weaker than that connection.
    assert base(gltf(STAGE.split('def "Looks"')[0] + inner)) == pytest.approx([0.1, 0.2, 0.3])


def test_variants_choose_documents(gltf, tmp_path):
    document(tmp_path)
    document(tmp_path, COLOR.replace("0.1", "0.6"), name="b.mtlx")
    text = (
        QUAD.replace("</Mat>", "</Looks/gold>")
        + """def "Looks" (variants = { string look = "a" }\n prepend variantSets = "look") {
        variantSet "look" = {
            "a" (references = @looks/a.mtlx@</MaterialX/Materials>) { }
            "b" (references = @looks/b.mtlx@</MaterialX/Materials>) { }
        }
    }"""
    )
    assert base(gltf(text)) == pytest.approx([0.1, 0.2, 0.3])
    assert base(gltf(text, "--variant", "/Looks:look=b", out="b.glb")) == pytest.approx([0.6, 0.2, 0.3])


def test_documents_under_a_mask_and_in_instances(gltf, tmp_path):
    document(tmp_path)
    (tmp_path / "asset.usda").write_text(
        '#usda 1.0\n(defaultPrim = "A")\ndef Xform "A" {\n'
        + QUAD.replace("</Mat>", "</A/Looks/gold>").replace("}", "\n}")
        + 'def "Looks" (references = @looks/a.mtlx@</MaterialX/Materials>) {\n}\n}\n'
    )
    text = (
        'def Xform "W" {'
        + "".join(f'def "I{i}" (instanceable = true\n references = @asset.usda@) {{}}\n' for i in (1, 2))
        + "}"
    )
    for arguments in ((), ("--mask", "/W/I2")):
        scene = gltf(text, *arguments, out=f"o{len(arguments)}.glb")
        assert scene.material("/W/I2/M")["pbrMetallicRoughness"]["baseColorFactor"][0] == pytest.approx(0.1)


def test_files_beside_the_document(gltf, tmp_path):
    inputs = '<input name="base_color" type="color3" nodename="I" />'
    image = '<image name="I" type="color3"><input name="file" type="filename" value="t.png" colorspace="srgb_texture" /></image>'
    document(tmp_path, inputs, image, ' fileprefix="maps/"')
    (tmp_path / "looks" / "maps").mkdir()
    picture(tmp_path / "looks" / "maps" / "t.png", 200, 100, 50)
    scene = gltf(STAGE)
    assert pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[0, 0, :3].tolist() == [
        200,
        100,
        50,
    ]


def test_color_spaces_of_documents_are_inherited(gltf, tmp_path):
    document(tmp_path, COLOR, attributes=' colorspace="srgb_texture"')
    assert base(gltf(STAGE))[0] == pytest.approx(0.01002, abs=1e-4)


def test_node_graphs_and_own_definitions(gltf, tmp_path):
    before = """
    <nodedef name="ND_tint" node="tint"><input name="c" type="color3" value="1, 1, 1" /><input name="k" type="float" value="0.5" />
      <output name="out" type="color3" /></nodedef>
    <nodegraph name="NG_tint" nodedef="ND_tint">
      <multiply name="m" type="color3">
        <input name="in1" type="color3" interfacename="c" /><input name="in2" type="float" interfacename="k" />
      </multiply>
      <output name="out" type="color3" nodename="m" />
    </nodegraph>
    <nodegraph name="NG">
      <input name="hue" type="color3" value="0.8, 0.4, 0.2" />
      <tint name="t1" type="color3"><input name="c" type="color3" interfacename="hue" /></tint>
      <tint name="t2" type="color3"><input name="c" type="color3" nodename="t1" /><input name="k" type="float" value="0.25" /></tint>
      <output name="result" type="color3" nodename="t2" />
    </nodegraph>"""
    document(tmp_path, '<input name="base_color" type="color3" nodegraph="NG" output="result" />', before)
    assert base(gltf(STAGE)) == pytest.approx(np.array([0.8, 0.4, 0.2]) / 8)


def including(*names: str, own: str = "") -> str:
    held = "".join(f'<xi:include href="{name}" />' for name in names)
    return f'<materialx version="1.38" xmlns:xi="http://www.w3.org/2001/XInclude">{held}{own}</materialx>'


def write(folder, files: dict[str, str]) -> None:
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


OWN_GOLD = GOLD.format(inputs=COLOR, before="", attributes="")


@pytest.mark.parametrize(
    "files",
    [
        {"a.mtlx": including("b.mtlx"), "b.mtlx": OWN_GOLD},
        {"a.mtlx": including("x/b.mtlx"), "x/b.mtlx": including("y/c.mtlx"), "x/y/c.mtlx": including("../d.mtlx"), "x/d.mtlx": OWN_GOLD},
        # A file of the same name beside the outermost one is not meant.
        {"a.mtlx": including("x/b.mtlx"), "x/b.mtlx": including("c.mtlx"), "x/c.mtlx": OWN_GOLD, "c.mtlx": including()},
        {"a.mtlx": including("b.mtlx", "c.mtlx"), "b.mtlx": including("c.mtlx"), "c.mtlx": OWN_GOLD},
    ],
    ids=["beside", "nested", "same name", "twice"],
)  # fmt: skip
def test_documents_include_others(export, tmp_path, files):
    write(tmp_path / "looks", files)
    result = export(STAGE)
    assert result.report["warnings"] == []
    assert base(Gltf(result.path)) == pytest.approx([0.1, 0.2, 0.3])
    read = {f"looks/{name}" for name in files if name != "c.mtlx" or "x/c.mtlx" not in files}
    assert {name for name in result.report["dependencies"] if name.endswith(".mtlx")} == read


def test_cycles_of_documents_end(export, tmp_path):
    content = OWN_GOLD[OWN_GOLD.index("<standard_surface") : OWN_GOLD.index("</materialx>")]
    write(
        tmp_path / "looks",
        {"a.mtlx": including("x/b.mtlx"), "x/b.mtlx": including("../a.mtlx", "b.mtlx", own=content)},
    )
    result = export(STAGE)
    assert result.report["warnings"] == []
    assert base(Gltf(result.path)) == pytest.approx([0.1, 0.2, 0.3])


@pytest.mark.parametrize(("length", "is_read"), [(60, True), (3_000, False)])
def test_long_chains_of_documents(export, tmp_path, length, is_read):
    write(tmp_path / "looks", {f"{at}.mtlx": including(f"{at + 1}.mtlx") for at in range(length)})
    write(tmp_path / "looks", {"a.mtlx": including("0.mtlx"), f"{length}.mtlx": OWN_GOLD})
    result = export(STAGE)
    assert result.code == 0, result.err
    assert ("unreadable layer" in result.warned("materials")) is not is_read


def test_included_documents_that_are_missing_are_dependencies(export, tmp_path):
    write(tmp_path / "looks", {"a.mtlx": including("x/b.mtlx"), "x/b.mtlx": including("c.mtlx")})
    result = export(STAGE)
    assert result.code == 0, result.err
    assert "unreadable layer" in result.warned("materials") and "c.mtlx" in result.said()
    assert result.report["dependencies"]["looks/x/c.mtlx"] == "missing"
    assert "up to date" in export(STAGE).out
    write(tmp_path / "looks", {"x/c.mtlx": OWN_GOLD})
    result = export(STAGE)
    assert result.report["warnings"] == []
    assert base(Gltf(result.path)) == pytest.approx([0.1, 0.2, 0.3])


def test_packages(gltf, tmp_path):
    inputs = '<input name="base_color" type="color3" nodename="I" />'
    image = '<image name="I" type="color3"><input name="file" type="filename" value="t.png" colorspace="srgb_texture" /></image>'
    document(tmp_path, inputs, image)
    picture(tmp_path / "looks" / "t.png", 200, 100, 50)
    (tmp_path / "scene.usda").write_text("#usda 1.0\n" + STAGE.replace("}", "\n}"))
    with Sdf.ZipFileWriter.CreateNew(str(tmp_path / "p.usdz")) as package:
        package.AddFile(str(tmp_path / "scene.usda"), "scene.usda")
        package.AddFile(str(tmp_path / "looks" / "a.mtlx"), "looks/a.mtlx")
        package.AddFile(str(tmp_path / "looks" / "t.png"), "looks/t.png")
    (tmp_path / "looks" / "a.mtlx").unlink()
    (tmp_path / "looks" / "t.png").unlink()
    scene = gltf(tmp_path / "p.usdz")
    assert pixels(scene, scene.material("/M")["pbrMetallicRoughness"]["baseColorTexture"])[0, 0, :3].tolist() == [
        200,
        100,
        50,
    ]


@pytest.mark.parametrize(
    ("content", "what"),
    [
        (None, "missing layer"),
        ("not xml at all", "unreadable layer"),
        ('<materialx version="1.38"><standard_surface', "unreadable layer"),
        (b"\xff\xfe\x00", "unreadable layer"),
        ("", "unreadable layer"),
        ("<html></html>", "unreadable layer"),
    ],
)
def test_broken_documents_are_reported(export, tmp_path, content, what):
    (tmp_path / "looks").mkdir()
    if content is not None:
        data = content if isinstance(content, bytes) else content.encode()
        (tmp_path / "looks" / "a.mtlx").write_bytes(data)
    result = export(STAGE)
    assert result.code == 0, result.err
    assert [line["what"] for line in result.report["warnings"] if line["path"] == "/Looks"] == [what]
    assert result.warned("materials") == {what, "material binding to nothing"}


def test_nodes_that_read_themselves(export, tmp_path):
    before = '<add name="A" type="color3"><input name="in1" type="color3" nodename="B" /></add>'
    before += '<add name="B" type="color3"><input name="in1" type="color3" nodename="A" /></add>'
    document(tmp_path, '<input name="base_color" type="color3" nodename="A" />', before)
    result = export(STAGE)
    assert result.code == 0, result.err
    assert "reads itself" in result.said()


def test_definitions_that_read_themselves_end(export, tmp_path):
    before = """<nodedef name="ND_loop" node="loop"><input name="c" type="color3" value="1, 1, 1" /><output name="out" type="color3" /></nodedef>
    <nodegraph name="NG_loop" nodedef="ND_loop">
      <loop name="l" type="color3"><input name="c" type="color3" interfacename="c" /></loop>
      <output name="out" type="color3" nodename="l" />
    </nodegraph><loop name="L" type="color3" />"""
    document(tmp_path, '<input name="base_color" type="color3" nodename="L" />', before)
    result = export(STAGE)
    assert result.code == 0, result.err
    assert "nested too deeply" in result.said()


def definition(name: str, *inside: str) -> str:
    """A definition whose graph adds nodes of other definitions, and is one of them."""
    held = "".join(f'<{kind} name="h{at}" type="color3" />' for at, kind in enumerate(inside))
    reads = "".join(f'<input name="in{at + 1}" type="color3" nodename="h{at}" />' for at in range(len(inside)))
    return f"""<nodedef name="ND_{name}" node="{name}"><output name="out" type="color3" /></nodedef>
    <nodegraph name="NG_{name}" nodedef="ND_{name}">{held}
      <add name="sum" type="color3">{reads}</add><output name="out" type="color3" nodename="sum" />
    </nodegraph>"""


@pytest.mark.parametrize(
    "definitions",
    [
        [definition(f"k{at}", f"k{at + 1}", f"k{at + 1}") for at in range(23)] + [definition("k23")],
        [definition("k0", "k0", "k0")],
        [definition("k0", "k1", "k1"), definition("k1", "k0", "k0")],
    ],
    ids=["doubling", "itself twice", "each other twice"],
)
def test_graphs_that_grow_without_bound_are_left_out(export, tmp_path, definitions, monkeypatch):
    if len(definitions) < 3:
        monkeypatch.setattr(materialx_layers, "_MOST_PRIMS", 2_000)
    before = "".join(definitions) + '<k0 name="K" type="color3" />'
    document(tmp_path, '<input name="base_color" type="color3" nodename="K" />', before)
    result = export(STAGE)
    assert result.code == 0, result.err
    assert f"more than {materialx_layers._MOST_PRIMS} prims" in result.said()
    assert result.warned("materials") >= {"unreadable layer", "material binding to nothing"}


def test_a_node_graph_that_reads_itself_ends(export, tmp_path):
    before = """<nodegraph name="NG">
      <add name="a" type="color3"><input name="in1" type="color3" nodegraph="NG" output="out" /></add>
      <output name="out" type="color3" nodename="a" />
    </nodegraph>"""
    document(tmp_path, '<input name="base_color" type="color3" nodegraph="NG" output="out" />', before)
    whole = 'def "X" (references = @looks/a.mtlx@) {}'
    result = export(QUAD.replace("</Mat>", "</X/Materials/gold>") + whole)
    assert result.code == 0, result.err
    assert "itself" in result.said()


NUMBERS = ["nan", "inf", "-inf", "1e999", "1e300", "99999999999", "-2147483649", "2147483648", "", "x", "1, 2", "0x10"]


@pytest.mark.parametrize("text", NUMBERS)
@pytest.mark.parametrize("kind", ["integer", "float", "color3", "vector2", "boolean", "matrix33", "matrix44"])
def test_a_bad_number_is_the_loss_of_its_input(export, tmp_path, kind, text):
    """Also as the index that an element of a colour is chosen by."""
    value = text if kind in ("integer", "float", "boolean") else ", ".join([text] * 3)
    before = f'''<constant name="C" type="{kind}"><input name="value" type="{kind}" value="{value}" /></constant>
      <extract name="E" type="float"><input name="in" type="color3" value="0.5, 0.25, 0.125" />
        <input name="index" type="{kind}" value="{value}" /></extract>
      <extract name="F" type="float"><input name="in" type="color3" value="0.5, 0.25, 0.125" />
        <input name="index" type="{kind}" nodename="C" /></extract>'''
    reads = '<input name="metalness" type="float" nodename="E" /><input name="coat" type="float" nodename="F" />'
    document(tmp_path, COLOR + reads + '<input name="coat_roughness" type="float" nodename="C" />', before)
    result = export(STAGE)
    assert result.code == 0, result.err
    assert base(Gltf(result.path)) == pytest.approx([0.1, 0.2, 0.3])


@pytest.mark.parametrize("index", ["inf", "-inf", "nan", "1e30"])
def test_an_index_that_is_not_finite(export, index):
    inputs = f"color3f inputs:in = (0.5, 0.25, 0.125)\n float inputs:index = {index}"
    element = node("E", "ND_extract_color3", inputs, "float outputs:out")
    result = export(network("color3f inputs:base_color = (0.1, 0.2, 0.3)\n" + link("metalness", "E", "float"), element))
    assert result.code == 0, result.err
    assert base(Gltf(result.path)) == pytest.approx([0.1, 0.2, 0.3])
    assert result.warned() == (set() if index == "1e30" else {"standard_surface metalness"})


def test_what_goes_wrong_in_a_document_is_its_problem_alone(export, tmp_path, monkeypatch):
    def fail(*_):
        raise ZeroDivisionError("an error inside")

    document(tmp_path)
    monkeypatch.setattr(materialx_layers, "_value", fail)
    result = export(STAGE)
    assert result.code == 0, result.err
    assert "an error inside" in result.said()
    assert "unreadable layer" in result.warned("materials")


@pytest.fixture
def without_materialx(monkeypatch):
    """As if the package were not installed."""
    monkeypatch.setitem(sys.modules, "MaterialX", None)
    for cached in (materialx_library.library, materialx_library.definition):
        cached.cache_clear()
    yield
    for cached in (materialx_library.library, materialx_library.definition):
        cached.cache_clear()


REMEDY = "pip install -r scripts/requirements.txt"
LIGHT = 'def SphereLight "Light" {}\n'


def test_documents_without_the_package_are_left_out(export, tmp_path, without_materialx):
    document(tmp_path)
    result = export(LIGHT + STAGE)
    assert result.code == 0, result.err
    assert [line["what"] for line in result.report["warnings"] if REMEDY in line["why"]] == ["unreadable layer"]
    assert {"/Light", "/M"} <= set(Gltf(result.path).by_path)
    strict = export(LIGHT + STAGE, "--strict", out="strict.glb")
    assert strict.code != 0 and REMEDY in strict.out + strict.err


def test_networks_without_the_package_are_left_out(export, without_materialx):
    fallback = """def Shader "P" { uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor = (0.1, 0.2, 0.3)
        token outputs:surface
    }
    """
    universal = "token outputs:surface.connect = </Mat/P.outputs:surface>"
    text = LIGHT + network("color3f inputs:base_color = (1, 0, 0)", fallback, interface=universal)
    result = export(text)
    assert result.code == 0, result.err
    assert [line["path"] for line in result.report["warnings"] if REMEDY in line["why"]] == ["/Mat"]
    assert base(Gltf(result.path)) == pytest.approx([0.1, 0.2, 0.3])
    assert "/Light" in Gltf(result.path).by_path
    strict = export(text, "--strict", out="strict.glb")
    assert strict.code != 0 and REMEDY in strict.out + strict.err
