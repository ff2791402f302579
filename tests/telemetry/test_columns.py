"""Arrays, frames and tables of one's own are logs like any other."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import fdi
from fdi.errors import LogError, UsageError
from fdi.report.convert import convert
from fdi.telemetry import read
from fdi.telemetry.formats import FORMATS

MODEL = """
format: 1
name: pair
components: {tank: {group: sensor}}
variables: {p: {unit: Pa}}
measurements:
  A: {component: tank, fields: {p: {variable: p, accuracy: 1 Pa}}}
  B: {component: tank, fields: {p: {variable: p, accuracy: 1 Pa}}}
"""
T = np.arange(0.0, 30.0, 0.5)


def columns() -> dict[str, np.ndarray]:
    """Two sensors of one pressure, the second in kPa."""
    pressure = 1000 + 10 * np.sin(T)
    return {"t": T, "A.p": pressure, "B.p": (pressure + 3) / 1000}


UNITS = {"A.p": "Pa", "B.p": "kPa"}


def frame() -> pd.DataFrame:
    """The same with units in the names."""
    return pd.DataFrame({"t [s]": T, "A.p [Pa]": columns()["A.p"], "B.p [kPa]": columns()["B.p"]})


def residual(log, folder: Path) -> np.ndarray:
    path = folder / "pair.yaml"
    path.write_text(MODEL, encoding="utf-8")
    return fdi.residuals_of(log, path).residuals.values


def test_arrays_give_the_residual_that_their_units_say(tmp_path):
    found = residual(fdi.log_from_columns(columns(), UNITS), tmp_path)
    assert np.abs(found).max() == pytest.approx(3.0)
    assert np.isfinite(found).all()


@pytest.mark.parametrize("how", ["frame", "index", "csv", "semicolons", "parquet"])
def test_every_way_in_gives_the_same_residual(how, tmp_path):
    own, path = frame(), tmp_path / "table"
    if how in ("frame", "index"):
        plain = pd.DataFrame(columns())
        log = fdi.log_from_columns(plain if how == "frame" else plain.set_index("t"), UNITS)
    else:
        if how == "parquet":
            own.to_parquet(path)
        else:
            own.to_csv(path, index=False, sep=";" if how == "semicolons" else ",")
        log = read(path)
        assert log.format == "table"
    expected = residual(fdi.log_from_columns(columns(), UNITS), tmp_path)
    assert residual(log, tmp_path) == pytest.approx(expected, abs=1e-9)


def test_what_convert_writes_of_a_message_is_read_back(tmp_path):
    log = fdi.log_from_columns(columns(), UNITS)
    back = read(convert(log, tmp_path / "out") / "B.parquet")
    assert back.channel("B.p").unit == "Pa"
    assert back.channel("B.p").value == pytest.approx(log.channel("B.p").value)


def test_nan_is_unknown_and_never_bridged(tmp_path):
    given = columns()
    given["A.p"][20] = np.nan
    found = residual(fdi.log_from_columns(given, UNITS), tmp_path)
    assert np.flatnonzero(np.isnan(found[0])).tolist() == [20]


def test_a_message_may_have_times_of_its_own():
    given = {**columns(), "B.t": np.where(np.arange(60) % 2, np.nan, T)}
    log = fdi.log_from_columns(given, UNITS)
    assert len(log["A"]) == 60
    assert len(log["B"]) == 30


def test_times_out_of_order_are_repaired_and_told():
    given = columns()
    given["t"] = given["t"].copy()
    given["t"][[3, 4]] = given["t"][[4, 3]]
    given["t"][10] = given["t"][9]
    log = fdi.log_from_columns(given, UNITS)
    assert (np.diff(log["A"].t) > 0).all()
    assert {q.kind for q in log.quality} == {"repaired", "duplicate"}
    assert log.channel("A.p").value[3] == given["A.p"][4]


@pytest.mark.parametrize(
    ("given", "units", "said"),
    [
        ({"t": [0, 1], "A.p": [1]}, {}, "has 1 values"),
        ({"A.p": [1.0]}, {}, "no times"),
        ({"t": [0.0]}, {}, "no channel"),
        ({"t": ["a"], "A.p": [1]}, {}, "not made of numbers"),
        ({"t": [np.nan], "A.p": [1]}, {}, "no record with a time"),
        ({"t": [0], "VFR_HUD.nothing": [1]}, {}, "no field"),
        ({"t": [0], "p": [1], "DATA.p": [1]}, {}, "one channel"),
        ({"t": [0], "p": [1]}, {"t": "m"}, "no time"),
    ],
)
def test_what_is_wrong_is_one_line(given, units, said):
    with pytest.raises(LogError, match=said):
        fdi.log_from_columns(given, units)


def test_a_unit_of_no_column_is_refused():
    with pytest.raises(UsageError, match="no column"):
        fdi.log_from_columns({"t": [0], "p": [1]}, {"q": "m"})


@pytest.mark.parametrize("text", ["a,b\n1,2\n", "time", "FMT, 128, 89, FMT, BBnNZ\n"])
def test_other_texts_are_no_tables(text):
    data = np.frombuffer(text.encode(), np.uint8)
    assert not FORMATS["table"].is_it(data)


def test_a_damaged_table_is_one_line(tmp_path):
    path = tmp_path / "t.csv"
    for body in (
        b"t,A.p\n1,x\n",
        b"PAR1 and nothing else",
        b"t,A.p\n1,2,3,4\n1,2\n",
        b"t,t\n1,2\n",
    ):
        path.write_bytes(body)
        with pytest.raises(LogError):
            read(path)
