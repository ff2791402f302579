"""Model files: what a good one gives, and that a bad one is told everything at once."""

import hashlib
import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from fdi import store
from fdi.errors import ModelError
from fdi.model import load_airframe, shipped_models
from fdi.model.choose import vehicles_of
from fdi.model.expression import parse
from fdi.model.load import find_model, models_folder
from fdi.model.yaml import read_document

TOLD = "value: 5, unit: m/s, source: brochure, log: {name: [VMAX, V_MAX], scale: 0.01}"
GOOD = """format: 1
name: cart
variables:
  v: {unit: m/s, domain: [0, null]}
  x: {unit: m}
parameters:
  v_max: {value: 5, unit: m/s, source: brochure, log: {name: [VMAX, V_MAX], scale: 0.01}}
equations:
  k_1: v = der(x)
  k_2: {text: "v = v_max", fault: stuck, component: wheel, when: "v > 1 and armed"}
limits:
  l_1: {variable: v, min: 0, max: v_max, component: wheel}
equalities:
  e_1: {text: "x = 0", tolerance: 50 cm}
measurements:
  VFR_HUD:
    component: estimator
    latency: 200 ms
    fields:
      groundspeed: {variable: v, accuracy: 36 km/h, offset: 0.1}
  32:
    when: x < 1000
    fields:
      x: {variable: x, value: "x*2 + v_max", when: "y > 0", group: navigation}
"""


def write(folder, text, name="m.yaml"):
    path = folder / name
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text, encoding="utf-8")
    return path


def problems(folder, text, name="m.yaml"):
    with pytest.raises(ModelError) as raised:
        load_airframe(write(folder, text, name))
    assert all("\n" not in problem for problem in raised.value.problems)
    return list(raised.value.problems)


def test_a_good_file_gives_an_airframe_in_the_units_of_its_variables(tmp_path):
    airframe = load_airframe(write(tmp_path, GOOD))
    assert [e.name for e in airframe.equations] == ["k_1", "k_2", "l_1", "e_1"]
    assert airframe.equations[1].fault == "stuck"
    assert airframe.equations[3].tolerance == pytest.approx(0.5)
    speed, place = airframe.measurements
    assert str(speed.channel) == "VFR_HUD.groundspeed"
    assert (speed.accuracy, speed.offset) == (pytest.approx(10.0), 0.1)
    assert speed.latency == pytest.approx(0.2)
    assert str(place.channel) == "LOCAL_POSITION_NED.x"
    assert place.when.operator == "and"
    assert place.group == "navigation"
    sources = airframe.parameters["v_max"].sources
    assert [(source.name, source.scale) for source in sources] == [("VMAX", 0.01), ("V_MAX", 0.01)]
    assert set(airframe.components) == {"wheel", "estimator", "outside_model"}


def test_a_kept_airframe_equals_the_one_that_was_assembled(tmp_path, monkeypatch):
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path / "cache"))
    path = write(tmp_path, GOOD)
    first, second = load_airframe(path), load_airframe(path)
    assert len(list((tmp_path / "cache").iterdir())) == 1
    for name in first.__slots__:
        assert getattr(first, name) == getattr(second, name), name


STRANGERS = {  # what is kept of GOOD, and what of it is spoiled
    "a left side": ('"v = v_max",["v"]', '"v = v_max",["nobody"]'),
    "a right side": ('["v"],["v_max"]', '["v"],["nobody"]'),
    "a condition": ('"armed",["and",2]', '"nobody",["and",2]'),
    "who is concerned": ('"stuck","wheel"', '"stuck","nobody"'),
    "what is measured": ('"v","estimator"', '"nobody","estimator"'),
    "who measures": ('"v","estimator"', '"v","nobody"'),
    "a variable": ('{"v":["v"', '{"v":["nobody"'),
    "a component": ('{"wheel":["wheel"', '{"wheel":["nobody"'),
}


@pytest.mark.parametrize("what", STRANGERS)
def test_what_is_kept_with_a_name_that_nothing_defines_is_read_anew(what, tmp_path, monkeypatch):
    monkeypatch.setenv("FDI_CACHE_DIR", str(tmp_path / "cache"))
    path, (own, spoiled) = write(tmp_path, GOOD), STRANGERS[what]
    whole = load_airframe(path)
    (entry,) = (tmp_path / "cache").iterdir()
    head, _, body = entry.read_text(encoding="utf-8").partition("\n")
    assert body.count(own) == 1
    store.keep(*head.split()[2:4], json.loads(body.replace(own, spoiled)))
    found = load_airframe(path)
    assert (found.equations, found.measurements) == (whole.equations, whole.measurements)
    assert (found.components, found.variables) == (whole.components, whole.variables)


