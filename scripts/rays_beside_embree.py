"""Rays a second of one thread's processor time, beside Embree: the same triangles and the same rays.

    python3 scripts/rays_beside_embree.py SCENE

Wants `pip install embreex numpy` and a quiet machine. `cargo bench --bench rays` makes the rays and times them; Embree is timed on
what that wrote, one ray at a time, as it is here.
"""

import argparse
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

ROOT = Path(__file__).resolve().parent.parent
ROUNDS = 15


def ours(scene, folder):
    """By kind of ray: rays a second, how many hit something, and how many there are."""
    command = ["cargo", "bench", "--quiet", "--bench", "rays", "--", str(Path(scene).resolve()), folder]
    printed = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True).stdout
    lines = re.findall(r"^(\w+) (\d+) (\d+) of (\d+)$", printed, re.M)
    return {name: tuple(map(int, numbers)) for name, *numbers in lines} or sys.exit(f"no rates in: {printed[-500:]}")


def embrees(scene, rays, query):
    """The same of Embree: rays a second, and how many hit something."""
    origins, ways = (numpy.ascontiguousarray(rays[:, part]) for part in (0, 1))
    reach = numpy.full(len(rays), 1.0 if query == "OCCLUDED" else numpy.inf, "f4")
    rates = []
    for _ in range(ROUNDS):
        started = time.thread_time()
        found = scene.run(origins, ways, reach, query=query)
        rates.append(len(rays) / (time.thread_time() - started))
    return max(rates), int(numpy.count_nonzero(found >= 0 if query == "INTERSECT" else found == 0))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene")
    scene = parser.parse_args().scene
    os.environ.setdefault("OMP_NUM_THREADS", "1")
    with tempfile.TemporaryDirectory() as folder:
        measured = ours(scene, folder)
        read = lambda name: numpy.fromfile(Path(folder) / name, "<f4")
        embree = EmbreeScene()
        TriangleMesh(embree, read("triangles").reshape(-1, 3, 3))
        print("| rays | a second | that hit | Embree's a second | that hit | ratio |\n|---|--:|--:|--:|--:|--:|")
        for name, (rate, hits, count) in measured.items():
            query = "OCCLUDED" if name == "shadow" else "INTERSECT"
            other, found = embrees(embree, read(name).reshape(-1, 2, 3), query)
            print(f"| {name} | {rate / 1e6:.2f} M | {hits:,} of {count:,} | {other / 1e6:.2f} M | {found:,} | {rate / other:.2f} |")


if __name__ == "__main__":
    main()
