#!/usr/bin/env python3
"""Measures what `candelabra-render` promises of error; docs/error.md has the results.

    python3 scripts/promises.py target/release SCENE... [--res 96x54] [--depth 1] [--table FILE]

For each scene a converged picture is rendered, in two halves with seeds of their own. Then:
told over true error at 16, 64 and 256 samples, of frames and of blocks of 8x8 pixels (the layer `error`); the true error
where 0.1, 0.05 and 0.02 are asked for, and that of as many samples in every pixel, with the seconds of processor time of both: all of the program, that is with reading the
scene and choosing the knob of splitting. The measure is that of
`src/render/noise`: the root mean square of the difference in the logarithm of luminance plus the grey floor.
"""
import argparse
import json
import math
import resource
import subprocess
import tempfile
from pathlib import Path
from typing import NamedTuple

import numpy as np
import OpenEXR

WEIGHTS = (0.2126, 0.7152, 0.0722)
BLOCK = 8
"""Pixels to each side of a block."""


class Picture(NamedTuple):
    """What a render gave: luminance, what the program told of the frame, and seconds of processor time."""

    light: np.ndarray
    noise: dict
    seconds: float
    errors: np.ndarray | None
    """The layer `error`, if it was asked for."""


class Shot:
    """A scene at a size, rendered by a program."""

    def __init__(self, program, scene, options, folder):
        self.command = [program, scene, "--float", *options]
        self.folder = Path(folder)

    def render(self, *options, aov="beauty"):
        picture = self.folder / "picture.exr"
        command = [*self.command, "-o", str(picture), "--progress", "json", "--aov", aov, *map(str, options)]
        started = processor_seconds()
        lines = subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        seconds = processor_seconds() - started
        events = [json.loads(line) for line in lines.stdout.splitlines() if line.startswith(b"{")]
        done = next(event for event in events if event["event"] == "frame-done")
        channels = OpenEXR.File(str(picture), separate_channels=True).channels()
        light = sum(weight * channels[name].pixels.astype(float) for weight, name in zip(WEIGHTS, "RGB"))
        errors = channels["error"].pixels.astype(float) if "error" in channels else None
        return Picture(light, done["noise"], seconds, errors)


def processor_seconds():
    """Of all programs that have ended."""
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Reference:
    """A converged picture in two halves, kept in a file if one is given."""

    def __init__(self, shot, samples, kept=None):
        if kept and kept.exists():
            self.halves = list(np.load(kept))
            return
        self.halves = [shot.render("--spp", samples, "--seed", seed).light for seed in (7001, 7002)]
        if kept:
            np.save(kept, np.array(self.halves))

    def squared_errors(self, light, grey):
        """Of each pixel, without the noise of the reference, and which pixels have noise."""
        a, b = (np.log(half + grey) for half in self.halves)
        middle = np.log(sum(self.halves) / 2 + grey)
        squares = (np.log(light + grey) - middle) ** 2 - (a - b) ** 2 / 4
        noisy = (self.halves[0] != light) | (self.halves[1] != light)
        return squares, noisy

    def error(self, light, grey):
        """The squared error of a picture: the mean over the pixels that have noise."""
        squares, noisy = self.squared_errors(light, grey)
        return squares[noisy].mean()


def blocks(values):
    """Sums over blocks of 8x8 pixels, the last ones of what is left."""
    rows = np.add.reduceat(values, range(0, values.shape[0], BLOCK), axis=0)
    return np.add.reduceat(rows, range(0, values.shape[1], BLOCK), axis=1)


def root(squares):
    return math.sqrt(max(0.0, sum(squares) / len(squares)))


