"""What does an analysis hold? The value that the corridor returns: that of every stage.

What can be asked of it is here, for whoever writes a script; how it is told is the matter of
``fdi.report``, which `Analysis.document` and `Analysis.report` call. That room lies above this one:
it is imported when it is asked for, and an ``Analysis`` holds nothing of it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fdi.decision import Alarms, Policy
from fdi.diagnosis import Consequence, Diagnosis, Fact, Finding, NotTestable, Open, RuledOut
from fdi.methods.estimator import EstimatorHealth
from fdi.methods.setup import Check
from fdi.model import Airframe, System
from fdi.residuals import Bank, Residuals
from fdi.residuals.latency import Lag
from fdi.shown import Rows, clean, html_table
from fdi.telemetry import Log, Signals

if TYPE_CHECKING:
    import pandas
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True, eq=False)
class Analysis:
    """The value of every stage of one analysis.

    Attributes
    ----------
    lags : tuple of Lag
        How late sensors come against the estimator, by the log; none where the policy takes the
        model's word.
    estimator : EstimatorHealth or None
        What the autopilot's own estimator noticed in the last flight; None where the method is not
        asked for, or the log tells nothing of it.
    setup : tuple of Check
        What the whole log shows of how the vehicle was set up, as ``fdi check`` tells it.
    stood_out : tuple of Fact
        What a person should know of the flight beside that, and accuses nobody.
    timings : mapping of str to float
        Wall seconds of every stage.
    """

    log: Log
    airframe: Airframe
    policy: Policy
    system: System
    bank: Bank
    signals: Signals
    lags: tuple[Lag, ...]
    residual_values: Residuals
    alarms: Alarms
    diagnosis: Diagnosis
    estimator: EstimatorHealth | None
    setup: tuple[Check, ...]
    stood_out: tuple[Fact, ...]
    warnings: tuple[str, ...]
    timings: Mapping[str, float]
    command: tuple[str, ...]
    version: str

    @property
    def findings(self) -> Rows[Finding]:
        """Return the accused components, causes before effects."""
        return Rows(self.diagnosis.findings)

    @property
    def consequences(self) -> Rows[Consequence]:
        """Return the components whose alarms follow from a finding."""
        return Rows(self.diagnosis.consequences)

    @property
    def ruled_out(self) -> Rows[RuledOut]:
        """Return the components that the data speak for."""
        return Rows(self.diagnosis.ruled_out)

    @property
    def open(self) -> Rows[Open]:
        """Return the components that are neither accused nor cleared, though tests ran."""
        return Rows(self.diagnosis.open)

    @property
    def not_testable(self) -> Rows[NotTestable]:
        """Return the components that this telemetry cannot show."""
        return Rows(self.diagnosis.not_testable)

    @property
    def verdict(self) -> str:
        """Return the answer in one sentence."""
        return self.diagnosis.verdict

    @property
    def fault_grid(self) -> pandas.DataFrame:
        """Return the marks of every fault over time; the index is t, a column is a fault."""
        return self.diagnosis.grid.frame()

    @property
    def isolability(self) -> pandas.DataFrame:
        """Return which fault is isolable from which, by the residual generators."""
        return self.diagnosis.implementable.frame()

    @property
    def residuals(self) -> pandas.DataFrame:
        """Return every residual over time, a column per generator."""
        return self.residual_values.frame()

    def document(self) -> dict[str, Any]:
        """Return what ``analysis.json`` holds, as plain values."""
        from fdi.report.analysis_document import analysis_document

        return analysis_document(self)

    def report(
        self, out: str | Path, formats: Sequence[str] | None = None, *, force: bool = False
    ) -> Path:
        """Write the report into a folder and return the folder.

        Parameters
        ----------
        out : str or Path
        formats : sequence of str, optional
            Of ``html, json, csv, png, svg, txt, parquet``; by default all.
        force : bool
            Write into a folder that is not ours; no file in it that is not ours is lost.

        Raises
        ------
        OutputError
            The folder cannot be written, or is not ours.
        """
        from fdi.report.folder import write_report

        return write_report(self, Path(out), formats, force)

    def plot(
        self,
        what: str = "grid",
        *,
        channels: Sequence[str] = (),
        test: str | None = None,
        finding: int = 1,
        width_mm: float = 85.0,
    ) -> Figure:
        """Return a figure for a printed page, by default as wide as one column.

        Parameters
        ----------
        what : str
            ``grid``, ``track``, ``channels``, ``residual``, ``isolability`` or ``evidence``.
        channels : sequence of str
            What ``channels`` shows, as ``MESSAGE.field``; by default those of the finding.
        test : str, optional
            What ``residual`` shows: the id of a test, its statement or a component; by default the
            test that tells most of the finding.
        finding : int
            Its rank, from 1; of ``channels``, ``residual`` and ``evidence``.
        width_mm : float
            mm; 85 is one column of a journal, 175 both.

        Returns
        -------
        matplotlib.figure.Figure
            Of no window: ``figure.savefig("grid.pdf")``, or shown by a notebook.

        Raises
        ------
        UsageError
            There is no such figure, channel, test or finding, or nothing to draw.
        """
        from fdi.report.paper import draw

        figure: Figure = draw(
            self, what, channels=channels, test=test, finding=finding, width_mm=width_mm
        )
        return figure

    def __repr__(self) -> str:
        return f"<Analysis of {clean(self.log.name)}: {clean(self.verdict)}>"

    def _repr_html_(self) -> str:
        return html_table(repr(self)[1:-1], ("", ""), ()) + self.findings._repr_html_()
