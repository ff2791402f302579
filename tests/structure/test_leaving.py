"""What can be left over together, against the greedy choice by ranks."""

from hypothesis import given
from hypothesis import strategies as st

from fdi.structure.decomposition import overdetermined
from fdi.structure.leaving import Leaver

from . import naive
from .models import models


def greedy(model, equations, preferred):
    """Preferred equations that can be taken away one after another without lowering the rank."""
    rest, left = list(equations), []
    full = naive.rank([model.rows[e] for e in rest])
    for equation in preferred:
        without = [e for e in rest if e != equation]
        if naive.rank([model.rows[e] for e in without]) == full:
            rest = without
            left.append(equation)
    return left


@given(models(), st.randoms(use_true_random=False))
def test_leaves_what_greed_by_ranks_leaves_also_when_asked_again(model, random):
    holders = [
        [e for e, row in enumerate(model.rows) if u in row] for u in range(len(model.unknowns))
    ]
    over = overdetermined(model.rows)
    leaver = Leaver(model.rows, holders, over)
    for _ in range(3):
        preferred = list(over)
        random.shuffle(preferred)
        assert leaver.leave(preferred) == greedy(model, over, preferred)
