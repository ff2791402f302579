"""What every command has in common: help, version, pipes, interrupts, defects."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fdi import __version__
from fdi.cli import analyze as analyze_command
from fdi.cli import main
from fdi.cli.commands import fdi

from .conftest import LOG, Run

FDI = [sys.executable, "-c", "import sys; from fdi.cli import main; sys.exit(main())"]


def test_the_version_is_told(run: Run) -> None:
    ended = run("--version")
    assert ended.code == 0
    assert __version__ in ended.out


def test_the_package_runs_as_a_module() -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "fdi", "--version"], capture_output=True, text=True, timeout=600
    )
    assert ended.returncode == 0
    assert ended.stdout == f"fdi, version {__version__}\n"


@pytest.mark.parametrize(
    "command", ["analyze", "info", "convert", "structure", "calibrate", "estimator", "vote"]
)
def test_help_shows_an_example(run: Run, command: str) -> None:
    ended = run(command, "--help")
    assert ended.code == 0
    assert f"fdi {command} " in ended.out
    assert "Example" in ended.out


def test_what_is_written_goes_where_o_says_in_every_command() -> None:
    every = [option for command in fdi.commands.values() for option in command.params]
    told = [option.opts for option in every if "--out" in option.opts]
    assert len(told) > 5
    assert all("-o" in names for names in told)


@pytest.mark.parametrize("words", [[], ["--help"]])
def test_the_group_lists_its_commands(run: Run, words: list[str]) -> None:
    ended = run(*words)
    told = ended.out + ended.err
    assert all(command in told for command in ("analyze", "info", "structure"))


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("fdi inf", {"plain,info"}),
        ("fdi analyze flight.t", {"file,flight.t"}),
        ("fdi structure fix", {"plain,fixed_wing"}),
        ("fdi structure my", {"file,my"}),
        ("fdi analyze --policy pap", {"plain,paper"}),
        ("fdi convert --ou", {"plain,--out"}),
        ("fdi cal", {"plain,calibrate"}),
        ("fdi est", {"plain,estimator"}),
        ("fdi estimator flight.b", {"file,flight.b"}),
        ("fdi calibrate --policy def", {"plain,default"}),
        ("fdi calibrate flight.t", {"file,flight.t"}),
        ("fdi analyze --bud", {"plain,--budget"}),
    ],
)
def test_a_shell_is_told_how_a_word_may_go_on(
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    words: str,
    expected: set[str],
) -> None:
    monkeypatch.setenv("_FDI_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", words)
    monkeypatch.setenv("COMP_CWORD", str(words.count(" ")))
    with pytest.raises(SystemExit, match="0"):
        main([])
    assert set(capsys.readouterr().out.split()) == expected


def test_an_unknown_command_is_2(run: Run) -> None:
    ended = run("analyse")
    assert ended.code == 2
    assert ended.err.count("\n") == 1


def test_a_log_without_a_command_is_told_the_command(run: Run) -> None:
    ended = run(str(LOG))
    assert ended.code == 2
    assert f"fdi analyze {LOG}" in ended.err


def test_info_is_a_page_or_json(run: Run) -> None:
    assert "impact, 9.8 m/s downwards" in run("info", LOG).out
    document = json.loads(run("info", LOG, "--json").out)
    assert document["log"]["vehicle"] == "quad"
    assert {"HEARTBEAT", "ATTITUDE"} <= {message["name"] for message in document["messages"]}


def test_convert_writes_the_folder_and_says_how_much(run: Run) -> None:
    ended = run("convert", LOG, "--out", "o")
    assert ended.code == 0
    assert ended.out.startswith("32 messages, ")
    assert "in o/" in ended.out
    assert {"ATTITUDE.parquet", "metadata.json"} <= {entry.name for entry in Path("o").iterdir()}
    assert not run("convert", LOG, "--out", "o", "--quiet").out
    assert run("convert", LOG).code == 2
    Path("mine").mkdir()
    Path("mine/x").write_text("")
    assert run("convert", LOG, "--out", "mine").code == 5
    assert run("convert", LOG, "--out", "mine", "--force").code == 0


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


def test_structure_says_why_faults_hang_together_and_what_would_part_them(
    run: Run, model: Path
) -> None:
    told = " ".join(run("structure", model, "--log", LOG).out.split())
    assert "nothing checks altitude, which follows from GPS_RAW_INT.alt" in told
    told = run("structure", model, "--place").out
    assert "What one further sensor of a variable would show" in told
    wider = model.with_name("wider.yaml")
    extra = (
        "  SCALED_PRESSURE3: {component: gps, fields: {press_abs: {variable: altitude, raw: true}}}"
    )
    wider.write_text(model.read_text() + extra)
    document = json.loads(run("structure", wider, "--log", LOG, "--place", "--json").out)
    found = document["placement"]
    assert (found["kind"], found["candidates"]) == ("message", ["SCALED_PRESSURE3"])
    assert found["sets"] == [["SCALED_PRESSURE3"]]
    assert ["GPS_RAW_INT.alt", "GLOBAL_POSITION_INT.alt"] in found["gains"][0]["isolable"]
    told = " ".join(run("structure", wider, "--log", LOG, "--place").out.split())
    assert "What one further message would show" in told
    assert "SCALED_PRESSURE3" in told


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
    assert command.wait(timeout=600) == 0
    assert command.stderr.read() == b""
    command.stderr.close()


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no full device here")
@pytest.mark.parametrize("command", ["info", "analyze"])
def test_a_full_disk_behind_standard_output_is_5(model: Path, command: str) -> None:
    words = {"info": [], "analyze": ["--json", "--model", str(model)]}[command]
    with Path("/dev/full").open("wb") as full:
        ended = subprocess.run(
            [*FDI, command, str(LOG), *words],
            stdout=full,
            stderr=subprocess.PIPE,
            text=True,
            timeout=600,
        )
    assert ended.returncode == 5
    assert ended.stderr.startswith("fdi: standard output")
    assert ended.stderr.count("\n") == 1


def run_with_room(most: int, work: Path, words: list[str]) -> subprocess.CompletedProcess[str]:
    """Run a command that fails to write more than so many bytes of a file, as on a full disk."""
    few = f"import resource; resource.setrlimit(resource.RLIMIT_FSIZE, ({most}, {most})); "
    folders = {"FDI_CACHE_DIR": str(work.parent / "c"), "MPLCONFIGDIR": str(work.parent)}
    return subprocess.run(
        [FDI[0], "-c", few + FDI[2], *words],
        cwd=work,
        env={**os.environ, **folders},
        capture_output=True,
        text=True,
        timeout=600,
    )


@pytest.mark.skipif(os.name == "nt", reason="no such limit there")
@pytest.mark.parametrize("most", [0, 100])
def test_a_table_on_a_full_disk_is_5_and_says_how_to_go_on(
    tmp_path: Path, model: Path, most: int
) -> None:
    """With no room at all, and with room for a part of the first row."""
    work = tmp_path / "w"
    work.mkdir()
    words = ["batch", str(LOG), "--model", str(model), "--workers", "1", "--out", "t.parquet"]
    ended = run_with_room(most, work, words)
    assert ended.returncode == 5, ended.stderr
    assert ended.stderr.startswith("fdi: t.parquet.rows.jsonl: cannot be written: File too large")
    assert ended.stderr.count("\n") == 1
    assert "--resume" in ended.stderr
    again = run_with_room(1_000_000, work, [*words, "--resume"])
    assert again.returncode == 0, again.stderr
    assert [path.name for path in work.iterdir()] == ["t.parquet"]


@pytest.mark.skipif(os.name == "nt", reason="no such limit there")
@pytest.mark.parametrize(
    "words",
    [
        ["analyze", str(LOG), "--out", "o", "--model", "{model}"],
        ["convert", str(LOG), "--out", "o"],
        ["inject", str(LOG), "--fault", "GPS_RAW_INT.alt:bias=15@20", "--out", "o"],
    ],
    ids=lambda words: words[0],
)
def test_a_full_disk_is_5_and_leaves_nothing(tmp_path: Path, model: Path, words: list[str]) -> None:
    work = tmp_path / "w"
    work.mkdir()
    ended = run_with_room(20_000, work, [word.format(model=model) for word in words])
    assert (ended.returncode, ended.stdout) == (5, ""), ended.stderr
    assert ended.stderr == "fdi: o: cannot be written: File too large\n"
    assert not list(work.iterdir())


def heed_interrupts() -> None:
    """Undo what a shell does to its background jobs, of which the tests may be one."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def test_ctrl_c_is_130_and_leaves_nothing(tmp_path: Path, model: Path) -> None:
    work = tmp_path / "w"
    work.mkdir()
    command = subprocess.Popen(
        [*FDI, "analyze", str(LOG), "--model", str(model)],
        cwd=work,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_interrupts,
    )
    deadline = time.monotonic() + 300
    while not list(work.iterdir()) and command.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    command.send_signal(signal.SIGINT)
    _, err = command.communicate(timeout=600)
    assert command.returncode == 130, err
    assert err.strip() == "fdi: interrupted"
    assert not list(work.iterdir())


def test_structure_counts_the_tests_that_an_analysis_has(run: Run) -> None:
    """Those of the default policy's methods, whose columns no log holds by itself, included."""
    told = json.loads(run("structure", "quadcopter", "--log", LOG, "--json").out)
    analysis = json.loads(run("analyze", LOG, "--json", "--model", "quadcopter").out)
    told = told["structure"]
    assert told["detectable"] == analysis["structure"]["detectable"]
    assert "estimator.velocity_ratio" in told["detectable"]
