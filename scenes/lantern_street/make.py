#!/usr/bin/env python3
"""Writes the layers and textures of the lantern street. Needs numpy; the same bytes every time.

    python scenes/lantern_street/make.py

`lantern_street.usda`, which puts them together, is written by hand.
"""

from pathlib import Path

from parts import houses, materials, neon, props, street, strings, textures, tram, windows


def main():
    folder = Path(__file__).resolve().parent
    textures.write_all(folder / "textures")
    materials.write(folder)
    street.write(folder)
    windows.write(folder)
    houses.write(folder)
    lanterns, bulbs = strings.write(folder)
    triangles = neon.write(folder)
    tram.write(folder)
    props.write(folder)
    print(f"{lanterns} lanterns, {bulbs} bulbs, {triangles} triangles of neon")


if __name__ == "__main__":
    main()
