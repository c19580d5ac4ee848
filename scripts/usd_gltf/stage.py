"""Opening a stage: payloads, variants, and the frames to export."""

from __future__ import annotations

import functools
import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom

from .composition import report_composition
from .report import ExportError, Notebook
from .shutters import Shutter, open_codes, stage_shutters

if TYPE_CHECKING:
    from .materialx_layers import Documents

PREDICATE = Usd.TraverseInstanceProxies(
    Usd.PrimIsActive & Usd.PrimIsDefined & Usd.PrimIsLoaded & ~Usd.PrimIsAbstract
)
"""What of a stage is scene: the default predicate, with the insides of instances."""

PROTOTYPE_PREDICATE = Usd.TraverseInstanceProxies(Usd.PrimIsActive & Usd.PrimIsLoaded)
"""What of a PointInstancer's prototype is scene: it may be an `over` or a `class`."""


_NAMES_SHOWN = 20
_APART = 1e-3
"""Time codes that are nearer to each other count as one."""
_EVERYTHING = Usd.TraverseInstanceProxies(Usd.PrimAllPrimsPredicate)


@dataclass(frozen=True)
class Options:
    """The user's choices that change the exported file."""

    frames: tuple[int, int] | None = None
    variants: tuple[tuple[str, str, str], ...] = ()
    purposes: tuple[str, ...] = ("default", "render")
    mask: tuple[str, ...] = ()
    normalize_area: str = "stage"
    complexity: str = "high"


@dataclass(frozen=True)
class Frames:
    """The frames that are exported, and the time codes that are sampled for them."""

    numbers: tuple[float, ...]
    """The time codes of the frames, ascending."""
    codes_per_second: float
    shutters: tuple[Shutter, ...] = ()

    @property
    def first(self) -> float:
        """The frame that static values are read at."""
        return self.numbers[0]

    @functools.cached_property
    def codes(self) -> tuple[float, ...]:
        """All time codes to sample, ascending: the frames, and those at which shutters are open around them."""
        numbers = np.array(self.numbers)
        wanted = {code for shutter in self.shutters for code in open_codes(shutter, numbers).tolist()}
        # Times are stored in 32 bits, and must ascend there too.
        apart = max(_APART, (len(numbers) + len(wanted)) * 2.0**-22)
        kept: list[tuple[float, bool]] = []
        for code, is_number in sorted([*((code, True) for code in self.numbers), *((code, False) for code in wanted)]):
            if kept and code - kept[-1][0] < apart:
                if not is_number:
                    continue
                if not kept[-1][1]:
                    kept.pop()
            kept.append((code, is_number))
        return tuple(code for code, _ in kept)

    @functools.cached_property
    def rest(self) -> int:
        """Which of `codes` is the first frame."""
        return self.codes.index(self.first)

    @functools.cached_property
    def is_number(self) -> np.ndarray:
        """Which of `codes` are frames."""
        return np.isin(self.codes, self.numbers)

    @property
    def zero(self) -> float:
        """The time code at second 0 of the file: the first frame, or as many whole frames before it as are
        sampled, since glTF has no times below 0."""
        return self.first - math.ceil(self.first - self.codes[0])

    def seconds_at(self, codes) -> np.ndarray:
        """glTF times of time codes: `(timeCode - zero) / timeCodesPerSecond`."""
        return (np.array(codes) - self.zero) / self.codes_per_second

    @functools.cached_property
    def seconds(self) -> np.ndarray:
        """glTF times of `codes`."""
        return self.seconds_at(self.codes)


def first_line(error: Exception, path: Path) -> str:
    """The one line of a Tf exception that says what is wrong in `path`."""
    text = str(error)
    messages = re.findall(r"in file \S+ : '(.*?)'?\s*(?=\n\tError in|\Z)", text, re.DOTALL)
    line = " ".join((messages or [text])[0].split()) or type(error).__name__
    line = re.sub(r"parse error matching .*(?= at ')", "parse error", line)
    return line.removeprefix(str(path)).removeprefix(":")


def changes(attribute: Usd.Attribute, frames: Frames) -> bool:
    """Whether the attribute's value differs between two of the time codes that are sampled."""
    if not attribute or not attribute.ValueMightBeTimeVarying() or len(frames.codes) < 2:
        return False
    first = attribute.Get(frames.first)
    return any(attribute.Get(code) != first for code in frames.codes)


