"""Which words does a package index show, where no file of the repository lies beside them?

In: README.md, whose links are paths. Out: the same without links that lead nowhere: the text of a
link stays, with the path where the text is another. The manual in docs/ lies in the wheel as well,
and `fdi --help` says where.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface

LINK = re.compile(r"(!?)\[([^\]]*)\]\((?!\w+:)([^)#]*)(#[^)]*)?\)")
NOTE = (
    "The files that this page names are in the source; the manual, docs/, is installed as well: "
    "the last line of `fdi --help` says where.\n\n"
)


def without_links(text: str) -> str:
    """Return a page whose links to files of the repository are words."""

    def words(link: re.Match[str]) -> str:
        is_image, said, path, _ = link.groups()
        if is_image:
            return ""
        return said if not path or said == path else f"{said} ({path})"

    return LINK.sub(words, text)


class Description(MetadataHookInterface):
    """Sets the long description."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Fill in the one dynamic field."""
        page = Path(self.root, "README.md").read_text(encoding="utf-8")
        title, rest = page.split("\n\n", 1)
        text = f"{title}\n\n{NOTE}{without_links(rest)}"
        metadata["readme"] = {"content-type": "text/markdown", "text": text}
