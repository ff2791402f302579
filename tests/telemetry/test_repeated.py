"""Rows of bytes are of one kind exactly when they are the same."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fdi.telemetry.formats.bytes import repeated
from fdi.telemetry.formats.bytes.repeated import kinds_of_rows


def rows_of(texts: list[bytes], width: int) -> np.ndarray:
    joined = b"".join(text[:width].ljust(width, b"\0") for text in texts)
    return np.frombuffer(joined, np.uint8).reshape(len(texts), width)


def assert_kinds(rows: np.ndarray) -> None:
    first, kind = kinds_of_rows(rows)
    wanted = [row.tobytes() for row in rows]
    assert [wanted[first[k]] for k in kind] == wanted
    assert len({wanted[i] for i in first}) == len(first)


@given(st.lists(st.binary(max_size=20), max_size=60), st.integers(1, 20))
def test_kinds_are_the_distinct_rows(texts, width):
    assert_kinds(rows_of(texts + texts[::2], width))


def test_rows_that_share_a_place_stay_apart(monkeypatch):
    monkeypatch.setattr(repeated, "_places", lambda words: np.zeros(len(words), np.uint16))
    assert_kinds(rows_of([b"one", b"two", b"three", b"one", b"two", b"one"], 8))


def test_no_rows_have_no_kinds():
    first, kind = kinds_of_rows(np.zeros((0, 16), np.uint8))
    assert (first.size, kind.size) == (0, 0)
