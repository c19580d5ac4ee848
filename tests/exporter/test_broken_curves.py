"""Curves that do not fit together, lack something, are too many, or glow."""

import numpy as np
import pytest
from conftest import Gltf
from test_curves import curves, outline
from usd_gltf.tubes import PIECES, SIDES


@pytest.mark.parametrize(("change", "what"), [
    (("[4]", "[3]"), "curves with a broken topology"),
    (("[4]", "[5, -1]"), "curves with a broken topology"),
    (("[4]", "[]"), "curves without vertices"),
    (("[4]", "[1, 1, 2, 0]"), "curves of too few vertices"),
    (('"bspline"', '"hermite"'), "curves of an unknown kind"),
    (('"nonperiodic"', '"looped"'), "curves of an unknown kind"),
])  # fmt: skip
def test_what_makes_no_curves_is_left_out(export, change, what):
    result = export(curves([(0, 0, k) for k in range(4)], basis="bspline").replace(*change))
    assert result.code == 0, result.err
    assert result.warned() == {what}
    assert "/C" not in Gltf(result.path).by_path


def test_vertices_beyond_the_last_span_are_left_out(export):
    result = export(curves([(0, 0, k) for k in range(9)], [6, 3], "bezier"))
    assert result.warned() == {"curves with vertices left over"}
    assert "5 vertices" in result.said()
    assert outline(Gltf(result.path))[0][:, 2].max() == pytest.approx(3)


def test_points_that_are_no_numbers_take_their_curve_along(export):
    result = export(curves([(0, 0, 0), (0, 0, 1), (1, 0, 0), (float("nan"), 0, 1)], [2, 2]))
    assert result.warned() == {"points that are not finite"}
    points, _ = outline(Gltf(result.path))
    assert points[:, 0].max() < 0.2


@pytest.mark.parametrize(("widths", "what", "radius"), [
    ("", "curves without widths", 0.5),
    ('float[] widths = [0.5, 0.5, 0.5, 0.5, 0.5] (interpolation = "vertex")', "widths do not fit their curves", 0.5),
    ('float[] widths = [0.3] (interpolation = "vertex")', None, 0.15),
    ("float[] widths = [0.3, 0.3, 0.3]", None, 0.15),
    ('float[] widths = [9] (interpolation = "constant")\nfloat[] primvars:widths = [0.3] (interpolation = "constant")', None, 0.15),
])  # fmt: skip
def test_widths_that_are_missing_or_of_another_size(export, widths, what, radius):
    result = export(curves([(0, 0, k) for k in range(3)], width=widths))
    assert result.warned() == ({what} if what else set())
    points, _ = outline(Gltf(result.path))
    sides = SIDES[2]
    assert np.linalg.norm(points[:, :2], axis=1).max() == pytest.approx(radius * np.pi / sides / np.sin(np.pi / sides))


def test_curves_that_glow_are_lights_of_their_area(gltf):
    look = """def Material "Neon" { token outputs:surface.connect = </Neon/S.outputs:surface>
        def Shader "S" { uniform token info:id = "UsdPreviewSurface"
            color3f inputs:emissiveColor = (3, 2, 1)
            token outputs:surface } }
    """
    scene = gltf(curves([(0, 0, 0), (0, 0, 1)], more="rel material:binding = </Neon>") + "\n" + look)
    assert scene.nits("/C") == pytest.approx([3, 2, 1])


def test_many_curves_are_refined_less(export, monkeypatch):
    monkeypatch.setattr("usd_gltf.tubes.MOST_FACES", 200)
    rows = [(x, 0, k) for x in range(10) for k in range(4)]
    result = export(curves(rows, [4] * 10, "bezier"))
    assert result.warned() == {"curves that are refined less"}
    assert "level 2 has 320 faces" in result.said() and "level 1 is used" in result.said()
    assert result.report["counts"]["curves"] == 10
    assert PIECES[1] * SIDES[1] * 10 <= 200
