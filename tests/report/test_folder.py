import hashlib
import json
import os
import stat
from contextlib import nullcontext, suppress
from pathlib import Path
from typing import Any

import pytest

from fdi.errors import OutputError, UsageError
from fdi.report import check_folder, write_file, write_report
from fdi.report import folder as folder_module
from fdi.report.files import FORMATS, names_of
from fdi.result import Analysis

LIST = ".fdi-manifest.json"
NAMES = {*names_of(FORMATS), LIST}


def names(folder: Path) -> set[str]:
    return {entry.name for entry in folder.iterdir()}


def test_a_report_holds_every_promised_file(analysis: Analysis, tmp_path: Path) -> None:
    assert write_report(analysis, tmp_path / "out") == tmp_path / "out"
    assert names(tmp_path / "out") == NAMES
    assert names(tmp_path) == {"out"}


@pytest.mark.parametrize(
    ("formats", "files"),
    [
        (["json"], {"analysis.json", LIST}),
        (["txt", "csv"], {"summary.txt", "fault_grid.csv", "isolability.csv", LIST}),
        (["parquet", "json"], {"residuals.parquet", "analysis.json", LIST}),
    ],
)
def test_format_narrows_what_is_written(
    analysis: Analysis, tmp_path: Path, formats: list[str], files: set[str]
) -> None:
    write_report(analysis, tmp_path / "out", formats)
    assert names(tmp_path / "out") == files


@pytest.mark.parametrize("formats", [["docx"], []])
def test_an_unknown_format_is_a_mistake_of_the_call(
    analysis: Analysis, tmp_path: Path, formats: list[str]
) -> None:
    with pytest.raises(UsageError, match="format"):
        write_report(analysis, tmp_path / "out", formats)


@pytest.mark.parametrize("first", [["json"], ["txt"]])
def test_a_folder_of_ours_is_replaced_and_foreign_files_in_it_stay(
    analysis: Analysis, tmp_path: Path, first: list[str]
) -> None:
    out = tmp_path / "out"
    write_report(analysis, out, first)
    (out / "my notes.txt").write_text("mine")
    write_report(analysis, out, ["csv"])
    assert names(out) == {"fault_grid.csv", "isolability.csv", LIST, "my notes.txt"}
    assert names(tmp_path) == {"out"}


def test_a_foreign_folder_is_refused_without_force(analysis: Analysis, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "analysis.json").write_text('{"tool": {"name": "another"}}')
    with pytest.raises(OutputError, match="--force"):
        write_report(analysis, out, ["txt"])
    assert names(out) == {"analysis.json"}
    write_report(analysis, out, ["txt"], force=True)
    assert "summary.txt" in names(out)


def test_an_empty_folder_is_used(analysis: Analysis, tmp_path: Path) -> None:
    write_report(analysis, tmp_path, ["json"])
    assert names(tmp_path) == {"analysis.json", LIST}


def test_a_symbolic_link_is_not_followed(analysis: Analysis, tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "out").symlink_to(tmp_path / "real")
    with pytest.raises(OutputError, match="symbolic link"):
        write_report(analysis, tmp_path / "out", ["json"], force=True)
    assert not names(tmp_path / "real")


def test_a_file_in_the_way_is_refused_even_with_force(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    with pytest.raises(OutputError, match="no folder"):
        check_folder(tmp_path / "out", force=True)


def test_the_working_directory_is_never_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "below").mkdir()
    monkeypatch.chdir(tmp_path / "below")
    for place in (Path("."), Path("..")):
        with pytest.raises(OutputError, match="working directory"):
            check_folder(place, force=True)


