"""The words of a study's report and of its exported tables: what a person reads in page, captions and figures."""

import csv
import io
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from study_app import figure_style
from study_app.analysis.data.study_tables import Study
from study_app.analysis.report import write_report
from tests.golden_figures import figure_words, stub_png
from tests.golden_values import file_lines

GOLDEN = Path(__file__).parent / "golden"


@contextmanager
def figures_as_lines() -> Iterator[None]:
    """Replace the content of figure files by the texts in the figures."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(figure_style, "file_bytes", stub_png)
        patched.setattr(write_report, "FORMATS", ("png",))
        yield


def sav_labels(path: Path) -> Iterator[str]:
    """Yield the labels of the variables of a file of SPSS."""
    pyreadstat = pytest.importorskip("pyreadstat", reason="the extra analysis is not installed")
    frame, meta = pyreadstat.read_sav(str(path), user_missing=True)
    for column in frame:
        labels = meta.variable_value_labels.get(column, {})
        missing = meta.missing_ranges.get(column, [])
        kind = meta.variable_measure[column]
        yield f"{column}: {meta.column_names_to_labels[column]} {kind} {labels} {missing}"


def report_words(study: Study) -> Iterator[str]:
    """Yield the words of a study's page, captions and figures; check that its tables are whole."""
    with figures_as_lines():
        files, failed = write_report.report_files(study)
    assert not failed, "; ".join(map(str, failed))
    for name, content in sorted(files.items()):
        kind = name.rpartition(".")[2]
        if kind == "csv":
            head, *rows = csv.reader(io.StringIO(content.decode()))
            assert {len(row) for row in rows} <= {len(head)}, name
            assert len(set(head)) == len(head), name
        elif kind == "png":
            yield from figure_words(content)
        elif kind in ("html", "txt") and name != "methods.txt":
            yield from file_lines(name, content)
