"""Files that are no log, models that are none: one line, the right code, no traceback, no hang."""

import os
import shutil
import subprocess
import sys
import threading
from pathlib import Path

import pytest

import fdi

from .conftest import LOG, MODEL, Ended, Run, refused


def is_told(ended: Ended, code: int) -> None:
    assert ended.code == code, ended.err
    assert ended.err.startswith("fdi: ")
    assert "Traceback" not in ended.out + ended.err
    assert not list(Path().iterdir())


@pytest.mark.parametrize(
    "content", [b"", b"plain words\n" * 99, bytes(4096), b"\xfe" * 5000, os.urandom(5000)]
)
def test_what_is_no_log_is_3(run: Run, tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(content)
    ended = run("analyze", path)
    is_told(ended, 3)
    assert ended.err.count("\n") == 1
    assert str(path) in ended.err


def test_a_log_that_holds_too_little_for_the_model_it_chose_is_3(run: Run, tmp_path: Path) -> None:
    """Nobody named a model, so none is wrong (4)."""
    path = tmp_path / "flight.log"
    path.write_bytes(b"FMT,1,1,ATT,IccccCC,Yaw\nATT,2,0,1,0,5,0,0\r")
    is_told(run("analyze", path), 3)


def test_what_is_no_file_is_3(run: Run, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    for path in (tmp_path, tmp_path / "missing", tmp_path / "fifo"):
        for command in ("analyze", "info"):
            is_told(run(command, path), 3)


CUT = """
import os, sys
from fdi.cli import main
from fdi.telemetry import content, reading
content.COPIED = 1000  # larger ones are mapped
whole = reading.content
def cut(file, path):
    data = whole(file, path)
    os.truncate(path, 5000)
    return data
reading.content = cut
sys.exit(main(["info", sys.argv[1]]))
"""


@pytest.mark.skipif(os.name == "nt", reason="a mapped file cannot be cut there")
def test_a_mapped_log_that_is_cut_short_while_it_is_read_is_3(tmp_path: Path) -> None:
    """The kernel ends the process at the first byte that is gone."""
    path = tmp_path / "flight.tlog"
    path.write_bytes(LOG.read_bytes())
    ended = subprocess.run(
        [sys.executable, "-c", CUT, str(path)], capture_output=True, text=True, timeout=600
    )
    assert (ended.returncode, ended.stdout) == (3, "")
    assert ended.stderr.startswith("fdi: a log was cut short")
    assert ended.stderr.count("\n") == 1


def test_what_is_no_file_cannot_be_converted(run: Run, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "fifo")
    for path in (tmp_path, tmp_path / "missing", tmp_path / "fifo", Path("/dev/zero")):
        ended = run("convert", path, "--out", "o")
        is_told(ended, 3)
        assert ended.err.count("\n") == 1


@pytest.mark.parametrize("command", ["analyze", "info"])
def test_a_log_without_permission_is_3(tmp_path: Path, command: str) -> None:
    path = tmp_path / "secret.tlog"
    path.write_bytes(LOG.read_bytes())
    path.chmod(0)
    ended = refused(command, path, "--json")
    assert (ended.code, ended.out) == (3, "")
    assert ended.err == f"fdi: {path}: cannot be read: permission denied\n"


def test_a_folder_without_permission_is_5(tmp_path: Path) -> None:
    locked = tmp_path / "locked"
    locked.mkdir(mode=0o500)
    ended = refused("analyze", LOG, "--out", locked / "out", "--format", "json")
    assert (ended.code, ended.out, ended.err.count("\n")) == (5, "", 1)
    assert str(locked) in ended.err


@pytest.mark.parametrize(
    ("locked", "code"),
    [("decision/policies", 4), ("telemetry/data", 70), ("diagnosis/advice", 4), ("../models", 4)],
)
def test_an_installation_that_may_not_be_read_is_no_defect(
    tmp_path: Path, locked: str, code: int
) -> None:
    root = Path(fdi.__file__).parents[1]
    for name in ("fdi", "models"):
        shutil.copytree(root / name, tmp_path / name)
    folder = tmp_path / "fdi" / locked
    folder.chmod(0)
    try:
        ended = refused(
            "analyze", LOG, "--json", code=f"import sys; sys.path.insert(0, {str(tmp_path)!r})"
        )
    finally:
        folder.chmod(0o700)
    assert (ended.code, ended.out, ended.err.count("\n")) == (code, "", 1), ended.err
    assert "cannot be read" in ended.err
    assert "defect" not in ended.err


@pytest.mark.parametrize("command", ["analyze", "info", "convert"])
def test_a_log_that_grows_while_it_is_read_gives_what_was_there(
    run: Run, model: Path, tmp_path: Path, command: str
) -> None:
    path = tmp_path / "growing.tlog"
    data = LOG.read_bytes()
    path.write_bytes(data)
    more = {"analyze": ["--model", model, "--format", "txt"], "convert": ["--out", "o"]}
    stop = threading.Event()

    def grow() -> None:
        with path.open("ab", buffering=0) as file:
            while not stop.wait(0.001):
                file.write(b"\0" * 64)

    writer = threading.Thread(target=grow)
    writer.start()
    try:
        ended = run(command, path, *more.get(command, []))
    finally:
        stop.set()
        writer.join()
    assert (ended.code, ended.err.count("Traceback")) == (0, 0), ended.err
    told = ended.out if command != "convert" else Path("o/metadata.json").read_text()
    assert "the file grew while it was read" in " ".join(told.split())


def test_a_cut_log_gives_what_is_left(run: Run, model: Path, tmp_path: Path) -> None:
    path = tmp_path / "cut.tlog"
    path.write_bytes(LOG.read_bytes()[:100_001])
    ended = run("analyze", path, "--model", model, "--format", "txt")
    assert ended.code == 0
    assert "The data are not whole: the file ends in the middle of a message" in ended.out


def test_a_log_without_a_message_of_the_model_is_3(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "other.yaml"
    path.write_text(MODEL.replace("GPS_RAW_INT", "GPS2_RAW").split("inputs:")[0] + OTHER)
    is_told(run("analyze", LOG, "--model", path), 3)


OTHER = """measurements:
  GPS2_RAW:
    component: gps
    fields:
      alt: {variable: altitude}
      eph: {variable: u_1, raw: true}
"""


@pytest.mark.parametrize(
    "text",
    [
        "effort = u_1 + nobody",
        "effort = __import__('os').getpid()",
        "effort = u_1.real",
        "effort = 9**9**9**9",
        "effort = " + "(" * 10_000 + "u_1" + ")" * 10_000,
        "effort = " + "(" * 500 + "u_1" + ")" * 500,
    ],
)
def test_a_wrong_expression_is_4(run: Run, tmp_path: Path, text: str) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text(MODEL.replace("effort = u_1", text))
    for command in (["analyze", LOG, "--model", path], ["structure", path]):
        ended = run(*command)
        is_told(ended, 4)
        assert "wrong.yaml:" in ended.err


def test_all_problems_of_a_model_are_told_a_line_each(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "wrong.yaml"
    path.write_text(
        MODEL.replace("effort = u_1", "effort = u_9").replace(
            "variable: altitude, acc", "variable: nothing, acc"
        )
    )
    ended = run("structure", path)
    is_told(ended, 4)
    assert ended.err.count("\n") >= 2
    assert all(line.startswith("fdi: wrong.yaml:") for line in ended.err.splitlines())


def test_an_alias_bomb_is_4(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "bomb.yaml"
    rows = ["a0: &a0 [x, x]"] + [f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]" for i in range(1, 30)]
    path.write_text("format: 1\nname: bomb\n" + "\n".join(rows))
    is_told(run("structure", path), 4)


@pytest.mark.parametrize("option", ["--model", "--policy"])
def test_what_is_neither_shipped_nor_a_file_is_4(run: Run, option: str) -> None:
    is_told(run("analyze", LOG, option, "nowhere"), 4)


def test_options_of_another_way_to_evaluate_are_2(run: Run, tmp_path: Path) -> None:
    labels = tmp_path / "labels.json"
    labels.write_text("{}")
    for option in (("--kind", "drift"), ("--moments", "3"), ("--channel", "ATTITUDE.roll")):
        ended = run("evaluate", labels, *option)
        assert ended.code == 2
        assert f"{option[0]} is of --inject" in ended.err


def test_log_is_not_written_over_by_its_own_injection(run: Run, tmp_path: Path) -> None:
    path = tmp_path / "flight.tlog"
    path.write_bytes(LOG.read_bytes())
    ended = run("inject", path, "--fault", "gps:bias=1@20", "--out", path, "--force")
    assert ended.code == 5
    assert "is the log itself" in ended.err
    assert path.read_bytes() == LOG.read_bytes()
