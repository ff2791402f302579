"""How does a bank run without this package? As one Python module that needs numpy alone.

In: a bank and how to differentiate. Out: the text of a module with ``SIGNATURES``, ``PARAMETERS``,
``CHANNELS`` and the function ``residuals(columns, rate_hz, state)``, which gives the same columns
as :meth:`Bank.evaluate`. Every node of the bank is one line, with its equation beside it. What the
lines call are the functions that evaluation calls here, by their own source.

Left out, and said so in ``NOT_EXPORTED``: generators with an algebraic loop, with a slope over a
window, with states that are integrated, with functions of somebody's own, and those that are held
against what earlier flights taught. Predicted spreads are not exported.
"""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Final

from fdi.model import evaluate
from fdi.model.expression import COMPARISONS, Apply, Expression, Number, Symbol, Text, symbols, walk
from fdi.model.given import Given
from fdi.model.system import ParameterValue, System, SystemEquation
from fdi.residuals import newton
from fdi.residuals.bank import Bank, Generator
from fdi.residuals.differentiate import RESOLVED, Differentiation, differentiate
from fdi.residuals.evaluate import SAME
from fdi.residuals.node import Node
from fdi.residuals.reads import needed_for

NAMED: Final = {
    "/": "_divide",
    "**": "_power",
    "log": "_log",
    "asin": "np.arcsin",
    "acos": "np.arccos",
    "atan": "np.arctan",
    "atan2": "np.arctan2",
    "wrap": "wrap",
    "and": "_all",
    "or": "_any",
    **{name: f"np.{name}" for name in ("sqrt", "sin", "cos", "tan", "exp", "abs", "sign")},
    **{
        sign: f"_compare(np.{kind})"
        for sign, kind in zip(
            COMPARISONS.values(),
            ("less", "less_equal", "greater", "greater_equal", "equal", "not_equal"),
            strict=True,
        )
    },
}
"""What computes an operator of the language: its arguments in brackets follow."""

_USED: Final = (
    evaluate.wrap,
    evaluate._divide,
    evaluate._power,
    evaluate._log,
    evaluate._compare,
    evaluate._truth,
    evaluate._all,
    evaluate._any,
    differentiate,
    newton.Solved,
    newton.choose,
)

HEAD: Final = '''"""Residual generators of {name}, exported from fdi {version}; needs numpy alone.

``residuals(columns, rate_hz)`` takes the channels in ``CHANNELS``, (n,) float each, sampled on one
grid in the units named there, NaN where unknown, and returns the residuals by their names, (n,),
NaN where an input is unknown or a condition does not hold. ``SIGNATURES`` says which faults each
is sensitive to, ``NOT_EXPORTED`` which generators are missing here, and why.
"""

from __future__ import annotations

from functools import reduce
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

TIED = {tied!r}
RESOLVED = {resolved!r}

'''

TAIL: Final = '''

def _known(value, size):
    value = np.where(np.isfinite(value), value, np.nan)
    return np.array(np.broadcast_to(value, size), dtype=np.float64)


def _where(value, condition):
    return np.where(_truth(condition) == 1.0, value, np.nan)


def _derivative(values, step, window, circular):
    half = max(1, round(window / (2 * step)))
    recipe = SimpleNamespace(method=METHOD, half_width=lambda step: {half})
    return differentiate(values, step, recipe, circular=circular)[0]


def _root(roots, sides, low, high, near, circular, turns):
    """Return the root that solves the equation, lies in the domain, is nearest to a channel."""
    kept = []
    for root, (left, right) in zip(roots, sides or [(0.0, 0.0)] * len(roots)):
        gap = wrap(left - right) if circular else left - right
        bad = np.abs(gap) > {same} * (np.abs(left) + np.abs(right))
        kept.append(np.where(bad | (root < low) | (root > high), np.nan, root))
    return choose(np.array(kept)[:, None, :], near[None], (turns,)).columns[0]


def _spacing(spacing, step, channels):
    return np.float64(max([step, *(spacing.get(name, step) for name in channels)]))

'''


