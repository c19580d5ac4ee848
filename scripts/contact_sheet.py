"""Puts pictures side by side on one PNG: `contact_sheet.py FRAME.png ... --output SHEET.png`."""

import argparse
import math
import os
import sys
import tempfile
from pathlib import Path

from PIL import Image

GAP = 4
"""Pixels between pictures."""
WIDTH = 320
"""Pixels that a picture is scaled to, at most."""


def contact_sheet(frames: list[Path], columns: int) -> Image.Image:
    """The pictures in rows, in the order given."""
    thumbnails = []
    for frame in frames:
        with Image.open(frame) as picture:
            picture.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
            thumbnails.append(picture.convert("RGB"))
    cell_width = max(t.width for t in thumbnails) + GAP
    cell_height = max(t.height for t in thumbnails) + GAP
    rows = math.ceil(len(thumbnails) / columns)
    sheet = Image.new("RGB", (columns * cell_width + GAP, rows * cell_height + GAP))
    for i, thumbnail in enumerate(thumbnails):
        sheet.paste(thumbnail, (GAP + i % columns * cell_width, GAP + i // columns * cell_height))
    return sheet


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("frames", type=Path, nargs="+")
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--columns", type=int, default=6)
    arguments = parser.parse_args()
    newest = max(frame.stat().st_mtime for frame in arguments.frames)
    if arguments.output.exists() and arguments.output.stat().st_mtime > newest:
        print(f"{arguments.output}: up to date")
        return 0
    sheet = contact_sheet(arguments.frames, arguments.columns)
    with tempfile.NamedTemporaryFile(dir=arguments.output.parent, suffix=".png", delete=False) as file:
        sheet.save(file, format="PNG")
    os.replace(file.name, arguments.output)
    print(f"{arguments.output}: {len(arguments.frames)} frames")
    return 0


if __name__ == "__main__":
    sys.exit(main())
