"""Whom a residual concerns, and how every component is tied to it."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.diagnosis.concerns import Tie, affected, concerns
from fdi.model.parts import Component
from tests.diagnosis.build import bank_of, limit_row, model, row

SHOWN = {
    "gps": ["x"],
    "baro": ["x"],
    "estimator": ["y"],
    "camera": ["y"],
    "control": ["z"],
    "sun": ["z"],
    "monitor": ["ratio", "load"],
}
AFFECTS = {"gps": ["estimator"], "wind": ["estimator"], "estimator": ["control"], "control": []}
TEXT = model(
    SHOWN,
    AFFECTS,
    "limits:\n  rejected: {variable: ratio, max: 1, component: estimator, suspects: [gps]}\n"
    "  overload: {variable: load, max: 1, component: estimator}\n",
)
for _name, _group in {"gps": "sensor", "baro": "sensor", "camera": "sensor"}.items():
    TEXT = TEXT.replace(f"{_name}: {{affects", f"{_name}: {{group: {_group}, affects")
BANK = bank_of(TEXT)
WHOM = concerns(BANK)
PAIR, Y, Z = (
    row(BANK, *faults)
    for faults in (("GPS.x", "BARO.x"), ("ESTIMATOR.y", "CAMERA.y"), ("CONTROL.z", "SUN.z"))
)
REJECTED, OVERLOAD = limit_row(BANK, "rejected"), limit_row(BANK, "overload")


@pytest.mark.parametrize(
    ("component", "place", "tie"),
    [
        ("gps", PAIR, Tie.HELD),
        ("baro", PAIR, Tie.HELD),
        ("estimator", PAIR, Tie.NONE),
        ("gps", Y, Tie.NONE),  # it disturbs the estimator, and no more
        ("baro", Y, Tie.NONE),
        ("camera", Y, Tie.HELD),
        ("estimator", Z, Tie.NONE),
        ("control", Y, Tie.NONE),
        ("sun", Z, Tie.HELD),
    ],
)
def test_a_cross_check_is_tied_to_whom_it_holds_and_not_to_who_disturbs_these(
    component, place, tie
):
    assert WHOM.ties(component)[place] == tie


def test_whom_a_statement_is_about_is_named_before_whom_it_only_suspects():
    """The order of the model has the receiver first, and its failure is a guess."""
    assert WHOM.in_order(REJECTED) == ["estimator", "gps"]
    assert WHOM.in_order(PAIR) == ["gps", "baro"]


@pytest.mark.parametrize(
    ("component", "tie"),
    [
        ("estimator", Tie.HELD),  # the statement is about it
        ("gps", Tie.SUSPECTED),  # though it disturbs the estimator as well
        ("monitor", Tie.NONE),  # it merely shows the number
        ("wind", Tie.NONE),  # nor is it about who disturbs the estimator
        ("baro", Tie.NONE),
        ("control", Tie.NONE),
    ],
)
def test_a_statement_is_tied_to_whom_it_names_and_whom_it_suspects(component, tie):
    assert WHOM.ties(component)[REJECTED] == tie


@pytest.mark.parametrize("group", ["sensor", "airframe", "navigation"])
def test_who_disturbs_another_is_not_tied_to_what_is_stated_of_it_whatever_it_is(group):
    bank = bank_of(TEXT.replace("wind: {affects", f"wind: {{group: {group}, affects"))
    assert not concerns(bank).ties("wind").any()


def test_a_component_is_tied_to_a_test_if_and_only_if_that_concerns_it():
    for component in BANK.system.components:
        ties = WHOM.ties(component)
        for place in range(len(BANK.generators)):
            assert (ties[place] > Tie.NONE) == (component in WHOM.of(place))
            assert (ties[place] == Tie.HELD) == (component in WHOM.held_by(place))


def test_a_test_concerns_its_faults_or_whom_it_states_something_of():
    assert WHOM.of(PAIR) == {"gps", "baro"}
    assert WHOM.of(REJECTED) == {"estimator", "gps"}
    assert WHOM.held_by(REJECTED) == {"estimator"}
    assert WHOM.of(OVERLOAD) == WHOM.held_by(OVERLOAD) == {"estimator"}


def test_only_what_is_marked_so_supports():
    more = "equalities:\n  level: {text: x = 0, supports: true, solves: []}\n"
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}, more=more))
    whom = concerns(bank)
    assert whom.supports[row(bank, "GPS.x")]
    assert not whom.supports[row(bank, "GPS.x", "BARO.x")]


@pytest.mark.parametrize(
    ("field", "how", "is_narrow"),
    [
        ("w:over", 'unit: m, value: "noise(w, 5)"', True),
        ("w:still", "unit: s", True),
        ("w:silent", "unit: s", True),
        ("w:over", 'unit: m, value: "change(w, 5)"', False),
        ("w", "unit: m", False),
    ],
)
def test_what_tells_how_a_channel_behaves_tells_of_one_way_to_fail(field, how, is_narrow):
    unit, _, value = how.partition(", ")
    text = model({"gps": ["x"], "baro": ["x"]}, unit=unit.removeprefix("unit: "))
    text = text.replace("variables:\n", f"variables:\n  v: {{{unit}}}\n  b: {{{unit}}}\n")
    text += (
        "equations:\n  of: {text: b = v, solves: [b], fault: gps.way, component: gps}\n"
        "limits:\n  most: {variable: b, max: 1, component: gps}\n"
        f'inputs:\n  RAW:\n    fields:\n      "{field}": {{variable: v, {value}}}\n'
    )
    bank = bank_of(text)
    whom = concerns(bank)
    assert bool(whom.narrow[limit_row(bank, "most")]) == is_narrow
    assert not whom.narrow[row(bank, "GPS.x", "BARO.x")]


def test_the_closest_tie_is_the_largest():
    assert Tie.NONE < Tie.SUSPECTED < Tie.HELD
    assert list(Tie) == [Tie.NONE, Tie.SUSPECTED, Tie.HELD]


def components(chain):
    return {name: Component(name, affects=tuple(to)) for name, to in chain.items()}


def test_affected_reaches_through_others_and_ends_in_a_circle():
    known = components({"a": ["b"], "b": ["c"], "c": ["a", "ghost"], "d": []})
    assert affected("a", known) == {"b", "c", "ghost"}
    assert affected("d", known) == set()
    assert affected("nobody", known) == set()


NODES = "abcdef"
CHAINS = st.fixed_dictionaries({n: st.lists(st.sampled_from(NODES), max_size=3) for n in NODES})


@given(CHAINS)
def test_who_is_affected_is_closed_under_what_these_affect(chain):
    known = components(chain)
    for name in NODES:
        reached = affected(name, known)
        assert set(chain[name]) - {name} <= reached
        for other in reached:
            assert set(chain[other]) - {name} <= reached


@given(CHAINS, st.sampled_from(NODES), st.sampled_from(NODES))
def test_one_more_arrow_never_disturbs_less(chain, start, end):
    more = {**chain, start: [*chain[start], end]}
    for name in NODES:
        assert affected(name, components(chain)) <= affected(name, components(more))
