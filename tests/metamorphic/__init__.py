"""What must not change the answer, on many flights: ``python -m metamorphic`` (minutes).

- ``edits.py``: a log as records, with times and order of its own, in three formats
- ``relations.py``: what must hold between a flight and its edited twin
- ``__main__.py``: every relation on every flight, and a table of what held

The relations are those of ``reliability.md``. `test_metamorphic.py` has a few flights of each, and
what is special to a format.
"""
