"""The value of the whole on small logs: bits by firmware, cores, findings, and what is lacking."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flights import ROOT

from fdi.errors import LogError, UsageError
from fdi.methods.estimator import estimator_health
from fdi.methods.estimator.bits import Bit, Bits, layout, release_of
from fdi.methods.estimator.cores import Change, Selection, whipsaws
from fdi.methods.estimator.findings import _faults, fallen, growing, standing
from fdi.methods.estimator.moments import Moment, complaint_of
from fdi.methods.estimator.records import family_of, table
from fdi.methods.estimator.tree import Node, path, walk
from fdi.telemetry import read

from .build import RATIOS, px4_log, status

T = np.arange(0.0, 40.0, 0.2)
NAN = np.full(T.size, np.nan)
GPS = {"fix_type": np.full(T.size, 3.0)}


def noisy(level: float = 0.1) -> np.ndarray:
    return level * (1 + 0.3 * np.sin(7.0 * T))


def test_a_log_without_a_single_message_of_an_estimator_is_refused(tmp_path: Path) -> None:
    log = px4_log(tmp_path / "a.ulg", {"wave": (T, {"x": T})})
    with pytest.raises(LogError, match="holds no message of an estimator's health") as told:
        estimator_health(log)
    assert told.value.exit_code == 3


def test_estimator_records_without_one_known_ratio_are_still_read(tmp_path: Path) -> None:
    unknown = dict.fromkeys(RATIOS, NAN)
    health = estimator_health(
        px4_log(tmp_path / "a.ulg", {"estimator_status": status(T, **unknown)})
    )
    assert health.ratios == ()
    assert any("velocity, horizontal position, height" in note for note in health.notes)


def test_no_such_flight_is_the_callers_mistake(tmp_path: Path) -> None:
    log = px4_log(tmp_path / "a.ulg", {"estimator_status": status(T)})
    with pytest.raises(UsageError, match="has no flight 3"):
        estimator_health(log, 2)


def test_one_core_only_is_told(tmp_path: Path) -> None:
    health = estimator_health(px4_log(tmp_path / "a.ulg", {"estimator_status": status(T)}))
    assert "one core only is in this log: there is no other to compare it with" in health.notes
    assert not any("which core" in note for note in health.notes)


def test_unused_entries_are_unknown_and_no_ratio(tmp_path: Path) -> None:
    topics = {"estimator_status": status(T, tas_test_ratio=NAN, mag_test_ratio=np.zeros(T.size))}
    health = estimator_health(px4_log(tmp_path / "a.ulg", topics))
    known = [ratio.quantity for ratio in health.ratios]
    assert known == ["velocity", "horizontal position", "height"]
    assert "not used, or not in this log: the ratio of compass, airspeed" in health.notes


@pytest.mark.parametrize(
    ("release", "bit", "name", "doubt"),
    [
        (0x010C0000, 16, "bad_acc_vertical", ""),
        (0x010F0000, 10, "bad_acc_vertical", ""),
        (0x010C0000, 9, "bad_vel_n", ""),
        (0x010D0000, 9, "bit 9", "bits from 9 on of release 1.13 by number"),
        (0x010D0000, 0, "bad_mag_x", "bits from 9 on of release 1.13 by number"),
        (None, 0, "bit 0", "the log does not say which firmware wrote it: bits by number"),
    ],
)
def test_fault_bits_have_the_names_of_their_firmware(
    tmp_path: Path, release: int | None, bit: int, name: str, doubt: str
) -> None:
    mask = np.where((T >= 10) & (T < 12), 2.0**bit, 0.0)
    topics = {"estimator_status": status(T, filter_fault_flags=mask)}
    health = estimator_health(px4_log(tmp_path / "a.ulg", topics, release=release))
    (found,) = health.bits.of("fault")
    assert found.name == name
    assert found.spans == ((pytest.approx(10.0), pytest.approx(12.0)),)
    told = [note for note in health.notes if "filter_fault_flags" in note]
    assert told == ([f"estimator_status.filter_fault_flags: {doubt}"] if doubt else [])


def test_fields_of_their_own_go_before_a_mask(tmp_path: Path) -> None:
    flags = {"fs_bad_mag_x": (T > 20) * 1.0, "reject_yaw": (T > 30) * 1.0, "cs_gps": T * 0 + 1}
    topics = {
        "estimator_status": status(T, filter_fault_flags=np.full(T.size, 2.0)),
        "estimator_status_flags": (T, flags),
    }
    health = estimator_health(px4_log(tmp_path / "a.ulg", topics, release=None))
    assert [bit.name for bit in health.bits.of("fault")] == ["bad_mag_x"]
    assert [bit.name for bit in health.bits.of("rejected")] == ["yaw"]
    assert health.bits.spans("fault", "bad_mag_y", 0) is None
    assert health.bits.spans("control", "gps", 0) != ()


@pytest.mark.parametrize("row", table("masks")["masks"], ids=lambda row: row["field"])
def test_every_layout_holds_each_name_once(row: dict) -> None:  # type: ignore[type-arg]
    for one in row["layouts"]:
        names = [name for name in one["bits"] if name is not None]
        assert len(set(names)) == len(names)


@pytest.mark.parametrize(
    ("release", "count"), [((1, 11), 12), ((1, 12), 13), ((1, 14), 13), (None, 0)]
)
def test_reject_bits_are_twelve_before_1_12_and_thirteen_after(
    release: tuple[int, int] | None, count: int
) -> None:
    rows = table("masks")["masks"]
    row = next(r for r in rows if r["field"] == "estimator_status.innovation_check_flags")
    names, doubt = layout(row, release)
    assert len(names) in (count, 0)
    assert bool(doubt) == (release is None or release < (1, 12))


def test_release_of_a_firmware() -> None:
    assert release_of("PX4 1.15.0beta (b589596a)") == (1, 15)
    assert release_of("ArduCopter V4.6.3 (8264a9b4)") == (4, 6)
    assert release_of("PX4") is None


def change(t: float, before: int, after: int) -> Change:
    return Change(t, before, after)


def test_three_changes_within_30_s_are_a_whipsaw() -> None:
    far = [change(0, 0, 1), change(20, 1, 2), change(31, 2, 3)]
    near = [change(0, 0, 1), change(20, 1, 2), change(29, 2, 3)]
    assert whipsaws(far) == ()
    assert whipsaws(near) == ((0, 29),)


def test_a_return_within_10_s_is_a_whipsaw() -> None:
    assert whipsaws([change(5, 0, 1), change(14, 1, 0)]) == ((5, 14),)
    assert whipsaws([change(5, 0, 1), change(16, 1, 0)]) == ()
    assert whipsaws([change(5, 0, 1)]) == ()
    assert whipsaws([change(5, 0, 1), change(14, 1, 2)]) == ()


def test_changes_carry_the_reason_of_their_own_line(tmp_path: Path) -> None:
    number = np.where((T >= 10) & (T < 10.4), 1.0, 0.0)
    topics = {
        "estimator_status": status(T),
        "estimator_status[1]": status(T),
        "estimator_selector_status": (T, {"primary_instance": number}),
    }
    texts = [(10.4, "[ekf2] primary EKF changed 1 (filter fault) -> 0")]
    health = estimator_health(px4_log(tmp_path / "a.ulg", topics, texts=texts))
    told = [(c.before, c.after, c.reason) for c in health.selection.changes]
    assert told == [(0, 1, ""), (1, 0, "filter fault")]
    assert [one.kind for one in health.findings] == ["whipsaw"]


def test_a_ratio_that_stands_still_is_no_longer_fused() -> None:
    value = np.where(T < 20, noisy(), 0.05)
    ((low, high),) = standing(T, value, (0.0, 35.0))
    assert (low, high) == (pytest.approx(20.0), pytest.approx(35.0))


@pytest.mark.parametrize(
    "value",
    [
        np.round(noisy(0.02), 2),  # hundredths repeat by rounding
        np.where(T < 20, noisy(), 0.0),  # nothing was fused
        np.where(T < 20, noisy(), 2.0),  # rejected, at the end of its scale
        np.where(T < 20, noisy(), np.nan),
        np.where((T > 20) & (T < 23), 0.05, noisy()),  # too short
    ],
    ids=["hundredths", "zero", "saturated", "unknown", "short"],
)
def test_what_looks_like_rest_and_is_none(value: np.ndarray) -> None:
    assert standing(T, value, (0.0, 40.0)) == ()


def test_a_bit_falls_where_it_is_gone_for_a_second() -> None:
    air = (5.0, 50.0)
    assert fallen([(0.0, 20.0)], air) == ((20.0, 50.0),)
    assert fallen([(0.0, 20.0), (20.5, 60.0)], air) == ()
    assert fallen([(0.0, 20.0), (25.0, 60.0)], air) == ((20.0, 25.0),)
    assert fallen([(0.0, 3.0)], air) == ()
    assert fallen([], air) == ()


@pytest.mark.parametrize("name", ["px4_quad", "px4_hexa", "copter_gusts", "plane_turbulence"])
def test_nothing_falls_where_a_sparse_link_ends_before_the_flight(name: str) -> None:
    log = read(ROOT / "examples" / "healthy_logs" / f"{name}.tlog")
    assert [one.text for one in estimator_health(log).findings if one.kind == "not fused"] == []


def test_a_ratio_that_grows_for_a_minute_is_a_drift() -> None:
    t = np.arange(0.0, 120.0, 0.5)
    ramp = np.clip((t - 30) / 60, 0.0, 1.0) * 0.2 + 0.05
    ((low, high, growth),) = growing(t, ramp, (0.0, 120.0), 0.05)
    assert low < 36
    assert high > 84
    assert growth == pytest.approx(5.0, rel=0.3)


def test_a_ratio_that_grows_and_falls_is_no_drift() -> None:
    t = np.arange(0.0, 120.0, 0.5)
    assert growing(t, 0.1 + 0.05 * np.sin(t / 6.0), (0.0, 120.0), 0.1) == ()
    assert growing(t, 0.1 + 0.0002 * t, (0.0, 120.0), 0.1) == ()


def test_gps_that_stops_leads_to_the_failsafe(tmp_path: Path) -> None:
    fixes = T[T <= 20.0]
    invalid, late = (T >= 25.0) * 1.0, (T >= 25.2) * 1.0
    topics = {
        "estimator_status": status(T, vel_test_ratio=noisy(), pos_test_ratio=noisy()),
        "vehicle_gps_position": (fixes, {"fix_type": np.full(fixes.size, 3.0)}),
        "vehicle_global_position": (T, {"dead_reckoning": (T >= 21.0) * 1.0, "eph": T * 0 + 1}),
        "vehicle_local_position": (T, {"xy_valid": 1 - invalid, "eph": T * 0 + 1}),
        "vehicle_status_flags": (T, {"condition_local_position_valid": 1 - late}),
        "vehicle_status": (T, {"failsafe": late, "nav_state": late * 0, "arming_state": T * 0 + 2}),
    }
    health = estimator_health(px4_log(tmp_path / "a.ulg", topics))
    tree = health.trees[0]
    assert [(node.name, round(node.since or 0, 3)) for node in path(tree)] == [
        ("no GPS measurement", 20.0),
        ("dead reckoning", 21.0),
        ("nothing to hold the position by for 5 s", 25.0),
        ("the estimator gives up its solution (xy_valid)", 25.0),
        ("local position invalid", 25.2),
        ("the commander is in failsafe", 25.2),
    ]


def test_flags_of_newer_firmware_are_inverted(tmp_path: Path) -> None:
    topics = {
        "estimator_status": status(T),
        "failsafe_flags": (T, {"local_position_invalid": ((T >= 15) & (T < 18)) * 1.0}),
    }
    health = estimator_health(px4_log(tmp_path / "a.ulg", topics, release=0x010F0000))
    position = health.trees[0].children[0]
    assert position.spans == ((pytest.approx(15.0), pytest.approx(18.0)),)
    assert position.because == "failsafe_flags.local_position_invalid"


def test_what_holds_at_take_off_already_is_no_complaint() -> None:
    held, later = Node("held", ((5.0, 9.0),)), Node("later", ((7.0, 9.0),))
    selection = Selection("", np.empty(0), np.empty(0, np.int64), (), ())
    assert complaint_of((), (held,), selection, 5.0) is None
    assert complaint_of((), (held, later), selection, 5.0) == Moment(7.0, "later")


def test_no_aid_time_is_the_parameters(tmp_path: Path) -> None:
    fixes = T[T <= 20.0]
    topics = {
        "estimator_status": status(T),
        "vehicle_gps_position": (fixes, {"fix_type": np.full(fixes.size, 3.0)}),
        "vehicle_local_position": (T, {"xy_valid": T * 0 + 1}),
    }
    file = tmp_path / "a.ulg"
    health = estimator_health(px4_log(file, topics, parameters={"EKF2_NOAID_TOUT": 2_000_000}))
    lost = health.trees[0].children[0].children[0].children[0]
    assert lost.name == "nothing to hold the position by for 2 s"
    assert lost.since == pytest.approx(22.0)


def test_a_recorder_that_pauses_is_no_gps_that_stops(tmp_path: Path) -> None:
    kept = (T < 20) | (T > 30)
    t = T[kept]
    topics = {
        "estimator_status": status(t),
        "vehicle_gps_position": (t, {"fix_type": np.full(t.size, 3.0)}),
        "vehicle_local_position": (t, {"xy_valid": t * 0 + 1}),
    }
    health = estimator_health(px4_log(tmp_path / "a.ulg", topics))
    position = health.trees[0].children[0]
    assert position.since is None
    assert position.children[1].spans == ()


def test_resets_are_told_with_the_state_that_jumps(tmp_path: Path) -> None:
    topics = {"estimator_status": status(T, reset_count_pos_ne=np.where(T < 12, 1.0, 2.0))}
    (reset,) = estimator_health(px4_log(tmp_path / "a.ulg", topics)).resets
    assert (reset.state, reset.core) == ("horizontal position", 0)
    assert reset.t == pytest.approx(12.0)


def test_innovations_come_with_variance_and_ratio_where_the_log_has_them(tmp_path: Path) -> None:
    fields = {"gps_hvel[0]": noisy(1.0)}
    rows = {"gps_hvel": noisy(1.0)}
    topics = {
        "estimator_status": status(T),
        "estimator_innovations": (T, rows),
        "estimator_innovation_variances": (T, {"gps_hvel": T * 0 + 4.0}),
    }
    (one,) = estimator_health(px4_log(tmp_path / "a.ulg", topics)).innovations
    assert one.variance is not None
    assert np.all(one.variance == 4.0)
    assert one.ratio is None
    assert one.level == pytest.approx(np.median(fields["gps_hvel[0]"][T <= 20]), rel=1e-6)


def test_reading_twice_gives_the_same(tmp_path: Path) -> None:
    file = tmp_path / "a.ulg"
    px4_log(file, {"estimator_status": status(T, filter_fault_flags=(T > 20) * 3.0)})
    a, b = estimator_health(read(file)), estimator_health(read(file))
    assert (a.findings, a.notes, a.bits, a.trees) == (b.findings, b.notes, b.bits, b.trees)


def test_a_ratio_that_is_not_used_is_not_said_to_be_missing(tmp_path: Path) -> None:
    topics = {"estimator_status": status(T, vel_test_ratio=np.zeros(T.size))}
    (tree, *_) = estimator_health(px4_log(tmp_path / "a.ulg", topics)).trees
    (test, *_) = [node for node, _, _ in walk(tree) if "test after take-off" in node.name]
    assert test.spans is None
    assert test.because == "a ratio of velocity or position is not used, or not in this log"


@pytest.mark.parametrize(
    ("spans", "at", "said"),
    [
        (((0.0, 100.0),), 20.0, "which was there before and all through the flight"),
        (((30.0, 31.0), (40.0, 41.0)), 30.0, ", 2 times"),
        (((0.0, 25.0),), 20.0, "filter fault bit 0 of "),
        (((0.0, 15.0),), None, ""),
    ],
)
def test_a_fault_bit_that_is_set_all_through_a_log_is_no_event_of_its_first_second(spans, at, said):
    """Old firmware writes a constant into the mask."""
    told = [*_faults(Bits((Bit("fault", "bit 0", 1, "EKF4.FS", spans, 0.0),), ()), (20.0, 90.0))]
    assert [one.t for one in told] == ([] if at is None else [at])
    assert all(said in one.text for one in told)


@pytest.mark.parametrize(
    ("group", "name"),
    [(None, "PX4 EKF2"), (2.0, "PX4 EKF2"), (1.0, "PX4 LPE"), (3.0, "PX4 attitude estimator Q")],
)
def test_the_estimator_has_the_name_of_the_one_that_is_chosen(
    tmp_path: Path, group: float | None, name: str
) -> None:
    """All of them publish ``estimator_status``."""
    chosen = {} if group is None else {"SYS_MC_EST_GROUP": group}
    log = px4_log(tmp_path / "a.ulg", {"estimator_status": status(T)}, parameters=chosen)
    assert family_of(log).name == name


@pytest.mark.parametrize(
    ("parameters", "said"),
    [({}, False), ({"AHRS_EKF_USE": 1.0}, False), ({"AHRS_EKF_USE": 0.0}, True)],
)
def test_an_estimator_that_the_vehicle_does_not_fly_on_is_told(
    parameters: dict[str, float], said: bool
) -> None:
    log = read(ROOT / "examples" / "crash_logs" / "copter_motor_failure_crash.tlog")
    others = {k: v for k, v in log.parameters.items() if not k.startswith("AHRS_EKF")}
    notes = estimator_health(replace(log, parameters=others | parameters, _cache={})).notes
    assert any("does not fly on this estimator" in note for note in notes) == said
