"""BasisCurves as tubes and ribbons, against closed forms and against what USD says of them."""

import numpy as np
import pytest
from conftest import HEADER
from PIL import Image
from pxr import Usd, UsdGeom
from test_deformation import SHOT, array, corners_of, sampled, seconds
from test_skinning import SKELETON, animation, baked
from usd_gltf.curves import Layout, Samples
from usd_gltf.tubes import SIDES

BASES = ("linear", "bezier", "bspline", "catmullRom")
WRAPS = ("nonperiodic", "periodic", "pinned")


def curves(points, counts=None, basis="linear", wrap="nonperiodic", width=0.2, more="", name="C"):
    """A BasisCurves prim; `width` is one number, or the text of widths."""
    kind = "linear" if basis == "linear" else "cubic"
    form = "" if basis == "linear" else f'uniform token basis = "{basis}"'
    widths = f'float[] widths = [{width}] (interpolation = "constant")' if isinstance(width, int | float) else width
    where = f"point3f[] points = {array(points)}" if not isinstance(points, str) else points
    return f"""def BasisCurves "{name}" {{
        uniform token type = "{kind}"
        {form}
        uniform token wrap = "{wrap}"
        int[] curveVertexCounts = {counts or [len(points)]}
        {where}
        {widths}
        {more}
    }}"""


def caps(radius, level="high"):
    """The area of both ends of a tube."""
    sides = SIDES[("low", "medium", "high", "veryhigh").index(level)]
    return 2 * np.pi**2 * radius**2 / (sides * np.tan(np.pi / sides))


def is_closed(scene, path="/C"):
    """Whether each edge of a mesh is passed once in each direction, and the mesh faces outside."""
    corners = np.concatenate([scene.triangles(path, p) for p in range(len(scene.primitives(path)))])
    _, index = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
    index = index.reshape(-1, 3)
    there = {(a, b) for t in index.tolist() for a, b in zip(t, t[1:] + t[:1], strict=True)}
    assert len(there) == 3 * len(index)
    volume = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    return all((b, a) in there for a, b in there) and volume > 0


def outline(found, path="/C"):
    normals, points = found.attribute(path, "NORMAL").astype(float), found.attribute(path, "POSITION").astype(float)
    assert np.isfinite(points).all()
    assert np.linalg.norm(normals, axis=1) == pytest.approx(1, abs=1e-5)
    return points, normals


@pytest.mark.parametrize("basis", BASES)
@pytest.mark.parametrize("wrap", WRAPS)
def test_spans_and_sizes_are_those_that_usd_tells(basis, wrap):
    stage = Usd.Stage.CreateInMemory()
    prim = UsdGeom.BasisCurves.Define(stage, "/C")
    prim.GetTypeAttr().Set("linear" if basis == "linear" else "cubic")
    prim.GetWrapAttr().Set(wrap)
    if basis != "linear":
        prim.GetBasisAttr().Set(basis)
    for count in range(4, 20):
        if basis == "bezier" and (count if wrap == "periodic" else count - 4) % 3:
            continue
        counts = [count, 10 if basis != "bezier" or wrap != "periodic" else 9]
        prim.GetCurveVertexCountsAttr().Set(counts)
        layout = Layout(np.array(counts), basis, wrap)
        assert layout.spans.tolist() == list(prim.ComputeSegmentCounts(Usd.TimeCode.Default()))
        # Of these, usd-core 26.11 tells other sizes of varying data than its schema does, which says segments, plus one if open.
        if wrap == "nonperiodic" or (wrap == "periodic" and basis != "linear"):
            assert layout.varying.sum() == prim.ComputeVaryingDataSize(Usd.TimeCode.Default())
        assert layout.varying.tolist() == [n + (wrap != "periodic") for n in layout.spans]
        assert layout.left_over == 0
        assert Samples(layout, 4).lengths.tolist() == [
            n * (1 if basis == "linear" else 4) + (wrap != "periodic") for n in layout.spans
        ]


