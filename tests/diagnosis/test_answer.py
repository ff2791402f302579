"""What is ruled out, what was not testable, the verdict, and the whole stage over a bank."""

from dataclasses import replace

import numpy as np
import pytest

from fdi.calibrate import strongest
from fdi.decision import load_policy
from fdi.diagnosis import diagnose
from fdi.diagnosis.clearing import quiet_tests
from fdi.residuals import Differentiation
from fdi.telemetry import Flight, Signals
from fdi.telemetry.events import SETTLING_S, flight_state

from .build import POLICY, RATE, alarms_of, bank_of, limit_row, model, named, row

SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"], "sun": ["y"], "star": ["y"]}
BANK = bank_of(model(SHOWN))
GPS = [row(BANK, "GPS.x", "BARO.x"), row(BANK, "GPS.x", "RADAR.x")]
BARO_RADAR, SKY = row(BANK, "BARO.x", "RADAR.x"), row(BANK, "SUN.y", "STAR.y")
FAILED = {place: [(40, 60)] for place in GPS}


def answer(raised, *, bank=BANK, close=None, **more):
    """The answer; ``close`` are quiet tests with the share of their threshold that they reach."""
    alarms = alarms_of(bank, raised, **more)
    strength = alarms.strength.copy()
    for place, share in (close or {}).items():
        strength[place] = share
    return diagnose(replace(alarms, strength=strength), bank)


# Ruled out.


def test_healthy_flight_rules_out_every_component_with_tests():
    assert named(answer({}).ruled_out) == sorted(SHOWN)


def test_component_is_ruled_out_by_its_tests_that_stayed_quiet():
    found = {item.component: item for item in answer({SKY: [(40, 60)]}).ruled_out}
    assert set(found) == {"gps", "baro", "radar"}
    assert set(found["gps"].residuals) <= {BANK.generators[place].id for place in GPS}
    said = "a lasting change of more than 2 m in either direction would have shown"
    assert found["gps"].text == f"{said} until 10 s before the end"
    (size,) = found["gps"].would_show
    assert (size.fault, size.unit) == ("GPS.x", "m")
    assert size.size == pytest.approx(2.0)  # the threshold of every test here


@pytest.mark.parametrize("accuracy", [0.5, 10.0])
def test_change_that_would_have_shown_is_that_of_the_threshold_however_accurate_a_channel(accuracy):
    bank = bank_of(model(SHOWN).replace("accuracy: 1 m", f"accuracy: {accuracy} m"))
    cleared = answer({}, bank=bank).ruled_out
    assert named(cleared) == sorted(SHOWN)
    for item in cleared:
        assert [one.size for one in item.would_show] == pytest.approx([2.0])


def test_change_that_a_mean_would_have_shown_is_beyond_the_tolerance():
    alarms = alarms_of(BANK, {})
    means, tolerance = np.full(alarms.state.shape, 0.5), np.full(len(BANK.generators), 1.25)
    wide = replace(alarms.residuals, tolerance=tolerance)
    found = diagnose(replace(alarms, residuals=wide, mean_threshold=means), BANK).ruled_out
    assert named(found) == sorted(SHOWN)
    assert {one.size for item in found for one in item.would_show} == {1.75}


@pytest.mark.parametrize(("until", "size"), [(45.0, 2.0), (47.0, 4.0)])
def test_change_that_would_have_shown_is_that_of_nine_tenths_of_the_last_minute(until, size):
    """Of 40 to 100 s; what was before does not count."""
    alarms = alarms_of(BANK, {})
    threshold = np.where(alarms.residuals.t < until, 4.0, alarms.threshold)
    found = diagnose(replace(alarms, threshold=threshold), BANK).ruled_out
    assert {one.size for item in found for one in item.would_show} == {size}


def test_test_that_was_mostly_unknown_rules_nothing_out():
    for unknown, out in ((30, False), (10, True)):
        found = answer({}, unknown={SKY: [(0, unknown)]})
        assert ({"sun", "star"} <= set(named(found.ruled_out))) == out


