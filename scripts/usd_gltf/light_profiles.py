"""IES profiles of lights: ShapingAPI's `ies:file`, `ies:angleScale` and `ies:normalize`.

The file is carried as it is, beside the glTF; `src/ingest/ies` reads it, and nothing here does. So the report does not
tell what is wrong inside a file; `candelabra inspect` does.
"""

from __future__ import annotations

import os

from pxr import Usd

from .asset_files import AssetFiles, place_of
from .gltf_document import Document, number
from .light_inputs import Light
from .report import Notebook
from .source_hash import Dependencies

WITHOUT_CONE = {"coneAngle": 180.0, "coneSoftness": 0.0, "focus": 0.0, "focusTint": [0.0] * 3}
"""`extras.usdLux.shaping` of a light that nothing but a profile shapes."""


class LightProfiles:
    """Carries the profiles of lights; each file once."""

    def __init__(self, document: Document, dependencies: Dependencies, report: Notebook) -> None:
        self.document, self.report = document, report
        self.files = AssetFiles(dependencies)
        self._carried: dict[str, str] = {}
        """The file beside the glTF by where the profile is."""

    def carry(self, light: Light) -> dict | None:
        """`extras.usdLux.shaping.ies` of a light; None if it has no profile, or (reported) none that can be read."""
        if light.profile is None:
            return None
        uri = self._uri(light, light.profile.file, light.profile.code)
        if uri is None:
            return None
        ies: dict = {"file": uri}
        if light.profile.angle_scale != 0.0:
            ies["angleScale"] = number(light.profile.angle_scale)
        if light.profile.normalize:
            ies["normalize"] = True
        return ies

    def _uri(self, light: Light, attribute: Usd.Attribute, code: float) -> str | None:
        """The file beside the glTF."""
        place = place_of(attribute, code)
        if place not in self._carried:
            instead = "the light shines without it, as bright as if every number in it were 1"
            file = self.files.read(light.path, attribute, code, instead, self.report, "IES profile")
            if file is None:  # reported for each light
                return None
            stem, suffix = os.path.splitext(file.name)
            fitting = suffix.lower() == ".ies"
            self._carried[place] = self.document.side_file(
                file.name if fitting else f"{stem}.ies", file.data, file.existing if fitting else None
            )
        return self._carried[place]
