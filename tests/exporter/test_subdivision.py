"""Subdivision surfaces against closed forms, invariances, and what OpenSubdiv makes of the same cages."""

import json
from pathlib import Path

import numpy as np
import pytest
from usd_gltf.primvars import CornerValues
from usd_gltf.subdivision import Cage, Rules, Surface
from usd_gltf.subdivision_masks import limit, refine
from usd_gltf.subdivision_topology import build, crease, split_to_quads

GOLDEN = json.loads((Path(__file__).parent / "subdivision_golden.json").read_text())
CUBE = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
CUBE_FACES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
TETRAHEDRON = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]], dtype=float)
TETRAHEDRON_FACES = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]
MIXED = np.array([[0, 0, 0], [2, 0, 1], [3, 2, 0], [1, 3, 1], [-1, 2, 0], [1, 1, 3], [5, 1, 2]], dtype=float)
MIXED_FACES = [[0, 1, 2, 3, 4], [0, 5, 1], [1, 5, 2], [2, 5, 3], [4, 3, 5], [1, 6, 2][::-1]]
"""A pentagon, triangles, a fin on the edge 1-2, and a hole between 0, 4 and 5."""


def surface(points, faces, level=1, scheme="catmullClark", creases=(), fixed=(), boundary="edgeAndCorner",
            face_varying="cornersPlus1", smooth_triangles=False):  # fmt: skip
    counts, corners = np.array([len(f) for f in faces]), np.concatenate(faces).astype(int)
    topology, keys = build(len(points), counts, corners)
    for start, end, sharpness in creases:
        assert crease(topology, keys, *np.array([[start], [end], [sharpness]]))
    for vertex, sharpness in fixed:
        topology.vertex_sharpness[vertex] = sharpness
    cage = Cage(topology, np.array(points, dtype=float), np.arange(len(counts)), np.ones(len(corners), bool))
    return Surface(cage, Rules(scheme, boundary, face_varying, smooth_triangles), level)


def grid(wide, high):
    faces = [[i * (high + 1) + j, (i + 1) * (high + 1) + j, (i + 1) * (high + 1) + j + 1, i * (high + 1) + j + 1]
             for i in range(wide) for j in range(high)]  # fmt: skip
    return [[i, j] for i in range(wide + 1) for j in range(high + 1)], faces


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def b_spline(t, derivative=False):
    """Weights (..., 4) of the uniform cubic B-spline's four control points."""
    t = np.asarray(t)[..., None]
    if derivative:
        return np.concatenate([-((1 - t) ** 2), 3 * t**2 - 4 * t, -3 * t**2 + 2 * t + 1, t**2], axis=-1) / 2
    return np.concatenate([(1 - t) ** 3, 3 * t**3 - 6 * t**2 + 4, -3 * t**3 + 3 * t**2 + 3 * t + 1, t**3], axis=-1) / 6


def extended(control):
    """Control points with a row beyond either end, so that the B-spline has the boundary for its end."""
    return np.concatenate([2 * control[:1] - control[1:2], control, 2 * control[-1:] - control[-2:-1]])


@pytest.mark.parametrize("level", [1, 2, 3])
def test_a_regular_grid_is_the_uniform_cubic_b_spline_up_to_its_corners(level):
    places, faces = grid(4, 3)
    control = np.concatenate([places, np.random.default_rng(1).random((20, 1))], axis=1)
    found = surface(control, faces, level)
    # Where each vertex is on the grid is what the linear scheme makes of the places.
    where = surface(np.pad(places, ((0, 0), (0, 1))), faces, level, "bilinear").points[:, :2]
    lattice = extended(extended(control.reshape(5, 4, 3)).swapaxes(0, 1)).swapaxes(0, 1)
    cell = np.minimum(where.astype(int), [3, 2])
    local = where - cell
    patch = lattice[cell[:, 0, None, None] + np.arange(4)[:, None], cell[:, 1, None, None] + np.arange(4)]
    u, v = (b_spline(local[:, axis]) for axis in (0, 1))
    du, dv = (b_spline(local[:, axis], True) for axis in (0, 1))
    assert found.points == pytest.approx(np.einsum("nijk,ni,nj->nk", patch, u, v), abs=1e-12)
    normal = np.cross(np.einsum("nijk,ni,nj->nk", patch, du, v), np.einsum("nijk,ni,nj->nk", patch, u, dv))
    assert unit(found.normals.values) == pytest.approx(unit(normal), abs=1e-12)