def test_an_alarm_in_the_middle_of_a_flight_speaks_against_what_its_test_holds():
    able, against, *_ = quiet_tests(alarms_of(BANK, {SKY: [(40, 60)]}))
    assert np.flatnonzero(against).tolist() == [SKY]
    assert able.all()


@pytest.mark.parametrize(("end", "cleared"), [(1.5, False), (2.0, True)])
def test_what_ran_for_a_moment_rules_nothing_out(end, cleared):
    """An alarm would have needed as long: two seconds, settled, have to be known."""
    found = answer({}, flights=(Flight(0, SETTLING_S + end, takeoff=0.0),))
    assert bool(found.ruled_out) == cleared


def test_time_on_the_ground_does_not_count_for_or_against_a_test():
    """Half of the log stands still; what tests of flight say in the other half is enough."""
    flights = (Flight(0, 100, takeoff=50),)
    for unknown, out in ((0, 50), True), ((50, 100), False):
        found = answer({}, unknown={SKY: [unknown]}, flights=flights)
        assert ({"sun", "star"} <= set(named(found.ruled_out))) == out


def test_every_testable_fault_needs_a_quiet_test():
    """The gps also shows z, where its test alarms after the impact: z is not shown to be right."""
    bank = bank_of(model({**SHOWN, "gps": ["x", "z"], "camera": ["z"]}))
    after = {row(bank, "GPS.z", "CAMERA.z"): [(80, 90)]}
    for raised, out in ((after, False), ({}, True)):
        found = answer(raised, bank=bank, flights=(Flight(0, 95, takeoff=5, impact=70),))
        assert ("gps" in named(found.ruled_out)) == out
        assert found.findings == ()


def test_fault_in_no_test_does_not_keep_its_component_from_being_ruled_out():
    bank = bank_of(model({**SHOWN, "gps": ["x", "alone"]}))
    assert "gps" in named(answer({}, bank=bank).ruled_out)


def test_who_cannot_be_told_from_the_accused_is_not_ruled_out():
    """A suspect of limits has quiet tests of its own, and yet may be the reason."""
    suspects = {f"r{i}": "[gps]" for i in range(5)} | {"r5": "[sun]"}
    limits = [
        f"  bad_{name}: {{variable: {name}, max: 1, component: estimator, suspects: {whom}}}\n"
        for name, whom in suspects.items()
    ]
    text = model({"monitor": list(suspects), **SHOWN}, {"estimator": []}, "limits:\n")
    text = text.replace("estimator: {affects", "estimator: {group: autopilot, affects")
    bank = bank_of(text + "".join(limits))
    raised = {limit_row(bank, f"bad_{name}"): [(40, 100)] for name in suspects}
    close = dict.fromkeys((row(bank, "GPS.x", f"{who}.x") for who in ("BARO", "RADAR")), 0.45)
    found = answer(raised, bank=bank, close=close, peak=20.0)
    named_here = {found.findings[0].component, *found.findings[0].inseparable_from}
    assert named_here == {"estimator", "gps"}
    assert "radar" in named(found.ruled_out)
    assert not named_here & set(named(found.ruled_out))


@pytest.mark.parametrize(("share", "out"), [(0.9, False), (0.0, True)])
def test_who_may_be_the_reason_is_not_ruled_out(share, out):
    """A suspect of a limit may be the reason where a test of its own comes close."""
    text = model(
        {"monitor": ["ratio"], **SHOWN},
        {"estimator": []},
        "limits:\n  bad: {variable: ratio, max: 1, component: estimator, suspects: [gps]}\n",
    ).replace("estimator: {affects", "estimator: {computed: true, affects")
    bank = bank_of(text)
    close = {row(bank, "GPS.x", "BARO.x"): share}
    found = answer({limit_row(bank, "bad"): [(40, 100)]}, bank=bank, close=close, peak=20.0)
    assert found.findings == ()
    assert ("gps" in named(found.ruled_out)) == out


