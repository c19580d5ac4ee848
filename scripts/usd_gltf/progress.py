"""How far an export is: a line on a terminal, or events for `candelabra` (src/pipeline/watch.rs), or nothing."""

from __future__ import annotations

import os
import sys
import time

from .events import tell

FORMS = ("auto", "json", "none")
_READING = 0.9
"""The share of an export that reading prims is taken for; it is most of the work."""
_WIDTH = 78
_PAUSE_S = {"terminal": 0.1, "json": 0.5}


class Progress:
    """Tells what is being done. `auto` shows it if standard error is a terminal, `json` on standard output.

    A context: at its end the terminal's line is free.
    """

    def __init__(self, form: str) -> None:
        shown = "terminal" if form == "auto" and sys.stderr.isatty() else form
        self._form = shown if shown in _PAUSE_S else None
        self._told, self._is_line = -1e9, False
        self._count = 0
        self.total = 0
        """How many prims there are to read."""

    def stage(self, name: str) -> None:
        """Something else is done from here on."""
        if self._form == "json":
            tell({"event": "stage", "name": name})
        elif self._form:
            self._show(name)

    def read(self, path: str) -> None:
        """One more prim is read."""
        if self._form is None:
            return
        self._count += 1
        now = time.monotonic()
        if now - self._told < _PAUSE_S[self._form]:
            return
        self._told = now
        share = min(self._count / max(self.total, 1), 1.0)
        if self._form == "json":
            tell({"event": "progress", "done": round(_READING * share, 4), "frame": None})
        else:
            self._show(f"reading prims: {100 * share:3.0f} %  {path}")

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        """Take the line off the terminal: something else is printed."""
        if self._is_line:
            print(f"\r{'':{_WIDTH}}\r", end="", file=sys.stderr, flush=True)
            self._is_line = False

    def _show(self, text: str) -> None:
        text = text if len(text) <= _WIDTH else f"{text[: _WIDTH - 3]}..."
        print(f"\r{text:{_WIDTH}}", end="", file=sys.stderr, flush=True)
        self._is_line = True


def form_of_environment() -> str:
    """The form that `CANDELABRA_PROGRESS` asks for; `auto` for those that only the programs have."""
    asked = os.environ.get("CANDELABRA_PROGRESS", "auto")
    return asked if asked in FORMS else "auto"
