"""What UsdLux says of a light and glTF cannot hold: each is a line in the report."""

from __future__ import annotations

from .light_attributes import LightAttributes


def report_losses(inputs: LightAttributes) -> None:
    """Report everything about a light that the file holds only as extras, or not at all."""
    _shadows(inputs)
    _relations(inputs)


def _shadows(inputs: LightAttributes) -> None:
    if not inputs.first("shadow:enable"):
        return  # there are none; `linking` sees to that
    why = "a non-physical control without a carrier; the light casts plain shadows"
    if any(inputs.still("shadow:color")):
        inputs.report.warn(inputs.path, "shadow:color", why)
    if inputs.still("shadow:distance") >= 0:
        inputs.report.warn(inputs.path, "shadow:distance", why)
    if inputs.still("shadow:falloff") >= 0:
        inputs.report.warn(inputs.path, "shadow:falloff", why)


def _relations(inputs: LightAttributes) -> None:
    portals = inputs.prim.GetRelationship("portals")
    if str(inputs.prim.GetTypeName()).startswith("DomeLight") and portals and portals.GetTargets():
        inputs.report.note(inputs.path, "dome portals", "they only guide sampling and have no carrier")
