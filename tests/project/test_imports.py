"""Modules import one another without a cycle, those for type annotations included, and no more than they need."""

import ast
import contextlib
import inspect
import os
import pkgutil
import re
import subprocess
import sys
import textwrap
from collections.abc import Iterator
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

import grimp
import pytest

pytestmark = pytest.mark.slow

FIND_THEIR_MODULES = ("study_app.haptics.model.effects",)
HEAVY = ("numba", "llvmlite", "PySide6", "pyqtgraph", "pandas", "scipy", "matplotlib")
EXTRAS = {"analysis", "cfd", "cluster", "lsl", "triggers", "video"}
ROOT = Path(__file__).resolve().parents[2] / "study_app"


def test_modules_that_packages_describe_exist() -> None:
    missing, count = [], 0
    for package in ROOT.rglob("__init__.py"):
        source = package.read_text("utf-8")
        described = re.findall(r"``?([a-z_.]+)``?", ast.get_docstring(ast.parse(source)) or "")
        below = {path.stem for path in package.parent.rglob("*")} | EXTRAS
        count += len(described)
        defined = source.split('"""', 2)[-1]
        missing += [
            (package, name)
            for name in described
            if name.rpartition(".")[2] not in below and not re.search(rf"\b{re.escape(name)}\b", defined)
        ]
    assert missing == []
    assert count > 20


def test_benchmarks_import_names_that_exist() -> None:
    """No other test detects a renamed function there, since the check does not run benchmarks."""
    missing = []
    for path in (ROOT.parent / "tests" / "benchmarks").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_bytes())):
            if not isinstance(node, ast.ImportFrom) or not (node.module or "").startswith(("study_app", "tests")):
                continue
            module = ROOT.parent / str(node.module).replace(".", "/")
            files = [module.with_suffix(".py"), module / "__init__.py"]
            source = "".join(file.read_text("utf-8") for file in files if file.is_file())
            missing += [
                f"{path.name}: {node.module}.{each.name}"
                for each in node.names
                if not re.search(rf"^ *(def |class |from .*)?{each.name}\b", source, re.MULTILINE)
                and not (module / f"{each.name}.py").is_file()
            ]
    assert missing == []


def _programs_in_strings(path: Path) -> Iterator[ast.Module]:
    """Yield the programs that a file starts from a string and that import this package."""
    for node in ast.walk(ast.parse(path.read_bytes())):
        text = node.value if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""
        if "from study_app" in text and "\n" in text:
            with contextlib.suppress(SyntaxError):
                yield ast.parse(textwrap.dedent(text))


def test_programs_in_strings_call_existing_functions() -> None:
    """No other test detects a changed signature there before the program runs."""
    faults, calls = [], 0
    for path in (path for folder in ("packaging", "tests", "tools") for path in (ROOT.parent / folder).rglob("*.py")):
        for program in _programs_in_strings(path):
            names: dict[str, Any] = {}
            for node in ast.walk(program):
                if isinstance(node, ast.ImportFrom) and str(node.module).startswith("study_app"):
                    for alias in node.names:
                        try:
                            names[alias.asname or alias.name] = pkgutil.resolve_name(f"{node.module}.{alias.name}")
                        except AttributeError as error:
                            faults.append(f"{path.name}: {error}")
            for call in (node for node in ast.walk(program) if isinstance(node, ast.Call)):
                function = names.get(getattr(call.func, "id", ""))
                keywords = {keyword.arg: None for keyword in call.keywords}
                if function is None or None in keywords or any(isinstance(node, ast.Starred) for node in call.args):
                    continue
                calls += 1
                try:
                    inspect.signature(function).bind(*call.args, **keywords)
                except TypeError as error:
                    faults.append(f"{path.name}: {ast.unparse(call)}: {error}")
    assert faults == []
    assert calls > 20


def test_no_module_imports_itself_through_others() -> None:
    graph = grimp.build_graph("study_app", cache_dir=None, exclude_type_checking_imports=True)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    for package in FIND_THEIR_MODULES:
        imports[package] |= graph.find_children(package)

    TopologicalSorter(imports).prepare()  # raises CycleError, which names the modules of a cycle


def test_reading_a_protocol_leaves_the_environment_as_it_is() -> None:
    """A program that imports the package may use plugins of pydantic, which the commands switch off."""
    program = "import os; before = dict(os.environ); import study_app.protocol.load; assert dict(os.environ) == before"
    plain = {name: value for name, value in os.environ.items() if not name.startswith("PYDANTIC")}
    subprocess.run([sys.executable, "-c", program], env=plain, check=True)


def test_reading_a_protocol_loads_neither_compiler_nor_qt():
    modules = [module.name for module in pkgutil.walk_packages([str(ROOT / "protocol")], prefix="study_app.protocol.")]
    assert "study_app.protocol.load" in modules
    program = (
        f"import sys, {', '.join(modules)}\n"
        "study_app.protocol.load.load('rek2024').scene_for('water')\n"
        f"print([name for name in {HEAVY} if name in sys.modules])"
    )
    process = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert process.stdout.strip() == "[]"
