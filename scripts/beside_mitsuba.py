"""Glass, masks, fog, gloss and a photometric profile beside Mitsuba and Cycles: are the pictures the same?

Small scenes, each written as glTF for `candelabra-render` and built for another renderer, are rendered by both to little
noise, in 16 independent pictures each. docs/beside_others.md says what is compared, and why what differs does.

    python3 scripts/beside_mitsuba.py candelabra-render [--samples 128] [--write] [--only NAME]...

Wants `pip install mitsuba bpy numpy`, and for Mitsuba an LLVM of version 19 or later (DRJIT_LIBLLVM_PATH names it, if it
is not found). `--write` puts the table into the page.
"""

import argparse
import tempfile
from datetime import date
from pathlib import Path

import numpy as np

import benchmarks
from others import mitsuba_side as mitsuba
from others import scenes_of_surfaces as surfaces
from others.booth import DEPTH, Booth
from others.pictures import compared
from others.scene_of_a_profile import lamp_of_a_profile

RUNS = 16
MORE = 6
"""Samples of the others for one of ours: each costs less there."""
SCENES = {
    "nothing but matt walls": surfaces.matt_booth,
    "card with a mask": surfaces.masked_card,
    "card with blended alpha": surfaces.blended_card,
    "pane of tinted glass that reflects nothing": surfaces.pane_without_reflection,
    "pane of glass": surfaces.pane_of_glass,
    "three panes": surfaces.three_panes,
    "solid ball": surfaces.ball_of_glass,
    "solid ball, smooth normals": surfaces.smooth_ball,
    "solid slab, tinted": surfaces.slab_of_glass,
    "solid slab that absorbs": surfaces.slab_that_absorbs,
    "rough slab (0.5)": surfaces.rough_slab,
    "rough ball (0.4)": surfaces.rough_ball,
    "box of fog, one scattering": surfaces.box_of_fog,
    "lamp with an IES profile": lamp_of_a_profile,
    "clear coat (0.35) over matt": surfaces.coat,
    "dielectric, roughness 0.4": surfaces.gloss,
    "metal, roughness 0.5": surfaces.metal,
}


def rows(name, program, samples, folder):
    """What is compared of a scene: (beside what, how it compares)."""
    booth = Booth(Path(folder))
    found = SCENES[name](booth)
    depth = found.get("depth", DEPTH)
    ours = booth.ours(program, samples, RUNS, depth)
    if "closed" in found:
        yield "closed form", compared(ours, np.stack([found["closed"]()] * 2))
    if "cycles" in found:
        yield "Cycles", compared(ours, booth.by_cycles(found["cycles"], samples * MORE, RUNS, depth, found.get("light")))
        return
    integrator = found.get("integrator", "path")
    both = [("Mitsuba", None), ("Mitsuba with Schlick's term", found.get("shapes"))]
    for beside, shapes in both[: 2 if "shapes" in found else 1]:
        scene = booth.loaded(integrator, depth, shapes)
        yield beside, compared(ours, mitsuba.pictures(scene, samples * MORE, RUNS, 1000))


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=lambda path: Path(path).resolve(), help="candelabra-render")
    parser.add_argument("--only", action="append", choices=SCENES, metavar="NAME", help=f"of {', '.join(SCENES)}")
    parser.add_argument("--samples", type=int, default=128, help="of a pixel in each of our pictures")
    parser.add_argument("--write", action="store_true", help="put the table into docs/beside_others.md")
    options = parser.parse_args()
    head = "| scene | beside | ratio of means | red, green, blue | differs beyond noise | blocks, in standard errors: rms | worst |"
    lines = [head, "|---|---|--:|--:|--:|--:|--:|"]
    print("\n".join(lines), flush=True)
    for name in options.only or SCENES:
        with tempfile.TemporaryDirectory() as folder:
            for beside, how in rows(name, options.program, options.samples, folder):
                ratio = f"{how['ratio']:.4f} ± {how['error']:.4f}"
                colors = ", ".join(f"{part:.4f}" for part in how["channels"])
                blocks = f"{how['z']:.2f} | {how['worst']:+.1f} ({how['worst_ratio']:.3f})"
                lines.append(f"| {name} | {beside} | {ratio} | {colors} | {100 * how['rms']:.2f} % | {blocks} |")
                print(lines[-1], flush=True)
    if options.write:
        command = f"python3 scripts/beside_mitsuba.py candelabra-render --samples {options.samples}`; {benchmarks.machine()}; {date.today()}"
        benchmarks.write("beside_mitsuba", "\n".join([*lines, "", f"*`{command}.*"]))


if __name__ == "__main__":
    main()