def test_log_without_samples_rules_nothing_out_and_fails_nowhere():
    found = answer({}, seconds=0, flights=())
    assert (found.findings, found.ruled_out) == ((), ())
    assert set(named(found.not_testable)) == set(SHOWN)


# Not testable.


def test_component_without_a_channel_is_told_so():
    bank = bank_of(model(SHOWN, {"compass": []}))
    (item,) = answer({}, bank=bank).not_testable
    assert (item.component, item.text) == ("compass", "no test of it reads a channel of this log")


def test_component_whose_channels_are_in_no_test_is_told_so():
    bank = bank_of(model({**SHOWN, "compass": ["z"]}))
    (item,) = answer({}, bank=bank).not_testable
    assert item.component == "compass"
    assert item.text.startswith("its channels are in no test")
    assert "COMPASS.z" in item.text


def test_that_tests_are_beyond_health_from_the_beginning_is_told_as_that():
    alarms = alarms_of(BANK, {}, unknown={SKY: [(0, 100)]})
    unfit = np.ones(len(alarms.unfit), bool)
    found = diagnose(replace(alarms, unfit=unfit), BANK)
    texts = {item.text for item in found.not_testable}
    assert texts == {"its tests are beyond health as the flight begins, and judge nothing later"}


def test_component_whose_tests_never_ran_is_told_so():
    found = answer({}, unknown={SKY: [(0, 100)]})
    assert named(found.not_testable) == ["sun", "star"]
    assert {item.text for item in found.not_testable} == {"its tests never had all that they need"}


def test_a_vehicle_that_is_never_seen_to_fly_is_told_so():
    bank = bank_of(
        model(
            {**SHOWN, "eye": ["z"]}, more="limits:\n  far: {variable: z, max: 9, when: airborne}\n"
        )
    )
    sky = {row(bank, "SUN.y", "STAR.y"): [(0, 100)], limit_row(bank, "far"): [(0, 100)]}
    down = (Flight(0, 100, flew=False),)
    found = answer({}, bank=bank, flights=down, unknown=sky)
    assert found.verdict.startswith("The vehicle is never seen to fly.")
    assert {item.text for item in found.not_testable} == {
        "its tests never had all that they need, or hold in the air only"
    }
    assert "never seen" not in answer({}).verdict


def test_of_a_vehicle_that_is_not_made_to_fly_it_is_not_said_that_it_never_did():
    """A rover's model has no statement that holds in the air only."""
    found = answer({}, flights=(Flight(0, 100, flew=False),), unknown={SKY: [(0, 100)]})
    assert found.verdict.startswith("No component is accused")
    texts = {item.text for item in found.not_testable}
    assert texts == {"its tests never had all that they need"}


LIMITED = model(
    {"monitor": ["load"]},
    {"computer": []},
    "limits:\n  overload: {variable: load, max: 1, component: computer}\n",
)


def test_component_that_only_a_limit_concerns_is_testable_where_the_limit_ran():
    bank = bank_of(LIMITED)
    limit = limit_row(bank, "overload")
    assert answer({}, bank=bank).not_testable == ()
    found = answer({}, bank=bank, unknown={limit: [(0, 100)]})
    assert {i.component: i.text for i in found.not_testable} == dict.fromkeys(
        ("monitor", "computer"), "its tests never had all that they need"
    )


def test_how_far_a_limit_is_violated_is_no_strength_of_a_finding():
    """It says nothing about noise; what goes 20 times beyond its threshold does."""
    bank = bank_of(LIMITED)
    limit = alarms_of(bank, {limit_row(bank, "overload"): [(40, 100)]}, peak=20.0)
    assert strongest(limit) == [("computer", 40.0, 0.0)]
    noise = alarms_of(BANK, {place: [(40, 100)] for place in GPS}, peak=20.0)
    assert strongest(noise) == [("gps", 40.0, 20.0)]


