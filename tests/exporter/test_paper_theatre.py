"""The scene of the paper theatre: made again byte by byte, exported without a loss, and each of its features in the file."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, Export, Gltf
from pxr import Sdf, Usd, UsdGeom, UsdSkel
from usd_gltf.cli import main

SCENE = ROOT / "scenes/paper_theatre"
STAGE = SCENE / "paper_theatre.usda"
THEATRE, LIGHTS = "/World/Theatre", "/World/Lights"
ONE_CANDELA = 1 / (np.pi * 0.02**2)
"""Nits of a point of 2 cm that sends 1 cd."""


@pytest.fixture(scope="module")
def exported(tmp_path_factory) -> Export:
    path = tmp_path_factory.mktemp("theatre") / "theatre.glb"
    return Export(main([str(STAGE), str(path), "--progress", "none"]), "", "", path, path.with_name(path.name + ".report.json"))


@pytest.fixture(scope="module")
def theatre(exported) -> Gltf:
    return Gltf(exported.path)


def other(tmp_path: Path, *arguments: str) -> Gltf:
    """The same scene with other options."""
    assert main([str(STAGE), str(tmp_path / "other.glb"), "--progress", "none", *arguments]) == 0
    return Gltf(tmp_path / "other.glb")


def seconds(code: float) -> float:
    """The shutter opens before the first frame, so the clock starts one frame earlier."""
    return (code - 1000) / 24


def metres(point: np.ndarray) -> np.ndarray:
    """Centimetres, Z up, to metres, Y up; (n, 3)."""
    x, y, z = np.asarray(point, float).T / 100
    return np.stack([x, z, -y], axis=-1)


def made_files(folder: Path) -> dict[str, bytes]:
    written = [path for path in folder.rglob("*") if path.suffix in {".usda", ".png", ".ies"} and path.name != STAGE.name]
    return {str(path.relative_to(folder)): path.read_bytes() for path in written}


def test_it_is_made_again_byte_by_byte_and_small(tmp_path):
    subprocess.run([sys.executable, SCENE / "make.py", "--output", tmp_path], check=True)
    again, committed = made_files(tmp_path), made_files(SCENE)
    assert again.keys() == committed.keys()
    assert [name for name in again if again[name] != committed[name]] == []
    assert sum(map(len, committed.values())) < 1_000_000


def test_nothing_is_lost_and_three_things_are_noted(exported):
    assert exported.code == 0
    assert exported.report["warnings"] == []
    assert exported.noted() == {"inputs:visibleInPrimaryRay = True", "candelabra:lightGroup", "light filter"}


def test_lamps_by_the_hundred(theatre):
    def lamps(path: str) -> list[str]:
        return [key for key in theatre.by_path if key.startswith(path + "[") and "usdLux" in theatre.node(key)["extras"]]

    assert len(lamps(f"{THEATRE}/Sky/Stars")) == 600
    assert len(lamps(f"{THEATRE}/Footlights")) == 19
    assert len(lamps("/World/Garden/Strings")) > 500
    kinds = {row["extras"]["usdLux"]["type"] for row in theatre.nodes if "usdLux" in row.get("extras", {})}
    assert kinds == {"SphereLight", "DiskLight", "RectLight", "DistantLight", "DomeLight", "MeshLight"}


def test_links_say_what_the_stage_says(theatre):
    def lit(light: str, link: str, path: str) -> bool:
        number = theatre.lux(f"{LIGHTS}/{light}")[link]
        links = theatre.node(path)["extras"].get("usdLinks", {"outside": []})
        return number in links["inside"] if "inside" in links else number not in links["outside"]

    head, wire, floor = "/World/Dragon/Puppet/Skin/Skull", "/World/Dragon/Puppet/Wires/WireBack", f"{THEATRE}/Floor"
    viewer, masking = "/World/Garden/Audience/Bench00/Bench", f"{THEATRE}/Masking"
    prims = (head, wire, floor, viewer, masking)
    table = {
        ("Key", "lightLink"): (True, True, True, False, False),
        ("Key", "shadowLink"): (True, False, True, True, True),
        ("Fill", "lightLink"): (True, True, True, False, False),
        ("Rim", "lightLink"): (True, True, False, False, False),
        ("Rim", "shadowLink"): (True, True, False, False, False),
        ("Kicker", "lightLink"): (False, False, False, True, False),
        ("Moon", "lightLink"): (False, False, False, True, False),
        ("Moon", "shadowLink"): (False, False, False, True, False),
    }
    assert {key: tuple(lit(*key, path) for path in prims) for key in table} == table
    assert "lightLink" not in theatre.lux(f"{LIGHTS}/PaperMoon")


def test_the_flag_dims_the_dragon_and_not_the_set(theatre):
    assert theatre.lux(f"{LIGHTS}/Key")["filters"] == [f"{LIGHTS}/Flag"]
    flag = theatre.node(f"{LIGHTS}/Flag")["extras"]["usdLightFilter"]
    assert (flag["type"], flag.get("inside", [0] * 3)) == ("rod", [0] * 3) and flag["edge"] == 60

    def is_dimmed(path: str) -> bool:
        links = theatre.node(path)["extras"].get("usdLinks", {"outside": []})
        number = flag["filterLink"]
        return number in links["inside"] if "inside" in links else number not in links["outside"]

    assert is_dimmed("/World/Dragon/Puppet/Skin/Skull") and not is_dimmed(f"{THEATRE}/Floor")
    assert not is_dimmed("/World/Garden/Audience/Bench00/Bench")
    assert theatre.lux(f"{LIGHTS}/Fill")["specular"] == pytest.approx(0.2)


def test_profiles_are_beside_the_file_and_their_candela_count(exported, theatre):
    washer = next(key for key in theatre.by_path if key.startswith(f"{LIGHTS}/Washers[0]") and "usdLux" in theatre.node(key)["extras"])
    for path, name in ((f"{LIGHTS}/Key", "profile_spot"), (washer, "wall_washer")):
        profile = theatre.lux(path)["shaping"]["ies"]
        assert (exported.path.parent / profile["file"]).read_bytes() == (SCENE / f"profiles/{name}.ies").read_bytes()
        light = theatre.light(path)
        # The colour of a temperature has the luminance 1.
        assert light["intensity"] * np.dot(light["color"], (0.2126, 0.7152, 0.0722)) == pytest.approx(1, rel=1e-3)
        assert light["type"] == "spot"
    assert theatre.lux(f"{LIGHTS}/Key")["inputs"]["intensity"] == pytest.approx(ONE_CANDELA, rel=1e-5)
    shaping = theatre.lux(f"{LIGHTS}/Fill")["shaping"]
    assert (shaping["coneAngle"], shaping["focus"]) == (12.5, 6)


def test_camera_shutter_exposure_and_shift(theatre):
    camera = theatre.node("/World/Camera")["extras"]["usdCamera"]
    assert camera["shutter"] == [-0.25, 0.25]
    assert camera["exposureScale"] == pytest.approx(8 * 0.8333 / 48 / 4, rel=1e-4)
    assert camera["filmOffset"][1] == pytest.approx(2.65 / 20.25)
    places = [theatre.world("/World/Camera", seconds(code))[:3, 3] for code in (1001, 1024)]
    assert np.linalg.norm(places[1] - places[0]) > 0.3


def test_the_moon_swells_and_brightens(theatre):
    moon = theatre.lux(f"{LIGHTS}/PaperMoon")
    times, red = np.array(moon["values"]["times"]), np.array(moon["values"]["rgb"])[:, 0]
    for code, radius, nits in ((1001, 23.44, 11 + 2 / 12), (1012, 28.28, 13), (1024, 33.56, 13 + 6 * 12 / 13)):
        scale = np.cbrt(np.linalg.det(theatre.world(f"{LIGHTS}/PaperMoon", seconds(code))[:3, :3]))
        assert scale * moon["radius"] == pytest.approx(radius / 100, rel=1e-4)
        first = np.interp(1000 + times[0] * 24, [1000, 1012], [11, 13])
        assert np.interp(seconds(code), times, red) / red[0] == pytest.approx(nits / first, rel=1e-3)


def test_the_lantern_revolves_and_its_lamps_with_it(theatre):
    drum, bead = f"{THEATRE}/Revolving/Drum", f"{THEATRE}/Revolving/Drum/Bead0"
    for code in (1001, 1002, 1010):
        angle = np.radians((code - 1000) * 30)
        expected = metres([-345 + 32 * np.cos(angle), -95 + 32 * np.sin(angle), 206])
        assert theatre.world(bead, seconds(code))[:3, 3] == pytest.approx(expected, abs=1e-4)
    assert len(theatre.channels(drum)["rotation"][0]) >= 25


def test_joints_carry_the_dragon(theatre):
    stage = Usd.Stage.Open(str(STAGE))
    flight = UsdSkel.Animation.Get(stage, "/World/Dragon/Puppet/Flight")
    joints = list(flight.GetJointsAttr().Get())
    for code in (1003, 1012, 1024):
        places = np.array(flight.GetTranslationsAttr().Get(code))
        for name, prim in (("drum00", "Drum00"), ("drum20", "Drum20"), ("head", "Eyes"), ("head", "Skull")):
            found = theatre.world(f"/World/Dragon/Puppet/Skin/{prim}", seconds(code))[:3, 3]
            assert found == pytest.approx(metres(places[joints.index(name)]), abs=1e-3)
    open_by = []
    for code in (1003, 1006, 1012):
        jaw, skull = (theatre.world(f"/World/Dragon/Puppet/Skin/{prim}", seconds(code))[:3, 0] for prim in ("Jaw", "Skull"))
        open_by.append(np.degrees(np.arccos(jaw @ skull / np.linalg.norm(jaw) / np.linalg.norm(skull))))
    assert np.ptp(open_by) > 5


def test_the_pine_is_bent_as_usd_bakes_it(theatre):
    stage = Usd.Stage.Open(Usd.Stage.Open(str(STAGE)).Flatten())
    assert UsdSkel.BakeSkinning(UsdSkel.Root.Get(stage, "/World/Pine/Tree"))
    for part in ("Trunk", "Crown"):
        path = f"/World/Pine/Tree/{part}"
        points = UsdGeom.Mesh.Get(stage, path).GetPointsAttr().Get(1001)
        baked = np.array(points) + (205, 330, 90)
        world = theatre.world(path)
        shown = theatre.triangles(path).reshape(-1, 3) @ world[:3, :3].T + world[:3, 3]
        low, high = metres(baked).min(axis=0), metres(baked).max(axis=0)
        assert shown.min(axis=0) == pytest.approx(low, abs=1e-4)
        assert shown.max(axis=0) == pytest.approx(high, abs=1e-4)


def test_pictures_that_shine(theatre):
    nits = theatre.light_map(f"{THEATRE}/Sky/Cloth")
    horizon, zenith = nits[-1].mean(axis=0), nits[0].mean(axis=0)
    assert horizon[0] > 3 * horizon[2] and zenith[2] > 3 * zenith[0]
    for drum in ("Drum00", "Drum31"):
        path = f"/World/Dragon/Puppet/Skin/{drum}"
        faces = [primitive["extras"]["usdPath"] for primitive in theatre.primitives(path)]
        paper = faces.index(f"{path}/Scales")
        assert "emissiveTexture" in theatre.material(path, paper)
        assert theatre.nits(path, paper).max() > 10
        assert len(theatre.triangles(path, paper)) == 14 * 8 * 2
    assert theatre.lux(f"{LIGHTS}/Sky")["texture"].endswith("dusk.png")


def test_neon_is_hundreds_of_triangles_and_flickers(theatre):
    assert sum(len(theatre.triangles(f"{THEATRE}/Neon/{part}")) for part in ("Letters", "Crescent", "Waves")) > 1000
    red = np.array(theatre.lux(f"{THEATRE}/Neon/Letters")["values"]["rgb"])[:, 0]
    assert (red.min(), red.max()) == (12, 46)


def test_creases_keep_the_capital_square(theatre, tmp_path):
    path = f"{THEATRE}/PillarLeft/Capital"

    def extent(scene: Gltf) -> np.ndarray:
        return np.ptp(scene.attribute(path, "POSITION"), axis=0)

    layer = Sdf.Layer.CreateNew(str(tmp_path / "without.usda"))
    layer.subLayerPaths = [str(STAGE)]
    stage = Usd.Stage.Open(layer)
    for name in ("defaultPrim", "metersPerUnit", "upAxis", "startTimeCode", "endTimeCode"):
        stage.SetMetadata(name, Usd.Stage.Open(str(STAGE)).GetMetadata(name))
    stage.OverridePrim(path).GetAttribute("creaseSharpnesses").Set([0.0, 0.0])
    layer.Save()
    assert main([layer.realPath, str(tmp_path / "without.glb"), "--mask", path, "--progress", "none"]) == 0
    creased, smooth = extent(theatre), extent(Gltf(tmp_path / "without.glb"))
    # A Catmull-Clark cage shrinks; its two creased rings do not let it.
    assert (creased > 1.08 * smooth).all()


def test_materials_of_four_dialects(theatre):
    def of(path: str, extension: str) -> dict:
        return theatre.material(path).get("extensions", {}).get(f"KHR_materials_{extension}", {})

    boards, gilt = theatre.material(f"{THEATRE}/Floor"), theatre.material(f"{THEATRE}/Mouldings")
    assert "baseColorTexture" in boards["pbrMetallicRoughness"]
    assert of(f"{THEATRE}/Floor", "clearcoat")["clearcoatFactor"] == pytest.approx(0.8)
    assert gilt["pbrMetallicRoughness"].get("metallicFactor", 1) == 1
    coats = [row.get("extensions", {}).get("KHR_materials_clearcoat") for row in theatre.json["materials"]]
    assert {"clearcoatFactor": 1, "clearcoatRoughnessFactor": pytest.approx(0.16)} in coats
    assert of("/World/Garden/Lantern/Lamp/Panes", "transmission")["transmissionFactor"] == 1
    assert "KHR_materials_volume" not in json.dumps(theatre.material("/World/Garden/Lantern/Lamp/Panes"))


def test_purposes(theatre, tmp_path):
    fringe, proxy = f"{THEATRE}/Fringe", f"{THEATRE}/ValanceProxy"
    assert fringe in theatre.by_path and proxy not in theatre.by_path
    stand_in = other(tmp_path, "--purposes", "proxy")
    assert proxy in stand_in.by_path and fringe not in stand_in.by_path


def test_variants(theatre, tmp_path):
    panes, working = "/World/Garden/Lantern/Lamp/Panes", f"{LIGHTS}/Working"
    choice = ["--variant", "/World:show=work", "/World/Garden/Lantern/Lamp:panes=none"]
    scene = other(tmp_path, *choice)
    assert panes in theatre.by_path and working not in theatre.by_path
    assert working in scene.by_path and f"{LIGHTS}/Key" not in scene.by_path and panes not in scene.by_path


def test_flaps_stand_in_front_of_each_flood(theatre):
    for name in ("FloodLeft", "FloodRight"):
        case = theatre.attribute(f"{THEATRE}/{name}/Case", "POSITION")
        lamp = theatre.node(f"{THEATRE}/{name}/Lamp")["translation"]
        assert case[:, 2].min() < lamp[2] - 10
