"""Power of a study: from simulated people to tables, the same whoever works, and what is told of it."""

from concurrent.futures import Executor, ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from study_app.analysis.planning.power_curves import _detectable_effect, interval, power_markdown, powers
from study_app.analysis.planning.simulated_studies import (
    BATCH,
    FULL,
    Counts,
    Plan,
    count_findings,
    draw_opinions,
    plan,
    sweep,
)
from study_app.analysis.statistics.trend_tests import step_down
from study_app.cli import commands
from study_app.errors import AnalysisError
from study_app.protocol.load import load, parse
from study_app.protocol.model import Protocol
from study_app.protocol.participants.raters import CONSISTENT, PUBLISHED, REHEARSED
from study_app.protocol.simulated import NO_FEATURES, TrialFeatures
from study_app.workers.executors import Workers
from tests.protocol.groups.grouped import grouped

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

SIZES = (5, 9)


def felt_in(protocol: Any) -> dict[tuple[str, str], tuple[TrialFeatures, ...]]:
    """Return features in which liquids differ in force and delays in the seen lag."""
    return {
        (block.id, condition): (
            TrialFeatures(
                force_mean_n=0.3 + 0.6 * number,
                force_peak_n=4.0,
                speed_rms_mps=0.1,
                push_share=0.01,
                roughness_n=0.03,
                delay_s=0.006 + protocol.delay_s(condition),
            ),
            TrialFeatures(
                force_mean_n=0.4 + 0.6 * number,
                force_peak_n=4.0,
                speed_rms_mps=0.1,
                push_share=0.02,
                roughness_n=0.03,
                delay_s=0.006 + protocol.delay_s(condition),
            ),
        )
        for block in protocol.blocks.values()
        for number, condition in enumerate(block.conditions)
    }


def planned(name: str = "rek2024") -> Plan:
    protocol = load(name)
    return plan(protocol, felt_in(protocol))


def swept(
    study: Plan, studies: int = 30, *, sizes: tuple[int, ...] = SIZES, seed: int = 1, executor: Executor | None = None
) -> tuple[int, dict[str, Counts]]:
    with ThreadPoolExecutor(1) as one_thread:
        *_, last = sweep(study, sizes, studies, seed, executor or one_thread)
    return last


@pytest.fixture(scope="module")
def counted() -> tuple[int, dict[str, Counts]]:
    return swept(planned())


