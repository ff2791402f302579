"""Tells which faults can be detected, and which can be told from which others.

In: a model, or the signatures of a bank of tests. Out: boolean arrays over the faults. From the
model no set is enumerated: fault f is isolable from g when an equation of f stays overdetermined
after the equations of g are removed; in mixed causality that is class membership. Integral and
derivative causality ask whether differential constraints can be used that way, no more.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fdi.errors import UsageError
from fdi.structure.causality import causally_overdetermined
from fdi.structure.incidence import Model
from fdi.structure.losses import causal_classes

Mask = NDArray[np.bool_]


def detectable(model: Model, causality: str = "mixed") -> Mask:
    """Return which faults a test can react to.

    Parameters
    ----------
    model : Model
    causality : {"mixed", "integral", "derivative"}
        How differential constraints may be used, see
        :func:`fdi.structure.causality.causally_overdetermined`.

    Returns
    -------
    (n_f,) bool array
        True where an equation of the fault lies in the overdetermined part.

    Raises
    ------
    UsageError
        When the causality is none of the three.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, definition 2; for the causalities Frisk,
    Bregon, Åslund, Krysander, Pulido, Biswas, IEEE Trans. SMC-A 42(5), 2012.

    Examples
    --------
    >>> detectable(Model.from_matrix([[1, 0], [1, 0], [0, 1]], faults={"f": 0, "g": 2}))
    array([ True, False])
    """
    return _touched(model, set(causally_overdetermined(model, causality)))


def isolability(model: Model, causality: str = "mixed") -> Mask:
    """Return which fault can be told from which other.

    Parameters
    ----------
    model : Model
    causality : {"mixed", "integral", "derivative"}
        How differential constraints may be used, see
        :func:`fdi.structure.causality.causally_overdetermined`.

    Returns
    -------
    (n_f, n_f) bool array
        ``[i, j]`` is True when a test exists that reacts to fault i and not to fault j; the
        diagonal is False.

    Raises
    ------
    UsageError
        When the causality is none of the three.

    Notes
    -----
    One pass finds the classes of all equations. A decomposition of its own needs only a fault whose
    equations lie in several classes or, in integral and derivative causality, in a class without
    which something else cannot be computed, see :func:`fdi.structure.losses.causal_classes`.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, definition 3; the classes are those of
    Krysander, Åslund, Nyberg, IEEE Trans. SMC-A 38(1), 2008; for the causalities Frisk, Bregon,
    Åslund, Krysander, Pulido, Biswas, IEEE Trans. SMC-A 42(5), 2012.

    Examples
    --------
    >>> model = Model.from_matrix([[1], [1], [1]], faults={"f": 0, "g": 1})
    >>> isolability(model)
    array([[False,  True],
           [ True, False]])

    A state x with a measured derivative is tested by integrating or by differentiating.

    >>> from fdi.structure import Fault
    >>> model = Model(("dx = d/dt x", "y1 = dx", "y2 = x"), ("x", "dx"), ((0, 1), (1,), (0,)),
    ...               (Fault("f", (1,)),), ((0, 0, "i"), (0, 1, "d")))
    >>> detectable(model, "integral"), detectable(model, "derivative")
    (array([ True]), array([ True]))
    """
    return _isolable(model, causality)


def double_isolability(model: Model) -> Mask:
    """Return which fault can be told from which two that occur together, in mixed causality.

    Parameters
    ----------
    model : Model

    Returns
    -------
    (n_f, n_f, n_f) bool array
        ``[i, j, k]`` is True when a test exists that reacts to fault i and neither to j nor to k;
        symmetric in j and k, and for j = k the isolability from one fault.

    Notes
    -----
    One pass for each fault: that of :func:`isolability` over the equations which the fault does
    not enter.

    References
    ----------
    Krysander, Frisk, IEEE Trans. SMC-A 38(6), 2008, definition 3, for a set of two faults.

    Examples
    --------
    >>> model = Model.from_matrix([[1]] * 4, faults={"f": 0, "g": 1, "h": 2})
    >>> double_isolability(model)[:, 1, 2]
    array([ True, False, False])
    """
    n = len(model.faults)
    result: Mask = np.zeros((n, n, n), dtype=bool)
    for j, fault in enumerate(model.faults):
        result[:, j, :] = _isolable(model, "mixed", without=fault.equations)
    return result


def _isolable(model: Model, causality: str, *, without: Iterable[int] = ()) -> Mask:
    """Return the isolability matrix without some equations, over all faults of the model."""
    classes, left = causal_classes(model, causality, without=without)
    class_of = {equation: k for k, group in enumerate(classes) for equation in group}
    classes_of = [{class_of[e] for e in f.equations if e in class_of} for f in model.faults]
    # With one class per fault the matrix is one comparison; the others correct their row or column.
    single = np.array([min(own) if len(own) == 1 else -1 for own in classes_of], dtype=np.intp)
    result: Mask = (single[:, None] != single) & (single >= 0)[:, None]
    for i, own in enumerate(classes_of):
        if len(own) > 1:
            result[i] = [bool(own - other) for other in classes_of]
    for j, other in enumerate(classes_of):
        if len(other) > 1:
            gone = {*without, *model.faults[j].equations}
            over = causally_overdetermined(model, causality, without=gone)
            result[:, j] = _touched(model, set(over))
        elif left and not left.keys().isdisjoint(other):
            result[:, j] = _touched(model, left[min(other)])
    np.fill_diagonal(result, False)
    return result


def _touched(model: Model, equations: set[int]) -> Mask:
    return np.array(
        [not equations.isdisjoint(fault.equations) for fault in model.faults], dtype=bool
    )


def detectable_of_signatures(signatures: ArrayLike) -> Mask:
    """Return which faults the tests of a bank react to.

    Parameters
    ----------
    signatures : (n_tests, n_f) bool array_like
        True where the test is sensitive to the fault.

    Returns
    -------
    (n_f,) bool array

    References
    ----------
    Gertler, "Fault Detection and Diagnosis in Engineering Systems", 1998, chapter 6.

    Examples
    --------
    >>> detectable_of_signatures([[1, 0, 0], [1, 1, 0]])
    array([ True,  True, False])
    """
    return np.asarray(_signature_matrix(signatures).any(axis=0))


def isolability_of_signatures(signatures: ArrayLike) -> Mask:
    """Return which fault the tests of a bank tell from which other.

    Parameters
    ----------
    signatures : (n_tests, n_f) bool array_like
        True where the test is sensitive to the fault.

    Returns
    -------
    (n_f, n_f) bool array
        ``[i, j]`` is True when a test reacts to fault i and not to fault j.

    References
    ----------
    Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos, "A Fault Diagnosis Framework for
    MAVLink-Enabled UAVs Using Structural Analysis", 2018, section IV.

    Examples
    --------
    >>> isolability_of_signatures([[1, 0], [1, 1]])
    array([[False,  True],
           [False, False]])
    """
    matrix = _signature_matrix(signatures).astype(
        np.float32
    )  # so that the product is one BLAS call
    return np.asarray(matrix.T @ (1 - matrix) > 0.5)


def not_isolable_groups(isolable: ArrayLike, detectable: ArrayLike) -> tuple[tuple[int, ...], ...]:
    """Return the groups of detectable faults that hang together by not being isolable.

    Parameters
    ----------
    isolable : (n_f, n_f) bool array_like
        See :func:`isolability` and :func:`isolability_of_signatures`.
    detectable : (n_f,) bool array_like

    Returns
    -------
    tuple of tuple of int
        Connected groups, of two faults or more, of the relation "f is not isolable from g",
        whichever its direction; by smallest fault, each ascending.

    Raises
    ------
    UsageError
        When the shapes do not fit.

    References
    ----------
    Zogopoulos-Papaliakos, Logothetis, Kyriakopoulos, "A Fault Diagnosis Framework for
    MAVLink-Enabled UAVs Using Structural Analysis", 2018, table IV.

    Examples
    --------
    >>> not_isolable_groups([[0, 1, 1], [0, 0, 1], [1, 1, 0]], [True, True, True])
    ((0, 1),)
    """
    pairs, seen = np.asarray(isolable, dtype=bool), np.asarray(detectable, dtype=bool)
    if pairs.shape != (seen.size, seen.size):
        raise UsageError(f"isolability has shape {pairs.shape}, but there are {seen.size} faults")
    joined = ~(pairs & pairs.T) & seen[:, None] & seen
    groups: list[tuple[int, ...]] = []
    left = seen.copy()
    for start in range(seen.size):
        if not left[start]:
            continue
        group = [start]
        left[start] = False
        for fault in group:  # grows while it is walked
            neighbours = np.flatnonzero(joined[fault] & left).tolist()
            left[neighbours] = False
            group.extend(neighbours)
        if len(group) > 1:
            groups.append(tuple(sorted(group)))
    return tuple(groups)


def _signature_matrix(signatures: ArrayLike | Sequence[Sequence[int]]) -> Mask:
    matrix = np.asarray(signatures, dtype=bool)
    if matrix.ndim != 2:
        raise UsageError(f"signatures have 2 dimensions (tests, faults), not {matrix.ndim}")
    return matrix
