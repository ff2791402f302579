"""The world at the place and day of a flight: known where the log tells both, else unknown."""

from types import SimpleNamespace

import numpy as np
import pytest

from fdi.model.world import undated, world_value


def log_at(lat, lon, utc="2020-01-01T00:00:00Z", message="GPS_RAW_INT"):
    """A log with positions, deg; ``utc`` is the day of its first record."""
    columns = {"lat": np.radians(lat), "lon": np.radians(lon)}
    return FakeLog(
        {message: SimpleNamespace(fields=tuple(columns), si=columns.__getitem__)},
        SimpleNamespace(utc=lambda t: utc),
    )


class FakeLog:
    def __init__(self, messages, clock):
        self.messages, self.clock = messages, clock

    def __contains__(self, name):
        return name in self.messages

    def __getitem__(self, name):
        return self.messages[name]


# NOAA/NCEI and BGS, The US/UK World Magnetic Model for 2020-2025, table of test values, 0 km
PUBLISHED = [
    ((80, 0), "2020-01-01T00:00:00Z", -1.28, 55000.1),
    ((0, 120), "2020-01-01T00:00:00Z", 0.16, 41104.9),
    ((-80, 240), "2020-01-01T00:00:00Z", 69.36, 55120.6),
    ((80, 0), "2022-07-02T00:00:00Z", 0.01, 55101.7),
]


@pytest.mark.parametrize(("place", "day", "declination_deg", "strength_nt"), PUBLISHED)
def test_field_is_that_of_the_published_test_values(place, day, declination_deg, strength_nt):
    log = log_at([place[0]], [place[1]], day)
    assert np.degrees(world_value("magnetic_declination", log)) == pytest.approx(
        declination_deg, abs=0.01
    )
    assert world_value("magnetic_strength", log) * 1e9 == pytest.approx(strength_nt, abs=0.3)


def test_place_is_the_median_of_what_is_known():
    """Records without a fix read 0, 0; one wild record does not move the place."""
    clean = log_at([47.0, 47.0, 47.0], [8.0, 8.0, 8.0])
    dirty = log_at([0.0, 47.0, np.nan, 47.0, 47.0, -80.0], [0.0, 8.0, 8.0, 8.0, 8.0, 240.0])
    assert world_value("magnetic_declination", dirty) == world_value("magnetic_declination", clean)


def test_estimated_place_serves_where_the_receiver_has_none():
    known = log_at([47.0], [8.0], message="GLOBAL_POSITION_INT")
    known.messages["GPS_RAW_INT"] = log_at([0.0, np.nan], [0.0, np.nan])["GPS_RAW_INT"]
    alone = log_at([47.0], [8.0])
    assert world_value("magnetic_strength", known) == world_value("magnetic_strength", alone)


def test_without_a_place_the_field_is_unknown():
    assert world_value("magnetic_strength", log_at([0.0, np.nan], [0.0, np.nan])) is None
    assert world_value("magnetic_strength", log_at([47.0], [8.0], message="OTHER")) is None


def test_day_beyond_the_newest_model_takes_the_newest():
    late = world_value("magnetic_declination", log_at([47.0], [8.0], "2041-06-01T00:00:00Z"))
    last = world_value("magnetic_declination", log_at([47.0], [8.0], "2029-12-28T00:00:00Z"))
    assert late == pytest.approx(last, abs=np.radians(0.01))


@pytest.mark.parametrize("day", [None, "1970-01-01T00:00:05Z", "2009-12-31T00:00:00Z"])
def test_without_a_day_the_field_is_known_within_two_degrees(day):
    """A clock that was never set is no reason to leave every compass untested."""
    for year in (2011, 2029):
        dated = log_at([47.0], [8.0], f"{year}-07-01T00:00:00Z")
        undated_log = log_at([47.0], [8.0], day)
        names = "magnetic_declination", "magnetic_strength"
        turned, grown = (world_value(n, undated_log) - world_value(n, dated) for n in names)
        assert abs(np.degrees(turned)) < 2.0
        assert abs(grown) < 1e-6
        assert list(undated(dated)) == []
    assert "2020" in next(undated(undated_log))


def test_without_a_place_no_field_is_assumed():
    nowhere = log_at([np.nan], [np.nan], None)
    assert world_value("magnetic_strength", nowhere) is None
    assert list(undated(nowhere)) == []
