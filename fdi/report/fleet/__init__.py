"""Tells of many logs at once: one page for an operator.

Given the rows of ``fdi batch``; sought one HTML text, such that the flights that need a look stand
out, and the condition of a vehicle can be followed over its flights. Rows -> page; like the page of
one analysis it needs nothing from elsewhere.

- ``flagged.py``: which logs need a look, and why
- ``sparks.py``: a few samples of height and speed, and the tiny pictures of them
- ``vehicles.py``: the rows of each vehicle with its trends; ``trend.py``: one trend as a picture
- ``document.py``: the page; ``templates/fleet.html.j2``, ``page/assets/fleet.js``, ``fleet.css``
"""
