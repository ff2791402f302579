"""The entry ``fdi``: from the words a person typed to an exit code, also when interrupted.

It loads nothing but what hears Ctrl-C; the commands come after that, and with them all libraries.
"""

from __future__ import annotations

from fdi.cli.interrupt import INTERRUPTED, Interrupts

COLLECT_EVERY = 50_000
"""Objects that are made between two searches for unreachable ones. The interpreter's 700 cost a
fifth of the CPU of an analysis, whose millions of objects live to its end."""

TYPE_CHECKING = False  # what `typing` has, without the 8 ms that it takes to load
if TYPE_CHECKING:
    from collections.abc import Sequence


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        By default those of the process, which then has to end with the exit code.
    """
    interrupts = Interrupts()
    try:
        interrupts.listen(to_the_end=arguments is None)
        if arguments is None:
            import gc

            gc.set_threshold(COLLECT_EVERY, *gc.get_threshold()[1:])
        from fdi.cli.commands import explain, run

        try:
            code = run(arguments)
        except Exception as error:  # of any kind: `explain` files a defect's traceback
            if interrupts.seen:  # what an interrupt became on its way
                raise
            code = explain(error)
        interrupts.is_over()
    except BaseException as error:  # an interrupt in any guise; all else goes on
        interrupts.is_over()
        if not interrupts.seen and not isinstance(error, KeyboardInterrupt):
            raise
        interrupts.seen = True
    if interrupts.seen:
        interrupts.say()
        code = INTERRUPTED
    if arguments is not None:
        interrupts.hand_back()
    return code
