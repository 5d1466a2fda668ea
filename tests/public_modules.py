"""A contract of the import linter: tests import public modules of the program, by name, and no others."""

import ast
from pathlib import Path

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


def package_of(module: str) -> str:
    """Return the package of the program that a module belongs to."""
    return module.split(".")[1]


def imported_by_tests(modules: set[str]) -> set[str]:
    """Return which of these modules the tests here import; another work tree with tests may be installed, too."""
    found = set()
    for path in Path("tests").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_bytes())):
            if isinstance(node, ast.Import):
                found |= {each.name for each in node.names}
            elif isinstance(node, ast.ImportFrom) and node.module:
                names = (f"{node.module}.{each.name}" for each in node.names)
                found |= {name if name in modules else node.module for name in names}
    return found


class PublicModules(Contract):
    """Tests import no private module of the program.

    A module is public if another package of the program imports it, or if ``seams`` names it; a seam that no test
    imports, or that is public already, is refused.
    """

    type_name = "public"

    seams = fields.SetField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Compare the private modules that tests import with the seams."""
        private = {
            name
            for name in imported_by_tests(graph.modules)
            if name.startswith("study_app.")
            and all(
                module.startswith("tests.") or package_of(module) == package_of(name)
                for module in graph.find_modules_that_directly_import(name)
            )
        }
        found, needless = sorted(private - self.seams), sorted(self.seams - private)
        return ContractCheck(kept=not found and not needless, metadata={"private": found, "needless": needless})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print the modules and what to do."""
        if found := check.metadata["private"]:
            output.print_error(f"private modules that tests import: {', '.join(found)}")
            output.print_error("test through a seam (docs/testing.md)")
        if needless := check.metadata["needless"]:
            output.print_error(f"seams that need no name: {', '.join(needless)}")
