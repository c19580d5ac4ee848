"""What a scene pays for features that it does not use, as a table in Markdown.

For each feature the renderer is built a second time without it (Cargo's `without-NAME`, src/math/built_in.rs), and
once without any. Both programs render one scene that has none of the features, one process after the other, on one
thread: with the default knob, or with one light at a point where splitting is what is left out. The table has the
whole program's cost over that of the program without the feature:

    instructions  of the samples alone: of a process with many samples less one with few
    process       instructions of the whole process, with reading the scene and building its tree
    time          wall time of the whole process, medians of interleaved runs
    memory        peak memory, medians

Instructions are counted by `perf`, or by Valgrind's cachegrind where the kernel gives no counters; they hardly depend
on what else the machine does, wall times do. The two programs must write the same picture. Fails if a count of
instructions or bytes is more than 2 % above, for any one feature (exit code 3).

    python3 scripts/what_is_paid.py [--quick] [--json FILE] [--programs FOLDER] [FEATURE ...]
"""

import argparse
import hashlib
import json
import math
import os
import random
import re
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FEATURES = (
    *("textures", "fog", "motion", "domes", "instances", "splitting", "range", "glossy", "transmission"),
    *("links", "filters", "multipliers", "profiles", "visibility"),
)
ALL = "all"
ALLOWED = 1.02
FLOOR, FACES, POINTS = 48, 3000, 1000
FEW, MANY = 1, 9