def blend(basis, four, t):
    """A span at t, by constructions that know no matrix."""
    a, b, c, d = four
    if basis == "linear":
        return a + (b - a) * t
    if basis == "bezier":  # de Casteljau
        row = [a, b, c, d]
        while len(row) > 1:
            row = [x + (y - x) * t for x, y in zip(row, row[1:], strict=False)]
        return row[0]
    if basis == "bspline":  # de Boor, knots -2 to 3
        row = [a, b, c, d]
        for degree in (3, 2, 1):
            row = [x + (y - x) * (t - (i + 1 - degree)) / degree for i, (x, y) in enumerate(zip(row, row[1:], strict=False))]
        return row[0]
    # Hermite's cubic from b to c, whose slopes are half the chords around them.
    m, n = (c - a) / 2, (d - b) / 2
    return b * (1 + 2 * t) * (1 - t) ** 2 + m * t * (1 - t) ** 2 + c * t * t * (3 - 2 * t) + n * t * t * (t - 1)


@pytest.mark.parametrize("basis", BASES)
@pytest.mark.parametrize("wrap", WRAPS)
def test_curves_run_as_their_basis_says(basis, wrap):
    rng = np.random.default_rng(5)
    counts = np.array([7, 10, 4, 13]) if wrap != "periodic" else np.array([6, 9, 3, 12])
    layout, pieces = Layout(counts, basis, wrap), 4 if basis != "linear" else 1
    values, samples = rng.normal(size=(counts.sum(), 3)), Samples(layout, 4)
    found, varying = samples.vertex(values), samples.varying(np.arange(float(layout.varying.sum()))[:, None])[:, 0]
    before, after = samples.slopes(values)
    for curve, start in enumerate(np.cumsum(counts) - counts):
        own = values[start : start + counts[curve]]
        if layout.is_pinned:
            own = np.concatenate([[2 * own[0] - own[1]], own, [2 * own[-1] - own[-2]]])
        first = layout.varying[:curve].sum()
        for number in range(samples.lengths[curve]):
            at = samples.starts[curve] + number
            span = min(number // pieces, layout.spans[curve] - 1)
            t = number / pieces - span
            four = [own[(span * layout.vstep + k) % len(own)] for k in range(4)]
            assert found[at] == pytest.approx(blend(basis, four, t), abs=1e-9)
            slope = (blend(basis, four, t + 1e-5) - blend(basis, four, t - 1e-5)) / 2e-5
            assert after[at] == pytest.approx(slope, abs=1e-6)
            if number % pieces:
                assert before[at] == pytest.approx(slope, abs=1e-6)
            low, high = first + span, first + (span + 1) % layout.varying[curve]
            assert varying[at] == pytest.approx(low + (high - low) * t)
    if layout.is_pinned:
        assert found[samples.starts] == pytest.approx(values[np.cumsum(counts) - counts])
        assert found[samples.starts + samples.lengths - 1] == pytest.approx(values[np.cumsum(counts) - 1])


@pytest.mark.parametrize("level", ["low", "medium", "high", "veryhigh"])
def test_a_straight_tube_has_the_area_of_its_cylinder_and_its_mean_width(gltf, level):
    scene = gltf(curves([(0, 0, 0), (1, 2, 2)], width=0.4), "--complexity", level)
    assert scene.area("/C") == pytest.approx(2 * np.pi * 0.2 * 3 + caps(0.2, level))
    assert is_closed(scene)
    # Seen across, from all around, it covers its diameter in the mean (Cauchy).
    along = np.array([1, 2, 2]) / 3
    x = np.cross(along, [0, 0, 1])
    x, y = x / np.linalg.norm(x), np.cross(along, x / np.linalg.norm(x))
    points, _ = outline(scene)
    angle = np.linspace(0, 2 * np.pi, 240, endpoint=False)
    seen = np.ptp(points @ (x[:, None] * np.cos(angle) + y[:, None] * np.sin(angle)), axis=0)
    assert seen.mean() == pytest.approx(0.4, rel=1e-3)


@pytest.mark.parametrize("sides", [3, 4, 7, 30])
def test_mitred_joints_keep_the_tubes_area(gltf, sides):
    angle = np.arange(sides) * 2 * np.pi / sides
    points = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    scene = gltf(curves(points, wrap="periodic", width=0.1))
    assert scene.area("/C") == pytest.approx(2 * np.pi * 0.05 * sides * 2 * np.sin(np.pi / sides))
    assert is_closed(scene)


def test_a_zigzag_in_space_keeps_its_area_too(gltf):
    points = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (1, 1, 1), (2, 2, 1), (2, 2, 3)], float)
    scene = gltf(curves(points, width=0.1))
    length = np.linalg.norm(np.diff(points, axis=0), axis=1).sum()
    assert scene.area("/C") == pytest.approx(2 * np.pi * 0.05 * length + caps(0.05))
    assert is_closed(scene)


