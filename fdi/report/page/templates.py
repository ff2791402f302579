"""How does a value come into a page? The environment of all templates.

Every value is escaped, and control characters in foreign text are stripped, wherever a template
shows it. What is drawn by us comes as SVG whose texts are escaped already (``| svg``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fdi.report.words import at, clean, number, per_cent, plural, share, shortened, size

if TYPE_CHECKING:
    from jinja2 import Environment


def templates() -> Environment:
    """Return the environment in which templates of ours are rendered."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("fdi.report"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        finalize=_finalize,
    )
    environment.filters.update(
        at=at, number=number, per_cent=per_cent, plural=plural, size=size, shortened=shortened
    )
    environment.filters["share"] = share
    environment.filters["svg"] = Markup
    return environment


def _finalize(value: Any) -> Any:
    return clean(value) if type(value) is str else "–" if value is None else value