def test_what_lies_outside_the_model_is_never_listed():
    text = model(SHOWN).replace("    component: sun\n", "")
    assert "outside_model" in bank_of(text).system.components
    found = answer({}, bank=bank_of(text), unknown={SKY: [(0, 100)]})
    assert named(found.not_testable) == ["sun", "star"]  # the sun has no channel any more


@pytest.mark.parametrize(
    ("raised", "unknown"),
    [
        ({}, {}),
        ({}, {SKY: [(0, 100)]}),
        ({SKY: [(40, 42)]}, {}),
        ({SKY: [(40, 100)]}, {BARO_RADAR: [(0, 100)]}),
        ({GPS[0]: [(40, 41)], BARO_RADAR: [(70, 71)]}, {GPS[1]: [(90, 100)]}),
        ({place: [(40, 100)] for place in GPS}, {}),
    ],
)
def test_every_component_stands_in_one_list(raised, unknown):
    text = model({**SHOWN, "camera": ["z"]}, {"compass": []})
    bank = bank_of(text)
    assert [set(one.faults) for one in bank.generators] == [set(o.faults) for o in BANK.generators]
    found = answer(raised, bank=bank, unknown=unknown, peak=5.0)
    listed = [
        *named(found.findings),
        *named(found.consequences),
        *(name for one in found.findings for name in one.inseparable_from),
        *named(found.ruled_out),
        *named(found.open),
        *named(found.not_testable),
    ]
    assert sorted(listed) == sorted({*SHOWN, "camera", "compass"})


# The verdict.


def test_verdict_names_who_failed_first_since_when_and_what_followed():
    found = answer({**{place: [(40, 100)] for place in GPS}, SKY: [(70, 100)]})
    head = "Gps failed first (93 % sure), at least 40.0 s into flight (log 40.0 s): it "
    assert found.verdict.startswith(head)
    assert found.verdict.endswith(f"Then: {found.findings[1].component}.")
    assert f"{found.findings[0].confidence * 100:.0f}" == "93"
    assert found.outlook == "accused"


def test_verdict_names_who_cannot_be_told_apart():
    """Each alone is as likely as not: together they are 88 %, and neither is called the first."""
    found = answer({SKY: [(40, 100)]})
    assert found.findings[0].confidence < 0.5
    assert found.verdict == (
        "Sun or star probably failed first (88 % sure that it was one of them, the data do not "
        "tell which), at least 40.0 s into flight (log 40.0 s): sun shows another y than the star."
    )


def test_verdict_of_a_healthy_flight_accuses_nobody_and_counts_the_tests():
    verdict = answer({}).verdict
    assert verdict.startswith("No component is accused: ")
    assert f" {len(BANK.generators)} tests" in verdict


def test_verdict_says_when_nothing_could_be_tested():
    every = {place: [(0, 100)] for place in range(len(BANK.generators))}
    assert answer({}, unknown=every).verdict == "Nothing in this telemetry could be tested."


def test_verdict_of_a_policy_that_does_not_accuse_says_so():
    verdict = answer(FAILED, policy=load_policy("paper")).verdict
    assert verdict == "This policy gives a fault grid and accuses no component."


# From channels to the answer.


def analysed(changes, *, n=800, seed=3):
    """The alarms and diagnosis of 200 s, each channel white noise of its accuracy plus a change."""
    rng, t = np.random.default_rng(seed), np.arange(n) / RATE
    columns = {
        request.channel: rng.normal(size=n) + changes.get(str(request.channel), np.zeros(n))
        for request in BANK.system.channels
    }
    period, flights = dict.fromkeys(columns, 0.0), (Flight(0, n / RATE),)
    state = flight_state(t, (), flights)
    signals = Signals(t, columns, period, state, RATE, (), flights, {}, "by hand")
    alarms = POLICY.decide(BANK.evaluate(signals, Differentiation()))
    return alarms, diagnose(alarms, BANK)