def circle(basis, count=12):
    """Control vertices of a circle of radius 1, nearly."""
    if basis == "bezier":
        quarter = np.arange(4) * np.pi / 2
        at = np.stack([np.cos(quarter), np.sin(quarter), 0 * quarter], axis=1)
        ahead = np.stack([-np.sin(quarter), np.cos(quarter), 0 * quarter], axis=1) * 0.5522847498
        return np.stack([at, at + ahead, np.roll(at, -1, axis=0) - np.roll(ahead, -1, axis=0)], axis=1).reshape(-1, 3)
    angle = np.arange(count) * 2 * np.pi / count
    # A uniform B-spline's points are a third of the cosine nearer to the middle.
    out = 3 / (2 + np.cos(2 * np.pi / count)) if basis == "bspline" else 1.0
    return np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1) * out


@pytest.mark.parametrize("basis", ["bezier", "bspline", "catmullRom"])
def test_a_circle_becomes_a_torus(gltf, basis):
    errors = []
    for level in ("low", "medium", "high", "veryhigh"):
        scene = gltf(curves(circle(basis), basis=basis, wrap="periodic", width=0.2), "--complexity", level)
        assert is_closed(scene)
        errors.append(abs(scene.area("/C") / (4 * np.pi**2 * 0.1) - 1))
        points, normals = outline(scene)
        middle = points * [1, 1, 0]
        middle /= np.linalg.norm(middle, axis=1, keepdims=True)
        out = points - middle
        out /= np.linalg.norm(out, axis=1, keepdims=True)
        assert (out * normals).sum(axis=1).min() > 0.99
    assert errors[-1] < 0.005 and errors[-1] < errors[0]


@pytest.mark.parametrize("form", ["vertex", "varying"])
def test_a_taper_is_a_cone(gltf, form):
    widths = f'float[] widths = [2, 1.5, 1, 0.5, 0] (interpolation = "{form}")'
    points = np.array([(0, 0, k) for k in range(5)], float)
    scene = gltf(curves(points, width=widths), "--complexity", "veryhigh")
    sides = SIDES[3]
    wide = np.pi / sides / np.sin(np.pi / sides)
    apothem = wide * np.cos(np.pi / sides)
    lateral = sides * (2 * wide * np.sin(np.pi / sides)) * np.hypot(4, apothem) / 2
    assert scene.area("/C") == pytest.approx(lateral + caps(1.0, "veryhigh") / 2)
    assert is_closed(scene)
    points, normals = outline(scene)
    sloped = normals[np.abs(normals[:, 2]) < 0.9]
    assert sloped[:, 2] == pytest.approx(np.sin(np.arctan2(1, 4)), abs=1e-6)


def test_a_width_below_zero_is_none(gltf):
    widths = 'float[] widths = [0.2, 0.2, -0.2] (interpolation = "vertex")'
    scene = gltf(curves([(0, 0, 0), (0, 0, 1), (0, 0, 2)], width=widths))
    points, _ = outline(scene)
    assert np.abs(points[points[:, 2] > 1.5][:, :2]).max(initial=0) < 1e-6


@pytest.mark.parametrize("basis", BASES)
@pytest.mark.parametrize("wrap", WRAPS)
def test_tubes_are_inside_what_usd_says_of_their_extent(gltf, export, basis, wrap):
    rng = np.random.default_rng(7)
    counts = [9, 6] if wrap == "periodic" else [10, 7]
    text = curves(rng.normal(size=(sum(counts), 3)), counts, basis, wrap, 0.05)
    scene = gltf(text)
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(HEADER + text.replace("}", "\n}"))
    prim = UsdGeom.BasisCurves(stage.GetPrimAtPath("/C"))
    low, high = np.array(UsdGeom.Boundable.ComputeExtentFromPlugins(prim, Usd.TimeCode.Default()), float)
    points, _ = outline(scene)
    if basis == "catmullRom" or (wrap == "pinned" and basis == "bspline"):
        low, high = low - 0.5, high + 0.5  # these leave the hull of their vertices
    # A mitre of a sharp bend is up to four times as long.
    room = 0.025 * (4.2 if basis in ("linear", "bezier") else 1.1)
    assert (points > low - room).all() and (points < high + room).all()


