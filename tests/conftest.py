"""What every test relies on: no test reads or fills the user's cache."""

import gc
import os
import shutil

import pytest
from hypothesis import settings

# The same inputs every time: a run that fails says something about the change, not about the draw.
# A longer search with other seeds: HYPOTHESIS_PROFILE=search.
settings.register_profile("same", derandomize=True, deadline=None)
settings.register_profile("search", max_examples=2000, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "same"))


def pytest_collection_finish() -> None:
    """Keep the collector from walking what lives to the end: it took a fifth of the time."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session", autouse=True)
def _own_cache_folder(tmp_path_factory):
    """Kept answers go to a folder of this run, in subprocesses and all its workers as well."""
    before = os.environ.get("FDI_CACHE_DIR")
    base = tmp_path_factory.getbasetemp()
    run = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    os.environ["FDI_CACHE_DIR"] = str(run / "cache")
    yield
    if before is None:
        del os.environ["FDI_CACHE_DIR"]
    else:
        os.environ["FDI_CACHE_DIR"] = before


@pytest.fixture(scope="session")
def chromium():
    """The path of an installed browser; without one the test is skipped."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    return path or pytest.skip("no chromium is installed")


@pytest.fixture(scope="session")
def browser(chromium):
    """The installed browser, driven by the package playwright."""
    driver = pytest.importorskip("playwright.sync_api")
    with driver.sync_playwright() as running:
        found = running.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield found
        found.close()
