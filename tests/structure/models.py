"""Models for the tests: random small ones, the shared reference models, the published ones."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import settings
from hypothesis import strategies as st

from fdi.structure import Fault, Model

SHARED = Path(__file__).parents[2].parent / "shared"
REFERENCE = sorted((SHARED / "structural" / "models").glob("*.json"))
needs_shared = pytest.mark.skipif(not REFERENCE, reason="the shared reference data are not here")


def tried(n):
    """Settings for n examples, or those of the profile if they are more (see tests/conftest.py)."""
    return settings(max_examples=max(n, settings.default.max_examples), deadline=None)


@st.composite
def models(draw, max_equations=7, max_unknowns=5):
    """A model with empty rows, unused unknowns, and faults in one to three equations."""
    m = draw(st.integers(0, max_equations))
    n = draw(st.integers(0, max_unknowns))
    row = st.lists(st.integers(0, n - 1), max_size=3) if n else st.just([])
    rows = draw(st.lists(row, min_size=m, max_size=m))
    where = st.lists(st.integers(0, max(m - 1, 0)), min_size=1, max_size=3)
    faults = draw(st.lists(where, max_size=4 if m else 0))
    return Model(
        tuple(f"e{i}" for i in range(m)),
        tuple(f"x{i}" for i in range(n)),
        tuple(tuple(row) for row in rows),
        tuple(Fault(f"f{i}", tuple(equations)) for i, equations in enumerate(faults)),
    )


@st.composite
def dynamic_models(draw, max_equations=4, max_states=2, max_others=2):
    """A model with a constraint for each state, further equations, and at most 3 faults."""
    n_states, n_others = draw(st.integers(1, max_states)), draw(st.integers(0, max_others))
    n = 2 * n_states + n_others  # x0, dx0, x1, dx1, ..., others
    row = st.lists(st.integers(0, n - 1), min_size=1, max_size=3)
    rows = [(2 * k, 2 * k + 1) for k in range(n_states)]
    rows += draw(st.lists(row, min_size=1, max_size=max_equations))
    where = st.lists(st.integers(0, len(rows) - 1), min_size=1, max_size=2)
    faults = draw(st.lists(where, max_size=3))
    return Model(
        tuple(f"e{i}" for i in range(len(rows))),
        tuple(f"x{i}" for i in range(n)),
        tuple(map(tuple, rows)),
        tuple(Fault(f"f{i}", tuple(equations)) for i, equations in enumerate(faults)),
        tuple(edge for k in range(n_states) for edge in ((k, 2 * k, "i"), (k, 2 * k + 1, "d"))),
    )


def dense(m, n, width=4):
    """A model of redundancy m - n without structure to speak of."""
    rows = tuple(tuple((i * 7 + j * j * (1 + i % 3)) % n for j in range(width)) for i in range(m))
    faults = tuple(Fault(f"f{i}", (i,)) for i in range(0, m, 2))
    return Model(tuple(f"e{i}" for i in range(m)), tuple(f"x{i}" for i in range(n)), rows, faults)


def paper_model(faults):
    """The published MAVLink model with 77 or 79 faults."""
    path = SHARED / "paper" / f"model_{faults}.json"
    data = json.loads(path.read_text(encoding="utf-8"))
    place = {name: i for i, name in enumerate(data["unknowns"])}
    return Model(
        tuple(equation["label"] for equation in data["equations"]),
        tuple(data["unknowns"]),
        tuple(tuple(place[u] for u in equation["unknowns"]) for equation in data["equations"]),
        tuple(
            Fault(equation["fault"], (i,))
            for i, equation in enumerate(data["equations"])
            if equation["fault"]
        ),
        name=data["model"],
    )


@st.composite
def ruled_models(draw):
    """A model with entries along which equations cannot be solved, and differential constraints."""
    n = draw(st.integers(1, 4))
    unknowns = st.integers(0, n - 1)
    rows, nonsolvable, derivative = [], [], []
    for equation in range(draw(st.integers(1, n + 3))):
        if n > 1 and draw(st.integers(0, 4)) == 0:
            state, slope = draw(st.lists(unknowns, min_size=2, max_size=2, unique=True))
            rows.append((state, slope))
            derivative += [(equation, state, "i"), (equation, slope, "d")]
        else:
            row = draw(st.lists(unknowns, min_size=1, max_size=3, unique=True))
            rows.append(tuple(row))
            nonsolvable += [(equation, u) for u in row if draw(st.integers(0, 3)) == 0]
    where = st.lists(st.integers(0, len(rows) - 1), min_size=1, max_size=2)
    faults = draw(st.lists(where, min_size=1, max_size=5))
    return Model(
        tuple(f"e{i}" for i in range(len(rows))),
        tuple(f"x{i}" for i in range(n)),
        tuple(rows),
        tuple(Fault(f"f{i}", tuple(equations)) for i, equations in enumerate(faults)),
        tuple(derivative),
        tuple(nonsolvable),
    )
