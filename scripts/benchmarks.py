"""Measures what the documentation claims, and writes the tables into it.

A table stands between the lines `<!-- benchmarks: NAME -->` and `<!-- end -->`, and is replaced as a whole, with the
command that printed it, the machine and the date. What is around it is written by hand.

    scripts/benchmarks.sh [--quick] [--only NAME]...

With --quick a few minutes' worth is measured and printed, and no file is touched: such numbers are for trying the
script. Without it the run takes an hour or two, and wants the machine for itself.
"""

import argparse
import json
import os
import platform
import re
import statistics
import subprocess
import sys
import tempfile
import time
from datetime import date
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TARGET = Path(os.environ.get("CARGO_TARGET_DIR", ROOT / "target"))
MILLION = "a million triangles"
CHANGED = "a hundred thousand lights, one changed"


broken = []
"""Commands that printed their table and found a promise broken in it."""


def told(command, judges=False):
    """What a command prints; it must succeed, or be one that judges. What it says on the other stream goes by."""
    print(f"== {' '.join(map(str, command))}", file=sys.stderr, flush=True)
    done = subprocess.run([str(word) for word in command], cwd=ROOT, stdout=subprocess.PIPE, text=True, check=False)
    if judges and done.returncode == 3:
        broken.append(command[1])
    elif done.returncode:
        sys.exit(f"failed with {done.returncode}: {' '.join(map(str, command))}")
    return done.stdout


def table(text):
    """The lines of a text that are a table in Markdown."""
    lines = [line for line in text.splitlines() if line.startswith("|")]
    return "\n".join(lines) if lines else sys.exit(f"no table in: {text[-500:]}")


def seconds(group, name):
    """The median that Criterion found, in seconds."""
    folder = TARGET / "criterion" / group / re.sub(r'[?"/\\*<>:|^]', "_", name) / "new"
    return json.loads((folder / "estimates.json").read_text())["median"]["point_estimate"] * 1e-9


def number(pattern, text):
    found = re.search(pattern, text)
    return float(found[1]) if found else sys.exit(f"no '{pattern}' in: {text[-500:]}")


def criterion(quick, only=None):
    """Runs the benchmark over a million triangles."""
    return told(["cargo", "bench", "--quiet", "--bench", "light_tree", "--"] + ([only] if only else []) + ["--quick"] * quick)


def costs(quick):
    text = criterion(quick, MILLION)
    each, peak = number(r"([\d.]+) an emitter", text), number(r"peak memory of a build: (\d+) MB", text)
    build = seconds(MILLION, "build, two threads")
    opened, verified = seconds(MILLION, "open"), seconds(MILLION, "open and verify")
    pick = seconds(MILLION, "one pick from a mapped file, one thread")
    glossy = seconds(MILLION, "one pick for a glossy surface, one thread")
    return f"""| a tree over 1,000,000 triangles | |
|---|---|
| build, two threads | {build:.2f} s, {peak:.0f} MB at peak |
| file | {each:.1f} bytes an emitter |
| open and verify | {1e3 * verified:.0f} ms (open alone: {1e3 * opened:.1f} ms) |
| one pick, one thread | {1e6 * pick:.2f} microseconds from a mapped file; for a glossy surface {1e6 * glossy:.2f} |"""


def one_changed(quick):
    criterion(quick, CHANGED)
    build, opened, upon = (seconds(CHANGED, name) for name in ("build", "open and verify the base", "build upon it"))
    return f"""| 100,000 lights, one changed | | of a build |
|---|---|---|
| build | {1e3 * build:.1f} ms | 1 |
| open and verify the old file | {1e3 * opened:.1f} ms | {opened / build:.2f} |
| build upon it | {1e3 * upon:.1f} ms | {upon / build:.2f} |"""


def break_even(quick):
    return table(told(["cargo", "bench", "--quiet", "--bench", "break_even", "--"] + ["--quick"] * quick))


def one_frame(quick):
    told(["cargo", "build", "--release", "--quiet", "--bins"])
    counts = ["1000", "10000"] if quick else []
    return table(told([sys.executable, "scripts/one_frame.py", TARGET / "release", *counts]))


def what_is_paid(quick):
    return table(told([sys.executable, "scripts/what_is_paid.py"] + ["--quick"] * quick, judges=True))


def make_scenes(folder, *names):
    """Makes seed scenes in a folder."""
    make = '. scripts/environment.sh; environment scripts/requirements.txt; "$python" scenes/seed/make.py --output "$@"'
    told(["sh", "-c", make, "make", folder, *names])


