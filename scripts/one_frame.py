"""What one frame costs a process, with a tree file and without: seconds and peak memory, as a table in Markdown.

A farm starts one process a frame. The scenes are point lights, each a prim of its own, that stand still, that one
node carries along, or of which one flickers. Each figure is the least of three runs of `candelabra-render` with
hardly any pixels, so that reading the scene and preparing its lights is what is measured.

    python3 scripts/one_frame.py FOLDER_OF_PROGRAMS [LIGHTS ...]
"""

import base64
import json
import multiprocessing
import os
import random
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

RUNS = 3
LAST_FRAME = 24
KINDS = ("still", "moving", "one flickers")


def scene(count, kind):
    """A glTF document as text."""
    random.seed(1)
    where = lambda: [round(random.uniform(-50, 50), 4) for _ in range(3)]
    lamp = lambda i, light=0: {
        "name": f"lamp_{i}",
        "translation": where(),
        "extensions": {"KHR_lights_punctual": {"light": light}},
    }
    nodes = [lamp(i) for i in range(count)]
    if kind == "one flickers":
        values = {"times": [0, 1], "rgb": [[5, 5, 5], [1, 1, 1]]}
        nodes[0] = lamp(0, 1) | {"extras": {"usdLux": {"type": "SphereLight", "values": values}}}
    nodes += [{"name": "carrier", "children": list(range(count))}]
    nodes += [{"name": "eye", "camera": 0, "translation": [0, 0, 80]}]
    point = {"type": "point", "intensity": 1.0}
    usd = {"timeCodesPerSecond": 24, "startTimeCode": 1, "endTimeCode": LAST_FRAME}
    found = {
        "asset": {"version": "2.0", "extras": {"usd": usd}},
        "extensionsUsed": ["KHR_lights_punctual"],
        "extensions": {"KHR_lights_punctual": {"lights": [point, point]}},
        "scene": 0,
        "scenes": [{"nodes": [count, count + 1]}],
        "nodes": nodes,
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
    }
    if kind == "moving":
        keys = struct.pack("<8f", 0, 1, 0, 0, 0, 1, 0, 0)
        uri = "data:application/octet-stream;base64," + base64.b64encode(keys).decode()
        found |= {
            "buffers": [{"byteLength": len(keys), "uri": uri}],
            "bufferViews": [
                {"buffer": 0, "byteLength": 8},
                {"buffer": 0, "byteOffset": 8, "byteLength": 24},
            ],
            "accessors": [
                {"bufferView": 0, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1]},
                {"bufferView": 1, "componentType": 5126, "count": 2, "type": "VEC3"},
            ],
            "animations": [
                {
                    "samplers": [{"input": 0, "output": 1}],
                    "channels": [{"sampler": 0, "target": {"node": count, "path": "translation"}}],
                }
            ],
        }
    return json.dumps(found)


def cost(command):
    """Seconds and peak memory in megabytes of a command: the least of some runs."""
    seconds, peaks = [], []
    for _ in range(RUNS):
        started = time.monotonic()
        running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(running.pid, 0)
        seconds.append(time.monotonic() - started)
        peaks.append(usage.ru_maxrss / 1024)
        if status:
            sys.exit(f"failed: {' '.join(map(str, command))}")
    return min(seconds), min(peaks)


def row(programs, folder, count, kind):
    shot, tree = folder / "shot.gltf", folder / "shot.ltree"
    # In a process of its own: what a process has at its peak, those that it starts are said to have, too.
    writing = multiprocessing.get_context("fork").Process(target=lambda: shot.write_text(scene(count, kind)))
    writing.start()
    writing.join()
    subprocess.run(
        [programs / "candelabra", "build", shot, "-o", tree, "--force"], check=True, stdout=subprocess.DEVNULL
    )
    render = [programs / "candelabra-render", shot, "-o", folder / "a.exr", "-f", "12"]
    render += ["--res", "8x8", "--spp", "1", "--depth", "1"]
    (without, without_mb), (with_, with_mb) = cost(render), cost(render + ["--tree", tree])
    size = tree.stat().st_size / 2**20
    return f"| {int(count):,} | {kind} | {without:.2f} s, {without_mb:.0f} MB | {with_:.2f} s, {with_mb:.0f} MB | {size:.1f} MB |"


def main():
    programs = Path(sys.argv[1])
    counts = [int(count) for count in sys.argv[2:]] or [10**3, 10**4, 10**5, 10**6]
    print(f"| lights | | without a tree | with the tree of {LAST_FRAME} frames | the tree |")
    print("|---|---|---|---|---|")
    for kind in KINDS:
        for count in counts:
            with tempfile.TemporaryDirectory() as folder:
                print(row(programs, Path(folder), count, kind), flush=True)


if __name__ == "__main__":
    main()
