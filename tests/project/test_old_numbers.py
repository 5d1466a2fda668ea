"""Numbers of the documentation that are older than the code that they measure are found by the dates of both."""

import os
import subprocess
from datetime import date
from pathlib import Path

import pytest

from tests.benchmarks.project.old_numbers import old_numbers

pytestmark = pytest.mark.slow

PAGE = """# Page

## Old

`liquid-study stability --cases 3` on 22 November 2026: 0 of 3.

## New

`liquid-study stability`: 4 of 5, on 2026-11-25.

## Without a date

`python tests/benchmarks/x.py` prints 7.

## Only a command

`liquid-study stability --cases 3` takes a minute.
"""


def test_sections_older_than_their_code_and_without_a_date_are_listed(tmp_path: Path) -> None:
    files = {
        "docs/page.md": PAGE,
        "study_app/haptics/tick.py": "",
        "study_app/store/folders.py": "",
        "tests/benchmarks/x.py": "from study_app.store.folders import StudyFolder\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    when = {"GIT_COMMITTER_DATE": "2026-11-24T12:00:00", "GIT_AUTHOR_DATE": "2026-11-24T12:00:00"}
    me = ("-c", "user.name=x", "-c", "user.email=x@example.org")
    for words in (("init", "-q"), ("add", "."), (*me, "commit", "-qm", "x")):
        subprocess.run(["git", *words], cwd=tmp_path, env=os.environ | when, check=True)
    day = date(2026, 11, 24)
    assert list(old_numbers(tmp_path)) == [
        ("docs/page.md", "Old", "stability", date(2026, 11, 22), day),
        ("docs/page.md", "Without a date", "tests/benchmarks/x.py", None, day),
    ]
