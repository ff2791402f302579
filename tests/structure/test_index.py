import pytest

from fdi.errors import UsageError
from fdi.structure import Model
from fdi.structure.index import residual_causality, structural_index

from .test_causality import TWO_RATES


def test_a_set_that_is_no_mso_set_is_refused():
    with pytest.raises(UsageError, match="3 equations with 1 unknowns are no MSO set"):
        residual_causality(Model.from_matrix([[1], [1], [1]]), 0b111)
    with pytest.raises(UsageError, match="is not just-determined"):
        residual_causality(Model.from_matrix([[1, 0], [1, 0], [0, 1]]), 0b111)


def test_structural_index_of_a_model_that_is_not_square_or_singular_is_refused():
    with pytest.raises(UsageError, match="3 equations, 2 unknowns, rank 2"):
        structural_index(TWO_RATES)
    with pytest.raises(UsageError, match="2 equations, 2 unknowns, rank 1"):
        structural_index(Model.from_matrix([[1, 0], [1, 0]]))
