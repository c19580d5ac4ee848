"""Meshes bound to skeletons: their points as a frame's pose puts them, blend shapes first.

UsdSkel's own queries do the work (UsdSkelSkinningQuery, UsdSkelBlendShapeQuery), in the order of
UsdSkelBakeSkinning, which would write to the stage; nothing is written here. A mesh whose joints move it as a
whole is moved; of another, `polygons` asks for the pose at each time.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from pxr import Gf, Usd, UsdGeom, UsdSkel, Vt

from .animation import varies
from .primvars import CornerValues
from .report import Notebook
from .stage import PROTOTYPE_PREDICATE, Frames


@dataclass
class Binding:
    """A mesh, and the skeleton that deforms it."""

    skeleton: UsdSkel.SkeletonQuery
    skin: UsdSkel.SkinningQuery
    transforms: Callable[[float], Vt.Matrix4dArray]
    """The skeleton's skinning transforms at a time, calculated once for all its meshes."""

    def weights(self, code: float) -> Vt.FloatArray | None:
        """Weights of the mesh's blend shapes; None if it has none that are animated."""
        animation = self.skeleton.GetAnimQuery()
        if not animation or not self.skin.HasBlendShapes():
            return None
        weights, mapper = animation.ComputeBlendShapeWeights(code), self.skin.GetBlendShapeMapper()
        return mapper.Remap(weights) if mapper and weights else weights

    @property
    def is_rigid(self) -> bool:
        """Whether the joints move the mesh as a whole, and nothing else deforms it."""
        return self.skin.HasJointInfluences() and self.skin.IsRigidlyDeformed() and not self.skin.HasBlendShapes()

    def to_mesh(self, code: float) -> np.ndarray:
        """(4, 4): from the skeleton's space to the mesh's, for row vectors. Nothing is seen of a mesh whose space is singular."""
        cache = UsdGeom.XformCache(code)
        skeleton, mesh = _as_placed(self.skeleton.GetPrim(), self.skin.GetPrim()), self.skin.GetPrim()
        to_world, from_world = (np.array(cache.GetLocalToWorldTransform(prim)) for prim in (skeleton, mesh))
        return to_world @ np.linalg.pinv(from_world)

    def state(self, code: float) -> list[np.ndarray]:
        """All numbers that decide the pose at a time."""
        found = [self.to_mesh(code), np.array(self.weights(code) or [])]
        if self.skin.HasJointInfluences():
            found.append(np.array(self.transforms(code)))
        return found


