"""Tests of `fdi.structure`."""
