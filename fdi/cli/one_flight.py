"""What do commands share that answer one question about one flight of a log?

Their options ``--out``, ``--flight``, ``--system``, ``--force`` and ``--json`` come as one value;
it checks the folder before the log is read, and prints and writes what was found.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Concatenate, Final, ParamSpec

import rich_click as click

from fdi.cli.options import JSON, SYSTEM, force_option
from fdi.cli.output import answer, show

if TYPE_CHECKING:
    from rich.console import RenderableType

    from fdi.report.folder import Holds

P = ParamSpec("P")
FLIGHT: Final = click.option(
    "--flight",
    type=click.IntRange(min=1),
    metavar="N",
    help="Which flight of the log, from 1; by default the last one.",
)


@dataclass(frozen=True, slots=True)
class Asked:
    """What a person asked of such a command.

    Attributes
    ----------
    out : Path or None
        The folder to write.
    flight : int or None
        From 0; None for the last one.
    system : int or None
        The vehicle's MAVLink system id.
    force, as_json : bool
    """

    out: Path | None
    flight: int | None
    system: int | None
    force: bool
    as_json: bool

    def check(self, holds: Holds, names: Collection[str]) -> None:
        """Refuse a folder that may not be written, before the work is done.

        Raises
        ------
        OutputError
            There is something else.
        """
        if self.out is not None:
            from fdi.report import check_folder

            check_folder(self.out, holds=holds, names=names, force=self.force)

    def tell(
        self,
        *,
        page: Callable[[], Iterable[RenderableType]],
        document: Callable[[], Mapping[str, Any]],
        write: Callable[[Path], object],
    ) -> None:
        """Write the folder if one was named, and print the page, or the document as JSON."""
        from fdi.report import json_text

        if self.out is not None:
            write(self.out)
        if self.as_json:
            answer(json_text(document()))
        else:
            show(page())


def asked_of_one_flight(
    folder: str, force: str | None = None
) -> Callable[[Callable[Concatenate[Asked, P], int]], Callable[..., int]]:
    """Return what gives a command these options and hands them on as its first argument.

    Parameters
    ----------
    folder : str
        What the help says of ``--out``.
    force : str, optional
        What it says of ``--force``, where that does more than usual.
    """
    options = (
        click.option("-o", "--out", type=click.Path(path_type=Path), metavar="DIR", help=folder),
        FLIGHT,
        SYSTEM,
        force_option(force) if force else force_option(),
        JSON,
    )

    def decorate(command: Callable[Concatenate[Asked, P], int]) -> Callable[..., int]:
        @wraps(command)
        def asking(
            out: Path | None,
            flight: int | None,
            system: int | None,
            force: bool,
            as_json: bool,
            *args: P.args,
            **kwargs: P.kwargs,
        ) -> int:
            number = None if flight is None else flight - 1
            return command(Asked(out, number, system, force, as_json), *args, **kwargs)

        for option in reversed(options):
            asking = option(asking)
        return asking

    return decorate