def test_what_stands_still_or_turns_back_is_drawn(gltf):
    hair = [(0, 0, 0)] * 4 + [(0, 0, 1), (0, 0, 2), (0, 1, 2), (0, 0, 2), (0, 0, 2), (0, 0, 2)]
    for basis in BASES:
        for wrap in WRAPS:
            count = 9 if wrap == "periodic" else 10
            points, _ = outline(gltf(curves(hair[:count], basis=basis, wrap=wrap, width=0.1)))
            assert np.ptp(points[:, 2]) > 1
    folded = curves([(0, 0, 0), (0, 0, 1), (0, 0, 0)], width=0.1)
    points, _ = outline(gltf(folded))
    assert np.abs(points[:, :2]).max() < 0.06
    result = gltf(curves([(1, 2, 3)] * 4, width=0.1))
    assert "/C" not in result.by_path or len(result.triangles("/C"))


def test_each_primvar_goes_along_as_its_interpolation_says(gltf):
    def colors(values, interpolation, basis="bspline"):
        more = f'color3f[] primvars:displayColor = {array(values)} (interpolation = "{interpolation}")'
        points = [(0, 0, k) for k in range(6)] + [(5, 0, k) for k in range(5)]
        scene = gltf(curves(points, [6, 5], basis, width=0.1, more=more))
        if interpolation == "constant":
            return scene.material("/C")["pbrMetallicRoughness"]["baseColorFactor"][:3]
        return outline(scene)[0], scene.attribute("/C", "COLOR_0")[:, 0]

    assert colors([(0.25, 0.5, 1)], "constant") == pytest.approx([0.25, 0.5, 1])
    points, red = colors([(0.25, 0, 0), (0.75, 0, 0)], "uniform")
    assert red == pytest.approx(np.where(points[:, 0] > 2.5, 0.75, 0.25))
    # Along evenly spaced vertices a B-spline is linear: z from 1 to 4, and to 3.
    points, red = colors([(k / 8, 0, 0) for k in range(6)] + [(k / 8, 0, 0) for k in range(5)], "vertex")
    assert red == pytest.approx(points[:, 2] / 8, abs=1e-6)
    points, red = colors([(k / 4, 0, 0) for k in range(4)] + [(k / 4, 0, 0) for k in range(3)], "varying")
    assert red == pytest.approx((points[:, 2] - 1) / 4, abs=1e-6)


def test_texture_coordinates_of_whole_curves_and_of_vertices(gltf, tmp_path):
    Image.new("RGB", (2, 2), (255, 128, 0)).save(tmp_path / "dots.png")
    look = """
        def Material "Look" { token outputs:surface.connect = </Look/S.outputs:surface>
            def Shader "S" { uniform token info:id = "UsdPreviewSurface"
                color3f inputs:diffuseColor.connect = </Look/T.outputs:rgb>
                token outputs:surface }
            def Shader "T" { uniform token info:id = "UsdUVTexture"
                asset inputs:file = @dots.png@
                float2 inputs:st.connect = </Look/R.outputs:result>
                float3 outputs:rgb }
            def Shader "R" { uniform token info:id = "UsdPrimvarReader_float2"
                string inputs:varname = "st"
                float2 outputs:result } }
    """

    def coordinates(kind, values):
        more = f"""texCoord2f[] primvars:st = {array(values)} (interpolation = "{kind}"
            )
            rel material:binding = </Look>"""
        scene = gltf(curves([(k, 0, 0) for k in range(5)], [3, 2], more=more) + look)
        return outline(scene)[0], scene.attribute("/C", "TEXCOORD_0")

    points, found = coordinates("uniform", [(0.25, 0.5), (0.75, 0.25)])
    assert found == pytest.approx(np.where(points[:, :1] < 2.5, [[0.25, 0.5]], [[0.75, 0.75]]))
    points, found = coordinates("vertex", [(k / 8, k / 4) for k in range(5)])
    assert found[:, 0] == pytest.approx(points[:, 0] / 8, abs=1e-6) and found[:, 1] == pytest.approx(1 - points[:, 0] / 4, abs=1e-6)


