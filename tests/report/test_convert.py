"""A converted log says the same as the log, and reaches the disk whole or not at all."""

import json
import string
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
import pytest
from flights import EXAMPLES, SHARED
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import OutputError
from fdi.report import convert, write_report
from fdi.report.convert import LONGEST, file_names
from fdi.result import Analysis
from fdi.telemetry import Log, read
from fdi.telemetry.message import Column
from fdi.units import Conversion, si

from .build import message, small_log
from .test_documents import log_validator

LIST = ".fdi-manifest.json"
LOGS = [
    EXAMPLES / "copter_motor_failure_crash.tlog",
    SHARED / "sitl" / "copter" / "c90_crash_motor1_x0.2.BIN",
    SHARED / "crash" / "motor2_lost.bin",
    SHARED / "odd" / "appended_multiple.ulg",
]


@pytest.mark.parametrize("path", LOGS, ids=lambda path: path.name)
def test_pandas_reads_the_frames_of_the_log(path: Path, tmp_path: Path) -> None:
    if not path.exists():
        pytest.skip("no ../shared")
    log = read(path)
    convert(log, tmp_path / "out")
    document = json.loads((tmp_path / "out" / "metadata.json").read_text())
    log_validator().validate(document)
    assert set(document["files"]) == set(log.messages)
    fields = {told["name"]: told["fields"] for told in document["messages"]}
    for key, name in document["files"].items():
        written, schema = (
            pd.read_parquet(tmp_path / "out" / name),
            pq.read_schema(tmp_path / "out" / name),
        )
        for field in schema:
            unit = (field.metadata or {}).get(b"unit", b"").decode()
            assert field.name == "t" or unit == (fields[key][field.name] or "")
            if field.name != "t" and fields[key][field.name] is not None:
                read_back = si(unit)
                written[field.name] = written[field.name] * read_back.scale + read_back.offset
        pd.testing.assert_frame_equal(written, log[key].frame(), check_freq=False, rtol=1e-12)


def test_a_column_holds_the_unit_that_its_name_says(tmp_path: Path) -> None:
    """``ATTITUDE.time_boot_ms`` was written in seconds."""
    stamps = np.array([51929, 4294967295, 52129], np.uint32)
    column = Column(lambda: stamps, si("ms"), (4294967295,))
    log = log_with(time_boot_ms=column)
    convert(log, tmp_path)
    table = pq.read_table(tmp_path / "M.parquet")
    assert table["time_boot_ms"].to_pylist() == [51929.0, None, 52129.0]
    assert table.schema.field("time_boot_ms").metadata[b"unit"] == b"ms"
    told = json.loads((tmp_path / "metadata.json").read_text())["messages"][0]
    assert told["fields"]["time_boot_ms"] == "ms"
    again = read(tmp_path / "M.parquet").channel("M.time_boot_ms")
    assert (again.unit, again.value[0]) == ("s", 51.929)


def texts(values: list[str]) -> Column:
    return Column(partial(np.array, values, object), Conversion(""), is_text=True)


def log_with(**columns: Column) -> Log:
    """Return a log of one message with a field ``alt`` and others."""
    t = np.arange(3.0)
    made = message("M", {"alt": np.array([1.0, np.nan, 3.0])}, t)
    return replace(small_log(), messages={"M": replace(made, columns={**made.columns, **columns})})


def test_units_and_origin_stand_in_the_schema(tmp_path: Path) -> None:
    log = log_with(name=texts(["a", "", "ü\ud800"]))
    convert(log, tmp_path)
    schema = pq.read_schema(tmp_path / "M.parquet")
    assert schema.names == ["t", "alt", "name"]
    assert [schema.field(n).metadata.get(b"unit") for n in schema.names] == [b"s", b"m", None]
    about = json.loads(schema.metadata[b"fdi"])
    assert about["message"] == "M"
    assert about["log"] == {
        "name": "flight.tlog",
        "sha256": log.sha256,
        "format": "tlog",
        "vehicle": "plane",
        "autopilot": "ardupilot",
    }


def test_unknown_is_null_and_text_is_text(tmp_path: Path) -> None:
    log = log_with(name=texts(["a", "", "ü\ud800"]))
    convert(log, tmp_path)
    table = pq.read_table(tmp_path / "M.parquet")
    assert table["alt"].to_pylist() == [1.0, None, 3.0]
    assert table["name"].to_pylist() == ["a", "", "ü?"]


def test_field_named_as_the_time_gives_way(tmp_path: Path) -> None:
    values = np.array([7.0, 8.0, 9.0])
    convert(
        log_with(t=Column(lambda: values, Conversion("s")), t_=texts(["a", "b", "c"])), tmp_path
    )
    frame = pd.read_parquet(tmp_path / "M.parquet")
    assert frame.index.tolist() == [0.0, 1.0, 2.0]
    assert frame["t__"].tolist() == [7.0, 8.0, 9.0]
    assert frame["t_"].tolist() == ["a", "b", "c"]


