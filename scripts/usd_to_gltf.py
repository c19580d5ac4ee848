#!/usr/bin/env python3
"""Export a USD stage to glTF without losing its lights.

    python scripts/usd_to_gltf.py shot.usd shot.glb

`src/ingest/carriers.md` says what the file carries; the package `usd_gltf` beside this file does it.
"""

import sys
from pathlib import Path

try:
    from usd_gltf.cli import main
except ModuleNotFoundError as missing:
    requirements = Path(__file__).resolve().parent / "requirements.txt"
    print(
        f"error: {sys.executable} lacks the package {missing.name}; "
        f"`{sys.executable} -m pip install -r {requirements}` installs what the exporter needs",
        file=sys.stderr,
    )
    sys.exit(1)

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
