"""Counts, tables and figures of the power of small plans: shares of studies with their intervals, and their words."""

import io
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from matplotlib.figure import Figure
from scipy.stats import binomtest

from study_app.analysis.planning.power_curves import powers, write_power
from study_app.analysis.planning.simulated_studies import count_findings, plan
from study_app.analysis.planning.threshold_studies import threshold_csv, threshold_markdown
from study_app.protocol.load import load, parse
from tests.analysis.conftest import SMALL
from tests.analysis.outputs import GOLDEN
from tests.analysis.power.test_power import felt_in
from tests.analysis.power.test_threshold_power import study, swept
from tests.golden import CHANGING, compare, each_once
from tests.golden_figures import figure_words, stub_png

PLANS = {"two": SMALL, "rek2024": None}


@pytest.mark.parametrize("name", ["two", pytest.param("rek2024", marks=pytest.mark.slow)])
def test_power_of_small_plans(
    name: str, tmp_path: Path, pytestconfig: pytest.Config, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(Figure, "savefig", lambda figure, to, **_: to.write(stub_png(figure)))
    text = PLANS[name]
    protocol = load(name) if text is None else parse(text.encode(), "small.toml")
    planned = plan(protocol, felt_in(protocol))
    counts = count_findings(planned, (3, 7), 1, 0, 3)
    lines = list[str]()
    rng = np.random.default_rng(5)
    random_counts = {
        kind: {what: values if what[1] == "means" else rng.integers(0, 4, values.shape) for what, values in of.items()}
        for kind, of in counts.items()
    }
    for study_counts, planned_studies in ((counts, 3), (random_counts, 40)):
        for path in sorted(write_power(powers(planned, (3, 7), 3, planned_studies, 1, study_counts), tmp_path)):
            if path.suffix not in (".svg", ".pdf"):
                content = path.read_bytes()
                if path.suffix == ".csv":
                    check_powers(pd.read_csv(path), 3)
                else:
                    lines += figure_words(content) if path.suffix == ".png" else content.decode().splitlines()
    compare(GOLDEN / f"power-{name}.txt", each_once(lines), pytestconfig, mask=CHANGING)


def check_powers(table: pd.DataFrame, studies: int) -> None:
    """Check that each power is in its interval: of a share of the studies in Wilson's."""
    assert set(table["studies"]) == {studies}
    for row in table[table["power"].notna()].itertuples():
        assert 0 <= row.power_low <= row.power <= row.power_high <= 1
        if round(row.power * studies) == pytest.approx(row.power * studies, abs=1e-3):
            ends = binomtest(round(row.power * studies), studies).proportion_ci(method="wilson")
            assert (row.power_low, row.power_high) == pytest.approx(tuple(ends), abs=6e-4)


@pytest.mark.parametrize("name", ["updown", pytest.param("questplus", marks=pytest.mark.slow)])
def test_precision_of_small_plans(name: str, pytestconfig: pytest.Config) -> None:
    method = {"updown": 'kind = "updown", trials = 20', "questplus": 'kind = "questplus", trials = 20'}[name]
    precisions = swept(study(('kind = "questplus", trials = 20', method)), (10, 20), (1, 3), 4)
    table = pd.read_csv(io.BytesIO(threshold_csv(precisions)))
    assert [tuple(row) for row in table[["trials", "participants"]].to_numpy()] == [(10, 1), (10, 3), (20, 1), (20, 3)]
    assert (table["half_interval"].isna() == (table["participants"] == 1)).all(), "one participant has no interval"
    for row in table[table["within"].notna()].itertuples():
        ends = binomtest(round(row.within * row.studies), row.studies).proportion_ci(method="wilson")
        assert (row.within_low, row.within_high) == pytest.approx(tuple(ends), abs=6e-4)
    if name == "updown":
        compare(GOLDEN / "precision.txt", each_once(threshold_markdown(precisions).splitlines()), pytestconfig)
