"""Parameters of the log: what means "not set", in whose words, and what is told of it."""

from dataclasses import replace

import numpy as np
import pytest
from flights import shared
from telemetry.build import Flight, mav, record

import fdi
from fdi.errors import ModelError
from fdi.model import load_airframe
from fdi.model.codec import decode, encode
from fdi.model.parameters import assumptions, value_of, with_learned
from fdi.model.system import Estimate
from fdi.residuals import Differentiation, build_bank
from fdi.telemetry import Sampling

TEXT = """format: 1
name: small
components:
  battery: {group: power}
  engine: {group: propulsion}
variables:
  u: {unit: "1"}
  voltage: {unit: V}
  ratio: {unit: "1"}
  extra: {unit: "1"}
parameters:
  low:
    value: 1000
    unit: us
    log:
      - {name: MOT_MIN, unset: [0], autopilot: ardupilot}
      - {name: RC3_MIN, autopilot: ardupilot}
      - {name: [OUT_MIN1, OUT_MIN], unset: [-1], autopilot: px4, unless: [SIMULATED, HEARTBEAT]}
  least: {unit: V, log: {name: BATT_CRT, unset: [0], scale: 0.001}}
  cruise: {unit: "1", log: {name: CRUISE}}
  unused: {value: 3, unit: m, log: {name: NOBODY_ASKS}}
equations:
  e_1: {text: "ratio = u/cruise", solves: [ratio]}
  e_2: {text: "extra = ratio - 1", solves: [extra], fault: engine.thrust, component: engine}
limits:
  l_1: {variable: voltage, min: least, component: battery}
  l_2: {variable: extra, max: 2, component: engine}
measurements:
  SERVO_OUTPUT_RAW:
    fields:
      servo1_raw: {variable: u, value: "servo1_raw - low"}
  SYS_STATUS:
    fields:
      voltage_battery: {variable: voltage, accuracy: 0.1 V}
"""