def python_module(bank: Bank, differentiation: Differentiation | None = None) -> str:
    """Return the text of a module that computes the residuals of a bank.

    Parameters
    ----------
    bank : Bank
    differentiation : Differentiation, optional
        How derivatives are taken; by default as the default policy does.

    Examples
    --------
    ::

        Path("residuals.py").write_text(python_module(chain.bank, chain.residuals.recipe))
    """
    from fdi import __version__

    recipe = differentiation or Differentiation()
    refused = {g.id: why for g in bank.generators if (why := _refusal(bank, g))}
    exported = [g for g in bank.generators if g.id not in refused]
    needed = sorted({i for g in exported for i in needed_for(bank.nodes, g.node)})
    lines = _Lines(bank, recipe)
    body = [line for number in needed for line in lines.of(number)]
    signatures = dict(zip((g.id for g in bank.generators), bank.signature_names(), strict=True))
    half = "1" if recipe.method == "backward_from_zero" else "half"
    parts = [
        HEAD.format(
            name=bank.system.name, version=__version__, tied=newton.TIED, resolved=float(RESOLVED)
        ),
        f"METHOD = {recipe.method!r}\n",
        _table(
            "PARAMETERS", {n: f"np.float64({float(p.value)!r})" for n, p in _used(bank, needed)}
        ),
        _table("CHANNELS", {n: repr(unit) for n, unit in _channels(bank, needed).items()}),
        _table("SIGNATURES", {g.id: repr(signatures[g.id]) for g in exported}),
        _table("EQUATIONS", {g.id: repr(_names(bank, g)) for g in exported}),
        _table("NOT_EXPORTED", {name: repr(why) for name, why in refused.items()}),
        "\n",
        *("\n\n" + inspect.getsource(function) for function in _USED),
        TAIL.format(half=half, same=SAME),
        "\ndef residuals(columns, rate_hz, state=None, spacing=None):\n",
        '    """Return every residual; ``state``: the flight state by name, if it is read."""\n',
        "    P, step, states, spaces = PARAMETERS, 1.0 / rate_hz, state or {}, spacing or {}\n",
        "    columns = {name: np.asarray(columns[name], dtype=np.float64) for name in CHANNELS}\n",
        "    size = len(next(iter(columns.values()), ()))\n",
        "    missing = np.full(size, np.nan)\n",
        '    with np.errstate(all="ignore"):\n',
        *(f"        {line}\n" for line in body or ["pass"]),
        "    return {\n",
        *(f"        {g.id!r}: v{g.node},\n" for g in exported),
        "    }\n",
    ]
    return "".join(parts)


def _table(name: str, rows: Mapping[str, str]) -> str:
    inside = "".join(f"    {key!r}: {value},\n" for key, value in rows.items())
    return f"{name} = {{\n{inside}}}\n"


def _names(bank: Bank, generator: Generator) -> tuple[str, ...]:
    return tuple(bank.system.equations[i].name for i in generator.equations)


def _channels(bank: Bank, needed: list[int]) -> dict[str, str]:
    """Return the channels that nodes read, with the units of the variables that they show."""
    nodes = (bank.nodes[i] for i in needed if bank.nodes[i].kind == "channel")
    variables = bank.system.variables
    return {_channel(bank.system, node): variables[node.variables[0]].unit for node in nodes}


def _channel(system: System, node: Node) -> str:
    measurement = system.equations[node.equation].measurement
    assert measurement is not None
    return str(measurement.channel)


def _used(bank: Bank, needed: list[int]) -> list[tuple[str, ParameterValue]]:
    """Return the parameters that nodes read."""
    names: dict[str, None] = {}
    for i in needed:
        node = bank.nodes[i]
        own = bank.system.equations[node.equation]
        for e in (*node.expressions, node.gate, own.left, own.right):
            names.update(dict.fromkeys(symbols(e) if e else ()))
    return [(n, p) for n, p in bank.system.parameters.items() if n in names]


def _refusal(bank: Bank, generator: Generator) -> str:
    """Return why a generator cannot be exported, "" where it can."""
    nodes = [bank.nodes[i] for i in needed_for(bank.nodes, generator.node)]
    kinds = {node.kind for node in nodes}
    if "loop" in kinds:
        return "has an algebraic loop, which is solved numerically"
    if "observer" in kinds:
        return "integrates states, which are held by an observer"
    if bank.system.equations[generator.residual].taught:
        return "is held against what earlier flights taught"
    if "slope" in kinds:
        return "has a slope over a window"
    used = [e for node in nodes for e in (*node.expressions, node.gate) if e is not None]
    own = [n.operator for e in used for n in walk(e) if isinstance(n, Apply)]
    given = sorted({name for name in own if isinstance(name, Given)})
    return f"uses the function {given[0]}, which the export does not hold" if given else ""


