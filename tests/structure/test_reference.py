"""The 50 shared reference models: everything that the room computes, against the toolbox of record.

Source: shared/structural (faultdiagnosistoolbox 0.12.5 and independent programs). Models with more
than 30,000 sets run under the marker `soak`.
"""

import hashlib
import json

import pytest

from fdi.structure import (
    bitset,
    classes,
    decompose,
    detectable,
    isolability,
    load_reference,
    members,
    mso_sets,
    mtes_sets,
    place_sensors,
)
from fdi.structure.index import (
    is_low_index,
    is_observable,
    residual_causality,
    structural_index,
)
from fdi.structure.isolability import double_isolability

from .models import REFERENCE, needs_shared

pytestmark = needs_shared

QUICK = 30_000


def reference_of(path):
    return json.loads(path.read_text(encoding="utf-8"))["reference"]


def lists(part):
    return [list(part.equations), list(part.unknowns)]


def names(paths):
    return [path.stem for path in paths]


each_model = pytest.mark.parametrize("path", REFERENCE, ids=names(REFERENCE))


def cases(kind):
    counts = ((path, reference_of(path).get(kind, {}).get("count")) for path in REFERENCE)
    return [
        pytest.param(path, id=path.stem, marks=[pytest.mark.soak] if count > QUICK else [])
        for path, count in counts
        if count is not None
    ]


@each_model
def test_parts_and_hall_blocks_equal_the_reference(path):
    expected, parts = reference_of(path), decompose(load_reference(path))
    for name in ("over", "just", "under"):
        assert lists(getattr(parts, name)) == expected["dm"][name]
    assert [lists(block) for block in parts.hall] == expected["dm"]["hall"]
    assert (parts.rank, parts.redundancy) == (expected["rank"], expected["redundancy"])


@each_model
def test_classes_equal_the_reference(path):
    expected, found = reference_of(path)["classes"], classes(load_reference(path))
    assert [lists(part) for part in found.sets] == expected["sets"]
    assert list(found.free) == expected["free"]


@pytest.mark.parametrize(
    ("causality", "key"), [("mixed", "mixed"), ("integral", "int"), ("derivative", "der")]
)
@each_model
def test_detectability_and_isolability_equal_the_reference(path, causality, key):
    expected, model = reference_of(path), load_reference(path)
    if "detectable" in expected:
        found = detectable(model, causality).nonzero()[0].tolist()
        assert found == expected["detectable"][key]
    if "isolable" in expected:
        rows = ["".join("01"[int(x)] for x in row) for row in isolability(model, causality)]
        assert rows == expected["isolable"][key]["rows"]


@pytest.mark.parametrize("path", REFERENCE, ids=names(REFERENCE))
def test_double_isolability_equals_the_reference(path):
    extras = json.loads((path.parents[1] / "extras.json").read_text(encoding="utf-8"))
    expected = extras.get(path.stem, {}).get("double")
    if expected is None:
        pytest.skip("no reference of double faults for this model")
    found = double_isolability(load_reference(path))
    for pair, text in expected.items():
        j, k = map(int, pair.split(","))
        assert "".join("01"[int(x)] for x in found[:, j, k]) == text
        assert (found[:, k, j] == found[:, j, k]).all()


def assert_sets_equal(model, found, expected, sets_of_classes):
    assert len(found) == expected["count"]
    indices = sorted(members(bits) for bits in found)
    text = "\n".join(",".join(map(str, line)) for line in indices)
    assert hashlib.sha256(text.encode()).hexdigest() == expected["sha256"]
    if "masks" in expected:
        unions = [
            sorted(e for k in members(int(mask, 16)) for e in sets_of_classes[k][0])
            for mask in expected["masks"]
        ]
        assert [list(line) for line in indices] == unions


@pytest.mark.parametrize("path", cases("mso"))
def test_mso_sets_equal_the_reference(path):
    expected, model = reference_of(path), load_reference(path)
    found = list(mso_sets(model))
    assert_sets_equal(model, found, expected["mso"], expected["classes"]["sets"])


@pytest.mark.parametrize("path", cases("mtes"))
def test_mtes_equal_the_reference(path):
    expected, model = reference_of(path), load_reference(path)
    found = list(mtes_sets(model))
    assert_sets_equal(model, found, expected["mtes"], expected["classes"]["sets"])


def strings(kind, key):
    """The models whose sets have one stored string or character each."""
    return [
        pytest.param(path, kind, id=f"{path.stem}-{kind}")
        for path in REFERENCE
        if key in reference_of(path).get(kind, {})
    ]


def sets_of(expected, kind):
    classes_of = [bitset(equations) for equations, _ in expected["classes"]["sets"]]
    for mask in expected[kind]["masks"]:
        yield sum(classes_of[k] for k in members(int(mask, 16)))


@pytest.mark.parametrize(
    ("path", "kind"), [*strings("mso", "low_index"), *strings("mtes", "low_index")]
)
def test_low_index_and_observability_of_sets_equal_the_reference(path, kind):
    expected, model = reference_of(path), load_reference(path)
    sets = list(sets_of(expected, kind))
    assert "".join("01"[is_low_index(model, bits)] for bits in sets) == expected[kind]["low_index"]
    found = "".join("01"[is_observable(model, bits)] for bits in sets)
    assert found == expected[kind]["observable"]


@pytest.mark.parametrize(("path", "kind"), strings("mso", "causality"))
def test_causality_of_residuals_equals_the_reference(path, kind):
    expected, model = reference_of(path), load_reference(path)
    found = [residual_causality(model, bits) for bits in sets_of(expected, kind)]
    assert found == expected[kind]["causality"]


@each_model
def test_low_index_and_structural_index_of_models_equal_the_reference(path):
    expected, model = reference_of(path), load_reference(path)
    if "low_index" in expected:
        assert is_low_index(model) == expected["low_index"]
    if "pantelides" in expected:
        index = expected["pantelides"]["index"]
        assert structural_index(model) == (index, tuple(expected["pantelides"]["nu"]))


@pytest.mark.parametrize("goal", ["detectability", "isolability"])
@pytest.mark.parametrize(
    "path", [pytest.param(p, id=p.stem) for p in REFERENCE if "sensors" in reference_of(p)]
)
def test_sensor_sets_equal_the_reference(path, goal):
    expected, model = reference_of(path)["sensors"], load_reference(path)
    found = place_sensors(model, expected["candidates"], goal=goal)
    known, size = expected[goal]["sets"], expected[goal]["exhaustive_to_size"]
    assert sorted(list(s) for s in found if len(s) <= size) == sorted(known)
