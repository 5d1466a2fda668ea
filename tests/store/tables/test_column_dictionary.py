import pytest

from study_app.store.tables.column_dictionary import dictionary_markdown


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
