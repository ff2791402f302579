"""Which tests does a change touch? On a house of two rooms."""

from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_loader
from pathlib import Path

import pytest

TOOL = Path(__file__).parents[1] / "tools" / "near"
HOUSE = {
    "fdi/a/__init__.py": "from fdi.a.top import answer\nfrom fdi.a.other import guess",
    "fdi/a/low.py": "",
    "fdi/a/top.py": "from fdi.a.low import fact",
    "fdi/a/other.py": "",
    "fdi/a/table.json": "",
    "fdi/b/__init__.py": "",
    "fdi/b/lone.py": "",
    "tests/a/test_low.py": "from fdi.a.low import fact",
    "tests/a/test_answer.py": "from fdi.a import answer",
    "tests/a/test_guess.py": "from fdi.a import guess",
    "tests/b/test_uses.py": "from fdi.a import answer",
    "tests/b/test_names.py": "import fdi.a.low",
}


@pytest.fixture
def module():
    loader = SourceFileLoader("near", str(TOOL))
    found = module_from_spec(spec_from_loader("near", loader))
    loader.exec_module(found)
    return found


@pytest.fixture
def near(module, tmp_path, monkeypatch):
    for name, text in HOUSE.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    monkeypatch.setattr(module, "ROOT", tmp_path)
    tests = {
        path.relative_to(tmp_path): set(module.imported(path))
        for path in tmp_path.rglob("test_*.py")
    }
    return lambda name: {str(one) for one in module.tests_of(Path(name), tests)}


@pytest.mark.parametrize(
    ("changed", "touched"),
    [
        (
            "fdi/a/low.py",
            {"tests/a/test_low.py", "tests/a/test_answer.py", "tests/b/test_names.py"},
        ),
        ("fdi/a/top.py", {"tests/a/test_answer.py"}),
        ("fdi/a/other.py", {"tests/a/test_guess.py"}),
        ("fdi/b/lone.py", {"tests/b/test_uses.py", "tests/b/test_names.py"}),
        ("tests/a/test_guess.py", {"tests/a/test_guess.py"}),
        ("tests/a/conftest.py", {f"tests/a/test_{name}.py" for name in ("low", "answer", "guess")}),
        ("docs/index.md", {"tests/test_docs.py"}),
        ("CHANGELOG.md", set()),
    ],
)
def test_what_imports_it_is_touched_and_else_the_room(near, changed, touched):
    assert near(changed) == touched


def test_data_touches_all_of_its_room(near):
    assert near("fdi/a/table.json") == {
        "tests/a/test_low.py",
        "tests/a/test_answer.py",
        "tests/a/test_guess.py",
    }


def test_what_is_no_code_has_tests_where_it_is_said_to(module):
    """pytest ends with 5 where it finds none."""
    for name, place in module.OWN.items():
        own = module.ROOT / place
        assert (module.ROOT / name).is_dir()
        assert own.is_file() or list(own.rglob("test_*.py")), place
