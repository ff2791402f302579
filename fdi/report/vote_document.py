"""What do ``fdi vote --json`` and the tables of ``--out`` hold?

In: a `Voting`. Out: plain values, and rows for CSV. Times are seconds of the first log's clock.
Every list of a value over time holds the first value and each change: ``[[t, value], ...]``. The
JSON Schema is ``vote.schema.json`` beside this file, also for `simulation_document`.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from fdi import __version__
from fdi.methods.voting import Reaction, Settings, Voting
from fdi.methods.voting.reaction import THESIS, Range
from fdi.methods.voting.voting import Voter
from fdi.report.json_text import number
from fdi.report.vote_rows import (
    error_rows,
    reaction_times,
    runs,
    selected_runs,
    times,
    vote_runs,
)
from fdi.report.vote_text import verdict

SCHEMA_VERSION: Final = 1
Cell = str | float | int | None


def vote_document(found: Voting, usual: Voting | None = None) -> dict[str, Any]:
    """Return votes as plain values; numbers are finite or null.

    Parameters
    ----------
    found : Voting
    usual : Voting, optional
        The same with the unchanged preset, where ``found`` is a "what if".
    """
    return {
        "schema_version": SCHEMA_VERSION,
        "tool": {"name": "uav-fdi", "version": __version__},
        "logs": [
            {"name": one.name, "autopilot": one.number, "offset_s": number(one.offset)}
            for one in found.logs
        ],
        "settings": settings_document(found.settings),
        "verdict": verdict(found),
        "autopilots": [_autopilot(found, voter) for voter in found.voters],
        "selected": [[number(run.start), run.value] for run in selected_runs(found)],
        "errors": [
            {
                "seen_by": row.seen_by,
                "autopilot": row.autopilot,
                "flag": row.flag,
                "blamed_s": [number(row.blamed_from), number(row.blamed_until)],
                "counted_s": [number(row.counted_from), number(row.counted_until)],
            }
            for row in error_rows(found)
        ],
        "reactions": [_reaction(found, one) for one in found.reactions],
        "reactions_of_the_preset": None
        if usual is None
        else [_reaction(usual, one) for one in usual.reactions],
        "thesis_table_6_1": {
            cause: {"detection_s": detection, "replacement_s": replacement}
            for cause, (detection, replacement) in THESIS.items()
        },
        "notes": list(found.notes),
    }


def settings_document(settings: Settings) -> dict[str, Any]:
    """Return parameters as plain values."""
    return {
        "preset": settings.name,
        "flags": list(settings.flags),
        "cycle_s": settings.cycle,
        "delay_s": settings.delay,
        "needs_takeoff": settings.needs_takeoff,
        "persistence_s": settings.persistence,
        "hold_s": settings.hold,
        "silence_s": settings.silence,
        "age_from": settings.age_from,
        "keeps_vote_when_equal": settings.keeps_vote_when_equal,
        "transport_s": settings.transport,
        "selection_hold_s": settings.selection_hold,
        "quorum": settings.quorum,
    }


def _autopilot(found: Voting, voter: Voter) -> dict[str, Any]:
    t, replay = times(found, voter), voter.replay

    def by_number(values: NDArray[Any]) -> dict[str, list[list[Any]]]:
        columns = values.T.astype(np.int64)
        return {
            str(name): [[number(run.start), run.value] for run in runs(t, column)]
            for name, column in zip(found.numbers, columns, strict=True)
        }

    return {
        "number": voter.number,
        "log": voter.log,
        "is_inferred": voter.witness.is_inferred,
        "cycles": int(t.size),
        "cycles_are_recorded": voter.is_at_record,
        "votes": [[number(run.start), run.value] for run in vote_runs(found, voter)],
        "errors": by_number(replay.counters),
        "priorities": by_number(replay.priorities),
        "silent": by_number(replay.silent),
        "healthy": by_number(replay.healthy),
        "cycles_that_differ_from_the_record": None
        if voter.differing is None
        else dict(voter.differing),
    }


def _reaction(found: Voting, one: Reaction) -> dict[str, Any]:
    after = reaction_times(one)

    def moment(at: int | None) -> float | None:
        return None if at is None else number(found.seconds(at))

    def extent(span: Range | None) -> list[float | None] | None:
        return None if span is None else [moment(span.low), moment(span.high)]

    return {
        "autopilot": one.pilot,
        "replaced_by": one.to,
        "cause": one.cause,
        "onset_s": moment(one.onset),
        "first_sign_s": moment(one.sign),
        "votes": [
            {
                "voter": change.voter,
                "is_inferred": change.is_inferred,
                "at_s": moment(change.at),
                "any_phase_s": extent(change.any_phase),
                "recorded_s": moment(change.recorded),
            }
            for change in one.changes
        ],
        "majority_s": moment(one.majority),
        "majority_any_phase_s": extent(one.majority_any_phase),
        "takeover_s": extent(one.takeover),
        "takeover_any_phase_s": extent(one.takeover_any_phase),
        "detection_after_s": number(after.detection),
        "takeover_after_s": None if after.takeover is None else [*map(number, after.takeover)],
    }


def vote_table(found: Voting) -> Iterator[list[Cell]]:
    """Yield a head and a row per cycle and autopilot, in the order of time."""
    numbers = found.numbers
    yield [
        "t",
        "autopilot",
        "compared",
        "vote",
        *(f"{what}_{n}" for what in ("errors", "priority", "silent", "healthy") for n in numbers),
    ]
    rows: list[tuple[float, int, list[Cell]]] = []
    for voter in found.voters:
        replay = voter.replay
        columns = (replay.counters, replay.priorities, replay.silent, replay.healthy)
        for k, t in enumerate(times(found, voter).tolist()):
            values = [int(v) for column in columns for v in column[k]]
            row = [t, voter.number, int(replay.is_open[k]), numbers[int(replay.vote[k])], *values]
            rows.append((t, voter.number, row))
    yield from (row for _, _, row in sorted(rows, key=lambda item: item[:2]))


def error_table(found: Voting) -> Iterator[list[Cell]]:
    """Yield a head and a row per flag that was blamed."""
    yield [
        "seen_by",
        "autopilot",
        "flag",
        "blamed_from",
        "blamed_until",
        "counted_from",
        "counted_until",
    ]
    yield from (list(row) for row in error_rows(found))


def reaction_table(found: Voting, usual: Voting | None = None) -> Iterator[list[Cell]]:
    """Yield a head and a row per reaction, s after the onset or first sign; the thesis last."""
    yield [
        "rules",
        "autopilot",
        "cause",
        "detection",
        "detection_low",
        "detection_high",
        "takeover_low",
        "takeover_high",
    ]
    labelled = [("what if" if usual else found.settings.name, found)]
    if usual is not None:
        labelled.append((usual.settings.name, usual))
    for label, voting in labelled:
        for one in voting.reactions:
            after = reaction_times(one)
            low, high = after.detection_range or (None, None)
            earliest, latest = after.takeover or (None, None)
            yield [label, one.pilot, one.cause, after.detection, low, high, earliest, latest]
    for cause, (detection, takeover) in THESIS.items():
        yield ["thesis, table 6.1", None, cause, detection, None, None, takeover, takeover]