class Skinning:
    """The bindings of a stage, and the poses of its meshes."""

    def __init__(self, stage: Usd.Stage, frames: Frames, report: Notebook) -> None:
        self.frames, self.report = frames, report
        self._bindings: dict[str, Binding] = {}
        self._as_they_stand: set[str] = set()
        """Meshes that cannot be posed."""
        cache = UsdSkel.Cache()
        for prim in Usd.PrimRange(stage.GetPseudoRoot(), PROTOTYPE_PREDICATE):
            if not prim.IsA(UsdSkel.Root):
                continue
            root = UsdSkel.Root(prim)
            cache.Populate(root, PROTOTYPE_PREDICATE)
            for binding in cache.ComputeSkelBindings(root, PROTOTYPE_PREDICATE):
                skeleton = cache.GetSkelQuery(binding.GetSkeleton())
                if skeleton:
                    transforms = functools.lru_cache(maxsize=32)(skeleton.ComputeSkinningTransforms)
                    for skin in binding.GetSkinningTargets():
                        self._bindings[str(skin.GetPrim().GetPath())] = Binding(skeleton, skin, transforms)

    def name(self, prim: Usd.Prim) -> str:
        """Tells apart instances of one mesh that are posed by different skeletons or animations."""
        binding = self._bindings.get(str(prim.GetPath()))
        if binding is None:
            return ""
        animation = binding.skeleton.GetAnimQuery()
        prims = [binding.skeleton.GetPrim(), *([animation.GetPrim()] if animation else [])]
        return " ".join(str((p.GetPrimInPrototype() if p.IsInstanceProxy() else p).GetPath()) for p in prims)

    def movement(self, prim: Usd.Prim) -> np.ndarray | None:
        """How its joints move a mesh as a whole, in its own space: (4, 4), or (frames, 4, 4) if that changes;
        None if they do not, or deform it."""
        binding = self._bindings.get(str(prim.GetPath()))
        if binding is None or not binding.is_rigid:
            return None
        try:
            matrices = np.array([self._rigid(binding, code).T for code in self.frames.codes])
        except (ValueError, np.linalg.LinAlgError) as error:
            self._unposed(prim, error)
            return None
        return matrices if varies(matrices.reshape(len(matrices), -1)) else matrices[0]

    @staticmethod
    def _rigid(binding: Binding, code: float) -> np.ndarray:
        matrix = np.array(binding.skin.ComputeSkinnedTransform(binding.transforms(code), code)) @ binding.to_mesh(code)
        if not (np.abs(matrix) < 3e38).all():
            raise ValueError("its transform is not finite")
        return matrix

    def _unposed(self, prim: Usd.Prim, error: Exception) -> None:
        self.report.warn(prim.GetPath(), "skinned mesh", f"it cannot be posed, and is exported as its points stand: {error}")

    def pose(
        self, prim: Usd.Prim, points: np.ndarray, corners: np.ndarray, normals: CornerValues | None
    ) -> tuple[np.ndarray, CornerValues | None]:
        """Points (v, 3) and normals of a mesh in the pose of the first frame; as they are if nothing deforms it, or
        it cannot be posed (reported)."""
        path = str(prim.GetPath())
        if path not in self._bindings and prim.GetAttribute("primvars:skel:jointIndices").HasAuthoredValue():
            why = "no SkelRoot above it binds it to a skeleton that is there; it is exported as its points stand"
            self.report.warn(path, "skinned mesh", why)
        try:
            return self.posed(prim, points, corners, normals, self.frames.first)
        except (ValueError, np.linalg.LinAlgError) as error:
            self._unposed(prim, error)
            self._as_they_stand.add(path)
            return points, normals

    def posed(
        self, prim: Usd.Prim, points: np.ndarray, corners: np.ndarray, normals: CornerValues | None, code: float
    ) -> tuple[np.ndarray, CornerValues | None]:
        """The same at any time. Raises ValueError or LinAlgError with what is wrong."""
        binding = self._deforming(prim)
        return (points, normals) if binding is None else self._posed(binding, points, corners, normals, code)

    def bends(self, prim: Usd.Prim) -> bool:
        """Whether a skeleton puts points of a prim elsewhere, and not the prim as a whole."""
        return self._deforming(prim) is not None

    def may_deform(self, prim: Usd.Prim) -> bool:
        """Whether a skeleton deforms the mesh, and its pose changes."""
        return self._deforming(prim) is not None and any(self.differs(prim, code) for code in self.frames.codes)

    def differs(self, prim: Usd.Prim, code: float) -> bool:
        """Whether what decides the pose of a mesh is other than at the first frame, by more than rounding, or cannot be
        told. Joints that move may still be none that it follows."""
        binding = self._deforming(prim)
        if binding is None or code == self.frames.first:
            return False
        try:
            first, now = binding.state(self.frames.first), binding.state(code)
        except (ValueError, np.linalg.LinAlgError):
            return True
        return not all(
            a.shape == b.shape and np.allclose(a, b, rtol=1e-6, atol=1e-6) for a, b in zip(first, now, strict=True)
        )

    def _deforming(self, prim: Usd.Prim) -> Binding | None:
        """What deforms a mesh, if anything does."""
        path = str(prim.GetPath())
        binding = self._bindings.get(path)
        return None if binding is None or binding.is_rigid or path in self._as_they_stand else binding

    def _posed(self, binding: Binding, points, corners, normals, code: float) -> tuple[np.ndarray, CornerValues | None]:
        """The same; ValueError says what is wrong with the binding."""
        moved = Vt.Vec3fArray.FromNumpy(points.astype(np.float32))
        turned = np.zeros_like(points)
        weights = binding.weights(code)
        if weights and any(weights):
            turned = _blend(UsdSkel.BlendShapeQuery(UsdSkel.BindingAPI(binding.skin.GetPrim())), weights, moved)
        space = np.eye(4)
        if binding.skin.HasJointInfluences():
            if not binding.skin.ComputeSkinnedPoints(binding.transforms(code), moved, code):
                raise ValueError("its joint influences do not fit its points")
            space = binding.to_mesh(code)
        found = np.array(moved, dtype=float) @ space[:3, :3] + space[3, :3]
        if normals is None:
            return found, None
        return found, _turn(binding, len(points), corners, normals, turned, space, code)


