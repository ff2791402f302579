"""What does a model look like? The pictures of ``fdi structure MODEL --figure KIND``.

In: a study of a model, and a residual generator of it. Out: a matplotlib figure. The bipartite
graph and the matching are two columns, equations and unknowns, in the order of the decomposition;
with a matching what is matched stands side by side. The sequence is one generator's computation
from its channels down to its residual, with the equations in symbols. Names that are as long as a
page is wide are cut.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np

from fdi.errors import UsageError
from fdi.model.expression import Apply, Expression, Symbol, rebuild, to_text
from fdi.report.figures import isolability_figure
from fdi.report.model_document import ModelStudy
from fdi.report.style import FAINT, INK, label, new_figure, styled
from fdi.residuals.bank import Bank, Generator
from fdi.residuals.distinguish import Distinguishability
from fdi.residuals.node import Node
from fdi.residuals.reads import needed_for
from fdi.structure import Model, decompose, submodel
from fdi.structure.matching import match
from fdi.structure.plot import PARTS, plot_decomposition

LINE: Final = 0.21  # inches, a row of text of 8 points with room to read
LONGEST: Final = 110  # letters of an equation in a row
MOST_ROWS: Final = 400  # beyond, a picture is no longer one that is looked at
LOOKS: Final = {
    "channel": "#2b6cb0",
    "derivative": "#dd6b20",
    "part": "#7b4bb3",
    "residual": "#c53030",
}
LETTERS: Final = (
    ("alpha", "α"),
    ("beta", "β"),
    ("gamma", "γ"),
    ("delta", "δ"),
    ("theta", "θ"),
    ("lambda", "λ"),
    ("mu", "μ"),
    ("rho", "ρ"),
    ("sigma", "σ"),
    ("tau", "τ"),
    ("phi", "φ"),
    ("psi", "ψ"),
    ("omega", "ω"),
)
GREEK: Final = dict(LETTERS)
POWERS: Final = str.maketrans("0123456789.-", "⁰¹²³⁴⁵⁶⁷⁸⁹·⁻")


def model_figure(
    found: ModelStudy, kind: str, test: str | None = None, sizes: Distinguishability | None = None
) -> Any:
    """Return a picture of a model.

    Parameters
    ----------
    found : ModelStudy
    kind : str
        One of :data:`KINDS`.
    test : str, optional
        The id of a residual generator: what graph, matching and sequence are of; the sequence is
        of the first without it, the others of the whole model.
    sizes : Distinguishability, optional
        Of ``isolability``: in colours how large a fault must be to be told.

    Raises
    ------
    UsageError
        There is no such picture or generator, or the model is too large for it.
    """
    if kind not in KINDS:
        raise UsageError(f"no figure is called {kind!r}", hint=", ".join(KINDS))
    with styled():
        return KINDS[kind](found, _generator(found.bank, test), sizes)


def _generator(bank: Bank, test: str | None) -> Generator | None:
    if test is None:
        return None
    for own in bank.generators:
        if own.id == test:
            return own
    known = f"r1 to r{len(bank.generators)}" if bank.generators else "none"
    raise UsageError(f"there is no residual generator {test!r}", hint=f"there are {known}")


def _part(found: ModelStudy, own: Generator | None) -> Model:
    """Return the structure of a generator's equations, or of the whole model."""
    model = found.system.structure()
    if own is None:
        return model
    names = {found.system.equations[i].name for i in own.equations}
    return submodel(model, [e for e, name in enumerate(model.equations) if name in names])


def _decomposition(found: ModelStudy, own: Generator | None, _: Distinguishability | None) -> Any:
    return plot_decomposition(_part(found, own))


def _isolability(found: ModelStudy, _: Generator | None, sizes: Distinguishability | None) -> Any:
    if sizes is None:
        return isolability_figure(found.implementable, f"Isolability of {found.airframe.name}")
    return size_figure(sizes, f"Isolability of {found.airframe.name}")


