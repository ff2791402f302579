"""Hostile and damaged input, by the command line as a user calls it.

Each ends within seconds with the promised exit code and a line for each thing that is wrong, or
with a partial result that says what was lost. Never a traceback, a hang, or a file left behind.
"""

import json
import os
import random
import subprocess
import sys
import tempfile
import textwrap
from typing import NamedTuple

import pytest
from flights import EXAMPLES, joined, records
from telemetry.build import Flight, mav, record

from fdi.analysis import analyze
from fdi.cli import main
from fdi.errors import UsageError
from fdi.evaluation.inject import injected
from fdi.evaluation.injected_fault import parse_fault
from fdi.telemetry import read

FDI = [sys.executable, "-c", "import sys; from fdi.cli import main; sys.exit(main())"]
LOG = EXAMPLES / "copter_motor_failure_crash.tlog"
TOO_LONG_S = 600  # a process that hangs; no measure of speed
LOG_REFUSED, MODEL_REFUSED, OUTPUT_REFUSED = 3, 4, 5
MODEL = textwrap.dedent(
    """\
    format: 1
    name: two_altitudes
    components:
      gps: {group: sensor}
      estimator: {group: navigation}
    variables:
      altitude: {unit: m}
      height: {unit: m}
    equations:
      k_1: "height = altitude"
    measurements:
      GPS_RAW_INT:
        component: gps
        fields:
          alt: {variable: altitude, accuracy: 3 m}
      GLOBAL_POSITION_INT:
        component: estimator
        fields:
          alt: {variable: height, accuracy: 3 m}
    """
)


class Ended(NamedTuple):
    code: int
    out: str
    err: str


@pytest.fixture
def run(tmp_path, monkeypatch, capsysbinary):
    """Run the command line in an empty folder, with a folder of its own for what it leaves.

    In this process, which costs a second less than one of its own.
    """
    work, left = tmp_path / "work", tmp_path / "left"
    work.mkdir()
    left.mkdir()
    monkeypatch.chdir(work)
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(tempfile, "tempdir", str(left))

    def call(*words):
        code = main([str(word) for word in words])
        out, err = (text.decode("utf-8") for text in capsysbinary.readouterr())
        assert "Traceback" not in out + err
        assert not list(left.iterdir()), "a defect of ours: " + err
        return Ended(code, out, err)

    call.work = work
    return call


@pytest.mark.parametrize("words", [("info", "/dev/zero"), ("analyze", "missing"), ("structure",)])
def test_a_process_of_its_own_answers_alike(run, words):
    """What a user has: the other tests of this file call a function."""
    alone = subprocess.run(
        [*FDI, *words],
        cwd=run.work,
        env={**os.environ, "COLUMNS": "100"},
        stdin=subprocess.DEVNULL,
        capture_output=True,
        text=True,
        timeout=TOO_LONG_S,
    )
    assert Ended(alone.returncode, alone.stdout, alone.stderr) == run(*words)


def assert_refused(ended, code, *, lines=1):
    assert ended.code == code, ended.err
    assert ended.err.startswith("fdi: ")
    assert ended.err.endswith("\n")
    assert not ended.out
    if lines is not None:
        assert ended.err.count("\n") == lines, ended.err


GARBAGE = random.Random(20161005).randbytes(60_000)
NO_LOGS = {
    "empty": b"",
    "text": b"The quick brown fox jumps over the lazy dog.\n" * 200,
    "one_line": b"x",
    "garbage": GARBAGE,
    "zeros": bytes(1 << 20),
    "starts_of_frames": b"\xfe" * (2 << 20),
    "starts_of_long_frames": b"\xfd\xff" * (1 << 20),
    "stamps_and_starts": (bytes.fromhex("00054321abcdef00") + b"\xfd\x09\x00\x00") * 100_000,
}


@pytest.mark.parametrize("name", NO_LOGS)
def test_file_that_is_no_log_is_refused(run, tmp_path, name):
    path = tmp_path / f"{name}.tlog"
    path.write_bytes(NO_LOGS[name])
    ended = run("analyze", path)
    assert_refused(ended, LOG_REFUSED)
    assert path.name in ended.err
    assert not list(run.work.iterdir())