class _Lines:
    """Writes nodes as lines of Python."""

    def __init__(self, bank: Bank, recipe: Differentiation) -> None:
        self.bank, self.recipe = bank, recipe
        self.system = bank.system

    def of(self, number: int) -> list[str]:
        """Return the lines that compute a node."""
        node = self.bank.nodes[number]
        equation = self.system.equations[node.equation]
        own = f"v{number}"
        lines = {
            "channel": self._measured,
            "derivative": self._derived,
            "solve": self._solved,
            "residual": self._solved,
        }[node.kind](own, node, equation)
        if node.gate is not None:
            names = {name: f"v{i}" for name, i in node.gate_arguments}
            read = symbols(node.gate)
            for name in read:
                names.setdefault(name, f"states[{name!r}]")
            if "step" in read:
                names["step"] = f"_spacing(spaces, step, {self._beneath(number)!r})"
            lines.append(f"{own} = _where({own}, {self.code(node.gate, names)})")
        lines[0] += f"  # {equation.name}: {equation.text}" if equation.text else ""
        return lines

    def _measured(self, own: str, node: Node, equation: SystemEquation) -> list[str]:
        return [f"{own} = columns[{_channel(self.system, node)!r}]"]

    def _derived(self, own: str, node: Node, equation: SystemEquation) -> list[str]:
        ((name, number),) = node.arguments
        window = max(self.recipe.window_s, equation.window)
        circular = self.system.variables[name].circular
        return [f"{own} = _derivative(v{number}, step, {window!r}, {circular})"]

    def _solved(self, own: str, node: Node, equation: SystemEquation) -> list[str]:
        names = {name: f"v{i}" for name, i in node.arguments}
        roots = [f"_known({self.code(e, names)}, size)" for e in node.expressions]
        circular = (
            equation.circular
            if node.kind == "residual"
            else self.system.variables[node.variables[0]].circular
        )
        # what was undone may have roots that solve nothing, or lie outside the domain
        sides_of = (equation.left, equation.right)
        undone = node.kind == "solve" and Symbol(node.variables[0]) not in sides_of
        is_checked = undone and not self._real
        if len(roots) == 1 and not is_checked:
            value = f"wrap({roots[0]})" if circular else roots[0]
            return [f"{own} = {value}"]
        variable = self.system.variables[node.variables[0]]
        lines = [f"roots = [{', '.join(roots)}]"]
        known = {*names, variable.name, *self.system.parameters}
        sides = "None"
        if is_checked and {*symbols(equation.left), *symbols(equation.right)} <= known:
            here = {**names, variable.name: "root"}
            left, right = (self.code(side, here) for side in sides_of)
            sides = f"[(_known({left}, size), _known({right}, size)) for root in roots]"
        ends = (variable.low, variable.high) if is_checked else (None, None)
        low = "-np.inf" if ends[0] is None else repr(float(ends[0]))
        high = "np.inf" if ends[1] is None else repr(float(ends[1]))
        near = next((f"v{i}" for name, i in node.near if name == variable.name), "missing")
        turns = f"{equation.circular}, {circular}"
        root = f"_root(roots, {sides}, {low}, {high}, {near}, {turns})"
        return [*lines, f"{own} = wrap({root})" if circular else f"{own} = {root}"]

    def _beneath(self, number: int) -> list[str]:
        needed = (self.bank.nodes[i] for i in needed_for(self.bank.nodes, number))
        return sorted({_channel(self.system, n) for n in needed if n.kind == "channel"})

    @property
    def _real(self) -> bool:
        return self.recipe.imaginary == "real_part"

    def code(self, expression: Expression, names: Mapping[str, str]) -> str:
        """Return an expression as Python; ``names``: what its symbols are called there."""
        match expression:
            case Number(value):
                return f"({value!r})" if value < 0 else repr(value)
            case Text(value):
                return repr(value)
            case Symbol(name):
                return f"P[{name!r}]" if name in self.system.parameters else names[name]
            case Apply(operator, arguments):
                return self._applied(operator, [self.code(a, names) for a in arguments])

    def _applied(self, operator: str, inner: list[str]) -> str:
        if operator in ("+", "*") or (operator == "-" and len(inner) == 2):
            return f"({f' {operator} '.join(inner)})"
        if operator == "-":
            return f"(-{inner[0]})"
        if operator in ("min", "max"):
            return f"reduce(np.{operator}imum, [{', '.join(inner)}])"
        if operator == "not":
            return f"(1.0 - _truth({inner[0]}))"
        if operator == "bit":
            return f"(np.floor({inner[0]} / 2.0 ** {inner[1]}) % 2)"
        if operator == "sqrt" and self._real:
            return f"np.sqrt(np.maximum({inner[0]}, 0.0))"
        return f"{NAMED[operator]}({', '.join(inner)})"
