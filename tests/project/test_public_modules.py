"""The contract of public modules refuses an import of a module that its package's docstring does not name."""

from pathlib import Path

import pytest

pytest.importorskip("grimp", reason="the import linter is not installed")

from grimp import ImportGraph

from tests.public_modules import PublicModules, public_modules

ROOT = Path(__file__).resolve().parents[2]


def test_a_module_that_no_docstring_names_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(ROOT)
    graph = ImportGraph()
    for imported in ("study_app.evidence.accuracy", "study_app.evidence.accuracy.survey"):
        graph.add_import(importer="study_app.cli.evidence", imported=imported)

    check = PublicModules(name="", session_options={}, contract_options={"seams": []}).check(graph, verbose=False)

    assert check.metadata["modules that other packages import, but no docstring names"] == {
        "study_app.evidence.accuracy.survey"
    }
    assert check.metadata["public modules that no other package imports"] == public_modules() - {
        "study_app.evidence.accuracy"
    }
