"""The whole export, from a source path to files."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

from pxr import Usd, UsdGeom

from . import EXPORTER
from .gltf_document import Document, number
from .light_carriers import LightCarriers
from .light_networks import LightNetworks
from .light_profiles import LightProfiles
from .light_textures import LightTextures
from .linking import Linking, LinkSubsets
from .materials import Materials
from .materialx_layers import Documents
from .mesh import MeshReader
from .node_writer import NodeWriter, root_node
from .prim_tree import PrimTree
from .progress import Progress
from .report import Report
from .skinning import Skinning
from .source_hash import Dependencies
from .stage import Frames, Options, choose_frames, open_stage
from .surfaces import Surfaces
from .textures import Textures


@dataclass
class Exported:
    """A document that is ready to be written."""

    document: Document
    usd: dict
    report: Report
    fingerprint: str
    dependencies: dict[str, str]


def export(source: Path, output: Path, options: Options, progress: Progress) -> Exported:
    """Compile `source` into a document; nothing is written yet."""
    progress.stage("opening the stage")
    report = Report()
    other = report.about("other")
    dependencies = Dependencies(source)
    documents = Documents(dependencies, report.about("materials"))
    stage = open_stage(source, options, documents, other)
    frames = choose_frames(stage, options, report.about("animation"))
    meters_per_unit = UsdGeom.GetStageMetersPerUnit(stage)
    if not (math.isfinite(meters_per_unit) and meters_per_unit > 0):
        other.warn("/", "metersPerUnit is not positive", f"it is {meters_per_unit}; 0.01 is used")
        meters_per_unit = 0.01
    up_axis = str(UsdGeom.GetStageUpAxis(stage))

    document = Document(output)
    textures = Textures(document, dependencies, frames.first, report.about("materials"))
    surfaces = Surfaces(textures, frames, meters_per_unit, report.about("materials"))
    materials = Materials(document, surfaces.read, report.about("materials"))
    skinning = Skinning(stage, frames, report.about("geometry"))
    meshes = MeshReader(document, materials, skinning, frames, options.complexity, report.about("geometry"))
    meshes.link_subsets = LinkSubsets(stage, report.about("lights"))
    networks = LightNetworks(surfaces.networks.images, frames, report.about("lights"))
    tree = PrimTree(stage, meshes, frames, options.purposes, meters_per_unit, networks, report.about("geometry"), progress)
    pictures = LightTextures(document, dependencies, frames, report.about("lights"))
    profiles = LightProfiles(document, dependencies, report.about("lights"))
    carriers = LightCarriers(
        document,
        materials,
        pictures,
        profiles,
        frames,
        meters_per_unit,
        options.normalize_area,
        report.about("lights"),
    )
    progress.stage("reading prims")
    prims = tree.roots()
    progress.stage("making nodes")
    linking = Linking(stage, prims, report.about("lights"))
    writer = NodeWriter(document, materials, carriers, linking, frames, report.about("animation"))
    writer.write(prims, root_node(meters_per_unit, up_axis == UsdGeom.Tokens.z))
    other.count("nodes", len(document.nodes))
    dependencies.add_layers(stage)
    fingerprint = dependencies.fingerprint(options)
    usd = _asset_extras(meters_per_unit, up_axis, frames, options, fingerprint)
    return Exported(document, usd, report, fingerprint, dependencies.files)


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
        "startTimeCode": number(frames.first),
        "endTimeCode": number(frames.numbers[-1]),
        **({"zeroTimeCode": number(frames.zero)} if frames.zero != frames.first else {}),
        "normalizeArea": options.normalize_area,
        "sourceHash": fingerprint,
    }
