"""All outputs of a study as lines: its report and its exported tables, each figure by what it shows."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

from study_app import figure_style
from study_app.analysis.data.study_tables import Study
from study_app.analysis.report import write_report
from tests.golden_figures import figure_of, stub_png
from tests.golden_values import file_lines, table_lines

GOLDEN = Path(__file__).parent / "golden"
ELSEWHERE = frozenset({"codebook.json", "methods.txt"})
"""Files of which others hold everything."""


@contextmanager
def figures_as_lines() -> Iterator[None]:
    """Let files of figures hold what these show."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(figure_style, "file_bytes", stub_png)
        for name in ("pictures", "level_pictures", "question_pictures"):
            patched.setattr(write_report, name, partial(vars(write_report)[name], forms=("png",)))
        yield


def sav_lines(path: Path) -> Iterator[str]:
    """Yield the labels of the variables of a file of SPSS, and the cells."""
    pyreadstat = pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")
    frame, meta = pyreadstat.read_sav(str(path), user_missing=True)
    for column in frame:
        labels = meta.variable_value_labels.get(column, {})
        missing = meta.missing_ranges.get(column, [])
        kind = meta.variable_measure[column]
        yield f"{column}: {meta.column_names_to_labels[column]} {kind} {labels} {missing}"
    yield from table_lines(frame.to_csv(index=False))


def report_lines(study: Study, without: frozenset[str] = ELSEWHERE) -> Iterator[str]:
    """Yield the lines of every file of a study's report."""
    with figures_as_lines():
        files, failed = write_report.report_files(study)
    assert not failed, "; ".join(map(str, failed))
    for name, content in sorted(files.items()):
        if name not in without:
            yield f"##### {name}"
            yield from figure_of(content) if name.endswith(".png") else file_lines(name, content)
