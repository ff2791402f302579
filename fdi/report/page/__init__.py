"""Makes the page that a person hands over: one file that opens offline and can be explored.

Given an ``Analysis``; sought one HTML text, such that it needs nothing from elsewhere, runs no
script but ours, reads as well without scripts and on paper, and shows what was measured against
what was predicted. ``Analysis`` -> ``Page``; the room above puts it into the template.

- ``document.py``: all of it, from the parts below
- ``waterfall.py``: vibrations over time and frequency, behind the motors' rates
- ``overview.py``, ``track.py``, ``marks.py``: plots of the flight, its way over ground, modes,
  events and the fault grid
- ``evidence.py``: the case against who is accused; ``sides.py``: measured against predicted
- ``suspects.py``: how sure it is, and who else; ``airframe.py``: where on the vehicle
- ``channels.py``: all channels of the log, as far as they fit; ``columns.py``: columns as text
- ``panel.py``: a plot as data; ``drawing.py``: a plot as SVG
- ``templates.py``: how values come into a page
- ``script.py``: the scripts and styles in ``assets/``, and the policy that allows them; uPlot there
  is vendored with its licence
"""