@pytest.fixture
def small(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(TEXT, encoding="utf-8")
    return load_airframe(path)


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.tlog"
    status = [
        record(t, mav.MAVLink_sys_status_message(0, 0, 0, 0, 12000, 100, 80, 0, 0, 0, 0, 0, 0))
        for t in np.arange(0.0, 25.0)
    ]
    parts = sorted([*Flight().records(), *status], key=lambda part: part[:8])
    path.write_bytes(b"".join(parts))
    return fdi.read(path)


def with_parameters(log, **parameters):
    return replace(log, parameters=parameters)


@pytest.mark.parametrize(
    ("parameters", "autopilot", "value"),
    [
        ({"MOT_MIN": 1100.0, "RC3_MIN": 980.0}, "ardupilot", 1100.0),
        ({"MOT_MIN": 0.0, "RC3_MIN": 980.0}, "ardupilot", 980.0),
        ({"RC3_MIN": 980.0}, "ardupilot", 980.0),
        ({}, "ardupilot", 1000.0),
        ({"RC3_MIN": 980.0}, "px4", 1000.0),  # there it is the stick's alone
    ],
)
def test_the_first_source_that_is_set_tells_the_value(small, log, parameters, autopilot, value):
    log = replace(with_parameters(log, **parameters), autopilot=autopilot)
    assert value_of(small.parameters["low"], log).value == value


@pytest.mark.parametrize(
    ("parameters", "value"),
    [
        ({"OUT_MIN1": 1075.0}, 1075.0),
        ({"OUT_MIN1": -1.0, "OUT_MIN": 1050.0}, 1050.0),
        ({"OUT_MIN1": 1075.0, "SIMULATED": 1.0}, 1000.0),
        ({"OUT_MIN1": 1075.0, "SIMULATED": 0.0}, 1075.0),
    ],
)
def test_a_source_does_not_count_where_the_log_has_what_makes_it_void(
    small, log, parameters, value
):
    sources = tuple(replace(s, unless=s.unless[:1]) for s in small.parameters["low"].sources)
    low = replace(small.parameters["low"], sources=sources)
    log = replace(with_parameters(log, **parameters), autopilot="px4")
    assert value_of(low, log).value == value
    with_message = small.parameters["low"]  # every log has a HEARTBEAT
    assert value_of(with_message, log).value == 1000.0


def test_a_limit_that_the_vehicle_does_not_set_is_no_test_and_told(small, log):
    unset = small.observe(with_parameters(log, BATT_CRT=0.0, MOT_MIN=1000.0, CRUISE=0.4))
    assert "l_1" not in [e.name for e in unset.equations]
    assert "the vehicle sets no BATT_CRT: without the tests of battery that need it" in (
        unset.warnings
    )
    given = small.observe(with_parameters(log, BATT_CRT=10500.0, MOT_MIN=1000.0, CRUISE=0.4))
    assert "l_1" in [e.name for e in given.equations]
    assert given.parameters["least"].value == 10.5
    assert not any("BATT_CRT" in warning for warning in given.warnings)


def test_what_only_an_unknown_parameter_determines_goes_with_it(small, log):
    lacking = small.observe(with_parameters(log, BATT_CRT=9000.0))
    names = [e.name for e in lacking.equations]
    assert not {"e_1", "e_2", "l_2"} & set(names)
    assert "l_1" in names
    assert "not in this log: CRUISE: without the tests of engine that need it" in lacking.warnings


def test_what_was_assumed_is_told_in_one_line_and_only_where_it_is_used(small, log):
    told = small.observe(with_parameters(log, BATT_CRT=9000.0, CRUISE=0.4)).warnings
    assert [w for w in told if "assumed" in w] == ["not in this log, so assumed: MOT_MIN 1000 us"]
    # set to what means "not set" is no assumption: the model's value is what that means
    told = small.observe(with_parameters(log, BATT_CRT=9000.0, CRUISE=0.4, MOT_MIN=0.0)).warnings
    assert not [w for w in told if "assumed" in w]


def test_without_a_log_every_test_counts_as_possible(small):
    system = small.observe()
    assert {"l_1", "e_1", "l_2"} <= {e.name for e in system.equations}
    assert not system.warnings


@pytest.mark.parametrize("case", shared("crash/motor2_lost.bin"))
def test_the_motor_that_was_lost_is_named_by_outputs_over_the_range_of_the_stick(case):
    found = fdi.analyze(case.path).findings
    assert found[0].component == "motor_2"


def test_step_is_the_time_between_the_records_that_a_test_reads(tmp_path):
    """A grid of 2 Hz makes no more of records that are 0.8 s apart on average."""
    text = TEXT.replace("max: 2,", 'max: 2, when: "step < 0.7",')
    path = tmp_path / "gated.yaml"
    path.write_text(text, encoding="utf-8")
    flight = Flight(rate=10.0).records()
    full = tmp_path / "full.tlog"
    full.write_bytes(b"".join(flight))
    for spacing, is_known in ((None, True), (0.8, False)):
        log = with_parameters(fdi.read(full), BATT_CRT=9000.0, CRUISE=0.4)
        system = load_airframe(path).observe(log)
        signals = log.signals(system.channels, Sampling(rate_hz=2.0))
        if spacing is not None:
            signals = replace(signals, spacing=dict.fromkeys(signals.spacing, spacing))
        bank = build_bank(system, "mtes+cross_checks")
        values = bank.evaluate(signals, Differentiation()).values
        assert bool(np.isfinite(values).any()) is is_known


FRAME = """format: 1
name: framed
description: ""
for: {i: [1, 2, 3, 4]}
components: {rotors: {group: propulsion}, power: {group: power}}
variables:
  u_{i}: {unit: "1"}
  roll: {unit: "1"}
  yaw: {unit: "1"}
  voltage: {unit: V}
parameters:
  r_{i}: {unit: "1", frame: "roll_{i}"}
  y_{i}: {unit: "1", frame: "yaw_{i}"}
equations:
  rol: {text: "roll = r_1*u_1 + r_2*u_2 + r_3*u_3 + r_4*u_4", solves: [roll], component: rotors}
  yaw: {text: "yaw = y_1*u_1 + y_2*u_2 + y_3*u_3 + y_4*u_4", solves: [yaw], component: rotors}
limits:
  tilts: {variable: roll, max: 1, component: rotors}
  turns: {variable: yaw, max: 1, component: rotors}
  low: {variable: voltage, min: 9, component: power}
inputs:
  MOTORS:
    fields:
      motor_{i}: {variable: "u_{i}"}
measurements:
  SYS_STATUS: {fields: {voltage_battery: {variable: voltage}}}
"""
X = {"FRAME_CLASS": 1.0, "FRAME_TYPE": 1.0}


@pytest.fixture
def framed(tmp_path):
    path = tmp_path / "framed.yaml"
    path.write_text(FRAME, encoding="utf-8")
    return load_airframe(path)


def test_a_parameter_takes_its_value_from_the_frame(framed, log):
    system = framed.observe(with_parameters(log, **X))
    values = {name: parameter.value for name, parameter in system.parameters.items()}
    assert [values[f"r_{i}"] for i in (1, 2, 3, 4)] == [-1, 1, 1, -1]
    assert [values[f"y_{i}"] for i in (1, 2, 3, 4)] == [1, 1, -1, -1]
    assert {"tilts", "turns", "rol", "yaw"} <= {e.name for e in system.equations}
    assert not [w for w in system.warnings if "motors stand" in w]


def test_where_the_frame_is_unknown_what_needs_it_is_left_out_and_told(framed, log):
    system = framed.observe(with_parameters(log, FRAME_CLASS=15.0, FRAME_TYPE=1.0))
    assert {e.name for e in system.equations} & {"tilts", "turns", "rol", "yaw", "low"} == {"low"}
    assert (
        "this log does not tell where the motors stand and which way they turn: without the tests "
        "of rotors that need it" in system.warnings
    )


def test_where_only_the_turn_is_unknown_the_rest_is_tested(framed, log):
    at = {"PX": (1, -1, 1, -1), "PY": (1, -1, -1, 1)}
    places = {f"CA_ROTOR{n}_{k}": float(at[k][n]) for n in range(4) for k in at}
    told = replace(with_parameters(log, CA_ROTOR_COUNT=4.0, **places), autopilot="px4")
    names = {e.name for e in framed.observe(told).equations}
    assert {"tilts", "rol"} <= names
    assert not {"turns", "yaw"} & names


def test_without_a_log_the_frame_is_unknown_and_every_test_possible(framed):
    assert {"tilts", "turns"} <= {e.name for e in framed.observe().equations}


@pytest.mark.parametrize("entry", ["roll_0", "roll_13", "lift_1", "roll_01", "roll"])
def test_what_a_frame_does_not_have_is_refused(tmp_path, entry):
    path = tmp_path / "bad.yaml"
    path.write_text(FRAME.replace("roll_{i}", entry), encoding="utf-8")
    with pytest.raises(ModelError, match="frame"):
        load_airframe(path)


@pytest.mark.parametrize(
    "other", ["log: {name: ROLL}", "identify: {prior: 0, bounds: [-1, 1], zero: roll}"]
)
def test_a_frame_takes_no_other_source(tmp_path, other):
    path = tmp_path / "bad.yaml"
    path.write_text(FRAME.replace('"roll_{i}"', f'"roll_{{i}}", {other}'), encoding="utf-8")
    with pytest.raises(ModelError, match="is told by the frame, and by nothing else but a value"):
        load_airframe(path)


@pytest.mark.parametrize(
    ("autopilot", "told", "value", "is_assumed"),
    [
        ("ardupilot", {}, 0.3, True),
        ("ardupilot", {"FRAME_CLASS": 1.0, "FRAME_TYPE": 0.0}, 0.0, False),
        ("ardupilot", {"FRAME_CLASS": 1.0, "FRAME_TYPE": 99.0}, np.nan, False),
        ("px4", {"SYS_AUTOSTART": 4999.0}, 0.3, True),
    ],
)
def test_a_value_counts_where_the_log_names_no_frame(
    framed, log, autopilot, told, value, is_assumed
):
    """A frame that is named and not known is no reason to take another one."""
    log = replace(log, autopilot=autopilot, vehicle="quad", parameters=told)
    parameter = replace(framed.parameters["r_3"], value=0.3)
    found = value_of(parameter, log)
    assert found.value == pytest.approx(value, nan_ok=True)
    assert (found.source == "default") == is_assumed
    said = assumptions({"r_3": parameter}, framed.equations, (), log)
    assert bool([line for line in said if "stand and turn as in the model" in line]) == is_assumed


def test_a_parameter_of_the_frame_is_kept_with_the_model(framed):
    again = decode(type(framed), encode(framed))
    assert again.parameters["r_3"].frame == "roll_3"


IDENTIFIED = """format: 1
name: small
components: {gps: {}}
variables: {v: {unit: m/s}, w: {unit: m/s}, off: {unit: m/s}}
parameters:
  drag: {unit: m/s, identify: {prior: 0.5, bounds: [-2, 2], zero: off}}
  fixed: {unit: m/s, value: 3}
equations:
  e_1: {text: off = v - w - drag, solves: [off]}
measurements:
  A: {component: gps, fields: {v: {variable: v, accuracy: 1 m/s}}}
  B: {component: gps, fields: {w: {variable: w, accuracy: 1 m/s}}}
"""


@pytest.fixture
def identified(tmp_path):
    path = tmp_path / "small.yaml"
    path.write_text(IDENTIFIED, encoding="utf-8")
    return load_airframe(path).observe()


@pytest.mark.parametrize("value", [-2.0, 1.25, 2.0])
def test_what_earlier_flights_told_of_a_parameter_takes_the_place_of_the_prior(identified, value):
    told = Estimate(value, 0.1, 4)
    found = with_learned(identified, {"drag": told}).parameters
    assert (found["drag"].value, found["drag"].std, found["drag"].source) == (value, 0.1, "policy")
    assert found["drag"].learned == told
    assert found["drag"].bounds == (-2.0, 2.0)
    assert found["fixed"] == identified.parameters["fixed"]
    assert with_learned(identified, {}) is identified


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("drag", 2.1, "mine.yaml: calibration.parameters: the value 2.1 of drag is not within"),
        ("drag", -2.1, "bounds \\[-2, 2\\]"),
        ("fixed", 3.0, "no parameter 'fixed' to identify in small, which identifies drag"),
        ("nobody", 3.0, "no parameter 'nobody'"),
    ],
)
def test_what_cannot_have_been_learned_is_refused(identified, name, value, said):
    with pytest.raises(ModelError, match=said):
        with_learned(identified, {name: Estimate(value, 0.1)}, where="mine.yaml")