@pytest.mark.parametrize("change", ["main", "included", "beside"])
def test_a_changed_file_is_read_anew(change, tmp_path):
    text = GOOD.replace("name: cart", "name: cart\ninclude: [parts/more.yaml]")
    more = "format: 1\nname: more\ncomponents:\n  wheel: {description: one}\n"
    path = write(tmp_path, text)
    included = write(tmp_path, more, "parts/more.yaml")
    before = load_airframe(path)
    assert before.components["wheel"].description == "one"
    if change == "main":
        write(tmp_path, text.replace("brochure", "measured"))
        assert load_airframe(path).parameters["v_max"].source == "measured"
    elif change == "included":
        write(tmp_path, more.replace(": one", ": two"), "parts/more.yaml")
        assert load_airframe(path).components["wheel"].description == "two"
    else:
        included.unlink()
        with pytest.raises(ModelError, match="is not found"):
            load_airframe(path)


BAD = {  # what to replace, by what, what is said, in which line
    "unknown symbol": ("v = der(x)", "v = 2*nothing", "unknown symbol 'nothing'", 9),
    "unit mismatch": ("v = der(x)", "v = x", r"unit mismatch: v \(m/s\) does not fit x \(m\)", 9),
    "derivative inside": ("v = der(x)", "v = 2*der(x)", "der.x. stands alone", 9),
    "two equals signs": ("v = der(x)", "v = x = 3", "one equals sign", 9),
    "code": ("v = der(x)", "v = __import__('os')", "unknown function '__import__'", 9),
    "tower": ("v = der(x)", "v = 9**9**9**9", "exponent", 9),
    "brackets": ("v = der(x)", "v = " + "(" * 10_000, "characters", 9),
    "fault twice": ("fault: stuck", "fault: VFR_HUD.groundspeed", "is brought twice, first at", 20),
    "unknown unit": ("unit: m/s, source", "unit: bananas, source", "'bananas' is not a unit", 7),
    "condition": ("v > 1 and armed", "v + 1", "must be a condition", 10),
    "unit in a condition": ("v > 1 and armed", "v > x", "does not fit", 10),
    "unknown name in a condition": ("v > 1 and armed", "mood == 1", "unknown symbol 'mood'", 10),
    "limit of nothing": ("variable: v, min", "variable: w, min", "unknown symbol 'w'", 12),
    "limit without bounds": ("min: 0, max: v_max, ", "", "neither a min nor a max", 12),
    "tolerance": ("50 cm", "50 s", "does not fit the unit", 14),
    "accuracy": ("36 km/h", "-1", "accuracy is -1, must be positive", 20),
    "accuracy in another unit": ("36 km/h", "3 K", "does not fit", 20),
    "no such field": ("groundspeed:", "groundspeeed:", "has no field groundspeeed", 20),
    "no such message": ("  32:\n", "  99999:\n", "no MAVLink message has the number", 24),
    "report of nothing": ("{variable: x, v", "{variable: x, reported: y, v", "needs an acc", 24),
    "unknown variable": ("{variable: x, value", "{variable: y, value", "unknown symbol 'y'", 24),
    "empty domain": ("[0, null]", "[2, 1]", "the domain .2, 1. is empty", 4),
    "reserved": ("  x: {unit: m}", "  x: {unit: m}\n  armed: {unit: m}", "meaning of its own", 6),
    "unused variable": ("  x: {unit: m}", "  x: {unit: m}\n  z: {unit: m}", "'z' is in no eq", 6),
    "nothing to identify": (TOLD, "unit: m/s", "neither a value nor anything", 7),
    "solves a stranger": ("fault: stuck", "solves: [x], fault: stuck", "solves x, which", 10),
    "swings without an angle": ("fault: stuck", "offset: 1, swings: 1 m, fault: s", "angle", 10),
    "duplicate key": ("  x: {unit: m}", "  x: {unit: m}\n  x: {unit: m}", "duplicate key 'x'", 6),
    "unknown key": ("source: brochure", "sauce: brochure", "sauce: unknown key", 7),
    "wrong type": ("value: 5", "value: much", "value: Input should be", 7),
    "wrong format": ("format: 1", "format: 2", "format: Input should be 1", 1),
    "no format": ("format: 1\n", "", "format: Field required", 1),
    "bad name": ("  v: {unit", "  v w: {unit", "should match pattern|unknown symbol", 4),
    "component with markup": ("component: wheel}", "component: '<b>'}", "should match pattern", 12),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_a_problem_is_reported_with_file_line_and_reason(name, tmp_path):
    old, new, message, line = BAD[name]
    assert old in GOOD
    import re

    found = problems(tmp_path, GOOD.replace(old, new, 1))
    hits = [problem for problem in found if re.search(message, problem)]
    assert hits, found
    assert hits[0].startswith(f"m.yaml:{line}: "), hits[0]


def test_all_problems_are_reported_together(tmp_path):
    text = GOOD
    for old, new in (
        ("v = der(x)", "v = nothing"),
        ("50 cm", "50 s"),
        ("36 km/h", "much"),
        ("unit: m/s, source", "unit: bananas, source"),
    ):
        text = text.replace(old, new, 1)
    found = problems(tmp_path, text)
    lines = sorted(int(problem.split(":")[1]) for problem in found)
    assert lines == [7, 9, 14, 20]  # a wrong unit is no problem of what uses the name


BASE = "format: 1\nname: b\nvariables:\n  y: {unit: m}\nequations:\n  k_9: y = 3\n"


def with_line(text, line):
    return text.replace("name: cart\n", f"name: cart\n{line}\n")


def test_what_a_field_states_goes_before_what_its_message_states(tmp_path):
    text = """format: 1
name: cart
components: {gps: {}, other: {}}
variables: {x: {unit: m}}
measurements:
  GPS:
    component: gps
    group: sensor
    latency: 200 ms
    when: "fix > 2"
    fields:
      a: {variable: x, accuracy: 2 m, jitter: 1 m}
      b: {variable: x, component: other, group: navigation, latency: 50 ms, when: "b > 1"}
  OTHER:
    fields:
      c: {variable: x}
"""
    shown = {str(m.channel): m for m in load_airframe(write(tmp_path, text)).measurements}
    a, b, c = shown["GPS.a"], shown["GPS.b"], shown["OTHER.c"]
    assert (a.component, a.group, a.latency) == ("gps", "sensor", 0.2)
    assert (b.component, b.group, b.latency) == ("other", "navigation", 0.05)
    assert (c.component, c.group, c.latency) == ("outside_model", "other", 0.0)
    assert (a.accuracy, a.jitter, b.accuracy) == (2.0, 1.0, None)
    assert (a.when, c.when) == (parse("fix > 2", condition=True), None)
    assert b.when == parse("fix > 2 and b > 1", condition=True)


@pytest.mark.parametrize(
    "stated", ["jitter: 3 m, accuracy: 2 m", "jitter: 0 m, accuracy: 2 m", "jitter: 1 m"]
)
def test_jitter_is_a_part_of_the_accuracy(stated, tmp_path):
    text = GOOD.replace("{variable: x, value:", "{variable: x, " + stated + ", value:")
    (told,) = problems(tmp_path, text)
    assert "must be positive and within the accuracy" in told


def test_a_second_definition_is_an_error_unless_the_file_extends_the_first(tmp_path):
    write(tmp_path, BASE, "b.yaml")
    again = GOOD.replace("  k_1:", "  k_9: y = 4\n  k_1:")
    found = problems(tmp_path, with_line(again, "include: [b.yaml]"))
    assert found == ["m.yaml:10: 'k_9' is defined twice, first at b.yaml:6"]
    airframe = load_airframe(write(tmp_path, with_line(again, "extends: b")))
    assert [e.text for e in airframe.equations if e.name == "k_9"] == ["y = 4"]


@pytest.mark.parametrize(
    ("section", "own", "told"),
    [
        (
            "equations",
            "equations:\n  k_1: y = 5",
            "n.yaml:5: 'k_1' takes the place of the one at b.yaml:9; "
            "if that is meant, say so: remove: {equations: [k_1]}",
        ),
        (
            "measurements",
            "measurements:\n  VFR_HUD: {fields: {alt: {variable: y}}}",
            "n.yaml:5: 'VFR_HUD' takes the place of the one at b.yaml:12; "
            "if that is meant, say so: remove: {measurements: [VFR_HUD]}",
        ),
        ("parameters", "parameters:\n  p: {unit: m, value: 2}", None),
        ("equations", "equations:\n  k_1: y = 3 + p", None),
    ],
)
def test_a_statement_that_takes_anothers_place_is_told_unless_that_is_removed(
    section, own, told, tmp_path
):
    base = WHOLE.replace("y = 3", "y = 3 + p") + "parameters:\n  p: {unit: m, value: 1}\n"
    write(tmp_path, base, "b.yaml")
    text = f"format: 1\nname: n\nextends: b\n{own}\n"
    for _ in "made", "recalled":
        airframe = load_airframe(write(tmp_path, text, "n.yaml"))
        assert airframe.warnings == ((told,) if told else ())
        assert airframe.observe(None).warnings[: len(airframe.warnings)] == airframe.warnings
    name = own.split()[1].rstrip(":")
    meant = text.replace("extends: b", f"extends: b\nremove: {{{section}: [{name}]}}")
    meant = load_airframe(write(tmp_path, meant, "n.yaml"))
    assert meant.warnings == ()
    assert names(meant) == names(airframe)


COMPONENT = "format: 1\nname: d\ncomponents:\n  wheel: {group: power}\n"


@pytest.mark.parametrize(
    ("group", "found"),
    [("power", []), ("airframe", ["m.yaml:5: 'wheel' is defined twice, first at d.yaml:4"])],
)
def test_a_component_may_be_defined_again_alike(tmp_path, group, found):
    write(tmp_path, COMPONENT, "d.yaml")
    own = f"include: [d.yaml]\ncomponents:\n  wheel: {{group: {group}}}"
    if found:
        assert problems(tmp_path, with_line(GOOD, own)) == found
    else:
        airframe = load_airframe(write(tmp_path, with_line(GOOD, own)))
        assert airframe.components["wheel"].group == group


def test_nothing_else_may_be_defined_again_alike(tmp_path):
    write(tmp_path, BASE, "b.yaml")
    again = GOOD.replace("  k_1:", "  k_9: y = 3\n  k_1:")
    found = problems(tmp_path, with_line(again, "include: [b.yaml]"))
    assert found == ["m.yaml:10: 'k_9' is defined twice, first at b.yaml:6"]


def test_extending_one_file_does_not_open_what_another_one_defined(tmp_path):
    write(tmp_path, BASE, "b.yaml")
    write(tmp_path, "format: 1\nname: c\nparameters:\n  c_1: {value: 1, unit: m}\n", "c.yaml")
    text = GOOD.replace("  v_max:", "  c_1: {value: 2, unit: m}\n  v_max:")
    found = problems(tmp_path, with_line(text, "include: [c.yaml]\nextends: b"))
    assert len(found) == 1
    assert "'c_1' is defined twice" in found[0]


def test_a_file_that_two_others_include_counts_once(tmp_path):
    write(tmp_path, BASE, "b.yaml")
    for name in "cd":
        write(tmp_path, f"format: 1\nname: {name}\ninclude: [b.yaml]\n", f"{name}.yaml")
    airframe = load_airframe(write(tmp_path, with_line(GOOD, "include: [c.yaml, d.yaml]")))
    assert "k_9" in {e.name for e in airframe.equations}


@pytest.mark.parametrize(
    ("target", "message"),
    [
        ("../secret.yaml", "lies outside the model's folder"),
        ("/etc/passwd", "lies outside the model's folder"),
        ("link.yaml", "lies outside the model's folder"),
        ("nothing.yaml", "is not found beside the file or among the models"),
        ("http://example.org/x.yaml", "is not found"),
        ("m.yaml", "includes itself"),
        ("circle.yaml", "includes itself"),
    ],
)
def test_what_a_file_may_include_is_bounded(target, message, tmp_path):
    write(tmp_path, "format: 1\nname: secret\n", "secret.yaml")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link.yaml").symlink_to(tmp_path / "secret.yaml")
    write(tmp_path, "format: 1\nname: circle\ninclude: [m.yaml]\n", "in/circle.yaml")
    found = problems(tmp_path / "in", with_line(GOOD, f"include: ['{target}']"))
    assert len(found) == 1
    assert message in found[0]
    assert found[0].startswith(("m.yaml:3: ", "circle.yaml:3: "))


def accuracy(airframe):
    (found,) = (m.accuracy for m in airframe.measurements if str(m.channel) == "GPS_RAW_INT.lat")
    return found


def copied(folder):
    """A copy of the shipped models in which one shared file has another accuracy."""
    mine = folder / "mine"
    shutil.copytree(models_folder(), mine)
    file = mine / "shared" / "position.yaml"
    text = file.read_text(encoding="utf-8")
    assert "variable: latitude, accuracy: 2e-7" in text
    file.write_text(text.replace("latitude, accuracy: 2e-7", "latitude, accuracy: 4e-7"))
    return mine


def test_an_edit_in_a_copied_folder_of_models_has_its_effect(tmp_path):
    """It was ignored: a shared file that includes another took the shipped one."""
    shipped, mine = load_airframe("quadcopter"), copied(tmp_path) / "quadcopter.yaml"
    edited = load_airframe(mine)
    assert accuracy(edited) == 2 * accuracy(shipped) == pytest.approx(4e-7)
    assert edited.sha256 != shipped.sha256
    again = mine.parent / "shared" / "position.yaml"
    again.write_text(again.read_text().replace("accuracy: 4e-7", "accuracy: 5e-7"))
    assert accuracy(load_airframe(mine)) == pytest.approx(5e-7)  # what was kept no longer holds


def test_every_file_that_was_read_is_told_with_its_checksum(tmp_path):
    mine = copied(tmp_path)
    (mine / "shared" / "health.yaml").unlink()
    files = {file.name: file for file in load_airframe(mine / "quadcopter.yaml").files}
    assert len(files) == len(load_airframe("quadcopter").files) > 5
    for name, file in files.items():
        folder = models_folder() if file.shipped else mine
        assert file.sha256 == hashlib.sha256((folder / name).read_bytes()).hexdigest()
    assert [name for name, file in files.items() if file.shipped] == ["shared/health.yaml"]


EXTENDING = "format: 1\nname: n\nextends: b\nremove: {remove}\nvariables:\n  y: {{unit: s}}\n"
WHOLE = """format: 1
name: b
components:
  wheel: {group: propulsion}
variables:
  y: {unit: m}
  z: {unit: m}
equations:
  k_1: y = 3
  k_2: z = 4
measurements:
  VFR_HUD:
    fields:
      alt: {variable: z}
      climb: {variable: y, raw: true}
  RANGEFINDER:
    fields:
      distance: {variable: z}
"""


def names(airframe):
    return {e.name for e in airframe.equations} | {str(m.channel) for m in airframe.measurements}


@pytest.mark.parametrize(
    ("remove", "gone"),
    [
        ("{equations: [k_2]}", {"k_2"}),
        ("{equations: [k_2], measurements: [RANGEFINDER]}", {"k_2", "RANGEFINDER.distance"}),
        ("{measurements: [VFR_HUD.alt]}", {"VFR_HUD.alt"}),
        ("{components: [wheel]}", set()),
        (
            "{variables: [z], equations: [k_2], measurements: [VFR_HUD.alt, RANGEFINDER]}",
            {"k_2", "VFR_HUD.alt", "RANGEFINDER.distance"},
        ),
    ],
)
def test_a_model_that_extends_another_may_remove_what_that_defines(remove, gone, tmp_path):
    whole = load_airframe(write(tmp_path, WHOLE, "b.yaml"))
    text = EXTENDING.format(remove=remove).partition("variables:\n  y")[0]
    airframe = load_airframe(write(tmp_path, text, "n.yaml"))
    assert names(airframe) == names(whole) - gone
    assert ("wheel" in airframe.components) == ("wheel" not in remove)
    assert ("z" in airframe.variables) == ("z" not in remove)


@pytest.mark.parametrize(
    ("remove", "message"),
    [
        ("{equations: [k_1, k_9]}", "n.yaml:4: remove: no 'k_9' in equations: 'b' has none"),
        ("{measurements: [VFR_HUD.speed]}", "no 'VFR_HUD.speed' in measurements"),
        ("{inputs: [RANGEFINDER]}", "no 'RANGEFINDER' in inputs"),
        ("{equatoins: [k_1]}", "nothing to remove from; there are components, variables"),
    ],
)
def test_removing_what_is_not_there_is_told_with_its_line(remove, message, tmp_path):
    write(tmp_path, WHOLE, "b.yaml")
    found = problems(tmp_path, EXTENDING.format(remove=remove), "n.yaml")
    assert any(message in problem for problem in found)
    assert all(problem.startswith("n.yaml:") for problem in found[:1])


def test_removing_needs_a_model_that_is_extended(tmp_path):
    write(tmp_path, WHOLE, "b.yaml")
    text = with_line(GOOD, "include: [b.yaml]\nremove: {equations: [k_2]}")
    assert any("no 'k_2' in equations: nothing is extended" in p for p in problems(tmp_path, text))


@pytest.mark.parametrize("kind", ["component", "message", "field"])
def test_an_unknown_group_is_told_what_there_is(kind, tmp_path):
    changes = {
        "component": ("parameters:", "components:\n  wheel: {group: sensors}\nparameters:"),
        "message": ("    latency: 200 ms", "    group: sensors"),
        "field": ("group: navigation", "group: sensors"),
    }
    (found,) = problems(tmp_path, GOOD.replace(*changes[kind]))
    assert "no group 'sensors'; there are sensor, navigation" in found


def test_a_channel_has_one_accuracy_however_many_variables_it_shows(tmp_path):
    """An airspeed was known to 0.3 m/s as an input and to 1 m/s as a measurement."""
    variables = GOOD.replace("parameters:", "  w: {unit: m/s}\nparameters:")
    inputs = "inputs:\n  VFR_HUD:\n    latency: 0.2 s\n    fields:\n      groundspeed: "
    wrong = variables + inputs + "{variable: w, accuracy: 1 m/s}\n"
    (found,) = problems(tmp_path, wrong)
    assert "VFR_HUD.groundspeed has another accuracy at m.yaml:" in found
    load_airframe(write(tmp_path, wrong.replace("accuracy: 1 m/s", "accuracy: 10 m/s")))


def test_a_problem_in_an_included_file_names_that_file(tmp_path):
    write(tmp_path, BASE.replace("y = 3", "y = sin(y)"), "b.yaml")
    assert problems(tmp_path, with_line(GOOD, "include: [b.yaml]"))[0].startswith("b.yaml:6: ")


def test_a_chain_of_very_many_files_is_refused(tmp_path):
    for i in range(60):
        write(tmp_path, f"format: 1\nname: f\ninclude: [f{i + 1}.yaml]\n", f"f{i}.yaml")
    with pytest.raises(ModelError, match="includes more than 50 files"):
        load_airframe(tmp_path / "f0.yaml")


@pytest.mark.parametrize("name", ["no_such_model", "no/such/file.yaml"])
def test_a_name_that_is_no_model_is_told_what_there_is(name):
    with pytest.raises(ModelError, match="neither a file nor a shipped model"):
        load_airframe(name)


@pytest.mark.parametrize("name", shipped_models())
def test_type_of_vehicle_is_found_without_parsing_a_shipped_model(name):
    path = find_model(name)
    assert list(vehicles_of(path)) == read_document(path).tree.get("vehicles", [])


def test_a_warm_load_needs_neither_parser_nor_checker(tmp_path):
    path = write(tmp_path, GOOD)
    code = (
        f"import sys; from fdi.model import load_airframe; load_airframe({str(path)!r}).observe();"
        "heavy = ('ruamel.yaml', 'pydantic', 'pint', 'sympy', 'pymavlink');"
        "print([name for name in heavy if name in sys.modules])"
    )
    root = Path(__file__).parents[2]
    for _ in range(2):
        done = subprocess.run(
            [sys.executable, "-c", code], cwd=root, capture_output=True, text=True, timeout=600
        )
    assert done.stdout.strip() == "[]", done.stderr


def test_an_unknown_key_is_told_with_the_known_ones_and_hides_nothing(tmp_path):
    path = tmp_path / "slip.yaml"
    path.write_text(
        "format: 1\nname: slip\ncomponents:\n  gps: {group: sensor}\nvariables:\n  v: {unit: m/s}\n"
        '  h: {unit: m}\nequations:\n  e_1: {text: "v = h", tolerence: 3}\nmeasurements:\n'
        "  GPS_RAW_INT: {component: gps, fields: {vel: {variable: v, transform: 2}, "
        "alt: {variable: h}}}\n",
        encoding="utf-8",
    )
    with pytest.raises(ModelError) as told:
        load_airframe(path)
    slip, transform, units = told.value.problems
    assert "e_1.tolerence: unknown key, did you mean 'tolerance'?; known are" in slip
    assert "vel.transform: unknown key; known are accuracy," in transform
    assert "v (m/s) does not fit h (m)" in units
