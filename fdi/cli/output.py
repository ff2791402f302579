"""How do words reach the terminal, a pipe or nobody?

Answers go to standard output; progress, warnings and errors to standard error. A reader that closes
the pipe early has what it wanted, which is no error. Colour and progress are for terminals only.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TextIO

from fdi.errors import OutputError
from fdi.report.words import clean

if TYPE_CHECKING:
    from rich.console import RenderableType

Progress = Callable[[str, float], None]
PIPE_WIDTH: Final = 100


def prepare_streams() -> None:
    """Let letters that a terminal cannot show be replaced instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="backslashreplace")


def answer(text: str) -> None:
    """Write a text to standard output.

    Raises
    ------
    OutputError
        It cannot be written.
    """
    try:
        sys.stdout.write(text)
        sys.stdout.flush()
    except BrokenPipeError:
        _close_quietly(sys.stdout)
    except OSError as error:
        _close_quietly(sys.stdout)
        raise OutputError(
            f"cannot be written: {error.strerror or error}", where="standard output"
        ) from error


def show(parts: Iterable[RenderableType]) -> None:
    """Print parts on standard output: in colour and as wide as it is on a terminal.

    They are rendered whole before the first letter is written, so that a broken stream is met in
    one place. ``NO_COLOR`` is honoured by rich.
    """
    from rich.console import Console

    is_terminal = sys.stdout.isatty()
    width = shutil.get_terminal_size().columns if is_terminal else PIPE_WIDTH
    out = io.StringIO()
    console = Console(file=out, width=width, force_terminal=is_terminal, emoji=False)
    for part in parts:
        console.print(part, highlight=False)
    answer("\n".join(line.rstrip() for line in out.getvalue().splitlines()) + "\n")


def complain(line: str) -> None:
    """Write one line to standard error; nobody listening is no error."""
    try:
        sys.stderr.write(f"{clean(line)}\n")
        sys.stderr.flush()
    except OSError:
        _close_quietly(sys.stderr)


def _close_quietly(stream: TextIO) -> None:
    """Point a stream that lost its reader to nowhere, so that closing it says nothing."""
    try:
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
    except (OSError, ValueError):
        return


@contextmanager
def progress_bar(wanted: bool) -> Iterator[Progress | None]:
    """Give a function that shows progress on standard error; None where that is no terminal."""
    if not wanted or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as Bar

    columns: tuple[Any, ...] = (
        TextColumn("{task.description:<10}"),
        BarColumn(bar_width=30),
        TimeElapsedColumn(),
    )
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("start", total=1.0)
        yield lambda stage, share: bar.update(task, description=stage, completed=share)
