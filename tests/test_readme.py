"""README's section "What is on disk": the dictionary word for word, and every file that a session leaves."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import reveal
from study_app.store.exclusions import exclude
from study_app.store.tables.column_dictionary import dictionary_markdown
from tests.compiled import needs_servo

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent
BEGIN = "<!-- dictionary: printed by python -m study_app.store.tables.column_dictionary -->\n\n"
END = "\n<!-- end of dictionary -->\n"


@pytest.fixture(scope="module")
def section() -> str:
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    return readme.split("\n## What is on disk\n")[1].split("\n## ")[0]


def test_the_dictionary_stands_there_as_it_is_printed(section: str) -> None:
    assert section.count(BEGIN) == section.count(END) == 1
    held = section.split(BEGIN)[1].split(END, maxsplit=1)[0]
    assert held == dictionary_markdown(), (
        "put what `python -m study_app.store.tables.column_dictionary` prints between the comments"
    )


def named_files(section: str) -> set[str]:
    """Return the paths of the tree in the section, of session 1 of P007."""
    tree = section.split("```\n")[1]
    assert tree.startswith("results/rek2024/\n")
    paths: set[str] = set()
    folders = {2: ""}
    for line in tree.splitlines()[1:]:
        name = line.split()[0].replace("…", "subject-P007_session-01_task-rek2024")
        indent = len(line) - len(line.lstrip())
        if name.endswith("/"):
            folders[indent + 2] = folders[indent] + name
        else:
            paths.add(folders[indent] + name)
    return paths


@needs_servo
def test_the_tree_names_every_file_of_a_study_and_no_other(section: str, tmp_path: Path) -> None:
    folder = rehearse("rek2024", participants=1, seed=1, results=tmp_path / "rek2024")
    exclude(folder, "P001", 1, by="AB", reason="a test")
    reveal(folder, by="AB", reason="a test")
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    there |= {"data/sub-P001/ses-01/crash.txt", "withdrawals.jsonl"}  # after a crash; after a withdrawal
    assert {re.sub(r"trial-\d{3}", "trial-003", name).replace("P001", "P007") for name in there} == named_files(section)
