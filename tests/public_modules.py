"""A contract of the import linter: other packages and tests import the modules that a package's docstring names."""

import ast
import re
from pathlib import Path

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output

_PUBLIC = re.compile(r"^Public modules: (.+?)\.$", re.DOTALL | re.MULTILINE)


def package_of(module: str) -> str:
    """Return the package of the program that a module belongs to."""
    return module.split(".")[1]


def public_modules() -> set[str]:
    """Return the modules after "Public modules: " in the docstrings of the packages."""
    names = set()
    for path in Path("study_app").glob("*/__init__.py"):
        if public := _PUBLIC.search(ast.get_docstring(ast.parse(path.read_bytes())) or ""):
            names |= {f"study_app.{path.parent.name}.{name}" for name in re.split(r",\s+", public[1])}
    return names


def imported_by_packages(graph: ImportGraph) -> set[str]:
    """Return the modules of packages that another package of the program imports."""
    return {
        name
        for name in graph.modules
        if name.startswith("study_app.")
        and name.count(".") > 1
        and any(
            importer.startswith("study_app.") and package_of(importer) != package_of(name)
            for importer in graph.find_modules_that_directly_import(name)
        )
    }


def imported_by_tests(modules: set[str]) -> set[str]:
    """Return which of these modules the tests of this work tree import."""
    names_imported = set()
    for path in Path("tests").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Import):
                names_imported |= {each.name for each in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                names = (f"{node.module}.{each.name}" for each in node.names)
                names_imported |= {name if name in modules else node.module for name in names}
    return {name for name in names_imported if name.startswith("study_app.") and name.count(".") > 1}


class PublicModules(Contract):
    """Other packages import the modules that a package's docstring names as public, and tests no private ones.

    A public folder exports names of its modules, which tests may import as well. ``seams`` names the other modules
    that tests import. A public module that no other package imports, and a seam that needs no name, are refused.
    """

    type_name = "public"

    seams = fields.SetField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Compare the docstrings with what packages import, and the seams with the private modules of tests."""
        public, imported = public_modules(), imported_by_packages(graph)
        exported = {
            module
            for folder in public & graph.modules
            for module in graph.find_modules_directly_imported_by(folder)
            if module.startswith(f"{folder}.")
        }
        private = imported_by_tests(graph.modules) - public - exported
        broken = {
            "modules that other packages import, but no docstring names": imported - public,
            "public modules that no other package imports": public - imported,
            "private modules that tests import (test through a seam: docs/testing.md)": private - self.seams,
            "seams that need no name": self.seams - private,
        }
        return ContractCheck(kept=not any(broken.values()), metadata=broken)

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print what is broken, with the modules."""
        for reason, modules in check.metadata.items():
            if modules:
                output.print_error(f"{reason}: {', '.join(sorted(modules))}")
