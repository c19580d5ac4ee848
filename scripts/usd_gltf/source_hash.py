"""A fingerprint of everything that an export depends on.

The content of every layer and texture that the root layer can reach (through any variant), the
names of those that cannot be found, the options, and the exporter's own source. Equal fingerprints
mean equal output, so an output that carries the fingerprint is up to date.
"""

from __future__ import annotations

import hashlib
import json
import struct
from pathlib import Path

from pxr import Ar, Sdf, Tf, Usd, UsdUtils

from . import EXPORTER
from .stage import Options


def read_asset(resolved: str) -> bytes | None:
    """The bytes of a resolved asset (also one inside a .usdz), or None."""
    asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(resolved))
    return bytes(asset.GetBuffer()) if asset is not None else None


def source_hash(source: Path, options: Options) -> str:
    """Hexadecimal fingerprint of `source` and `options`."""
    digest = hashlib.blake2b(digest_size=20)

    def add(label: str, data: bytes) -> None:
        digest.update(struct.pack("<QQ", len(label), len(data)) + label.encode("utf-8", "replace") + data)

    add("exporter", f"{EXPORTER} {Usd.GetVersion()}".encode())
    for module in sorted(Path(__file__).parent.glob("*.py")):
        add(module.name, module.read_bytes())
    add("options", repr(options).encode())
    add("source", source.read_bytes())
    try:
        layers, assets, missing = UsdUtils.ComputeAllDependencies(str(source))
    except (Tf.ErrorException, RuntimeError):
        return digest.hexdigest()
    folder = str(source.resolve().parent)
    files = {layer.realPath for layer in layers if isinstance(layer, Sdf.Layer)} | set(assets)
    for file in sorted(files):
        data = read_asset(file)
        add(file.removeprefix(folder), b"" if data is None else data)
    for file in sorted(set(missing)):
        add(f"missing {file.removeprefix(folder)}", b"")
    return digest.hexdigest()


def recorded_hash(output: Path) -> str | None:
    """The fingerprint that an existing .glb or .gltf carries, if its side files are there too."""
    try:
        data = output.read_bytes()
        if data[:4] == b"glTF":
            (length,) = struct.unpack_from("<I", data, 12)
            data = data[20 : 20 + length]
        document = json.loads(data)
        uris = [item.get("uri") for kind in ("buffers", "images") for item in document.get(kind, [])]
        uris += [
            node.get("extras", {}).get("usdLux", {}).get("texture") for node in document.get("nodes", [])
        ]
        if all((output.parent / uri).is_file() for uri in uris if uri):
            return document["asset"]["extras"]["usd"]["sourceHash"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, struct.error):
        pass
    return None
