from hypothesis import given

from fdi.structure import Model, decompose, graph_components
from fdi.structure.decomposition import Part, overdetermined

from . import naive
from .models import models, tried


@given(models())
def test_overdetermined_part_equals_brute_force(model):
    assert set(overdetermined(model.rows)) == naive.overdetermined(model, range(len(model.rows)))


@given(models())
@tried(1000)
def test_parts_and_hall_blocks_equal_brute_force(model):
    found = decompose(model)
    for part, expected in zip(
        (found.over, found.just, found.under), naive.parts(model), strict=True
    ):
        assert (set(part.equations), set(part.unknowns)) == expected
    assert [list(block.equations) for block in found.hall] == naive.hall_blocks(model)


@given(models())
def test_parts_are_disjoint_and_cover_the_model(model):
    parts = decompose(model)
    three = (parts.over, parts.just, parts.under)
    assert sorted(e for p in three for e in p.equations) == list(range(len(model.rows)))
    assert sorted(u for p in three for u in p.unknowns) == list(range(len(model.unknowns)))


@given(models())
def test_rank_is_what_the_sizes_of_the_parts_say(model):
    parts = decompose(model)
    assert parts.rank == naive.rank(list(model.rows))
    assert parts.rank == (
        len(parts.over.unknowns) + len(parts.just.equations) + len(parts.under.equations)
    )
    assert len(parts.just.equations) == len(parts.just.unknowns)


@given(models())
def test_overdetermined_equations_hold_no_other_unknowns(model):
    over = decompose(model).over
    assert {u for e in over.equations for u in model.rows[e]} == set(over.unknowns)


@given(models())
def test_hall_blocks_partition_the_just_determined_part_into_square_systems(model):
    parts = decompose(model)
    assert sorted(e for b in parts.hall for e in b.equations) == list(parts.just.equations)
    assert sorted(u for b in parts.hall for u in b.unknowns) == list(parts.just.unknowns)
    inside = set(parts.just.unknowns)
    for block in parts.hall:
        rows = [tuple(set(model.rows[e]) & inside) for e in block.equations]
        assert len(block.equations) == len(block.unknowns) == naive.rank(rows)


def test_hall_blocks_are_the_smallest_square_systems():
    model = Model.from_matrix([[1, 1, 0], [1, 1, 1], [0, 0, 1]])
    assert decompose(model).hall == (Part((0, 1), (0, 1)), Part((2,), (2,)))


def test_equation_without_unknowns_is_overdetermined_and_its_own_graph_component():
    model = Model(("e", "f", "g"), ("x", "unused"), ((), (0,), (0,)))
    parts = decompose(model)
    assert parts.over == Part((0, 1, 2), (0,))
    assert parts.under == Part((), (1,))
    assert graph_components(model) == (Part((0,), ()), Part((1, 2), (0,)))


def test_empty_model_has_empty_parts():
    parts = decompose(Model((), (), ()))
    assert parts.over == parts.just == parts.under == Part((), ())
    assert (parts.hall, parts.rank, parts.redundancy) == ((), 0, 0)
    assert graph_components(Model((), (), ())) == ()


@given(models())
def test_graph_components_share_no_unknown_and_cannot_be_split(model):
    parts = graph_components(model, range(len(model.rows)))
    unknowns = [u for part in parts for u in part.unknowns]
    assert len(unknowns) == len(set(unknowns))
    assert sorted(e for part in parts for e in part.equations) == list(range(len(model.rows)))
    for part in parts:
        grown = {part.equations[0]}
        for _ in part.equations:
            held = {u for e in grown for u in model.rows[e]}
            grown |= {e for e in part.equations if held & set(model.rows[e])}
        assert grown == set(part.equations)
