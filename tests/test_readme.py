"""README.md is short; the page of the results folder names every file that a session leaves."""

import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.blinded.blinding import reveal
from study_app.store.exclusions import exclude
from tests.compiled import needs_servo

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent
LONGEST = 80
"""Lines of README.md."""


def test_the_readme_is_short_and_leads_to_every_section() -> None:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST
    assert text.count("![") == 3
    assert max(len(line) for line in text.splitlines() if not line.startswith(("|", "python3", "!"))) <= 120


def test_the_first_command_ends_in_the_demo_and_the_second_in_the_quick_tests() -> None:
    """`packaging/try_readme.sh` takes them from these lines and runs them."""
    lines = (ROOT / "README.md").read_text(encoding="utf-8").splitlines()
    first, second = (line for line in lines if line.startswith("python3 -m venv"))
    program, command = first.rpartition("&& ")[2].split()
    assert (program, command in commands.commands) == (".venv/bin/liquid-study", True)
    assert command == "demo"
    assert second.endswith('-m pytest -n 2 --dist loadfile -m "not slow and not nightly"')


def test_the_sample_is_sound_and_described_by_this_version() -> None:
    result = CliRunner().invoke(commands, ["verify", str(ROOT / "results" / "sample-rek2024")])
    assert (result.output, result.exit_code) == ("12 sessions: sound\n", 0)


@pytest.fixture(scope="module")
def section() -> str:
    return (ROOT / "docs" / "results-folder.md").read_text(encoding="utf-8")


def named_files(section: str) -> set[str]:
    """Return the paths of the tree in the page, of session 1 of P007."""
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


@pytest.mark.nightly
@needs_servo
def test_the_tree_names_exactly_the_files_of_a_study(section: str, tmp_path: Path) -> None:
    folder = rehearse("rek2024", participants=1, seed=1, results=tmp_path / "rek2024")
    exclude(folder, "P001", 1, by="AB", reason="a test")
    reveal(folder, by="AB", reason="a test")
    there = {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}
    there |= {"data/sub-P001/ses-01/crash.txt", "withdrawals.jsonl"}  # after a crash; after a withdrawal
    assert {re.sub(r"trial-\d{3}", "trial-003", name).replace("P001", "P007") for name in there} == named_files(section)
