"""One analysis for all tests of the report, which leave it as it is."""

from pathlib import Path

import pytest

from fdi.result import Analysis

from .build import small_analysis


@pytest.fixture(scope="session")
def analysis(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    folder: Path = tmp_path_factory.mktemp("model")
    return small_analysis(folder)
