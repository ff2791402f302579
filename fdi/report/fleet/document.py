"""What is on the page of many logs? One HTML text from the rows of ``fdi batch``.

In: rows. Out: a page that opens offline, with a table to sort and filter, and the trends of each
vehicle. It holds no data for scripts: the table is the data, and reads as well without them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any, Final, NamedTuple
from urllib.parse import quote

from fdi import __version__
from fdi.report.fleet.flagged import bad_end, flights_of, is_flagged, names_of, rank_of, worst_first
from fdi.report.fleet.sparks import CURVES, spark_svg
from fdi.report.fleet.vehicles import told_of, vehicles_of
from fdi.report.page.script import policy_of, script, style
from fdi.report.page.templates import templates
from fdi.report.words import span

Row = Mapping[str, Any]
SCRIPT: Final = "fleet.js"
STYLES: Final = ("report.css", "fleet.css")
_ENDS: Final = {
    "landed": "landed",
    "in_air": "the recording stops in flight",
    "on_ground": "stayed on the ground",
    None: "no flight",
}


class Accused(NamedTuple):
    """Who is accused, in a person's words, from when on, s of the log's clock, and 0..1."""

    name: str
    onset_s: float
    confidence: float


@dataclass(frozen=True, slots=True)
class Line:
    """A row of the table as it is shown.

    Attributes
    ----------
    number : int
        From 1; what trends refer to.
    row : Row
    name, folder : str
        Of the log.
    link : str
        To its report, "" for none.
    when : str
        Date and time, UTC, to the minute; "" where the log does not tell.
    flown : str
        Time in the air.
    ended : str
    rank : int
        Of the end, the worst first, for sorting.
    state : str
        ``flagged``, ``failed`` or ``quiet``.
    sparks : tuple of str
        SVG of height and speed, "" for none.
    accused : tuple of Accused
        For each finding.
    names : mapping of str to str
        What a person calls each component.
    same_flight_as : str
        The name of the first log of its flight, "" where it is that itself.
    """

    number: int
    row: Row
    name: str
    folder: str
    link: str
    when: str
    flown: str
    ended: str
    rank: int
    state: str
    sparks: tuple[str, ...]
    accused: tuple[Accused, ...]
    names: Mapping[str, str]
    same_flight_as: str

    def called(self, components: Sequence[str]) -> list[str]:
        """Return what a person calls components."""
        return [self.names[one] for one in components]


def fleet_page(rows: Sequence[Row], table: str) -> str:
    """Return the page of many logs.

    Parameters
    ----------
    rows : sequence of mapping
        As `fdi.fleet.analyze_log` returns them; ``report`` is relative to the page.
    table : str
        The name of the table beside the page.
    """
    from markupsafe import Markup

    sheet, own = style(STYLES), script(SCRIPT)
    lines = [_line(place + 1, rows[place]) for place in worst_first(rows)]
    return (
        templates()
        .get_template("fleet.html.j2")
        .render(
            csp=policy_of((own,), sheet),
            style=Markup(sheet),
            script=Markup(own),
            version=__version__,
            table=table,
            lines=lines,
            counts={
                "all": len(lines),
                **{state: _count(lines, state) for state in ("flagged", "failed", "quiet")},
                "to_look_at": flights_of(line.row for line in lines if line.state == "flagged"),
            },
            kinds=sorted({row["vehicle"] for row in rows if row["vehicle"]}),
            vehicles=[(one, told_of(one)) for one in vehicles_of(rows)],
            models=sorted({row["model"] for row in rows if row["model"]}),
            policies=sorted({row["policy"] for row in rows}),
        )
    )


def _count(lines: Sequence[Line], state: str) -> int:
    return sum(line.state == state for line in lines)


def _line(number: int, row: Row) -> Line:
    path = PurePath(row["path"])
    failed = row["error"] is not None
    when, names = row["start_utc"], names_of(row)
    return Line(
        number=number,
        row=row,
        name=path.name,
        folder=str(path.parent) if path.parent != PurePath() else "",
        link="" if row["report"] is None else quote(f"{row['report']}/report.html"),
        when=f"{when[:10]} {when[11:16]}" if when else "",
        flown="" if not row["airborne_s"] else span(row["airborne_s"]),
        ended="" if failed else bad_end(row) or _ENDS.get(row["ended"], str(row["ended"])),
        rank=rank_of(row),
        state="failed" if failed else "flagged" if is_flagged(row) else "quiet",
        sparks=tuple(_spark(name, row) for name in CURVES),
        accused=tuple(
            Accused(
                names.get(one["component"], one["component"]), one["onset_s"], one["confidence"]
            )
            for one in row["findings"]
        ),
        names=names,
        same_flight_as=""
        if row["same_flight_as"] is None
        else PurePath(row["same_flight_as"]).name,
    )


def _spark(name: str, row: Row) -> str:
    onsets = [one["onset_s"] for one in row["findings"]]
    return next(
        (spark_svg(one, onsets) for one in row["curves"] if one["name"] == name and one["t"]), ""
    )
