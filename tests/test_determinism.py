"""The same log, model and version give the same JSON byte for byte, however they are run."""

import json
import os
import re
import subprocess
import sys

import pytest
from flights import EXAMPLES

pytestmark = pytest.mark.flights

FDI = [sys.executable, "-c", "import sys; from fdi.cli import main; sys.exit(main())"]
LOGS = ["copter_gps_loss_landing.tlog", "plane_engine_failure_stall.tlog"]
PLAIN = {"PYTHONHASHSEED": "0", "TZ": "UTC", "LC_ALL": "C.UTF-8"}
OTHERS = {
    "seed_and_time_zone": {"PYTHONHASHSEED": "1", "TZ": "Asia/Kathmandu", "PYTHONOPTIMIZE": "1"},
    "seed_locale_and_threads": {
        "PYTHONHASHSEED": "12345",
        "LC_ALL": "de_DE.UTF-8",
        "LANG": "de_DE.UTF-8",
        "OPENBLAS_NUM_THREADS": "1",
    },
}


def analysed(name, cache, **changes):
    """Return what ``fdi analyze --json`` prints, without the timings and the command line."""
    environment = {**os.environ, **PLAIN, "FDI_CACHE_DIR": str(cache), **changes}
    ended = subprocess.run(
        [*FDI, "analyze", str(EXAMPLES / name), "--json", "--no-progress"],
        env=environment,
        capture_output=True,
        timeout=600,
        check=True,
    )
    return without_times(ended.stdout.decode("utf-8"))


def without_times(text):
    """Cut two values out of the text; all other bytes stay as they were printed."""
    document = json.loads(text)
    for key, value in (
        ("timings_s", document["timings_s"]),
        ("command", document["tool"]["command"]),
    ):
        left, right = ("{", "}") if isinstance(value, dict) else (r"\[", r"\]")
        pattern = rf'"{key}":\s*{left}[^{right}]*{right}'
        text, count = re.subn(pattern, f'"{key}": -', text)
        assert count == 1, key
    return text


@pytest.fixture(scope="module", params=LOGS)
def plain(request, tmp_path_factory):
    """The text of a first run that derives everything, and the cache that it left."""
    cache = tmp_path_factory.mktemp("first")
    return request.param, analysed(request.param, cache), cache


@pytest.mark.parametrize("changes", OTHERS.values(), ids=OTHERS.keys())
def test_json_is_the_same_byte_for_byte(plain, changes, tmp_path):
    """Derived anew in every environment: nothing is taken from the cache of another one."""
    name, text, _ = plain
    assert analysed(name, tmp_path / "own", **changes) == text


def test_json_is_the_same_when_the_model_comes_from_the_cache(plain):
    name, text, cache = plain
    assert any(cache.rglob("*"))
    assert analysed(name, cache, PYTHONHASHSEED="77") == text