@pytest.mark.parametrize(
    ("command", "name"),
    [
        *(("analyze", name) for name in ("folder", "pipe", "missing", "circle", "/dev/zero")),
        ("info", "pipe"),
        ("info", "/dev/zero"),
    ],
)
def test_what_is_not_a_file_is_refused(run, tmp_path, command, name):
    path = tmp_path / name
    if name == "folder":
        path.mkdir()
    elif name == "pipe":
        os.mkfifo(path)
    elif name == "circle":
        path.symlink_to(path)
    ended = run(command, path)
    assert_refused(ended, LOG_REFUSED)
    assert str(path) in ended.err


def test_hostile_file_name_stays_in_one_line(run, tmp_path):
    ended = run("analyze", tmp_path / "a\nfdi: all is well\x1b[2J.tlog")
    assert_refused(ended, LOG_REFUSED)
    assert "\x1b" not in ended.err


@pytest.mark.parametrize("share", [0.3, 0.5, 0.9])
def test_cut_log_gives_a_partial_result_that_says_so(run, tmp_path, share):
    data = LOG.read_bytes()
    path = tmp_path / "cut.tlog"
    path.write_bytes(data[: whole_records(data, share) + 17])
    ended = run("analyze", path, "--json")
    assert ended.code == 0, ended.err
    document = json.loads(ended.out)
    assert {"truncated", "lost_bytes"} & {q["kind"] for q in document["quality"]}
    assert document["log"]["duration_s"] < 50


def whole_records(data, share):
    """Return the size of the whole records in a share of the example."""
    size = 0
    for own in records(LOG):
        if size + len(own.frame) + 8 > share * len(data):
            return size
        size += len(own.frame) + 8
    return size


def test_log_with_a_hole_and_noise_gives_a_partial_result_that_says_so(run, tmp_path):
    data = LOG.read_bytes()
    third = len(data) // 3
    path = tmp_path / "holed.tlog"
    path.write_bytes(data[:third] + GARBAGE[:3000] + data[third + 5000 :])
    ended = run("analyze", path, "--json")
    assert ended.code == 0, ended.err
    lost = [q for q in json.loads(ended.out)["quality"] if q["kind"] == "lost_bytes"]
    assert sum(q["count"] for q in lost) >= 2900


def test_log_with_no_message_that_the_model_knows_is_refused(run, tmp_path):
    """A vehicle that says who it is and what it does, and sends no measurement."""
    beats = [
        record(t, message)
        for t in range(40)
        for message in (
            mav.MAVLink_heartbeat_message(mav.MAV_TYPE_QUADROTOR, 3, 0x81, 5, 4, 3),
            mav.MAVLink_statustext_message(6, b"hello"),
        )
    ]
    path = tmp_path / "silent.tlog"
    path.write_bytes(b"".join(beats))
    ended = run("analyze", path)
    assert_refused(ended, LOG_REFUSED)
    assert "silent.tlog" in ended.err
    assert not list(run.work.iterdir())


def test_log_with_no_channel_of_a_given_model_is_refused(run, tmp_path):
    model = tmp_path / "other.yaml"
    model.write_text(MODEL.replace("GPS_RAW_INT", "GPS2_RAW").replace("GLOBAL_POSITION_INT", "HIL"))
    ended = run("analyze", LOG, "--model", model)
    assert_refused(ended, LOG_REFUSED)


def test_log_of_ten_records_gives_an_answer_or_is_refused(run, tmp_path):
    path = tmp_path / "short.tlog"
    path.write_bytes(b"".join(Flight().records()[:10]))
    ended = run("analyze", path, "--json")
    if ended.code:
        assert_refused(ended, LOG_REFUSED)
    else:
        assert not json.loads(ended.out)["findings"]


def test_log_whose_times_are_nonsense_gives_an_answer_or_is_refused(run, tmp_path):
    noise = random.Random(5)
    path = tmp_path / "times.tlog"
    path.write_bytes(joined(r._replace(stamp=noise.getrandbits(64)) for r in records(LOG)))
    ended = run("analyze", path, "--json")
    if ended.code:
        assert_refused(ended, LOG_REFUSED)
    else:
        json.loads(ended.out)


def test_log_whose_stamps_are_all_zero_is_judged_by_the_time_since_boot(run, tmp_path):
    """The log's clock is 0 at the first record; an onset before it is no time of this log."""
    path = tmp_path / "zero.tlog"
    path.write_bytes(joined(r._replace(stamp=0) for r in records(LOG)))
    ended = run("analyze", path, "--json")
    assert ended.code == 0, ended.err
    document = json.loads(ended.out)
    assert document["quality"], "nothing is said about the stamps"
    onsets = [finding["onset"]["log_s"] for finding in document["findings"]]
    assert all(0 <= onset <= document["log"]["duration_s"] for onset in onsets), onsets


