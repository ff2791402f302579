"""Rows of bytes, whatever format they are of.

compiled.py  loops over bytes as machine code, where numba is at hand
gather.py    bytes at many offsets
repeated.py  which rows of bytes are the same
texts.py     which are alike, and what they say
"""
