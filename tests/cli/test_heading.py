"""``fdi heading``: what it prints and writes, and a sentence for everything that lacks."""

import json
from importlib.resources import files
from pathlib import Path

import jsonschema
import numpy as np
import pandas as pd
import pytest
from methods.setup.sensors import Ride, write

from .conftest import Run

FILES = {".fdi-manifest.json", "heading.json", "heading.txt", "headings.png", "headings.svg"}
MORE = {"recovered.png", "recovered.svg"}


@pytest.fixture
def log(tmp_path: Path) -> Path:
    # its receiver tells a course across the way that its places go: the receiver is off
    return write(tmp_path / "ride.tlog", Ride(course_off=np.pi / 2))


def validated(text: str) -> dict:
    schema = json.loads(files("fdi.report").joinpath("heading.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    document = json.loads(text)
    jsonschema.Draft202012Validator(schema).validate(document)
    return document


def test_it_prints_a_page(run: Run, log: Path) -> None:
    ended = run("heading", log)
    assert ended.code == 0
    assert ended.err == ""
    assert ended.out.startswith("ride.tlog\n")
    assert "gps (satellite) since" in ended.out
    assert "absent: the log holds no GPS_RAW_INT.yaw" in ended.out


def test_json_keeps_its_schema(run: Run, log: Path) -> None:
    document = validated(run("heading", log, "--json").out)
    assert document["accused"] == "gps"
    assert document["recovery"] is None
    again = run("heading", log, "--json", "--recover", "x.csv", "--assume", "magnetometer@40")
    assert validated(again.out)["recovery"]["block"] == "magnetometer"


@pytest.mark.parametrize(
    ("name", "reader"), [("x.csv", pd.read_csv), ("x.parquet", pd.read_parquet)]
)
def test_what_is_recovered_is_a_table(run: Run, log: Path, name: str, reader) -> None:
    ended = run("heading", log, "--recover", name, "--assume", "magnetometer@30")
    assert ended.code == 0
    table = reader(name)
    assert list(table) == ["t_s", "method", "heading_deg", "sigma_heading_deg"]
    assert (table.t_s > 30).all()
    assert table.heading_deg.between(-180, 180).all()
    assert [path.name for path in Path().iterdir() if "tmp" in path.name] == []


def test_a_file_that_is_there_is_kept(run: Run, log: Path) -> None:
    Path("mine.csv").write_text("mine")
    ended = run("heading", log, "--recover", "mine.csv", "--assume", "magnetometer@30")
    assert ended.code == 5
    assert ended.err == "fdi: mine.csv: is there already (name another file, or give --force)\n"
    assert Path("mine.csv").read_text() == "mine"
    words = ("--recover", "mine.csv", "--assume", "magnetometer@30", "--force")
    assert run("heading", log, *words).code == 0
    assert Path("mine.csv").read_text() != "mine"


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--recover", "x.txt"), "x.txt ends in neither of .parquet, .csv"),
        (("--assume", "magnetometer@3"), "there is no FILE"),
        (("--recover", "x.csv", "--assume", "magnetometer"), "is no BLOCK@SECONDS"),
        (("--recover", "x.csv", "--assume", "compass@3"), "is no BLOCK@SECONDS"),
        (("--recover", "x.csv", "--assume", "satellite@nan"), "is no BLOCK@SECONDS"),
        (("--recover", "x.csv", "--assume", "satellite@1e9"), "is not in the air"),
        (("--flight", 9), "has no flight 9"),
    ],
)
def test_a_wrong_call_is_2(run: Run, log: Path, words: tuple, said: str) -> None:
    ended = run("heading", log, *words)
    assert ended.code == 2
    assert said in ended.err
    assert ended.err.count("\n") == 1
    assert not Path("x.csv").exists()


def test_a_folder_that_is_not_there_is_5(run: Run, log: Path) -> None:
    ended = run("heading", log, "--recover", "no/x.csv", "--assume", "magnetometer@30")
    assert ended.code == 5
    assert ended.err == "fdi: no: is no folder\n"


def test_a_second_between_records_is_3(run: Run, tmp_path: Path) -> None:
    slow = write(tmp_path / "slow.tlog", Ride(rate=1.0, length=90.0))
    ended = run("heading", slow)
    assert ended.code == 3
    assert "inertial records are 1.0 s apart" in ended.err
    assert ended.err.count("\n") == 1


def test_a_folder_holds_text_json_and_figures_the_same_every_time(run: Run, log: Path) -> None:
    words = ("--recover", "x.csv", "--assume", "satellite@30", "--force")
    for name in ("a", "b"):
        assert run("heading", log, "--out", name, *words).code == 0
    assert {path.name for path in Path("a").iterdir()} == FILES | MORE
    for name in FILES | MORE:
        assert Path("a", name).read_bytes() == Path("b", name).read_bytes(), name
    assert run("heading", log, "--out", "a").code == 0
    assert {path.name for path in Path("a").iterdir()} == FILES


def test_analyze_takes_what_was_recovered_of_this_log_alone(
    run: Run, log: Path, tmp_path: Path
) -> None:
    run("heading", log, "--recover", "x.csv", "--assume", "magnetometer@30")
    other = write(tmp_path / "other.tlog", Ride(rate=9.0))
    ended = run("analyze", other, "--recovered", "x.csv", "--json")
    assert ended.code == 3
    assert ended.out == ""
    (line,) = ended.err.strip().splitlines()
    assert "x.csv: is not of other.tlog: its times are no records of it" in line
