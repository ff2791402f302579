"""What a file says once for every motor equals what it would say written out, mistakes included."""

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fdi.errors import ModelError
from fdi.model import load_airframe
from fdi.model.columns import MAX_ROWS
from fdi.model.repeat import repeated
from fdi.model.yaml import parse_document

SHORT = """format: 1
name: two_motors
for:
  i: [1, 2]
  o: [2, 1]    # the other one
components:
  "motor_{i}": {group: propulsion, affects: ["motor_{o}"]}
variables:
  u_{i}: {unit: "1"}
  d_{i}: {unit: "1", description: "{what} motor {i} gets more than {o}"}
  mean: {unit: "1"}
equations:
  k_0: {text: "mean = (u_1 + u_2)/2"}
  k_{i}: {text: "d_{i} = u_{i} - u_{o}", solves: ["d_{i}"], fault: "motor_{i}.weak"}
limits:
  motor_{i}_hard: {variable: "d_{i}", max: 0.3, component: "motor_{i}"}
inputs:
  SERVO_OUTPUT_RAW:
    fields:
      servo{i}_raw: {variable: "u_{i}", value: "servo{i}_raw/1000"}
"""


def written_out(text: str, rows: list[dict[str, str]]) -> str:
    """The slow, obvious way: every line with a column in its key, once for every row."""
    lines = []
    for line in text.splitlines():
        if re.match(r'\s*"?\w*\{', line):
            for row in rows:
                own = line
                for column, word in row.items():
                    own = own.replace(f"{{{column}}}", word)
                lines.append(own)
        else:
            lines.append(line)
    return "\n".join(lines)


def without_columns(text: str) -> str:
    return re.sub(r"^for:\n(  .*\n)+", "", text, flags=re.M)


@given(st.lists(st.tuples(st.integers(0, 999), st.sampled_from(["-x", "y", "7"])), min_size=1,
                max_size=6, unique_by=lambda row: row[0]))  # fmt: skip
def test_repeated_entries_equal_lines_written_out(cells):
    body = (
        'a: {b: 1}\nv:\n  x_{i}: {text: "{w} + {i}", l: ["{i}", {w: "{w}"}]}\n  y: 2\n  z{i}: 3\n'
    )
    numbers = ", ".join(str(number) for number, _ in cells)
    words = ", ".join(f'"{word}"' for _, word in cells)
    short = parse_document(f"for: {{i: [{numbers}], w: [{words}]}}\n{body}", "m")
    rows = [{"i": str(number), "w": word} for number, word in cells]
    full = parse_document(written_out(body.replace("{w:", "{q:"), rows).replace("{q:", "{w:"), "m")
    assert repeated(short).tree == full.tree
    assert list(repeated(short).tree["v"]) == list(full.tree["v"])


def test_a_model_of_repeated_entries_equals_the_one_written_out(tmp_path):
    text = SHORT.replace("{what} ", "")
    (tmp_path / "short.yaml").write_text(text)
    rows = [{"i": "1", "o": "2"}, {"i": "2", "o": "1"}]
    (tmp_path / "full.yaml").write_text(written_out(without_columns(text), rows))
    short, full = (load_airframe(tmp_path / f"{name}.yaml") for name in ("short", "full"))
    for name in set(short.__slots__) - {"sha256", "files"}:
        assert getattr(short, name) == getattr(full, name), name
    assert [e.name for e in short.equations][:3] == ["k_0", "k_1", "k_2"]
    assert [str(m.channel.field) for m in short.measurements] == ["servo1_raw", "servo2_raw"]


def told(text: str) -> list[str]:
    with pytest.raises(ModelError) as raised:
        repeated(parse_document(text, "m.yaml"))
    return list(raised.value.problems)


def test_a_mistake_in_a_repeated_entry_names_its_line_and_which_it_is(tmp_path):
    path = tmp_path / "m.yaml"
    path.write_text(SHORT.replace("u_{i} - u_{o}", "u_{i} - w_{o}").replace("{what} ", ""))
    with pytest.raises(ModelError) as raised:
        load_airframe(path)
    line = SHORT.splitlines().index(next(x for x in SHORT.splitlines() if "k_{i}" in x)) + 1
    assert list(raised.value.problems) == [
        f"m.yaml:{line}: equations.k_1: unknown symbol 'w_2'",
        f"m.yaml:{line}: equations.k_2: unknown symbol 'w_1'",
    ]