def test_the_cubes_limit():
    """By hand: (9 v + 4 edges + faces) / 24 at a corner; 0.8395 amid a face."""
    for level in (1, 2, 3):
        found = surface(CUBE, CUBE_FACES, level)
        assert found.points[-8:] == pytest.approx(CUBE / 2)
        assert np.abs(found.points).max() == pytest.approx((16 + 12 + 20 / 9) / 36)
        assert unit(found.normals.values[-8:]) == pytest.approx(CUBE / np.sqrt(3))


def test_loop_on_a_regular_triangulation_is_the_box_spline():
    """The box spline takes x^2 to x^2 + 1/4, and likewise any direction; and the normal to the gradient's."""
    n = 7
    i, j = np.meshgrid(np.arange(n), np.arange(n), indexing="ij")
    x, y = (i + j / 2).reshape(-1), (j * np.sqrt(0.75)).reshape(-1)
    at = (i * n + j)[:-1, :-1].reshape(-1, 1)
    faces = np.concatenate([at + [0, n, 1], at + [n, n + 1, 1]])
    for level in (1, 2, 3):
        found = surface(np.stack([x, y, x * x - x * y], axis=1), faces, level, "loop")
        flat = surface(np.stack([x, y, 0 * x], axis=1), faces, level, "loop").points
        inside = (flat[:, 1] > 1.8) & (flat[:, 1] < 3.4) & (np.abs(flat[:, 0] - flat[:, 1] / np.sqrt(3) - 3) < 0.9)
        px, py = flat[inside, 0], flat[inside, 1]
        assert inside.sum() > 5
        assert found.points[inside, 2] == pytest.approx(px * px - px * py + 0.25)
        normal = np.stack([py - 2 * px, px, np.ones_like(px)], axis=1)
        assert unit(found.normals.values[inside]) == pytest.approx(unit(normal))


SHARP = {"creases": [[0, 1, 1.3], [1, 3, 2.0], [3, 2, 10], [5, 7, 0.4], [7, 6, 3.6]], "fixed": [[4, 1.7], [6, 10]]}


@pytest.mark.parametrize(
    ("points", "faces", "options"),
    [
        (CUBE, CUBE_FACES, {}),
        (CUBE, CUBE_FACES, SHARP),
        (CUBE, CUBE_FACES[:-1], {**SHARP, "boundary": "edgeOnly"}),
        (MIXED, MIXED_FACES, {}),
        (MIXED, MIXED_FACES, {"smooth_triangles": True, "creases": [[0, 5, 2.5], [3, 5, 10]]}),
        (TETRAHEDRON, TETRAHEDRON_FACES, {"scheme": "loop"}),
        (TETRAHEDRON, TETRAHEDRON_FACES[1:], {"scheme": "loop", "creases": [[0, 3, 1.5]], "boundary": "edgeOnly"}),
    ],
)
class TestLaws:
    def test_the_limit_is_the_same_from_every_level(self, points, faces, options):
        """Also where sharpness has not ended, and at darts, whose limit is a series."""
        found = [surface(points, faces, level, **options).points for level in (1, 2, 4)]
        for coarse, fine in zip(found, found[1:], strict=False):
            assert fine[-len(coarse) :] == pytest.approx(coarse, abs=3e-6)

    def test_it_moves_with_its_cage(self, points, faces, options):
        turn, shift = np.array([[1, 2, 0], [0, -1, 1], [3, 0, 1]]), np.array([5, -7, 11])
        moved = surface(points @ turn + shift, faces, 2, **options)
        still = surface(points, faces, 2, **options)
        assert moved.points == pytest.approx(still.points @ turn + shift)

    def test_names_do_not_matter(self, points, faces, options):
        random = np.random.default_rng(3)
        order, face_order = random.permutation(len(points)), random.permutation(len(faces))
        name = np.argsort(order)
        renamed = [np.roll(name[np.array(faces[f])], 1) for f in face_order]
        changed = {
            "creases": [[name[a], name[b], s] for a, b, s in options.get("creases", ())],
            "fixed": [[name[v], s] for v, s in options.get("fixed", ())],
        }
        one, other = surface(points, faces, 2, **options), surface(points[order], renamed, 2, **{**options, **changed})
        assert sorted(map(tuple, one.points.round(9) + 0.0)) == sorted(map(tuple, other.points.round(9) + 0.0))

    def test_weights_sum_to_one_and_stay_near(self, points, faces, options):
        found = surface(points, faces, 2, **options)
        vertices = np.arange(len(points))
        corners = np.concatenate(faces)
        for kind in ("vertex", "varying"):
            total = 0.0
            for vertex in vertices:
                one = CornerValues((vertices == vertex).astype(float)[:, None], corners, interpolation=kind)
                part = found.carry(one).values
                total = total + part
                assert part.max() <= 1 + 1e-12
            assert total == pytest.approx(np.ones_like(total))

    def test_euler_characteristic_and_twins_are_kept(self, points, faces, options):
        levels = surface(points, faces, 3, **options)._levels
        for level in levels:
            assert level.vertices - len(level.lead) + len(level.counts) == (
                levels[0].vertices - len(levels[0].lead) + len(levels[0].counts)
            )
            there = np.flatnonzero(level.twin >= 0)
            twin = level.twin[there]
            assert (level.twin[twin] == there).all() and (level.edge[twin] == level.edge[there]).all()
            assert (level.corners[twin] == level.corners[level.next[there]]).all()
            assert (level.edge[level.lead] == np.arange(len(level.lead))).all()
            assert len(np.unique(level.edge)) == len(level.lead)


