"""What ``fdi observe`` and ``fdi watch`` do with a connection: open, record, listen, end."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fdi.cli.output import complain

if TYPE_CHECKING:
    from rich.console import RenderableType

    from fdi.live.hearing import Hearing
    from fdi.live.session import Engine


def follow(
    connection: str,
    engine: Engine,
    draw: Callable[[Hearing], RenderableType],
    *,
    record_to: Path | None,
    system: int | None,
    seconds: float | None,
) -> Path | None:
    """Listen to a connection till Ctrl-C and return the ``.tlog``; None where nothing was heard."""
    from fdi.live.connection import open_link
    from fdi.live.hearing import Hearing
    from fdi.live.listening import listen
    from fdi.live.recorder import record
    from fdi.live.screen import screen
    from fdi.live.session import Session

    link = open_link(connection)
    try:
        recorder = record(record_to)
        session = Session(recorder, Hearing(system), engine)
        try:
            with screen(lambda: draw(session.hearing)) as tell:
                tell([f"listening to {connection}; Ctrl-C ends it"])
                listen(link, session, tell, seconds=seconds)
        finally:
            recorder.close()
            if recorder.size:
                complain(f"{session.hearing.frames} messages are in {recorder.path}")
            else:
                complain(f"nothing was heard on {connection}; no file is left")
    finally:
        link.close()
    return recorder.path if recorder.size else None


def live_options(command: Any) -> Any:
    """Return a command with the options that connections have."""
    import rich_click as click

    for option in (
        click.option(
            "--seconds",
            type=click.FloatRange(min=0.0, min_open=True),
            metavar="S",
            help="With a CONNECTION: stop after S seconds; by default Ctrl-C stops it.",
        ),
        click.option(
            "--like",
            metavar="LOG",
            help="With a CONNECTION: an earlier log of this vehicle, for its frame and parameters.",
        ),
        click.option(
            "--record",
            "record_to",
            type=click.Path(path_type=Path),
            metavar="FILE",
            help="With a CONNECTION: the .tlog to write; by default it is named by the time.",
        ),
    ):
        command = option(command)
    return command
