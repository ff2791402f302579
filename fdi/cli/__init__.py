"""Parses the command line, calls the stages, prints what they say.

Given the words a person typed; sought the call they mean, such that every mistake is told in one
line with the right exit code. Words -> exit code.

- ``main.py``: the entry ``fdi``; ``interrupt.py``: how Ctrl-C ends it
- ``commands.py``: which command is meant, and what an exception means to the shell
- ``analyze.py``, ``info.py``, ``convert.py``, ``structure.py``, ``evaluate.py``, ``batch.py``,
  ``calibrate.py``, ``inject.py``, ``fit.py``, ``estimator.py``, ``observe.py``, ``heading.py``,
  ``check.py``, ``vote.py``, ``figure.py``, ``compare.py``, ``watch.py``: one command each
- ``live.py``: a connection opened, recorded, heard and ended
- ``options.py``: what means the same in several commands; ``one_flight.py``: what those share that
  answer one question about one flight
- ``completion.py``: what a shell offers while a word is typed
- ``bus_error.py``: what is said when a mapped log is cut short
- ``output.py``: standard output and error, progress
"""

from fdi.cli.main import main

__all__ = ["main"]