def size_figure(sizes: Distinguishability, title: str) -> Any:
    """Return in colours how much larger a fault must be to be told from another than to be seen.

    A fault stands in a row with its smallest size; it is left out where that is not known. A cell
    is the factor for the fault of its column, grey where nothing tells the two apart.
    """
    from matplotlib.colors import LogNorm

    rows = np.flatnonzero(sizes.detected > 0)
    count = len(rows)
    told = sizes.told[np.ix_(rows, rows)]
    with np.errstate(divide="ignore"):
        factor = np.sqrt(sizes.detected[rows][:, None] / told)
    factor[~np.isfinite(factor)] = np.nan
    np.fill_diagonal(factor, np.nan)
    side = max(3.0, LINE * count)
    figure = new_figure(side + 5.0, side + 2.6)
    axes = figure.subplots()
    axes.set_facecolor("#cbd2d9")
    image = (
        axes.imshow(
            factor.clip(1.0, 10.0), cmap="viridis_r", norm=LogNorm(1.0, 10.0), aspect="equal"
        )
        if count
        else None
    )
    names = [label(sizes.names[i], 40) for i in rows]
    axes.set_xticks(range(count), names, rotation=90, fontsize=8)
    axes.set_yticks(range(count), names, fontsize=8)
    axes.tick_params(length=0)
    axes.set_title(f"{label(title, 60)}: {count} faults whose smallest size is known")
    if image is not None:
        bar = figure.colorbar(image, ax=axes, shrink=min(1.0, 3.0 / side), ticks=[1, 2, 5, 10])
        bar.ax.set_yticklabels(["1", "2", "5", "10 or more"])
        bar.ax.minorticks_off()
        bar.set_label("times the smallest size that is seen; grey: cannot be told")
    return figure


def _graph(found: ModelStudy, own: Generator | None, _: Distinguishability | None) -> Any:
    return _columns(_part(found, own), matched=False)


def _matching(found: ModelStudy, own: Generator | None, _: Distinguishability | None) -> Any:
    model = _part(found, own)
    solved: Mapping[str, str] = {}
    if own is not None:
        solved = {found.system.equations[e].name: name for e, name in own.steps}
    return _columns(model, matched=True, solved=solved)


def _columns(model: Model, *, matched: bool, solved: Mapping[str, str] | None = None) -> Any:
    """Return the bipartite graph as two columns; edges of the matching run straight across."""
    equation_of, _ = match(model.rows, len(model.unknowns))
    if solved:
        place = {name: e for e, name in enumerate(model.equations)}
        of = {unknown: place[name] for name, unknown in solved.items() if name in place}
        equation_of = [of.get(name, -1) for name in model.unknowns]
    parts = decompose(model)
    colour = {e: PARTS[n] for n in PARTS for e in getattr(parts, n).equations}
    pairs = [(e, u) for u, e in enumerate(equation_of) if e >= 0]
    order = {e: k for k, e in enumerate([*parts.under.equations, *parts.just.equations])}
    pairs.sort(key=lambda pair: (order.get(pair[0], len(order)), pair))
    alone = [e for e in range(len(model.rows)) if e not in {e for e, _ in pairs}]
    free = [u for u in range(len(model.unknowns)) if equation_of[u] < 0]
    left, right = [*(e for e, _ in pairs), *alone], [*(u for _, u in pairs), *free]
    count = max(len(left), len(right), 1)
    if count > MOST_ROWS:
        raise UsageError(
            f"{count} equations have no room in one picture", hint="name a generator with --test"
        )
    names = [label(model.equations[e], 40) for e in left]
    width = 3.2 + 0.075 * (max(map(len, names), default=0) + 20)
    figure = new_figure(width, LINE * count + 1.0)
    axes = figure.subplots()
    row_of, place_of = ({k: i for i, k in enumerate(own)} for own in (left, right))
    straight = set(pairs) if matched else set()
    for e in left:
        for u in model.rows[e]:
            bold = (e, u) in straight
            axes.plot(
                [0, 1],
                [row_of[e], place_of[u]],
                color=colour.get(e, FAINT) if bold or not matched else FAINT,
                linewidth=2.0 if bold else 0.6,
                alpha=1.0 if bold else 0.65,
                zorder=2 if bold else 1,
            )
    for e, name in zip(left, names, strict=True):
        tone = INK if not matched or e not in alone else LOOKS["residual"]
        axes.text(-0.03, row_of[e], name, ha="right", va="center", fontsize=8, color=tone)
    for u in right:
        axes.text(1.03, place_of[u], label(model.unknowns[u], 30), va="center", fontsize=8)
    axes.set_xlim(-0.9, 1.7)
    axes.set_ylim(count - 0.4, -0.6)
    axes.set_axis_off()
    extra = f"; left over (red) {len(alone)}" if matched else ""
    axes.set_title(f"{label(model.name, 40)}: {len(left)} equations, {len(right)} unknowns{extra}")
    return figure