def measure(shot, reference, seeds, errors, told_at):
    grey = shot.render("--error", 10, "--spp", 8).noise["grey"]
    rows = {"told": {}, "asked": {}, "grey": grey}
    for count in told_at:
        told, true, of_blocks = [], [], 0
        for seed in range(seeds):
            picture = shot.render("--spp", count, "--grey", grey, "--seed", seed, aov="error")
            squares, noisy = reference.squared_errors(picture.light, grey)
            told.append(picture.noise["error"] ** 2)
            true.append(squares[noisy].mean())
            of_blocks += np.array([blocks(picture.errors**2 * noisy), blocks(squares * noisy)])
        block_told, block_true = of_blocks[:, blocks(noisy * 1.0) >= BLOCK]
        ratios = np.sqrt(block_told / np.maximum(block_true, 1e-12))
        # Standard error of the ratio of sums over blocks (Cochran 1977, section 6); half of it for its root.
        spread = block_told - block_told.sum() / block_true.sum() * block_true
        unsure = 0.5 * math.sqrt((spread**2).sum()) / block_true.sum()
        rows["told"][count] = {
            "told": root(told), "true": root(true), "unsure": unsure, "blocks": list(np.quantile(ratios, (0.05, 0.5, 0.95))),
            "blocks_within": float(np.mean((ratios > 0.8) & (ratios < 1.25))),
        }
    for asked in errors:
        true, even, told, counts, seconds, even_seconds = [], [], [], [], [], []
        for seed in range(seeds if asked > 0.04 else 1):
            picture = shot.render("--error", asked, "--grey", grey, "--seed", seed)
            true.append(reference.error(picture.light, grey))
            told.append(picture.noise["error"] ** 2)
            counts.append(picture.noise["samples"])
            seconds.append(picture.seconds)
            picture = shot.render("--spp", max(2, round(counts[-1])), "--grey", grey, "--seed", 50 + seed)
            even.append(reference.error(picture.light, grey))
            even_seconds.append(picture.seconds)
        mean = lambda values: sum(values) / len(values)
        rows["asked"][asked] = {
            "told": root(told), "true": root(true), "even": root(even), "samples": mean(counts),
            "seconds": mean(seconds), "even_seconds": mean(even_seconds),
        }
    return rows


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=Path, help="folder of the programs")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--res", default="96x54")
    parser.add_argument("--depth", default="1")
    parser.add_argument("--frame", help="which frame, if not the first")
    parser.add_argument("--reference", type=int, default=8192, help="samples of each half of the converged picture")
    parser.add_argument("--seeds", type=int, default=4, help="pictures of each kind")
    parser.add_argument("--errors", type=float, nargs="*", default=[0.1, 0.05, 0.02])
    parser.add_argument("--counts", type=int, nargs="*", default=[16, 64, 256], help="for told over true error")
    parser.add_argument("--references", type=Path, help="folder to keep converged pictures in, for further runs")
    parser.add_argument("--table", type=Path, help="JSON file for the results")
    options = parser.parse_args()
    results = {}
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as folder:
            knobs = ["--res", options.res, "--depth", options.depth]
            knobs += ["--frames", options.frame] if options.frame else []
            shot = Shot(str(options.programs / "candelabra-render"), scene, knobs, folder)
            name = f"{Path(scene).stem}_{options.res}_{options.depth}_{options.reference}.npy"
            kept = options.references and options.references / name
            reference = Reference(shot, options.reference, kept)
            results[Path(scene).stem] = rows = measure(shot, reference, options.seeds, options.errors, options.counts)
        for count, row in rows["told"].items():
            low, middle, high = row["blocks"]
            print(
                f"{Path(scene).stem:16} {count:4} samples: told {row['told']:.4f}, true {row['true']:.4f}, ratio "
                f"{row['told'] / row['true']:.3f} +- {row['unsure']:.3f}; blocks {low:.2f}, {middle:.2f}, {high:.2f} (5, 50, 95 %), "
                f"{100 * row['blocks_within']:.0f} % within 0.8 to 1.25",
                flush=True,
            )
        for asked, row in rows["asked"].items():
            print(
                f"{Path(scene).stem:16} {asked} asked: told {row['told']:.4f}, true {row['true']:.4f}; "
                f"{row['samples']:.0f} samples a pixel, {row['seconds']:.1f} s; as many everywhere: "
                f"{row['even']:.4f}, {row['even_seconds']:.1f} s",
                flush=True,
            )
    if options.table:
        options.table.write_text(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