def _as_placed(skeleton: Usd.Prim, mesh: Usd.Prim) -> Usd.Prim:
    """The skeleton in the instance that the mesh is in, where USD names it in their prototype."""
    if not skeleton.IsInPrototype() or skeleton.IsInstanceProxy():
        return skeleton
    above = mesh
    while above and not (above.IsInstance() and skeleton.GetPath().HasPrefix(above.GetPrototype().GetPath())):
        above = above.GetParent()
    if not above:
        return skeleton
    path = skeleton.GetPath().ReplacePrefix(above.GetPrototype().GetPath(), above.GetPath())
    return mesh.GetStage().GetPrimAtPath(path) or skeleton


def _blend(shapes: UsdSkel.BlendShapeQuery, weights: Vt.FloatArray, points: Vt.Vec3fArray) -> np.ndarray:
    """Move `points` by the blend shapes, and return what is to be added to the normals (v, 3) at them."""
    parts = shapes.ComputeSubShapeWeights(weights)
    indices = shapes.ComputeBlendShapePointIndices()
    if not shapes.ComputeDeformedPoints(*parts, indices, shapes.ComputeSubShapePointOffsets(), points):
        raise ValueError("its blend shapes do not fit its points")
    turned = np.zeros((len(points), 3))
    for weight, shape, part in zip(*parts, strict=True):
        inbetween = shapes.GetInbetween(part)
        offsets = inbetween.GetNormalOffsets() if inbetween else shapes.GetBlendShape(shape).GetNormalOffsetsAttr().Get()
        where = np.array(indices[shape], dtype=int) if len(indices[shape]) else np.arange(len(points))
        if offsets and len(offsets) == len(where) and where.max(initial=0) < len(points):
            np.add.at(turned, where, weight * np.array(offsets, dtype=float))
    return turned


def _turn(
    binding: Binding, count: int, corners: np.ndarray, normals: CornerValues, turned: np.ndarray, space: np.ndarray, code: float
) -> CornerValues:
    """Normals of a mesh of `count` points turned with them, one for each point, or for each corner."""
    by_point = normals.interpolation in ("vertex", "varying")
    point = np.arange(count) if by_point else corners
    if by_point:
        found = np.zeros((count, 3))
        found[corners] = normals.values[normals.index]
    else:
        found = normals.values[normals.index]
    found = found + turned[point]
    skin = binding.skin
    if skin.HasJointInfluences():
        transforms, mapper = binding.transforms(code), skin.GetJointMapper()
        if mapper:
            unmoved = Vt.Matrix4dArray([Gf.Matrix4d(1.0)] * len(skin.GetJointOrder()))
            transforms = mapper.RemapTransforms(transforms, unmoved)
        indices, weights = skin.ComputeVaryingJointInfluences(count, code)
        each = len(indices) // count
        array = Vt.Vec3fArray.FromNumpy(found.astype(np.float32))
        UsdSkel.SkinNormals(
            skin.GetSkinningMethod(),
            Gf.Matrix3d(*_cotransform(np.array(skin.GetGeomBindTransform(code))).reshape(-1).tolist()),
            Vt.Matrix3dArray.FromNumpy(np.array([_cotransform(np.array(matrix)) for matrix in transforms])),
            Vt.IntArray.FromNumpy(np.array(indices, np.int32).reshape(count, each)[point].reshape(-1)),
            Vt.FloatArray.FromNumpy(np.array(weights, np.float32).reshape(count, each)[point].reshape(-1)),
            each,
            array,
        )
        found = np.array(array, dtype=float) @ _cotransform(space)
    if by_point:
        return CornerValues(found, corners, interpolation="vertex")
    return CornerValues(found, np.arange(len(corners)), interpolation="faceVarying")


def _cotransform(matrix: np.ndarray) -> np.ndarray:
    """(3, 3): how normals, as row vectors, go under a matrix of points; zero if that is singular, as of a joint of scale 0."""
    try:
        return np.linalg.inv(matrix[:3, :3]).T
    except np.linalg.LinAlgError:
        return np.zeros((3, 3))