def spent(command):
    """Seconds that a program takes, and its memory at peak in MB."""
    print(f"== {' '.join(map(str, command))}", file=sys.stderr, flush=True)
    started = time.perf_counter()
    process = subprocess.Popen([str(word) for word in command], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    if status:
        sys.exit(f"failed: {' '.join(map(str, command))}")
    return time.perf_counter() - started, usage.ru_maxrss / 1000


def opening(quick):
    told(["cargo", "build", "--release", "--quiet", "--bins"])
    rounds = 1 if quick else 7
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        name = "lamps_1000" if quick else "million_points"
        make_scenes(folder, name)
        scene, tree, picture = (Path(folder) / file for file in (f"{name}.glb", "lights.lt", "picture.exr"))
        build = [TARGET / "release" / "candelabra", "build", scene, "-o", tree, "--force"]
        render = [TARGET / "release" / "candelabra-render", scene, "-o", picture, "--res", "16x9", "--spp", "1"]
        render += ["--depth", "1", "--split", "0"]
        for what, command in (
            ("`candelabra build`", build),
            ("a picture of 144 samples, with the tree", [*render, "--tree", tree]),
            ("the same without it", render),
        ):
            took, peak = zip(*(spent(command) for _ in range(rounds)))
            rows.append(f"| {what} | {statistics.median(took):.2f} s | {max(peak):.0f} MB |")
        size = scene.stat().st_size / 1e6
    head = f"| `{name}`, {size:.0f} MB | a process, all told | memory at peak |\n|---|---|---|\n"
    return head + "\n".join(rows)


def profile(quick):
    told(["cargo", "build", "--release", "--quiet", "--bins"])
    names = ["lamps_10"] if quick else ["spiral_points", "spiral_mesh", "lamps_10", "lamps_1000"]
    with tempfile.TemporaryDirectory() as folder:
        make_scenes(folder, *names)
        scenes = [Path(folder) / f"{name}.glb" for name in names]
        command = [sys.executable, "scripts/profile.py", TARGET / "release", *scenes, "--options"]
        one, default = (table(told([*command, options])) for options in ("--split 0 --depth 1", "--depth 5"))
    return f"Direct light, one light at a point:\n\n{one}\n\nFive bounces, the default knob:\n\n{default}"


def learned(quick):
    told(["cargo", "build", "--release", "--quiet", "--bins"])
    names = ["two_rooms", "behind_house", "lamps_10", "lamps_100", "lamps_1000", "spiral_points", "spiral_mesh"]
    few = ["--probes", "32", "--seeds", "1", "--reference", "16"]
    with tempfile.TemporaryDirectory() as folder:
        chosen = names[:1] if quick else names
        make_scenes(folder, *chosen)
        scenes = [Path(folder) / f"{name}.glb" for name in chosen]
        return told([sys.executable, "scripts/learned.py", TARGET / "release", *scenes, *(few if quick else [])]).strip()


BLOCKS = {
    "costs": (costs, "cargo bench --bench light_tree"),
    "one_changed": (one_changed, "cargo bench --bench light_tree"),
    "break_even": (break_even, "cargo bench --bench break_even"),
    "one_frame": (one_frame, "python3 scripts/one_frame.py target/release"),
    "opening": (opening, "candelabra build; candelabra-render"),
    "profile": (profile, "python3 scripts/profile.py target/release SCENE..."),
    "learned": (learned, "python3 scripts/learned.py target/release SCENE..."),
    "what_is_paid": (what_is_paid, "python3 scripts/what_is_paid.py"),
}
FILES = ("README.md", "docs/measurements.md", "docs/one_frame.md", "docs/profile.md", "docs/beside_others.md", "docs/visibility.md")


def machine():
    """The processor, as the system names it, and how much of it there is."""
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    try:
        name = re.search(r"model name\s*:\s*(.+)", Path("/proc/cpuinfo").read_text())
    except OSError:
        name = None
    name = name[1].strip() if name else platform.processor() or platform.machine()
    return f"{name}, {cores} core{'' if cores == 1 else 's'}"


def write(name, block):
    """Puts a block into every place that is marked for it."""
    marked = re.compile(rf"(<!-- benchmarks: {name} -->\n).*?(<!-- end -->)", re.S)
    places = 0
    for path in (ROOT / file for file in FILES):
        text, count = marked.subn(lambda found: f"{found[1]}{block}\n{found[2]}", path.read_text())
        places += count
        if count:
            with tempfile.NamedTemporaryFile("w", dir=path.parent, delete=False) as part:
                part.write(text)
            os.chmod(part.name, path.stat().st_mode & 0o777)
            os.replace(part.name, path)
            print(f"{path.relative_to(ROOT)}: {name}")
    if not places:
        sys.exit(f"no file has a place for '{name}': write <!-- benchmarks: {name} --> and <!-- end --> where it belongs")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    names = [*BLOCKS, "extremes"]
    parser.add_argument("--only", action="append", choices=names, metavar="NAME", help=f"of {', '.join(names)}; all if none")
    parser.add_argument("--quick", action="store_true", help="measure little, print it, write nothing")
    options = parser.parse_args()
    chosen = options.only or names
    for name, (block, command) in BLOCKS.items():
        if name not in chosen:
            continue
        text = f"{block(options.quick)}\n\n*`{command}`; {machine()}; {date.today()}.*"
        if options.quick:
            print(f"{name}, quick:\n\n{text}\n", flush=True)
        else:
            write(name, text)
    if "extremes" in chosen and not options.quick:
        told(["scripts/extremes.sh"])
    if broken:
        sys.exit(f"measured, but a promise is broken: {', '.join(broken)}")


if __name__ == "__main__":
    main()
