"""The labels file: what it may say, and what is said about one that is wrong."""

import json

import pytest

from fdi.errors import ModelError, UsageError
from fdi.evaluation import load_labels, select


def write(folder, tree):
    path = folder / "labels.json"
    path.write_text(tree if isinstance(tree, str) else json.dumps(tree))
    return path


FLIGHT = {"vehicle": "quad", "faults": [{"component": "gps", "kind": "ramp", "onset": 3}]}


def test_a_label_is_read_with_its_defaults(tmp_path):
    (one,) = load_labels(write(tmp_path, {"flights": {"x/a.tlog": {**FLIGHT, "more": 1}}}))
    assert one.path == tmp_path / "x" / "a.tlog"
    assert one.use == "diagnosis"
    assert one.onset == 3.0
    assert one.faults[0].is_slow


@pytest.mark.parametrize(
    "tree",
    [
        "{",
        "[" * 100_000,
        {},
        {"flights": {"a": {}}},
        {"flights": {"a": {**FLIGHT, "use": "guess"}}},
        {"flights": {"a": {**FLIGHT, "faults": [{"component": "gps"}]}}},
        '{"flights": {"a": {"vehicle": "quad", "faults": [], "evaluate_until": NaN}}}',
    ],
)
def test_what_a_label_cannot_say_is_one_error(tmp_path, tree):
    with pytest.raises(ModelError) as error:
        load_labels(write(tmp_path, tree))
    assert "\n" not in str(error.value)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ModelError, match=r"no\.json"):
        load_labels(tmp_path / "no.json")


def test_patterns_select_and_one_that_selects_nothing_is_a_mistake(tmp_path):
    tree = {"flights": {"a/x.tlog": FLIGHT, "b/y.tlog": FLIGHT}}
    labels = load_labels(write(tmp_path, tree))
    assert [one.key for one in select(labels, ["b/*"])] == ["b/y.tlog"]
    with pytest.raises(UsageError, match="c/"):
        select(labels, ["c/*"])