@pytest.mark.parametrize("failure", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_failure_half_way_leaves_the_old_report_and_nothing_else(
    analysis: Analysis,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    failure: BaseException,
) -> None:
    out = tmp_path / "out"
    write_report(analysis, out, ["json"])
    before = (out / "analysis.json").read_bytes()

    def half(*_: Any) -> Any:
        yield "summary.txt", b"x"
        raise failure

    monkeypatch.setattr(folder_module, "contents", half)
    with pytest.raises((OutputError, KeyboardInterrupt)):
        write_report(analysis, out)
    assert names(tmp_path) == {"out"}
    assert (out / "analysis.json").read_bytes() == before


def test_what_the_system_refuses_names_the_path(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="file/below"):
        check_folder(tmp_path / "file" / "below" / "\0") if os.name == "nt" else write_file(
            tmp_path / "file" / "below", b""
        )


def test_a_report_is_the_same_byte_for_byte(analysis: Analysis, tmp_path: Path) -> None:
    for place in ("one", "two"):
        write_report(analysis, tmp_path / place)
    for name in NAMES:
        assert (tmp_path / "one" / name).read_bytes() == (tmp_path / "two" / name).read_bytes(), (
            name
        )


def test_the_list_says_what_was_written(analysis: Analysis, tmp_path: Path) -> None:
    write_report(analysis, tmp_path / "out", ["json", "txt"])
    told = json.loads((tmp_path / "out" / LIST).read_text())
    assert told["tool"]["name"] == "uav-fdi"
    for entry in told["files"]:
        content = (tmp_path / "out" / entry["name"]).read_bytes()
        assert entry["sha256"] == hashlib.sha256(content).hexdigest()
    assert {entry["name"] for entry in told["files"]} == {"analysis.json", "summary.txt"}


def test_a_report_that_a_person_changed_is_refused_and_kept(
    analysis: Analysis, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    write_report(analysis, out, ["html", "json", "txt"])
    (out / "report.html").write_text("with my remarks")
    (out / "summary.txt").write_text("with my remarks, too")
    with pytest.raises(OutputError, match=r"report\.html in it was changed"):
        write_report(analysis, out, ["html", "json"])
    write_report(analysis, out, ["html", "json"], force=True)
    assert (out / "report.html.1").read_text() == "with my remarks"
    assert (out / "summary.txt").read_text() == "with my remarks, too"
    assert names(out) == {"report.html", "report.html.1", "analysis.json", "summary.txt", LIST}


@pytest.mark.parametrize("formats", [["json"], ["html"]])
def test_a_persons_own_report_survives_force(
    analysis: Analysis, tmp_path: Path, formats: list[str]
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (out / "report.html").write_text("mine")
    write_report(analysis, out, formats, force=True)
    assert "mine" in {path.read_text("utf-8") for path in out.glob("report.html*")}


def test_a_file_of_our_name_beside_our_files_is_refused(analysis: Analysis, tmp_path: Path) -> None:
    out = tmp_path / "out"
    write_report(analysis, out, ["json"])
    (out / "report.html").write_text("mine")
    write_report(analysis, out, ["json"])
    with pytest.raises(OutputError, match=r"report\.html in it was not written by fdi"):
        write_report(analysis, out, ["html"])
    assert (out / "report.html").read_text() == "mine"


def test_a_folder_keeps_its_place_and_its_mode(analysis: Analysis, tmp_path: Path) -> None:
    out = tmp_path / "out"
    out.mkdir(mode=0o700)
    place = out.stat().st_ino
    write_report(analysis, out, ["json"])
    (out / "analysis.json").chmod(0o600)
    write_report(analysis, out, ["json"])
    assert (out.stat().st_ino, stat.S_IMODE(out.stat().st_mode)) == (place, 0o700)
    assert stat.S_IMODE((out / "analysis.json").stat().st_mode) == 0o600


def test_a_folder_without_a_list_is_somebody_elses(analysis: Analysis, tmp_path: Path) -> None:
    """Also one that a version of ours wrote before there were lists."""
    out = tmp_path / "out"
    write_report(analysis, out, ["json"])
    (out / LIST).unlink()
    with pytest.raises(OutputError, match="no list"):
        write_report(analysis, out, ["json"])


def listed(out: Path, files: dict[str, bytes]) -> None:
    """Write a list as a stranger would."""
    entries = [
        {"name": name, "sha256": hashlib.sha256(content).hexdigest()}
        for name, content in files.items()
    ]
    tree = {"schema_version": 1, "tool": {"name": "uav-fdi"}, "holds": "report", "files": entries}
    (out / LIST).write_text(json.dumps(tree))


@pytest.mark.parametrize("name", ["../thesis.txt", "sub/thesis.txt", "{outside}", "..", ""])
@pytest.mark.parametrize("force", [False, True])
def test_a_strangers_list_names_nothing_outside_the_folder(
    analysis: Analysis, tmp_path: Path, name: str, force: bool
) -> None:
    out = tmp_path / "out"
    (out / "sub").mkdir(parents=True)
    for path in (tmp_path / "thesis.txt", out / "sub" / "thesis.txt"):
        path.write_bytes(b"years")
    listed(out, {name.format(outside=tmp_path / "thesis.txt"): b"years"})
    with nullcontext() if force else pytest.raises(OutputError):
        write_report(analysis, out, ["json"], force=force)
    assert (tmp_path / "thesis.txt").read_bytes() == b"years"
    assert (out / "sub" / "thesis.txt").read_bytes() == b"years"


@pytest.mark.parametrize("force", [False, True])
def test_a_link_that_a_strangers_list_names_is_not_followed(
    analysis: Analysis, tmp_path: Path, force: bool
) -> None:
    out = tmp_path / "out"
    out.mkdir()
    (tmp_path / "thesis.txt").write_bytes(b"years")
    (out / "summary.txt").symlink_to(tmp_path / "thesis.txt")
    (out / "analysis.json").symlink_to(tmp_path / "thesis.txt")
    listed(out, {"summary.txt": b"years", "analysis.json": b"years"})
    with nullcontext() if force else pytest.raises(OutputError):
        write_report(analysis, out, ["json"], force=force)
    assert (tmp_path / "thesis.txt").read_bytes() == b"years"
    assert (out / "summary.txt").is_symlink()


@pytest.mark.parametrize("content", [b"", b"{", b"[1]", b"[" * 100_000, b"\xff", b'{"files": 1}'])
def test_a_damaged_list_makes_nothing_ours(
    analysis: Analysis, tmp_path: Path, content: bytes
) -> None:
    out = tmp_path / "out"
    write_report(analysis, out, ["json"])
    (out / LIST).write_bytes(content)
    with pytest.raises(OutputError, match="no list"):
        write_report(analysis, out, ["json"])
    write_report(analysis, out, ["json"], force=True)
    write_report(analysis, out, ["json"])


def test_a_folder_in_the_way_of_a_file_is_refused_even_with_force(
    analysis: Analysis, tmp_path: Path
) -> None:
    (tmp_path / "out" / "report.html").mkdir(parents=True)
    with pytest.raises(OutputError, match=r"holds a folder report\.html"):
        write_report(analysis, tmp_path / "out", ["html"], force=True)


@pytest.mark.parametrize("count", range(6))
def test_a_kill_between_two_renames_leaves_a_folder_that_is_ours(
    analysis: Analysis, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, count: int
) -> None:
    """The list is replaced first and last; the files of either time are ours in between."""
    out = tmp_path / "out"
    write_report(analysis, out, ["json", "txt", "csv"])
    other = {"json": b"{}", "txt": b"other"}
    done = []

    def some(fresh: Path, path: Path) -> None:
        if len(done) == count:
            raise KeyboardInterrupt
        done.append(os.replace(fresh, path))

    with monkeypatch.context() as patch:
        patch.setattr(folder_module, "_replace", some)
        patch.setattr(
            folder_module,
            "contents",
            lambda _, wanted: [(names_of([kind])[0], other[kind]) for kind in wanted],
        )
        with suppress(KeyboardInterrupt):
            write_report(analysis, out, ["json", "txt"])
    write_report(analysis, out, ["json"])
    assert names(out) == {"analysis.json", LIST}


def test_what_a_killed_run_left_makes_no_folder_foreign(analysis: Analysis, tmp_path: Path) -> None:
    out = tmp_path / "out"
    (out / ".fdi-0123abcd.tmp").mkdir(parents=True)
    write_report(analysis, out, ["json"])
    assert "analysis.json" in names(out)
