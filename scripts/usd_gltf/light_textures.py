"""The pictures of rect lights and domes, as files that `ingest` reads.

The light of a picture that cannot be read is not known, so such a light stays dark: a fallback is
never brighter than what was authored. A picture that changes from frame to frame keeps one of them,
and the light's brightness follows the mean of the others.
"""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass

import numpy as np

from . import pictures
from .asset_files import UDIM, AssetFile, AssetFiles
from .baking import COARSE, bake, png_bytes
from .gltf_document import Document
from .light_inputs import Light
from .pictures import Picture, PictureError
from .report import Notebook
from .source_hash import Dependencies
from .stage import Frames

_SUFFIXES = {"PNG": (".png",), "JPEG": (".jpg", ".jpeg"), "EXR": (".exr",), "HDR": (".hdr",)}
_DARK = "the light is left dark, since its brightness is not known"


@dataclass
class Shown:
    """A picture in a file, and what its texels are to be multiplied by."""

    name: str
    data: bytes
    existing: object
    factor: np.ndarray
    """(3,), or (frames, 3) if the picture changes."""


class LightTextures:
    """Reads the pictures of lights."""

    def __init__(
        self, document: Document, dependencies: Dependencies, frames: Frames, report: Notebook
    ) -> None:
        self.document, self.frames, self.report = document, frames, report
        self.files = AssetFiles(dependencies)
        self._rects: dict[str, tuple[dict | None, np.ndarray]] = {}
        self._domes: dict[str, tuple[str | None, np.ndarray]] = {}

    def rect(self, light: Light) -> tuple[dict | None, np.ndarray]:
        """glTF's texture info of a rect light, and the factor of its radiance; the factor of one
        that cannot be read is 0."""
        if light.path not in self._rects:
            shown = self._shown(light, dome=False)
            if shown is None:
                self._rects[light.path] = None, np.zeros(3)
            else:
                image = self.document.image(shown.name, shown.data, shown.existing)
                sampler = self.document.shared("samplers", {"wrapS": 33071, "wrapT": 33071})
                texture = self.document.shared("textures", {"source": image, "sampler": sampler})
                self._rects[light.path] = {"index": texture}, shown.factor
        return self._rects[light.path]

    def dome(self, light: Light) -> tuple[str | None, np.ndarray]:
        """URI of a dome's picture, and the factor of its radiance; 0 if it cannot be read."""
        if light.path not in self._domes:
            shown = None
            if light.texels is not None or light.texture_format in ("automatic", "latlong"):
                shown = self._shown(light, dome=True)
            else:
                why = f"only pictures of latitude and longitude are read; {_DARK}"
                self.report.warn(light.path, f"texture:format {light.texture_format}", why)
            if shown is None:
                self._domes[light.path] = None, np.zeros(3)
            else:
                uri = self.document.side_file(shown.name, shown.data, shown.existing)
                self._domes[light.path] = uri, shown.factor
        return self._domes[light.path]

    def _shown(self, light: Light, dome: bool) -> Shown | None:
        """The light's picture; None (reported) if there is none that can be read."""
        if light.texels is not None:
            digest = hashlib.blake2b(light.path.encode(), digest_size=4).hexdigest()
            name = f"{light.path.rsplit('/', 1)[-1]}_color_{digest}"
            return self._baked(light, name, "what its network computes", light.texels)
        attribute = light.texture
        asset = attribute.Get(self.frames.first)
        if asset is not None and UDIM in asset.path:
            why = f"{asset.path}: a light has no tiles; {_DARK}"
            self.report.warn(light.path, "UDIM texture on a light", why)
            return None
        varying = attribute.ValueMightBeTimeVarying()
        codes = self.frames.codes if varying else (self.frames.first,)
        files: dict[str, AssetFile | None] = {}
        names = []
        for code in codes:
            asset = attribute.Get(code)
            names.append(asset.resolvedPath or asset.path if asset is not None else "")
            if names[-1] and names[-1] not in files:
                files[names[-1]] = self.files.read(light.path, attribute, code, _DARK, self.report)
        if len(set(names)) == 1:
            file = files[names[0]]
            return None if file is None else self._carried(light, file, dome)
        return self._sequence(light, files, names, dome)

    def _sequence(self, light: Light, files: dict[str, AssetFile | None], names: list[str], dome: bool) -> Shown | None:
        """One picture of many, and the mean of each over its mean."""
        means = {"": np.ones(3)}
        for name, file in files.items():
            means[name] = np.zeros(3)
            try:
                if file is not None:
                    means[name] = _mean(pictures.decode(file.data), dome)
            except PictureError as error:
                self._unreadable(light, file.name, error)
        first = names[self.frames.rest] if len(names) > 1 else names[0]
        kept = max(files, key=lambda name: (name == first and means[name].all(), means[name].min(), name))
        file = files[kept]
        shown = None if file is None else self._carried(light, file, dome)
        if shown is None:
            return None
        why = f"{file.name} is kept, and the brightness of every frame is that of its own picture"
        self.report.warn(light.path, f"animated {light.texture.GetName()}", why)
        whole = means[kept]
        ratios = [np.where(whole > 0, means[n] / np.where(whole > 0, whole, 1.0), 0.0) for n in names]
        shown.factor = shown.factor * np.array(ratios)
        return shown

    def _carried(self, light: Light, file: AssetFile, dome: bool) -> Shown | None:
        """A file as the carrier can hold it: as it is, or baked into a PNG."""
        form = pictures.kind(file.data)
        try:
            if form in ("PNG", "JPEG") or (dome and form is not None):
                if dome:
                    self._check_dome(light, file)
                return _as_it_is(file, form)
            picture = pictures.decode(file.data)
            self._check_layout(light, file, picture.cube, picture.texels.shape[1::-1], dome)
        except PictureError as error:
            self._unreadable(light, file.name, error)
            return None
        stem = os.path.splitext(file.name)[0]
        if not picture.linear:
            return Shown(f"{stem}.png", png_bytes(picture.texels), None, np.ones(3))
        return self._baked(light, stem, file.name, picture.texels[:, :, :3])

    def _baked(self, light: Light, stem: str, source: str, texels: np.ndarray) -> Shown:
        baked = bake(texels)
        why = f"{source} becomes a PNG of eight bits and a factor; its total is kept, its grain is {baked.grain:.1%}"
        if baked.grain > COARSE:
            why += ": its darker parts are coarse beside its brightest"
            self.report.warn(light.path, "picture of a light baked coarsely", why)
        else:
            self.report.note(light.path, "picture of a light baked", why)
        return Shown(f"{stem}.png", baked.png, None, baked.factor)

    def _check_dome(self, light: Light, file: AssetFile) -> None:
        """Refuse or report what is no picture of latitude and longitude."""
        shape = pictures.shape(file.data)
        if shape is not None:
            size, cube = shape
            self._check_layout(light, file, cube, size, dome=True)

    def _check_layout(self, light: Light, file: AssetFile, cube: bool, size: tuple[int, int], dome: bool) -> None:
        if cube:
            raise PictureError("it is a cube map; save it as latitude and longitude")
        if dome and abs(size[0] - 2 * size[1]) > 0.02 * size[0]:
            why = f"{file.name} is {size[0]} x {size[1]}; it is read as latitude and longitude all the same"
            is_cross = 3 * size[0] == 4 * size[1] or 4 * size[0] == 3 * size[1]
            line = self.report.warn if is_cross else self.report.note
            line(light.path, "dome picture that is not twice as wide as high", why)

    def _unreadable(self, light: Light, name: str, error: PictureError) -> None:
        self.report.warn(light.path, "picture of a light that cannot be read", f"{name}: {error}; {_DARK}")


def _as_it_is(file: AssetFile, form: str) -> Shown:
    stem, suffix = os.path.splitext(file.name)
    fitting = suffix.lower() in _SUFFIXES[form]
    name = file.name if fitting else stem + _SUFFIXES[form][0]
    return Shown(name, file.data, file.existing if fitting else None, np.ones(3))


def _mean(picture: Picture, dome: bool) -> np.ndarray:
    """Mean light of a picture; over all directions, if it is a dome's."""
    light = picture.texels[:, :, :3]
    if not picture.linear:
        light = pictures.linear_from_srgb(light)
    rows = light.mean(axis=1)
    if not dome:
        return rows.mean(axis=0)
    weight = np.sin((np.arange(len(rows)) + 0.5) * np.pi / len(rows))
    return weight @ rows / weight.sum()
