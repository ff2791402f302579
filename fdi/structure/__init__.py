"""Answers what a set of equations could reveal, from its structure alone.

Given which equation contains which unknown, and which equations each fault enters; sought are the
sets of equations that can be tested, such that every test has more equations than unknowns and none
that it could do without, and, from them or directly, which faults can be detected and told apart.

In: :class:`Model`. Out: bit sets of equations (int, bit i is equation i), parts, boolean arrays.
Nothing here knows of logs, flights, units or the text of an equation.

- ``incidence.py``: the model; bit sets
- ``reference.py``: models of reference files
- ``matching.py``: a maximum matching of equations with unknowns
- ``decomposition.py``: over-, just- and underdetermined part, graph components
- ``equivalence.py``: equations that leave the overdetermined part together
- ``testsets.py``: MSO sets, MTES and a bound on their number
- ``sample.py``: a fair sample of them, where they are too many
- ``search.py``: what searches a graph component for them: Python or compiled code
- ``dual.py``: the vectors in which removing an equation is a projection
- ``flats.py``: the search over these vectors, in Python
- ``paths.py``: the same search without vectors, for large models
- ``compiled.py``: the search over the vectors, compiled (extra ``fast``)
- ``field.py``: packed arithmetic modulo 2^61 - 1
- ``causality.py``: what remains testable by integrating alone, by differentiating alone
- ``losses.py``: what remains of that when an equation leaves
- ``index.py``: how a set uses its differential constraints; index, observability
- ``isolability.py``: detectable and isolable faults, of a model and of a bank
- ``signatures.py``: irreducible signatures, for faults that occur together
- ``placement.py``: minimal sets of added sensors
- ``additions.py``: minimal sets of whatever can be added
- ``cheapest.py``: the cheapest of them, by an integer program
- ``hitting.py``: which sets of faults explain all tests in alarm
- ``explain.py``: why faults cannot be told apart, and what would separate them
- ``computation.py``: what can be computed from what, where not every entry can be solved along
- ``sequence.py``, ``loops.py``: valid sequences of a set, and what stands against the others
- ``selection.py``: a test for a purpose, a small bank for all purposes; its parts are
  ``purposes.py``, ``finder.py``, ``leaving.py`` and ``cover.py``
- ``adapters.py``: models from and to networkx, scipy, sympy, the toolbox of record
- ``frames.py``, ``plot.py``: matrices with names, pictures
- ``export.py``: the incidence as a file for other programs
"""

from fdi.structure.computation import Rules
from fdi.structure.decomposition import decompose, graph_components
from fdi.structure.equivalence import classes
from fdi.structure.incidence import Fault, Model, bitset, members, submodel
from fdi.structure.isolability import detectable, isolability
from fdi.structure.placement import cheapest_sensors, place_sensors
from fdi.structure.reference import load_reference
from fdi.structure.sample import sample_sets
from fdi.structure.selection import find_test, select_tests
from fdi.structure.testsets import count_bound, mso_sets, mtes_sets

__all__ = [
    "Fault",
    "Model",
    "Rules",
    "bitset",
    "cheapest_sensors",
    "classes",
    "count_bound",
    "decompose",
    "detectable",
    "find_test",
    "graph_components",
    "isolability",
    "load_reference",
    "members",
    "mso_sets",
    "mtes_sets",
    "place_sensors",
    "sample_sets",
    "select_tests",
    "submodel",
]