def test_model_of_these_tests_is_right(run, tmp_path):
    """Else the tests below would show nothing."""
    path = tmp_path / "good.yaml"
    path.write_text(MODEL)
    assert run("structure", path).code == 0
    assert run("analyze", LOG, "--model", path, "--json").code == 0


EXPRESSIONS = {
    "unknown_symbol": "altitude + nobody_knows_this",
    "import": "__import__('os')",
    "import_called": '__import__("os").system("touch was_here")',
    "powers": "9**9**9**9",
    "power_of_a_variable": "altitude**9**9**9",
    "brackets": "(" * 10_000 + "altitude" + ")" * 10_000,
    "few_brackets": "(" * 900 + "altitude" + ")" * 900,
    "minus_signs": "-" * 5_000 + "altitude",
    "terms": " + ".join(["altitude"] * 30_000),
    "attribute": "altitude.__class__.__mro__",
    "subscript": "altitude[0]",
    "call_of_a_call": "sqrt(1)(2)",
    "lambda": "(lambda: altitude)()",
    "comprehension": "sum(x for x in altitude)",
    "text": "'altitude'",
    "walrus": "(altitude := 3)",
    "unfinished": "altitude + (",
    "empty": "",
    "nul": "altitude\\0",
    "huge_number": "1e999",
    "huge_integer": "9" * 5_000,
    "complex_number": "3j",
}


def hostile(*names):
    """Return the model with hostile equations on the lines from HOSTILE_LINE on."""
    quoted = [EXPRESSIONS[name].replace('"', '\\"') for name in names]
    lines = [f'  k_{i}: "height = {text}"' for i, text in enumerate(quoted, 1)]
    return MODEL.replace('  k_1: "height = altitude"', "\n".join(lines))


HOSTILE_LINE = 1 + MODEL.splitlines().index('  k_1: "height = altitude"')


@pytest.mark.parametrize(
    "name", ["unknown_symbol", "import", "import_called", "powers", "brackets"]
)
def test_hostile_expression_is_refused_with_file_and_line(run, tmp_path, name):
    path = tmp_path / "hostile.yaml"
    path.write_text(hostile(name))
    ended = run("analyze", LOG, "--model", path)
    assert_refused(ended, MODEL_REFUSED)
    assert f"hostile.yaml:{HOSTILE_LINE}" in ended.err
    assert len(ended.err) < 1000
    assert not list(run.work.iterdir())


def test_every_hostile_expression_of_a_model_is_told_with_its_line(run, tmp_path):
    path = tmp_path / "hostile.yaml"
    path.write_text(hostile(*EXPRESSIONS))
    ended = run("structure", path)
    assert_refused(ended, MODEL_REFUSED, lines=None)
    told = ended.err.splitlines()
    assert all(line.startswith("fdi: ") for line in told)
    assert max(map(len, told)) < 1000
    missed = [
        name
        for line, name in enumerate(EXPRESSIONS, HOSTILE_LINE)
        if not any(f"hostile.yaml:{line}:" in said for said in told)
    ]
    assert not missed, ended.err
    assert not list(run.work.iterdir())


BOMB = "\n".join(
    ["a0: &a0 [x, x]"] + [f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}, *a{i - 1}]" for i in range(1, 40)]
)
MODELS = {
    "unknown_symbol": MODEL.replace("height = altitude", "height = nobody_knows_this"),
    "alias_bomb": f"format: 1\nname: bomb\n{BOMB}\n",
    "alias_of_itself": "format: 1\nname: x\nvariables: &v {altitude: *v}\n",
    "duplicate_key": MODEL.replace("  altitude: {unit: m}", "  altitude: {unit: m}\n" * 2),
    "tag": "format: 1\nname: !!python/object/apply:os.system ['touch was_here']\n",
    "flow_nesting": "format: 1\nname: x\nvariables: " + "[" * 10_000 + "]" * 10_000 + "\n",
    "not_yaml": "format: 1\nname: [unclosed\n",
    "not_a_mapping": "- a\n- b\n",
    "not_text": GARBAGE[:5000],
    "empty": "",
    "huge": MODEL + "# " + "x" * (3 << 20) + "\n",
    "includes_itself": MODEL + "include: [model.yaml]\n",
    "includes_what_is_outside": MODEL + "include: [../../../../etc/passwd]\n",
    "includes_a_missing_file": MODEL + "include: [nowhere.yaml]\n",
    "log": LOG.read_bytes(),
}


