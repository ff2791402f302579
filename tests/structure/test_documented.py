"""Every public function and class of the room has an example that runs and names its source."""

import importlib
import inspect
import pkgutil

import pytest

import fdi.structure

MODULES = [
    importlib.import_module(f"fdi.structure.{found.name}")
    for found in pkgutil.iter_modules(fdi.structure.__path__)
]


def public():
    for module in MODULES:
        for name, value in sorted(vars(module).items()):
            own = getattr(value, "__module__", None) == module.__name__
            if (
                own
                and not name.startswith("_")
                and (inspect.isroutine(value) or inspect.isclass(value))
            ):
                yield pytest.param(value, id=f"{module.__name__.rpartition('.')[2]}.{name}")


@pytest.mark.parametrize("value", list(public()))
def test_it_has_an_example_and_a_reference(value):
    text = inspect.getdoc(value) or ""
    assert ">>>" in text, "no doctest"
    assert "References\n----------\n" in text, "no reference"
    assert "README" not in text, "a reference that a reader cannot look up"
    if inspect.isroutine(value):
        parameters = inspect.signature(value).parameters
        for name in parameters:
            assert name in text, f"parameter {name} is not described"


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_every_file_says_which_question_it_answers(module):
    first = (module.__doc__ or "").partition("\n")[0]
    assert first.endswith((".", "?"))


def test_public_names_of_the_room_are_those_of_its_files():
    for name in fdi.structure.__all__:
        value = getattr(fdi.structure, name)
        assert value.__module__.startswith("fdi.structure.")
