"""The whole export, from a source path to files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from pxr import Usd, UsdGeom

from . import EXPORTER
from .gltf_document import Document, number
from .light_carriers import LightCarriers
from .materials import Materials
from .mesh import MeshReader
from .node_writer import NodeWriter, root_node
from .preview_surface import PreviewSurfaces
from .prim_tree import PrimTree
from .report import Report
from .stage import Frames, Options, choose_frames, open_stage
from .textures import Textures


@dataclass
class Exported:
    """A document that is ready to be written."""

    document: Document
    usd: dict
    report: Report


def export(source: Path, output: Path, options: Options, fingerprint: str) -> Exported:
    """Compile `source` into a document; nothing is written yet."""
    report = Report()
    stage = open_stage(source, options, report)
    frames = choose_frames(stage, options, report)
    meters_per_unit = UsdGeom.GetStageMetersPerUnit(stage)
    if not (math.isfinite(meters_per_unit) and meters_per_unit > 0):
        report.warn("/", "metersPerUnit is not positive", f"it is {meters_per_unit}; 0.01 is used")
        meters_per_unit = 0.01
    up_axis = str(UsdGeom.GetStageUpAxis(stage))

    document = Document(output)
    textures = Textures(document, frames.first, report)
    materials = Materials(document, PreviewSurfaces(textures, frames, report).read, report)
    meshes = MeshReader(document, materials, frames, report)
    tree = PrimTree(stage, meshes, frames, options.purposes, meters_per_unit, report)
    carriers = LightCarriers(
        document, materials, textures, frames, meters_per_unit, options.normalize_area, report
    )
    writer = NodeWriter(document, materials, carriers, frames, report)
    writer.write(tree.roots(), root_node(meters_per_unit, up_axis == UsdGeom.Tokens.z))
    report.count("nodes", len(document.nodes))
    usd = _asset_extras(meters_per_unit, up_axis, frames, options, fingerprint)
    return Exported(document, usd, report)


def _asset_extras(
    meters_per_unit: float, up_axis: str, frames: Frames, options: Options, fingerprint: str
) -> dict:
    """`asset.extras.usd`."""
    return {
        "exporter": EXPORTER,
        "usdVersion": ".".join(map(str, Usd.GetVersion()[1:])),
        "metersPerUnit": number(meters_per_unit),
        "upAxis": up_axis,
        "timeCodesPerSecond": number(frames.codes_per_second),
        "startTimeCode": number(frames.codes[0]),
        "endTimeCode": number(frames.codes[-1]),
        "normalizeArea": options.normalize_area,
        "sourceHash": fingerprint,
    }
