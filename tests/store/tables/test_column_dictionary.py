import re

import pytest

from study_app.store.journals.journal_events import EVENTS
from study_app.store.tables.column_dictionary import SECTIONS, dictionary_markdown
from study_app.store.tables.columns import EXCLUSIONS, GROUP, INTERVALS, RESPONSES_2, TABLES, TRIALS_2, VIDEO
from study_app.store.tables.level_columns import EXPONENTS, OF_TRACKS, SETTINGS, THRESHOLDS
from study_app.store.tables.recorded_columns import FRAMES, SAMPLES

OF_FORMAT_2 = tuple(column for column in TRIALS_2 if column not in TABLES["trials"])


def test_every_column_of_every_file_has_its_line() -> None:
    text = dictionary_markdown()
    sections = {title: columns for title, _, _, columns in SECTIONS}
    responses, trials, participants = TABLES.values()
    tables = [responses, RESPONSES_2, trials, INTERVALS, participants]
    outcome, *video, intervals, group = OF_FORMAT_2
    assert tuple(video) == VIDEO
    assert (outcome.levels[-1][0], intervals.name, group) == ("invalid", "intervals", GROUP)
    opened = (OF_TRACKS, THRESHOLDS, SETTINGS, EXPONENTS)
    assert list(sections.values()) == [*tables, OF_FORMAT_2, *opened, EXCLUSIONS, SAMPLES, FRAMES]
    parts = re.split(r"^## ([\w, ]+)$", text, flags=re.MULTILINE)
    assert parts[1::2] == [*sections, "Journal"]
    for title, part in zip(parts[1::2], parts[2::2], strict=True):
        names = re.findall(r"^\| `(\w+)` \|", part, flags=re.MULTILINE)
        expected = EVENTS if title == "Journal" else sections[title]
        assert names == [one.name for one in expected]


def test_every_table_is_one_that_renders() -> None:
    """A header, its rule and rows of as many cells, with a line free before and after, below its heading and file."""
    text = dictionary_markdown()
    tables = [block for block in text.split("\n\n") if block.startswith("| ")]
    assert len(tables) == len(SECTIONS) + 1
    for table in tables:
        header, rule, *rows = table.rstrip("\n").split("\n")
        assert set(rule) <= set("| -")
        assert rows
        assert {row.count(" | ") for row in (header, *rows)} == {2}
    headed = r"^## .+\n\n`.+`: .+\n\n(?:[^|].*\n\n)?\| "
    assert len(re.findall(headed, text, re.MULTILINE)) == len(tables)


@pytest.mark.parametrize(
    "line",
    [
        "| `response` | whole number, 1 to 7, or n/a | The answer on the scale, from 1 (completely disagree) to 7 "
        "(completely agree). |",
        "| `simulated` | true, false | true if participant and device were simulated (a rehearsal). |",
        "| `force_peak_n` | number [N], or n/a | Largest magnitude of the force sent to the device. **Sealed until "
        "unblinding.** |",
        "| `page_shown` | `page` | A page of text was shown. |",
        "| `due_ns` | whole number [ns] | Time when the tick was due; its lateness is time_ns - due_ns. |",
    ],
)
def test_a_line_says_kind_unit_range_and_meaning(line: str) -> None:
    assert line in dictionary_markdown().splitlines()


def test_levels_are_explained() -> None:
    (line,) = [line for line in dictionary_markdown().splitlines() if line.startswith("| `validity` ")]
    assert "| `valid`, `invalid`, or n/a |" in line
    assert line.endswith("`valid`: all did; `invalid`: at least one did not. |")