def scene():
    """A glTF document as text: matt hills under a mesh light and points, and nothing else that could be asked for."""
    random.seed(1)
    steps = range(FLOOR + 1)
    hill = lambda i, j: math.sin(0.7 * i) * math.cos(0.9 * j)
    floor = [(i - FLOOR / 2, hill(i, j), j - FLOOR / 2) for i in steps for j in steps]
    at = lambda i, j: i * (FLOOR + 1) + j
    quads = [(i, j) for i in range(FLOOR) for j in range(FLOOR)]
    corners = [c for i, j in quads for c in (at(i, j), at(i, j + 1), at(i + 1, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1))]
    where = lambda: [random.uniform(-20, 20), random.uniform(2, 8), random.uniform(-20, 20)]
    faces = []
    for x, y, z in (where() for _ in range(FACES)):
        faces += [(x, y, z), (x + 0.05, y + 0.02, z), (x, y - 0.03, z + 0.05)]
    binary, views, accessors = b"", [], []

    def array(data, kind, count, shape, **more):
        nonlocal binary
        views.append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
        accessors.append({"bufferView": len(views) - 1, "componentType": kind, "count": count, "type": shape} | more)
        binary += data
        return len(accessors) - 1

    def mesh(points, indices, material):
        bounds = {"min": [min(p[a] for p in points) for a in range(3)], "max": [max(p[a] for p in points) for a in range(3)]}
        flat = [x for point in points for x in struct.unpack("3f", struct.pack("3f", *point))]
        bounds = {key: list(struct.unpack("3f", struct.pack("3f", *value))) for key, value in bounds.items()}
        positions = array(struct.pack(f"<{len(flat)}f", *flat), 5126, len(points), "VEC3", **bounds)
        triangles = array(struct.pack(f"<{len(indices)}I", *indices), 5125, len(indices), "SCALAR")
        return {"primitives": [{"attributes": {"POSITION": positions}, "indices": triangles, "material": material}]}

    meshes = [mesh(floor, corners, 0), mesh(faces, list(range(len(faces))), 1)]
    matt = {"KHR_materials_specular": {"specularFactor": 0}}
    lamp = lambda i: {"name": f"lamp_{i}", "translation": where(), "extensions": {"KHR_lights_punctual": {"light": 0}}}
    nodes = [{"name": "floor", "mesh": 0}, {"name": "faces", "mesh": 1}]
    nodes += [{"name": "eye", "camera": 0, "translation": [0, 9, 26], "rotation": [-0.17, 0, 0, 0.985]}]
    nodes += [lamp(i) for i in range(POINTS)]
    document = {
        "asset": {"version": "2.0"},
        "extensionsUsed": ["KHR_lights_punctual", "KHR_materials_specular"],
        "extensions": {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 3}]}},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(nodes)))}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": [
            {"name": "earth", "pbrMetallicRoughness": {"metallicFactor": 0}, "extensions": matt},
            {"name": "glow", "pbrMetallicRoughness": {"metallicFactor": 0}, "emissiveFactor": [1, 1, 1], "extensions": matt},
        ],
        "cameras": [{"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.1}}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"uri": "shot.bin", "byteLength": len(binary)}],
    }
    return json.dumps(document), binary


def built(feature, folder):
    """The renderer without a feature, or with all of them: from a folder, or built of the sources as they are."""
    if folder:
        return folder / (feature or "whole")
    command = ["cargo", "build", "--release", "--quiet", "--bin", "candelabra-render"]
    without = FEATURES if feature == ALL else [feature] if feature else []
    command += ["--features", ",".join(f"without-{name}" for name in without)]
    subprocess.run(command, cwd=ROOT, check=True)
    target = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
    program = target / "paid" / (feature or "whole")
    program.parent.mkdir(parents=True, exist_ok=True)
    shutil.copy2(target / "release" / "candelabra-render", program)
    return program


class Shot:
    """The scene in a folder, and how to render it."""

    def __init__(self, folder, options):
        self.folder = folder
        text, binary = scene()
        (folder / "shot.gltf").write_text(text)
        (folder / "shot.bin").write_bytes(binary)
        self.size = "32x18" if options.quick else "64x36"
        self.runs = 5 if options.quick else 15

    def command(self, program, feature, samples, size=None):
        split = ["--split", "0"] if feature in ("splitting", ALL) else []
        size = ["--res", size or self.size, "--spp", str(samples), "--depth", "3", "--threads", "1"]
        return [program, self.folder / "shot.gltf", "-o", self.folder / "a.exr", "--progress", "none", *size, *split]

    def instructions(self, program, feature, samples):
        command = self.command(program, feature, samples)
        perf = ["perf", "stat", "-x,", "-e", "instructions:u"]
        done = subprocess.run([*perf, *command], capture_output=True, text=True, check=False) if shutil.which("perf") else None
        found = done and re.search(r"^(\d+),.*instructions", done.stderr, re.M)
        if not found:
            cachegrind = ["valgrind", "--tool=cachegrind", "--cache-sim=no", "--cachegrind-out-file=/dev/null"]
            done = subprocess.run([*cachegrind, *command], capture_output=True, text=True, check=False)
            found = re.search(r"I\s+refs:\s+([\d,]+)", done.stderr)
        if done.returncode or not found:
            sys.exit(f"no count of instructions (install perf or valgrind): {done.stderr[-500:]}")
        return int(found[1].replace(",", ""))

    def cost(self, program, feature):
        """Seconds and peak bytes of one process."""
        command = self.command(program, feature, MANY, "96x54")
        started = time.monotonic()
        running = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        _, status, usage = os.wait4(running.pid, 0)
        if status:
            sys.exit(f"failed: {' '.join(map(str, command))}")
        return time.monotonic() - started, usage.ru_maxrss

    def pixels(self):
        """A hash of what is behind the picture's header, in which the program has left its own hash."""
        data, at = (self.folder / "a.exr").read_bytes(), 8
        while data[at]:
            at = data.index(b"\0", data.index(b"\0", at) + 1) + 1
            at += 4 + struct.unpack_from("<I", data, at)[0]
        return hashlib.sha256(data[at:]).hexdigest()


def measure(shot, whole, without, feature):
    """Ratios: what the whole program takes over what the other takes."""
    counts, pictures = {}, set()
    for name, program in (("whole", whole), ("without", without)):
        few, many = (shot.instructions(program, feature, samples) for samples in (FEW, MANY))
        counts[name] = (many - few, many)
        pictures.add(shot.pixels())
    if len(pictures) > 1:
        sys.exit(f"without {feature} the picture is another")
    costs = {"whole": [], "without": []}
    for _ in range(shot.runs):
        for name, program in (("whole", whole), ("without", without)):
            costs[name].append(shot.cost(program, feature))
    medians = {name: [statistics.median(column) for column in zip(*rows, strict=True)] for name, rows in costs.items()}
    ratio = lambda of: of[0] / of[1]
    return {
        "feature": feature,
        "instructions": ratio([counts[name][0] for name in counts]),
        "process": ratio([counts[name][1] for name in counts]),
        "time": ratio([medians[name][0] for name in medians]),
        "memory": ratio([medians[name][1] for name in medians]),
        "memory_bytes": medians["whole"][1] * 1024,
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("features", nargs="*", metavar="FEATURE", help=f"of {', '.join(FEATURES)} and {ALL}, which is without any; each if none")
    parser.add_argument("--quick", action="store_true", help="fewer pixels and runs")
    parser.add_argument("--json", type=Path, help="write the numbers to a file, too")
    parser.add_argument("--programs", type=Path, help="a folder of programs built before: whole, and one for each feature")
    options = parser.parse_args()
    if unknown := [name for name in options.features if name not in (*FEATURES, ALL)]:
        parser.error(f"no feature {', '.join(unknown)}; choose of {', '.join(FEATURES)} and {ALL}")
    rows = []
    columns = ("instructions", "process", "time", "memory")
    print(f"| a scene without | {' | '.join(columns)} |\n|---|---|---|---|---|")
    with tempfile.TemporaryDirectory() as folder:
        shot = Shot(Path(folder), options)
        whole = built(None, options.programs)
        for feature in options.features or (*FEATURES, ALL):
            row = measure(shot, whole, built(feature, options.programs), feature)
            rows.append(row)
            print(f"| {feature} | {' | '.join(f'{row[column]:.3f}' for column in columns)} |", flush=True)
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1) + "\n")
    counted = ("instructions", "process", "memory")
    one = [row for row in rows if row["feature"] != ALL]
    if paid := [row["feature"] for row in one if any(row[column] > ALLOWED for column in counted)]:
        print(f"more than {100 * (ALLOWED - 1):.0f} % is paid for what is not used: {', '.join(paid)}", file=sys.stderr)
        sys.exit(3)


if __name__ == "__main__":
    main()
