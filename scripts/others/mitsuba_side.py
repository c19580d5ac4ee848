"""Mitsuba's half of what is compared: meshes as files, materials that speak glTF's formulas, pictures.

`schlick` is a BSDF for Mitsuba that wraps one of its own dielectrics, `dielectric`, `roughdielectric` or
`thindielectric`, and puts glTF's Fresnel term in place of the exact one. A path ends that passes the triangle but not the
surface that normals at its corners tell of, or the other way. All else is Mitsuba's.
"""

import drjit as dr
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")


class Schlick(mi.BSDF):
    """`nested` is the dielectric, `ior` its index, `thin` whether it is a single pane."""

    def __init__(self, props):
        mi.BSDF.__init__(self, props)
        self.nested, self.ior, self.thin = props["nested"], props["ior"], props.get("thin", False)
        self.m_components = [self.nested.flags(i) for i in range(self.nested.component_count())]
        self.m_flags = self.nested.flags()

    def share(self, wi, wo):
        """What this Fresnel term gives over what the exact one gives, where light goes from one to the other."""
        reflected = wi.z * wo.z > 0
        _, _, eta, _ = mi.fresnel(wi.z, self.ior)
        h = dr.normalize(dr.select(reflected, wi + wo, wi + wo * eta))
        h = dr.mulsign(h, h.z)
        cosine = dr.abs(wi.z) if self.thin else dr.dot(wi, h)
        exact, beyond, _, _ = mi.fresnel(cosine, self.ior)
        f0 = ((self.ior - 1) / (self.ior + 1)) ** 2
        if self.thin:
            exact, least = 2 * exact / (1 + exact), cosine
        else:
            least = dr.minimum(dr.abs(cosine), dr.abs(beyond))
        ours = f0 + (1 - f0) * (1 - least) ** 5
        ours = dr.select(exact >= 1, 1, ours)
        return dr.select(reflected, ours / exact, dr.select(exact < 1, (1 - ours) / (1 - exact), 0))

    def agrees(self, si, way):
        """Whether a direction is on the same side of the triangle and of the normal."""
        return (dr.dot(si.n, si.to_world(way)) > 0) == (way.z > 0)

    def sample(self, ctx, si, one, two, active=True):
        drawn, weight = self.nested.sample(ctx, si, one, two, active)
        is_sound = (drawn.pdf > 0) & self.agrees(si, si.wi) & self.agrees(si, drawn.wo)
        return drawn, dr.select(is_sound, weight * self.share(si.wi, drawn.wo), 0)

    def eval(self, ctx, si, wo, active=True):
        value = self.nested.eval(ctx, si, wo, active)
        is_sound = (value != 0) & self.agrees(si, si.wi) & self.agrees(si, wo)
        return dr.select(is_sound, value * self.share(si.wi, wo), 0)

    def pdf(self, ctx, si, wo, active=True):
        return self.nested.pdf(ctx, si, wo, active)

    def eval_pdf(self, ctx, si, wo, active=True):
        return self.eval(ctx, si, wo, active), self.pdf(ctx, si, wo, active)

    def traverse(self, callback):
        callback.put("nested", self.nested, mi.ParamFlags.Differentiable)

    def to_string(self):
        return "Schlick"


mi.register_bsdf("schlick", Schlick)


def rgb(color):
    return {"type": "rgb", "value": [float(part) for part in color]}


def diffuse(color):
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": rgb(color)}}


def shape(path, points, triangles, bsdf, glow=(0, 0, 0), uv=None, normals=None, **more):
    """Writes a mesh in world space as PLY, and returns it as Mitsuba reads it. It shines from its front."""
    kinds = {"has_vertex_normals": normals is not None, "has_vertex_texcoords": uv is not None}
    mesh = mi.Mesh("mesh", len(points), len(triangles), **kinds)
    rows = mi.traverse(mesh)
    rows["vertex_positions"] = np.ravel(points).astype("f4")
    rows["faces"] = np.ravel(triangles).astype("u4")
    if normals is not None:
        rows["vertex_normals"] = np.ravel(normals).astype("f4")
    if uv is not None:
        rows["vertex_texcoords"] = np.ravel(uv).astype("f4")
    rows.update()
    mesh.write_ply(str(path))
    row = {"type": "ply", "filename": str(path), "face_normals": normals is None, "bsdf": bsdf} | more
    if any(glow):
        row["emitter"] = {"type": "area", "radiance": rgb(glow)}
    return row


def camera(matrix, tall_rad, size):
    """A pinhole whose matrix is glTF's, with a box filter."""
    eye, back, up = matrix[:3, 3], matrix[:3, 2], matrix[:3, 1]
    look = mi.ScalarTransform4f().look_at(eye.tolist(), (eye - back).tolist(), up.tolist())
    film = {"type": "hdrfilm", "width": size[0], "height": size[1], "rfilter": {"type": "box"}}
    film |= {"pixel_format": "rgb", "component_format": "float32"}
    row = {"type": "perspective", "fov": float(np.degrees(tall_rad)), "fov_axis": "y", "near_clip": 1e-3}
    return row | {"to_world": look, "film": film, "sampler": {"type": "independent"}}


def pictures(scene, samples, runs, first_seed=0):
    """Independent pictures of a loaded scene, runs x height x width x 3."""
    return np.stack([np.array(mi.render(scene, spp=samples, seed=first_seed + i)) for i in range(runs)])
