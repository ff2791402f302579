"""What does a shell offer where a word is half typed?

Files for a log, names of what is shipped and files for a model or policy. How a shell is told to
ask: ``eval "$(_FDI_COMPLETE=bash_source fdi)"`` (``zsh_source``, ``fish_source``).
"""

from __future__ import annotations

from typing import Final

import rich_click as click
from click.shell_completion import CompletionItem

FILE: Final = click.Path(readable=False)
"""A path that a command looks at itself: it knows better what to say of a bad one."""


def model_names(
    context: click.Context, parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Return the shipped models that begin so, or else files."""
    from fdi.model.load import shipped_models

    return _names_or_files(("auto", *shipped_models()), incomplete)


def policy_names(
    context: click.Context, parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Return the shipped policies that begin so, or else files."""
    from fdi.decision.policy import shipped_policies

    return _names_or_files(shipped_policies(), incomplete)


def _names_or_files(names: tuple[str, ...], incomplete: str) -> list[CompletionItem]:
    found = [CompletionItem(name) for name in names if name.startswith(incomplete)]
    return found or [CompletionItem(incomplete, type="file")]
