"""A recovered block in place of the failed one: what becomes unknown, which file does not fit."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

import fdi
from fdi.errors import LogError
from fdi.methods.heading import cross_check, recover
from fdi.methods.heading.recovery import REPLACED
from fdi.methods.heading.replaced import BLOCKS, with_recovered
from fdi.report.recovered import write_recovered
from fdi.telemetry import Log

from ..setup.sensors import Ride
from .rides import flown

SINCE = 35.0
LOST = Path(__file__).parents[3] / "examples/crash_logs/copter_gps_loss_landing.tlog"


@pytest.fixture(scope="module")
def healthy(tmp_path_factory: pytest.TempPathFactory) -> Log:
    return flown(tmp_path_factory.mktemp("ride") / "healthy.tlog")


def written(log: Log, block: str, path: Path) -> Path:
    return write_recovered(recover(log, cross_check(log), block, SINCE), path)


@pytest.mark.parametrize("block", REPLACED)
@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_its_own_channels_are_unknown_from_then_on_and_the_recovered_known(
    healthy: Log, tmp_path: Path, block: str, ending: str
) -> None:
    path = written(healthy, block, tmp_path / f"x.{ending}")
    log = with_recovered(healthy, path)
    own = BLOCKS[f"recovered_{block}"]
    message = log[own.message]
    for field in (one for one in own.fields if one in message):
        before, now = healthy[own.message].si(field), message.si(field)
        gone = message.t >= SINCE + 0.2
        assert np.isnan(now[gone]).all()
        assert np.array_equal(now[message.t < SINCE], before[message.t < SINCE], equal_nan=True)
    made = log[f"recovered_{block}"]
    table = pd.read_csv(path) if ending == "csv" else pd.read_parquet(path)
    assert np.allclose(made.t, table.t_s)
    assert np.isfinite(made.si("sigma")).all()


def test_the_other_sensors_of_the_same_message_stay(healthy: Log, tmp_path: Path) -> None:
    log = with_recovered(healthy, written(healthy, "magnetometer", tmp_path / "x.csv"))
    for field in ("xgyro", "yacc"):
        assert np.array_equal(log["RAW_IMU"].si(field), healthy["RAW_IMU"].si(field))
    assert np.isfinite(healthy["RAW_IMU"].si("xmag")).all()


def test_what_a_receiver_says_of_itself_stays(healthy: Log, tmp_path: Path) -> None:
    """Else what follows from a lost fix has no cause left, and another sensor is accused of it."""
    log = with_recovered(healthy, written(healthy, "satellite", tmp_path / "x.csv"))
    message, before = log["GPS_RAW_INT"], healthy["GPS_RAW_INT"]
    assert np.isnan(message.si("alt")[message.t > SINCE + 0.2]).all()
    for field in ("fix_type", "satellites_visible"):
        assert np.array_equal(message.si(field), before.si(field), equal_nan=True)


def test_a_lost_fix_stays_the_first_failure_with_its_position_recovered(tmp_path: Path) -> None:
    log = fdi.read(LOST)
    path = write_recovered(recover(log, cross_check(log)), tmp_path / "x.csv")
    found = fdi.analyze(LOST, recovered=path)
    assert [one.component for one in found.findings] == ["gps"]


def test_an_analysis_reads_what_was_recovered_with_its_deviation(
    healthy: Log, tmp_path: Path
) -> None:
    log = with_recovered(healthy, written(healthy, "magnetometer", tmp_path / "x.csv"))
    model = tmp_path / "compass.yaml"
    model.write_text("format: 1\nname: compass\ninclude: [shared/recovered.yaml]\n")
    chain = fdi.residuals_of(log, model)
    rows = [
        i
        for i, one in enumerate(chain.bank.generators)
        if "recovered_magnetometer.heading" in one.faults
    ]
    late = chain.residuals.t > SINCE + 5
    values, spread = (x[rows][:, late] for x in (chain.residuals.values, chain.residuals.spread))
    known = np.isfinite(values)
    assert known.any()
    sigma = np.radians(pd.read_csv(tmp_path / "x.csv").sigma_heading_deg)
    assert spread[known].min() >= sigma.min()
    assert not chain.policy.decide(chain.residuals).alarm[rows].any()


def test_a_file_of_another_flight_is_refused(healthy: Log, tmp_path: Path) -> None:
    path = written(healthy, "satellite", tmp_path / "x.csv")
    other = flown(tmp_path / "other.tlog", Ride(rate=9.0))
    with pytest.raises(LogError, match=r"is not of other\.tlog: its times are no records of it"):
        with_recovered(other, path)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a,b\n1,2\n3,4\n", "holds no recovered block"),
        ("t_s,heading_deg,sigma_heading_deg\nx,1,2\ny,1,2\n", "holds no numbers as t_s"),
        ("t_s,heading_deg,sigma_heading_deg\n2,1,2\n1,1,2\n", "its times are no records"),
        ("", "cannot be read as a table"),
    ],
)
def test_what_is_no_recovery_is_refused_in_one_line(
    healthy: Log, tmp_path: Path, text: str, said: str
) -> None:
    path = tmp_path / "x.csv"
    path.write_text(text)
    with pytest.raises(LogError, match=said):
        with_recovered(healthy, path)


def test_a_file_that_is_not_there_is_told(healthy: Log, tmp_path: Path) -> None:
    with pytest.raises(LogError, match="is no file"):
        with_recovered(healthy, tmp_path / "nothing.parquet")
