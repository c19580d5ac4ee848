#!/usr/bin/env python3
"""Export a USD stage to glTF without losing its lights.

    python scripts/usd_to_gltf.py shot.usd shot.glb

`src/ingest/carriers.md` says what the file carries; the package `usd_gltf` beside this file does it.
"""

import sys

from usd_gltf.cli import main

if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
