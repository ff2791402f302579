"""Tells people and programs what an analysis found.

Given an ``Analysis``; sought texts, figures, tables and files, such that nothing the analysis knows
is left out and nothing is said that it does not know. ``Analysis`` -> folder, text, figure.

- ``folder.py``: a folder of ours, written in place; ``manifest.py``: which files in it are ours
- ``files.py``: which files it holds, and what is in each
- ``text.py``: the analysis for a terminal; ``log_text.py``, ``model_text.py``: a log, a model
- ``html.py`` and ``templates/``: one page to hand over; ``page/``: its plots, drawings and scripts
- ``explained.py``: what a test did, and why it was judged or not
- ``figures.py``: fault grid and isolability matrix, as pictures
- ``style.py``: what all figures have in common; ``waterfall.py``: what pictures of vibrations show
- ``tables.py``: CSV and Parquet; ``json_text.py``: JSON that is the same byte for byte
- ``methods_document.py``: what methods beside the model's tests show, for analysis.json
- ``analysis_document.py``, ``log_document.py``, ``model_document.py``: what ``fdi analyze``,
  ``fdi info`` and ``fdi structure`` give as JSON
- ``model_figures.py``: a model in pictures; ``sizes.py``: how large faults must be on a flight
- ``enough.py``: the cheapest messages and tests that tell faults of given sizes
- ``model_gain.py``, ``model_gain_text.py``: what a model shows beyond an older one
- ``estimator_text.py``, ``estimator_figures.py``, ``estimator_document.py``: what
  ``fdi estimator`` tells; ``estimator_files.py``: the files of its folder
- ``check_text.py``, ``check_document.py``: what ``fdi check`` tells; ``stood_out.py``: what of that
  and of the flight stands beside an answer; ``advice_text.py``: what to do next
- ``observer_text.py``, ``observer_figures.py``, ``observer_document.py``: what ``fdi observe``
  tells; ``observer_files.py``: the files of its folder
- ``heading_text.py``, ``heading_figures.py``, ``heading_document.py``: what ``fdi heading`` tells;
  ``heading_files.py``: the files of its folder; ``recovered.py``: the table of what it recovered
- ``timeline.py``: which of a log's events a person wants to read
- ``convert.py``: a log as Parquet files for other programs
- ``vote_text.py``, ``vote_figure.py``, ``vote_document.py``: what ``fdi vote`` says, draws and
  tabulates; ``vote_rows.py``: the rows that these share; ``vote_files.py``: its folder
- ``simulation_text.py``, ``reliability_text.py``: simulated voters; units in series and parallel
- ``words.py``: times, numbers and foreign text as a person reads them
- ``paper/``: figures for a printed column; ``compared/``: what ``fdi compare`` tells; ``fleet/``:
  the page of ``fdi batch``
"""

from fdi.report.analysis_document import analysis_document
from fdi.report.convert import convert
from fdi.report.files import FORMATS
from fdi.report.folder import check_folder, write_file, write_report
from fdi.report.json_text import json_text
from fdi.report.log_document import log_document
from fdi.report.log_text import log_summary
from fdi.report.model_document import model_document
from fdi.report.model_text import model_summary
from fdi.report.text import print_summary, summary

__all__ = [
    "FORMATS",
    "analysis_document",
    "check_folder",
    "convert",
    "json_text",
    "log_document",
    "log_summary",
    "model_document",
    "model_summary",
    "print_summary",
    "summary",
    "write_file",
    "write_report",
]
