"""Errors are for the person who can mend them: one line, a place, a next step, an exit code."""

import pytest

import fdi
from fdi import errors
from fdi.errors import FdiError, ModelError

KINDS = [
    kind
    for kind in vars(errors).values()
    if isinstance(kind, type) and kind.__module__ == "fdi.errors"
]


def test_message_says_where_what_and_what_to_do():
    error = FdiError("holds 3 of 16 bytes", where="a.ulg", hint="copy it again")
    assert str(error) == "a.ulg: holds 3 of 16 bytes (copy it again)"
    assert str(FdiError("is empty")) == "is empty"
    assert (error.message, error.where, error.hint) == (
        *("holds 3 of 16 bytes", "a.ulg", "copy it again"),
    )


def test_exit_codes_are_those_that_users_script_against():
    codes = {kind.__name__: kind.exit_code for kind in KINDS}
    assert {n: c for n, c in codes.items() if c != 70} == {
        "UsageError": 2,
        "LogError": 3,
        "ModelError": 4,
        "OutputError": 5,
    }


@pytest.mark.parametrize("kind", KINDS)
def test_every_error_of_ours_can_be_caught_as_one(kind):
    with pytest.raises(fdi.FdiError):
        raise kind("x")


def test_all_problems_of_a_file_are_one_error():
    error = ModelError.of(["m.yaml:3: a", "m.yaml:7: b", "m.yaml:9: c"])
    assert str(error) == "m.yaml:3: a (and 2 more)"
    assert error.problems == ("m.yaml:3: a", "m.yaml:7: b", "m.yaml:9: c")
    assert str(ModelError.of(["only"])) == "only"
    assert ModelError("is no map", where="m.yaml").problems == ("m.yaml: is no map",)


@pytest.mark.parametrize("name", fdi.__all__)
def test_public_names_are_there_and_listed(name):
    assert getattr(fdi, name).__name__ == name
    assert name in dir(fdi)


def test_a_name_that_is_not_public_is_told_as_python_does():
    with pytest.raises(AttributeError, match="module 'fdi' has no attribute 'analyse'"):
        _ = fdi.analyse
