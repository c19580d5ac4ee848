"""PointInstancers over time: who is who without ids, and how many matrices there may be."""

import numpy as np
import pytest
from conftest import Gltf
from test_vanishing import is_there, particles, sampled
from usd_gltf import instancers


def moving(counts, ids=None, name="I"):
    """An instancer of `counts` instances at each time code; number `i` is at (i, code, 0)."""
    rows = {code: ", ".join(f"({i}, {code}, 0)" for i in range(count)) for code, count in counts.items()}
    attributes = [sampled("int[] protoIndices", {code: [0] * count for code, count in counts.items()}),
                  sampled("point3f[] positions", {code: f"[{row}]" for code, row in rows.items()})]  # fmt: skip
    if ids is not None:
        attributes.append(sampled("int64[] ids", ids))
    return particles(*attributes).replace("/I/", f"/{name}/").replace('"I"', f'"{name}"')


@pytest.mark.parametrize("broken", ["[7, 7]", "[7]", "[7, 3, 5]"])
def test_ids_that_are_one_for_each_at_some_times_only_are_none_at_all(export, broken):
    result = export(moving({1: 2, 6: 2}, {1: "[7, 3]", 3: broken, 5: "[3, 7]"}))
    assert result.warned() == {"ids that are not one for each instance"} and "at frame 3, and elsewhere they are" in result.said()
    scene = Gltf(result.path)
    for number in (0, 1):
        assert is_there(scene, number) == [True] * 6
        assert scene.world(f"/I[{number}]/C", 5 / 24)[:3, 3] == pytest.approx([number, 6, 0])
    assert not any("_seen" in node["name"] for node in scene.nodes)


def test_ids_that_never_are_one_for_each_are_none(export):
    result = export(moving({1: 2, 6: 2}, {1: "[7, 7]", 3: "[3]"}), "--strict")
    assert result.code == 0, result.err
    assert is_there(Gltf(result.path), 1) == [True] * 6


def test_an_instancer_that_is_away_for_a_while_keeps_its_ids(export):
    result = export(moving({1: 2, 3: 0, 5: 2}, {1: "[7, 3]", 3: "[]", 5: "[3, 7]"}), "--strict")
    assert result.code == 0, result.err
    scene = Gltf(result.path)
    assert is_there(scene, 7) == is_there(scene, 3) == [True, True, False, False, True, True]


@pytest.mark.parametrize(("counts", "ids"), [
    ({1: 2, 6: 2}, None),  # the same at all times
    ({1: 2, 4: 1}, None),  # one that vanishes
    ({code: 1 for code in range(1, 7)}, {code: f"[{code}]" for code in range(1, 7)}),  # always another
])  # fmt: skip
def test_matrices_over_time_are_bounded(export, monkeypatch, counts, ids):
    identities = len({i for row in ids.values() for i in row}) - 2 if ids else 2
    places = 6 * identities
    text = moving(counts, ids)
    monkeypatch.setattr(instancers, "MOST_PLACES", places)
    assert export(text, "--strict").code == 0
    monkeypatch.setattr(instancers, "MOST_PLACES", places - 1)
    result = export(text, out="bounded.glb")
    assert result.code == 0, result.err
    assert result.warned("animation") == {"PointInstancer too large over time"}
    assert "/I" in result.report_path.read_text() and "Export fewer frames" in result.said()
    scene = Gltf(result.path)
    first = [path for path in scene.by_path if path.startswith("/I[") and path.endswith("]/C")]
    assert len(first) == counts[1]
    assert all(np.array_equal(scene.world(path, 0.2), scene.world(path, 0)) for path in first)


def test_matrices_of_a_stage_are_bounded(export, monkeypatch):
    text = moving({1: 2, 6: 2}) + "\ndef " + moving({1: 1, 6: 1}, name="J").partition("def ")[2]
    monkeypatch.setattr(instancers.Room.__init__, "__defaults__", (15,))
    result = export(text, out="bounded.glb")
    # The first takes 12 of them; 3 are not enough for the second.
    assert result.code == 0, result.err
    assert [line["path"] for line in result.report["warnings"]] == ["/J"]
    monkeypatch.setattr(instancers.Room.__init__, "__defaults__", (18,))
    assert export(text, "--strict").code == 0