@pytest.mark.nightly
def test_the_command_writes_the_same_bytes_with_one_worker_two_and_a_cluster(
    worker_options: tuple[tuple[str, str], ...], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr(
        "study_app.session.simulated.rehearsal.condition_features", lambda protocol, **_: felt_in(protocol)
    )
    outputs = []
    for number, words in enumerate(worker_options):
        to = tmp_path / str(number)
        command = ("power", "rek2024", "--sizes", "5", "--studies", "50", "--to", str(to))
        result = CliRunner().invoke(commands, [*command, *words])
        assert result.exit_code == 0, result.output
        outputs.append({path.name: path.read_bytes() for path in to.iterdir()})
    assert outputs[0].keys() >= {"power.csv", "power.md", "power-delays.png"}
    assert all(files == outputs[0] for files in outputs)


def test_engine_dask_and_its_variable_are_other_words_for_a_cluster(monkeypatch: pytest.MonkeyPatch) -> None:
    cluster = "tcp://lab1:8786"
    opened_workers: list[Workers] = []

    def opening(workers: Workers) -> Any:
        opened_workers.append(workers)
        raise AnalysisError("opened")

    monkeypatch.setattr("study_app.cli.power.executor_for", opening)
    monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", cluster)
    for words in (("--engine", "dask"), (), ("--jobs", "3"), ("--engine", "processes")):
        assert isinstance(CliRunner().invoke(commands, ["power", "rek2024", *words]).exception, AnalysisError)
    assert opened_workers == [Workers(cluster=cluster), Workers(cluster=cluster), Workers(3), Workers()]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("--engine", "dask"), "--engine dask needs a cluster: specify --cluster tcp://HOST:8786"),
        (("--workers", "2", "--cluster", "tcp://lab1:8786"), "--workers and --cluster cannot be combined"),
        (("--workers", "0"), "0 workers cannot compute anything: specify 1 or more"),
        (("--jobs", "-2"), "-2 is not a whole number of at least -1"),
        (("--engine", "ray"), "'ray' is not one of 'processes', 'dask'"),
    ],
)
def test_workers_that_make_no_sense_are_a_usage_error(
    words: tuple[str, ...], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("DASK_SCHEDULER_ADDRESS", raising=False)
    result = CliRunner().invoke(commands, ["power", "rek2024", *words])
    assert result.exit_code == 2
    assert said in result.output


@pytest.mark.parametrize("kind", PUBLISHED)
def test_power_grows_with_participants_and_effects_and_is_alpha_without_any(
    counted: tuple[int, dict[str, Counts]], kind: str
) -> None:
    studies, counts = counted[0], counted[1][kind]
    slack = 4 * np.sqrt(0.25 / studies)
    for block in ("liquids", "delays"):
        shares = counts[block, "found"] / studies
        assert (np.diff(shares, axis=0) > -slack).all()
        assert (np.diff(shares[:, : FULL + 1], axis=1) > -slack).all()
        assert (counts[block, "any"][:, 0] / studies <= 0.05 + slack / 2).all()
    if kind == CONSISTENT:
        assert (counts["delays", "found"][1, FULL, 0] / studies) > 0.9  # a delay of 200 ms is noticed


def test_the_answers_are_those_of_the_answer_model() -> None:
    """Without spread over draws, the mean answer over many people is the model's opinion, rounded now and then."""
    study_plan = planned()
    answers = draw_opinions(study_plan, 400, 1, 0)[1].answers(1.0, REHEARSED)
    assert set(np.unique(answers)) <= set(range(1, 8))
    different = answers[:, :, [item.id for item in study_plan.blocks[1].items].index("different")]
    assert different[:, 0].mean() == pytest.approx(1.9, abs=0.2)
    assert different[:, -1].mean() == pytest.approx(6.1, abs=0.2)
    none = draw_opinions(study_plan, 400, 1, 0)[1].answers(0.0, REHEARSED).mean(axis=0)
    assert np.ptp(none, axis=0).max() < 0.25
    assert (np.diff(different.mean(axis=0)) > -0.2).all()


def test_the_lowest_delay_is_the_step_downs_of_the_report() -> None:
    """Of studies whose trend is shown, as often as the report's own function, by exact p."""
    study_plan = planned()
    delays = study_plan.blocks[1]
    assert delays.delays_ms is not None
    counts = count_findings(study_plan, (9,), 1, 0, BATCH)[CONSISTENT]
    place = [item.id for item in delays.items].index("harder")
    lowest = []
    for study in range(BATCH):
        answers = draw_opinions(study_plan, 9, 1, study)[1].answers(1.0, PUBLISHED[CONSISTENT])
        lowest_ms = step_down(answers[:, :, place], delays.delays_ms).lowest_ms
        lowest.append(np.inf if lowest_ms is None else lowest_ms)
    expected = [sum(lowest_delay <= delay for lowest_delay in lowest) for delay in delays.delays_ms]
    assert np.abs(counts["delays", "lowest"][0, place, 1:] - expected[1:]).max() <= 2  # p at the edge is drawn


def test_the_interval_is_wilsons() -> None:
    # Brown, Cai & DasGupta 2001: never outside 0 to 1, and not empty at the ends
    low, high = interval(0.5, 100)
    assert (low, high) == (pytest.approx(0.4038, abs=1e-4), pytest.approx(0.5962, abs=1e-4))
    assert interval(0.0, 20) == (0.0, pytest.approx(0.1611, abs=1e-4))


def test_a_block_of_some_groups_counts_their_participants() -> None:
    """The participants of a block are stated only if some groups lack it."""
    steps = {"a": ["hello", "thin", "end"], "b": ["hello", "thin", "thick", "end"]}
    groups = "".join(f"\n[groups.{name}]\nsequence = {of_group}\n" for name, of_group in steps.items())
    features = {(block, condition): (NO_FEATURES,) for block in ("thin", "thick") for condition in ("water", "honey")}
    study_plan = plan(grouped(groups=groups), features)
    assert {block.id: block.groups for block in study_plan.blocks} == {"thin": (), "thick": ("b",)}
    studies, counts = swept(study_plan)
    power_results = powers(study_plan, SIZES, studies, studies, 1, counts)
    words = "n counts only the participants in b, because other groups do not complete this block."
    assert power_markdown(power_results).count(words) == 1


def test_a_planned_block_has_the_conditions_statements_and_features_of_the_study() -> None:
    protocol = load("rek2024")
    blocks = {block.id: block for block in plan(protocol, felt_in(protocol)).blocks}
    for name, block in blocks.items():
        stated, conditions = protocol.blocks[name], protocol.conditions
        names = list(stated.conditions)
        if block.kind == "delays":
            names.sort(key=lambda condition: conditions[condition].delay_ms)
        assert [setting.condition for setting in block.settings] == names
        assert block.codes == tuple(f"S{place}" for place in range(1, len(names) + 1))
        assert [setting.liquid for setting in block.settings] == [conditions[condition].liquid for condition in names]
        assert [setting.delay_ms for setting in block.settings] == [
            conditions[condition].delay_ms for condition in names
        ]
        assert [setting.label for setting in block.settings] == [conditions[condition].label for condition in names]
        assert block.features == tuple(felt_in(protocol)[name, condition] for condition in names)
        assert (block.title, block.repetitions, block.groups) == (stated.title["en"], stated.repetitions, ())
        questionnaire = protocol.questionnaire_of(name)
        assert questionnaire is not None
        assert [(item.id, item.text, item.short) for item in block.items] == [
            (question.id, question.text["en"], question.short["en"]) for question in questionnaire.statements
        ]
        assert block.labels == tuple("1234567")
    assert {block.kind for block in blocks.values()} == {"delays", "liquids"}


ADJUSTMENT = """
format = 2
study.name = "matching"
liquids.damper.drag = { law = "linear", damping_nspm = 8 }
tasks.stir = { kind = "follow", cycles = 1 }
stimuli.damping = { vary = "damping_nspm", level = "value", standards = [5, 11], levels = [2, 17] }
methods.set = { kind = "adjustment", repetitions = 6 }
blocks.weak = { stimulus = "damping", design = "adjustment", method = "set" }
"""


def test_a_hypothesis_about_settings_has_its_smallest_difference(tmp_path: Path) -> None:
    path, to = tmp_path / "matching.toml", tmp_path / "to"
    strong = 'blocks.strong = { stimulus = "damping", design = "adjustment", method = "set" }\n'
    path.write_text(ADJUSTMENT + strong, encoding="utf-8", newline="\n")
    refused = CliRunner().invoke(commands, ["power", str(path), "--to", str(to)])
    assert "are not simulated" in str(refused.exception)
    assert not to.exists()
    contrast = '[[analysis.contrasts]]\nmeasure = "pse"\nblocks = ["weak", "strong"]\n'
    path.write_text(ADJUSTMENT + strong + contrast, encoding="utf-8", newline="\n")
    result = CliRunner().invoke(commands, ["power", str(path), "--sizes", "8", "--to", str(to)])
    assert result.exit_code == 0, result.output
    assert "Settings are not simulated. Differences are expressed in standard deviations (SD)" in result.output
    assert "| point of subjective equality | 8 | 1 | ±0.84 SD | ±1.36 SD |" in result.output
    assert (to / "power.md").read_text("utf-8") in result.output


def changed_blocks(**changes: Any) -> Protocol:
    """Return the demo with changes to each block."""
    demo = load("demo")
    blocks = {name: block.model_copy(update=changes) for name, block in demo.blocks.items()}
    return demo.model_copy(update={"blocks": blocks})


@pytest.mark.parametrize(
    ("protocol", "reason"),
    [
        (parse(ADJUSTMENT.encode(), "matching.toml"), "results of the method of adjustment are not simulated;"),
        (changed_blocks(conditions=("water",)), "no main block has two conditions to compare; power is available"),
        (changed_blocks(questionnaire=None), "no main block with two or more conditions asks statements"),
    ],
)
def test_a_protocol_without_simulated_results_is_refused_with_the_reason(protocol: Protocol, reason: str) -> None:
    name = protocol.study.name
    with pytest.raises(AnalysisError, match=f"^the power of {name} cannot be estimated, because {reason}"):
        plan(protocol, {})


@pytest.mark.parametrize("sizes", ["5,many", "1", "5,2000", ""])
def test_sizes_that_make_no_sense_are_refused(sizes: str) -> None:
    result = CliRunner().invoke(commands, ["power", "rek2024", "--sizes", sizes])
    assert result.exit_code == 2


@pytest.mark.parametrize(
    ("found", "effect"),
    [
        ([0.2, 0.7, 0.9], 1.5),
        ([0.2, 0.85, 0.6], 12 / 13),
        ([0.1, 0.3, 0.8], 2.0),
        ([0.8, 0.9, 0.95], 0.0),
        ([0.1, 0.2, 0.79], None),
    ],
)
def test_the_detectable_effect_is_where_80_percent_of_studies_find_it(found: list[float], effect: float | None) -> None:
    assert _detectable_effect(np.array(found), np.array([0.0, 1.0, 2.0])) == (effect and pytest.approx(effect))
