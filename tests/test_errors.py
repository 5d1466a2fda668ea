"""Errors keep their fields when pickled between processes; suggested commands can be pasted."""

import importlib
import inspect
import pickle
import pkgutil
from collections.abc import Iterator
from pathlib import PurePosixPath
from typing import Any

import pytest

from study_app.errors import Problem, StudyError, as_argument

PROBLEMS = Problem("blocks.b", "is unknown", 3, hint="did you mean c?"), Problem("x", "is missing")
GIVEN = {"int": -6, "tuple[Problem, ...]": PROBLEMS}


def kinds(base: type[StudyError]) -> Iterator[type[StudyError]]:
    yield base
    for kind in base.__subclasses__():
        yield from kinds(kind)


def example(kind: type[StudyError]) -> StudyError:
    """Return an error of a kind, with something for each of its arguments."""
    if kind.__init__ is Exception.__init__:
        return kind(f"what, value, hint of {kind.__name__}")
    arguments: dict[str, Any] = {
        name: GIVEN.get(str(parameter.annotation), f"the {name}")
        for name, parameter in inspect.signature(kind).parameters.items()
    }
    return kind(**arguments)


@pytest.mark.slow
def test_every_error_is_the_same_after_pickling() -> None:
    for module in pkgutil.walk_packages(["study_app"], "study_app."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    error_kinds = {kind for kind in kinds(StudyError) if kind.__module__.startswith("study_app.")}
    assert len(error_kinds) > 20
    for error in map(example, error_kinds):
        error.add_note("in case 3")
        again = pickle.loads(pickle.dumps(error))  # noqa: S301 - made here
        assert type(again) is type(error)
        assert (str(again), again.args, vars(again)) == (str(error), error.args, vars(error))
        assert again.__notes__ == ["in case 3"]


@pytest.mark.parametrize(
    ("path", "argument"),
    [
        ("data/sub-P003", "data/sub-P003"),
        ("study ä/data", '"study ä/data"'),
        ("C:\\Users\\Jo\\s_1.0", "C:\\Users\\Jo\\s_1.0"),
        ("a&b", '"a&b"'),
        ("größe", "größe"),
    ],
)
def test_a_suggested_command_quotes_a_path_that_a_shell_would_split(path: str, argument: str) -> None:
    assert as_argument(PurePosixPath(path)) == argument
