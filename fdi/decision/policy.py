"""How is an analysis carried out? A policy is a recipe in one file; every stage gets its part.

In: a shipped policy's name or a path. Out: a ``Policy``. The file is YAML, checked for shape by
pydantic; each part is the value that its stage takes (tests, sampling, differentiation, decision,
marking).
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from math import inf, isfinite
from numbers import Real
from pathlib import Path
from typing import Any, Final, Literal

from fdi import store
from fdi.decision.alarms import Alarms, Marking, Use
from fdi.decision.detectors import DETECTORS
from fdi.decision.recipes import Learned, PredictedSpread, Rank
from fdi.errors import ModelError, UsageError
from fdi.methods.table import methods_of
from fdi.model.codec import FOREIGN, decode, encode
from fdi.model.system import Estimate
from fdi.model.yaml import documents_in, read_document
from fdi.residuals import Differentiation, Residuals
from fdi.shown import Shown
from fdi.telemetry import Sampling

FOLDER = Path(__file__).parent / "policies"
KIND: Final = "policy"  # of an entry of the cache


@dataclass(frozen=True, slots=True)
class Calibration:
    """From which flights, by names, of which model and kind of vehicle tests were learned.

    ``parameters``: what these flights told of the model's parameters, by name.
    """

    model: str
    vehicle: str
    flights: tuple[str, ...]
    hours: float
    parameters: Mapping[str, Estimate] = field(default_factory=dict, hash=False)


@dataclass(frozen=True, slots=True)
class Policy(Shown):
    """A recipe.

    Attributes
    ----------
    tests : str
        Which test sets the bank implements.
    sampling, differentiation, decision
        The parts for the stages of these names.
    marking : str
        When a fault is marked in the grid.
    accuse : bool
        Whether components are accused at all.
    copies : str
        Whether a channel that repeats another one is a witness: ``dropped`` or ``kept``.
    latencies : str
        Whether sensors' latencies are ``estimated`` from the log or those that the model has
        ``stated``.
    accuracies : str
        Whether the accuracies ``reported`` by the log count, or only those that the model has
        ``stated``.
    commands : str
        Whether tests that read a recorded command as evidence are ``used`` or ``left_out``.
    integrate : bool
        Whether tests may integrate states; see `build_bank`.
    methods : tuple of str
        Whose columns are judged with the bank's residuals, by name (``fdi.methods.table``).
    calibration : Calibration, optional
        From what its tests were learned.
    """

    name: str
    sha256: str
    description: str
    tests: Literal["mtes", "mtes+cross_checks", "selected"]
    sampling: Sampling
    differentiation: Differentiation
    decision: PredictedSpread | Rank
    marking: Marking
    accuse: bool = True
    copies: Literal["dropped", "kept"] = "dropped"
    latencies: Literal["estimated", "stated"] = "estimated"
    accuracies: Literal["reported", "stated"] = "reported"
    commands: Literal["used", "left_out"] = "used"
    integrate: bool = False
    methods: tuple[str, ...] = ()
    calibration: Calibration | None = None

    def decide(self, residuals: Residuals) -> Alarms:
        """Return which residuals are beyond their threshold, and when."""
        _, decide = DETECTORS[self.decision.method]
        return decide(self.decision, residuals, self.use)

    @property
    def use(self) -> Use:
        """Return its word to the diagnosis."""
        own = self.decision
        told = (own.mean_s, own.sigmas) if isinstance(own, PredictedSpread) else (0.0, 0.0)
        return Use(self.marking, self.accuse, *told)

    def resample(
        self, *, window: tuple[float, float] | None = None, rate_hz: float | None = None
    ) -> Policy:
        """Return the policy with a window, s of the log's clock, and a rate where one is given.

        Raises
        ------
        UsageError
            The window is no two times in order, or the rate no number above zero.
        """
        sampling = self.sampling
        if window is not None:
            if len(window) != 2 or not all(map(_is_number, window)) or not window[0] <= window[1]:
                raise UsageError(f"the window {window!r} is no two times, s, in order")
            sampling = replace(sampling, window=window)
        if rate_hz is not None:
            _check_positive("rate", rate_hz)
            sampling = replace(sampling, rate_hz=rate_hz)
        return replace(self, sampling=sampling)

    def using(self, methods: Iterable[str] | None) -> Policy:
        """Return the policy with these methods, by name, where they are given.

        Raises
        ------
        UsageError
            There is no method of a name.
        """
        if methods is None:
            return self
        return replace(self, methods=tuple(method.name for method in methods_of(methods)))

    def within(self, budget_per_hour: float | None) -> Policy:
        """Return the policy with this budget, and no floor below it, where one is given.

        Raises
        ------
        UsageError
            The policy decides in a way that has no budget, or that is no number above zero.
        """
        if budget_per_hour is None:
            return self
        _check_positive("budget", budget_per_hour)
        if not isinstance(self.decision, PredictedSpread):
            raise UsageError(
                f"the policy {self.name} has no budget: its tests fire on a fixed share of samples",
                hint="leave out --budget",
            )
        decision = replace(self.decision, budget_per_hour=budget_per_hour, least_scale=0.0)
        return replace(self, decision=decision)

    @property
    def budget_per_hour(self) -> float | None:
        """Return how many false alarms by noise a flight hour may hold, None for unstated."""
        return getattr(self.decision, "budget_per_hour", None)


def _is_number(value: object) -> bool:
    return isinstance(value, Real) and isfinite(value)


def _check_positive(what: str, value: object) -> None:
    if not (isinstance(value, Real) and isfinite(value) and float(value) > 0):
        raise UsageError(f"the {what} {value!r} is no number above zero")


def shipped_policies() -> tuple[str, ...]:
    """Return the names of the shipped policies, sorted."""
    return tuple(path.stem for path in documents_in(FOLDER))


def load_policy(name: str | Path) -> Policy:
    """Return a shipped policy by its name, or the policy in a file.

    Raises
    ------
    ModelError
        There is no such policy, or the file is wrong.
    """
    if str(name) in shipped_policies():
        return _shipped(FOLDER / f"{name}.yaml")
    if not Path(name).exists():
        known = ", ".join(shipped_policies())
        raise ModelError("is neither a file nor a shipped policy", where=str(name), hint=known)
    return _parsed(Path(name))


def _shipped(path: Path) -> Policy:
    """Return a policy of ours, from the cache where it was read before: the parser loads slowly."""
    key = store.digest(KIND, path.read_bytes())
    with suppress(*FOREIGN):  # a foreign entry of the cache: read anew
        kept: Policy = decode(Policy, store.fetch(KIND, key))
        return kept
    policy = _parsed(path)
    store.keep(KIND, key, encode(policy))
    return policy


def _parsed(path: Path) -> Policy:
    """Return the policy in a file; ModelError where it is wrong."""
    document = read_document(path)
    from pydantic import TypeAdapter, ValidationError

    from fdi.decision.schema import PolicyFile

    try:
        spec = TypeAdapter(PolicyFile).validate_python(document.tree)
    except ValidationError as error:
        problems = []
        for item in error.errors(include_url=False):
            # pydantic names the chosen method as a step of the path; the file has no such key
            place = tuple(part for part in item["loc"] if part not in DETECTORS)
            name = ".".join(str(part) for part in place)
            problems.append(f"{document.name}:{document.line(place)}: {name}: {item['msg']}")
        raise ModelError.of(problems) from None
    return _policy(spec, hashlib.sha256(path.read_bytes()).hexdigest())


def _policy(spec: Any, digest: str) -> Policy:
    given = spec.calibration
    tree: dict[str, Any] = spec.model_dump(
        exclude={"format", "description", "calibration"}, exclude_unset=True
    )
    decision = tree.pop("decision")
    if given is not None:
        if decision["method"] != "predicted_spread":
            raise ModelError("only predicted_spread takes a calibration", where=spec.name)
        decision["learned"] = {
            key: Learned(one.scale, one.stray, one.centre or (-inf, inf))
            for key, one in given.tests.items()
        }
    recipe, _ = DETECTORS[decision["method"]]
    return Policy(
        sha256=digest,
        description=spec.description,
        sampling=Sampling(**tree.pop("sampling")),
        differentiation=Differentiation(**tree.pop("differentiation")),
        decision=recipe(**decision),
        methods=tuple(tree.pop("methods", ())),
        calibration=given and _calibration(given),
        **tree,
    )


def _calibration(given: Any) -> Calibration:
    parameters = {
        name: Estimate(one.value, one.std, one.flights) for name, one in given.parameters.items()
    }
    return Calibration(given.model, given.vehicle, tuple(given.flights), given.hours, parameters)


def _told(learned: Mapping[str, Any]) -> dict[str, Any]:
    """Return what differs from what an unknown test has."""
    told = {"scale": learned["scale"]} if learned["scale"] != 1.0 else {}
    if learned["stray"]:
        told["stray"] = learned["stray"]
    if isfinite(learned["centre"][0]):
        told["centre"] = list(learned["centre"])
    return told


def policy_text(policy: Policy) -> str:
    """Return a policy as the text of a file that `load_policy` reads."""
    from io import StringIO

    from ruamel.yaml import YAML

    tree: dict[str, Any] = {"format": 1, **asdict(policy), "methods": list(policy.methods)}
    del tree["sha256"], tree["sampling"]["window"]
    decision, calibration = tree["decision"], tree.pop("calibration")
    learned = decision.pop("learned", {})
    tree["decision"] = {"method": decision.pop("method"), **decision}
    if calibration is not None:
        tests = {key: told for key, one in learned.items() if (told := _told(one))}
        flights = list(calibration["flights"])
        tree["calibration"] = {**calibration, "flights": flights, "tests": tests}
    out = StringIO()
    writer = YAML(typ="safe", pure=True)
    writer.default_flow_style = None
    writer.sort_base_mapping_type_on_output = False
    writer.width = 1000
    writer.dump(tree, out)
    return out.getvalue()
