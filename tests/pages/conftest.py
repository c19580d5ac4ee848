"""Small scenes, their pages, and a real browser to look at them."""

import base64
import json
import os
import shutil
import struct
import subprocess
from pathlib import Path

import pytest
from browser import Browser

ROOT = Path(__file__).resolve().parents[2]
HOSTILE = "<script>document.title = 'broken'<script>\"'&amp;<img src=x onerror=alert(1)>灯"
"""A prim that would be markup if a page let it."""


def _scene(lights: dict[str, dict]) -> dict:
    """A floor, a camera above it, and lights by name: `at`, `intensity` and perhaps `spot`."""
    corners = [(-4, 0, -4), (4, 0, -4), (4, 0, 4), (-4, 0, 4)]
    data = b"".join(struct.pack("<3f", *corner) for corner in corners) + struct.pack("<6H", 0, 2, 1, 0, 3, 2)
    punctual = [
        {"intensity": light["intensity"], **({"type": "spot", "spot": {}} if light.get("spot") else {"type": "point"})}
        for light in lights.values()
    ]
    nodes = [{"name": "floor", "mesh": 0}, {"name": "eye", "camera": 0, "translation": [0, 6, 0]}]
    nodes[1]["rotation"] = [-(0.5**0.5), 0, 0, 0.5**0.5]
    for row, (name, light) in enumerate(lights.items()):
        extension = {"KHR_lights_punctual": {"light": row}}
        nodes.append({"name": name, "translation": light["at"], "extensions": extension})
    return {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": punctual}},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.9, "aspectRatio": 1.5, "znear": 0.1}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [-4, 0, -4], "max": [4, 0, 4]},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [
            {"byteLength": 60, "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}
        ],
    }


def _lights() -> dict[str, dict]:
    grid = {f"lamp_{i}": {"at": [i % 10 - 4.5, 1, i // 10 - 2], "intensity": 1 + i * 7 % 50} for i in range(50)}
    return {**grid, HOSTILE: {"at": [0, 2, 0], "intensity": 100, "spot": True}}


@pytest.fixture(scope="session")
def candelabra():
    """Runs the program, which is built first."""
    subprocess.run(["cargo", "build", "--quiet", "--bin", "candelabra"], cwd=ROOT, check=True)
    program = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target")) / "debug" / "candelabra"

    def run(*arguments, code: int = 0) -> None:
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == code, done

    return run


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    return tmp_path_factory.mktemp("pages")


@pytest.fixture(scope="session")
def scenes(folder) -> tuple[Path, Path]:
    """Two versions of one scene, which differ in every way there is."""
    before, after = folder / "before.gltf", folder / "after.gltf"
    lights = _lights()
    before.write_text(json.dumps(_scene(lights)))
    lights["lamp_7"]["at"] = [3, 2, 3]
    lights["lamp_9"]["intensity"] *= 8
    lights[HOSTILE]["intensity"] = 300
    lights["renamed"] = lights.pop("lamp_11")
    lights["new"] = {"at": [-3, 1, 3], "intensity": 77}
    del lights["lamp_20"]
    after.write_text(json.dumps(_scene(lights)))
    return before, after


@pytest.fixture(scope="session")
def inspect_page(candelabra, scenes, folder) -> Path:
    page = folder / "inspect.html"
    tree = folder / "before.ltree"
    candelabra("build", scenes[0], "--output", tree)
    candelabra("inspect", tree, "--html", page)
    return page


@pytest.fixture(scope="session")
def table_page(candelabra, folder) -> Path:
    """What is hidden below a roof that hangs over the middle of the floor."""
    scene, table, page = folder / "roofed.gltf", folder / "roofed.lvis", folder / "table.html"
    content = _scene({f"lamp_{i}": {"at": [i - 4, 3, 0], "intensity": 9} for i in range(9)})
    content["nodes"].append({"name": "roof", "mesh": 0, "translation": [0, 1, 0], "scale": [0.4, 1, 0.4]})
    content["scenes"][0]["nodes"].append(len(content["nodes"]) - 1)
    content["nodes"][1].update({"translation": [0, 6, 9], "rotation": [-0.3, 0, 0, 0.954]})
    scene.write_text(json.dumps(content))
    candelabra("learn", scene, "--rays", "0.1", "--output", table)
    candelabra("inspect", table, "--html", page)
    return page


@pytest.fixture(scope="session")
def diff_page(candelabra, scenes, folder) -> Path:
    page = folder / "diff.html"
    candelabra("diff", *scenes, "--html", page, code=1)
    return page


@pytest.fixture(scope="session")
def measure_page(candelabra, scenes, folder) -> Path:
    page = folder / "measure.html"
    small = ["--res", "48x32", "--seeds", "2", "--probes", "16", "--cache", folder / "cache"]
    candelabra("measure", scenes[0], "uniform", "tree:0", "tree", "--budgets", "2,4,8", *small, "--html", page)
    return page


@pytest.fixture(scope="session")
def browser():
    """A browser; `CANDELABRA_BROWSER` names one. Without any the tests are skipped, but not under CI."""
    named = os.environ.get("CANDELABRA_BROWSER")
    names = [named] if named else ["chromium", "chromium-browser", "google-chrome"]
    program = next(filter(None, map(shutil.which, names)), None)
    if program is None:
        tell = pytest.fail if named or os.environ.get("CI") == "true" else pytest.skip
        tell("the pages are not looked at: no Chromium here; install one, or let CANDELABRA_BROWSER name it")
    browser = Browser(program)
    yield browser
    browser.close()
