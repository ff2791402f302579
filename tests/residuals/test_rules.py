"""Which matchings are valid, against every matching of small systems."""

import networkx as nx
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fdi import structure
from fdi.model.expression import Apply, Symbol
from fdi.model.parts import Kind
from fdi.model.system import SystemEquation
from fdi.residuals.rules import NoMatching, ValidMatching, cheapest_matching
from fdi.structure.loops import strong_components

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
    found = cheapest_matching(range(len(equations)), equations)
    if not valid:
        assert isinstance(found, NoMatching)
        assert found.reason
        return
    assert isinstance(found, ValidMatching)
    assert naive.is_valid(equations, dict(found.pairs))
    plain = [pairs for pairs in valid if naive.is_restricted(equations, pairs)]
    assert found.restricted == bool(plain) == naive.is_restricted(equations, dict(found.pairs))
    assert found.cost == min(naive.cost(equations, pairs) for pairs in plain or valid)


@given(overdetermined_sets())
@settings(max_examples=100, deadline=None)
def test_everything_is_known_when_it_is_needed(equations):
    found = cheapest_matching(range(len(equations or ())), equations or [])
    if isinstance(found, NoMatching):
        return
    solved = dict(found.pairs)
    known = set()
    for block in found.blocks:
        own = {solved[i] for i in block}
        assert all(set(equations[i].edges) <= known | own for i in block)
        known |= own
    assert set(equations[found.residual].edges) <= known
    assert found.residual not in solved


def test_a_set_without_an_equation_to_spare_has_no_matching():
    assert isinstance(cheapest_matching([0], [equation(0, {"x": "solvable"})]), NoMatching)


def test_of_two_equations_to_spare_a_fault_is_among_those_used():
    """As for {l17, e5, s41}: two limits without a fault on one measured variable."""
    equations = [
        equation(0, {"x": "solvable"}, fault=False),
        equation(1, {"x": "solvable"}, fault=False),
        equation(2, {"x": "solvable"}),
    ]
    found = cheapest_matching(range(3), equations)
    assert 2 in {found.residual, *dict(found.pairs)}
    assert len(found.pairs) == 1


def test_a_large_set_takes_no_search():
    """A chain of forty unknowns, each in three equations, had more matchings than can be tried."""
    size = 40
    equations = [
        equation(i, {f"x{j % size}": "solvable" for j in (i, i + 1, i + 2)})
        for i in range(size + 1)
    ]
    assert isinstance(cheapest_matching(range(size + 1), equations), ValidMatching)


def test_reason_names_the_equation_and_the_unknown():
    equations = [equation(0, {"x": "fixed"}), equation(1, {"x": "fixed"})]
    reason = cheapest_matching([0, 1], equations).reason
    assert reason == "e1 would have to be solved, which it cannot be, for x"


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
