"""What a pilot sees: it fits the terminal, names the component and says how long ago."""

import io
import os
from types import SimpleNamespace

import numpy as np
import pytest
from rich.console import Console

from fdi.live import screen, watching
from fdi.live.hearing import Hearing, Speaker
from fdi.live.observing import SHOWN_S, Observing, Recent
from fdi.live.screen import bank_view, headline, observer_view, sparkline
from fdi.live.watching import Accused, Watching
from fdi.methods.observer.limits import Alarm
from fdi.methods.observer.motor import WeakMotor
from fdi.methods.observer.states import RESIDUALS

NOW = 100.0


@pytest.fixture
def heard() -> Hearing:
    return Hearing(speaker=Speaker(1, 1, "quad", "ardupilot"), boot_s=NOW)


@pytest.fixture
def flown() -> Observing:
    """A minute in which vz goes beyond its threshold 20 s ago and motor 1 is weak."""
    t = np.arange(NOW - 60, NOW, 0.1)
    off = np.full((len(RESIDUALS), t.size), 0.1)
    off[RESIDUALS.index("vz"), t > NOW - 20] = 3.0
    seen = Observing()
    seen.recent = Recent(t, np.full(t.size, 10.0), off, np.ones(off.shape))
    seen.alarms = [Alarm("vz", NOW - 20, NOW - 0.1, 3.0, 1.0)]
    seen.motors = [WeakMotor(1, NOW - 20, NOW - 0.1)]
    return seen


@pytest.fixture
def watched() -> Watching:
    t = np.arange(NOW - 60, NOW, 0.25)
    strength = np.full((40, t.size), 0.2)
    strength[7, t > NOW - 12] = 4.0
    bank = SimpleNamespace(
        generators=[SimpleNamespace(id=f"r{k}") for k in range(40)],
    )
    seen = Watching(says=("GPS receiver shows another latitude than the estimator, " * 3,) * 40)
    seen.alarms = SimpleNamespace(
        residuals=SimpleNamespace(bank=bank, t=t), strength=strength, unfit=np.zeros(40, bool)
    )
    seen.known = [watching.TestAlarm(7, NOW - 12, NOW - 0.25)]
    seen.accused = [Accused("gps", "GPS receiver", NOW - 12, NOW - 10, 0.997)]
    return seen


def drawn(view, size: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> list[str]:
    monkeypatch.setattr(screen.shutil, "get_terminal_size", lambda: os.terminal_size(size))
    page = io.StringIO()
    Console(file=page, width=size[0], color_system=None, emoji=False).print(view())
    return page.getvalue().rstrip("\n").split("\n")


@pytest.mark.parametrize("size", [(40, 24), (80, 24), (200, 50)])
def test_the_observers_view_fits_and_shows_what_is_newest(
    size: tuple[int, int], heard: Hearing, flown: Observing, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = drawn(lambda: observer_view(heard, flown), size, monkeypatch)
    assert len(lines) <= size[1]
    rows = [line for line in lines if line.split()[:1] and line.split()[0] in RESIDUALS]
    assert len(rows) == len(RESIDUALS)  # none is wrapped
    assert rows[RESIDUALS.index("vz")].rstrip().endswith("█")
    assert " ".join(lines).startswith("MOTOR 1 is weak, it began 20 s ago")


@pytest.mark.parametrize("size", [(60, 16), (80, 24), (200, 50)])
def test_the_banks_view_fits_and_begins_with_the_test_in_alarm(
    size: tuple[int, int], heard: Hearing, watched: Watching, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = drawn(lambda: bank_view(heard, watched), size, monkeypatch)
    assert len(lines) <= size[1]
    rows = [line for line in lines if line.split()[:1] and line.split()[0][1:].isdigit()]
    assert len(rows) == len(lines) - len(lines[: lines.index(rows[0])])  # none is wrapped
    assert rows[0].split()[:2] == ["r7", "4.00"]
    assert "█ " in rows[0]
    assert "GPS receiver shows" in rows[0]
    assert " ".join(lines).startswith("ACCUSED: GPS receiver, 99 % sure, it began 12 s ago")


def test_what_has_ended_is_told_as_such_and_silence_too(heard: Hearing, flown: Observing) -> None:
    flown.motors = [WeakMotor(1, NOW - 40, NOW - 22)]
    heard._is_silent = True
    found = headline(heard, flown)
    assert found.startswith("MOTOR 1 is weak, it began 40 s ago, it ended 22 s ago")
    assert "THE LINK IS DEAD" in found


def test_before_anything_is_known_it_says_what_is_waited_for() -> None:
    assert headline(Hearing(), Observing()) == "waiting for a vehicle  [nobody heard yet]"


def test_a_sparkline_is_blank_where_nothing_is_known() -> None:
    t = np.array([NOW - SHOWN_S + 1, NOW - 1])
    found = sparkline(t, np.array([np.nan, 0.0]), now=NOW)
    assert found == " " * 29 + "▁"


def test_a_line_is_inert_whoever_wrote_it(capsys: pytest.CaptureFixture[str]) -> None:
    """A component's name comes from a model, a vehicle's from the air."""
    with screen.screen(lambda: "") as tell:
        tell(["12.0 s: \x1b[31m\x1b]0;harm\x07\u202e[bold]motor[/bold]"])
    assert capsys.readouterr().out == "12.0 s: [31m]0;harm[bold]motor[/bold]\n"
