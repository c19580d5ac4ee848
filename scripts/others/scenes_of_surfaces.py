"""Test scenes of glass, masks, fog and gloss.

Each function puts things into a `Booth`, and returns what the comparison needs beside: `shapes` that take the place of
Mitsuba's own glass with glTF's Fresnel term, the `integrator` and `depth`, surfaces for `cycles` by piece.
"""

import math

import numpy as np

from others import mitsuba_side as theirs
from others.booth import GREY, ball, box, quad
from others.documents import matt
from others.pictures import write_png

IOR = 1.5


def glass(color=(1, 1, 1), roughness=0.0, ior=IOR, solid=False, attenuation=None, specular=1.0):
    """The glTF material."""
    row = {
        "pbrMetallicRoughness": {"baseColorFactor": [*color, 1], "metallicFactor": 0, "roughnessFactor": roughness},
        "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1.0}, "KHR_materials_ior": {"ior": ior}},
        "doubleSided": True,
    }
    if specular != 1.0:
        row["extensions"]["KHR_materials_specular"] = {"specularFactor": specular}
    if solid:
        row["extensions"]["KHR_materials_volume"] = {"thicknessFactor": 1.0} | (attenuation or {})
    return row


def dielectric(kind, color=(1, 1, 1), **more):
    """Mitsuba's, which tints what it transmits."""
    return {"type": kind, "int_ior": IOR, "ext_ior": 1.0, "specular_transmittance": theirs.rgb(color)} | more


def by_schlick(nested, thin=False):
    return {"type": "schlick", "ior": IOR, "thin": thin, "nested": nested}


def matt_booth(booth):
    lamp_above(booth)
    return {}


def pane_without_reflection(booth):
    """Glass of which only the tint is there."""
    color = (0.9, 0.6, 0.3)
    lamp_in_front(booth)
    booth.put(pane(), material=glass(color, specular=0.0), bsdf=dielectric("thindielectric", color, int_ior=1.0))
    return {}


def pane_of_glass(booth):
    color = (0.95, 0.8, 0.6)
    lamp_in_front(booth)
    return either(booth, pane(), glass(color), dielectric("thindielectric", color), thin=True)


def three_panes(booth):
    """Of three colours, one behind another."""
    lamp_in_front(booth)
    shapes = {}
    for i, color in enumerate(((0.9, 0.7, 0.5), (0.5, 0.9, 0.7), (0.7, 0.7, 0.9))):
        found = either(booth, pane(0.3 * i - 0.3), glass(color), dielectric("thindielectric", color), thin=True)
        shapes |= found["shapes"]
    return {"shapes": shapes}


def ball_of_glass(booth):
    lamp_above(booth)
    return either(booth, ball((0.1, 0.75, -0.2), 0.7), glass(solid=True), dielectric("dielectric"))


def smooth_ball(booth):
    """Few triangles, with the normals of a ball."""
    points, triangles = ball((0, 0, 0), 1.0, rings=12)
    lamp_above(booth)
    shape = points * 0.7 + (0.1, 0.75, -0.2), triangles
    return either(booth, shape, glass(solid=True), dielectric("dielectric"), normals=points)


def slab_of_glass(booth):
    color = (0.9, 0.8, 0.95)
    lamp_in_front(booth)
    return either(booth, slab(), glass(color, solid=True), dielectric("dielectric", color))


def slab_that_absorbs(booth):
    color, distance = (0.3, 0.6, 0.8), 0.5
    lamp_in_front(booth)
    absorption = {"attenuationColor": color, "attenuationDistance": distance}
    inside = medium(-np.log(color) / distance, (0, 0, 0))
    material = glass(solid=True, attenuation=absorption)
    return either(booth, slab(), material, dielectric("dielectric"), interior=inside) | {"integrator": "volpath"}


def rough_slab(booth, roughness=0.5):
    lamp_in_front(booth)
    bsdf = dielectric("roughdielectric", distribution="ggx", alpha=roughness**2)
    return either(booth, slab(), glass(roughness=roughness, solid=True), bsdf)


def rough_ball(booth, roughness=0.4):
    lamp_above(booth)
    bsdf = dielectric("roughdielectric", distribution="ggx", alpha=roughness**2)
    return either(booth, ball((0.1, 0.75, -0.2), 0.7), glass(roughness=roughness, solid=True), bsdf)


def masked_card(booth):
    """Holes in a card, without symmetry; some texels are just below the threshold and some at it."""
    alpha = holes()
    return card(booth, alpha, "MASK", np.where(alpha >= 128, 255, 0))


def blended_card(booth):
    alpha = holes()
    return card(booth, alpha, "BLEND", alpha)


