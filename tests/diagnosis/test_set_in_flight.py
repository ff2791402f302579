"""What left health after a parameter was set in the air: counted from the first, and no trigger."""

from fdi.diagnosis.set_in_flight import orders_by_parameter
from fdi.telemetry import Event

from .build import alarms_of, bank_of, model, row

BANK = bank_of(model({"gps": ["x"], "baro": ["x"], "sun": ["y"], "star": ["y"]}))
SKY, HEIGHT = row(BANK, "SUN.y", "STAR.y"), row(BANK, "GPS.x", "BARO.x")


def told(raised, *names, triggered=()):
    """Return what is told of parameters set at 40, 41, ... s."""
    events = [
        Event(40.0 + i, "parameter", name, value=1.0, before=0.0) for i, name in enumerate(names)
    ]
    alarms = alarms_of(BANK, raised, events=tuple(events))
    for start, end in triggered:
        alarms.state[HEIGHT, 4 * start : 4 * end] = 1
    (fact,) = orders_by_parameter(alarms)
    return fact.text


def test_what_follows_a_list_counts_from_its_first():
    assert "(log 40.0 s); 5.0 s later: " in told({SKY: [(45, 60)]}, "A")
    assert "(log 40.0 to 41.0 s); 5.0 s after the first: " in told({SKY: [(45, 60)]}, "A", "B")


def test_a_trigger_is_not_told_as_what_came_of_it():
    assert told({}, "A", triggered=[(42, 44)]).endswith("(log 40.0 s)")
    both = told({SKY: [(45, 60)]}, "A", triggered=[(42, 44)])
    assert "; 5.0 s later: " in both
