"""Kept answers: whole or absent, bounded, and never in the way."""

import os
import time

import pytest

from fdi import store

TREE = {"a": [1, 2.5, None, "x"], "b": {"c": True}}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path / "cache"


def test_what_was_kept_is_fetched(folder):
    assert store.fetch("kind", "0" * 64) is None
    store.keep("kind", "0" * 64, TREE)
    assert store.fetch("kind", "0" * 64) == TREE
    assert store.fetch("other", "0" * 64) is None


@pytest.mark.parametrize(
    "damage",
    [
        lambda b: b[: len(b) // 2],
        lambda b: b"",
        lambda b: b.replace(b"2.5", b"2.6"),
        lambda b: b.replace(b"cache 1", b"cache 0"),
        lambda b: os.urandom(200),
        lambda b: b"[" * 100_000,
        lambda b: b.split(b"\n")[0] + b"\n" + b"[" * 100_000,
    ],
)
def test_a_damaged_file_counts_as_absent(damage, folder):
    store.keep("kind", "k", TREE)
    path = folder / "kind-k.json"
    path.write_bytes(damage(path.read_bytes()))
    assert store.fetch("kind", "k") is None
    store.keep("kind", "k", TREE)
    assert store.fetch("kind", "k") == TREE


def test_an_entry_of_another_key_counts_as_absent(folder):
    store.keep("kind", "one", TREE)
    (folder / "kind-two.json").write_bytes((folder / "kind-one.json").read_bytes())
    assert store.fetch("kind", "two") is None


@pytest.mark.parametrize("kind", ["folder", "fifo"])
def test_what_is_no_file_is_not_opened(kind, folder):
    folder.mkdir()
    path = folder / "kind-k.json"
    path.mkdir() if kind == "folder" else os.mkfifo(path)
    assert store.fetch("kind", "k") is None


def test_a_folder_that_cannot_be_made_keeps_nothing(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("")
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path / "file" / "cache"))
    store.keep("kind", "k", TREE)
    assert store.fetch("kind", "k") is None


def test_least_recently_used_entries_go_first(folder, monkeypatch):
    monkeypatch.setattr(store, "MAX_FILES", 3)
    now = time.time()
    for age, key in enumerate("abc"):
        store.keep("kind", key, TREE)
        os.utime(folder / f"kind-{key}.json", (now - 100 + age, now - 100 + age))
    store.fetch("kind", "a")
    store.keep("kind", "d", TREE)
    assert sorted(path.name for path in folder.iterdir()) == [f"kind-{key}.json" for key in "acd"]


def test_leftovers_of_a_process_that_died_are_removed(folder):
    store.keep("kind", "a", TREE)
    stale = folder / ".x.tmp"
    stale.write_text("")
    os.utime(stale, (0, 0))
    store.keep("kind", "b", TREE)
    assert not stale.exists()


def test_folder_follows_the_environment(monkeypatch, tmp_path):
    monkeypatch.delenv("FDI_CACHE_DIR")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert store.cache_folder() == tmp_path / "fdi"
    monkeypatch.setenv("XDG_CACHE_HOME", "relative")
    assert store.cache_folder().is_absolute()


def test_parts_of_a_key_do_not_run_together():
    assert store.digest("ab", "c") != store.digest("a", "bc")
