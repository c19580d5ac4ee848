#!/usr/bin/env python3
"""Writes the layers, textures and photometric files of the paper theatre. Needs numpy; the same bytes every time.

    python scenes/paper_theatre/make.py [--output FOLDER]

`paper_theatre.usda`, which puts them together, is written by hand. The writer of USD text is that of the lantern street.
"""

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "lantern_street"))

from pieces import dragon, garden, looks, pictures, pine, profiles, theatre  # noqa: E402


def main():
    options = argparse.ArgumentParser(description="Writes the layers of the paper theatre.")
    options.add_argument("--output", type=Path, default=HERE, help="where they go; beside this file if not given")
    folder = options.parse_args().output
    for piece in (pictures, profiles, looks, theatre, dragon, pine, garden):
        piece.write(folder)


if __name__ == "__main__":
    main()
