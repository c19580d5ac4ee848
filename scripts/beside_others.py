"""Light trees beside the other renderers that PyPI has: error, processor time a sample, efficiency.

    python3 scripts/beside_others.py candelabra-render SCENE... [--write] [--samples 64]

A scene is a .glb, or PATH:BOUNCES (1 if not given: direct light). All surfaces are made matt and flat, spots become points of
the same power, lamps with a size the triangles that they are drawn with; three renderers get that same scene: Candelabra
with the default knob and with one light at a point (`--split 0`), Mitsuba's `path`, Cycles with its light tree. One
thread each, 160x90 pixels, a box filter.

    relMSE x samples  the mean over pixels of (x - r)^2 / (r^2 + (0.01 mean r)^2) times the samples of a pixel, of pictures of
                      few samples; r is a converged picture of Candelabra's, whose own noise, told by its two halves, is
                      taken out. Pixels in which a lamp is seen are left out.
    time a sample     the process's user time less that of one with 1 sample a pixel, so that opening, building and
                      compiling are out: the median of three runs, in which the renderers take turns
    efficiency        one over the product of both

Wants `pip install mitsuba bpy numpy`; DRJIT_LIBLLVM_PATH names an LLVM of version 19 or later.
"""

import argparse
import math
import os
import statistics
import subprocess
import sys
import tempfile
from datetime import date
from pathlib import Path

import numpy as np

import benchmarks
from others.documents import Plain
from others.pictures import luminance, read_exr

SIZE = (160, 90)
PIXELS = SIZE[0] * SIZE[1]
ROUNDS = 3
RENDERERS = ("default", "one light", "Cycles", "Mitsuba")
PICTURES = {"default": 1, "one light": 2, "Cycles": 2, "Mitsuba": 8}
"""Of one process: renderers that take less time for a sample make more, so that there is something to measure."""
SCRIPTS = {"Cycles": "cycles_side.py", "Mitsuba": "mitsuba_plain.py"}


class Shot:
    """A scene with so many bounces of light."""

    def __init__(self, program, scene, depth, folder):
        self.program, self.depth, self.folder = program, depth, folder
        self.scene = Plain(scene).saved(folder / "scene.glb")

    def run(self, command):
        """User seconds of a process."""
        words = [str(word) for word in command]
        running = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        said = running.stderr.read()
        _, status, usage = os.wait4(running.pid, 0)
        running.returncode = status
        if status:
            sys.exit(f"failed: {' '.join(words)}\n{said.decode(errors='replace')[-2000:]}")
        return usage.ru_utime

    def ours(self, samples, seed, *options, depth=None, threads=1):
        picture = self.folder / "ours.exr"
        command = [self.program, self.scene, "-o", picture, "--res", f"{SIZE[0]}x{SIZE[1]}", "--float", "--progress", "none"]
        command += ["--depth", self.depth if depth is None else depth, "--threads", threads, "--seed", seed]
        seconds = self.run([*command, "--spp", samples, *options])
        return read_exr(picture), seconds

    def render(self, renderer, samples, seeds):
        """Pictures and user seconds."""
        if renderer in SCRIPTS:
            output = self.folder / "theirs.npy"
            script = Path(__file__).resolve().parent / "others" / SCRIPTS[renderer]
            command = [sys.executable, script, self.scene, output, "--size", f"{SIZE[0]}x{SIZE[1]}"]
            seconds = self.run([*command, "--samples", samples, "--depth", self.depth, "--seeds", *seeds])
            return list(np.load(output).astype(float)), seconds
        split = ["--split", "0"] if renderer == "one light" else []
        runs = [self.ours(samples, seed, *split) for seed in seeds]
        return [picture for picture, _ in runs], sum(seconds for _, seconds in runs)


def error(pictures, halves, counted):
    """The mean relMSE of pictures, without what the reference's own noise adds."""
    halves = [luminance(half) for half in halves]
    middle = sum(halves) / 2
    counted = counted & (middle > 1e-6 * middle.mean())
    scale = middle**2 + (0.01 * middle[counted].mean()) ** 2
    own = (halves[0] - halves[1]) ** 2 / 4
    return statistics.mean(float(np.mean((((luminance(x) - middle) ** 2 - own) / scale)[counted])) for x in pictures)


