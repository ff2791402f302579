"""No test of a shipped model is off for want of a synonym: what never runs has a reason."""

import tarfile
from pathlib import Path

import pytest
from flights import SHARED, analysis_of

from fdi.model.parts import Kind

pytestmark = pytest.mark.flights

ARCHIVE = SHARED / "closed_loop.tar.xz"
SECOND = {
    "att_7": "second estimator", "att_8": "second estimator", "acc_stk_2": "second unit",
    "accelerometer_2_frozen": "second unit", "mag_stk_2": "second compass",
    "mag_2": "second compass",
    "compass_2_frozen": "second compass", "SCALED_PRESSURE2.press_abs:frozen": "second barometer",
    "alt_5": "second barometer", "barometer_2_scatters": "second barometer",
    "rng_1": "range finder", "rangefinder_scaled": "range finder",
    "srf_7": "second aileron", "srf_8": "third aileron", "aileron_2_output_held": "second aileron",
    "aileron_3_output_held": "third aileron", "mom_aileron_2": "second aileron",
    "aileron_2_turns_otherwise": "second aileron", "mom_aileron_3": "third aileron",
    "aileron_3_turns_otherwise": "third aileron",
}  # fmt: skip
"""Parts that the vehicle does not have."""
THREE = dict.fromkeys(
    (
        f"{name}_{unit}_departs"
        for name in ("gyroscope", "accelerometer", "compass", "barometer")
        for unit in (1, 2, 3)
    ),
    "fewer than three units of it, of which one could be voted out",
)
UNSET = dict.fromkeys(("battery_low", "battery_empty"), "the vehicle sets no such limit")
SAME = {"est_7": "one channel is a copy of the other, and their relation holds whatever happens"}
ALWAYS_THERE = {
    "health_5": "radio control is there all along, or never",
    "rc_gone": "likewise",
    "speed_lost_at_full_throttle": "the plane never needs full throttle",
}
STREAM = dict.fromkeys(
    ("gps_sil", "alt_sil", "mag_sil", "air_sil", "gps_is_silent", "barometer_silent",
     "compass_silent", "airspeed_silent"),
    "ArduPilot sends its streams whatever a sensor does",
)  # fmt: skip
INSIDE = dict.fromkeys(
    ("mag_sil", "compass_silent", "air_sil", "airspeed_silent"),
    "PX4's telemetry has compass and airspeed inside messages that go on",
)
USED = ("gyroscope", "accelerometer", "compass", "barometer", "airspeed", "gps")
SWITCHED_OFF = (
    *(f"used_{i}" for i in range(len(USED))),
    *(f"{name}_switched_off" for name in USED),
)
NOT_LOGGED = dict.fromkeys(
    (*SWITCHED_OFF, "health_4", "rc_lost", "board_supply", "memory_short", "processor_overload"),
    "the log does not hold it: no SYS_STATUS, POWR, PM; no input_rc where none is connected",
)
NOT_SENT = dict.fromkeys(("board_supply", "memory_short"), "PX4 sends neither supply nor memory")
METRICS = dict.fromkeys(
    ("vibration_x_grown", "vibration_y_grown", "vibration_z_grown"),
    "PX4's VIBRATION is coning and high frequency metrics",
)
NEVER_STOOD = dict.fromkeys(
    ("acc_rst_1", "accelerometer_1_weighs"), "no three seconds of standing are on the record"
)
NO_CURRENT = dict.fromkeys(("bat_3", "bat_5"), "the simulated battery has no current")
NO_PARAMETERS = dict.fromkeys(
    ("en_8", "engine_gives_less_thrust"), "FW_AIRSPD_TRIM was not downloaded"
)
OFF = dict.fromkeys(("rec_1", "rec_2", "rec_3", "rec_4"), "nothing was recovered before")
NOT_OBSERVED = dict.fromkeys(
    (
        *(f"observed_{name}" for name in ("north", "east", "height", "velocity", "roll", "pitch")),
        "observed_heading",
        *(f"motor_{i}_observed_weak" for i in range(1, 7)),
    ),
    "the method observer runs only where it is asked for",
)
ONE_UNIT = {"twin_gyroscopes": "PX4's telemetry, and a log of one unit, have one gyroscope"}
_UNTOLD = "PX4's telemetry does not tell which way is meant"
NOT_MEANT = {"rolls_against_its_ailerons": _UNTOLD, "pitches_against_its_elevator": _UNTOLD}
NO_SURFACES = dict.fromkeys(
    (
        *(f"srf_{i}" for i in range(1, 7)),
        *(
            f"{name}_{what}"
            for name in ("aileron", "elevator", "rudder")
            for what in ("far_from_trim", "output_held", "turns_otherwise")
        ),
        *(f"mom_{name}" for name in ("aileron", "elevator", "rudder")),
    ),
    "the telemetry of this VTOL has the lifting motors' outputs alone",
)
NO_FRAME = dict.fromkeys(
    (
        f"{name}_{motor}{what}"
        for motor in range(1, 5)
        for name, what in (
            ("ext", ""),
            ("idl", ""),
            ("stk", ""),
            ("motor", "_given_more"),
            ("motor", "_output_held"),
        )
    ),
    "the telemetry of this VTOL does not say where its lifting motors are",
) | dict.fromkeys(
    ("roll_not_followed_on_rotors", "pitch_not_followed_on_rotors"),
    "PX4 sends no demanded attitude (NAV_CONTROLLER_OUTPUT) of a VTOL on its rotors",
)
GENTLE = dict.fromkeys(
    ("energy_lost_at_full_throttle", "engine_at_idle", "throttle_taken_away",
     "en_2", "en_3", "en_11"),
    "the plane never needs full throttle, and is never told to stop",
)  # fmt: skip
ONE_TURN = dict.fromkeys(
    ("air_9", "airspeed_jumped"),
    "80 s on its wings with one turn: a jump of the wind explains them as well",
)
POOR_LINK = dict.fromkeys(
    ("pos_9", "gps_position_creeps", "alt_4", "barometer_scatters"),
    "the link loses a second within every minute of this flight, and in its beginning every 10 s",
)
UNTOLD = dict.fromkeys(
    ("turns_against_its_motors", "throws_its_motors"),
    "no parameter of this flight tells where its motors are",
)
ON_BOARD = dict.fromkeys(("link_1", "link_silent"), "a recorder on board has no link")
NO_RATES = dict.fromkeys(
    (
        f"{name}_{motor}{what}"
        for motor in range(1, 7)
        for name, what in (
            ("rot", ""),
            ("spn", ""),
            ("lds", ""),
            ("sil", ""),
            ("motor", "_stands_still"),
            ("motor", "_turns_otherwise"),
            ("motor", "_draws_otherwise"),
            ("motor", "_is_silent"),
        )
    ),
    "simulated motor controllers say nothing, or that nothing turns",
)
NO_SINK_RATE = dict.fromkeys(
    ("alt_6", "estimator_sinks_otherwise"),
    "telemetry sends no vertical velocity of the receiver: GPS_RAW_INT has none",
)
NO_RESTART = dict.fromkeys(
    (
        *(f"restart_{i}" for i in range(1, 4)),
        *(f"restart_{why}" for why in ("powered", "board", "battery")),
    ),
    "no autopilot started anew",
)
OF_PX4 = {"vibration_grown": "PX4's own level stands in its logs alone"}
NEVER_FLEW = {"swings_on_its_legs": "only a vehicle that never leaves the ground is asked"}
FIRST = dict.fromkeys(
    ("pow_1", "motors_draw_otherwise"),
    "no policy of earlier flights is at hand, from which this one could depart",
)
ANY = (
    NEVER_FLEW
    | FIRST
    | NO_RATES
    | SECOND
    | THREE
    | UNSET
    | ALWAYS_THERE
    | OFF
    | NOT_OBSERVED
    | NO_RESTART
)
PX4_TLOG = ANY | OF_PX4 | NO_SINK_RATE | INSIDE | NOT_SENT | METRICS | ONE_UNIT | NO_CURRENT
PX4_ULOG = ANY | SAME | NOT_LOGGED | METRICS | NO_CURRENT | ON_BOARD
NO_LOAD = {"processor_overload": "a simulated autopilot sends a load of 0 in every record"}
ARDUPILOT_TLOG = ANY | OF_PX4 | NO_SINK_RATE | SAME | STREAM | NO_LOAD
ARDUPILOT_BIN = ANY | OF_PX4 | NOT_LOGGED | ON_BOARD
CASES = {
    "sitl/plane/p02_rect_wind_land.tlog": ARDUPILOT_TLOG,
    "sitl/plane/p01_rect_calm.BIN": ARDUPILOT_BIN | NEVER_STOOD,
    "sitl/copter/c03_ref_square_wind.tlog": ARDUPILOT_TLOG,
    "sitl/copter/c03_ref_square_wind.BIN": ARDUPILOT_BIN,
}
CLOSED_LOOP = {
    "s20_0024_plane_healthy.tlog": PX4_TLOG | NO_PARAMETERS | NOT_MEANT,
    "s20_0024_plane_healthy.ulg": PX4_ULOG | NEVER_STOOD,
    "s20_0043_quad_healthy.tlog": PX4_TLOG | POOR_LINK | UNTOLD,
    "s20_0045_quad_healthy.ulg": PX4_ULOG | ONE_UNIT | NEVER_STOOD,
    "s20_0036_hexa_healthy.tlog": PX4_TLOG,
    "s20_0036_hexa_healthy.ulg": PX4_ULOG,
    "s20_0016_vtol_healthy.tlog": (
        PX4_TLOG | NO_PARAMETERS | NO_SURFACES | NO_FRAME | GENTLE | NOT_MEANT | ONE_TURN
    ),
}
"""Healthy flights of each vehicle, autopilot and format, and what may never run on them."""


