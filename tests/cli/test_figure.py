"""``fdi figure``: the file it writes, and what it refuses."""

from pathlib import Path

import pytest

from .conftest import LOG, Run


@pytest.mark.parametrize(
    ("kind", "head"), [("svg", b"<?xml"), ("pdf", b"%PDF"), ("png", b"\x89PNG")]
)
def test_a_figure_is_written_and_named(run: Run, model: Path, kind: str, head: bytes) -> None:
    name = f"own.{kind}"
    ended = run("figure", LOG, "--model", model, "--what", "track", "--out", name)
    assert ended.code == 0
    assert ended.out == f"{name}\n"
    assert Path(name).read_bytes().startswith(head)


def test_without_a_name_the_log_and_the_figure_give_one(run: Run, model: Path) -> None:
    assert run("figure", LOG, "--model", model, "--quiet").out == ""
    assert [path.name for path in Path.cwd().iterdir()] == [f"{LOG.stem}-grid.svg"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--out", "own.bmp"), "no picture ends with '.bmp'"),
        (("--what", "pie"), "'pie' is not one of"),
        (("--test", "r1"), "a test is not what grid shows"),
        (("--what", "channels", "--channel", "nonsense"), "is no channel"),
        (("--what", "channels", "--channel", "NO_SUCH.roll"), "has no message NO_SUCH"),
        (("--what", "residual", "--test", "r999"), "no test 'r999'"),
        (("--what", "evidence", "--finding", "99"), "there is no finding 99"),
        (("--finding", "0"), "is not in the range"),
        (("--width", "1"), "cannot be drawn"),
    ],
)
def test_what_cannot_be_drawn_ends_with_2_and_one_line(
    run: Run, model: Path, words: tuple[str, ...], said: str
) -> None:
    ended = run("figure", LOG, "--model", model, "--quiet", *words)
    assert ended.code == 2
    assert said in ended.err
    assert len(ended.err.splitlines()) == 1
    assert not list(Path.cwd().iterdir())


def test_a_missing_log_ends_with_3(run: Run) -> None:
    assert run("figure", "nowhere.tlog").code == 3


def test_a_folder_that_is_not_there_ends_with_5(run: Run, model: Path) -> None:
    assert run("figure", LOG, "--model", model, "--out", "no/such/own.svg").code == 5
