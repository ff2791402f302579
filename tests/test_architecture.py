"""The import rules of the house hold, and importing the package stays cheap."""

import re
import subprocess
import sys
from pathlib import Path

import pytest
from importlinter.cli import lint_imports

ROOT = Path(__file__).resolve().parents[1]


def modules_loaded_by(statement: str) -> set[str]:
    """Return the names in sys.modules after the statement ran in a fresh interpreter."""
    code = f"import sys\n{statement}\nprint('\\n'.join(sys.modules))"
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=600
    )
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


def test_imports_run_one_way(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The contracts of .importlinter: layers of rooms, pure graph theory, no circles."""
    monkeypatch.chdir(ROOT)
    monkeypatch.setattr(sys, "path", list(sys.path))  # the linter puts the folder in front
    status = lint_imports(config_filename=str(ROOT / ".importlinter"), no_cache=True, no_logo=True)
    assert status == 0, capsys.readouterr().out


@pytest.mark.parametrize(
    "heavy", ["scipy", "pandas", "sympy", "matplotlib", "pint", "pymavlink", "pyarrow"]
)
def test_import_fdi_does_not_load(heavy: str) -> None:
    """`import fdi` loads numpy at the most; everything else waits until it is needed."""
    assert heavy not in modules_loaded_by("import fdi")


def test_an_analysis_holds_nothing_of_what_tells_it() -> None:
    """Only `Analysis.document` and `Analysis.report` import the room above, when called."""
    assert not {name for name in modules_loaded_by("import fdi.result") if "fdi.report" in name}


@pytest.mark.parametrize("heavy", ["pandas", "sympy", "networkx", "matplotlib", "pymavlink"])
def test_import_structure_does_not_load(heavy: str) -> None:
    """Adapters and plots may use these, but only inside the functions that need them."""
    assert heavy not in modules_loaded_by("import fdi.structure")


@pytest.mark.parametrize(
    "room", sorted(ROOT.glob("fdi/**/__init__.py")), ids=lambda p: p.parent.name
)
def test_the_page_of_a_room_names_every_file_in_it(room: Path) -> None:
    """Whoever looks for something reads one docstring, not a folder."""
    page = room.read_text(encoding="utf-8")
    files = {path.name for path in room.parent.glob("*.py")} - {"__init__.py"}
    if room.parent != ROOT / "fdi":
        assert not {name for name in files if not re.search(rf"\b{name}\b", page)}
    named = set(re.findall(r"[a-z_]+\.py\b", page))
    assert named <= files
