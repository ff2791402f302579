"""The stage weighs by chosen weights here: what these tests say must not depend on a fit."""

import pytest

from fdi.diagnosis import answer

from .build import WEIGHTS


@pytest.fixture(autouse=True)
def _chosen_weights(monkeypatch):
    monkeypatch.setattr(answer, "load_fitted", lambda: WEIGHTS)