@pytest.mark.parametrize(
    ("points", "faces", "options"),
    [
        (CUBE, CUBE_FACES, {}),
        (CUBE, CUBE_FACES, {"creases": [[0, 1, 10], [1, 3, 10], [3, 2, 10], [2, 0, 10], [5, 7, 10]]}),
        (CUBE, CUBE_FACES[:-1], {"boundary": "edgeOnly"}),
        (MIXED, MIXED_FACES[:-1], {"boundary": "edgeOnly"}),
        (TETRAHEDRON, TETRAHEDRON_FACES, {"scheme": "loop"}),
        (TETRAHEDRON, TETRAHEDRON_FACES[1:], {"scheme": "loop", "boundary": "edgeOnly"}),
        (TETRAHEDRON, TETRAHEDRON_FACES, {"scheme": "loop", "creases": [[0, 1, 10], [1, 2, 10]]}),
    ],
)
def test_normals_are_the_same_from_every_level(points, faces, options):
    """At smooth vertices and on either side of creases, also where valences are irregular."""
    coarse, fine = (surface(points, faces, level, **options) for level in (1, 4))
    offset = len(fine.points) - len(coarse.points)
    level = coarse._levels[-1]
    sharp = level.incident(level.edge_sharpness > 0)
    tested = 0
    for vertex in np.flatnonzero((sharp == 0) | (sharp == 2)):
        here = unit(coarse.normals.values[np.unique(coarse.normals.index[coarse.corners == vertex])])
        there = unit(fine.normals.values[np.unique(fine.normals.index[fine.corners == vertex + offset])])
        assert len(here) == len(there)
        for normal in here:
            assert np.linalg.norm(there - normal, axis=1).min() < 1e-6
            tested += 1
    assert tested > 9


def test_normals_of_an_irregular_vertex_are_what_fine_facets_show():
    found = surface(CUBE, CUBE_FACES, 2)
    fine = surface(CUBE, CUBE_FACES, 6)
    corner = np.flatnonzero(fine.corners.reshape(-1, 4) == len(fine.points) - 1)[0] // 4
    facet = fine.points[fine.corners.reshape(-1, 4)[corner]]
    facing = unit(np.cross(facet[2] - facet[0], facet[3] - facet[1]))
    assert facing @ unit(found.normals.values[-1]) == pytest.approx(1, abs=2e-3)


def test_semi_sharp_creases_decay_from_level_to_level():
    ring = [[0, 1], [1, 3], [3, 2], [2, 0]]

    def refined(sharpness, level):
        found = surface(CUBE, CUBE_FACES, level, creases=[[*edge, sharpness] for edge in ring])
        return found._refine(found._levels, CUBE, False)

    for level in (1, 2, 3):
        assert refined(level, level) == pytest.approx(refined(10, level)), "as sharp as infinite for so many levels"
        assert np.abs(refined(level, level + 1) - refined(10, level + 1)).max() > 0.01
    assert refined(0.25, 1) == pytest.approx(0.25 * refined(1, 1) + 0.75 * refined(0, 1))
    assert refined(50, 4) == pytest.approx(refined(10, 4))


