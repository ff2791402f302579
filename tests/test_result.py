"""What can be asked of an analysis by whoever writes a script."""

import json

import pytest
from report.build import small_analysis

from fdi.errors import OutputError
from fdi.report import analysis_document, write_report


@pytest.fixture(scope="module")
def analysis(tmp_path_factory):
    return small_analysis(tmp_path_factory.mktemp("model"))


def test_analysis_shows_its_parts_as_frames(analysis):
    assert analysis.verdict == analysis.diagnosis.verdict
    assert list(analysis.fault_grid.columns) == list(analysis.diagnosis.grid.faults)
    assert analysis.residuals.shape == (len(analysis.signals.t), len(analysis.bank.generators))
    assert analysis.isolability.to_numpy().tolist() == (
        analysis.diagnosis.implementable.matrix.astype(int).tolist()
    )
    assert repr(analysis) == f"<Analysis of flight.tlog: {analysis.verdict}>"


def test_document_is_that_of_the_report(analysis):
    assert analysis.document() == analysis_document(analysis)


def test_report_is_written_in_the_formats_asked_for(analysis, tmp_path):
    folder = analysis.report(tmp_path / "own", ["json", "csv"])
    write_report(analysis, tmp_path / "other", ["json", "csv"])
    names = sorted(path.name for path in folder.iterdir())
    assert {"analysis.json", "fault_grid.csv", "isolability.csv"} <= set(names)
    assert not [name for name in names if name.endswith((".html", ".png", ".txt"))]
    for name in names:
        assert (folder / name).read_bytes() == (tmp_path / "other" / name).read_bytes()
    assert json.loads((folder / "analysis.json").read_text()) == analysis.document()


def test_report_goes_into_a_foreign_folder_only_when_forced(analysis, tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with pytest.raises(OutputError):
        analysis.report(tmp_path, ["json"])
    assert analysis.report(tmp_path, ["json"], force=True) == tmp_path
    assert (tmp_path / "mine.txt").read_text() == "mine"
