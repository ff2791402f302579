import csv
import io
import json
from collections.abc import Callable
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import jsonschema
import numpy as np
import pyarrow.parquet as pq
import pytest

from fdi.report.json_text import json_text
from fdi.report.log_document import log_document, rate
from fdi.report.tables import fault_grid_csv, isolability_csv, residuals_parquet
from fdi.result import Analysis

from .build import NOTHING, message, small_analysis, small_log


@pytest.fixture(scope="module")
def validator() -> jsonschema.Draft202012Validator:
    schema = json.loads(files("fdi.report").joinpath("analysis.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_analysis_json_keeps_its_schema(
    analysis: Analysis, validator: jsonschema.Draft202012Validator
) -> None:
    validator.validate(json.loads(json_text(analysis.document())))


def test_a_quiet_analysis_keeps_the_schema(
    tmp_path: Path, validator: jsonschema.Draft202012Validator
) -> None:
    validator.validate(small_analysis(tmp_path, **NOTHING).document())


Damage = Callable[[dict[str, Any]], Any]


@pytest.mark.parametrize(
    "damage",
    [
        lambda d: d.update(extra=1),
        lambda d: d["log"].update(path="/home"),
        lambda d: d["findings"][0].pop("alarm"),
        lambda d: d["findings"][0].update(kind="odd"),
        lambda d: d["findings"][0].update(confidence=1.2),
        lambda d: d["residuals"][0].update(status="maybe"),
        lambda d: d["fault_grid"]["rows"][0]["intervals"].append([1.0]),
    ],
)
def test_the_schema_is_strict(
    analysis: Analysis, validator: jsonschema.Draft202012Validator, damage: Damage
) -> None:
    document = json.loads(json_text(analysis.document()))
    damage(document)
    with pytest.raises(jsonschema.ValidationError):
        validator.validate(document)


def test_json_keeps_order_is_ascii_and_refuses_nan() -> None:
    document = {"b": [1, None], "a": {"text": "naïve \u202e"}}
    written = json_text(document)
    assert json.loads(written) == document
    assert list(json.loads(written)) == ["b", "a"]
    assert written.isascii()
    with pytest.raises(ValueError, match="JSON compliant"):
        json_text({"a": float("nan")})


def test_the_grid_csv_says_0_1_or_nothing(analysis: Analysis) -> None:
    grid = analysis.diagnosis.grid
    marks = grid.marks.copy()
    marks[0, :2] = -1
    unknown = replace(
        analysis, diagnosis=replace(analysis.diagnosis, grid=replace(grid, marks=marks))
    )
    rows = list(csv.DictReader(io.StringIO(fault_grid_csv(unknown))))
    assert list(rows[0]) == ["t", *grid.faults]
    assert len(rows) == len(grid.t)
    assert rows[0][grid.faults[0]] == ""
    assert {row[fault] for row in rows[2:] for fault in grid.faults} == {"0", "1"}


def test_the_isolability_csv_is_the_matrix(analysis: Analysis) -> None:
    rows = list(csv.reader(io.StringIO(isolability_csv(analysis))))
    value = analysis.diagnosis.implementable
    assert rows[0] == ["fault", *value.faults]
    assert [[int(cell) for cell in row[1:]] for row in rows[1:]] == value.matrix.astype(
        int
    ).tolist()


def test_a_formula_in_a_name_reaches_a_spreadsheet_as_text(analysis: Analysis) -> None:
    grid = replace(analysis.diagnosis.grid, faults=("=1+1", "@x", "a"))
    table = fault_grid_csv(replace(analysis, diagnosis=replace(analysis.diagnosis, grid=grid)))
    assert table.splitlines()[0] == "t,'=1+1,'@x,a"


def test_the_parquet_gives_the_frame_back_with_units(analysis: Analysis) -> None:
    table = pq.read_table(io.BytesIO(residuals_parquet(analysis)))
    frame = table.to_pandas()
    assert frame.index.name == "t"
    np.testing.assert_array_equal(frame.to_numpy(), analysis.residuals.to_numpy())
    metadata = table.schema.field("r5").metadata
    assert metadata[b"unit"] == b"m"
    assert json.loads(metadata[b"signature"]) == list(analysis.bank.generators[4].faults)
    assert json.loads(table.schema.metadata[b"fdi"])["log"]["name"] == "flight.tlog"


def log_validator() -> jsonschema.Draft202012Validator:
    schema = json.loads(files("fdi.report").joinpath("log.schema.json").read_text())
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def test_the_log_document_keeps_its_schema_and_has_no_nan() -> None:
    document = log_document(small_log())
    log_validator().validate(json.loads(json_text(document)))
    assert document["parameters"] == {"ARMING_CHECK": 1.0}
    assert document["log"]["flights"][0]["impact_s"] == 85.0
    assert document["clock"]["pieces"] == [
        {"start_s": 0.0, "boot_offset_s": 30.0, "utc_offset_s": 1.7e9}
    ]
    told = {m["name"]: m for m in document["messages"]}["VFR_HUD"]
    assert (told["count"], told["rate_hz"], told["fields"]) == (360, 4.0, {"alt": "m"})


@pytest.mark.parametrize(
    ("t", "expected"),
    [
        (np.arange(0, 9, 0.25), 4.0),
        (np.concatenate((np.arange(0, 9, 0.25), np.arange(13, 25, 0.25))), 4.0),  # a gap
        (np.arange(300) * 1e-6, None),  # a download
        (np.array([0.0, 0.1, 0.2, 60.0, 60.1, 400.0, 400.1]), None),  # now and then
        (np.arange(24) * 0.04, 25.0),  # a log of a second
        (np.array([0.0, 0.5, 1.0]), None),
        (np.empty(0), None),
    ],
)
def test_a_rate_is_that_of_a_message_while_it_comes(
    t: np.ndarray[Any, Any], expected: float | None
) -> None:
    found = rate(message("M", {"x": t}, t))
    assert found == (None if expected is None else pytest.approx(expected))
