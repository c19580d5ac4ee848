#!/usr/bin/env python3
"""Measures what a table of `candelabra learn` brings; docs/visibility.md has the results.

    python3 scripts/learned.py target/release SCENE... [--probes 512] [--seeds 3] [--res 192x108]

For each scene a table is learned with the default number of rays, from all frames or from some with --frames. Then:
the exact variance of picking with shadows, with and without it, at points of several seeds; and, unless --probes-only,
pictures with and without it in turns, against a converged one: squared error times seconds of processor time, and how many
frames of 1280x720 at an error of 0.05 pay for the learning.
"""
import argparse
import json
import subprocess
import tempfile
from pathlib import Path

from promises import Reference, Shot, processor_seconds

WAYS = ("tree:0", "tree:0.5")
PIXELS = 1280 * 720
ERROR = 0.05


def run(*command):
    """Seconds of processor time that a command takes."""
    started = processor_seconds()
    subprocess.run([str(word) for word in command], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    return processor_seconds() - started


def variances(program, scene, options, table, folder):
    """Of each way the mean and the median without the table and with it, in the mean over the seeds."""
    found = Path(folder) / "exact.json"
    sums = {way: [0.0] * 4 for way in WAYS}
    for seed in range(1, options.seeds + 1):
        run(
            program, "measure", scene, "--exact", "--visibility", "--probes", options.probes, "--seed", seed,
            "--learned", table, "--json", found, *WAYS,
        )
        rows = {row["name"]: row for row in json.loads(found.read_text())["exact"]["strategies"]}
        for way in WAYS:
            # Where nothing is hidden, the table says nothing.
            plain, learned = rows[way], rows.get(f"{way}, learned", rows[way])
            of_seed = (plain["variance"], learned["variance"], plain["median"], learned["median"])
            sums[way] = [mean + own / options.seeds for mean, own in zip(sums[way], of_seed)]
    return sums


def race(program, scene, options, table, learning, folder):
    """Squared error times seconds without the table and with it, and frames until it has paid."""
    knobs = ["--res", options.res, "--depth", options.depth]
    shot = Shot(program, scene, knobs, folder)
    reference = Reference(shot, options.reference)
    grey = shot.render("--error", 10, "--spp", 8)[1]["noise"]["grey"]
    squares, seconds = [0.0, 0.0], [0.0, 0.0]
    for seed in range(options.seeds):
        for side, extra in enumerate(([], ["--learned", table])):
            light, _, took = shot.render("--spp", options.spp, "--grey", grey, "--seed", seed, *extra)
            squares[side] += reference.error(light, grey) / options.seeds
            seconds[side] += took / options.seeds
    width, height = map(int, options.res.split("x"))
    costs = [square * took for square, took in zip(squares, seconds)]
    saved = (costs[0] - costs[1]) / ERROR**2 * PIXELS / (width * height)
    return squares, costs, learning / saved if saved > 0 else None


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("programs", type=Path, help="folder of the programs")
    parser.add_argument("scenes", nargs="+")
    parser.add_argument("--frames", help="frames to learn from")
    parser.add_argument("--probes", type=int, default=512, help="points of each seed")
    parser.add_argument("--probes-only", action="store_true", help="no pictures")
    parser.add_argument("--seeds", type=int, default=3, help="sets of points, and pictures")
    parser.add_argument("--res", default="192x108")
    parser.add_argument("--depth", default="1")
    parser.add_argument("--spp", type=int, default=16)
    parser.add_argument("--reference", type=int, default=2048, help="samples of each half of the converged picture")
    options = parser.parse_args()
    main_program, renderer = (options.programs / name for name in ("candelabra", "candelabra-render"))
    print("| scene | | mean | with the table | | median | with the table | |\n|---|---|--:|--:|--:|--:|--:|--:|")
    races = []
    with tempfile.TemporaryDirectory() as folder:
        tree, table = Path(folder) / "lights.ltree", Path(folder) / "shot.lvis"
        for scene in options.scenes:
            name = Path(scene).stem
            run(main_program, "build", scene, "-o", tree, "--force")
            frames = ["--frames", options.frames] if options.frames else []
            learning = run(main_program, "learn", scene, "--tree", tree, *frames, "-o", table)
            for way, row in variances(main_program, scene, options, table, folder).items():
                mean, with_mean, median, with_median = row
                print(
                    f"| `{name}` | {'one light' if way == 'tree:0' else 'knob 0.5'} | {mean:.3g} | {with_mean:.3g} "
                    f"| x{mean / with_mean:.2f} | {median:.2g} | {with_median:.2g} | x{median / with_median:.2f} |",
                    flush=True,
                )
            if options.probes_only:
                continue
            squares, costs, pays = race(str(renderer), scene, options, table, learning, folder)
            races.append(
                f"| `{name}` | {squares[0] ** 0.5:.4f} | {squares[1] ** 0.5:.4f} | x{costs[0] / costs[1]:.2f} "
                f"| {learning:.0f} s | {'never' if pays is None else f'{pays:.2g}'} |"
            )
    if races:
        print("\n| scene | error | with the table | squared error x seconds | learning | frames that pay for it |")
        print("|---|--:|--:|--:|--:|--:|")
        print("\n".join(races))


if __name__ == "__main__":
    main()