@pytest.mark.parametrize(
    ("command", "name"),
    [*(("structure", name) for name in MODELS), ("analyze", "alias_bomb"), ("analyze", "log")],
)
def test_hostile_model_is_refused(run, tmp_path, command, name):
    path = tmp_path / "model.yaml"
    content = MODELS[name]
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    ended = run(*(["analyze", LOG, "--model", path] if command == "analyze" else [command, path]))
    assert_refused(ended, MODEL_REFUSED, lines=None)
    assert all(line.startswith("fdi: ") for line in ended.err.splitlines())
    assert len(ended.err.splitlines()) < 50
    assert "model.yaml" in ended.err
    assert "root:" not in ended.err
    assert not list(run.work.iterdir())


def test_all_problems_of_a_model_are_told_a_line_each(run, tmp_path):
    path = tmp_path / "model.yaml"
    path.write_text(
        MODEL.replace("height = altitude", "height = nobody")
        .replace("accuracy: 3 m}", "accuracy: 3 kg}", 1)
        .replace("height: {unit: m}", "height: {unit: m}\n  lonely: {unit: m}")
    )
    ended = run("structure", path)
    assert_refused(ended, MODEL_REFUSED, lines=None)
    told = ended.err.splitlines()
    for word in ("nobody", "kg", "lonely"):
        assert [line for line in told if word in line and "model.yaml:" in line], (word, told)


def test_output_that_cannot_be_written_is_5(run, tmp_path):
    file = tmp_path / "file"
    file.write_text("mine")
    for out in (file, file / "below", "/proc/nowhere/out"):
        assert_refused(run("analyze", LOG, "--out", out, "--format", "json"), OUTPUT_REFUSED)
    assert file.read_text() == "mine"


def test_folder_of_somebody_else_is_left_alone(run):
    folder = run.work / f"{LOG.stem}.fdi"
    folder.mkdir()
    folder.joinpath("mine").write_text("")
    assert_refused(run("analyze", LOG, "--format", "json"), OUTPUT_REFUSED)
    assert [entry.name for entry in folder.iterdir()] == ["mine"]


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"budget": 0}, "the budget 0 is no number above zero"),
        ({"rate": "x"}, "the rate 'x' is no number above zero"),
        ({"rate": 0.0}, "the rate 0.0 is no number above zero"),
        ({"window": "20:30"}, "the window '20:30' is no two times"),
        ({"window": (30.0, 20.0)}, "is no two times, s, in order"),
    ],
)
def test_an_argument_that_means_nothing_is_refused_in_one_line(wrong, said):
    with pytest.raises(UsageError, match=said):
        analyze(LOG, **wrong)


def test_a_model_of_another_vehicle_is_used_with_a_warning():
    told = analyze(LOG, model="hexacopter").warnings
    assert "hexacopter is a model of hexa, and the log is of quad" in told
    assert not [line for line in analyze(LOG, model="any_vehicle").warnings if "model of" in line]


def test_a_message_that_stops_while_others_go_on_is_told(tmp_path):
    path = tmp_path / "silent.tlog"
    path.write_bytes(injected(read(LOG), parse_fault("GPS_RAW_INT.alt:dropout@15")))
    told = [line for line in analyze(path).warnings if " stops at " in line]
    assert len(told) == 1
    assert told[0].startswith("GPS_RAW_INT stops at 1")
    assert not [line for line in analyze(LOG).warnings if " stops at " in line]


def test_messages_that_stop_together_are_one_line(tmp_path):
    lost = [parse_fault(f"{name}:dropout@15") for name in ("GPS_RAW_INT.alt", "VFR_HUD.alt")]
    first, path = tmp_path / "first.tlog", tmp_path / "silent.tlog"
    first.write_bytes(injected(read(LOG), lost[0]))
    path.write_bytes(injected(read(first), lost[1]))
    (told,) = [line for line in analyze(path).warnings if " stop at " in line]
    assert told.startswith("GPS_RAW_INT, VFR_HUD stop at 1")
    assert "what they show is unknown" in told
