"""Mitsuba's pictures of a plain scene, in a process of its own.

    python3 mitsuba_plain.py SCENE.glb OUTPUT.npy [--samples 64] [--seeds 0 1 2] [--size 160x90] [--depth 1] [--threads 1]

renders a scene that `Plain` reads: a stack of pictures, one for each seed, by Mitsuba's `path`, which picks an emitter
evenly. Meshes that are there once are merged by colour; others are instances.
"""

import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
from others import mitsuba_side as side  # noqa: E402
from others.documents import Plain, asked  # noqa: E402


def moved(points, matrix):
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def wound(triangles, matrix):
    """Triangles whose front is outside, under a matrix that may mirror."""
    return triangles if np.linalg.det(matrix[:3, :3]) > 0 else triangles[:, ::-1]


def shapes(plain, folder):
    uses = Counter(mesh for mesh, _ in plain.places)
    found, merged = {}, {}
    for i, (number, matrix) in enumerate(plain.places):
        points, triangles, color, glow, two_sided = plain.meshes[number]
        if glow.any():
            if two_sided:
                sys.exit("Mitsuba's meshes shine from their front alone")
            bsdf = {"type": "diffuse", "reflectance": side.rgb((0, 0, 0))}
            file = folder / f"lamp_{i}.ply"
            found[f"lamp_{i}"] = side.shape(file, moved(points, matrix), wound(triangles, matrix), bsdf, glow)
        elif uses[number] == 1:
            merged.setdefault(tuple(color), []).append((moved(points, matrix), triangles))
        else:
            group = f"group_{number}"
            if group not in found:
                one = side.shape(folder / f"{group}.ply", points, triangles, side.diffuse(color))
                found[group] = {"type": "shapegroup", "shape": one}
            place = side.mi.ScalarTransform4f(matrix.tolist())
            found[f"instance_{i}"] = {"type": "instance", "to_world": place, "group": {"type": "ref", "id": group}}
    for i, (color, parts) in enumerate(merged.items()):
        starts = np.cumsum([0] + [len(points) for points, _ in parts])
        triangles = np.concatenate([rows + start for (_, rows), start in zip(parts, starts[:-1], strict=True)])
        points = np.concatenate([points for points, _ in parts])
        found[f"merged_{i}"] = side.shape(folder / f"merged_{i}.ply", points, triangles, side.diffuse(color))
    for i, (at, candela) in enumerate(plain.points):
        found[f"point_{i}"] = {"type": "point", "position": at.tolist(), "intensity": side.rgb(candela)}
    return found


def main():
    options = asked(__doc__)
    side.dr.set_thread_count(options.threads)
    plain = Plain(options.scene)
    with tempfile.TemporaryDirectory() as folder:
        row = {"type": "scene", "integrator": {"type": "path", "max_depth": options.depth + 1}}
        row["sensor"] = side.camera(*plain.camera, options.size)
        scene = side.mi.load_dict(row | shapes(plain, Path(folder)))
    stack = [np.array(side.mi.render(scene, spp=options.samples, seed=seed)) for seed in options.seeds]
    np.save(options.output, np.stack(stack))


if __name__ == "__main__":
    main()
