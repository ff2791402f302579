"""Which equations can be left over together?

In: a model's overdetermined part and equations in order of preference. Out: those that one maximum
matching leaves unmatched, as many of the preferred ones as fit, greedily. The equations left over
are a basis of the dual of the transversal matroid of the equations, so greedy is best for any
weights that agree with the preference (Edmonds 1971).
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from fdi.structure.incidence import Rows
from fdi.structure.matching import match


class Leaver:
    """Keeps a maximum matching of some equations and exchanges which of them it leaves over.

    Parameters
    ----------
    rows : sequence of sequences of int
        Unknowns of every equation of the model.
    holders : sequence of sequences of int
        Equations of every unknown.
    equations : sequence of int
        The equations that take part.

    References
    ----------
    Oxley, "Matroid Theory", 2nd ed. 2011, sections 1.8 (greedy) and 2.4 (strict gammoids).

    Examples
    --------
    >>> leaver = Leaver(((0,), (0, 1), (1,)), ((0, 1), (1, 2)), (0, 1, 2))
    >>> leaver.leave([0, 1]), leaver.leave([1])
    ([0], [1])
    """

    def __init__(
        self, rows: Rows, holders: Sequence[Sequence[int]], equations: Sequence[int]
    ) -> None:
        self._holders = holders
        self.unknown_of: dict[int, int] = {}  # -1 where an equation is left over
        _, unknown_of = match([rows[e] for e in equations], len(holders))
        for equation, unknown in zip(equations, unknown_of, strict=True):
            self.unknown_of[equation] = unknown

    def leave(self, preferred: Iterable[int]) -> list[int]:
        """Return the preferred equations that are left over now, in their order.

        Parameters
        ----------
        preferred : iterable of int
            Equations that take part, the most wanted first.

        Returns
        -------
        list of int
        """
        free = {equation for equation, unknown in self.unknown_of.items() if unknown < 0}
        stuck: set[int] = set()  # no path leads to these from what is still free
        left: list[int] = []
        for equation in preferred:
            if not free:
                break
            if equation in free or self._exchange(equation, free, stuck):
                free.discard(equation)
                left.append(equation)
        return left

    def _exchange(self, wanted: int, free: set[int], stuck: set[int]) -> bool:
        """Match one of the free equations instead of the wanted one, if some path allows it."""
        if wanted in stuck:
            return False
        unknown_of, holders = self.unknown_of, self._holders
        gives_to: dict[int, int] = {}  # who would take over whose unknown
        seen = {wanted}
        queue = [wanted]
        for equation in queue:  # grows while it is walked
            for other in holders[unknown_of[equation]]:
                if other in seen or other in stuck or other not in unknown_of:
                    continue
                seen.add(other)
                gives_to[other] = equation
                if other in free:
                    free.discard(other)
                    while other != wanted:
                        before = gives_to[other]
                        unknown_of[other] = unknown_of[before]
                        other = before
                    unknown_of[wanted] = -1
                    return True
                if unknown_of[other] >= 0:
                    queue.append(other)
        stuck |= seen
        return False
