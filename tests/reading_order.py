"""A contract of the import linter: a package's docstring lists its layers, in the order in which to read them."""

import ast
import re
from pathlib import Path

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, output

MOST_MODULES = 5
"""Packages with more modules and folders need a reading order."""
_ORDER = re.compile(r"^Reading order: (.+?)\.$", re.DOTALL | re.MULTILINE)


def layers_in(docstring: str) -> list[list[str]]:
    """Return the layers after "Reading order: " in a docstring, lowest first; none if it has no such sentence."""
    order = _ORDER.search(docstring)
    return [re.split(r",\s+", layer) for layer in re.split(r";\s+", order[1])] if order else []


def broken_order(graph: ImportGraph, package: str) -> str | None:
    """Return why the reading order in a package's docstring does not hold; None if it holds."""
    docstring = ast.get_docstring(ast.parse(Path(*package.split("."), "__init__.py").read_bytes())) or ""
    layers = layers_in(docstring)
    listed = [name for layer in layers for name in layer]
    modules = sorted(child.removeprefix(f"{package}.") for child in graph.find_children(package))
    if sorted(listed) != modules:
        return f"the reading order lists {', '.join(sorted(listed)) or 'nothing'}; the modules are {', '.join(modules)}"
    illegal = graph.find_illegal_dependencies_for_layers(
        layers=[set(layer) for layer in reversed(layers)], containers={package}
    )
    upwards = sorted(f"{dependency.importer} imports {dependency.imported}" for dependency in illegal)
    return f"a module may import only layers before its own: {', '.join(upwards)}" if upwards else None


class ReadingOrder(Contract):
    """In each package with more than five modules and folders, each layer imports only those that are read before it.

    Layers are separated by semicolons, modules of one layer, which do not import each other, by commas.
    """

    type_name = "reading_order"

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Compare the imports inside every package with its docstring."""
        packages = sorted(
            name
            for name in graph.modules
            if name.startswith("study_app.") and len(graph.find_children(name)) > MOST_MODULES
        )
        broken = {package: reason for package in packages if (reason := broken_order(graph, package))}
        return ContractCheck(kept=not broken, metadata={"broken": broken})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print each package and what does not hold."""
        for package, reason in check.metadata["broken"].items():
            output.print_error(f"{package}: {reason}")
