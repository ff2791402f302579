"""What every test relies on: no test reads or fills the user's cache."""

import os

import pytest


@pytest.fixture(scope="session", autouse=True)
def _own_cache_folder(tmp_path_factory):
    """Kept answers go to a folder of this run, in subprocesses as well."""
    before = os.environ.get("FDI_CACHE_DIR")
    os.environ["FDI_CACHE_DIR"] = str(tmp_path_factory.mktemp("cache"))
    yield
    if before is None:
        del os.environ["FDI_CACHE_DIR"]
    else:
        os.environ["FDI_CACHE_DIR"] = before
