"""Which expression does a text of a model file stand for?

In: a text written by a stranger. Out: an ``Expression``, a tree of four kinds of nodes, or a
``ModelError`` whose message names what is not allowed. The text is parsed with ``ast`` and walked
with a whitelist: numbers, names, the operators and functions listed here, comparisons and quoted
words in conditions. There are no attributes, subscripts, keywords, lambdas or calls of calls, and
nothing is ever evaluated by Python itself; limits on length, depth and constant powers hold before
any arithmetic is done (``sympify`` runs code, and ``9**9**9**9`` hangs sympy beyond 5 s).

The trap for a maintainer: :func:`ast.parse` itself overflows on deeply nested text, so brackets and
chains of signs are counted on the characters first.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final

from fdi.errors import ModelError
from fdi.model.given import Given

MAX_CHARACTERS: Final = 2000
MAX_DEPTH: Final = 50
MAX_NODES: Final = 500
MAX_LEVELS: Final = 150
"""Of a tree: a sum of n terms has n. Every walk over a tree stays far from Python's own limit."""
MAX_CONSTANT_EXPONENT: Final = 8.0
MAX_NUMBER: Final = 1e300

ARITHMETIC: Final = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Pow: "**",
}
COMPARISONS: Final = {
    ast.Lt: "<",
    ast.LtE: "<=",
    ast.Gt: ">",
    ast.GtE: ">=",
    ast.Eq: "==",
    ast.NotEq: "!=",
}
FUNCTIONS: Final[Mapping[str, tuple[int, int]]] = {
    "sqrt": (1, 1),
    "sin": (1, 1),
    "cos": (1, 1),
    "tan": (1, 1),
    "asin": (1, 1),
    "acos": (1, 1),
    "atan": (1, 1),
    "atan2": (2, 2),
    "exp": (1, 1),
    "log": (1, 1),
    "abs": (1, 1),
    "sign": (1, 1),
    "wrap": (1, 1),
    "bit": (2, 2),
    "min": (2, 12),
    "max": (2, 12),
    "der": (1, 1),
    "slope": (2, 6),
    "jump": (4, 4),
    "still": (1, 1),
    "recent": (1, 1),
    "change": (2, 2),
    "integral": (2, 2),
    "span": (2, 2),
    "noise": (2, 2),
    "kept": (2, 2),
    "sampled": (2, 2),
}
"""Name of a function and how many arguments it takes, at least and at most."""
OVER_RECORDS: Final = frozenset(
    {"still", "recent", "change", "integral", "span", "noise", "kept", "sampled"}
)
"""Those whose value at a record depends on the records before: for measured fields only."""
NOISE: Final = "noise"
KEPT: Final = "kept"
"""The one that is known after the records that it was made of, too."""
SAMPLED: Final = "sampled"
"""The one that tells an accuracy: for what is reported."""
OVER_A_WHILE: Final = frozenset({"change", "integral", "span", NOISE, KEPT, SAMPLED})
"""Those of them that take a number of seconds: for ``FIELD:over`` only."""
REGRESSED: Final = frozenset({"slope", "jump"})
"""Those of pairs of columns over a window."""
OVER_TIME: Final = OVER_RECORDS | REGRESSED | {"der"}
"""Functions whose value at a moment depends on other moments."""

LOGICAL: Final = frozenset({"and", "or", "not"})
CONSTANTS: Final[Mapping[str, float]] = {"pi": 3.141592653589793}
NAME: Final = re.compile(r"[A-Za-z_][A-Za-z0-9_]*\Z")


@dataclass(frozen=True, slots=True)
class Number:
    """A constant."""

    value: float


@dataclass(frozen=True, slots=True)
class Symbol:
    """The name of a variable, parameter, message field or flight state."""

    name: str


@dataclass(frozen=True, slots=True)
class Text:
    """A quoted word, which only a comparison may hold: ``mode == "AUTO"``."""

    value: str


