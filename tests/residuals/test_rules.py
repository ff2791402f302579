"""Which matchings are valid, against every matching of small systems."""

import math
from dataclasses import replace

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi import structure
from fdi.model.expression import Apply, Symbol, parse
from fdi.model.parts import Kind, Measurement
from fdi.model.system import SystemEquation
from fdi.residuals.rules import (
    NoMatching,
    Reason,
    _is_explicit,
    best_matchings,
    cheapest_matching,
    choices_of,
    matchings,
    noise_gain,
)
from fdi.structure.loops import strong_components
from fdi.structure.sequence import Order
from fdi.telemetry import Channel

from . import naive


def equation(number, edges, cost=1.0, fault=True):
    left, right = Symbol("q"), Symbol("p")
    names = {kind: name for name, kind in edges.items()}
    if "derivative" in names:
        left, right = Symbol(names["derivative"]), Apply("der", (Symbol(names["integral"]),))
    return SystemEquation(
        f"e{number}",
        Kind.RELATION,
        left,
        right,
        edges,
        cost=cost,
        fault=f"f{number}" if fault else None,
    )


@st.composite
def overdetermined_sets(draw):
    """A minimally overdetermined set of a random system."""
    names = [f"x{i}" for i in range(draw(st.integers(1, 4)))]
    equations = []
    for number in range(draw(st.integers(len(names) + 1, len(names) + 2))):
        if len(names) > 1 and draw(st.integers(0, 3)) == 0:
            pair = draw(st.permutations(names))[:2]
            edges = {pair[0]: "derivative", pair[1]: "integral"}
        else:
            held = draw(st.lists(st.sampled_from(names), min_size=1, max_size=3, unique=True))
            edges = {
                name: draw(st.sampled_from(["solvable", "solvable", "fixed"])) for name in held
            }
        equations.append(equation(number, edges, draw(st.sampled_from([1.0, 1.0, 2.5]))))
    unknowns = sorted({name for e in equations for name in e.edges})
    model = structure.Model(
        tuple(e.name for e in equations),
        tuple(unknowns),
        tuple(tuple(sorted(unknowns.index(name) for name in e.edges)) for e in equations),
        tuple(structure.Fault(f"f{i}", (i,)) for i in range(len(equations))),
    )
    sets = list(structure.mso_sets(model))
    if not sets:
        return None
    return [equations[i] for i in structure.members(draw(st.sampled_from(sets)))]


@given(overdetermined_sets())
@settings(max_examples=300, deadline=None)
def test_cheapest_matching_is_that_of_brute_force_over_the_published_rules(equations):
    if equations is None:
        return
    valid = [pairs for pairs in naive.matchings(equations) if naive.is_valid(equations, pairs)]
    choices = choices_of(equations)
    found = cheapest_matching(choices, range(len(equations)))
    if not valid:
        assert isinstance(found, NoMatching)
        assert found.reason
        return
    assert isinstance(found, Order)
    solved = choices.solved(found)
    assert naive.is_valid(equations, solved)
    plain = [pairs for pairs in valid if naive.is_restricted(equations, pairs)]
    assert found.restricted == bool(plain) == naive.is_restricted(equations, solved)
    assert found.cost == min(naive.cost(equations, pairs) for pairs in plain or valid)


@given(overdetermined_sets())
@settings(max_examples=100, deadline=None)
def test_everything_is_known_when_it_is_needed(equations):
    choices = choices_of(equations or [])
    found = cheapest_matching(choices, range(len(equations or ())))
    if isinstance(found, NoMatching):
        return
    solved = choices.solved(found)
    known = set()
    for block in found.blocks:
        own = {solved[i] for i, _ in block}
        assert all(set(equations[i].edges) <= known | own for i, _ in block)
        known |= own
    assert set(equations[found.residual].edges) <= known
    assert found.residual not in solved


def test_a_set_without_an_equation_to_spare_has_no_matching():
    assert isinstance(
        cheapest_matching(choices_of([equation(0, {"x": "solvable"})]), [0]), NoMatching
    )


def test_of_two_equations_to_spare_a_fault_is_among_those_used():
    """As for {l17, e5, s41}: two limits without a fault on one measured variable."""
    equations = [
        equation(0, {"x": "solvable"}, fault=False),
        equation(1, {"x": "solvable"}, fault=False),
        equation(2, {"x": "solvable"}),
    ]
    choices = choices_of(equations)
    found = cheapest_matching(choices, range(3))
    solved = choices.solved(found)
    assert 2 in {found.residual, *solved}
    assert len(solved) == 1


def test_a_large_set_takes_no_search():
    """A chain of forty unknowns, each in three equations, had more matchings than can be tried."""
    size = 40
    equations = [
        equation(i, {f"x{j % size}": "solvable" for j in (i, i + 1, i + 2)})
        for i in range(size + 1)
    ]
    assert isinstance(cheapest_matching(choices_of(equations), range(size + 1)), Order)


def test_reason_names_the_equation_and_the_unknown():
    equations = [equation(0, {"x": "fixed"}), equation(1, {"x": "fixed"})]
    found = cheapest_matching(choices_of(equations), [0, 1])
    assert found.reason is Reason.NOT_INVERTIBLE
    assert found.text == "e1 would have to be solved, which it cannot be, for x"


@given(overdetermined_sets(), st.integers(1, 4))
@settings(max_examples=200, deadline=None)
def test_k_best_matchings_are_the_best_of_all_choices(equations, k):
    if equations is None:
        return
    choices = choices_of(equations)
    numbers = range(len(equations))
    every = [m for m in matchings(choices, numbers) if isinstance(m, Order)]
    valid = [pairs for pairs in naive.matchings(equations) if naive.is_valid(equations, pairs)]
    assert {m.residual for m in every} == {min(set(numbers) - set(pairs)) for pairs in valid}
    found = best_matchings(choices, numbers, k)
    if not every:
        assert isinstance(found, NoMatching)
        return

    def key(matching):
        gain = noise_gain(choices, matching)
        return not matching.restricted, matching.cost, matching.loops, gain

    assert list(map(key, found)) == sorted(map(key, every))[:k]
    assert len({m.residual for m in found}) == len(found)