def _sequence(found: ModelStudy, own: Generator | None, _: Distinguishability | None) -> Any:
    if own is None and not found.bank.generators:
        raise UsageError("the model has no residual generator")
    generator = own or found.bank.generators[0]
    bank = found.bank
    numbers = [i for i in needed_for(bank.nodes, generator.node) if bank.nodes[i].kind != "loop"]
    rows = {number: row for row, number in enumerate(numbers)}
    lines = [_step(bank, bank.nodes[i]) for i in numbers]
    widest = [max(len(line[k]) for line in lines) for k in range(3)]
    arcs = 0.35 + 0.12 * len(numbers) ** 0.5
    inch = [0.072 * w + 0.3 for w in widest]
    figure = new_figure(arcs + sum(inch) + 0.3, LINE * 1.35 * len(lines) + 1.0)
    axes = figure.subplots()
    starts = np.cumsum([arcs, *inch])
    for row, (line, number) in enumerate(zip(lines, numbers, strict=True)):
        tone = LOOKS.get(bank.nodes[number].kind, INK)
        for x, text in zip(starts, line, strict=False):
            axes.text(x, row, text, va="center", fontsize=8, color=tone)
        for read in _read(bank, number):
            _arc(axes, rows[read], row, arcs)
    axes.set_xlim(0, starts[-1])
    axes.set_ylim(len(lines) - 0.4, -0.6)
    axes.set_axis_off()
    faults = ", ".join(label(name, 30) for name in generator.faults[:4])
    more = f" and {len(generator.faults) - 4} more" if len(generator.faults) > 4 else ""
    axes.set_title(f"{generator.id} of {label(bank.system.name, 30)}: {faults}{more}", fontsize=9)
    return figure


def _read(bank: Bank, number: int) -> Sequence[int]:
    """Return the nodes that one is computed from, those of a loop in its place."""
    found: list[int] = []
    for read in bank.nodes[number].reads:
        found += bank.nodes[read].reads if bank.nodes[read].kind == "loop" else [read]
    return sorted(set(found))


def _arc(axes: Any, above: int, below: int, room: float) -> None:
    depth = min(0.1 + 0.06 * (below - above), room - 0.15)
    at = np.linspace(0, np.pi, 24)
    x = room - 0.08 - depth * np.sin(at)
    y = above + (below - above) * (1 - np.cos(at)) / 2
    axes.plot(x, y, color=FAINT, linewidth=0.8, zorder=1)
    axes.plot([x[-1]], [below], marker=">", markersize=3.5, color=FAINT)


def _step(bank: Bank, node: Node) -> tuple[str, str, str]:
    """Return what a node gives, how, and by which equation."""
    equation = bank.system.equations[node.equation]
    name = in_symbols(Symbol(node.variables[0])) if node.variables else "residual"
    if node.kind == "channel":
        assert equation.measurement is not None
        return name, f"= {equation.measurement.channel}", "measured"
    if node.kind == "part":
        return name, label(f"with {equation.text}", LONGEST), f"{equation.name}, in a loop"
    if node.kind in ("derivative", "slope"):
        inside = ", ".join(in_symbols(Symbol(argument)) for argument, _ in node.arguments)
        over = equation.right.operator if isinstance(equation.right, Apply) else node.kind
        how = f"= d/dt {inside}" if node.kind == "derivative" else f"= {over} of {inside}"
    elif node.kind == "observer":
        states = ", ".join(in_symbols(Symbol(own)) for own in node.variables[: node.states])
        name, how = "residual", f"= {in_symbols(node.expressions[-1])}, {states} integrated"
    else:
        how = "= " + " or ".join(in_symbols(own) for own in node.expressions)
    if node.gate is not None:
        how += f"   where {in_symbols(node.gate)}"
    return name, label(how, LONGEST), equation.name


def in_symbols(expression: Expression) -> str:
    """Return an expression as it is written by hand: Greek letters, powers, roots.

    Examples
    --------
    >>> from fdi.model.expression import parse
    >>> in_symbols(parse("0.5*rho*sqrt(v**2)"))
    '0.5·ρ·√(v²)'
    >>> in_symbols(parse("1/(a + b**2)**(-0.5)"))
    '1/(a + b²)⁻⁰·⁵'
    """

    def leaf(node: Expression) -> Expression:
        if isinstance(node, Symbol):
            stem, score, rest = node.name.partition("_")
            return Symbol(GREEK.get(stem, stem) + score + rest)
        return node

    text = to_text(rebuild(expression, leaf))
    text = re.sub(
        r"\*\*(?:\((-?[0-9.]+)\)|([0-9.]+))",
        lambda found: (found[1] or found[2]).translate(POWERS),
        text,
    )
    for plain, sign in (("sqrt(", "√("), ("*", "·"), (" >= ", " ≥ "), (" <= ", " ≤ ")):
        text = text.replace(plain, sign)
    return text


KINDS: Final[
    dict[str, Callable[[ModelStudy, Generator | None, Distinguishability | None], Any]]
] = {
    "graph": _graph,
    "dm": _decomposition,
    "isolability": _isolability,
    "matching": _matching,
    "sequence": _sequence,
}
