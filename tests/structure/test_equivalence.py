from hypothesis import given

from fdi.structure import Model, classes

from . import naive
from .models import models, tried


@given(models(max_equations=9, max_unknowns=7))
@tried(1000)
def test_classes_equal_brute_force(model):
    assert [list(part.equations) for part in classes(model).sets] == naive.classes(model)


@given(models())
def test_a_class_has_one_equation_more_than_unknowns_of_its_own(model):
    found = classes(model)
    assert all(part.redundancy == 1 for part in found.sets)
    inner = [u for part in found.sets for u in part.unknowns]
    held = {u for part in found.sets for e in part.equations for u in model.rows[e]}
    assert sorted([*inner, *found.free]) == sorted(held)


def test_equations_that_only_close_a_loop_are_classes_of_their_own():
    """Neither of the two matched equations dominates the other: each reaches both sources."""
    model = Model.from_matrix([[1, 0], [0, 1], [1, 1], [1, 1]])
    assert [part.equations for part in classes(model).sets] == [(0,), (1,), (2,), (3,)]


def test_long_chain_is_one_class_without_recursion():
    n = 3000
    rows = ((0,), *((i, i + 1) for i in range(n - 1)), (n - 1,))
    model = Model(tuple(f"e{i}" for i in range(n + 1)), tuple(f"x{i}" for i in range(n)), rows)
    assert [len(part.equations) for part in classes(model).sets] == [n + 1]
