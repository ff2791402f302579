"""No input makes a reader raise anything but our errors, hang, or devour memory.

200,000 inputs: `make soak`. What once failed is kept in ``regressions/``, as small as it gets.
"""

import json
import os
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest

from .fuzz import exercise, worker
from .fuzz.__main__ import ALONE, run
from .fuzz.heads import heads
from .fuzz.mutations import make_input, reader_of
from .fuzz.smaller import smaller
from .fuzz.whole import MORE
from .fuzz.worker import CLOCKS, FLIGHTS, WHOLE

pytestmark = pytest.mark.flights

INPUTS = 500
ANALYSED = range(64, 76)  # 64 once ended with exit code 2; a report is written of 75
CLOCKED = 100
FLOWN = len(MORE)
REGRESSIONS = sorted((Path(__file__).parent / "regressions").glob("*.input"))


@pytest.fixture(autouse=True)
def _importable_worker(monkeypatch):
    """A worker is started as a module of the tests."""
    tests = Path(__file__).resolve().parents[1]
    path = os.pathsep.join([str(tests.parent), str(tests), os.environ.get("PYTHONPATH", "")])
    monkeypatch.setenv("PYTHONPATH", path)


def test_what_failed_once_does_not_fail_again():
    ended = subprocess.run(
        [sys.executable, "-m", "telemetry.fuzz.worker", *map(str, REGRESSIONS)],
        env={**os.environ, **ALONE},
        capture_output=True,
        timeout=600,
        check=True,
    )
    said = [json.loads(line) for line in ended.stdout.splitlines()]
    assert said[-1] == {"done": True}
    assert sum("trying" in s for s in said) == len(REGRESSIONS)
    assert not [s for s in said if "what" in s]


def test_no_input_of_hundreds_fails():
    """A four-hundredth of the soak: some 20 ms of CPU each."""
    assert not run(0, INPUTS, os.cpu_count() or 1)


def test_wrong_definitions_and_metadata_never_end_as_a_wrong_command_line():
    """Through the whole analysis, by its exit code: 0 or 3. More of them: `make soak`."""
    assert not run(ANALYSED.start, len(ANALYSED), os.cpu_count() or 1, [WHOLE])


def test_no_damaged_clock_of_a_hundred_stops_a_reader():
    assert not run(0, CLOCKED, os.cpu_count() or 1, [CLOCKS])


def test_no_damaged_clock_of_a_flight_costs_a_command_more_than_it_may():
    """Every command once: 20 times the undamaged log's CPU, 1 GB. More of them: `make soak`."""
    costs = []
    assert not run(0, FLOWN, 1, [FLIGHTS], costs)
    assert Counter(what for what, *_ in costs) == {"analyze": FLOWN, **dict.fromkeys(MORE, 1)}
    assert max(times for _, _, times, _ in costs) < 20


def test_every_head_is_a_log_before_it_is_mutated(tmp_path):
    """Else the fuzzing would only ever see refusals."""
    path = tmp_path / "log"
    for head in heads():
        path.write_bytes(b"".join(head.chunks))
        log = exercise.exercise(path, exercise.Random(0))
        assert sum(len(message) for message in log.messages.values()) > 10, head


def test_number_makes_the_same_input_every_time():
    first = [make_input(number) for number in range(40)]
    assert [make_input(number) for number in range(40)] == first
    assert len({one.data for one in first}) > 35


def test_inputs_of_some_readers_are_those_made_of_their_heads():
    tried = [number for number, _ in worker.inputs(["0", "60", "tlog", "ulg"])]
    stories = {number: make_input(number).story.partition(" ")[0] for number in range(60)}
    assert tried == [number for number in range(60) if reader_of(number) in ("tlog", "ulg")]
    assert {stories[number] for number in tried}.isdisjoint({"bin", "log"})
    assert {"tlog", "ulg"} <= {stories[number] for number in tried}


@pytest.mark.parametrize(
    ("defect", "what"),
    [
        (lambda: [][0], "IndexError"),
        (lambda: bytearray(600_000_000), "MemoryError"),
        (lambda: list(iter(int, 1)), "too slow"),
        (lambda: worker.warnings.warn("odd", RuntimeWarning, stacklevel=1), "RuntimeWarning"),
    ],
)
def test_defect_of_a_reader_is_noticed_and_made_small(monkeypatch, tmp_path, defect, what):
    def spoiled(path, random):
        if b"needle" in path.read_bytes():
            defect()

    monkeypatch.setattr(worker, "exercise", spoiled)
    monkeypatch.setattr(worker, "START_S", 0.02)
    before = worker.signal.signal(worker.signal.SIGPROF, worker.stop)
    try:
        data = b"hay" * 30 + b"needle" + b"hay" * 30
        found = worker.check(data, 1, tmp_path)
        assert found is not None
        assert what in found["what"]
        if what == "IndexError":
            assert smaller(data, found["what"], 1, tmp_path) == b"needle"
    finally:
        worker.signal.signal(worker.signal.SIGPROF, before)
