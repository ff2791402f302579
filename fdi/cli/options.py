"""Which options mean the same in several commands? Each of them, defined once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

import rich_click as click

from fdi.cli.completion import model_names, policy_names

F = TypeVar("F", bound=Callable[..., Any])

SYSTEM: Final = click.option(
    "--system",
    type=int,
    metavar="ID",
    help="Which vehicle, by its MAVLink system id, where there are several.",
)
WORKERS: Final = click.option(
    "--workers", type=int, metavar="N", help="Number of local processes; by default one per core."
)
QUIET: Final = click.option("--quiet", "-q", is_flag=True, help="Print nothing.")
NO_PROGRESS: Final = click.option("--no-progress", is_flag=True, help="Show no progress bar.")
JSON: Final = click.option("--json", "as_json", is_flag=True, help="Print the answer as JSON.")


def force_option(
    said: str = "Write even into a folder that fdi did not make; a file in the way is kept as"
    " NAME.1.",
) -> Callable[[F], F]:
    """Return the option ``--force`` of a command that writes, with what its help says."""
    return click.option("--force", is_flag=True, help=said)


def read_methods(
    context: click.Context, option: click.Parameter, value: str | None
) -> tuple[str, ...] | None:
    """Return the names in ``none``, ``all`` or ``A,B``; None where the policy says."""
    if value is None:
        return None
    from fdi.methods.table import METHODS

    if value in ("none", "all"):
        return tuple(METHODS) if value == "all" else ()
    names = tuple(name.strip() for name in value.split(","))
    unknown = [name for name in names if name not in METHODS]
    if unknown:
        raise click.BadParameter(
            f"there is no method {unknown[0]!r}; there are {', '.join(METHODS)}", context, option
        )
    return names


METHODS: Final = click.option(
    "--methods",
    metavar="none|all|LIST",
    callback=read_methods,
    help="Methods whose tests are weighed with the model's: estimator, heading, observer, "
    "response, voting. By default those of the policy.",
)


def model_option(
    said: str = "Airframe model: a shipped name, a YAML file, or auto: chosen by the vehicle "
    "in the log.",
) -> Callable[[F], F]:
    """Return the option ``--model`` with what its help says."""
    return click.option(
        "--model",
        default="auto",
        metavar="NAME|FILE|auto",
        shell_complete=model_names,
        help=said,
    )


def policy_option(
    said: str = "How tests are chosen and thresholds set: a shipped name or a YAML file.",
    *,
    metavar: str = "default|paper|FILE",
) -> Callable[[F], F]:
    """Return the option ``--policy`` with what its help says."""
    return click.option(
        "--policy",
        default="default",
        metavar=metavar,
        shell_complete=policy_names,
        help=said,
    )
