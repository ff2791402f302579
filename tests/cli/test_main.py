"""What every command has in common: help, version, pipes, interrupts, defects."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fdi import __version__
from fdi.cli import analyze as analyze_command

from .conftest import LOG, Run

FDI = [sys.executable, "-c", "import sys; from fdi.cli import main; sys.exit(main())"]


def test_the_version_is_told(run: Run) -> None:
    ended = run("--version")
    assert ended.code == 0
    assert __version__ in ended.out


def test_the_package_runs_as_a_module() -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "fdi", "--version"], capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 0
    assert ended.stdout == f"fdi, version {__version__}\n"


@pytest.mark.parametrize("command", ["analyze", "info", "structure"])
def test_help_shows_an_example(run: Run, command: str) -> None:
    ended = run(command, "--help")
    assert ended.code == 0
    assert f"fdi {command} " in ended.out
    assert "Example" in ended.out


@pytest.mark.parametrize("words", [[], ["--help"]])
def test_the_group_lists_its_commands(run: Run, words: list[str]) -> None:
    ended = run(*words)
    told = ended.out + ended.err
    assert all(command in told for command in ("analyze", "info", "structure"))


def test_an_unknown_command_is_2(run: Run) -> None:
    ended = run("analyse")
    assert ended.code == 2
    assert ended.err.count("\n") == 1


def test_info_is_a_page_or_json(run: Run) -> None:
    assert "impact at 9.8 m/s" in run("info", LOG).out
    document = json.loads(run("info", LOG, "--json").out)
    assert document["log"]["vehicle"] == "quad"
    assert {"HEARTBEAT", "ATTITUDE"} <= {message["name"] for message in document["messages"]}


def test_structure_describes_or_gives_json(run: Run, model: Path) -> None:
    told = run("structure", model)
    assert told.code == 0
    assert "cannot be detected" in told.out
    document = json.loads(run("structure", model, "--log", LOG, "--json").out)
    found = document["structure"]
    assert found["equations"] == 5
    assert found["faults"] == 3
    assert found["mtes"] == found["mso"] == 2
    assert found["detectable"] == ["motor_1", "GPS_RAW_INT.alt", "GLOBAL_POSITION_INT.alt"]


def test_structure_draws_a_picture(run: Run, model: Path) -> None:
    assert run("structure", model, "--figure", "matrix.svg").code == 0
    assert Path("matrix.svg").read_bytes().startswith(b"<?xml")
    assert run("structure", model, "--figure", "matrix.docx").code == 2
    assert run("structure", model, "--figure", "no/where/matrix.png").code == 5


def test_a_defect_is_70_and_names_the_file_with_the_traceback(
    run: Run, monkeypatch: pytest.MonkeyPatch, model: Path
) -> None:
    def broken(*_: object, **__: object) -> None:
        raise RuntimeError("it broke")

    monkeypatch.setattr(analyze_command, "_tell", broken)
    ended = run("analyze", LOG, "--model", model, "--format", "txt")
    assert ended.code == 70
    assert ended.err.count("\n") == 1
    path = Path(ended.err.split("file ")[1].strip())
    assert "it broke" in path.read_text()
    path.unlink()


def test_a_reader_that_leaves_early_is_no_error() -> None:
    command = subprocess.Popen(
        [*FDI, "info", str(LOG)], stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert command.stdout is not None
    assert command.stderr is not None
    command.stdout.close()
    assert command.wait(timeout=60) == 0
    assert command.stderr.read() == b""
    command.stderr.close()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
def test_a_full_disk_behind_standard_output_is_5() -> None:
    with Path("/dev/full").open("wb") as full:
        ended = subprocess.run(
            [*FDI, "info", str(LOG)], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60
        )
    assert ended.returncode == 5
    assert ended.stderr.startswith("fdi: standard output")


def test_ctrl_c_is_130_and_leaves_nothing(tmp_path: Path, model: Path) -> None:
    work = tmp_path / "w"
    work.mkdir()
    command = subprocess.Popen(
        [*FDI, "analyze", str(LOG), "--model", str(model)],
        cwd=work,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    deadline = time.monotonic() + 30
    while not list(work.iterdir()) and command.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    command.send_signal(signal.SIGINT)
    _, err = command.communicate(timeout=60)
    assert command.returncode == 130, err
    assert err.strip() == "fdi: interrupted"
    assert not list(work.iterdir())
