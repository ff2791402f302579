"""What does a diagnosis say? The values of the diagnose stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from fdi.methods.setup.values import Setting
from fdi.shown import Shown, html_table
from fdi.structure.decomposition import Decomposition
from fdi.telemetry.ends import FlightEnd
from fdi.units import hundredths
from fdi.windows import runs_of

if TYPE_CHECKING:
    import pandas

QUIET, MARKED, UNKNOWN = 0, 1, -1
MOST_LETTERS = 240

FindingKind = Literal["step", "ramp", "freeze", "loss", "noise", "scale", "limit", "unknown"]


When = Literal["now", "next flight"]


@dataclass(frozen=True, slots=True)
class Advice(Shown):
    """One thing to do about what is said of a flight.

    Attributes
    ----------
    do, why : str
        What to do, and how to tell what it shows.
    parameter : Setting or None
        The parameter that it is about.
    source, address : str
        The page that says so.
    when : str
        ``now``: inspect; ``next flight``: record.
    """

    do: str
    why: str
    parameter: Setting | None
    source: str
    address: str
    when: When = "now"


@dataclass(frozen=True, slots=True)
class Evidence(Shown):
    """What a person can check against a plot; ``telling`` is the residual that tells most."""

    text: str
    residuals: tuple[str, ...]
    channels: tuple[str, ...]
    telling: str = ""


@dataclass(frozen=True, slots=True)
class Size(Shown):
    """By how much channels of a sensor read too high (below zero: too low).

    Attributes
    ----------
    channels : tuple of str
        All are off alike.
    against : tuple of str
        Their twins, where nothing else tells which of the two is off.
    shape : str
        ``bias``, or ``drift``: then value and sigma are per second.
    value, sigma : float
        In ``unit``.
    since : float
        s; from when on.
    shown, shown_unit : float, str
        By how much that moves the residual that tells most, where its unit is another one.
    """

    channels: tuple[str, ...]
    against: tuple[str, ...]
    shape: Literal["bias", "drift"]
    value: float
    sigma: float
    unit: str
    since: float
    shown: float | None = None
    shown_unit: str = ""


@dataclass(frozen=True, slots=True)
class Term(Shown):
    """What one feature adds to the log odds of an accusation; below zero it speaks against it."""

    feature: str
    words: str
    weight: float


@dataclass(frozen=True, slots=True)
class Other(Shown):
    """What a flight shows of a component when another one is accused.

    Attributes
    ----------
    alarm : float or None
        When the first alarm about it began, s, of those that stood or began within 10 s.
    against : tuple of str
        What speaks against it, in words; facts of this flight, and seldom a proof.
    """

    component: str
    alarm: float | None
    against: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Finding(Shown):
    """An accused component of one flight; times are s of the log's clock.

    Attributes
    ----------
    onset, alarm, end : float
        When the cause began to show, when the data allowed the accusation, when it ceased (None if
        it lasted to the end of the flight or to an impact).
    confidence : float
        0..1, ends excluded: the probability that this component failed, against all others and
        nobody, by weights fitted to labelled flights (docs/evaluation.md).
    inseparable_from : tuple of str
        Components that explain the same alarms as well.
    because : tuple of Term
        What weighed most, the strongest first.
    rivals : tuple of (str, float)
        Everybody else who could have made these alarms, with the probability, 0..1.
    others : tuple of Other
        Everybody else of whom a test ran then, the rivals first.
    size : Size or None
        By how much a sensor is wrong, where the residuals are explained by it.
    earlier : tuple of (float, float)
        From when to when, s, it had shown before, and healed.
    advice : tuple of Advice
        What to do about it, in this order.
    """

    rank: int
    flight: int
    component: str
    faults: tuple[str, ...]
    kind: FindingKind
    onset: float
    alarm: float
    end: float | None
    confidence: float
    inseparable_from: tuple[str, ...]
    evidence: Evidence
    because: tuple[Term, ...]
    rivals: tuple[tuple[str, float], ...]
    others: tuple[Other, ...] = ()
    size: Size | None = None
    earlier: tuple[tuple[float, float], ...] = ()
    advice: tuple[Advice, ...] = ()

    def __repr__(self) -> str:
        sure = hundredths(self.confidence)
        return (
            f"<Finding {self.rank}: {self.component}, {self.kind}, from {self.onset:.1f} s of the "
            f"log, {sure} % sure>"
        )


@dataclass(frozen=True, slots=True)
class Consequence(Shown):
    """A component whose alarms follow from a finding."""

    component: str
    faults: tuple[str, ...]
    onset: float
    because_of: int
    text: str


How = Literal["changes", "rises", "falls", "frozen", "silent"]


@dataclass(frozen=True, slots=True)
class WouldShow(Shown):
    """The size of a lasting change from which on a fault would have shown.

    ``how``: ``changes`` (in either direction), ``rises``, ``falls``; ``frozen`` or ``silent`` for
    as long as ``size``.
    """

    fault: str
    size: float
    unit: str
    how: How = "changes"


@dataclass(frozen=True, slots=True)
class RuledOut(Shown):
    """A component that the data speak for: its tests could have seen a fault and stayed quiet.

    ``text`` is for a person: how large the faults are that would have shown.
    """

    component: str
    text: str
    residuals: tuple[str, ...]
    would_show: tuple[WouldShow, ...]


@dataclass(frozen=True, slots=True)
class Open(Shown):
    """A component that is neither accused nor cleared, and why."""

    component: str
    text: str


@dataclass(frozen=True, slots=True)
class Together(Shown):
    """Who could have made all alarms of a flight, where one is not the whole answer.

    Attributes
    ----------
    flight : int
    tests : int
        How many alarmed.
    diagnoses : tuple of tuple of str
        The minimal sets of one and of two components, fewest first, then those that hold most of
        the accused.
    """

    flight: int
    tests: int
    diagnoses: tuple[tuple[str, ...], ...]


FirstKind = Literal["event", "command", "trigger", "alarm"]


@dataclass(frozen=True, slots=True)
class First(Shown):
    """Something that happened in the last seconds before a flight went wrong.

    Attributes
    ----------
    at : float
        s of the log's clock.
    kind : str
        ``event`` (the autopilot reports), ``command`` (somebody or the autopilot asked for it),
        ``trigger`` (a test was beyond its threshold), ``alarm`` (and stayed there).
    text : str
        For a person.
    component : str or None
        Whom a trigger or alarm concerns first.
    """

    at: float
    kind: FirstKind
    text: str
    component: str | None = None


@dataclass(frozen=True, slots=True)
class Ending(Shown):
    """How a flight ended, and what was first where it ended badly, in the order of time."""

    end: FlightEnd
    first: tuple[First, ...] = ()
    advice: tuple[Advice, ...] = ()


Outlook = Literal["accused", "ended badly", "suspected", "alarms", "healthy", "untested"]
"""What a glance should tell: ``suspected`` where an accusation is less than probable; ``healthy``
only where the vehicle flew, nothing went wrong, no alarm was raised and what keeps it in the air
could be tested."""


@dataclass(frozen=True, slots=True)
class NotTestable(Shown):
    """A component that this telemetry cannot show, and why.

    ``wanted``: the telemetry that would show it, with the autopilot's setting, "" for none.
    """

    component: str
    text: str
    wanted: str = ""
    advice: tuple[Advice, ...] = ()


@dataclass(frozen=True, slots=True, eq=False)
class FaultGrid:
    """Marks of every modelled fault over time.

    Attributes
    ----------
    t : (n,) float
        s; a mark at t[k] holds to t[k+1].
    faults, components, groups : tuple of str
        Of each row.
    marks : (f, n) int8
        1 marked, 0 quiet, -1 unknown.
    """

    t: NDArray[np.float64]
    faults: tuple[str, ...]
    components: tuple[str, ...]
    groups: tuple[str, ...]
    marks: NDArray[np.int8]

    def frame(self) -> pandas.DataFrame:
        """Return the marks as a frame: index t, a column per fault; NaN where unknown."""
        import pandas as pd

        values = np.where(self.marks == UNKNOWN, np.nan, self.marks).T
        return pd.DataFrame(values, index=pd.Index(self.t, name="t"), columns=list(self.faults))

    def intervals(self, row: int, state: int) -> list[list[float]]:
        """Return the half-open intervals, s, in which a row is in a state."""
        return runs(self.t, self.marks[row] == state)

    def __repr__(self) -> str:
        marked = int((self.marks == MARKED).any(axis=1).sum())
        return f"<FaultGrid: {marked} of {len(self.faults)} faults marked, {len(self.t)} samples>"

    def _repr_html_(self) -> str:
        rows = [i for i in range(len(self.faults)) if (self.marks[i] == MARKED).any()]
        cells = [
            (
                self.faults[i],
                self.components[i],
                ", ".join(f"{low:.1f} to {high:.1f}" for low, high in self.intervals(i, MARKED)),
            )
            for i in rows
        ]
        return html_table(repr(self)[1:-1], ("fault", "component", "marked, s"), cells)


@dataclass(frozen=True, slots=True)
class Agreement(Shown):
    """What the columns of a method say of an accusation, or of a flight without one.

    Attributes
    ----------
    rank : int or None
        Of the finding; None where nobody is accused in the flight.
    agrees : bool
        Whether it points to the accused.
    """

    method: str
    flight: int
    rank: int | None
    agrees: bool
    text: str


@dataclass(frozen=True, slots=True, eq=False)
class Isolability:
    """Which faults can be seen and told apart.

    Attributes
    ----------
    faults : tuple of str
    detectable : (f,) bool
    matrix : (f, f) bool
        [i, j]: fault i is isolable from fault j.
    groups : tuple of tuple of str
        Connected groups of faults that cannot be told apart.
    """

    faults: tuple[str, ...]
    detectable: NDArray[np.bool_]
    matrix: NDArray[np.bool_]
    groups: tuple[tuple[str, ...], ...]

    def frame(self) -> pandas.DataFrame:
        """Return the matrix as a frame, 0 and 1."""
        import pandas as pd

        names = list(self.faults)
        return pd.DataFrame(self.matrix.astype(int), index=names, columns=names)

    def __repr__(self) -> str:
        return (
            f"<Isolability: {int(self.detectable.sum())} of {len(self.faults)} faults detectable, "
            f"{len(self.groups)} groups that cannot be told apart>"
        )

    def _repr_html_(self) -> str:
        cells = [(number, ", ".join(group)) for number, group in enumerate(self.groups, 1)]
        return html_table(repr(self)[1:-1], ("group", "faults"), cells)


@dataclass(frozen=True, slots=True, eq=False)
class Diagnosis:
    """The answer: causes, consequences, what is ruled out, what could not be tested.

    Attributes
    ----------
    verdict : str
        The answer in at most `MOST_LETTERS` letters.
    endings : tuple of Ending
        One for each flight.
    open : tuple of Open
        Who is neither accused nor cleared, though tests ran.
    together : tuple of Together
        Of flights where several are accused, or none explains all alarms alone.
    methods : tuple of Agreement
        What methods beside the model's tests say of the findings.
    implementable, structural : Isolability
        By the residual generators, and by structure alone.
    decomposition : Decomposition
        Of the whole system.
    """

    verdict: str
    outlook: Outlook
    endings: tuple[Ending, ...]
    findings: tuple[Finding, ...]
    consequences: tuple[Consequence, ...]
    ruled_out: tuple[RuledOut, ...]
    open: tuple[Open, ...]
    not_testable: tuple[NotTestable, ...]
    together: tuple[Together, ...]
    methods: tuple[Agreement, ...]
    grid: FaultGrid
    implementable: Isolability
    structural: Isolability
    decomposition: Decomposition
    graph_components: int

    def __repr__(self) -> str:
        return f"<Diagnosis: {self.verdict}>"

    def _repr_html_(self) -> str:
        told = {
            "accused": [one.component for one in self.findings],
            "what follows": [one.component for one in self.consequences],
            "ruled out": [one.component for one in self.ruled_out],
            "open": [one.component for one in self.open],
            "not testable": [one.component for one in self.not_testable],
        }
        cells = [(word, ", ".join(dict.fromkeys(some)) or "–") for word, some in told.items()]
        return html_table(repr(self)[1:-1], ("", "components"), cells)


def runs(t: NDArray[np.float64], mask: NDArray[np.bool_]) -> list[list[float]]:
    """Return half-open intervals, s, of the runs of a mask; the last sample holds one more step."""
    if not len(t):
        return []
    step = float(np.median(np.diff(t))) if len(t) > 1 else 1.0
    ends = np.append(t, t[-1] + step)
    return [[float(ends[a]), float(ends[b])] for a, b in runs_of(mask)]
