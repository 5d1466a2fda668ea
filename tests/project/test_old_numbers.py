"""Measured numbers of the documentation have a day; those older than the code are found by the dates of both."""

import os
import re
import subprocess
from datetime import date
from pathlib import Path

import pytest

from tests.benchmarks.project.old_numbers import last_change, measured, version
from tests.documented import ROOT

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


CHANGELOG = "## [Unreleased]\n\n## [0.3.0] - 2026-11-23\n\n## [0.2.0] - 2026-11-21\n"


def test_outdated_and_undated_sections_are_distinguished(tmp_path: Path) -> None:
    files = {
        "CHANGELOG.md": CHANGELOG,
        "docs/page.md": PAGE,
        "study_app/haptics/tick.py": "",
        "study_app/store/files/folders.py": "",
        "tests/benchmarks/x.py": "from study_app.store.files.folders import StudyFolder\n",
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8", newline="\n")
    when = {"GIT_COMMITTER_DATE": "2026-11-24T12:00:00", "GIT_AUTHOR_DATE": "2026-11-24T12:00:00"}
    me = ("-c", "user.name=x", "-c", "user.email=x@example.org")
    for words in (("init", "-q"), ("add", "."), (*me, "commit", "-qm", "x")):
        subprocess.run(["git", *words], cwd=tmp_path, env=os.environ | when, check=True)
    old, new, without = measured(tmp_path)
    assert (old.section, old.command, old.day) == ("Old", "stability", date(2026, 11, 22))
    assert (new.section, new.day) == ("New", date(2026, 11, 25))
    assert (without.section, without.command, without.day) == ("Without a date", "tests/benchmarks/x.py", None)
    assert old.day < last_change(tmp_path, old.code) == last_change(tmp_path, without.code) == date(2026, 11, 24)
    assert [version(tmp_path, date(2026, 11, day)) for day in (22, 23)] == ["0.2.0", "0.3.0"]


def test_every_measured_number_of_the_pages_has_a_day() -> None:
    assert not [row[:3] for row in measured(ROOT) if row.day is None]


def test_the_readme_sums_up_the_counts_of_the_page_on_stability() -> None:
    page = (ROOT / "docs/stability.md").read_text("utf-8")
    rows = re.findall(r"^\| \d.* cases .*$", page, re.M)
    without, hard, others = (
        [int(number.replace(",", "")) for number in re.findall(r"\d+(?:,\d{3})*", row)] for row in rows
    )
    seeds = len(others) // 3
    cases, unstable, noisy = (sum(others[first : first + seeds]) for first in (0, seeds, 2 * seeds))
    assert sum(hard[1 : 1 + seeds]) == 0
    bad, loud, loud_of_hard = (
        f"{count or 'none'} {'was' if count == 1 else 'were'}" for count in (unstable, noisy, sum(hard[1 + seeds :]))
    )
    for name in ("README.md", "docs/begin.md"):
        text = " ".join((ROOT / name).read_text("utf-8").split())
        assert f"{sum(without[1 : 1 + seeds]):,} of {6000 * seeds:,} hard cases" in text
        assert f"with the safety layer, none were unstable and {loud_of_hard} noisy." in text
        assert f"Of {cases:,} cases of other kinds, {bad} unstable and {loud} noisy" in text
