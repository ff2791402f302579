import json
import os
from pathlib import Path
from typing import Any

import pytest

from fdi.errors import OutputError, UsageError
from fdi.report import check_folder, write_file, write_report
from fdi.report import folder as folder_module
from fdi.report.files import NAMES
from fdi.result import Analysis


def names(folder: Path) -> set[str]:
    return {entry.name for entry in folder.iterdir()}


def test_a_report_holds_every_promised_file(analysis: Analysis, tmp_path: Path) -> None:
    assert write_report(analysis, tmp_path / "out") == tmp_path / "out"
    assert names(tmp_path / "out") == NAMES
    assert names(tmp_path) == {"out"}


@pytest.mark.parametrize(
    ("formats", "files"),
    [
        (["json"], {"analysis.json"}),
        (["txt", "csv"], {"summary.txt", "fault_grid.csv", "isolability.csv", ".fdi-report"}),
        (["parquet", "json"], {"residuals.parquet", "analysis.json"}),
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
    assert names(out) == {"fault_grid.csv", "isolability.csv", ".fdi-report", "my notes.txt"}
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
    assert names(tmp_path) == {"analysis.json"}


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


def test_a_report_can_be_told_from_its_head(analysis: Analysis, tmp_path: Path) -> None:
    write_report(analysis, tmp_path / "out", ["json"])
    document = json.loads((tmp_path / "out" / "analysis.json").read_text())
    assert document["tool"]["name"] == "uav-fdi"
    assert folder_module.is_ours(tmp_path / "out")
