"""Ctrl-C is 130 and one line, whatever runs when it is pressed."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from .conftest import LOG

pytestmark = [
    pytest.mark.flights,
    pytest.mark.skipif(os.name == "nt", reason="Ctrl-C is no signal there"),
]

END = "\nfrom fdi.cli import main\nsys.exit(main())"
AT_IMPORT = """
import os, signal, sys
left = int(sys.argv.pop(1))
def press(event, _):
    global left
    if event == "import":
        left -= 1
        if left == 0:
            os.kill(os.getpid(), signal.SIGINT)
sys.addaudithook(press)
"""
AFTER_MAIN = """
import os, signal, sys, time
from fdi.cli import main
code = main()
os.kill(os.getpid(), signal.SIGINT)
time.sleep(1)
sys.exit(code)
"""
IN_RUN = """
import os, signal, sys, time
import fdi.cli.commands
def press():
    os.kill(os.getpid(), signal.SIGINT)
    time.sleep(1)
def run(arguments):
{}
    time.sleep(600)
    return 0
fdi.cli.commands.run = run
"""
LOST = {
    "dropped": """
    try:
        press()
    except BaseException:
        pass""",
    "turned into another": """
    try:
        press()
    except KeyboardInterrupt:
        pass
    raise ImportError("half loaded")""",
    "in a destructor": """
    class Dropping:
        def __del__(self):
            press()
    Dropping()""",
    "pressed again while it is cleaned up": """
    try:
        press()
    finally:
        try:
            press()
            open("clean", "w")
        except BaseException:
            raise RuntimeError""",
}


def heed_interrupts() -> None:
    """Undo what a shell does to its background jobs, of which the tests may be one."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def started(code: str, words: list[str], work: Path) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", code, *words],
        cwd=work,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=heed_interrupts,
    )


def assert_interrupted(process: subprocess.Popen[str], work: Path) -> None:
    with process:
        out, err = process.communicate(timeout=600)
    assert (process.returncode, out, err.strip()) == (130, "", "fdi: interrupted")
    assert not list(work.iterdir())


@pytest.fixture
def work(tmp_path: Path) -> Path:
    work = tmp_path / "w"
    work.mkdir()
    return work


@pytest.mark.parametrize("number", [25, 100, 350, 650, 950])
def test_within_an_import(number: int, work: Path, model: Path) -> None:
    """Of the libraries that the command line needs, and of those that the analysis does."""
    words = [str(number), "analyze", str(LOG), "--model", str(model), "--quiet"]
    assert_interrupted(started(AT_IMPORT + END, words, work), work)


@pytest.mark.parametrize("name", ["fdi.cli.commands", "rich_click", "numpy", "atexit"])
def test_from_the_first_module_on_that_it_loads_itself(name: str, work: Path, model: Path) -> None:
    """Interrupted when the import begins: the earliest of them are the first things that load."""
    code = AT_IMPORT.replace('event == "import"', f'event == "import" and _[0] == {name!r}')
    words = ["1", "analyze", str(LOG), "--model", str(model), "--quiet"]
    assert_interrupted(started(code + END, words, work), work)


def test_next_to_nothing_is_loaded_before_it_listens(work: Path) -> None:
    """Till then Ctrl-C is a traceback: ``signal`` and ``enum`` alone took a third of that time."""
    code = """
import sys
before = set(sys.modules)
import fdi.cli.interrupt
def listen(self, *, to_the_end):
    print(*sorted(set(sys.modules) - before))
    sys.exit()
fdi.cli.interrupt.Interrupts.listen = listen
"""
    with started(code + END, [], work) as process:
        out, _ = process.communicate(timeout=600)
    ours = {"__future__", "fdi", "fdi.cli", "fdi.cli.interrupt", "fdi.cli.main"}
    assert set(out.split()) <= ours


def test_after_the_answer(work: Path) -> None:
    with started(AFTER_MAIN, ["--version"], work) as process:
        out, err = process.communicate(timeout=600)
    assert process.returncode == 130
    assert out.startswith("fdi, version")
    assert err == "fdi: interrupted\n"


@pytest.mark.parametrize("how", LOST)
def test_an_interrupt_that_is_lost_on_its_way_still_ends(how: str, work: Path) -> None:
    before = time.monotonic()
    process = started(IN_RUN.format(LOST[how]) + END, [], work)
    process.wait(timeout=600)
    assert time.monotonic() - before < 300
    if how == "pressed again while it is cleaned up":
        (work / "clean").unlink()
    assert_interrupted(process, work)


@pytest.mark.parametrize("gap", [0.0, 0.02, 0.3])
def test_twice(gap: float, work: Path, model: Path) -> None:
    process = started("import sys" + END, ["analyze", str(LOG), "--model", str(model)], work)
    deadline = time.monotonic() + 300
    while not list(work.iterdir()) and process.poll() is None and time.monotonic() < deadline:
        time.sleep(0.005)
    for _ in range(2):
        process.send_signal(signal.SIGINT)
        time.sleep(gap)
    assert_interrupted(process, work)
