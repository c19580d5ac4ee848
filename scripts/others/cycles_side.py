"""Cycles' half of what is compared, by Blender as a Python module.

    python3 cycles_side.py SCENE.glb OUTPUT.npy [--samples 64] [--seeds 0 1 2] [--size 160x90] [--depth 1] [--threads 1]

renders a scene that `Plain` reads: a stack of pictures, one for each seed. The light tree is on; what makes pictures
other than converged ones (clamping, blurred caustics, a threshold for faint lights, adaptive counts, a denoiser) is off.
"""

import math
import sys
import tempfile
from pathlib import Path

import bpy
import numpy as np

CANDELA_OF_WATT = 1 / (4 * math.pi)
"""What a point of one watt sends in each direction."""
LUMENS_OF_WATT = 177.83
"""By which Cycles divides an IES file's lumens: the efficacy of D65."""


def empty(size, depth, threads):
    """An empty scene with the settings under which pictures can be compared."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.threads_mode, scene.render.threads = "FIXED", threads
    image = scene.render.image_settings
    image.file_format, image.color_depth = "OPEN_EXR", "32"
    cycles = scene.cycles
    cycles.device, cycles.use_light_tree = "CPU", True
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_auto_tile = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.blur_glossy = cycles.light_sampling_threshold = 0.0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = cycles.transmission_bounces = depth - 1
    return scene


def material(build):
    """A material whose nodes `build(nodes, links)` makes; it returns the output socket of the surface."""
    made = bpy.data.materials.new("material")
    made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(build(tree.nodes, tree.links), output.inputs["Surface"])
    return made


def matt(color, glow, two_sided):
    """Lambert's law; what shines does so from its front alone, if it is not two-sided, and reflects nothing."""

    def build(nodes, links):
        if not any(glow):
            diffuse = nodes.new("ShaderNodeBsdfDiffuse")
            diffuse.inputs["Color"].default_value = (*map(float, color), 1)
            diffuse.inputs["Roughness"].default_value = 0
            return diffuse.outputs[0]
        most = float(max(glow))
        emission = nodes.new("ShaderNodeEmission")
        emission.inputs["Color"].default_value = (*(float(part) / most for part in glow), 1)
        emission.inputs["Strength"].default_value = most
        if not two_sided:
            front = nodes.new("ShaderNodeMath")
            front.operation = "MULTIPLY_ADD"
            links.new(nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"], front.inputs[0])
            front.inputs[1].default_value, front.inputs[2].default_value = -most, most
            links.new(front.outputs[0], emission.inputs["Strength"])
        return emission.outputs[0]

    made = material(build)
    made.cycles.emission_sampling = ("FRONT_BACK" if two_sided else "FRONT") if any(glow) else "NONE"
    return made


def principled(color, roughness, metallic=0.0, level=0.5, coat=0.0, coat_roughness=0.0):
    """Blender's Principled BSDF of index 1.5; at a `level` of 0 it has no dielectric gloss."""

    def build(nodes, _):
        node = nodes.new("ShaderNodeBsdfPrincipled")
        values = {"Roughness": roughness, "Metallic": metallic, "IOR": 1.5, "Specular IOR Level": level}
        for name, value in (values | {"Coat Weight": coat, "Coat Roughness": coat_roughness}).items():
            node.inputs[name].default_value = value
        node.inputs["Base Color"].default_value = (*color, 1)
        return node.outputs[0]

    return material(build)


def mesh(points, triangles, surface):
    made = bpy.data.meshes.new("mesh")
    made.from_pydata(points.tolist(), [], triangles.tolist())
    made.materials.append(surface)
    return made


def place(data, matrix=None):
    """Puts a mesh, a light or a camera into the scene."""
    made = bpy.data.objects.new("object", data)
    bpy.context.scene.collection.objects.link(made)
    if matrix is not None:
        made.matrix_world = np.asarray(matrix, float).T.tolist()
    return made


def point(candela):
    """A light without size."""
    made = bpy.data.lights.new("light", "POINT")
    most = max(float(max(candela)), 1e-30)
    made.shadow_soft_size, made.color = 0.0, [float(part) / most for part in candela]
    made.energy = most / CANDELA_OF_WATT
    return made


def camera(matrix, tall_rad):
    made = bpy.data.cameras.new("camera")
    made.sensor_fit, made.clip_start, made.clip_end = "VERTICAL", 1e-3, 1e6
    made.angle_y = tall_rad
    bpy.context.scene.camera = place(made, matrix)


def photometric(file):
    """A point that shines as an IES file says, candela as they stand; Cycles reads the file itself."""
    made = point((LUMENS_OF_WATT * CANDELA_OF_WATT,) * 3)
    made.use_nodes = True
    nodes, links = made.node_tree.nodes, made.node_tree.links
    emission = next(node for node in nodes if node.type == "EMISSION")
    profile = nodes.new("ShaderNodeTexIES")
    profile.mode, profile.filepath = "EXTERNAL", str(file)
    links.new(profile.outputs["Factor" if "Factor" in profile.outputs else "Fac"], emission.inputs["Strength"])
    return made


def converted(plain, size, depth, threads):
    scene = empty(size, depth, threads)
    surfaces = {}
    meshes = []
    for points, triangles, color, glow, two_sided in plain.meshes:
        key = (*color, *glow, two_sided)
        if key not in surfaces:
            surfaces[key] = matt(color, glow, two_sided)
        meshes.append(mesh(points, triangles, surfaces[key]))
    for number, matrix in plain.places:
        place(meshes[number], matrix)
    lights = {}
    for at, candela in plain.points:
        if tuple(candela) not in lights:
            lights[tuple(candela)] = point(candela)
        place(lights[tuple(candela)]).location = at
    camera(*plain.camera)
    return scene


def picture(scene, samples, seed):
    """Height x width x 3."""
    from others.pictures import read_exr

    scene.cycles.samples, scene.cycles.seed = samples, seed
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "picture.exr")
        bpy.ops.render.render(write_still=True)
        return read_exr(scene.render.filepath)


def main():
    from others.documents import Plain, asked

    options = asked(__doc__)
    scene = converted(Plain(options.scene), options.size, options.depth, options.threads)
    np.save(options.output, np.stack([picture(scene, options.samples, seed) for seed in options.seeds]))


if __name__ == "__main__":
    sys.path.insert(0, str(Path(__file__).resolve().parent.parent))
    main()
