"""Tells how several flights differ: on a terminal, as JSON, as a figure.

Given a ``Comparison``; sought what a person or a program reads, such that the odd flight stands
out. ``Comparison`` -> text, document, figure.

- ``text.py``: the page of ``fdi compare``
- ``document.py``: what ``fdi compare --json`` prints; its schema is ``compare.schema.json``
- ``figure.py``: the tests that differ most, with the band of the healthy flights
"""

from fdi.report.compared.document import comparison_document
from fdi.report.compared.figure import comparison_figure
from fdi.report.compared.text import comparison_summary

__all__ = ["comparison_document", "comparison_figure", "comparison_summary"]
