"""What does a terminal say about several flights? The page of ``fdi compare``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Final

from fdi.comparison import Comparison, Difference, Setting
from fdi.report.text import heading, table, text
from fdi.report.words import at, number, plural, span, unit
from fdi.units import customary

if TYPE_CHECKING:
    from rich.console import RenderableType

MOST_TESTS: Final = 12
MOST_SETTINGS: Final = 40


def comparison_summary(found: Comparison) -> Iterator[RenderableType]:
    """Yield what a terminal shows of a comparison."""
    healthy = sum(one.is_healthy for one in found.flights)
    yield text(
        f"{plural(len(found.flights), 'flight')} of a {found.vehicle}, model {found.model}: "
        f"{plural(len(found.tests), 'common test')}, the band is made of "
        f"{plural(healthy, 'healthy flight')}",
        "bold",
    )
    yield from _flights(found)
    yield from _tests(found)
    yield from _identified(found)
    yield from _settings(found)
    if found.notes:
        yield heading("Notes")
        for note in found.notes:
            yield text(f"  {note}")


def _flights(found: Comparison) -> Iterator[RenderableType]:
    yield heading("Flights")
    made = table("", "flight", "in the air", "band", "accused", "tests outside", "furthest")
    for place, flight in enumerate(found.flights):
        own = [one for one in found.differences if one.flight == place]
        outside = sum(one.bands > 1 for one in own)
        furthest = f"{number(own[0].bands, 3)} bands" if own else "–"
        made.add_row(
            *map(
                text,
                (
                    place + 1,
                    flight.name,
                    span(flight.seconds),
                    "yes" if flight.is_healthy else "no",
                    ", ".join(flight.accused) or "nobody",
                    f"{outside} of {len(own)}",
                    furthest,
                ),
            )
        )
    yield made


def by_test(found: Comparison) -> list[Difference]:
    """Return the largest difference of every test, the furthest first.

    Of the flights that do not make the band; where all do, of all.
    """
    healthy = all(one.is_healthy for one in found.flights)
    best: dict[int, Difference] = {}
    for one in found.differences:
        if healthy or not found.flights[one.flight].is_healthy:
            best.setdefault(one.test, one)
    return list(best.values())


def _tests(found: Comparison) -> Iterator[RenderableType]:
    outside = [one for one in by_test(found) if one.bands > 1]
    yield heading("Tests that differ most")
    if not outside:
        who = "No flight" if all(one.is_healthy for one in found.flights) else "None of the others"
        yield text(f"  {who} leaves the band of the healthy flights for a second.")
        return
    made = table("test", "flight", "bands", "from, s", "residual", "band")
    for one in outside[:MOST_TESTS]:
        test = found.tests[one.test]
        shown = customary(test.unit)
        sign = test.way or 1  # what violates a statement that has but one side is shown above zero
        value, middle = (v * shown.scale * sign for v in (one.value, one.middle))
        half = one.half * shown.scale
        made.add_row(
            *map(
                text,
                (
                    f"{test.ids[one.flight]} {test.statement}",
                    one.flight + 1,
                    number(one.bands, 3),
                    at(one.since),
                    f"{number(value, 3)} {unit(shown.unit)}".strip(),
                    f"{number(middle, 2)} +- {number(half, 2)}",
                ),
            )
        )
    yield made
    more = len(outside) - MOST_TESTS
    if more > 0:
        yield text(f"  and {plural(more, 'further test')} outside the band")
    yield text(
        "  bands: how far off the middle, in half widths of a band that holds every healthy flight "
        "by the others; from: after take-off; a test that states one side only counts on that side"
    )


def _identified(found: Comparison) -> Iterator[RenderableType]:
    if not found.identified:
        return
    yield heading("Identified values")
    made = table("parameter", "with each log")
    for one in found.identified:
        shown = customary(one.unit)
        cells = [
            f"{name}: –"
            if value is None or std is None
            else f"{name}: {number(value * shown.scale, 3)} +- {number(std * shown.scale, 1)}"
            for name, value, std in zip(_numbered(found), one.values, one.stds, strict=True)
        ]
        made.add_row(*map(text, (f"{one.name} {unit(shown.unit)}".strip(), "   ".join(cells))))
    yield made


def _settings(found: Comparison) -> Iterator[RenderableType]:
    yield heading("Parameters that differ")
    if not found.settings:
        yield text("  none, of those that two logs hold")
        return
    made = table("parameter", "value (flights)")
    for one in found.settings[:MOST_SETTINGS]:
        made.add_row(text(one.name), text(_values(found, one)))
    yield made
    more = len(found.settings) - MOST_SETTINGS
    if more > 0:
        yield text(f"  and {more} more, which --json lists")


def _values(found: Comparison, setting: Setting) -> str:
    """Return the values of a parameter, each once, with the flights that have it."""
    whose: dict[float | None, list[str]] = {}
    for name, value in zip(_numbered(found), setting.values, strict=True):
        whose.setdefault(value, []).append(name)
    digits = next(
        (n for n in range(4, 9) if len({number(value, n) for value in whose}) == len(whose)), 9
    )
    parts = (
        f"{'not told' if value is None else number(value, digits)} ({', '.join(own)})"
        for value, own in whose.items()
    )
    return "   ".join(parts)


def _numbered(found: Comparison) -> Sequence[str]:
    """Return the logs by the numbers of their flights, which are short."""
    return [
        "+".join(str(i + 1) for i, flight in enumerate(found.flights) if flight.log == log)
        for log in range(len(found.logs))
    ]
