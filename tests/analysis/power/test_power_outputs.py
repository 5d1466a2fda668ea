"""Counts, tables and figures of the power of small plans, compared with reviewed files."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from study_app.analysis.planning.power_curves import powers, write_power
from study_app.analysis.planning.simulated_studies import count, plan
from study_app.analysis.planning.threshold_studies import threshold_csv, threshold_markdown
from study_app.protocol.load import load, parse
from tests.analysis.conftest import SMALL
from tests.analysis.outputs import GOLDEN
from tests.analysis.power.test_power import felt_in
from tests.analysis.power.test_threshold_power import study, swept
from tests.golden import CHANGING, compare
from tests.golden_figures import figure_of, stub_png
from tests.golden_values import numbers

PLANS = {"two": SMALL, "rek2024": None}


@pytest.mark.parametrize("name", ["two", pytest.param("rek2024", marks=pytest.mark.slow)])
def test_power_of_small_plans(
    name: str, tmp_path: Path, pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Figure, "savefig", lambda figure, to, **_: to.write(stub_png(figure)))
    text = PLANS[name]
    protocol = load(name) if text is None else parse(text.encode(), "small.toml")
    planned = plan(protocol, felt_in(protocol))
    counts = count(planned, (3, 7), 1, 0, 3)
    lines = [f"{kind} {' '.join(what)}: {numbers(found)}" for kind, of in counts.items() for what, found in of.items()]
    rng = np.random.default_rng(5)
    drawn = {
        kind: {what: one if what[1] == "means" else rng.integers(0, 4, one.shape) for what, one in of.items()}
        for kind, of in counts.items()
    }
    for given, asked in ((counts, 3), (drawn, 40)):
        for path in sorted(write_power(powers(planned, (3, 7), 3, asked, 1, given), tmp_path)):
            if path.suffix not in (".svg", ".pdf"):
                content = path.read_bytes()
                lines.append(f"##### {path.name}, {asked} asked")
                lines += figure_of(content) if path.suffix == ".png" else content.decode().splitlines()
    compare(GOLDEN / f"power-{name}.txt", lines, pytestconfig, mask=CHANGING)


@pytest.mark.parametrize("name", ["updown", pytest.param("questplus", marks=pytest.mark.slow)])
def test_precision_of_small_plans(name: str, pytestconfig: pytest.Config) -> None:
    method = {"updown": 'kind = "updown", trials = 20', "questplus": 'kind = "questplus", trials = 20'}[name]
    found = swept(study(('kind = "questplus", trials = 20', method)), (10, 20), (1, 3), 4)
    compare(GOLDEN / f"precision-{name}.txt", [threshold_csv(found).decode(), threshold_markdown(found)], pytestconfig)