def test_an_infinite_crease_is_a_cubic_b_spline_and_ends_where_three_meet():
    places, faces = grid(4, 4)
    control = np.concatenate([places, np.random.default_rng(2).random((25, 1))], axis=1)
    line = [10, 11, 12, 13, 14]
    found = surface(control, faces, 2, creases=[[a, b, 10] for a, b in zip(line, line[1:], strict=False)])
    curve = extended(control[line])
    t = np.arange(0, 4.01, 0.25)
    cell = np.minimum(t.astype(int), 3)
    wanted = np.einsum("nik,ni->nk", curve[cell[:, None] + np.arange(4)], b_spline(t - cell))
    for point in wanted:
        assert np.linalg.norm(found.points - point, axis=1).min() < 1e-12
    # Two normals at a vertex of the crease, and three sharp edges make a corner that stays put.
    assert len(found.normals.values) == len(found.points) + 17
    corner = surface(control, faces, 2, creases=[[11, 12, 10], [12, 13, 10], [12, 17, 10]])
    assert corner.points[-25:][12] == pytest.approx(control[12])


def test_boundary_rules():
    places, faces = grid(2, 2)
    flat = np.pad(np.array(places, dtype=float), ((0, 0), (0, 1)))
    pinned, rounded = (surface(flat, faces, 2, boundary=rule) for rule in ("edgeAndCorner", "edgeOnly"))
    assert pinned.points[-9:][0] == pytest.approx([0, 0, 0])
    # The boundary's B-spline at a corner: (4 corner + neighbours) / 6.
    assert rounded.points[-9:][0] == pytest.approx([1 / 6, 1 / 6, 0])
    assert not pinned.hidden.any() and not rounded.hidden.any()
    places, faces = grid(4, 4)
    flat = np.pad(np.array(places, dtype=float), ((0, 0), (0, 1)))
    inner = surface(flat, faces, 1, boundary="none")
    assert sorted(set(inner.parents[~inner.hidden])) == [5, 6, 9, 10], "faces that touch the boundary are holes"
    rim = [v for v in range(25) if 0 in places[v] or 4 in places[v]]
    edges = [(a, b) for a in rim for b in rim if a < b and np.abs(np.subtract(places[a], places[b])).sum() == 1]
    assert not surface(flat, faces, 1, boundary="none", creases=[[a, b, 10] for a, b in edges]).hidden.any()


def test_triangles_may_be_weighed_otherwise():
    """By hand, at the edge 0-1 of two triangles: 0.03 of each end, 0.47 of either middle."""
    points = np.array([[0, 0, 0], [0, 3, 0], [3, 0, 6], [-3, 0, 0]], dtype=float)
    topology, keys = build(4, np.array([3, 3]), np.array([0, 1, 3, 1, 0, 2]))
    edge = int(np.flatnonzero(keys == 1)[0])
    for rule, middle in ((False, 0.5), (True, 0.94)):
        child = refine(topology, points, False, rule)[2 + edge]
        means = (points[[0, 1, 3]].mean(axis=0) + points[[1, 0, 2]].mean(axis=0)) / 2
        assert child == pytest.approx((1 - middle) * points[:2].mean(axis=0) + middle * means)


def test_opensubdivs_own_points():
    golden = GOLDEN["cube"]
    faces = np.split(golden["corners"], np.cumsum(golden["counts"])[:-1])
    found = surface(golden["points"], faces, 2, creases=golden["creases"], fixed=golden["fixed"])
    refined = found._refine(found._levels, np.array(golden["points"], dtype=float), False)
    assert refined == pytest.approx(np.array(golden["refined"]), abs=1.1e-5)


@pytest.mark.parametrize("rule", ["all", "none", "cornersOnly", "cornersPlus1", "cornersPlus2", "boundaries"])
@pytest.mark.parametrize("indexed", [False, True])
def test_opensubdivs_own_face_varying_values(rule, indexed):
    golden = GOLDEN["grid"]
    faces = np.split(golden["corners"], np.cumsum(golden["counts"])[:-1])
    values, index = np.array(golden["st"]), np.arange(len(golden["st"]))
    if indexed:
        values, index = np.unique(values, axis=0, return_inverse=True)
    boundary = "edgeOnly" if rule == "none" else "edgeAndCorner"
    found = surface(golden["points"], faces, 1, boundary=boundary, face_varying=rule)
    st = found.carry(CornerValues(values, index.reshape(-1), interpolation="faceVarying", indexed=indexed))
    wanted = np.array(golden["values"][rule])
    # Smooth corners of the boundary are OpenSubdiv's own approximation there.
    assert st.values[st.index] == pytest.approx(wanted, abs=1e-4 if rule == "none" else 1.2e-5)


