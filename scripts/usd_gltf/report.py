"""What an export could not carry, and what it counted.

A *warning* says that something of the stage is lost or changed; `--strict` makes it an error. A
*note* says that something was read in another way than the schema's own, or that it has no effect
on a picture; nothing is lost. Every line belongs to one of `CATEGORIES`.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable

CATEGORIES = ("lights", "materials", "geometry", "cameras", "animation", "other")
"""What a line is about; `--strict=lights,cameras` names some of them."""


class ExportError(Exception):
    """The export cannot go on. The message names the file, the prim and the remedy."""


class Report:
    """Warnings, notes and counts of one export."""

    def __init__(self) -> None:
        self.warnings: list[dict[str, str]] = []
        self.notes: list[dict[str, str]] = []
        self.counts: Counter[str] = Counter()
        self._idle: dict[str, tuple[dict[str, str], set[str], set[str]]] = {}
        self._seen: set[tuple[str, str, str]] = set()

    def about(self, category: str) -> Notebook:
        """The same report for code whose lines all belong to `category`."""
        return Notebook(self, category)

    def add(self, lines: list[dict[str, str]], category: str, path: object, what: str, why: str) -> None:
        """Add one line to the warnings or the notes, unless it is there already."""
        key = (category, str(path), what)
        if key not in self._seen:
            self._seen.add(key)
            lines.append({"category": category, "path": key[1], "what": what, "why": why})

    def add_idle(self, category: str, path: str, names: Iterable[str]) -> None:
        """Add attributes of a prim that do not change the picture. All of a category are one note, for nobody has to do
        anything about them."""
        if category not in self._idle:
            note = {"category": category, "path": path, "what": "attributes without effect", "why": ""}
            self.notes.append(note)
            self._idle[category] = note, set(), set()
        note, prims, all_names = self._idle[category]
        prims.add(path)
        all_names.update(names)
        who = f"those of {len(prims)} prims" if len(prims) > 1 else "they"
        note["why"] = f"{who} do not change the picture: {', '.join(sorted(all_names))}"

    def warnings_in(self, categories: Iterable[str]) -> list[dict[str, str]]:
        """The warnings that belong to one of `categories`."""
        chosen = set(categories)
        return [warning for warning in self.warnings if warning["category"] in chosen]

    def to_json(self, source: str, output: str, source_hash: str, dependencies: dict[str, str]) -> str:
        """The report file's text."""

        def in_order(lines: list[dict[str, str]]) -> list[dict[str, str]]:
            return sorted(lines, key=lambda line: (line["category"], line["what"], line["path"]))

        body = {
            "source": source,
            "output": output,
            "sourceHash": source_hash,
            "warnings": in_order(self.warnings),
            "notes": in_order(self.notes),
            "counts": dict(sorted(self.counts.items())),
            "dependencies": dict(sorted(dependencies.items())),
        }
        return json.dumps(body, indent=1, ensure_ascii=False) + "\n"

    def summary(self) -> list[str]:
        """One line for each kind of warning and note, with its count and its first prim."""
        printed = []
        for name, lines in (("warning", self.warnings), ("note", self.notes)):
            groups: dict[tuple[str, str], list[dict[str, str]]] = {}
            for line in lines:
                groups.setdefault((line["category"], line["what"]), []).append(line)
            for (category, what), group in sorted(groups.items()):
                first = group[0]
                times = f" ({len(group)} prims)" if len(group) > 1 else ""
                printed.append(f"{name}: {category}: {what}{times}: {first['path']}: {first['why']}")
        return printed


class Notebook:
    """A report, written to by code whose lines all belong to one category."""

    def __init__(self, report: Report, category: str) -> None:
        assert category in CATEGORIES
        self._report, self._category = report, category

    def about(self, category: str) -> Notebook:
        """The same report under another category."""
        return Notebook(self._report, category)

    def warn(self, path: object, what: str, why: str) -> None:
        """Say once that `what` at prim `path` is lost or changed, and `why`."""
        self._report.add(self._report.warnings, self._category, path, what, why)

    def note(self, path: object, what: str, why: str) -> None:
        """Say once how `what` at prim `path` was read; nothing of it is lost."""
        self._report.add(self._report.notes, self._category, path, what, why)

    def idle(self, path: object, names: Iterable[str]) -> None:
        """Say that attributes of prim `path` do not change the picture."""
        self._report.add_idle(self._category, str(path), names)

    def count(self, what: str, by: int = 1) -> None:
        """Add to a count of exported things."""
        self._report.counts[what] += by
