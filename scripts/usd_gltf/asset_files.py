"""Files that asset attributes name: found, read, and recorded as dependencies."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from pxr import Ar, Sdf, Usd

from .report import Notebook
from .source_hash import Dependencies

UDIM = "<UDIM>"


@dataclass(frozen=True)
class AssetFile:
    """A file that was read."""

    name: str
    data: bytes
    existing: Path | None
    """Where it is; None inside a package."""


class AssetFiles:
    """Reads files; what cannot be read is reported."""

    def __init__(self, dependencies: Dependencies) -> None:
        self.dependencies = dependencies

    def read(
        self,
        owner: object,
        attribute: Usd.Attribute,
        code: float,
        instead: str,
        report: Notebook,
        what: str = "missing texture",
    ) -> AssetFile | None:
        """The file that an attribute names; None if it names none, or (reported as `what`, with what is
        done `instead`) if it cannot be read."""
        asset = attribute.Get(code)
        if not isinstance(asset, Sdf.AssetPath) or not asset.path:
            return None
        resolved = asset.resolvedPath
        data = self.dependencies.read(resolved) if resolved else None
        if data is None:
            place = place_of(attribute, code)
            self.dependencies.miss(place)
            found = f"{asset.path} is a folder" if os.path.isdir(place) else f"{asset.path} cannot be found"
            if os.path.isfile(place):
                found = f"{asset.path} is there, but cannot be opened"
            report.warn(owner, what, f"{found}; {instead}")
            return None
        return _file(resolved, data)

    def tiles(self, attribute: Usd.Attribute, code: float) -> dict[tuple[int, int], AssetFile]:
        """The UDIM tiles that are there, by their column and row."""
        asset = attribute.Get(code)
        found = {}
        for number in range(100):
            place = _anchored(attribute, code, asset.path.replace(UDIM, str(1001 + number)))
            resolved = str(Ar.GetResolver().Resolve(place))
            data = self.dependencies.read(resolved) if resolved else None
            if data is not None:
                found[number % 10, number // 10] = _file(resolved, data)
            else:
                self.dependencies.miss(place)
        return found


def place_of(attribute: Usd.Attribute, code: float) -> str:
    """Where the file is that an attribute names, or where it should be; empty if it names none."""
    asset = attribute.Get(code)
    if not isinstance(asset, Sdf.AssetPath) or not asset.path:
        return ""
    return asset.resolvedPath or _anchored(attribute, code, asset.path)


def _file(resolved: str, data: bytes) -> AssetFile:
    if Ar.IsPackageRelativePath(resolved):
        inner = Ar.SplitPackageRelativePathInner(resolved)[1]
        return AssetFile(os.path.basename(inner), data, None)
    return AssetFile(os.path.basename(resolved), data, Path(resolved))


def _anchored(attribute: Usd.Attribute, code: float, path: str) -> str:
    """An asset path, relative to the layer that authors it."""
    for spec in attribute.GetPropertyStack(code):
        if spec.HasDefaultValue() or spec.layer.GetNumTimeSamplesForPath(spec.path):
            anchored = Sdf.ComputeAssetPathRelativeToLayer(spec.layer, path)
            if os.path.isabs(anchored) or Ar.IsPackageRelativePath(anchored):
                return anchored
            return os.path.join(os.path.dirname(spec.layer.realPath), anchored)
    return path
