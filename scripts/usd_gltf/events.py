"""What `candelabra run` hears of a script, as src/pipeline/watch.rs has it: an event is a line of JSON.

Words stay words where nobody has asked for events by CANDELABRA_PROGRESS=json.
"""

from __future__ import annotations

import json
import os
from pathlib import Path


def tell_up_to_date(output: Path) -> None:
    """Say that an output was made of the same before, and is kept."""
    if os.environ.get("CANDELABRA_PROGRESS") == "json":
        tell({"event": "up-to-date", "frame": None, "output": str(output)})
    else:
        print(f"{output}: up to date")


def tell(event: dict) -> None:
    """Print an event."""
    print(json.dumps(event, separators=(",", ":")), flush=True)
