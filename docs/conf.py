"""How the pages of this folder and the docstrings become a site: `make docs`.

Sphinx reads it. Warnings are errors, and every link of what was built is followed on the disk. The
site asks nothing of the network: formulas are MathML, the theme brings no fonts.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any
from urllib.parse import unquote, urlsplit

from docutils import nodes
from docutils.statemachine import StringList
from docutils.utils.math.latex2mathml import tex2mathml
from sphinx.application import Sphinx
from sphinx.errors import SphinxError
from sphinx.util.docutils import SphinxDirective

import fdi

sys.path.insert(0, str(Path(__file__).parent))  # for the file beside this one
import reference

project = "fdi"
author = copyright = "The fdi developers"
version = release = fdi.__version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon"]
exclude_patterns = ["_*"]
html_theme = "furo"
html_static_path = ["static"]
html_css_files = ["wide.css"]
html_title = f"fdi {release}"
html_show_sphinx = html_copy_source = False

# as the pages are read beside the code, too: sections by their names, formulas between dollars
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]
suppress_warnings = ["misc.highlighting_failure"]  # what a console shows is no language

autodoc_typehints = "none"  # the signature has them, the docstring says shape and unit
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True


class _Links(HTMLParser):
    """What a page links to, what it loads, and which of its places can be linked to."""

    def __init__(self, page: Path) -> None:
        super().__init__()
        self.targets: list[str] = []
        self.loaded: list[str] = []
        self.places: set[str] = set()
        self.feed(page.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        found = {name: value or "" for name, value in attrs}
        self.places |= {found[key] for key in ("id", "name") if key in found}
        if tag == "a" and "href" in found:
            self.targets.append(found["href"])
        elif key := {"link": "href", "script": "src", "img": "src", "source": "src"}.get(tag):
            self.loaded += [found[key]] if key in found else []


def broken_links(site: Path) -> list[str]:
    """Return the links of a built site that lead nowhere on the disk, or load from the network.

    Links to other sites are not followed.
    """
    pages = {page.resolve(): _Links(page) for page in sorted(site.rglob("*.html"))}
    broken = []
    for page, links in pages.items():
        name = page.relative_to(site.resolve())
        broken += [f"{name} loads {one}" for one in links.loaded if urlsplit(one).netloc]
        for target in [*links.targets, *links.loaded]:
            parts = urlsplit(target)
            if parts.scheme or parts.netloc:
                continue
            there = (page.parent / unquote(parts.path)).resolve() if parts.path else page
            place = unquote(parts.fragment)
            if not there.is_file() or (
                place and there in pages and place not in pages[there].places
            ):
                broken.append(f"{name} links to {target}")
    return broken


def _refuse_broken_links(app: Sphinx, failed: Exception | None) -> None:
    if failed is None and app.builder.format == "html" and (broken := broken_links(app.outdir)):
        raise SphinxError("\n".join(["links that lead nowhere:", *broken]))


def _as_mathml(block: bool) -> Callable[[Any, nodes.Element], None]:
    """Return what writes a formula: the browser's own formulas need neither scripts nor fonts."""

    def write(writer: Any, node: nodes.Element) -> None:
        writer.body.append(tex2mathml(node.astext(), as_block=block))
        raise nodes.SkipNode

    return write


class _FromCode(SphinxDirective):
    """A part of a page that the code itself tells: ``commands``, or the fields of a schema."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Return the part as nodes, with its headings."""
        (what,) = self.arguments
        text = reference.commands() if what == "commands" else reference.fields(what)
        holder = nodes.section()
        holder.document = self.state.document
        self.state.nested_parse(StringList(text.splitlines(), source=what), 0, holder, True)
        return list(holder.children)


def setup(app: Sphinx) -> None:
    """Add to Sphinx what no extension has."""
    app.add_directive("from-code", _FromCode)
    inline, block = ((_as_mathml(one), None) for one in (False, True))
    app.add_html_math_renderer("mathml", inline_renderers=inline, block_renderers=block)
    app.connect("build-finished", _refuse_broken_links)


html_math_renderer = "mathml"
