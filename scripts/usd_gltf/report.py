"""The export report: what had no carrier, and what the source got wrong."""

from __future__ import annotations

import json
from collections import Counter


class ExportError(Exception):
    """The export cannot go on. The message names the file, the prim and the remedy."""


class Report:
    """Warnings and counts of one export."""

    def __init__(self) -> None:
        self.warnings: list[dict[str, str]] = []
        self.counts: Counter[str] = Counter()
        self._seen: set[tuple[str, str]] = set()

    def warn(self, path: object, what: str, why: str) -> None:
        """Note once that `what` at prim `path` was lost or changed, and `why`."""
        key = (str(path), what)
        if key not in self._seen:
            self._seen.add(key)
            self.warnings.append({"path": key[0], "what": what, "why": why})

    def count(self, what: str, by: int = 1) -> None:
        """Add to a count of exported things."""
        self.counts[what] += by

    def to_json(self, source: str, output: str, source_hash: str) -> str:
        """The report file's text."""
        body = {
            "source": source,
            "output": output,
            "sourceHash": source_hash,
            "warnings": sorted(self.warnings, key=lambda w: (w["what"], w["path"])),
            "counts": dict(sorted(self.counts.items())),
        }
        return json.dumps(body, indent=1, ensure_ascii=False) + "\n"

    def summary(self) -> list[str]:
        """One line for each kind of warning, with its count and its first prim."""
        groups: dict[str, list[dict[str, str]]] = {}
        for warning in self.warnings:
            groups.setdefault(warning["what"], []).append(warning)
        lines = []
        for what, group in sorted(groups.items()):
            first = group[0]
            times = f" ({len(group)} prims)" if len(group) > 1 else ""
            lines.append(f"warning: {what}{times}: {first['path']}: {first['why']}")
        return lines
