"""The pages that are made from the code tell all of it."""

import importlib.util
import json
import re
from importlib.resources import files
from pathlib import Path

import click
import pytest

from fdi.cli.commands import fdi as group

ROOT = Path(__file__).resolve().parents[1]
SCHEMA = json.loads(files("fdi.report").joinpath("analysis.schema.json").read_text("utf-8"))


@pytest.fixture(scope="module")
def reference():
    spec = importlib.util.spec_from_file_location("reference", ROOT / "docs" / "reference.py")
    found = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(found)
    return found


def test_every_option_of_every_command_is_told(reference):
    parts = re.split(r"^## fdi ", reference.commands(), flags=re.M)[1:]
    told = {part.split(maxsplit=1)[0]: part for part in parts}
    assert set(told) == set(group.commands)
    for name, command in group.commands.items():
        for option in command.params:
            if isinstance(option, click.Option) and not option.hidden:
                assert option.opts[-1] in told[name], (name, option.opts)


def test_every_field_of_the_analysis_has_a_meaning(reference):
    rows = [line.split(" | ") for line in reference.fields("analysis").splitlines()[2:]]
    assert len(rows) > 200
    assert [row[0] for row in rows if not row[2].strip(" |")] == []


def test_every_field_that_is_always_there_is_in_the_table(reference):
    names = set(re.findall(r"^\| `([^`.\[]+)", reference.fields("analysis"), re.M))
    assert set(SCHEMA["required"]) <= names
