"""Which command is meant, and what does an exception mean to the shell?

Every error this package raises on purpose is one line on standard error and its own exit code; what
it did not foresee is a defect of ours: the traceback goes to a file that is named, and the code is
70.
"""

from __future__ import annotations

import logging
import os
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Final

import rich_click as click

from fdi import __version__
from fdi.cli.analyze import analyze
from fdi.cli.batch import batch
from fdi.cli.bus_error import end_with_a_line_on_bus_errors
from fdi.cli.calibrate import calibrate
from fdi.cli.check import check
from fdi.cli.compare import compare
from fdi.cli.convert import convert
from fdi.cli.estimator import estimator
from fdi.cli.evaluate import evaluate
from fdi.cli.figure import figure
from fdi.cli.fit import fit
from fdi.cli.heading import heading
from fdi.cli.info import info
from fdi.cli.inject import inject
from fdi.cli.observe import observe
from fdi.cli.output import complain, prepare_streams
from fdi.cli.structure import structure
from fdi.cli.vote import vote
from fdi.cli.watch import watch
from fdi.errors import FdiError, ModelError, own_file

TERMINATED: Final = 143
USAGE: Final = 2
DEFECT: Final = 70


class _Commands(click.RichGroup):
    """The commands; who names a log and no command is told the one that is likely meant."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args[0] not in self.commands and os.path.exists(args[0]):
            ctx.fail(f"{args[0]} is no command; what failed in a log says 'fdi analyze {args[0]}'")
        return super().resolve_command(ctx, args)


def manual_folder() -> Path:
    """Return the folder of the manual, in a wheel or in a checkout."""
    package = Path(__file__).resolve().parents[1]
    inside = package / "docs"
    return inside if inside.is_dir() else package.parent / "docs"


@click.group(
    cls=_Commands,
    invoke_without_command=True,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=f"Example: fdi analyze flight.tlog\n\nManual: {manual_folder()}",
)
@click.version_option(__version__, prog_name="fdi")
@click.pass_context
def fdi(context: click.Context) -> int:
    """Find out from a drone's telemetry log which component failed first."""
    if context.invoked_subcommand is None:
        click.echo(context.get_help())
        return USAGE
    return 0


for _command in (
    analyze,
    info,
    convert,
    structure,
    check,
    compare,
    figure,
    estimator,
    observe,
    evaluate,
    fit,
    heading,
    batch,
    calibrate,
    inject,
    vote,
    watch,
):
    fdi.add_command(_command)


def run(arguments: Sequence[str] | None = None) -> int:
    """Run the command that the words name, by default those of the process; return its code."""
    prepare_streams()
    end_with_a_line_on_bus_errors()
    _quieten()
    result = fdi.main(
        args=None if arguments is None else list(arguments), prog_name="fdi", standalone_mode=False
    )
    return result if isinstance(result, int) else 0


def explain(error: Exception) -> int:
    """Say in a line what an exception means, and return the exit code."""
    if isinstance(error, click.Abort):
        raise KeyboardInterrupt from error
    if isinstance(error, click.ClickException):
        complain(f"fdi: {error.format_message()} (try '{_called(error)} --help')")
        return USAGE
    if isinstance(error, FdiError):
        for line in error.problems if isinstance(error, ModelError) else (str(error),):
            complain(f"fdi: {line}")
        return error.exit_code
    if (unreadable := own_file(error)) is not None:
        complain(f"fdi: {unreadable}")
        return DEFECT
    return _defect(error)


def _quieten() -> None:
    """Keep what libraries tell developers from users, and let a kill clean up."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        signal.signal(signal.SIGTERM, _terminated)
    except ValueError:  # not the main thread: whoever runs us there keeps its own handler
        return


def _terminated(number: int, frame: FrameType | None) -> None:
    sys.exit(TERMINATED)


def _called(error: click.ClickException) -> str:
    context = getattr(error, "ctx", None)
    return context.command_path if context is not None else "fdi"


def _defect(error: Exception) -> int:
    """Write the traceback of a defect to a file and say where."""
    name = "nowhere: no file could be written"
    try:
        handle, name = tempfile.mkstemp(prefix="fdi-defect-", suffix=".txt")
        with os.fdopen(handle, "w", encoding="utf-8", errors="backslashreplace") as file:
            file.write(f"fdi {__version__}, Python {sys.version}\n{sys.argv}\n\n")
            traceback.print_exception(error, file=file)
    except OSError:
        traceback.print_exception(error)
    complain(
        f"fdi: a defect of ours ({type(error).__name__}): please report it with the file {name}"
    )
    return DEFECT
