"""What speaks for a component, and what against it."""

from fdi.diagnosis import diagnose

from .build import FLIGHTS, alarms_of, bank_of, model, row


def answer(bank, raised, **more):
    return diagnose(alarms_of(bank, raised, flights=FLIGHTS, **more), bank)


SHOWN = {"gps": ["x"], "baro": ["x"], "radar": ["x"]}


def test_what_is_computed_is_asked_last():
    text = model({"estimator": ["x"], "gps": ["x"]}, {"estimator": [], "gps": []})
    bank = bank_of(text.replace("estimator: {affects", "estimator: {computed: true, affects"))
    (finding,) = answer(bank, {0: [(40, 60)]}, peak=10.0).findings
    assert finding.component == "gps"


def test_the_one_that_all_alarms_share_is_accused_and_the_agreeing_pair_is_not():
    bank = bank_of(model(SHOWN))
    pair = {row(bank, "GPS.x", name): [(40, 60)] for name in ("BARO.x", "RADAR.x")}
    assert [f.component for f in answer(bank, pair).findings] == ["gps"]


def test_weak_evidence_that_concerns_several_accuses_nobody():
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}))
    assert answer(bank, {0: [(40, 60)]}, peak=1.2).findings == ()
    assert answer(bank, {0: [(40, 60)]}, peak=9.0).findings != ()


def test_what_supports_accuses_nobody_alone_and_counts_beside_another():
    more = "equalities:\n  level: {text: x = 0, supports: true, solves: []}\n"
    bank = bank_of(model({"gps": ["x"], "baro": ["x"]}, more=more))
    level, pair = row(bank, "GPS.x"), row(bank, "GPS.x", "BARO.x")
    assert answer(bank, {level: [(40, 60)]}, peak=9.0).findings == ()
    assert answer(bank, {pair: [(40, 60)]}, peak=1.2).findings == ()
    (finding,) = answer(bank, {level: [(40, 60)], pair: [(40, 60)]}, peak=1.2).findings
    assert finding.component == "gps"