def step(size, start=560, end=800, n=800):
    return float(size) * ((np.arange(n) >= start) & (np.arange(n) < end))


def test_noise_accuses_nobody():
    assert analysed({})[1].findings == ()


@pytest.mark.parametrize("sign", [-1, 1])
def test_scaled_fault_keeps_its_component_and_its_strength_never_falls(sign):
    before = np.zeros(240)
    for size in (12, 20, 50, 300, 1e5, 1e9):
        alarms, found = analysed({"GPS.x": sign * step(size)})
        (finding,) = found.findings
        assert finding.component == "gps"
        assert finding.onset == 140.0
        strength = alarms.strength[GPS, 560:].max(axis=0)
        assert (strength >= before * (1 - 1e-12)).all()  # sums of means round
        before = strength


@pytest.mark.parametrize("channel", ["GPS.x", "BARO.x", "RADAR.x"])
def test_failed_one_of_three_is_accused_and_the_rest_ruled_out(channel):
    found = analysed({channel: step(30)})[1]
    failed = channel.split(".")[0].lower()
    assert named(found.findings) == [failed]
    assert {"sun", "star"} <= set(named(found.ruled_out))
    assert failed not in named(found.ruled_out)


def test_gap_in_the_failed_channel_neither_accuses_nor_exonerates():
    change = step(30)
    change[600:660] = np.nan
    found = analysed({"GPS.x": change})[1]
    assert named(found.findings) == ["gps"]
    assert found.grid.intervals(0, -1) == [[150.0, 165.0]]
    assert analysed({"GPS.x": np.where(np.isnan(change), np.nan, 0.0)})[1].findings == ()


def test_values_of_the_answer_cannot_be_written():
    found = analysed({})[1]
    with pytest.raises(ValueError, match="read-only"):
        found.grid.marks[0, 0] = 1
    assert repr(found) == f"<Diagnosis: {found.verdict}>"


@pytest.mark.parametrize(("later", "said"), [(3.0, "3.0 s after"), (-1.0, "1.0 s before")])
def test_what_follows_is_told_with_when_it_shows(later, said):
    """An estimator's limit, and the receiver that disturbs it."""
    text = model(
        {"monitor": ["ratio"], **SHOWN},
        {"gps": ["estimator"], "estimator": []},
        "limits:\n  bad: {variable: ratio, max: 1, component: estimator}\n",
    )
    bank = bank_of(text)
    raised = {row(bank, "GPS.x", f"{who}.x"): [(40, 60)] for who in ("BARO", "RADAR")}
    raised[limit_row(bank, "bad")] = [(40 + later, 60)]
    found = answer(raised, bank=bank, peak=20.0)
    assert named(found.findings) == ["gps"]
    (one,) = found.consequences
    assert (one.component, one.onset, one.because_of) == ("estimator", 40.0 + later, 1)
    assert one.text == f"Estimator shows it {said} the gps"


def test_who_would_explain_it_as_well_is_not_open():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"], "sun": ["y"], "star": ["y"]}))
    found = answer({row(bank, "GPS.x", "BARO.x"): [(40, 100)]}, bank=bank, peak=20.0)
    both = {found.findings[0].component, *found.findings[0].inseparable_from}
    assert both == {"gps", "baro"}
    assert not both & set(named(found.open))


def test_a_diagnosis_is_shown_as_a_table():
    found = answer({place: [(40, 100)] for place in GPS}, unknown={SKY: [(0, 100)]})
    assert repr(found) == f"<Diagnosis: {found.verdict}>"
    shown = found._repr_html_()
    assert "<td>accused</td><td>gps</td>" in shown
    assert "<td>not testable</td><td>sun, star</td>" in shown
    assert "<td>what follows</td><td>–</td>" in shown