def test_a_region_beside_a_semi_sharp_one_is_as_sharp():
    """Of two regions that meet along a line, one has a crease that ends at it: both all but stay there (cornersPlus1)."""
    places, faces = grid(4, 2)
    flat = np.pad(np.array(places, dtype=float), ((0, 0), (0, 1)))
    index = np.concatenate(faces)
    values = np.concatenate([flat[:, :2], flat[:, :2] + 9])
    right = np.repeat(np.arange(8) % 2 == 1, 4)  # a seam along the middle of the long side

    def moved(rule, sharpness):
        found = surface(flat, faces, 1, creases=[[6, 7, sharpness]], face_varying=rule)
        st = found.carry(CornerValues(values**2, index + len(flat) * right, interpolation="faceVarying", indexed=True))
        return [np.linalg.norm(st.values - place, axis=1).min() for place in ((4, 1), (121, 100))]

    assert moved("cornersPlus1", 0) == pytest.approx([1 / 3, 1 / 3])
    assert moved("cornersOnly", 3) == pytest.approx([moved("cornersPlus1", 3)[0], 1 / 3])
    assert moved("cornersPlus1", 3) == pytest.approx([1 / 24, 1 / 24]), "the kink halves at each level that it stays sharp"


def test_values_without_seams_are_vertex_values():
    index = np.concatenate(CUBE_FACES)
    found = surface(CUBE, CUBE_FACES, 2, **SHARP)
    smooth = found.carry(CornerValues(CUBE, index, interpolation="vertex"))
    torn = found.carry(CornerValues(CUBE, index, interpolation="faceVarying", indexed=True))
    assert torn.values[torn.index] == pytest.approx(smooth.values[smooth.index])
    assert smooth.values[smooth.index] == pytest.approx(found.points[found.corners])


def test_what_is_no_manifold_is_sharp():
    fins = surface(np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0], [1, 0, 1], [-1, 0.2, 0], [-1, 0.2, 1], [0, 1, 0], [0, 1, 1.0]]),
                   [[0, 2, 3, 1], [0, 1, 5, 4], [0, 1, 7, 6]], 2)  # fmt: skip
    assert fins.points[-8:][:2] == pytest.approx(np.array([[0, 0, 0], [0, 0, 1]]))
    two_cubes = np.concatenate([CUBE, CUBE[1:] + 2])
    again = [[(v + 7 if v else 7) for v in face] for face in CUBE_FACES]  # its corner 0 is the first one's corner 7
    touching = surface(two_cubes, CUBE_FACES + again, 1)
    assert touching.points[-15:][7] == pytest.approx(CUBE[7])
    alike = surface(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 2, 0], [1, 2, 0.0]]), [[0, 1, 2, 3], [4, 5, 2, 3]], 1)
    assert np.isfinite(alike.points).all()


@pytest.mark.parametrize("faces", [[[0, 0, 0]], [[0, 1, 1, 0]], [[0, 1, 0, 2, 0, 3]], [[0, 1, 2], [0, 1, 2]], [[0, 1, 2], [2, 1, 0]]])
def test_degenerate_faces_give_finite_surfaces(faces):
    for scheme in ("catmullClark", "bilinear", "loop"):
        if scheme != "loop" or all(len(face) == 3 for face in faces):
            found = surface(TETRAHEDRON, faces, 2, scheme)
            assert np.isfinite(found.points).all()
            assert found.normals is None or np.isfinite(found.normals.values).all()


def test_a_vertex_of_very_many_faces():
    n = 3000
    angle = np.arange(n) * (2 * np.pi / n)
    points = np.concatenate([[[0, 0, 1]], np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)])
    faces = [[0, 1 + k, 1 + (k + 1) % n] for k in range(n)]
    for scheme in ("catmullClark", "loop"):
        found = surface(points, faces, 1, scheme)
        pole = len(found.points) - len(points)
        assert found.points[pole, :2] == pytest.approx([0, 0], abs=1e-9)
        assert unit(found.normals.values[pole]) == pytest.approx([0, 0, 1], abs=1e-6)


def test_points_that_no_face_uses_stay():
    topology, _ = build(6, np.array([4]), np.array([0, 1, 2, 3]))
    values = np.random.default_rng(4).random((6, 3))
    level, refined = split_to_quads(topology), refine(topology, values, False)
    assert limit(level, refined, False)[-2:] == pytest.approx(values[-2:])