@dataclass(frozen=True, slots=True)
class Apply:
    """An operator or function applied to its arguments; a sign is ``Apply("-", (x,))``.

    It knows its ``names`` (see `symbols`): they are asked for thousands of times in an analysis.
    """

    operator: str
    arguments: tuple[Expression, ...]
    names: tuple[str, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        names = dict.fromkeys(name for one in self.arguments for name in symbols(one))
        object.__setattr__(self, "names", tuple(names))


Expression = Number | Symbol | Text | Apply


Own = Mapping[str, Given]
"""Functions that Python handed over, by their names (``given.py``)."""
NONE: Final[Own] = {}


def parse(text: str, *, condition: bool = False, functions: Own = NONE) -> Expression:
    """Return the expression that a text stands for.

    Parameters
    ----------
    text : str
        At most 2,000 characters.
    condition : bool
        Whether the text is a ``when``: then it must be a comparison or a logical combination of
        them, otherwise it must hold neither.
    functions : mapping of str to Given
        Further functions that the text may use.

    Raises
    ------
    ModelError
        The text is not an expression of the language; the message says why.

    Examples
    --------
    >>> to_text(parse("0.5*rho*v**2"))
    '0.5*rho*v**2'
    >>> parse("__import__('os')")
    Traceback (most recent call last):
    fdi.errors.ModelError: unknown function '__import__'
    """
    _check_size(text)
    try:
        tree = ast.parse(text.strip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        reason = error.msg if isinstance(error, SyntaxError) else str(error)
        raise ModelError(f"not an expression: {reason}") from None
    if sum(1 for _ in ast.walk(tree)) > 4 * MAX_NODES:
        raise ModelError(f"more than {MAX_NODES} terms")
    expression = _convert(tree.body, 0, functions)
    if isinstance(expression, Text):
        raise ModelError(f"the quoted word {expression.value[:40]!r} is not a number")
    if condition and isinstance(expression, Symbol):  # a flag of the flight state: `airborne`
        return expression
    if is_logical(expression) != condition:
        kind = "a condition (a comparison)" if condition else "a quantity, not a condition"
        raise ModelError(f"must be {kind}")
    return expression


def parse_equation(text: str, functions: Own = NONE) -> tuple[Expression, Expression]:
    """Return the two sides of an equation ``left = right``; ``functions`` as of :func:`parse`.

    Raises
    ------
    ModelError
        There is not exactly one equals sign, or a side is not an expression.
    """
    sides = re.split(r"(?<![<>=!])=(?!=)", text)
    if len(sides) != 2:
        raise ModelError(f"an equation has one equals sign, this has {len(sides) - 1}")
    return parse(sides[0], functions=functions), parse(sides[1], functions=functions)


def _check_size(text: str) -> None:
    if len(text) > MAX_CHARACTERS:
        raise ModelError(f"{len(text)} characters, at most {MAX_CHARACTERS} are allowed")
    if not text.strip():
        raise ModelError("is empty")
    depth = deepest = 0
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        deepest = max(deepest, depth)
    signs = max((len(run) for run in re.findall(r"(?:[-+~]\s*)+|(?:not\s+)+", text)), default=0)
    if deepest > MAX_DEPTH or signs > 2 * MAX_DEPTH:
        raise ModelError(f"nested deeper than {MAX_DEPTH}")
    if text.count("**") > MAX_DEPTH:
        raise ModelError(f"more than {MAX_DEPTH} powers")


def _convert(node: ast.expr, depth: int, own: Own) -> Expression:
    if depth > MAX_LEVELS:
        raise ModelError(f"more than {MAX_LEVELS} terms in a row")
    match node:
        case ast.Constant(value=bool()):
            raise ModelError(f"{node.value!r} is not a number")
        case ast.Constant(value=int() | float() as value):
            if abs(value) > MAX_NUMBER:
                raise ModelError("a number is too large")
            return Number(float(value))
        case ast.Constant(value=str() as word):
            return Text(word)
        case ast.Name(id=name):
            if not NAME.match(name):
                raise ModelError(f"{name!r} is not a name")
            return Number(CONSTANTS[name]) if name in CONSTANTS else Symbol(name)
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _quantity(_convert(operand, depth + 1, own))
        case ast.UnaryOp(op=ast.USub(), operand=operand):
            return negative(_quantity(_convert(operand, depth + 1, own)))
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return Apply("not", (_logical(_convert(operand, depth + 1, own)),))
        case ast.BinOp(left=left, op=op, right=right) if type(op) in ARITHMETIC:
            sides = (
                _quantity(_convert(left, depth + 1, own)),
                _quantity(_convert(right, depth + 1, own)),
            )
            return _arithmetic(ARITHMETIC[type(op)], *sides)
        case ast.BoolOp(op=op, values=values):
            terms = tuple(_logical(_convert(value, depth + 1, own)) for value in values)
            return Apply("and" if isinstance(op, ast.And) else "or", terms)
        case ast.Compare(left=left, ops=ops, comparators=comparators):
            return _comparison([left, *comparators], ops, depth, own)
        case ast.Call():
            return _call(node, depth, own)
        case ast.BinOp(op=ast.BitXor()):
            raise ModelError("'^' is no power: use '**'")
    raise ModelError(f"{type(node).__name__} is not allowed in an expression")


def _arithmetic(operator: str, left: Expression, right: Expression) -> Expression:
    if operator == "**":
        exponent = _constant(right)
        if exponent is None:
            raise ModelError("an exponent must be a number")
        if abs(exponent) > MAX_CONSTANT_EXPONENT:
            raise ModelError(f"an exponent of {exponent:g} is beyond {MAX_CONSTANT_EXPONENT:g}")
        return Apply("**", (left, Number(exponent)))
    if operator == "/" and right == Number(0.0):
        raise ModelError("division by zero")
    return Apply(operator, (left, right))


def _constant(expression: Expression) -> float | None:
    """Return the value of a number, a negative number or a fraction of two numbers."""
    match expression:
        case Number(value):
            return value
        case Apply("/", (Number(top), Number(bottom))) if bottom:
            return top / bottom
        case Apply("-", (Number(value),)):
            return -value
    return None


def _comparison(terms: list[ast.expr], ops: list[ast.cmpop], depth: int, own: Own) -> Expression:
    sides = [_convert(term, depth + 1, own) for term in terms]
    if any(is_logical(side) for side in sides):
        raise ModelError("a comparison of conditions is not allowed")
    parts: list[Expression] = []
    for left, op, right in zip(sides, ops, sides[1:], strict=False):
        if type(op) not in COMPARISONS:
            raise ModelError(f"{type(op).__name__} is not allowed in a condition")
        symbol = COMPARISONS[type(op)]
        if isinstance(left, Text) or (isinstance(right, Text) and symbol not in ("==", "!=")):
            raise ModelError("a quoted word stands on the right of == or != only")
        parts.append(Apply(symbol, (left, right)))
    return parts[0] if len(parts) == 1 else Apply("and", tuple(parts))


def _call(node: ast.Call, depth: int, own: Own) -> Expression:
    if not isinstance(node.func, ast.Name):
        raise ModelError("only a function by its name can be called")
    name = node.func.id
    if name in own:
        name = own[name]
        low = high = len(name.function.takes)
    elif name in FUNCTIONS:
        low, high = FUNCTIONS[name]
    else:
        raise ModelError(f"unknown function {name!r}")
    if node.keywords or not low <= len(node.args) <= high:
        count = f"{low}" if low == high else f"{low} to {high}"
        raise ModelError(f"{name} takes {count} arguments, not {len(node.args)}")
    arguments = tuple(_quantity(_convert(argument, depth + 1, own)) for argument in node.args)
    if name in OVER_RECORDS and not symbols(arguments[0]):
        raise ModelError(f"{name}(...) is of a field, not of {to_text(arguments[0])}")
    if name in OVER_A_WHILE:
        return Apply(name, (arguments[0], _seconds(name, arguments[1])))
    return Apply(name, arguments)


def _seconds(name: str, expression: Expression) -> Number:
    value = _constant(expression)
    if value is None or not value > 0:
        text = to_text(expression)
        raise ModelError(f"{name}(x, seconds) takes a positive number of seconds, not {text}")
    return Number(value)


def _quantity(expression: Expression) -> Expression:
    if is_logical(expression):
        raise ModelError("a condition cannot be used as a number")
    if isinstance(expression, Text):
        raise ModelError(f"the quoted word {expression.value!r} is not a number")
    return expression


def _logical(expression: Expression) -> Expression:
    # A bare name may stand for a flag of the flight state: `when: airborne`.
    if not is_logical(expression) and not isinstance(expression, Symbol):
        raise ModelError("'and', 'or' and 'not' combine conditions")
    return expression


def is_logical(expression: Expression) -> bool:
    """Return whether the expression is a comparison or a combination of comparisons."""
    return isinstance(expression, Apply) and (
        expression.operator in LOGICAL or expression.operator in COMPARISONS.values()
    )


def negative(expression: Expression) -> Expression:
    """Return the expression with its sign turned, numbers folded."""
    if isinstance(expression, Number):
        return Number(-expression.value)
    return Apply("-", (expression,))


def walk(expression: Expression) -> Iterator[Expression]:
    """Yield every node, the root first, without recursion."""
    stack = [expression]
    while stack:
        node = stack.pop()
        yield node
        if isinstance(node, Apply):
            stack.extend(reversed(node.arguments))


def symbols(expression: Expression) -> tuple[str, ...]:
    """Return the names in the expression, each once, in order of first appearance."""
    if isinstance(expression, Apply):
        return expression.names
    return (expression.name,) if isinstance(expression, Symbol) else ()


def count(expression: Expression, name: str) -> int:
    """Return how often a name occurs."""
    return sum(1 for node in walk(expression) if isinstance(node, Symbol) and node.name == name)


def differential(left: Expression, right: Expression) -> tuple[str, str] | None:
    """Return (derivative, state) for the two sides of ``y = der(x)``, else None."""
    match left, right:
        case Symbol(y), Apply("der", (Symbol(x),)):
            return y, x
    return None


def regressed(left: Expression, right: Expression) -> tuple[str, tuple[str, ...]] | None:
    """Return (y, the arguments) for ``y = slope(v, u, ...)`` or ``y = jump(...)``, else None."""
    match left, right:
        case Symbol(y), Apply(operator, arguments) if operator in REGRESSED:
            names = tuple(argument.name for argument in arguments if isinstance(argument, Symbol))
            return y, names
    return None


def substitute(expression: Expression, values: Mapping[str, Expression]) -> Expression:
    """Return the expression with names replaced."""

    def replace(node: Expression) -> Expression:
        return values.get(node.name, node) if isinstance(node, Symbol) else node

    return rebuild(expression, replace)


def rebuild(expression: Expression, leaf: Callable[[Expression], Expression]) -> Expression:
    """Return the expression with every leaf passed through a function."""
    if isinstance(expression, Apply):
        arguments = tuple(rebuild(argument, leaf) for argument in expression.arguments)
        return Apply(expression.operator, arguments)
    return leaf(expression)


PRECEDENCE: Final = {
    "or": 1, "and": 2, "not": 3,
    "<": 4, "<=": 4, ">": 4, ">=": 4, "==": 4, "!=": 4,
    "+": 5, "-": 5, "*": 6, "/": 6, "**": 8,
}  # fmt: skip


def to_text(expression: Expression) -> str:
    """Return the expression as text that :func:`parse` reads back to the same tree."""
    return _text(expression)[0]


def _text(expression: Expression) -> tuple[str, int]:
    match expression:
        case Number(value):
            text = repr(int(value)) if value == int(value) and abs(value) < 1e15 else repr(value)
            return text, 9 if value >= 0 else 7
        case Symbol(name):
            return name, 9
        case Text(value):
            return '"' + value + '"', 9
        case Apply(operator, (argument,)) if operator in ("-", "not"):
            level = 7 if operator == "-" else PRECEDENCE["not"]
            inner, inner_level = _text(argument)
            sign = "-" if operator == "-" else "not "
            return sign + (inner if inner_level > level else f"({inner})"), level
        case Apply(operator, arguments) if operator in PRECEDENCE:
            level = PRECEDENCE[operator]
            parts = []
            for place, argument in enumerate(arguments):
                part, part_level = _text(argument)
                # Left associative, and a power takes a bracket on its left.
                tight = part_level > level or (
                    place == 0 and part_level == level and operator in "+-*/"
                )
                parts.append(part if tight else f"({part})")
            glue = operator if operator in ("*", "/", "**") else f" {operator} "
            return glue.join(parts), level
        case Apply(operator, arguments):
            return f"{operator}({', '.join(to_text(a) for a in arguments)})", 9