@pytest.mark.parametrize("basis", ["linear", "bspline"])
def test_ribbons_lie_across_their_normals(gltf, basis):
    points = [(0, 0, k) for k in range(6)]
    normals = 'normal3f[] normals = [(1, 0, 1)] (interpolation = "constant")'
    scene = gltf(curves(points, basis=basis, width=0.5, more=normals))
    length = 5 if basis == "linear" else 3
    assert scene.area("/C") == pytest.approx(0.5 * length)
    found, facing = outline(scene)
    assert facing == pytest.approx(np.tile([1, 0, 0], (len(facing), 1)), abs=1e-6)
    assert found[:, 0] == pytest.approx(0, abs=1e-7) and np.ptp(found[:, 1]) == pytest.approx(0.5)
    assert scene.area_vectors("/C")[:, 0].min() > 0


def test_a_ribbon_that_turns_has_the_area_of_its_helicoid(gltf):
    angle = np.linspace(0, np.pi, 41)
    rows = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    normals = f'normal3f[] primvars:normals = {array(rows)} (interpolation = "varying")'
    text = curves([(0, 0, z) for z in np.linspace(0, 2, 41)], width=1.0, more=normals)
    scene = gltf(text)
    rate = np.pi / 2
    half = 0.5 * rate
    closed = 2 * (half * np.hypot(1, half) + np.arcsinh(half)) / (2 * rate) * 2
    assert scene.area("/C") == pytest.approx(closed, rel=0.02)
    fine = gltf(text, "--complexity", "veryhigh")
    assert fine.area("/C") == pytest.approx(closed, rel=0.005)


def same_as_alone(gltf, text, codes):
    """Whether curves that deform are at each frame what they are if it is exported alone; neither has weld differences."""
    scene = gltf(text)
    found = {code: corners_of(scene.deformed_triangles("/C", seconds(code))) for code in codes}
    for code in codes:
        alone = gltf(text, "--frames", str(code), out="alone.glb")
        rest = alone.triangles("/C") @ alone.world("/C")[:3, :3].T + alone.world("/C")[:3, 3]
        a, b = (np.unique(np.round(np.array(rows).reshape(-1, 3), 3), axis=0) for rows in (found[code], corners_of(rest)))
        far = np.abs(a[:, None] - b).max(axis=2)
        if max(far.min(axis=0).max(), far.min(axis=1).max()) > 2e-3:
            return False
    return True


def test_points_and_widths_over_time_are_carried(gltf, export):
    straight = np.array([(0, 0, k) for k in range(5)], float)
    bent = straight + [[0, 0, 0], [0.1, 0, 0], [0.4, 0, 0], [0.9, 0, 0], [1.6, 0, 0]]
    moving = curves(sampled({1: straight, 5: bent}), [5], "catmullRom")
    result = export(SHOT + moving, "--strict")
    assert result.code == 0, result.err
    assert result.report["counts"]["deforming meshes"] == 1
    assert same_as_alone(gltf, SHOT + moving, (1, 3, 5))
    widths = 'float[] widths.timeSamples = { 1: [0.2], 5: [0.6] }\n'
    growing = curves(straight, basis="catmullRom", width=f"{widths}")
    scene = gltf(SHOT + growing)
    assert np.ptp(scene.deformed("/C", seconds(5))[:, 0]) == pytest.approx(3 * np.ptp(scene.deformed("/C", 0)[:, 0]), rel=1e-5)
    still = gltf(SHOT + curves(sampled({1: straight, 5: straight}), [5], "catmullRom"))
    assert "targets" not in still.primitives("/C")[0]