def test_a_column_that_is_not_there_is_told_with_its_line():
    assert told(SHORT)[0] == "m.yaml:10: variables.d_{i}.description: 'what' is no column of 'for'"


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("v:\n  x_{i}: 1\n", "m.yaml:2: v.x_{i}: 'i' is no column of 'for'"),
        (
            "for: [1]\n",
            "m.yaml:1: for: must be columns, such as {i: [1, 2, 3, 4]}, or a list of words",
        ),
        (
            "for: [i, o]\n",
            "m.yaml:1: for: no file that includes this one gives the column 'i', 'o'",
        ),
        ("v: {x: 'sum(u_{j} for j)'}\n", "m.yaml:1: v.x: 'for j': 'for' has no row"),
        ("v: {x: 'sum(u_{j} for j but 3)'}\n", "m.yaml:1: v.x: 'for j': 'for' has no row"),
        (
            "for: {i: [1]}\nv:\n  x_{i}: 'max(u_{j} for j but {i})'\n",
            "m.yaml:3: v.x_{i}: 'for j': 'for' has no row left",
        ),
        (
            "for: {i: [1, 2]}\nv:\n  x: 'sum(u_{i} for i)'\n",
            "m.yaml:3: v.x: 'for i': 'i' is a column, take another word",
        ),
        (
            "for: {i: [1, 2]}\nv:\n  x: 'sum(u_{j} for j but 3)'\n",
            "m.yaml:3: v.x: 'for j but': 'for' has no row '3'",
        ),
        (
            "for: {i: [1, 2]}\nv:\n  x: 'sum(u_{i}*v_{j} for j)'\n",
            "m.yaml:3: v.x: {i} stands for nothing: the entry's name lacks it",
        ),
        (
            "for:\n  i: [1, 2]\n  o: [2]\n",
            "m.yaml:1: for: columns must be equally long: i has 2, o has 1",
        ),
        ("for:\n  i: 4\n", f"m.yaml:2: for.i: must be a list of 1 to {MAX_ROWS} words or numbers"),
        (
            "for:\n  i: " + str(list(range(MAX_ROWS + 1))),
            f"m.yaml:2: for.i: must be a list of 1 to {MAX_ROWS} words or numbers",
        ),
        ("for:\n  i: [1, true]\n", "m.yaml:2: for.i: may hold words and whole numbers only"),
        ("for:\n  i-j: [1]\n", "m.yaml:2: for.i-j: is not a word"),
        (
            "for:\n  i: [1, " + "a" * 81 + "]\n",
            "m.yaml:2: for.i: has a word of more than 80 characters",
        ),
        ("for: {i: [1, 1]}\nv:\n  x_{i}: 1\n", "m.yaml:3: v.x_{i}: 'x_1' is there twice"),
        ("for: {i: [1, 2]}\nv:\n  x_1: 1\n  x_{i}: 1\n", "m.yaml:4: v.x_{i}: 'x_1' is there twice"),
        (
            'for: {i: [1]}\nv:\n  x: "u_{i}"\n',
            "m.yaml:3: v.x: {i} stands for nothing: the entry's name lacks it",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_repeated_is_told_with_its_line(text, problem):
    assert told(text) == [problem]


def test_a_key_within_a_repeated_entry_is_filled_by_the_row_of_the_entry():
    text = "for: {i: [1, 2], o: [2, 1]}\nv:\n  x_{i}:\n    y_{o}:\n      z_{i}: 1\n"
    assert repeated(parse_document(text, "m")).tree == {
        "v": {"x_1": {"y_2": {"z_1": 1}}, "x_2": {"y_1": {"z_2": 1}}}
    }


def test_without_columns_braces_are_letters():
    text = 'v: {x: "a {brace}", y: ["{}", "{i"]}'
    assert repeated(parse_document(text, "m")).tree == parse_document(text, "m").tree


def test_a_small_file_does_not_become_a_huge_one():
    words = ", ".join("w" * 78 + f"{n:02}" for n in range(MAX_ROWS))
    text = f"for: {{i: [{words}]}}\nv:\n" + "".join(
        f'  x{n}_{{i}}: "{"{i}" * 50}"\n' for n in range(100)
    )
    assert told(text) == ["m.yaml:10: repetition makes more than 1000000 characters"]


@pytest.mark.parametrize(
    ("short", "full"),
    [
        ("sum(a_{j}*b_{j} for j) - c", "(a_1*b_1 + a_2*b_2 + a_3*b_3) - c"),
        ("mean(a_{j} for j)", "((a_1 + a_2 + a_3)/3)"),
        ("min(abs(a_{j} - (b)) for j)", "min(abs(a_1 - (b)), abs(a_2 - (b)), abs(a_3 - (b)))"),
        ("x*max(a_{j} for j) > max(c, d)", "x*max(a_1, a_2, a_3) > max(c, d)"),
        ("sum(sum(a_{j}*a_{k} for j but 1) for k but 3)",
         "((a_2*a_1 + a_3*a_1) + (a_2*a_2 + a_3*a_2))"),
        ("sum(a_{j} for j) + max(a_{j} for j but 1 and 2)", "(a_1 + a_2 + a_3) + (a_3)"),
        ("the mean (of what is there for all)", "the mean (of what is there for all)"),
    ],
)  # fmt: skip
def test_a_call_over_all_rows_is_the_call_written_out(short, full):
    text = f"for: {{i: [1, 2, 3], w: [a, b, c]}}\nv: {{x: '{short}'}}\n"
    assert repeated(parse_document(text, "m")).tree["v"]["x"] == full


def test_in_a_repeated_entry_a_call_may_leave_out_its_own_row_and_others():
    text = "for: {i: [1, 2, 3], o: [3, 1, 2]}\nv:\n  x_{i}: 'sum(u_{j}/u_{i} for j but {i}, {o})'\n"
    assert repeated(parse_document(text, "m")).tree["v"] == {
        "x_1": "(u_2/u_1)",
        "x_2": "(u_3/u_2)",
        "x_3": "(u_1/u_3)",
    }


def test_calls_within_calls_do_not_make_a_small_file_a_huge_one():
    """Six of them over 32 rows are 10^9 terms."""
    names = "abcdef"
    product = "*".join(f"u_{{{name}}}" for name in names)
    short = "sum(" * len(names) + product + "".join(f" for {name})" for name in names)
    text = f"for: {{i: {list(range(MAX_ROWS))}}}\nv: {{x: '{short}'}}\n"
    assert told(text) == ["m.yaml:2: repetition makes more than 1000000 characters"]


PART = """format: 1
name: part
for: [i, o]
variables:
  u_{i}: {unit: "1"}
equations:
  k_{i}: {text: "u_{i} = u_{o} + mean(u_{j} for j)"}
"""
WHOLE = "format: 1\nname: whole\ninclude: [part.yaml]\nfor: {i: [1, 2], o: [2, 1], extra: [5, 6]}\n"


def written(folder, **files):
    for name, text in files.items():
        (folder / f"{name}.yaml").write_text(text)
    return folder / f"{next(iter(files))}.yaml"


def test_an_included_file_takes_the_columns_of_the_one_that_includes_it(tmp_path):
    short = load_airframe(written(tmp_path, whole=WHOLE, part=PART))
    full = PART.replace("for: [i, o]", "for: {i: [1, 2], o: [2, 1]}")
    other = load_airframe(written(tmp_path, other=full.replace("name: part", "name: whole")))
    assert short.equations == other.equations
    assert list(short.variables) == ["u_1", "u_2"]


def test_a_file_that_takes_columns_is_told_which_are_missing(tmp_path):
    path = written(tmp_path, whole=WHOLE.replace(", o: [2, 1]", ""), part=PART)
    with pytest.raises(ModelError) as raised:
        load_airframe(path)
    assert raised.value.problems[0] == (
        "part.yaml:3: for: no file that includes this one gives the column 'o'"
    )


def test_a_file_is_not_included_for_two_sets_of_rows(tmp_path):
    second = WHOLE.replace("name: whole", "name: second").replace("[1, 2]", "[3, 4]")
    first = WHOLE.replace("[part.yaml]", "[part.yaml, second.yaml]")
    with pytest.raises(ModelError) as raised:
        load_airframe(written(tmp_path, whole=first, part=PART, second=second))
    assert list(raised.value.problems) == ["part.yaml: is included twice, for other rows"]
