"""Texts of the program: none prints the name of a variable instead of its value."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import study_app

pytestmark = pytest.mark.slow

PLACE = re.compile(r"\{([A-Za-z_]\w*)[^{}]*\}")
FORMATTERS = {"PydanticCustomError", "StrMethodFormatter", "TextColumn", "format"}
"""What puts values into a text of its own function."""


def unformatted_strings(source: str) -> Iterator[tuple[int, str]]:
    """Yield line and text of each string that names a variable of its function in braces, and is no f-string."""
    for function in ast.walk(ast.parse(source)):
        if not isinstance(function, ast.FunctionDef | ast.AsyncFunctionDef):
            continue
        nodes = [node for statement in function.body for node in ast.walk(statement)]
        called = [node.func for node in nodes if isinstance(node, ast.Call)]
        if FORMATTERS & {getattr(function_node, "attr", getattr(function_node, "id", "")) for function_node in called}:
            continue
        known = {node.arg for node in ast.walk(function.args) if isinstance(node, ast.arg)}
        known |= {node.id for node in nodes if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}
        parts = {id(part) for node in nodes if isinstance(node, ast.JoinedStr) for part in ast.walk(node)}
        texts = (node for node in nodes if isinstance(node, ast.Constant) and isinstance(node.value, str))
        for text in texts:
            if id(text) not in parts and known & set(PLACE.findall(text.value)):
                yield text.lineno, text.value


def test_no_text_prints_the_name_of_a_variable() -> None:
    folder = Path(study_app.__file__).parent
    unformatted_texts = {
        f"{path.relative_to(folder)}:{line}": text
        for path in sorted(folder.rglob("*.py"))
        for line, text in unformatted_strings(path.read_text(encoding="utf-8"))
    }
    assert unformatted_texts == {}


def test_each_logged_text_has_a_place_for_each_of_its_values() -> None:
    wrong_calls = []
    for path in sorted(Path(study_app.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text("utf-8"))):
            match node:
                case ast.Call(func=ast.Attribute(value=ast.Name("log")), args=[ast.Name(name), _]) if name.isupper():
                    continue
                case ast.Call(func=ast.Attribute(value=ast.Name("log")), args=[ast.Constant(str(text)), *values]):
                    whole = text.replace("%%", "").count("%") == len(values)
                case ast.Call(func=ast.Attribute(value=ast.Name("log")), args=[_, _, *_]):
                    whole = False
                case _:
                    continue
            if not whole:
                wrong_calls.append((path.name, node.lineno))
    assert wrong_calls == []


def test_no_part_of_a_text_stands_alone() -> None:
    """An f-string after a finished statement is computed and lost."""
    lost = [
        (path, node.lineno)
        for path in (Path(__file__).parents[2] / "study_app").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.JoinedStr)
    ]
    assert not lost
