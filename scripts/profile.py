#!/usr/bin/env python3
"""Where the time of a sample goes: a table in Markdown, a row for each part of the renderer, a column for each scene.

    python3 scripts/profile.py target/release SCENE... [--options "--split 0 --depth 1"] [--res 320x180] [--spp 16]

Wants Linux's `perf` and `addr2line`, and a release build, which has line tables. One thread renders each scene; 997 times a
second of processor time `perf` notes where it is. What is inlined counts for the file that it was written in, and what a library
computes for the file that asked, where that can be seen.
"""

import argparse
import collections
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

PARTS = {
    "rays: what is hit, what is hidden": r"render/rays/",
    "tree: groups weighed": r"light_tree/(group|importance|glossy|viewer|node|veil|segment)\.rs|light_tree/linking/",
    "tree: cuts and descents": r"light_tree/",
    "lights: fetched and sampled": r"emitter/|scene/|render/(direct|links)\.rs",
    "picks handed to the path": r"render/(picker|knob)/",
    "surfaces and textures": r"render/surface",
    "BSDF": r"render/bsdf/",
    "random numbers": r"math/random\.rs|sobol_burley",
    "film and passes": r"render/(film|noise|passes|layers|parts|beauty|buffers)",
    "path and camera": r"render/(path|walk|camera|fog|delegate|motion)",
    "math": r"/src/math/",
    "reading the scene, building, writing": r"/src/(ingest|pipeline|store|bin|scene)/|render/(exr|png)",
}
"""By the file that the code was written in: the first that fits."""
REST = "libraries and system"


def record(command, data):
    """Runs a command under perf with one thread; returns what it printed."""
    perf = ["perf", "record", "--quiet", "-F", "997", "-e", "cpu-clock:u", "-o", data, "--", *command]
    done = subprocess.run(["env", "RAYON_NUM_THREADS=1", *perf], capture_output=True, text=True, check=False)
    return done.stdout + done.stderr if done.returncode == 0 else sys.exit(f"failed: {shlex.join(perf)}\n{done.stderr}")


def addresses(data, program):
    """How often the program was at each of its addresses, and how often it was in some library."""
    fields = ["perf", "script", "-i", data, "-F", "ip,sym,symoff,dso", "--show-mmap-events"]
    lines = subprocess.run(fields, capture_output=True, text=True, check=True).stdout.splitlines()
    mapped = re.compile(r"PERF_RECORD_MMAP2? .*\[(0x[0-9a-f]+)\((0x[0-9a-f]+)\) @ (0x[0-9a-f]+|0) .*: r-xp (.*)")
    maps = [found.groups() for found in map(mapped.search, lines) if found]
    own = [tuple(int(number, 16) for number in row[:3]) for row in maps if row[3] == str(program)]
    found, elsewhere = collections.Counter(), 0
    for line in lines:
        sample = re.match(r"\s*([0-9a-f]+) .*\((.*)\)$", line)
        if not sample:
            continue
        at = int(sample[1], 16)
        inside = [(start, offset) for start, size, offset in own if start <= at < start + size]
        if inside:
            start, offset = inside[0]
            found[at - start + offset] += 1
        else:
            elsewhere += 1
    return found, elsewhere


def shift(program):
    """What an address of the file's code is loaded at, less where it stands in the file."""
    lines = subprocess.run(["readelf", "-lW", program], capture_output=True, text=True, check=True).stdout.splitlines()
    for line in lines:
        words = line.split()
        if words[:1] == ["LOAD"] and "E" in words[6:8]:
            return int(words[2], 16) - int(words[1], 16)
    sys.exit(f"{program}: no code in it")


def sources(program, places):
    """For each address the files of what is inlined there, the innermost first."""
    asked = "\n".join(f"{place:#x}" for place in places)
    command = ["addr2line", "-a", "-i", "-e", program]
    printed = subprocess.run(command, input=asked, capture_output=True, text=True, check=True).stdout
    found, current = {}, None
    for line in printed.splitlines():
        if line.startswith("0x"):
            current = found.setdefault(int(line, 16), [])
        else:
            current.append(line.rsplit(":", 1)[0])
    return found


def part_of(files):
    for file in files:
        if "/rustc/" in file or file.startswith("?"):
            continue
        for part, pattern in PARTS.items():
            if re.search(pattern, file):
                return part
    return REST


def profile(programs, scene, options):
    """The share of each part, and the microseconds of a path."""
    program = (Path(programs) / "candelabra-render").resolve()
    with tempfile.TemporaryDirectory() as folder:
        data = str(Path(folder) / "perf.data")
        tree = str(Path(folder) / "tree.ltree")
        subprocess.run([Path(programs) / "candelabra", "build", scene, "-o", tree], capture_output=True, check=True)
        record([str(program), scene, "--tree", tree, "-o", str(Path(folder) / "picture.exr"), *options], data)
        found, elsewhere = addresses(data, program)
    moved = shift(program)
    files = sources(program, [place + moved for place in found])
    counts = collections.Counter({REST: elsewhere})
    for place, count in found.items():
        counts[part_of(files.get(place + moved, []))] += count
    return counts


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--options", default="")
    parser.add_argument("--res", default="320x180")
    parser.add_argument("--spp", type=int, default=16)
    given = parser.parse_args()
    width, height = map(int, given.res.split("x"))
    options = ["--res", given.res, "--spp", str(given.spp), *shlex.split(given.options)]
    columns = {Path(scene).stem: profile(given.programs, scene, options) for scene in given.scenes}
    print("| | " + " | ".join(f"`{name}`" for name in columns) + " |\n|---|" + "--:|" * len(columns))
    whole = {name: counts.total() for name, counts in columns.items()}
    for part in [*PARTS, REST]:
        shares = (f"{100 * counts[part] / whole[name]:.1f} %" for name, counts in columns.items())
        print(f"| {part} | " + " | ".join(shares) + " |")
    paths = width * height * given.spp
    each = (f"{total / 997 / paths * 1e6:.2f}" for total in whole.values())
    print("| **microseconds of processor time a path, all told** | " + " | ".join(each) + " |")


if __name__ == "__main__":
    main()