def test_a_tube_that_turns_over_does_not_spin(gltf):
    """Each vertex stays on its side: over a turn of a straight hair its ring moves as the hair does."""
    turns = {1 + k: [(0, 0, 0), (np.sin(a), 0, np.cos(a)), (2 * np.sin(a), 0, 2 * np.cos(a))] for k, a in enumerate(np.linspace(0, 3, 25))}
    scene = gltf(SHOT.replace("= 5", "= 25") + curves(sampled(turns), [3], width=0.1))
    last = scene.deformed("/C", 0)
    for code in range(2, 26):
        now = scene.deformed("/C", seconds(code))
        # A turn by 1/8 about Y moves what is 2.05 from the axis by 0.26; a spin would add up to the diameter.
        assert np.linalg.norm(now - last, axis=1).max() < 0.26
        last = now


def test_counts_over_time_stay_those_of_the_first_frame(export):
    counts = "int[] curveVertexCounts.timeSamples = { 1: [4], 5: [2, 2] }"
    text = curves([(0, 0, k) for k in range(4)]).replace("int[] curveVertexCounts = [4]", counts)
    assert "animated curveVertexCounts" in export(SHOT + text).warned("animation")


def test_skinned_curves_follow_their_joints(gltf):
    skin = """
        int[] primvars:skel:jointIndices = [0, 0, 1, 1, 1] (interpolation = "vertex"
            elementSize = 1)
        float[] primvars:skel:jointWeights = [1, 1, 0.5, 1, 1] (interpolation = "vertex"
            elementSize = 1)
        matrix4d primvars:skel:geomBindTransform = ((1, 0, 0, 0), (0, 1, 0, 0), (0, 0, 1, 0), (0, 0, 0, 1))
    """
    body = curves([(k / 2, 0, 0) for k in range(5)], width=0.02, more=skin)
    body = body.replace('"C" {', '"C" (prepend apiSchemas = ["SkelBindingAPI"]) {')
    text = f"""def SkelRoot "Figure" (prepend apiSchemas = ["SkelBindingAPI"]) {{
        rel skel:skeleton = </Figure/Bones>
        rel skel:animationSource = </Figure/Nod>
        {SKELETON}
{animation()}
{body}
 }}"""
    scene = gltf(SHOT + text)
    for code in (1, 2):
        expected, _ = baked(text, "/Figure/C", code)
        triangles = scene.deformed_triangles("/Figure/C", seconds(code)).reshape(-1, 3)
        for point in expected:
            assert np.linalg.norm(triangles - point, axis=1).min() < 0.03


@pytest.mark.parametrize("size", [1e-9, 1e-4, 1.0, 1e5, 1e12])
@pytest.mark.parametrize("ratio", [1e-5, 1e-2, 1.0, 30.0])
def test_neither_the_size_of_curves_nor_how_thin_they_are_matters(gltf, size, ratio):
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.normal(size=(9, 3)), axis=0)
    areas = []
    for scale in (1.0, size):
        scene = gltf(curves(points * scale, basis="bspline", width=ratio * scale), out=f"{scale:g}.glb")
        corners = outline(scene)[0] / scale
        index = scene.accessor(scene.primitives("/C")[0]["indices"]).reshape(-1, 3)
        a, b, c = (corners[index[:, k]] for k in range(3))
        areas.append(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)
    assert areas[1] == pytest.approx(areas[0], rel=2e-3)


@pytest.mark.parametrize("basis", BASES)
@pytest.mark.parametrize("wrap", WRAPS)
def test_a_curve_among_others_is_what_it_is_alone(gltf, basis, wrap):
    """Curves of all lengths in one prim, with curves between them that have no span."""
    rng = np.random.default_rng(11)
    counts = [12, 1, 6, 9, 0, 6] if wrap == "periodic" else [10, 1, 4, 13, 0, 7]
    points = np.cumsum(rng.normal(size=(sum(counts), 3)), axis=0)
    starts = np.cumsum(counts) - counts
    together = gltf(curves(points, counts, basis, wrap))
    alone = []
    for start, count in zip(starts, counts, strict=True):
        if count > 1:
            alone += corners_of(gltf(curves(points[start : start + count], None, basis, wrap), out="alone.glb").triangles("/C"))
    found = corners_of(together.triangles("/C"))
    assert len(found) == len(alone)
    assert np.sort(np.array(found).reshape(-1, 9), axis=0) == pytest.approx(np.sort(np.array(alone).reshape(-1, 9), axis=0), abs=2e-4)
