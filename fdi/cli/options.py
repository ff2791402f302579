"""Which options mean the same in several commands? Each of them, defined once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final, TypeVar

import rich_click as click

from fdi.cli.completion import model_names, policy_names

F = TypeVar("F", bound=Callable[..., Any])

SYSTEM: Final = click.option(
    "--system", type=int, metavar="ID", help="Which vehicle, by its MAVLink system id."
)
WORKERS: Final = click.option(
    "--workers", type=int, metavar="N", help="Local processes; by default one per core."
)
QUIET: Final = click.option("--quiet", "-q", is_flag=True, help="Print nothing.")
NO_PROGRESS: Final = click.option("--no-progress", is_flag=True, help="No progress bar.")


def model_option(said: str = "Airframe model.") -> Callable[[F], F]:
    """Return the option ``--model`` with what its help says."""
    return click.option(
        "--model",
        default="auto",
        metavar="NAME|FILE|auto",
        shell_complete=model_names,
        help=said,
    )


def policy_option(
    said: str = "The recipe.", *, metavar: str = "default|paper|FILE"
) -> Callable[[F], F]:
    """Return the option ``--policy`` with what its help says."""
    return click.option(
        "--policy",
        default="default",
        metavar=metavar,
        shell_complete=policy_names,
        help=said,
    )
