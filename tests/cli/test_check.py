"""``fdi check``: what it prints, its JSON, its exit codes."""

import json
from importlib.resources import files
from pathlib import Path

import jsonschema
import pytest
from methods.setup.build import Quad, write

from .conftest import LOG, Run


@pytest.fixture(scope="module")
def flip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("flip")
    return write(folder / "flip.tlog", Quad(places=(0, 1, 3, 2), rate=25))


def test_a_flip_on_take_off_is_told_in_one_line(run: Run, flip: Path) -> None:
    ended = run("check", flip)
    assert ended.code == 0
    assert ended.err == ""
    assert "motors 3 and 4 are swapped" in " ".join(ended.out.split())
    assert "moment residuals fall from" in " ".join(ended.out.split())
    assert "Not checked, or not decided" in ended.out


def test_check_ends_with_1_where_something_is_wrong(run: Run, flip: Path) -> None:
    assert run("check", flip, "--check").code == 1


def test_a_healthy_set_up_says_so(run: Run, tmp_path: Path) -> None:
    path = write(tmp_path / "healthy.tlog", Quad())
    ended = run("check", path, "--check")
    assert ended.code == 0
    assert "Nothing was found to be set up wrongly: " in ended.out
    assert "mistake" not in ended.out


def test_json_keeps_its_schema_and_is_the_same_every_time(run: Run, flip: Path) -> None:
    first, second = run("check", flip, "--json"), run("check", LOG, "--json")
    schema = json.loads(files("fdi.report").joinpath("check.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    for ended in (first, second):
        jsonschema.Draft202012Validator(schema).validate(json.loads(ended.out))
    assert {"motors"} == {
        one["name"] for one in json.loads(first.out)["checks"] if one["verdict"] == "wrong"
    }
    assert run("check", flip, "--json").out == first.out


def test_what_is_no_log_ends_with_3_and_one_line(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "no.bin"
    path.write_bytes(b"nothing of a log" * 50)
    ended = run("check", path)
    assert ended.code == 3
    assert ended.out == ""
    assert len(ended.err.splitlines()) == 1


def test_a_missing_log_ends_with_3(run: Run) -> None:
    assert run("check", "nowhere.tlog").code == 3
