"""Print measured numbers of the documentation that have no date, or are older than the code they measure.

A section of a page measures if it names a command of `MEASURES`, or a benchmark, which measures what it imports. Its
numbers are as old as the latest date in the section; without one, as the date that docs/validation.md gives for the
command. Code is as old as its last commit; the version of a number is the last one in CHANGELOG.md on its day. Run in a
clone: ``python tests/benchmarks/project/old_numbers.py``; exit code 3: there is a number without a date.
"""

import re
import subprocess
import sys
from collections.abc import Iterator
from datetime import date, datetime
from pathlib import Path
from typing import Final, NamedTuple

MODEL: Final = ("study_app/haptics",)
ANSWERS: Final = ("study_app/psychophysics", "study_app/protocol/simulated.py")
STABILITY: Final = (*MODEL, "study_app/evidence/stability")
MEASURES: Final = {
    "accuracy": (*MODEL, "study_app/evidence/accuracy"),
    "cfd": ("study_app/evidence/cfd", "study_app/haptics/kernels/effects"),
    "delay-thresholds": (*ANSWERS, "study_app/evidence/thresholds"),
    "devices bench": ("study_app/devices/bench",),
    "power": (*ANSWERS, "study_app/analysis/planning"),
    "scene": MODEL,
    "soak": (*MODEL, "study_app/evidence/soak"),
    "stability": STABILITY,
    **{f"stability --{part}": STABILITY for part in ("delayed", "delivered", "velocity", "withheld")},
    "timing --lsl": ("study_app/outlets", "study_app/evidence/outlets"),
    "timing --triggers": ("study_app/outlets", "study_app/evidence/outlets"),
    "timing": ("study_app/haptics/runtime", "study_app/gui/participant", "study_app/evidence/timing"),
    "validate": (*ANSWERS, "study_app/analysis/levels", "study_app/evidence/thresholds"),
    "validate-report": ("study_app/analysis", "study_app/evidence/report_rates"),
}
"""What a command measures; of two that fit, the longer one counts."""

_COMMAND: Final = re.compile(r"\bliquid-study ([a-z][\w -]*)|\b(tests[/.]benchmarks[\w/.]+)")
_RELEASE: Final = re.compile(r"^## \[([\d.]+)\] - (\S+)$", re.MULTILINE)
_DATE: Final = re.compile(r"\b(\d{1,2} [A-Z][a-z]+ \d{4}|\d{4}-\d\d-\d\d)\b")
_CODE: Final = re.compile(r"```.*?^```|`[^`\n]*`|\]\([^)]*\)", re.MULTILINE | re.DOTALL)
_SECTION: Final = re.compile(r"^(?=#{1,4} )", re.MULTILINE)


class Measured(NamedTuple):
    """A section with measured numbers: its command, the code of that command, and the day of measurement."""

    page: str
    section: str
    command: str
    code: tuple[str, ...]
    day: date | None


def dates(text: str) -> Iterator[date]:
    """Yield the dates in a text: 22 November 2026, 2026-11-22."""
    for words in _DATE.findall(" ".join(text.split())):
        try:
            yield datetime.strptime(words, "%Y-%m-%d" if words[4] == "-" else "%d %B %Y").date()
        except ValueError:
            continue


def commands(text: str, top: Path) -> dict[str, tuple[str, ...]]:
    """Return the measuring commands that a text names, with the code that each measures."""
    commands_of: dict[str, tuple[str, ...]] = {}
    for words, benchmark in _COMMAND.findall(text):
        if benchmark:
            script = benchmark.removesuffix(".py").replace(".", "/") + ".py"
            if (top / script).is_file():
                commands_of[benchmark] = (script, *_imported(top, top / script))
        elif names := [name for name in MEASURES if f"{words} ".startswith(f"{name} ")]:
            commands_of[max(names, key=len)] = MEASURES[max(names, key=len)]
    return commands_of


def _imported(top: Path, script: Path) -> Iterator[str]:
    for module in re.findall(r"^\s*from (study_app[\w.]*) import", script.read_text(encoding="utf-8"), re.MULTILINE):
        path = module.replace(".", "/")
        yield f"{path}.py" if (top / f"{path}.py").is_file() else path


def measured(top: Path) -> Iterator[Measured]:
    """Yield the sections of the pages in a clone that name a measuring command and have numbers."""
    pages = {path: path.read_text(encoding="utf-8") for path in sorted((top / "docs").rglob("*.md"))}
    runs: dict[str, date] = {}
    for line in pages.get(top / "docs" / "validation.md", "").splitlines():
        runs |= {name: max(dates(line)) for name in commands(line, top) if any(dates(line))}
    for path, text in pages.items():
        for section in _SECTION.split(text):
            heading, _, body = section.partition("\n")
            if not re.search(r"\d", _CODE.sub("", body)) or "decisions" in path.parts or path.stem == "validation":
                continue
            for name, code in commands(body, top).items():
                day = max(dates(body), default=runs.get(name))
                yield Measured(path.relative_to(top).as_posix(), heading.strip("# "), name, code, day)


def last_change(top: Path, paths: tuple[str, ...]) -> date:
    """Return the day of the last commit to any of the paths."""
    words = ["git", "-C", str(top), "log", "-1", "--format=%cs", "--", *paths]
    return date.fromisoformat(subprocess.run(words, capture_output=True, text=True, check=True).stdout.strip())


def version(top: Path, day: date) -> str:
    """Return the last version of a clone's changelog that is not younger than a day."""
    released = _RELEASE.findall((top / "CHANGELOG.md").read_text(encoding="utf-8"))
    return next((name for name, when in released if date.fromisoformat(when) <= day), "?")


if __name__ == "__main__":
    here, undated, older = Path.cwd(), 0, 0
    for row in measured(here):
        place = " | ".join(row[:3])
        if row.day is None:
            undated += 1
            print(f"{place} | no date")
        elif row.day < (changed := last_change(here, row.code)):
            older += 1
            print(f"{place} | measured {row.day} ({version(here, row.day)}) | changed {changed}")
    print(f"{older} sections state a day before the last change of what they measure; {undated} state none")
    sys.exit(3 if undated else 0)
