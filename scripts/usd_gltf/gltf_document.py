"""A glTF document in the making: buffers, accessors, shared objects, and the files written.

Equal data is stored once: accessors, materials, meshes, lights, images and samplers are keyed by
their content, so that instances share whatever is the same however USD spelt it.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import struct
from pathlib import Path

import numpy as np

from .report import ExportError
from .whole_file import write_atomically

FLOAT, UINT32, UINT16 = 5126, 5125, 5123
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963
_TYPES = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}
_IMAGE_TYPES = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg"}


def number(value: float) -> float:
    """`value` rounded to single precision's nine digits, for short and reproducible JSON."""
    return float(f"{float(value):.9g}") + 0.0


def numbers(values) -> list[float]:
    """A list of `number`s."""
    return [number(v) for v in values]


class Document:
    """The glTF JSON, its binary buffer and its side files."""

    def __init__(self, output: Path) -> None:
        self.output = output
        self.binary = output.suffix.lower() == ".glb"
        self.nodes: list[dict] = []
        self.roots: list[int] = []
        self.side_files: dict[str, bytes] = {}
        self.extensions: set[str] = set()
        self.animation: dict[str, list] = {"channels": [], "samplers": []}
        self._lists: dict[str, list[dict]] = {}
        self._index: dict[tuple[str, str], int] = {}
        self._chunks: list[bytes] = []
        self._length = 0
        self._accessors: dict[tuple, int] = {}
        self._images: dict[bytes, int] = {}

    # -- objects ---------------------------------------------------------------------------------

    def node(self, node: dict) -> int:
        """Append a node, return its index."""
        self.nodes.append(node)
        return len(self.nodes) - 1

    def shared(self, kind: str, value: dict) -> int:
        """Index of an object equal to `value` in the top-level list `kind`, added if it is new."""
        key = (kind, json.dumps(value, sort_keys=True))
        if key not in self._index:
            items = self._lists.setdefault(kind, [])
            items.append(value)
            self._index[key] = len(items) - 1
        return self._index[key]

    def objects(self, kind: str) -> list[dict]:
        """The top-level list `kind` (a list that nobody should change)."""
        return self._lists.get(kind, [])

    def use(self, extension: str) -> str:
        """Note that the file uses `extension`, and return its name."""
        self.extensions.add(extension)
        return extension

    # -- binary data -----------------------------------------------------------------------------

    def _view(self, data: bytes, target: int | None = None) -> int:
        self._chunks.append(data)
        view = {"buffer": 0, "byteOffset": self._length, "byteLength": len(data)}
        if target is not None:
            view["target"] = target
        padding = -len(data) % 4
        self._chunks.append(b"\0" * padding)
        self._length += len(data) + padding
        views = self._lists.setdefault("bufferViews", [])
        views.append(view)
        return len(views) - 1

    def accessor(self, array: np.ndarray, target: int | None = None, bounds: bool = False) -> int:
        """An accessor over `array` (n or n x k; float32, or unsigned 16 or 32 bits), stored once.

        `bounds` writes min and max, which glTF asks of positions and animation times.
        """
        array = np.ascontiguousarray(array)
        if array.dtype == np.float32:
            component = FLOAT
            if not np.isfinite(array).all():
                raise ExportError("internal: a non-finite number reached an accessor")
        else:
            component = UINT16 if array.dtype == np.uint16 else UINT32
        data = array.tobytes()
        width = 1 if array.ndim == 1 else array.shape[1]
        key = (hashlib.blake2b(data, digest_size=16).digest(), component, width, target, bounds)
        if key not in self._accessors:
            accessor = {
                "bufferView": self._view(data, target),
                "componentType": component,
                "count": len(array),
                "type": _TYPES[width],
            }
            if bounds:
                rows = array.reshape(len(array), width).astype(float)
                accessor["min"] = rows.min(axis=0).tolist()
                accessor["max"] = rows.max(axis=0).tolist()
            accessors = self._lists.setdefault("accessors", [])
            accessors.append(accessor)
            self._accessors[key] = len(accessors) - 1
        return self._accessors[key]

    def indices(self, array: np.ndarray) -> int:
        """An index accessor, 16 bits where they suffice."""
        small = len(array) == 0 or int(array.max()) < 65535
        return self.accessor(array.astype(np.uint16 if small else np.uint32), ELEMENT_ARRAY_BUFFER)

    # -- images and side files -------------------------------------------------------------------

    def side_file(self, name: str, data: bytes, existing: Path | None = None) -> str:
        """URI, relative to the output, of a file with these bytes inside the output's folder.

        `existing` is where the data was read from; it is named as it stands when it lies inside
        the folder and its path needs no escaping, otherwise the data is copied to
        `<stem>_textures/`.
        """
        folder = Path(os.path.realpath(self.output.parent))
        if existing is not None:
            real = Path(os.path.realpath(existing))
            if real.is_relative_to(folder):
                uri = real.relative_to(folder).as_posix()
                if re.fullmatch(r"[A-Za-z0-9._/-]+", uri):
                    return uri
        clean = re.sub(r"[^A-Za-z0-9._-]+", "_", name).lstrip(".") or "file"
        stem = re.sub(r"[^A-Za-z0-9._-]+", "_", self.output.stem).lstrip(".") or "scene"
        uri = f"{stem}_textures/{clean}"
        if self.side_files.get(uri, data) != data:
            base, suffix = os.path.splitext(clean)
            digest = hashlib.blake2b(data, digest_size=6).hexdigest()
            uri = f"{stem}_textures/{base}-{digest}{suffix}"
        self.side_files[uri] = data
        return uri

    def image(self, name: str, data: bytes, existing: Path | None = None) -> int:
        """An image from PNG or JPEG bytes: embedded in a .glb, a file beside a .gltf."""
        key = hashlib.blake2b(data, digest_size=16).digest()
        if key not in self._images:
            if self.binary:
                mime = _IMAGE_TYPES[os.path.splitext(name)[1].lower()]
                image = {"bufferView": self._view(data), "mimeType": mime, "name": name}
            else:
                image = {"uri": self.side_file(name, data, existing)}
            images = self._lists.setdefault("images", [])
            images.append(image)
            self._images[key] = len(images) - 1
        return self._images[key]

    # -- files -----------------------------------------------------------------------------------

    def _json(self, usd: dict, buffer_uri: str | None) -> bytes:
        document: dict = {
            "asset": {"version": "2.0", "generator": usd["exporter"], "extras": {"usd": usd}},
            "scene": 0,
            "scenes": [{"nodes": self.roots}] if self.roots else [{}],
        }
        if self.nodes:
            document["nodes"] = self.nodes
        lists = dict(self._lists)
        lights = lists.pop("lights", None)
        document.update(sorted(lists.items()))
        if lights:
            self.use("KHR_lights_punctual")
            document["extensions"] = {"KHR_lights_punctual": {"lights": lights}}
        if self.animation["channels"]:
            document["animations"] = [{"name": "usd", **self.animation}]
        if self._length:
            buffer: dict = {"byteLength": self._length}
            if buffer_uri is not None:
                buffer["uri"] = buffer_uri
            document["buffers"] = [buffer]
        if self.extensions:
            document["extensionsUsed"] = sorted(self.extensions)
        text = json.dumps(document, separators=(",", ":"), allow_nan=False, ensure_ascii=False)
        return text.encode("utf-8", errors="replace")

    def write(self, usd: dict) -> None:
        """Write all files, the glTF itself last. `usd` becomes `asset.extras.usd`."""
        # Its parts are not joined: a copy of gigabytes.
        files = {self.output.parent / uri: [data] for uri, data in self.side_files.items()}
        if self.binary:
            header = self._json(usd, None)
            header += b" " * (-len(header) % 4)
            main = [struct.pack("<II", len(header), 0x4E4F534A), header]
            if self._length:
                main += [struct.pack("<II", self._length, 0x004E4942), *self._chunks]
            length = 12 + sum(map(len, main))
            if length >= 1 << 32:
                raise ExportError(
                    f"{self.output}: {length} bytes do not fit a .glb (4 GiB): write a .gltf"
                )
            main.insert(0, struct.pack("<4sII", b"glTF", 2, length))
        else:
            name = re.sub(r"[^A-Za-z0-9._-]+", "_", self.output.stem) + ".bin"
            main = [self._json(usd, name)]
            if self._length:
                files[self.output.parent / name] = self._chunks
        for path, parts in sorted(files.items()):
            write_atomically(path, *parts)
        write_atomically(self.output, *main)
