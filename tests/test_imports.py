"""Modules of the package import one another without a cycle, those for type annotations included."""

from graphlib import TopologicalSorter

import grimp
import pytest

pytestmark = pytest.mark.slow

FIND_THEIR_MODULES = ("study_app.haptics.model.effects", "study_app.haptics.model.estimators")


def test_no_module_imports_itself_through_others() -> None:
    graph = grimp.build_graph("study_app", cache_dir=None)
    imports = {module: graph.find_modules_directly_imported_by(module) for module in graph.modules}
    for package in FIND_THEIR_MODULES:
        imports[package] |= graph.find_children(package)

    TopologicalSorter(imports).prepare()  # raises CycleError, which names the modules of a cycle
