"""Puts pictures side by side on one PNG: `contact_sheet.py FRAME.png ... --output SHEET.png`."""

import argparse
import hashlib
import io
import math
import sys
from pathlib import Path

from PIL import Image
from PIL.PngImagePlugin import PngInfo

from usd_gltf.whole_file import write_atomically

GAP = 4
"""Pixels between pictures."""
WIDTH = 320
"""Pixels that a picture is scaled to, at most."""
KEYWORD = "candelabra"
"""Under which a sheet says what it was made of."""


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


def digest(frames: list[Path], columns: int) -> str:
    """A hash of all that a sheet is made of."""
    hasher = hashlib.sha256(f"{GAP} {WIDTH} {columns}".encode())
    for frame in frames:
        hasher.update(hashlib.sha256(frame.read_bytes()).digest())
    return hasher.hexdigest()


def digest_of(sheet: Path) -> str | None:
    """The hash of what a sheet was made of, if it is one and is whole."""
    try:
        with Image.open(sheet) as picture:
            picture.load()
            return picture.info.get(KEYWORD)
    except OSError:
        return None


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("frames", type=Path, nargs="+")
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--columns", type=int, default=6)
    arguments = parser.parse_args()
    now = digest(arguments.frames, arguments.columns)
    if digest_of(arguments.output) == now:
        print(f"{arguments.output}: up to date")
        return 0
    text, file = PngInfo(), io.BytesIO()
    text.add_text(KEYWORD, now)
    contact_sheet(arguments.frames, arguments.columns).save(file, format="PNG", pnginfo=text)
    write_atomically(arguments.output, file.getvalue())
    print(f"{arguments.output}: {len(arguments.frames)} frames")
    return 0


if __name__ == "__main__":
    sys.exit(main())
