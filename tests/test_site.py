"""A page of the site that leads nowhere, or asks the network for something, is not published."""

import importlib.util
from pathlib import Path

import pytest

pytest.importorskip("sphinx", reason="the extra docs is not installed")
CONF = Path(__file__).resolve().parents[1] / "docs" / "conf.py"


@pytest.fixture(scope="module")
def broken_links():
    spec = importlib.util.spec_from_file_location("site_conf", CONF)
    conf = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(conf)
    return conf.broken_links


def test_links_to_what_is_there_are_whole(broken_links, tmp_path):
    (tmp_path / "a b.html").write_text('<p id="here">text</p><a href="#here">up</a>')
    links = '<a href="a%20b.html#here">x</a><a href="https://example.org/none">y</a>'
    (tmp_path / "index.html").write_text(links)
    assert broken_links(tmp_path) == []


@pytest.mark.parametrize("page", ["none.html", "index.html#none", "#none", "none.png"])
def test_a_link_that_leads_nowhere_is_told(broken_links, tmp_path, page):
    (tmp_path / "index.html").write_text(f'<a href="{page}">x</a>')
    assert broken_links(tmp_path) == [f"index.html links to {page}"]


@pytest.mark.parametrize(
    "loads", ['<script src="https://a.org/x.js">', '<link href="//a.org/x.css">']
)
def test_a_page_that_loads_from_the_network_is_told(broken_links, tmp_path, loads):
    (tmp_path / "index.html").write_text(loads)
    (told,) = broken_links(tmp_path)
    assert "a.org" in told