def never_run(path: Path) -> set[str]:
    """Return the statements of the model that some component answers for and no test judged."""
    found = analysis_of(path)
    equations, ran = found.system.equations, set()
    for row, generator in enumerate(found.bank.generators):
        if (found.alarms.state[row] != -1).any():
            ran |= {equations[i].name for i in generator.equations}
    judged = {
        e.name for e in found.airframe.equations if e.kind in (Kind.LIMIT, Kind.EQUALITY) or e.fault
    }
    return judged - ran


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory):
    if not ARCHIVE.is_file():
        pytest.skip("no ../shared")
    folder, wanted = tmp_path_factory.mktemp("closed_loop"), set(CLOSED_LOOP)
    with tarfile.open(ARCHIVE) as archive:
        for member in archive:
            if Path(member.name).name in wanted:
                (folder / Path(member.name).name).write_bytes(archive.extractfile(member).read())
                wanted.discard(Path(member.name).name)
            if not wanted:
                break
    return folder


@pytest.mark.skipif(not SHARED.is_dir(), reason="no ../shared")
@pytest.mark.parametrize("name", CASES)
def test_what_never_runs_on_ardupilot_has_a_reason(name):
    assert never_run(SHARED / name) - set(CASES[name]) == set()


@pytest.mark.parametrize("name", CLOSED_LOOP)
def test_what_never_runs_on_px4_has_a_reason(name, unpacked):
    assert never_run(unpacked / name) - set(CLOSED_LOOP[name]) == set()
