"""The command ``fdi vote``: which of several autopilots is selected, when and why?"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, TypeVar

import rich_click as click
from click import get_current_context
from click.core import ParameterSource

from fdi.cli.completion import FILE
from fdi.cli.options import JSON, QUIET, force_option
from fdi.cli.output import answer, complain, show
from fdi.errors import UsageError

if TYPE_CHECKING:
    from fdi.methods.voting import Settings

F = TypeVar("F", bound=Callable[..., Any])

TIMES: Final = (
    "cycle",
    "delay",
    "persistence",
    "hold",
    "silence",
    "transport",
    "selection_hold",
)
"""Options that take the place of a time of the preset."""
OF_LOGS: Final = {"delay": "--delay", "flags": "--flags", "phase": "--phase", "onset": "--onset"}
"""Options that say nothing of a simulation."""
OF_SIMULATION: Final = {
    "fail": "--fail",
    "outside": "--outside",
    "loss": "--loss",
    "lasts": "--lasts",
    "runs": "--runs",
    "seed": "--seed",
    "mttf": "--mttf",
    "flight": "--flight",
    "voter": "--voter",
}


def _seconds(option: str, said: str) -> Callable[[F], F]:
    """Return an option that takes seconds."""
    return click.option(option, type=float, metavar="S", help=said)


@click.command(epilog="Example: fdi vote instance_0.ulg instance_1.ulg --onset 42.68 --out votes")
@click.argument("logs", metavar="[LOG...]", nargs=-1, type=FILE)
@click.option(
    "--preset",
    type=click.Choice(["recorded", "thesis"]),
    default="recorded",
    show_default=True,
    help="The rules as the published program ran, or as its thesis states them.",
)
@_seconds(
    "--cycle", "What if this were the time from one comparison, message and vote to the next."
)
@_seconds("--delay", "What if comparisons began so long after take-off.")
@_seconds("--persistence", "What if an error counted after it was blamed for so long.")
@_seconds("--hold", "What if it then counted until it was not blamed for so long.")
@_seconds("--silence", "What if an autopilot not heard for so long counted as silent.")
@_seconds("--transport", "What if a message took so long to arrive.")
@_seconds(
    "--selection-hold", "What if the program that counts votes paused so long after each count."
)
@click.option(
    "--quorum",
    type=int,
    metavar="N",
    help="What if votes were counted as soon as N autopilots have voted.",
)
@click.option(
    "--age-from",
    type=click.Choice(["sent", "received"]),
    help="What if silence counted from the sender's time stamp, or from the reception.",
)
@click.option("--flags", metavar="NAME,...", help="What if only these flags were compared.")
@_seconds("--phase", "Let the cycles run freely, from so long after each log's first record.")
@_seconds(
    "--onset",
    "When something failed, in seconds of the first log; reaction times count from there.",
)
@click.option(
    "--simulate",
    metavar="N,...",
    help="Without logs: simulate N autopilots with random failures; several N in turn.",
)
@click.option(
    "--fail",
    multiple=True,
    metavar="KIND[:NUMBER]",
    help="With --simulate: an autopilot is faulty, mute, dead, stuck or lying, such as lying:2.",
)
@click.option(
    "--outside",
    is_flag=True,
    help="With --simulate: a cause from outside turns the flags of all autopilots bad.",
)
@click.option(
    "--loss",
    type=float,
    default=0.0,
    metavar="SHARE",
    help="With --simulate: share of messages that are lost.",
)
@click.option(
    "--lasts",
    type=float,
    default=50.0,
    show_default=True,
    metavar="S",
    help="With --simulate: how long a run goes on after the failure.",
)
@click.option(
    "--runs", type=int, default=1000, show_default=True, help="With --simulate: number of runs."
)
@click.option(
    "--seed",
    type=int,
    default=0,
    show_default=True,
    help="With --simulate: seed of the random numbers.",
)
@click.option(
    "--mttf",
    type=float,
    metavar="H",
    help="With --simulate: mean time to failure of one autopilot.",
)
@click.option(
    "--flight",
    type=float,
    metavar="H",
    help="With --simulate: length of a flight, for the reliability.",
)
@click.option(
    "--voter",
    type=float,
    default=1.0,
    show_default=True,
    metavar="R",
    help="With --simulate: reliability of what counts the votes.",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder for figures and tables.",
)
@force_option()
@JSON
@QUIET
def vote(logs: Sequence[str], simulate: str | None, **asked: Any) -> int:
    """Say which of several autopilots of one vehicle the voter selects, when and why.

    Give the logs of the autopilots, in any order. One is enough if it holds the flags that it
    received from the others. Each autopilot's part of the voter is replayed from the flags alone,
    and compared with what the voter itself wrote into the log. The options "what if" change a rule;
    their answer is printed beside that of the preset.

    With --simulate there are no logs: the same rules run for N autopilots that fail at random.
    Prints how often the wrong one is in charge, and how reliable N units are. Without --fail,
    --outside and --loss it goes through a list of scenarios.
    """
    if bool(logs) == (simulate is not None):
        raise UsageError(
            "logs and --simulate are both given" if logs else "there is no log",
            hint="give the logs of the autopilots, or --simulate N without any",
        )
    if logs:
        _refuse(OF_SIMULATION, "is of --simulate", "leave it out, or give --simulate")
    else:
        _refuse(OF_LOGS, "is of logs and says nothing of a simulation", "leave it out")
    if simulate is not None:
        _simulate(_numbers(simulate), _settings(asked), asked)
    else:
        _of_logs(logs, _settings(asked), asked)
    return 0


def _refuse(options: dict[str, str], why: str, hint: str) -> None:
    """Refuse options that have no meaning here.

    Raises
    ------
    UsageError
        One was given.
    """
    context = get_current_context()
    for name, option in options.items():
        if context.get_parameter_source(name) is ParameterSource.COMMANDLINE:
            raise UsageError(f"{option} {why}", hint=hint)


def _settings(asked: dict[str, Any]) -> Settings:
    """Return the preset with what was asked for in its place."""
    from fdi.methods.voting import PRESETS

    names = (*TIMES, "quorum", "age_from")
    given = {name: asked[name] for name in names if asked[name] is not None}
    if asked["flags"] is not None:
        given["flags"] = tuple(name.strip() for name in asked["flags"].split(","))
    return replace(PRESETS[asked["preset"]], **given)


def _numbers(text: str) -> tuple[int, ...]:
    """Return the numbers of autopilots that were asked for.

    Raises
    ------
    UsageError
        The text holds something else.
    """
    parts = [part.strip() for part in text.split(",")]
    if not all(part.isascii() and part.isdigit() and len(part) < 4 for part in parts):
        raise UsageError(f"{text[:60]!r} are no numbers of autopilots", hint="for example 3,5,7")
    return tuple(int(part) for part in parts)


def _of_logs(logs: Sequence[str], settings: Settings, asked: dict[str, Any]) -> None:
    from fdi.methods.voting import PRESETS
    from fdi.methods.voting import vote as run
    from fdi.report import check_folder, json_text
    from fdi.report.vote_document import vote_document
    from fdi.report.vote_files import VOTE_FILES, write_votes
    from fdi.report.vote_text import vote_summary
    from fdi.telemetry import read

    out, force = asked["out"], asked["force"]
    if out is not None:
        check_folder(out, holds="votes", names=VOTE_FILES, force=force)
    read_logs = [read(path) for path in logs]
    found = run(read_logs, settings, onset=asked["onset"], phase=asked["phase"])
    preset = PRESETS[settings.name]
    is_what_if = settings != preset or asked["phase"] is not None
    usual = run(read_logs, preset, onset=asked["onset"]) if is_what_if else None
    if out is not None:
        write_votes(found, usual, out, force=force)
    if asked["as_json"]:
        for note in found.notes:
            complain(f"fdi: warning: {note}")
        answer(json_text(vote_document(found, usual)))
    elif not asked["quiet"]:
        show(vote_summary(found, usual))


def _simulate(numbers: tuple[int, ...], settings: Settings, asked: dict[str, Any]) -> None:
    from fdi.methods.voting import Scenario
    from fdi.methods.voting.scenarios import parse_failures, run_one, run_standard
    from fdi.report import check_folder, json_text
    from fdi.report.reliability_text import Units
    from fdi.report.simulation_text import simulation_document, simulation_summary
    from fdi.report.vote_files import SIMULATION_FILES, write_simulation

    out, force = asked["out"], asked["force"]
    if out is not None:
        check_folder(out, holds="votes", names=SIMULATION_FILES, force=force)
    units = Units(numbers, asked["mttf"], asked["flight"], asked["voter"])
    draws = {"runs": asked["runs"], "seed": asked["seed"]}
    if asked["fail"] or asked["outside"] or asked["loss"]:
        failures = parse_failures(asked["fail"])
        scenario = Scenario(min(numbers), failures, asked["outside"], asked["loss"], asked["lasts"])
        rows = run_one(numbers, scenario, settings, **draws)
    else:
        rows = run_standard(numbers, settings, lasts=asked["lasts"], **draws)
    if out is not None:
        write_simulation(rows, settings, units, out, force=force)
    if asked["as_json"]:
        answer(json_text(simulation_document(rows, settings, units)))
    elif not asked["quiet"]:
        show(simulation_summary(rows, settings, units))
