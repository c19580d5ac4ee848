"""Puts pictures side by side on one PNG: `contact_sheet.py FRAME.png ... --output SHEET.png`, or
`contact_sheet.py --pattern SHOT.####.png --frames 1001-1024 --output SHEET.png`.

Exit codes: 0 done or up to date, 1 failed, 2 usage.
"""

import argparse
import hashlib
import io
import math
import re
import sys
from collections import defaultdict
from pathlib import Path

from PIL import Image
from PIL.PngImagePlugin import PngInfo

from usd_gltf.events import tell_up_to_date
from usd_gltf.whole_file import write_atomically

GAP = 4
"""Pixels between pictures."""
WIDTH = 320
"""Pixels that a picture is scaled to, at most."""
KEYWORD = "candelabra"
"""Under which a sheet says what it was made of."""
MOST_FRAMES = 10_000
"""On one sheet."""


def frame_numbers(text: str) -> list[int]:
    """Frames as #FRAMESPEC# writes them: `1001-1024`, `1-9x2`, `1,5,9`."""
    numbers: list[int] = []
    for part in text.split(","):
        match = re.fullmatch(r"(-?\d{1,9})(?:-(-?\d{1,9})(?:x(-?\d{1,9}))?)?", part)
        if not match:
            raise argparse.ArgumentTypeError(f"'{part[:60]}' is no range of frames; write 1001-1024, 1-9x2 or 1,5,9")
        first = int(match[1])
        last = first if match[2] is None else int(match[2])
        step = int(match[3] or (1 if first <= last else -1))
        if step == 0 or (last - first) * step < 0:
            raise argparse.ArgumentTypeError(f"the step of '{part}' never reaches its last frame")
        frames = range(first, last + (1 if step > 0 else -1), step)
        if len(numbers) + len(frames) > MOST_FRAMES:
            raise argparse.ArgumentTypeError(f"a sheet has no more than {MOST_FRAMES} frames; make several")
        numbers += frames
    return numbers


def frame_files(pattern: str, numbers: list[int]) -> list[Path]:
    """The files of frames: the last `#`s of a pattern become the number, in as many places at least."""
    head, marks, tail = re.fullmatch(r"(.*?)(#+)([^#]*)", pattern).groups()
    # As the renderer names them: the sign takes one of the places.
    return [Path(f"{head}{number:0{len(marks)}}{tail}") for number in numbers]


def contact_sheet(frames: list[Path], columns: int) -> Image.Image:
    """The pictures in rows, in the order given. Says so if they differ in size."""
    thumbnails, sizes = [], defaultdict(list)
    for frame in frames:
        size, thumbnail = small(frame)
        sizes[size].append(frame)
        thumbnails.append(thumbnail)
    if len(sizes) > 1:
        told = (f"{len(of)} of {w}x{h}, the first is {of[0]}" for (w, h), of in sizes.items())
        print(f"note: the pictures differ in size: {'; '.join(told)}", file=sys.stderr)
    cell_width = max(t.width for t in thumbnails) + GAP
    cell_height = max(t.height for t in thumbnails) + GAP
    rows = math.ceil(len(thumbnails) / columns)
    sheet = Image.new("RGB", (columns * cell_width + GAP, rows * cell_height + GAP))
    for i, thumbnail in enumerate(thumbnails):
        sheet.paste(thumbnail, (GAP + i % columns * cell_width, GAP + i // columns * cell_height))
    return sheet


def small(frame: Path) -> tuple[tuple[int, int], Image.Image]:
    """A picture's size, and the picture scaled down."""
    try:
        with Image.open(frame) as picture:
            size = picture.size
            picture.thumbnail((WIDTH, WIDTH), Image.Resampling.LANCZOS)
            return size, picture.convert("RGB")
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        # Not all that Pillow raises names the file.
        raise OSError(None, f"no whole picture ({error}); render it again", str(frame)) from error


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
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError):
        return None


def main() -> int:
    arguments = parsed()
    try:
        return run(arguments.frames, arguments.output, min(arguments.columns, len(arguments.frames)))
    except OSError as error:
        print(f"error: {error.filename or arguments.output}: {error.strerror or error}", file=sys.stderr)
    return 1


def parsed() -> argparse.Namespace:
    """The arguments; `frames` are files, however they were named."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", type=Path, nargs="*", help="the pictures")
    parser.add_argument("--pattern", metavar="NAME", help="the pictures' name, with #### for the frame")
    parser.add_argument("--frames", type=frame_numbers, metavar="A-B", help="the frames of the pattern")
    parser.add_argument("--output", type=Path, required=True)
    parser.add_argument("--columns", type=columns, default=6)
    arguments = parser.parse_args()
    by_pattern = arguments.pattern is not None
    if by_pattern != (arguments.frames is not None) or by_pattern == bool(arguments.files):
        parser.error("name the pictures, or give --pattern and --frames")
    if by_pattern and "#" not in arguments.pattern:
        parser.error(f"--pattern {arguments.pattern} has no #### for the frame")
    if by_pattern:
        arguments.frames = frame_files(arguments.pattern, arguments.frames)
    else:
        arguments.frames = arguments.files
    return arguments


def columns(text: str) -> int:
    """A number of columns: one or more."""
    if not re.fullmatch(r"[1-9]\d{0,3}", text):
        raise argparse.ArgumentTypeError(f"'{text}' is no number of columns; write 6")
    return int(text)


def run(frames: list[Path], output: Path, columns: int) -> int:
    """Makes the sheet, unless it is up to date; the exit code."""
    missing = [str(frame) for frame in frames if not frame.is_file()]
    if missing:
        some = ", ".join(missing[:10]) + (f" and {len(missing) - 10} more" if len(missing) > 10 else "")
        print(f"error: {len(missing)} of {len(frames)} pictures are missing: {some}; render them", file=sys.stderr)
        return 1
    now = digest(frames, columns)
    if digest_of(output) == now:
        tell_up_to_date(output)
        return 0
    text, file = PngInfo(), io.BytesIO()
    text.add_text(KEYWORD, now)
    contact_sheet(frames, columns).save(file, format="PNG", pnginfo=text)
    write_atomically(output, file.getvalue())
    print(f"{output}: {len(frames)} frames")
    return 0


if __name__ == "__main__":
    sys.exit(main())
