"""A contract of the import linter: tests import no more modules of the program by name than stated."""

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class ImportRatchet(Contract):
    """Tests import exactly ``most`` modules of the program: more are refused, fewer have to be stated."""

    type_name = "ratchet"

    most = fields.IntegerField()

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Count the modules of the program that any module of the tests imports."""
        imported = {
            name
            for module in graph.modules
            if module.startswith("tests.")
            for name in graph.find_modules_directly_imported_by(module)
            if name.startswith("study_app.")
        }
        return ContractCheck(kept=len(imported) == self.most, metadata={"imported": imported})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print the two numbers and what to do."""
        found = len(check.metadata["imported"])
        advice = "test through a seam (docs/testing.md)" if found > self.most else f"set most = {found}"
        output.print_error(f"tests import {found} modules of the program, the contract states {self.most}: {advice}")