def measured(shot, samples, converged):
    """By renderer: relMSE x samples, microseconds a sample, the ratio of means to the reference and its standard error."""
    halves = [shot.ours(converged, seed, threads=2)[0] for seed in (7001, 7002)]
    counted = luminance(shot.ours(64, 1, depth=0)[0]) == 0
    means = lambda pictures: [float(luminance(picture)[counted].mean()) for picture in pictures]
    truth = statistics.mean(means(halves))
    pictures, times = {name: [] for name in RENDERERS}, {name: [] for name in RENDERERS}
    for name in SCRIPTS:
        for count in (1, samples):
            shot.render(name, count, [0])  # so that all that is compiled is kept
    for turn in range(ROUNDS):
        for name in RENDERERS:
            seeds = [1 + turn * PICTURES[name] + i for i in range(PICTURES[name])]
            found, seconds = shot.render(name, samples, seeds)
            _, without = shot.render(name, 1, seeds)
            pictures[name] += found
            times[name].append((seconds - without) / ((samples - 1) * PIXELS * len(seeds)) * 1e6)
    rows = {}
    for name in RENDERERS:
        each = means(pictures[name])
        sure = statistics.stdev(each) / math.sqrt(len(each)) / truth
        rows[name] = {
            "error": error(pictures[name], halves, counted) * samples,
            "time": statistics.median(times[name]),
            "times": times[name],
            "ratio": statistics.mean(each) / truth,
            "sure": sure,
        }
    return rows


def line(name, rows):
    """A row of the table."""
    of = lambda key, form: " / ".join(form.format(rows[renderer][key]) for renderer in RENDERERS)
    worth = {renderer: 1 / (row["error"] * row["time"]) for renderer, row in rows.items()}
    best = max(worth["Cycles"], worth["Mitsuba"])
    ratios = " / ".join(f"{rows[renderer]['ratio']:.4f} ± {rows[renderer]['sure']:.4f}" for renderer in SCRIPTS)
    gains = f"{worth['default'] / best:.1f} / {worth['one light'] / best:.1f}"
    return f"| {name} | {of('error', '{:.3g}')} | {of('time', '{:.2f}')} | {gains} | {ratios} |"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=lambda path: Path(path).resolve(), help="candelabra-render")
    parser.add_argument("scenes", nargs="+", metavar="SCENE[:BOUNCES]")
    parser.add_argument("--samples", type=int, default=64, help="of a pixel; the converged picture has 8 times as many")
    parser.add_argument("--write", action="store_true", help="put the table into docs/beside_others.md")
    options = parser.parse_args()
    columns = [f"relMSE x samples: {' / '.join(RENDERERS)}", "microseconds a sample"]
    columns += ["efficiency over the best rival: default / one light", "means, over ours: Cycles / Mitsuba"]
    lines = [f"| scene | {' | '.join(columns)} |", "|---|--:|--:|--:|--:|"]
    print("\n".join(lines), flush=True)
    for scene in options.scenes:
        path, _, bounces = scene.partition(":")
        depth = int(bounces or 1)
        with tempfile.TemporaryDirectory() as folder:
            shot = Shot(options.program, path, depth, Path(folder))
            rows = measured(shot, options.samples, 4 * options.samples)
        name = f"`{Path(path).stem}`" + (f", {depth} bounces" if depth > 1 else "")
        lines.append(line(name, rows))
        print(lines[-1], flush=True)
        print(f"{name}: {rows}", file=sys.stderr, flush=True)
        if options.write:
            command = "python3 scripts/beside_others.py candelabra-render SCENE..."
            benchmarks.write("beside_others", "\n".join([*lines, "", f"*`{command}`; {benchmarks.machine()}; {date.today()}.*"]))


if __name__ == "__main__":
    main()
