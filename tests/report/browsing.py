"""A page in a browser that must neither complain nor ask for anything but itself."""

import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

LONGEST_S = 200.0
"""A busy machine draws a frame in seconds."""


@contextmanager
def opened(browser: Any, written: Path, width: int) -> Iterator[Any]:
    page = browser.new_page(viewport={"width": width, "height": 900})
    told: list[str] = []
    asked: list[str] = []
    page.on("pageerror", lambda error: told.append(str(error)))
    page.on("console", lambda line: told.append(line.text) if line.type == "error" else None)
    page.on("request", lambda request: asked.append(request.url))
    page.goto(written.as_uri())
    yield page
    assert not told
    assert {url.split("#")[0] for url in asked} == {written.as_uri()}
    assert len([url for url in asked if "#" not in url]) == 1
    page.close()


def until(page: Any, holds: str) -> None:
    """Wait for what an expression says; the page's policy keeps ``wait_for_function`` from it."""
    end = time.monotonic() + LONGEST_S
    while not page.evaluate(holds):
        assert time.monotonic() < end, holds
        page.wait_for_timeout(50)
