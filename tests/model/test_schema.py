"""What an entry of a model file may be, and what one that is left out is."""

import pytest

from fdi.errors import ModelError
from fdi.model import load_airframe

PLAIN = """format: 1
name: plain
components:
  gps: {}
variables:
  v: {unit: m/s}
  w: {unit: m/s}
parameters:
  most: {value: 5, unit: m/s, log: {name: MOST}}
equations:
  k: v = w
equalities:
  e: v = most
limits:
  l: {variable: v, max: most}
inputs:
  A: {fields: {w: {variable: w}}}
measurements:
  B: {component: gps, fields: {v: {variable: v}}}
"""


def load(folder, *changes):
    text = PLAIN
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = folder / "plain.yaml"
    path.write_text(text, encoding="utf-8")
    return load_airframe(path)


def stated(one, words):
    return {word: getattr(one, word) for word in words.split()}


def test_an_equation_that_says_nothing_more_is_nothing_more(tmp_path):
    found = load(tmp_path)
    assert [one.name for one in found.equations] == ["k", "l", "e"]
    for one in found.equations:
        flags = stated(one, "supports steady always command elapsed")
        assert set(flags.values()) == {False}
        sizes = stated(one, "tolerance window offset")
        assert set(sizes.values()) == {0.0}
        lists = stated(one, "suspects amounts errors swings")
        assert set(lists.values()) == {()}
        assert stated(one, "fault component when") == dict.fromkeys(("fault", "component", "when"))
        assert (one.cost, one.side, one.says) == (1.0, "", "")


@pytest.mark.parametrize("word", ["supports", "steady", "always", "command"])
def test_what_an_equation_says_more_it_is(tmp_path, word):
    changed = load(tmp_path, ("k: v = w", f"k: {{text: v = w, {word}: true}}"))
    assert getattr(changed.equations[0], word) is True


@pytest.mark.parametrize("word", ["always", "command", "elapsed"])
def test_what_a_limit_says_more_it_is(tmp_path, word):
    found = load(tmp_path, ("max: most}", f"max: most, {word}: true}}"))
    (limit,) = (one for one in found.equations if one.name == "l")
    assert getattr(limit, word) is True


@pytest.mark.parametrize(
    ("said", "fault", "component"),
    [
        ("cost: 1", None, None),
        ("fault: stuck", "stuck", "outside_model"),
        ("fault: stuck, component: gps", "stuck", "gps"),
        ("component: gps", None, "gps"),
    ],
)
def test_a_fault_of_nobody_lies_outside_the_model(tmp_path, said, fault, component):
    found = load(tmp_path, ("k: v = w", f"k: {{text: v = w, {said}}}")).equations[0]
    assert (found.fault, found.component) == (fault, component)


def test_components_and_variables_that_say_nothing_more(tmp_path):
    found = load(tmp_path)
    gps = found.components["gps"]
    assert (gps.group, gps.affects, gps.computed, gps.ends_log) == ("other", (), False, False)
    v = found.variables["v"]
    assert (v.low, v.high, v.circular, v.description) == (None, None, False, "")
    changed = load(
        tmp_path,
        ("gps: {}", "gps: {computed: true, ends_log: true, records: true}"),
        ("v: {unit: m/s}", "v: {unit: m/s, domain: [0, 9]}"),
    )
    assert changed.components["gps"].computed
    assert changed.components["gps"].ends_log
    assert changed.components["gps"].records
    assert (changed.variables["v"].low, changed.variables["v"].high) == (0.0, 9.0)


def test_channels_that_say_nothing_more(tmp_path):
    shown, given = load(tmp_path).measurements
    if given.trusted is False:
        shown, given = given, shown
    assert (shown.trusted, given.trusted) == (False, True)
    assert shown.component == "gps"
    for one in (shown, given):
        nothing = stated(one, "accuracy jitter value when reported")
        assert set(nothing.values()) == {None}
        assert set(stated(one, "offset latency latency_accuracy").values()) == {0.0}
        assert set(stated(one, "raw stillness silence").values()) == {False}
        assert (one.stirred, one.made_by, one.late) == ((), "", "")


def test_a_parameter_of_a_log_is_as_it_stands_there(tmp_path):
    (source,) = load(tmp_path).parameters["most"].sources
    assert (source.name, source.scale, source.unset) == ("MOST", 1.0, ())


@pytest.mark.parametrize(
    ("old", "taken", "refused"),
    [
        ("k: v = w", "k: {text: v = w, cost: 0.01}", "k: {text: v = w, cost: 0}"),
        ("k: v = w", f"{'k' * 80}: v = w", f"{'k' * 81}: v = w"),
        ("k: v = w", "k_9: v = w", "9_k: v = w"),
        (
            "k: v = w",
            f"k: {{text: v = w, component: gps, says: {'s' * 70}}}",
            f"k: {{text: v = w, component: gps, says: {'s' * 71}}}",
        ),
        ("k: v = w", "k: {text: v = w, says: it is}", "k: {text: v = w, says: it is.}"),
        ("gps: {}", "gps: {name: Receiver}", "gps: {name: Re_ceiver}"),
        ("gps: {}", "gps: {group: sensor}", "gps: {group: sensors}"),
        ("max: most}", "max: 9}", "most: 9}"),
        ("format: 1", "format: 1", "format: 2"),
    ],
)
def test_an_entry_is_taken_up_to_its_bound_and_refused_beyond(tmp_path, old, taken, refused):
    load(tmp_path, (old, taken))
    with pytest.raises(ModelError):
        load(tmp_path, (old, refused))
