"""Texts and figures of results made up from their types, compared with reviewed files."""

import typing
from collections import namedtuple
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from study_app.evidence.accuracy import accuracy_report, comparison
from study_app.evidence.table import Evidence
from study_app.evidence.thresholds import noticed_delays
from tests.filled import filled
from tests.golden import CHANGING, compare, each_once
from tests.golden_figures import figure_words, stub_png

GOLDEN = Path(__file__).parent / "golden"


def candidate(rng: np.random.Generator) -> Any:
    """Return a candidate with the fields that a report reads."""
    family = filled(typing.get_type_hints(typing.get_type_hints(comparison.Row)["candidate"])["family"], rng)
    name, rate = filled(str, rng), float(rng.choice([250, 1000]))
    return namedtuple("Candidate", "name label family rate_hz counted")(name, name[:4], family, rate, bool(rate < 500))


GIVEN: dict[str, Any] = {
    "candidate": candidate, "truths": (),
    "delay": lambda rng: int(rng.integers(1, 4)),
}  # fmt: skip
QUICK = {"noticed_delays-markdown": noticed_delays.noticed_delays_evidence}
SLOW = {
    "accuracy_report-write": accuracy_report.accuracy_evidence,
}  # fmt: skip
REPORTS = (*QUICK.items(), *(pytest.param(*report, marks=pytest.mark.slow) for report in SLOW.items()))


def lines_of(make: Callable[..., Any], seed: int, folder: Path, *, files: bool) -> Iterator[str]:
    """Yield the lines that a function returns or writes for made-up results."""
    rng = np.random.default_rng(seed)
    hints = typing.get_type_hints(make)
    written = [
        folder if kind is Path else filled(kind, rng, **GIVEN) for name, kind in hints.items() if name != "return"
    ]
    output = make(*written)
    if isinstance(output, Evidence):
        output = output.write(folder) if files else output.text
    if not isinstance(output, tuple):
        yield output.decode() if isinstance(output, bytes) else str(output)
        return
    for path in sorted(path for path in output if path.suffix != ".svg"):
        content = path.read_bytes()
        yield f"-- {path.name}"
        yield from figure_words(content) if content.startswith(b"\x89PNG") else content.decode().splitlines()


@pytest.mark.parametrize(("name", "make"), REPORTS)
def test_reports_of_results(
    name: str, make: Callable[..., Any], tmp_path: Path, pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Figure, "savefig", lambda figure, to, **_: to.write(stub_png(figure)))
    files = name.endswith("write")
    lines = [line for seed in range(2) for line in (f"== {seed}", *lines_of(make, seed, tmp_path, files=files))]
    compare(GOLDEN / f"{name}.txt", each_once(lines), pytestconfig, mask=CHANGING)
