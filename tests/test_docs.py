"""What README and docs tell people to type works: commands, options, models, Python."""

import re
import shlex
from pathlib import Path

import click
import pytest

import fdi
from fdi import __version__, structure
from fdi.batch import batch
from fdi.cli.commands import fdi as group
from fdi.fleet import Job
from fdi.model import load_airframe
from fdi.model.repeat import repeated
from fdi.model.yaml import parse_document

pytestmark = pytest.mark.flights

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").glob("*.md"))]
CRASHES = ("copter_gps_loss_landing.tlog", "copter_motor_failure_crash.tlog")
NAMES = "|".join(group.commands)
COMMAND = re.compile(rf"(?:^|`|\s)(?:\.venv/bin/)?fdi ((?:{NAMES})\b[^`#\n]*)")


def calls():
    """Every call of a command on a page, and the example that its help ends with."""
    for name, command in group.commands.items():
        found = COMMAND.search(f" {command.epilog}")
        yield pytest.param(found[1], id=f"{name} --help")
    for page in PAGES:
        for line in page.read_text(encoding="utf-8").splitlines():
            for found in COMMAND.findall(line):
                yield pytest.param(
                    found.strip().rstrip(".,;:)"), id=f"{page.name}: {found.strip()}"
                )


def blocks(language):
    for page in PAGES:
        text = page.read_text(encoding="utf-8")
        for number, block in enumerate(re.findall(rf"```{language}\n(.*?)```", text, re.S), 1):
            yield pytest.param(block, id=f"{page.name}-{number}")


@pytest.mark.parametrize("call", list(calls()))
def test_options_on_a_page_are_those_of_the_command(call):
    name, *words = shlex.split(call, posix=True) if call.count("'") % 2 == 0 else call.split()
    command = group.commands[name]
    known = {option for p in command.params if isinstance(p, click.Option) for option in p.opts}
    asked = {word.partition("=")[0] for word in words if word.startswith("--")}
    assert asked <= known | {"--help"}


def test_the_readme_names_every_command():
    listed = re.findall(r"^fdi (\w+)", (ROOT / "README.md").read_text("utf-8"), re.M)
    assert set(listed) == set(group.commands)


# docs/airframe.md is one model in pieces, which tests/test_airframe_page.py puts together
@pytest.mark.parametrize("block", [b for b in blocks("yaml") if "airframe.md" not in b.id])
def test_models_on_a_page_are_models_or_parts_of_one(block, tmp_path):
    tree = repeated(parse_document(block, "page")).tree
    if "format" in tree:
        path = tmp_path / "page.yaml"
        path.write_text(block, encoding="utf-8")
        assert load_airframe(path).equations
    else:
        assert set(tree) <= {"components", "variables", "equations", "inputs", "measurements"}


def test_the_citation_names_this_version():
    cited = parse_document((ROOT / "CITATION.cff").read_text(encoding="utf-8"), "CITATION.cff")
    assert cited.tree["version"] == __version__


# the examples of docs/structure.md show their answers: tests/structure/test_docs.py
PROSE = [b for b in blocks("python") if not b.id.startswith(("structure.md", "README.md"))]


@pytest.mark.parametrize("block", PROSE)
def test_python_on_a_page_runs_where_its_files_are(block, monkeypatch, tmp_path):
    examples = ROOT / "examples"
    (tmp_path / "examples").symlink_to(examples)
    (tmp_path / "flight.tlog").symlink_to(examples / "healthy_logs" / "copter_gusts.tlog")
    monkeypatch.chdir(tmp_path)
    if "fleet.parquet" in block:  # what the command on that page writes
        batch([Job("flight.tlog")], Path("fleet.parquet"))
    copters = ["healthy_logs/copter_gusts.tlog", *(f"crash_logs/{name}" for name in CRASHES)]
    names = {"fdi": fdi, "paths": [examples / name for name in copters]}
    exec(compile(block, "page", "exec"), names)  # noqa: S102 - our own page
    assert set(names) - {"fdi", "paths", "__builtins__"}


def test_python_in_the_readme_runs(monkeypatch, tmp_path, capsys):
    (block,) = [b.values[0] for b in blocks("python") if b.id.startswith("README.md")]
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    exec(compile(block, "README.md", "exec"), {})  # noqa: S102 - our own page
    assert "motor" in capsys.readouterr().out
    assert (tmp_path / "crash.fdi" / "report.html").is_file()


def test_the_page_of_python_has_every_public_name():
    page = (ROOT / "docs" / "api.md").read_text(encoding="utf-8")
    described = set(re.findall(r"^\.\. auto\w+:: fdi\.(?:\w+\.)*(\w+)$", page, re.M))
    assert (
        set(fdi.__all__)
        | {n for n in structure.__all__ if callable(getattr(structure, n))}
        - {
            "Fault",  # three small values beside Model, which says what they are
            "bitset",
            "members",
            "submodel",
        }
        <= described
    )
