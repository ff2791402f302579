"""``fdi compare``: what it prints, its JSON and figure, what it refuses."""

import json
from importlib.resources import files
from pathlib import Path

import jsonschema
import pytest

from .conftest import LOG, Run

OTHER = LOG.parent / "copter_gps_loss_landing.tlog"
PLANE = next(iter(sorted(LOG.parent.glob("plane*.tlog"))), LOG)


def test_two_flights_are_compared(run: Run, model: Path) -> None:
    ended = run("compare", LOG, "--healthy", OTHER, "--model", model)
    assert ended.code == 0, ended.err
    said = " ".join(ended.out.split())
    assert "2 flights of a quad, model tiny" in said
    assert "Tests that differ most" in said
    assert "Parameters that differ" in said
    assert "hardly known" in said  # one healthy flight tells little


def test_json_keeps_its_schema_and_is_the_same_every_time(run: Run, model: Path) -> None:
    words = ("compare", LOG, "--healthy", OTHER, "--model", model, "--json")
    first, second = run(*words), run(*words)
    schema = json.loads(files("fdi.report").joinpath("compare.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    document = json.loads(first.out)
    jsonschema.Draft202012Validator(schema).validate(document)
    assert first.out == second.out
    assert [one["healthy"] for one in document["flights"]] == [False, True]


def test_the_figure_is_written(run: Run, model: Path) -> None:
    run("compare", LOG, "--healthy", OTHER, "--model", model, "--figure", "own.pdf")
    assert Path("own.pdf").read_bytes().startswith(b"%PDF")


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ((), 2, "Missing argument"),
        ((LOG,), 2, "no other to compare"),
        ((LOG, LOG), 2, "named twice"),
        ((LOG, OTHER, "--figure", "own.bmp"), 2, "no picture ends with"),
        ((LOG, "nowhere.tlog"), 3, "nowhere.tlog"),
    ],
)
def test_what_cannot_be_compared_ends_in_one_line(
    run: Run, model: Path, words: tuple[object, ...], code: int, said: str
) -> None:
    ended = run("compare", *words, "--model", model)
    assert ended.code == code
    assert said in ended.err
    assert ended.out == ""
    assert len(ended.err.splitlines()) == 1


def test_different_vehicles_are_refused(run: Run) -> None:
    ended = run("compare", LOG, PLANE)
    assert ended.code == 2
    assert "has another vehicle (plane)" in ended.err
    assert len(ended.err.splitlines()) == 1