def open_stage(path: Path, options: Options, documents: Documents, report: Notebook) -> Usd.Stage:
    """Open with all payloads, set the variants, populate the mask, and report what did not compose.

    With a mask only its prims are there, what is above and below them, and what they need to look right: all that
    their relationships and connections name, except collections and proxies, which name what stands beside them.
    """
    if not path.is_file():
        raise ExportError(f"{path}: no such file")
    try:
        if options.mask:
            mask = Usd.StagePopulationMask([Sdf.Path(prim) for prim in options.mask])
            stage = Usd.Stage.OpenMasked(str(path), mask, Usd.Stage.LoadAll)
        else:
            stage = Usd.Stage.Open(str(path), Usd.Stage.LoadAll)
    except (Tf.ErrorException, RuntimeError) as error:
        raise ExportError(f"{path}: USD cannot read it: {first_line(error, path)}") from None
    documents.compose(stage)
    for prim_path, variant_set, selection in options.variants:
        _select_variant(stage, path, prim_path, variant_set, selection)
        documents.compose(stage)
    for prim_path in options.mask:
        if not stage.GetPrimAtPath(prim_path):
            raise ExportError(f"{path}: --mask: {_no_prim(path, prim_path)}")
    if options.mask:
        stage.ExpandPopulationMask(lambda link: not link.GetName().startswith("collection:") and link.GetName() != "proxyPrim")
        documents.compose(stage)
    report_composition(stage, documents.problems, report)
    return stage


def _no_prim(file: Path, prim_path: str) -> str:
    """Why a prim is not there, and what the last prim on the way to it has instead."""
    stage = Usd.Stage.Open(str(file), Usd.Stage.LoadAll)
    if stage.GetPrimAtPath(prim_path):
        return f"{prim_path} is outside the prims of --mask"
    above = Sdf.Path(prim_path).GetParentPath()
    while not stage.GetPrimAtPath(above):
        above = above.GetParentPath()
    names = [child.GetName() for child in stage.GetPrimAtPath(above).GetFilteredChildren(_EVERYTHING)]
    shown = ", ".join(names[:_NAMES_SHOWN]) + (f", and {len(names) - _NAMES_SHOWN} more" if len(names) > _NAMES_SHOWN else "")
    return f"there is no prim {prim_path} ({above} has: {shown or 'none'})"


def _select_variant(stage: Usd.Stage, file: Path, prim_path: str, name: str, selection: str) -> None:
    """Select a variant in the session layer."""
    prim = stage.GetPrimAtPath(prim_path)
    if not prim:
        raise ExportError(f"{file}: --variant: {_no_prim(file, prim_path)}")
    if prim.IsInstanceProxy():
        instance = prim
        while not instance.IsInstance():
            instance = instance.GetParent()
        raise ExportError(f"{file}: --variant: {prim_path} is inside the instance {instance.GetPath()}; select on that, or above")
    if name not in prim.GetVariantSets().GetNames():
        known = ", ".join(prim.GetVariantSets().GetNames()) or "none"
        raise ExportError(f"{file}: --variant: {prim_path} has no variant set '{name}' (it has: {known})")
    variant_set = prim.GetVariantSet(name)
    if selection not in variant_set.GetVariantNames():
        known = ", ".join(variant_set.GetVariantNames())
        raise ExportError(f"{file}: --variant: {prim_path}{{{name}}} has no '{selection}' (it has: {known})")
    with Usd.EditContext(stage, stage.GetSessionLayer()):
        variant_set.SetVariantSelection(selection)


def choose_frames(stage: Usd.Stage, options: Options, report: Notebook) -> Frames:
    """The frames asked for, else the stage's own range, else the range of its time samples; and the shutters of
    the stage's cameras."""
    per_second = stage.GetTimeCodesPerSecond()
    if not (math.isfinite(per_second) and per_second > 0):
        report.warn("/", "timeCodesPerSecond is not positive", f"it is {per_second}; 24 is used")
        per_second = 24.0
    if options.frames is not None:
        start, end = map(float, options.frames)
    elif stage.HasAuthoredTimeCodeRange():
        start, end = stage.GetStartTimeCode(), stage.GetEndTimeCode()
    else:
        start, end = _sampled_range(stage)
        if end > start:
            why = f"frames {start:g}-{end:g} are taken from the time samples; say --frames to choose"
            report.note("/", "no startTimeCode and endTimeCode", why)
    if not (math.isfinite(start) and math.isfinite(end)) or end < start:
        report.warn("/", "startTimeCode and endTimeCode are no range", f"{start:g}-{end:g}; the first is used")
        start = end = start if math.isfinite(start) else 0.0
    if end - start > 1_000_000:
        raise ExportError(f"frames {start:g}-{end:g} are more than a million: say --frames FIRST-LAST")
    codes = [start + step for step in range(int(end - start) + 1)]
    if codes[-1] < end:
        codes.append(end)
    return Frames(tuple(codes), per_second, stage_shutters(Usd.PrimRange(stage.GetPseudoRoot(), PREDICATE), start))


def _sampled_range(stage: Usd.Stage) -> tuple[float, float]:
    """Whole frames around all time samples of things that the export can animate."""
    low, high = math.inf, -math.inf
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), PREDICATE):
        if not prim.IsA(UsdGeom.Xformable):
            continue
        for attribute in prim.GetAuthoredAttributes():
            if attribute.ValueMightBeTimeVarying():
                samples = attribute.GetTimeSamples()
                if samples:
                    low, high = min(low, samples[0]), max(high, samples[-1])
    if not (math.isfinite(low) and math.isfinite(high)):
        return 0.0, 0.0
    return float(math.floor(low)), float(math.ceil(high))
