"""What does a person read of what stood out in a flight? The lines of one block.

In: an analysis. Out: one line for each fact; nothing where nothing did. They are facts and accuse
nobody, as `TITLE` says: whoever places the block leaves it so.
"""

from __future__ import annotations

from typing import Final

from fdi.result import Analysis

TITLE: Final = "What stood out: facts, and no accusations (more: fdi check)"


def stood_out_lines(analysis: Analysis) -> tuple[str, ...]:
    """Return a line for each fact that stood out, the weightiest first, without markup."""
    return tuple(
        f"{fact.text[:1].upper()}{fact.text[1:]}{' (beyond doubt)' if fact.is_wrong else ''}."
        for fact in analysis.stood_out
    )