def test_message_without_records_is_converted(tmp_path: Path) -> None:
    empty = message("M", {"alt": np.empty(0)}, np.empty(0))
    convert(replace(small_log(), messages={"M": empty}), tmp_path)
    assert pd.read_parquet(tmp_path / "M.parquet").shape == (0, 1)


@given(st.lists(st.text(max_size=80), unique=True, max_size=12))
def test_file_names_are_harmless_and_differ_in_any_case(keys: list[str]) -> None:
    names = list(file_names(keys).values())
    assert len({name.lower() for name in names}) == len(keys)
    harmless = set(string.ascii_letters + string.digits + "_-")
    for name in names:
        stem = name.removesuffix(".parquet")
        assert stem
        assert set(stem) <= harmless
        assert len(stem) <= LONGEST + 4
        assert stem.lower() not in {"con", "prn", "aux", "nul", "com1", "lpt9"}


HOSTILE = ["../x", "/etc/passwd", "a\0b", "NUL", "con", "Con", ".", "..", "", "x/../../y", "a\\b"]


@given(st.lists(st.sampled_from([*HOSTILE, "A", "a", "A_1", "A[1]", "a-2"]), unique=True))
def test_hostile_and_colliding_names_are_harmless(keys: list[str]) -> None:
    names = list(file_names(keys).values())
    assert len({name.lower() for name in names}) == len(keys)
    assert not [name for name in names if Path(name).name != name or "\0" in name or name[0] == "."]


def test_hostile_message_names_stay_in_the_folder(tmp_path: Path) -> None:
    t = np.arange(3.0)
    messages = {name: message(name, {"alt": t}, t) for name in HOSTILE}
    convert(replace(small_log(), messages=messages), tmp_path / "a" / "out")
    assert [entry.name for entry in (tmp_path / "a").iterdir()] == ["out"]
    written = {entry.name for entry in (tmp_path / "a" / "out").iterdir()}
    document = json.loads((tmp_path / "a" / "out" / "metadata.json").read_text())
    assert written == {*document["files"].values(), "metadata.json", LIST}
    assert set(document["files"]) == set(HOSTILE)


def names_in(folder: Path) -> set[str]:
    return {entry.name for entry in folder.iterdir()}


def test_folder_of_ours_is_replaced_and_foreign_files_in_it_stay(tmp_path: Path) -> None:
    out = tmp_path / "out"
    convert(small_log(), out)
    (out / "mine.parquet").write_text("mine")
    convert(log_with(), out)
    assert names_in(out) == {"M.parquet", "metadata.json", "mine.parquet", LIST}


def test_what_a_foreign_document_lists_stays(tmp_path: Path) -> None:
    """A document that looks like ours and lists somebody's files deletes none of them."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "survey.parquet").write_text("precious")
    document = {"tool": {"name": "uav-fdi"}, "files": {"A": "survey.parquet"}}
    (out / "metadata.json").write_text(json.dumps(document))
    with pytest.raises(OutputError):
        convert(small_log(), out)
    convert(small_log(), out, force=True)
    assert (out / "survey.parquet").read_text() == "precious"
    assert json.loads((out / "metadata.json.1").read_text()) == document


def test_folder_of_somebody_else_needs_force(tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("")
    with pytest.raises(OutputError, match="--force"):
        convert(small_log(), tmp_path)
    assert names_in(tmp_path) == {"mine"}
    convert(small_log(), tmp_path, force=True)
    assert {"mine", "metadata.json"} < names_in(tmp_path)


def test_report_is_not_a_converted_log(analysis: Analysis, tmp_path: Path) -> None:
    """Each kind of folder is replaced only by its own."""
    write_report(analysis, tmp_path, ["json"])
    with pytest.raises(OutputError, match="holds a report, not a converted log"):
        convert(small_log(), tmp_path)


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_failure_half_way_leaves_the_old_folder_and_nothing_else(
    tmp_path: Path, failure: BaseException
) -> None:
    out = tmp_path / "out"
    convert(small_log(), out)
    before = (out / "VFR_HUD.parquet").read_bytes()

    def broken() -> np.ndarray[Any, Any]:
        raise failure

    with pytest.raises((OutputError, KeyboardInterrupt)):
        convert(log_with(x=Column(broken, Conversion("m"))), out)
    assert names_in(tmp_path) == {"out"}
    assert (out / "VFR_HUD.parquet").read_bytes() == before


def test_what_was_decoded_is_let_go(tmp_path: Path) -> None:
    log = small_log()
    convert(log, tmp_path / "out")
    assert not any(m._cache for m in log.messages.values())
