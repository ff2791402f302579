"""Random expressions for the tests of the model language."""

from hypothesis import strategies as st

from fdi.model.expression import FUNCTIONS, OVER_TIME, Apply, Number, Symbol, Text, negative

NAMES = ("a", "b", "v_ground", "x1")
ONE_ARGUMENT = tuple(
    name for name, arity in FUNCTIONS.items() if arity == (1, 1) and name not in OVER_TIME
)
EXPONENTS = (-3.0, -2.0, -1.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0, 8.0)

numbers = st.one_of(
    st.integers(-9, 9).map(lambda i: Number(float(i))),
    st.floats(-1e6, 1e6, allow_nan=False).map(Number),
)
leaves = st.one_of(numbers, st.sampled_from(NAMES).map(Symbol))


def _divides(sides):
    return sides[1] != Number(0.0)


def quantities(leaf=leaves, functions=ONE_ARGUMENT, max_leaves=12, exponents=EXPONENTS):
    """Expressions that the parser can give, with the folding that it does."""

    def grow(inner):
        pair = st.tuples(inner, inner)
        options = [
            st.builds(Apply, st.sampled_from("+-*"), pair),
            st.builds(Apply, st.just("/"), pair.filter(_divides)),
            inner.map(negative),
            st.builds(
                lambda base, e: Apply("**", (base, Number(e))), inner, st.sampled_from(exponents)
            ),
            st.builds(
                Apply, st.sampled_from(["min", "max"]), st.lists(inner, min_size=2, max_size=4)
            ).map(lambda n: Apply(n.operator, tuple(n.arguments))),
        ]
        if functions:
            options.append(
                st.builds(lambda f, x: Apply(f, (x,)), st.sampled_from(list(functions)), inner)
            )
        if "atan" in functions:
            options.append(st.builds(Apply, st.just("atan2"), pair))
        return st.one_of(options)

    return st.recursive(leaf, grow, max_leaves=max_leaves)


def conditions():
    """Conditions that the parser can give."""
    compared = st.builds(
        lambda op, sides: Apply(op, sides),
        st.sampled_from(["<", "<=", ">", ">=", "==", "!="]),
        st.tuples(quantities(max_leaves=4), quantities(max_leaves=4)),
    )
    moded = st.builds(
        lambda op, word: Apply(op, (Symbol("mode"), Text(word))),
        st.sampled_from(["==", "!="]),
        st.sampled_from(["AUTO", "FBWA"]),
    )
    flag = st.just(Symbol("airborne"))

    def grow(inner):
        return st.one_of(
            st.builds(lambda terms: Apply("and", tuple(terms)), st.lists(inner, min_size=2)),
            st.builds(lambda terms: Apply("or", tuple(terms)), st.lists(inner, min_size=2)),
            inner.map(lambda c: Apply("not", (c,))),
        )

    return st.recursive(st.one_of(compared, moded, flag), grow, max_leaves=6)
