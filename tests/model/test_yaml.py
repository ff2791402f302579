"""YAML files written by strangers."""

import pytest

from fdi.errors import ModelError
from fdi.model.yaml import MAX_BYTES, parse_document, read_document


def test_values_are_those_of_yaml_1_2():
    text = (
        "a: yes\nb: 0x1F\nc: 1_000\nd: 1e3\ne: .inf\nf: ~\ng: true\nh: '3'\ni: 012\nj: [1, 2.5]\n"
    )
    assert parse_document(text, "m").tree == {
        "a": "yes", "b": 31, "c": 1000, "d": 1000.0, "e": float("inf"), "f": None, "g": True,
        "h": "3", "i": 12, "j": [1, 2.5],
    }  # fmt: skip


def test_every_entry_knows_its_line():
    document = parse_document("a:\n  b: 1\n  c:\n  - x\n  - y: 2\n", "m")
    assert document.line(("a", "b")) == 2
    assert document.line(("a", "c", 1, "y")) == 5
    assert document.line(("a", "c", 1, "unknown")) == 5
    assert document.line(("nothing",)) == 1


BOMB = "a: &a [x, x]\n" + "".join(
    f"{b}: &{b} [*{a}, *{a}, *{a}, *{a}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
REFUSED = {
    "alias bomb": (BOMB, "m:1: anchors and aliases"),
    "merge": ("a: &x {b: 1}\nc:\n  <<: *x\n", "anchors and aliases"),
    "anchor that holds itself": ("a: &x [*x]\n", "anchors and aliases"),
    "duplicate key": ("a: 1\nb: 2\na: 3\n", "m:3: duplicate key 'a', first in line 1"),
    "duplicate key below": ("s:\n  a: 1\n  a: 1\n", "m:3: duplicate key"),
    "depth": ("a: " + "[" * 60 + "]" * 60, "deeper than 50"),
    "depth beyond the parser": ("a: " + "[" * 5000 + "]" * 5000, "deeper than 50"),
    "python tag": ("a: !!python/object/apply:os.system [id]\n", "m:1: .*not allowed|is not YAML"),
    "python scalar": ("a: !!python/name:os.system\n", "not allowed"),
    "own tag": ("a: !x 3\n", "not allowed"),
    "binary": ("a: !!binary aGk=\n", "not allowed"),
    "a list": ("- a\n", "mapping of keys"),
    "a word": ("hello\n", "mapping of keys"),
    "nothing": ("", "mapping of keys"),
    "not YAML": ("a: [1\nb: }\n", "is not YAML"),
    "a tab": ("a:\n\tb: 1\n", "is not YAML"),
    "a key that is a list": ("? [a]\n: 1\n", "a key must be a word"),
    "a control character": ("a: \x07\n", "is not YAML"),
    "two documents": ("a: 1\n---\nb: 2\n", "is not YAML"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_is_refused_with_the_line(name):
    text, message = REFUSED[name]
    with pytest.raises(ModelError, match=message) as raised:
        parse_document(text, "m")
    assert all("\n" not in problem for problem in raised.value.problems)


def test_all_duplicate_keys_are_reported_together():
    with pytest.raises(ModelError) as raised:
        parse_document("a: 1\na: 2\nb: {c: 1, c: 2}\n", "m")
    assert len(raised.value.problems) == 2


def test_a_file_that_is_not_utf8_is_named(tmp_path):
    (tmp_path / "m.yaml").write_bytes(b"name: \xff\xfe\n")
    with pytest.raises(ModelError, match=r"m.yaml: is not UTF-8 text \(byte 6\)"):
        read_document(tmp_path / "m.yaml")


def test_a_file_that_is_too_large_is_not_read(tmp_path):
    (tmp_path / "m.yaml").write_bytes(b"a: 1\n" + b"#" * MAX_BYTES)
    with pytest.raises(ModelError, match="larger than"):
        read_document(tmp_path / "m.yaml")


@pytest.mark.parametrize("kind", ["missing", "folder", "fifo"])
def test_what_is_no_file_is_not_opened(kind, tmp_path):
    import os

    path = tmp_path / "m.yaml"
    if kind == "folder":
        path.mkdir()
    elif kind == "fifo":
        os.mkfifo(path)
    with pytest.raises(ModelError, match=r"does not exist|is not a file"):
        read_document(path)
