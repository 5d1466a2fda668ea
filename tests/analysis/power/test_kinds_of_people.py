"""Power of consistent, typical and noisy people, beside an independent simulation with scipy's signed-rank test."""

import re
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import PermutationMethod, binom, rankdata, wilcoxon

from study_app.analysis.planning.power_curves import power_csv, power_markdown, powers
from study_app.analysis.planning.simulated_studies import (
    BATCH,
    EFFECTS,
    Counts,
    Plan,
    count_findings,
    plan,
    total_counts,
)
from study_app.cli import commands
from study_app.errors import ProtocolError
from study_app.protocol.load import parse
from study_app.protocol.participants.raters import CONSISTENT, NOISY, PUBLISHED, STATED, TYPICAL, SimulatedParticipants
from study_app.protocol.simulated import NO_FEATURES
from tests.analysis.conftest import SMALL

TEXT = (
    SMALL.replace('"smooth"', '"like_honey"')
    .replace('id = "warm"', 'id = "like_tar"')
    .replace("repetitions = 2", "repetitions = 1")
)
"""Two liquids, once each, and two statements, of which one is planned."""
WATERY, THICK = 1.620, 5.578
"""Opinions of "like honey" without a force and with a huge one: 1.6 + 4.2 · 0.9472 · (0.00505 or 1), push share 0."""
PARTICIPANTS, STUDIES, OWN_STUDIES = 12, 500, 4000
TABLE = "[simulated_participants]\nnoise_sd = {}\nbias_sd = {}\nslope_sd = {}\nlapse_rate = {}\n"


def one_statement_plan(text: str = TEXT) -> Plan:
    """Return a plan with one statement, so that its test is not corrected for another one."""
    huge = replace(NO_FEATURES, force_mean_n=100.0, speed_rms_mps=0.1)
    features = {("feel", "heavyzembla"): (huge,), ("feel", "lightquorn"): (NO_FEATURES,)}
    study = plan(parse(text.encode(), "small.toml"), features)
    (block,) = study.blocks
    return replace(study, blocks=(replace(block, items=block.items[:1]),))


