"""Docstrings of the public interface: accepted by numpydoc, and with examples that run."""

import doctest
import importlib
import inspect
import pkgutil
import re
import tempfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from numpydoc.docscrape import get_doc_object
from numpydoc.validate import validate

from tests.compiled import needs_servo

PACKAGES = ("haptics", "protocol", "psychophysics", "session", "store", "analysis.statistics")
NOT_ASKED = {
    "ES01": "an extended summary",
    "EX01": "an example everywhere",
    "GL08": "a docstring for members of a typing.Protocol; ruff asks for all others",
    "RT01": "a Returns section, where the first line says what is returned",
    "SA01": "a See Also section",
    "YD01": "a Yields section, where the first line says what is yielded",
}
TYPE = re.compile(
    r"""(\([\w, ]+\)\ )(or\ \([\w, ]+\)\ )?arrays?\b      # (participants, settings) array
    | array\b | (bool|bytes|callable|datetime|float|int|str)\b
    | (iterable|mapping|sequence|tuple)\b(\ of\ \w+)?   # with what it holds
    | "[\w-]+"(\ \|\ "[\w-]+")*                        # one of these words
    | ([a-z]\w*\.)?[A-Z]\w+                            # a class
    """,
    re.VERBOSE,
)
ERROR = re.compile(r"([a-z]\w*\.)?[A-Z]\w+(, ([a-z]\w*\.)?[A-Z]\w+)*")
EXAMPLES = (
    "study_app.protocol.load.load",
    "study_app.haptics.runtime.offline.simulate",
    "study_app.analysis.data.study_tables.load_study",
    "study_app.analysis.evaluate.evaluate",
    "study_app.session.replay.replay",
)


pytestmark = pytest.mark.slow


def modules(package: str) -> Iterator[ModuleType]:
    """Return the public modules of a package and of those below it."""
    top = importlib.import_module(package)
    yield top
    for module in pkgutil.walk_packages(top.__path__, package + "."):
        if not any(part.startswith("_") for part in module.name.split(".")):
            yield importlib.import_module(module.name)


def is_public(name: str, value: Any) -> bool:
    if name.startswith("_"):
        return False  # not looked at: a validator that is not built yet would be built here, in its model's dictionary
    if isinstance(value, property) and value.fget.__name__ == "<lambda>":
        return False  # a value of a kind, described in its base class
    value = getattr(value, "py_func", value)  # what numba compiles
    return (
        inspect.isfunction(value) or inspect.isclass(value) or isinstance(value, property | classmethod | staticmethod)
    )


def names(package: str) -> Iterator[str]:
    """Return the full names of a package's public functions and classes, and of the classes' methods."""
    for module in modules(package):
        for name, value in vars(module).items():
            if not is_public(name, value) or getattr(value, "__module__", None) != module.__name__:
                continue
            yield f"{module.__name__}.{name}"
            if inspect.isclass(value):
                yield from (
                    f"{module.__name__}.{name}.{member}"
                    for member, held in vars(value).items()
                    if is_public(member, held)
                )


def faults(name: str) -> Iterator[str]:
    """Return what numpydoc, and the slots for types, refuse in the docstring of that name."""
    documented = get_doc_object(pkgutil.resolve_name(name))
    sections = {section: documented[section] for section in ("Parameters", "Returns", "Raises")}
    for code, message in validate(name)["errors"]:
        if code not in NOT_ASKED and not (code == "PR01" and not sections["Parameters"]):
            yield f"{name}: {code} {message}"
    for section, written in sections.items():
        for entry in written:
            if not (ERROR.fullmatch(entry.type) if section == "Raises" else TYPE.match(entry.type)):
                yield f"{name}: {section} {entry.name}: {entry.type!r} is no type"
            if not entry.desc:
                yield f"{name}: {section} {entry.name or entry.type} has no description"


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_are_numpydocs(package: str) -> None:
    public_names = list(names(f"study_app.{package}"))
    assert len(public_names) > 20
    assert [fault for name in public_names for fault in faults(name)] == []


@needs_servo
@pytest.mark.parametrize("name", EXAMPLES)
def test_examples_run(name: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(Path(__file__).parents[2])
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    module = importlib.import_module(name.rpartition(".")[0])
    (example,) = doctest.DocTestFinder(recurse=False).find(vars(module)[name.rpartition(".")[2]], name)
    example.globs.update(vars(module))
    output: list[str] = []
    result = doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(example, out=output.append)
    assert result.attempted > 1
    assert result.failed == 0, "".join(output)