@given(overdetermined_sets())
@settings(max_examples=200, deadline=None)
def test_cheapest_matching_is_the_first_of_the_best_but_for_loops_and_noise(equations):
    if equations is None:
        return
    choices = choices_of(equations)
    cheapest = cheapest_matching(choices, range(len(equations)))
    best = best_matchings(choices, range(len(equations)), 1)
    if isinstance(cheapest, NoMatching):
        assert best == cheapest
    else:
        assert (best[0].restricted, best[0].cost) == (cheapest.restricted, cheapest.cost)


def measured(number, name):
    """A measurement equation, which alone brings noise."""
    channel = Channel.parse(f"M.{name}{number}")
    shown = Measurement(channel=channel, variable=name, component="c", group="g")
    return replace(equation(number, {name: "solvable"}), measurement=shown)


def relation(number, left, right, edges):
    return replace(equation(number, edges), left=parse(left), right=parse(right))


def test_noise_gain_of_two_sensors_of_one_variable_is_the_root_of_two():
    choices = choices_of([measured(0, "x"), measured(1, "x")])
    (found,) = best_matchings(choices, [0, 1], 1)
    assert noise_gain(choices, found) == pytest.approx(math.sqrt(2))


def test_what_one_channel_contributes_on_two_ways_adds_up():
    """z = x + y with y = 2*x: the noise of x reaches z twice."""
    edges = {"x": "solvable", "y": "solvable"}
    equations = [
        measured(0, "x"),
        relation(1, "y", "2*x", edges),
        relation(2, "z", "x + y", {**edges, "z": "solvable"}),
        measured(3, "z"),
    ]
    choices = choices_of(equations)
    found = next(m for m in matchings(choices, range(4)) if m.residual == 3)
    assert noise_gain(choices, found) == pytest.approx(math.sqrt(2**2 + 1))


def test_the_matching_that_computes_forwards_comes_first():
    """y = x**3 is solved for y, not for x, although both are possible at the same cost."""
    equations = [
        measured(0, "x"),
        relation(1, "y", "x**3", {"x": "solvable", "y": "solvable"}),
        relation(2, "z", "y - x", {"x": "fixed", "y": "fixed", "z": "solvable"}),
        measured(3, "y"),
        measured(4, "z"),
    ]
    choices = choices_of(equations)
    found = best_matchings(choices, [0, 1, 3], 3)
    gains = [noise_gain(choices, matching) for matching in found]
    assert gains == sorted(gains)
    assert found[-1].residual == 0
    assert gains[-1] > gains[0]


@pytest.mark.parametrize(
    ("equations", "reason"),
    [
        ([equation(0, {"x": "solvable"})], Reason.NO_REDUNDANCY),
        ([equation(i, {"x": "fixed"}) for i in range(2)], Reason.NOT_INVERTIBLE),
        ([equation(i, {"x": "solvable"}, fault=False) for i in range(2)], Reason.NO_FAULT),
        (
            [
                equation(0, {"v": "derivative", "p": "integral"}),
                equation(1, {"v": "solvable"}),
                equation(2, {"p": "fixed"}),
            ],
            Reason.INTEGRATION,
        ),
        (
            [
                equation(0, {"v": "derivative", "p": "integral"}),
                equation(1, {"v": "solvable", "p": "solvable"}),
                equation(2, {"p": "fixed"}),
            ],
            Reason.DYNAMIC_LOOP,
        ),
    ],
)
def test_reason_is_one_of_a_list(equations, reason):
    choices, numbers = choices_of(equations), range(len(equations))
    assert isinstance(best_matchings(choices, numbers, 3), NoMatching)
    found = list(matchings(choices, numbers))
    assert reason in {blocked.reason for blocked in found}
    assert all(blocked.text for blocked in found)


@given(
    st.integers(1, 8).flatmap(
        lambda n: st.tuples(
            st.just(n),
            st.lists(st.tuples(st.integers(0, n - 1), st.integers(0, n - 1)), max_size=20),
        )
    )
)
def test_strong_components_are_those_of_networkx_in_topological_order(case):
    n, edges = case
    graph = nx.DiGraph(edges)
    graph.add_nodes_from(range(n))
    parts = strong_components(range(n), {i: sorted(graph.successors(i)) for i in range(n)})
    expected = {frozenset(part) for part in nx.strongly_connected_components(graph)}
    assert {frozenset(part) for part in parts} == expected
    place = {node: i for i, part in enumerate(parts) for node in part}
    assert all(place[a] <= place[b] for a, b in graph.edges)


@pytest.mark.parametrize("size", [20_000])
def test_a_long_chain_needs_no_recursion(size):
    arrows = {i: [i + 1] for i in range(size)} | {size: []}
    assert len(strong_components(range(size + 1), arrows)) == size + 1


@pytest.mark.parametrize(
    ("left", "right", "explicit"),
    [
        ("x", "y + 1", True),
        ("y + 1", "x", True),
        ("x", "x**2 - y", False),
        ("x**2 - y", "x", False),
        ("2*x", "y", False),
        ("v", "der(x)", True),
    ],
)
def test_an_equation_is_explicit_that_says_what_a_variable_is(left, right, explicit):
    own = SystemEquation("e", Kind.RELATION, parse(left), parse(right), {})
    assert _is_explicit(own, "x") == explicit
    assert _is_explicit(measured(0, "x"), "x")