def box_of_fog(booth, low=(-1.4, 0.2, -1.6), high=(1.2, 2.0, 0.8)):
    extinction, albedo, forward = 0.9, (0.9, 0.8, 0.6), 0.5
    lamp_above(booth)
    fog = {"extinction": extinction, "albedo": albedo, "anisotropy": forward, "min": low, "max": high}
    booth.document.node(extras={"usdFog": fog})
    inside = medium((extinction,) * 3, albedo, {"type": "hg", "g": forward})
    points, triangles = box(low, high)
    booth.shapes["fog"] = theirs.shape(booth.folder / "fog.ply", points, triangles, {"type": "null"}, interior=inside)
    return {"integrator": "volpath", "depth": 1}


def coat(booth):
    """A clear coat over what is matt; Cycles has Blender's Principled BSDF there."""
    color, roughness = (0.5, 0.2, 0.1), 0.35
    material = matt(color)
    material["extensions"]["KHR_materials_clearcoat"] = {"clearcoatFactor": 1.0, "clearcoatRoughnessFactor": roughness}
    lamp_above(booth)
    booth.put(ball((0.1, 0.75, -0.2), 0.7), material=material)
    same = {"color": color, "roughness": 1, "level": 0, "coat": 1, "coat_roughness": roughness}
    return {"cycles": {len(booth.pieces) - 1: same}}


def gloss(booth):
    return glossy(booth, (0.5, 0.2, 0.1), 0.4, 0)


def metal(booth):
    return glossy(booth, (0.95, 0.68, 0.3), 0.5, 1)


def glossy(booth, color, roughness, metallic):
    row = {"baseColorFactor": [*color, 1], "metallicFactor": metallic, "roughnessFactor": roughness}
    lamp_above(booth)
    booth.put(ball((0.1, 0.75, -0.2), 0.7), material={"pbrMetallicRoughness": row})
    return {"cycles": {len(booth.pieces) - 1: {"color": color, "roughness": roughness, "metallic": metallic}}}


def lamp_above(booth):
    booth.lamp((0.2, 2.8, 0.6), (0.6, 0, 0), (0, 0, 0.5), 6.0)


def lamp_in_front(booth):
    """On the right, out of sight, towards the glass and the walls."""
    booth.lamp((1.9, 1.6, 1.2), (-0.4, 0, 0.6), (0, 0.5, 0), 8.0)


def pane(z=0.0):
    return quad((0.3, 1.0, z), (1.0, 0, 0.2), (0, 0.9, 0))


def slab():
    """A thick pane, aslant."""
    points, triangles = box((-0.7, 0.2, -0.15), (1.0, 1.7, 0.15))
    cos, sin = math.cos(0.3), math.sin(0.3)
    return points @ np.array([(cos, 0, -sin), (0, 1, 0), (sin, 0, cos)]), triangles


def either(booth, shape, material, nested, thin=False, **more):
    """Puts glass in by Mitsuba's formulas, and returns the shape by glTF's."""
    booth.put(shape, material=material, bsdf=nested, **more)
    name, row = list(booth.shapes.items())[-1]
    return {"shapes": {name: row | {"bsdf": by_schlick(nested, thin)}}}


def medium(extinction, albedo, phase=None):
    most = max(extinction)
    row = {"type": "homogeneous", "sigma_t": theirs.rgb(np.array(extinction) / most), "scale": float(most)}
    return row | {"albedo": theirs.rgb(albedo), "phase": phase or {"type": "isotropic"}}


def holes():
    alpha = np.random.default_rng(4).choice((0, 60, 127, 128, 200, 255), (6, 8))
    alpha[0, :4], alpha[:3, 0] = 255, 0
    return alpha


def card(booth, alpha, mode, theirs_alpha):
    """A card above the floor whose texture has this alpha; `theirs_alpha` is what Mitsuba is to take for it."""
    lamp_above(booth)
    rows = np.full((*alpha.shape, 4), 255)
    rows[..., 3] = alpha
    write_png(booth.folder / "card.png", rows)
    number = booth.document.add("images", {"uri": "card.png"})
    nearest = booth.document.add("samplers", {"magFilter": 9728, "minFilter": 9728})
    texture = booth.document.add("textures", {"source": number, "sampler": nearest})
    material = matt(GREY)
    material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": texture}
    material |= {"alphaMode": mode} | ({"alphaCutoff": 128 / 255} if mode == "MASK" else {})
    data = theirs.mi.Bitmap((theirs_alpha / 255).astype("f4")[..., None])
    opacity = {"type": "bitmap", "bitmap": data, "filter_type": "nearest", "raw": True}
    bsdf = {"type": "mask", "opacity": opacity, "nested": theirs.diffuse(GREY)}
    booth.put(quad((0.2, 1.1, -0.3), (0.9, 0, 0.1), (0, 0.1, -0.7)), material=material, bsdf=bsdf)
    return {}
