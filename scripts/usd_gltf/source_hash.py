"""A fingerprint of everything that an export really read.

`Dependencies` collects the files while the stage is open: the content of each layer that composed,
of each file that a layer names but that USD could not open, and of each texture; and the names of
those that are not there. The report keeps that list, so the next run can hash the same files again
without opening the stage. Equal fingerprints mean equal output, so an output that carries the
fingerprint is up to date.
"""

from __future__ import annotations

import hashlib
import json
import os
import struct
import time
from importlib import metadata
from pathlib import Path

from pxr import Ar, Sdf, Usd

from . import EXPORTER
from .stage import Options

MISSING = "missing"
"""Stands for the content of a file that is not there."""
CHANGED = "changed while it was read"
"""Stands for content that nobody knows any more: the next run exports again."""
_ENVIRONMENT = ("PXR_AR_DEFAULT_SEARCH_PATH", "PXR_PLUGINPATH_NAME")
"""Variables that change which files USD finds or can open."""


class Dependencies:
    """The files that one export reads, by their path relative to the source's folder. Links are not
    followed in these paths: the next run has to go through them again, since they may lead elsewhere then."""

    def __init__(self, source: Path) -> None:
        self.started = time.time_ns()
        self.folder = os.path.abspath(source.parent)
        self.files: dict[str, str] = {}
        self._add_layer(os.path.abspath(source))

    def read(self, resolved: str) -> bytes | None:
        """The bytes of a resolved asset (also one inside a .usdz), or None if there is none."""
        data = _read_asset(resolved)
        content = MISSING if data is None else _digest(data)
        if self.files.setdefault(self._name(resolved), content) != content:
            self.files[self._name(resolved)] = CHANGED
        return data

    def miss(self, path: str) -> None:
        """Record a file that was looked for and is not there."""
        self.files.setdefault(self._name(path), MISSING)

    def add_layers(self, stage: Usd.Stage) -> None:
        """Record the layers of a stage, and the files they name that did not become layers."""
        for layer in stage.GetUsedLayers():
            if layer.realPath:
                self._add_layer(layer.realPath)
            named = [*layer.GetCompositionAssetDependencies(), *layer.GetExternalAssetDependencies()]
            for path in filter(None, named):
                if Sdf.Layer.IsAnonymousLayerIdentifier(path):
                    continue  # made in memory of a file that was read
                anchored = Sdf.ComputeAssetPathRelativeToLayer(layer, path)
                resolved = str(Ar.GetResolver().Resolve(anchored))
                if resolved:
                    self._add_layer(resolved)
                elif os.path.isabs(anchored):
                    self.miss(anchored)
                else:
                    self.miss(os.path.join(os.path.dirname(layer.realPath), anchored))

    def fingerprint(self, options: Options) -> str:
        """The fingerprint of these files under `options`."""
        return _fingerprint(options, self.files)

    def _add_layer(self, path: str) -> None:
        """Record a file that USD itself reads, or fails to read, some time after `started`."""
        if self._name(path) in self.files:
            return
        data = self.read(path)
        outer = Ar.SplitPackageRelativePathOuter(path)[0] if Ar.IsPackageRelativePath(path) else path
        try:
            if data is not None and self.started < os.stat(outer).st_mtime_ns <= time.time_ns():
                self.files[self._name(path)] = CHANGED
        except OSError:
            self.files[self._name(path)] = CHANGED

    def _name(self, path: str) -> str:
        return os.path.relpath(path, self.folder) if os.path.isabs(path) else path


def up_to_date(source: Path, options: Options, fingerprint: str, dependencies: dict[str, str]) -> bool:
    """Whether the files of an earlier export still have the content that `fingerprint` stands for."""
    if not all(isinstance(digest, str) for digest in dependencies.values()):
        return False
    folder = os.path.abspath(source.parent)
    # The list must be of this source: a report may have been copied from elsewhere.
    if os.path.basename(os.path.abspath(source)) not in dependencies or CHANGED in dependencies.values():
        return False
    files = {}
    for name in dependencies:
        data = _read_asset(os.path.normpath(os.path.join(folder, name)))
        files[name] = MISSING if data is None else _digest(data)
    return _fingerprint(options, files) == fingerprint


def _read_asset(resolved: str) -> bytes | None:
    if not Ar.IsPackageRelativePath(resolved) and os.path.isdir(resolved):
        return None
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
    if asset is None:
        return None
    return bytes(asset.GetBuffer()) if asset.GetSize() else b""


def _digest(data: bytes) -> str:
    return hashlib.blake2b(data, digest_size=20).hexdigest()


def _fingerprint(options: Options, files: dict[str, str]) -> str:
    """Exporter, packages, options, environment and files in one number."""
    digest = hashlib.blake2b(digest_size=20)

    def add(label: str, data: bytes) -> None:
        digest.update(struct.pack("<QQ", len(label), len(data)) + label.encode("utf-8", "replace") + data)

    add("exporter", f"{EXPORTER} {Usd.GetVersion()}".encode())
    for module in sorted(Path(__file__).parent.glob("*.py")):
        add(module.name, module.read_bytes())
    add("materialx", _version("materialx").encode())
    add("options", repr(options).encode())
    for variable in _ENVIRONMENT:
        add(variable, os.environ.get(variable, "").encode("utf-8", "replace"))
    for name, content in sorted(files.items()):
        add(name, content.encode())
    return digest.hexdigest()


def _version(package: str) -> str:
    """The version of a Python package; empty if it is not installed, since what it reads is left out then."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def recorded_hash(output: Path) -> str | None:
    """The fingerprint that an existing .glb or .gltf carries, if its side files are there too."""
    try:
        data = output.read_bytes()
        if data[:4] == b"glTF":
            (length,) = struct.unpack_from("<I", data, 12)
            data = data[20 : 20 + length]
        document = json.loads(data)
        uris = [item.get("uri") for kind in ("buffers", "images") for item in document.get(kind, [])]
        for node in document.get("nodes", []):
            light = node.get("extras", {}).get("usdLux", {})
            uris += [light.get("texture"), light.get("shaping", {}).get("ies", {}).get("file")]
        if all((output.parent / uri).is_file() for uri in uris if uri):
            return document["asset"]["extras"]["usd"]["sourceHash"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, struct.error):
        pass
    return None
