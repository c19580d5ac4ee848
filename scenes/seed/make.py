#!/usr/bin/env python3
"""Makes the scenes that the seed shows, each as `OUTPUT/NAME.glb`. Needs scripts/requirements.txt.

    python scenes/seed/make.py [--output out/seed] [--usd-only] [NAME ...]

Most are written as USD and exported; a million points are glTF from the start. The same bytes every time.
"""

import argparse
import subprocess
import sys
from functools import partial
from pathlib import Path

import fog_spots
import hidden
import lamps
import linked
import million_points
import profiles
import spiral_mesh
import spiral_points
import textured_lights

SCENES = {
    "spiral_points": spiral_points.write,
    "spiral_mesh": spiral_mesh.write,
    "million_points": million_points.write_points,
    "one_area": million_points.write_area,
    "lamps_10": partial(lamps.write, lights=10),
    "lamps_100": partial(lamps.write, lights=100),
    "lamps_1000": partial(lamps.write, lights=1000),
    "fog_spots": fog_spots.write,
    "textured_lights": textured_lights.write,
    "two_rooms": hidden.write_rooms,
    "opening_door": hidden.write_opening_door,
    "behind_house": hidden.write_house,
    "linked": linked.write,
    "profiles": profiles.write,
    "profile_hall": profiles.write_hall,
}
GLTF = {"million_points", "one_area", "textured_lights"}
EXPORTER = Path(__file__).resolve().parents[2] / "scripts" / "usd_to_gltf.py"


def main():
    parser = argparse.ArgumentParser(description="Make the scenes that the seed shows.")
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(SCENES)}; all if none")
    parser.add_argument("--output", type=Path, default=Path("out/seed"), help="folder (default: out/seed)")
    parser.add_argument("--usd-only", action="store_true", help="do not export what is written as USD")
    options = parser.parse_args()
    unknown = [name for name in options.names if name not in SCENES]
    if unknown:
        parser.error(f"no scene {', '.join(unknown)}; choose of {', '.join(SCENES)}")
    options.output.mkdir(parents=True, exist_ok=True)
    for name in options.names or SCENES:
        path = options.output / f"{name}{'.glb' if name in GLTF else '.usda'}"
        SCENES[name](path)
        print(f"{path}: written", flush=True)
        if name not in GLTF and not options.usd_only:
            subprocess.run([sys.executable, EXPORTER, path, path.with_suffix(".glb")], check=True)


if __name__ == "__main__":
    main()
