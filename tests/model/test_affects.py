"""Who disturbs whom in the shipped models: a direction that says something."""

import pytest

from fdi.diagnosis.concerns import affected
from fdi.model import load_airframe, shipped_models

MOST = 0.3
"""Share of the ordered pairs: were everything disturbed by everything, ``affects`` said nothing."""


@pytest.fixture(params=shipped_models())
def components(request):
    return load_airframe(request.param).components


def test_nobody_disturbs_himself_through_others(components):
    for name, component in components.items():
        for first in component.affects:
            assert name not in {first, *affected(first, components)}, (name, first)


def test_whom_a_component_disturbs_is_a_component_of_some_model(components):
    """A file that several models share names what not each of them has."""
    known = {name for model in shipped_models() for name in load_airframe(model).components}
    for name, component in components.items():
        assert set(component.affects) <= known, name


def test_most_pairs_do_not_disturb_each_other(components):
    pairs = sum(len(affected(name, components) & set(components)) for name in components)
    assert 0 < pairs < MOST * len(components) * (len(components) - 1)
