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
JSON: Final = click.option("--json", "as_json", is_flag=True, help="Print it as JSON.")


def force_option(
    said: str = "Write into a folder that fdi did not make; a file in the way is kept as NAME.1.",
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
    help="Which methods are weighed with the model's tests; by default the policy's.",
)


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
