"""Matrices into glTF's translation, rotation and scale.

Matrices are 4x4 numpy arrays that multiply column vectors; functions take stacks `(n, 4, 4)`.
"""

from __future__ import annotations

import numpy as np

SHEAR_TOLERANCE = 1e-4
"""Largest cosine between two axes of a matrix that still counts as free of shear."""


def column(matrix) -> np.ndarray:
    """A Gf.Matrix4d (or an array of them, row vectors) for column vectors."""
    return np.swapaxes(np.asarray(matrix, dtype=float), -1, -2)


def decompose(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Translations (n, 3), quaternions xyzw (n, 4), scales (n, 3), shear (n,) of a stack.

    A mirroring matrix gets a negative x scale. Under shear the rotation is the nearest one (polar
    decomposition), the scale its best fit, and `shear` is the largest cosine between two axes.
    """
    linear = matrices[:, :3, :3]
    lengths = np.linalg.norm(linear, axis=1)
    largest = lengths.max(axis=1)
    flat = lengths <= 1e-12 * np.maximum(largest, 1e-300)[:, None]
    axes = linear / np.where(flat, 1.0, lengths)[:, None, :]
    gram = np.einsum("nki,nkj->nij", axes, axes)
    cosines = np.abs(np.stack([gram[:, 0, 1], gram[:, 0, 2], gram[:, 1, 2]], axis=1))
    solid = ~flat
    pairs = np.stack([solid[:, 0] & solid[:, 1], solid[:, 0] & solid[:, 2], solid[:, 1] & solid[:, 2]], axis=1)
    shear = np.where(pairs, cosines, 0.0).max(axis=1)

    mirrored = np.linalg.det(axes) < 0
    rotation = axes.copy()
    rotation[mirrored, :, 0] *= -1
    repair = (shear > 1e-9) | flat.any(axis=1)
    if repair.any():
        rotation[repair] = _nearest_rotation(rotation[repair], flat[repair])
    scale = np.einsum("nki,nki->ni", rotation, linear)
    return matrices[:, :3, 3], _quaternions(rotation), scale, shear


def _nearest_rotation(axes: np.ndarray, flat: np.ndarray) -> np.ndarray:
    """The rotation nearest to each matrix of unit axes; flat (zero) axes are made up."""
    u, _, vt = np.linalg.svd(np.where(flat[:, None, :], 0.0, axes))
    rotation = u @ vt
    turned = np.linalg.det(rotation) < 0
    u[turned, :, 2] *= -1
    return u @ vt


def _quaternions(rotation: np.ndarray) -> np.ndarray:
    """Unit quaternions xyzw of rotation matrices (n, 3, 3), by the largest component."""
    m = rotation
    trace = m[:, 0, 0] + m[:, 1, 1] + m[:, 2, 2]
    squares = np.stack(
        [
            1 + 2 * m[:, 0, 0] - trace,
            1 + 2 * m[:, 1, 1] - trace,
            1 + 2 * m[:, 2, 2] - trace,
            1 + trace,
        ],
        axis=1,
    )
    candidates = np.empty((len(m), 4, 4))
    yz, zx, xy = m[:, 2, 1], m[:, 0, 2], m[:, 1, 0]
    zy, xz, yx = m[:, 1, 2], m[:, 2, 0], m[:, 0, 1]
    candidates[:, 0] = np.stack([squares[:, 0], xy + yx, zx + xz, yz - zy], axis=1)
    candidates[:, 1] = np.stack([xy + yx, squares[:, 1], yz + zy, zx - xz], axis=1)
    candidates[:, 2] = np.stack([zx + xz, yz + zy, squares[:, 2], xy - yx], axis=1)
    candidates[:, 3] = np.stack([yz - zy, zx - xz, xy - yx, squares[:, 3]], axis=1)
    best = candidates[np.arange(len(m)), squares.argmax(axis=1)]
    return best / np.linalg.norm(best, axis=1, keepdims=True)


def continuous(quaternions: np.ndarray) -> np.ndarray:
    """The same rotations along a path, each sign chosen so that neighbours are nearest."""
    dots = np.einsum("ni,ni->n", quaternions[1:], quaternions[:-1])
    signs = np.concatenate([[1.0], np.cumprod(np.where(dots < 0, -1.0, 1.0))])
    return quaternions * signs[:, None]


def slerp(first: np.ndarray, second: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Unit quaternions (n, 4) at a share (n, 1) of the shorter way between two stacks of them."""
    cosine = np.einsum("ni,ni->n", first, second)[:, None]
    second = np.where(cosine < 0, -second, second)
    angle = np.arctan2(np.linalg.norm(second - first, axis=1), np.linalg.norm(second + first, axis=1))[:, None] * 2
    # A quarter of a circle at most; where there is no angle, the mean is as good.
    sine = np.sin(angle)
    small = sine < 1e-9
    weights = [np.sin(part * angle) / np.where(small, 1.0, sine) for part in (1 - share, share)]
    weights = [np.where(small, part, weight) for part, weight in zip((1 - share, share), weights, strict=True)]
    return weights[0] * first + weights[1] * second


def between(first: np.ndarray, second: np.ndarray, share: np.ndarray) -> np.ndarray:
    """Matrices (n, 4, 4) at a share (n,) of the way between two stacks of them, as glTF goes it: by translation,
    rotation and scale. Where there is shear, linearly."""
    share = share[:, None]
    (t0, r0, s0, shear0), (t1, r1, s1, shear1) = decompose(first), decompose(second)
    x, y, z, w = slerp(r0, r1, share).T
    turned = np.array([
        [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
    ])  # fmt: skip
    found = np.tile(np.eye(4), (len(first), 1, 1))
    found[:, :3, :3] = np.moveaxis(turned, 2, 0) * (s0 + share * (s1 - s0))[:, None, :]
    found[:, :3, 3] = t0 + share * (t1 - t0)
    sheared = np.maximum(shear0, shear1) > SHEAR_TOLERANCE
    found[sheared] = (first + share[:, None] * (second - first))[sheared]
    return found


def split_shear(matrices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Two stacks without shear whose product is `matrices` (n, 4, 4): rotated scales, and rotations.

    One node cannot hold shear, but two can. Along the stack the axes keep their order and sign as
    far as they can.
    """
    u, s, vt = np.linalg.svd(matrices[:, :3, :3])
    for at in range(1, len(vt)):
        order = _matched(vt[at - 1] @ vt[at].T)
        u[at], s[at], vt[at] = u[at][:, order], s[at][order], vt[at][order]
        sign = np.where(np.einsum("ij,ij->i", vt[at - 1], vt[at]) < 0, -1.0, 1.0)
        u[at], vt[at] = u[at] * sign, vt[at] * sign[:, None]
    turned = np.linalg.det(vt) < 0
    vt[turned, 2] *= -1
    u[turned, :, 2] *= -1
    outer, inner = (np.tile(np.eye(4), (len(matrices), 1, 1)) for _ in range(2))
    outer[:, :3, :3] = u * s[:, None, :]
    outer[:, :3, 3] = matrices[:, :3, 3]
    inner[:, :3, :3] = vt
    return outer, inner


def _matched(cosines: np.ndarray) -> list[int]:
    """For each row of a 3x3 matrix, in turn, the column left with the largest absolute value."""
    order: list[int] = []
    for row in np.abs(cosines):
        order.append(max((c for c in range(3) if c not in order), key=lambda c: row[c]))
    return order
