"""What an installed fdi brings along: no dead links on its page, and the manual."""

import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner

from fdi.cli.commands import fdi, manual_folder

ROOT = Path(__file__).parents[1]
LINK = re.compile(r"\]\(([^)]*)\)")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    pytest.importorskip("hatchling")
    folder = tmp_path_factory.mktemp("wheel")
    words = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(words, cwd=ROOT, check=True, capture_output=True)
    (path,) = folder.glob("*.whl")
    with zipfile.ZipFile(path) as opened:
        yield opened


def test_page_of_a_package_index_has_no_link_that_leads_nowhere(wheel):
    (name,) = (name for name in wheel.namelist() if name.endswith(".dist-info/METADATA"))
    page = wheel.read(name).decode("utf-8").partition("\n\n")[2]
    links = LINK.findall((ROOT / "README.md").read_text(encoding="utf-8"))
    assert links
    assert not [target for target in LINK.findall(page) if not target.startswith("https://")]
    assert "in full (docs/verdict.md)" in page
    assert "`fdi --help` says where" in page


def test_the_manual_lies_where_the_help_says(wheel):
    inside = {Path(name) for name in wheel.namelist()}
    pages = [path.relative_to(ROOT) for path in (ROOT / "docs").rglob("*.md")]
    assert pages
    assert {"fdi" / page for page in pages} <= inside


def test_help_ends_with_where_the_manual_lies():
    assert (manual_folder() / "tutorial.md").is_file()
    shown = CliRunner().invoke(fdi, ["--help"], env={"COLUMNS": "200"}).output
    assert f"Manual: {manual_folder()}" in " ".join(shown.split())
