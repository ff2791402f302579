"""What can go wrong, as one tree: each kind ends the command line with its own exit code.

::

    FdiError                     70 would be a defect of ours; every subclass has its own code
    ├── UsageError        2      the command line or a call is wrong
    ├── LogError          3      the log cannot be read, or holds nothing that a model could use
    ├── ModelError        4      an airframe model, policy or labels file is wrong
    ├── OutputError       5      the output cannot be written
    └── EntryError        70     what was kept is damaged; always caught, it is made anew

A message is one line that says what is wrong, with the numbers; ``where`` names the place (file,
line, byte, channel, equation) and ``hint`` the next step. Damage inside a log is no exception: it
is a record in the log's quality, and the rest is returned. `own_file` tells an installation that
nobody can use from a defect.
"""

from __future__ import annotations

import os
from collections.abc import Sequence


class FdiError(Exception):
    """Base of every error this package raises on purpose.

    Parameters
    ----------
    message : str
        What is wrong, in one line.
    where : str, optional
        The place: file and line, byte offset, channel or equation.
    hint : str, optional
        What the reader can do about it.
    """

    exit_code = 70

    def __init__(self, message: str, *, where: str = "", hint: str = "") -> None:
        self.message = message
        self.where = where
        self.hint = hint
        super().__init__(str(self))

    def __str__(self) -> str:
        place = f"{self.where}: " if self.where else ""
        hint = f" ({self.hint})" if self.hint else ""
        return f"{place}{self.message}{hint}"


class UsageError(FdiError):
    """The command line, or the arguments of a call, cannot be carried out."""

    exit_code = 2


class LogError(FdiError):
    """The log cannot be read, or holds nothing that a model could use."""

    exit_code = 3


class ModelError(FdiError):
    """An airframe model, a policy or a labels file is wrong.

    ``problems`` holds every problem found, one line each, file and line first; the message is the
    first of them and says how many more there are.
    """

    exit_code = 4

    def __init__(
        self, message: str, *, where: str = "", hint: str = "", problems: tuple[str, ...] = ()
    ) -> None:
        super().__init__(message, where=where, hint=hint)
        self.problems = problems or (str(self),)

    @classmethod
    def of(cls, problems: Sequence[str]) -> ModelError:
        """Return one error that reports all problems of a file together."""
        more = f" (and {len(problems) - 1} more)" if len(problems) > 1 else ""
        return cls(problems[0] + more, problems=tuple(problems))


class OutputError(FdiError):
    """The output cannot be written."""

    exit_code = 5


class EntryError(FdiError):
    """What was kept from an earlier run is not what it should be: it has to be made anew."""


def own_file(error: BaseException) -> str | None:
    """Return what an exception says if a file of this package cannot be read, else None.

    That is no defect: somebody installed it where this user may not read, or lost a part of it.
    """
    package = os.path.dirname(os.path.abspath(__file__))
    text = "cannot be read, and belongs to fdi itself: install it anew, where you may read it"
    if isinstance(error, ImportError) and (error.name or "").partition(".")[0] == "fdi":
        return f"the module {error.name} {text}"
    if not isinstance(error, OSError) or not isinstance(error.filename, str | os.PathLike):
        return None
    name = os.path.abspath(error.filename)
    return f"{name} {text}" if name.startswith(package + os.sep) else None