def power_counts(study: Plan, studies: int, seed: int) -> dict[str, Counts]:
    counts: dict[str, Counts] = {}
    for batch in range(studies // BATCH):
        counts = total_counts(counts, count_findings(study, (PARTICIPANTS,), seed, batch, BATCH))
    return counts


def own_share(kind: SimulatedParticipants, effect: float) -> float:
    """Return the share of studies that show a difference: by the sign test over the block, then by signed ranks."""
    rng, middle = np.random.default_rng(20261127), (WATERY + THICK) / 2
    shape = (OWN_STUDIES, PARTICIPANTS)
    slope = effect * rng.normal(1.0, kind.slope_sd, shape)[..., None]
    noise = kind.noise_sd * rng.uniform(0.5 / 0.65, 0.8 / 0.65, shape)[..., None] * rng.normal(size=(*shape, 2))
    points = (
        middle + slope * (np.array([THICK, WATERY]) - middle) + rng.normal(0, kind.bias_sd, shape)[..., None] + noise
    )
    answers = np.clip(np.rint(points + 3.0 * (rng.random((*shape, 2)) < kind.lapse_rate)), 1, 7)
    differences = answers[..., 0] - answers[..., 1]
    positive, untied = (differences > 0).sum(axis=1), (differences != 0).sum(axis=1)
    differs = 2 * binom.sf(np.maximum(positive, untied - positive) - 1, untied, 0.5) <= 0.05
    return float((differs & (signed_rank_p(differences) <= 0.05)).mean())


def signed_rank_p(differences: np.ndarray) -> np.ndarray:
    """Return the exact p of Wilcoxon's signed-rank test of each row, zeros left out, ties as mean ranks."""
    signs = np.array(list(product((0.0, 1.0), repeat=differences.shape[1])), np.float32)
    ranks = np.where(differences == 0, np.nan, np.abs(differences))
    ranks = np.nan_to_num(rankdata(ranks, axis=1, nan_policy="omit"))
    rank_sum, whole = (ranks * (differences > 0)).sum(axis=1), ranks.sum(axis=1)
    away = np.abs(signs @ ranks.T.astype(np.float32) - whole / 2)
    return np.asarray((away >= np.abs(rank_sum - whole / 2) - 1e-4).mean(axis=0))


def test_the_independent_signed_rank_test_is_scipys() -> None:
    differences = np.random.default_rng(4).integers(-3, 5, (6, 9)).astype(float)
    expected = [wilcoxon(row, zero_method="wilcox", method=PermutationMethod(np.inf)).pvalue for row in differences]
    assert signed_rank_p(differences) == pytest.approx(expected)


@pytest.mark.slow
@pytest.mark.parametrize("effect", [0.25, 0.375, 0.5])
def test_an_independent_simulation_finds_the_same_power(effect: float) -> None:
    study = replace(one_statement_plan(), kinds={**PUBLISHED, "lapsing": SimulatedParticipants(lapse_rate=0.2)})
    counts = power_counts(study, STUDIES, 7)
    for name, kind in study.kinds.items():
        program = counts[name]["feel", "found"][0, EFFECTS.index(effect), 0] / STUDIES
        own = own_share(kind, effect)
        error = np.sqrt(own * (1 - own) * (1 / STUDIES + 1 / OWN_STUDIES))
        assert abs(program - own) <= 3.5 * error + 0.01, (name, program, own)


def test_the_people_of_the_study_file_come_first_and_the_range_encloses_them() -> None:
    text = TEXT + TABLE.format(0.63, 0.5, 0.5, 0)
    study = one_statement_plan(text)
    power_results = powers(study, (PARTICIPANTS,), 40, 40, 7, power_counts(study, 40, 7))
    assert list(power_results.kinds) == [STATED, CONSISTENT, NOISY]
    first, consistent, noisy = power_results.kinds.values()
    assert first == consistent  # equal values, equal people
    assert [curve.power for curve in noisy] != [curve.power for curve in first]
    page_text = power_markdown(power_results)
    assert "% of studies detect the effect if participants are consistent, " in page_text
    assert power_csv(power_results).count(b",noisy,") == len(noisy)


@given(
    key=st.sampled_from(["noise_sd", "slope_sd"]),
    seed=st.integers(0, 1000),
    effect=st.sampled_from([0.375, 0.5]),
    bias=st.sampled_from([0.0, 0.5]),
)
@settings(max_examples=12, deadline=None)
def test_power_falls_with_noise_and_with_the_spread_of_slopes(key: str, seed: int, effect: float, bias: float) -> None:
    """Values 0.4 and 1.4, in 100 studies: the smallest expected fall is from 100 to about 60 %."""
    kinds = {
        str(value): SimulatedParticipants(**{"noise_sd": 0.4, "slope_sd": 0.4, "bias_sd": bias} | {key: value})
        for value in (0.4, 1.4)
    }
    counts = power_counts(replace(one_statement_plan(), kinds=kinds), 100, seed)
    low, high = (counts[kind]["feel", "found"][0, EFFECTS.index(effect), 0] for kind in kinds)
    assert low > high


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((3.5, 0.5, 0.5, 0), "noise_sd"),
        ((1, -0.1, 0.5, 0), "bias_sd"),
        ((1, 0.5, 2.5, 0), "slope_sd"),
        ((1, 0.5, 0.5, 0.6), "lapse_rate"),
    ],
)
def test_values_beyond_their_range_are_refused(values: tuple[float, ...], said: str) -> None:
    with pytest.raises(ProtocolError, match=said):
        parse((TEXT + TABLE.format(*values)).encode(), "small.toml")


def test_typical_people_are_the_default_of_the_table() -> None:
    (kind, *_) = one_statement_plan(TEXT + "[simulated_participants]\nnoise_sd = 1.10\n").kinds.values()
    assert kind == PUBLISHED[TYPICAL]


@pytest.mark.slow
def test_the_command_adds_the_planned_number_of_participants_and_quotes_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    huge = replace(NO_FEATURES, force_mean_n=100.0, speed_rms_mps=0.1)
    features = {("feel", "heavyzembla"): (huge,), ("feel", "lightquorn"): (NO_FEATURES,)}
    monkeypatch.setattr("study_app.session.simulated.rehearsal.condition_features", lambda *_, **_named: features)
    file = tmp_path / "small.toml"
    file.write_text(f"{TEXT}\n[analysis]\nparticipants = 7\n", encoding="utf-8", newline="\n")
    command = ["power", str(file), "--studies", "20", "--workers", "1", "--to", str(tmp_path)]
    result = CliRunner().invoke(commands, command)
    assert result.exit_code == 0, result.output
    assert "| statement | n = 5 | n = 7 (planned) | n = 8 | n = 12 |" in result.output
    registered = CliRunner().invoke(commands, ["preregister", str(file), "--power", str(tmp_path)]).output
    (line,) = (line for line in registered.splitlines() if line.startswith("- Smooth (conditions differ): "))
    assert "## Power with the planned 7 participants" in registered
    assert re.fullmatch(
        r"- Smooth \(conditions differ\): \d+ % of studies detect the effect if participants are consistent, \d+ % if "
        r"they are typical, and \d+ % if they are noisy\.",
        line,
    )
