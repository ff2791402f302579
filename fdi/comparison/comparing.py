"""From analyses to a comparison: the stage itself."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fdi.comparison.aligned import check, course_of, flights_of, log_names, tests_of
from fdi.comparison.differ import Bands, differences, healthy_members
from fdi.comparison.settings import identified_of, settings_of
from fdi.comparison.values import Compared, Comparison, Test
from fdi.errors import UsageError
from fdi.result import Analysis


def compare(analyses: Sequence[Analysis], *, healthy: Sequence[bool] | None = None) -> Comparison:
    """Return several flights of one vehicle beside each other, aligned at take-off.

    Parameters
    ----------
    analyses : sequence of Analysis
        With one model and policy.
    healthy : sequence of bool, optional
        Which of them make the band; by default the flights in which nobody is accused and that do
        not end with an impact.

    Raises
    ------
    UsageError
        There are fewer than two flights, they are of different vehicles, models or policies, have
        no test in common, or none is healthy.
    LogError
        A log holds no flight.

    Examples
    --------
    ::

        found = fdi.compare([fdi.analyze(path) for path in paths])
        found.differences.to_pandas().head()
        found.plot().savefig("compared.pdf")
    """
    check(analyses)
    if healthy is not None and len(healthy) != len(analyses):
        raise UsageError(f"{len(healthy)} words on the health of {len(analyses)} analyses")
    names = log_names(analyses)
    flights = flights_of(analyses, names, healthy)
    if len(flights) < 2:
        raise UsageError(
            "holds one flight, and there is no other to compare it with",
            where=flights[0].name,
            hint="give two flights or more",
        )
    members = healthy_members(flights)
    if not members:
        raise UsageError(
            "in every flight somebody is accused or it ends with an impact",
            hint="say which of them make the band: --healthy LOG, in Python healthy=",
        )
    tests = tests_of(analyses, flights)
    courses = tuple(
        course_of(analyses[flight.log], flight, tests, place)
        for place, flight in enumerate(flights)
    )
    bands = Bands(courses)
    return Comparison(
        vehicle=analyses[0].log.vehicle,
        model=analyses[0].airframe.name,
        logs=names,
        flights=tuple(flights),
        tests=tests,
        courses=courses,
        band=bands.widened(members),
        differences=differences(flights, courses, bands),
        settings=settings_of(analyses, sorted({flights[i].log for i in members})),
        identified=identified_of(analyses),
        notes=tuple(_notes(analyses, flights, tests)),
    )


def _notes(
    analyses: Sequence[Analysis], flights: Sequence[Compared], tests: Sequence[Test]
) -> Iterator[str]:
    members = [one for one in flights if one.is_healthy]
    if len(members) < 3:
        yield (
            f"{len(members)} healthy flight{'s make' * (len(members) > 1) or ' makes'} the band: "
            "how far healthy flights differ from each other is hardly known, so differences may be "
            "usual"
        )
    longest = max(one.seconds for one in members)
    for one in flights:
        if not one.has_takeoff:
            yield f"{one.name}: begins in the air, so its times count from where tests begin"
        if one.seconds > longest + 1:
            yield (
                f"{one.name}: lasts {one.seconds:.0f} s, the longest healthy one {longest:.0f} s; "
                "after that it is held against what these did in all their time"
            )
    for number, analysis in enumerate(analyses):
        left = len(analysis.bank.generators) - len(tests)
        if left > 0:
            name = next(one.name.partition("#")[0] for one in flights if one.log == number)
            yield f"{name}: {left} of its {len(analysis.bank.generators)} tests are not in all logs"
