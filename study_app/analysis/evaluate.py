"""Evaluate a study: compute all results, and decide which tests apply to which block."""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Final

import pandas as pd

from study_app.analysis.contrasts import contrast_results
from study_app.analysis.data.blocks import Block
from study_app.analysis.data.motion import Performance, performance
from study_app.analysis.data.study_tables import Study
from study_app.analysis.findings import all_findings
from study_app.analysis.findings.finding import (
    BlockAnswers,
    block_answers,
    empty_result,
    summarize_block,
    unrated_results,
)
from study_app.analysis.findings.statement_tests import add_gates
from study_app.analysis.levels.evaluate import level_results
from study_app.analysis.questions import question_results, score_results
from study_app.analysis.results import (
    SEALED,
    BlockResult,
    Delivered,
    Ended,
    Failure,
    Failures,
    NotTested,
    Progress,
    Results,
    report_no_progress,
)
from study_app.protocol.orders import Evenness, evenness

SEED: Final = 1
"""The seed of all permutations and resamples, so that the same data always give the same numbers."""


def evaluate(study: Study, *, recordings: bool = True, progress: Progress = report_no_progress) -> Results:
    """Run all tests on the answers and, with ``recordings``, the recordings of a study.

    While the key is sealed there are only counts and comparisons of codes. ``BlockResult.absent`` lists results that
    require the key or more participants. A part that fails is listed in ``Results.failures`` and, with the reason, in
    the ``absent`` results of its block; all other parts are complete.

    Examples
    --------
    >>> from pathlib import Path
    >>> from study_app.analysis.findings.statement_tests import SettingsDiffer
    >>> from study_app.analysis.data.study_tables import load_study
    >>> results = evaluate(load_study(Path("results/sample-rek2024")))
    >>> [(block.id, block.n, block.revealed) for block in results.blocks]
    [('liquids', 12, False), ('delays', 12, False)]
    >>> tested = SettingsDiffer.value_in(results.blocks[0])[0]
    >>> print(f"{tested.item}: p = {tested.outcome.p:.2f}, W = {tested.outcome.effect:.2f}")
    feels_liquid: p = 0.78, W = 0.03
    """
    failures = Failures()
    try:
        return _evaluate_study(study, failures, partial(_report_or_end, progress), recordings=recordings)
    except Ended as ended:
        raise ended.error from None


def _report_or_end(progress: Progress, what: str, share: float) -> None:
    """Report progress; wrap an exception of the callback in `Ended`, so that it is not recorded as a failure."""
    try:
        progress(what, share)
    except BaseException as error:
        raise Ended(error) from error


def _evaluate_study(study: Study, failures: Failures, progress: Progress, *, recordings: bool) -> Results:
    collected = [
        failures.attempt("all tests", partial(block_answers, study, block, SEED, failures), block=block.id)
        for block in study.blocks
    ]
    gated = add_gates([answers for answers in collected if not isinstance(answers, Failure)])

    def block_result(number: int, block: Block) -> BlockResult:
        def tell(what: str) -> None:
            progress(f"testing: {what}", 0.5 * number / len(study.blocks))

        def test(answers: BlockAnswers) -> BlockResult | Failure:
            return failures.attempt("all tests", partial(evaluate_block, study, answers, tell), block=block.id)

        failure = collected[number]
        result = (
            failure
            if isinstance(failure, Failure)
            else test(next(answers for answers in gated if answers.block is block))
        )
        return empty_result(block, NotTested(result.what, result.why)) if isinstance(result, Failure) else result

    def measure_performance() -> Performance | None:
        """Measure motion and force if requested; None before unblinding, because the force reveals a thick liquid."""
        if not (study.revealed and recordings):
            return None
        return performance(
            study, lambda done, total: progress(f"reading recordings: {done} of {total}", 0.5 + 0.3 * done / total)
        )

    blocks = tuple(block_result(number, block) for number, block in enumerate(study.blocks))
    levels = failures.value("the answers at each level", lambda: level_results(study), ())
    return Results(
        decided=study.decided,
        people=study.people,
        blocks=blocks,
        contrasts=failures.value("the hypotheses", lambda: contrast_results(study, gated, levels), ()),
        delivered=failures.value("the delivered delays", lambda: _delivery_check(study), ()),
        orders=failures.value("the trial orders", lambda: _order_balance(study), {}),
        block_orders=failures.value("the block orders", lambda: _block_order_balance(study), None),
        unrated_blocks=tuple(unrated_results(study.unrated_blocks)),
        seed=SEED,
        questions=failures.value("the answers to other questions", lambda: question_results(study), ()),
        scores=failures.value("the questionnaire scores", lambda: score_results(study), ()),
        levels=levels,
        performance=failures.value("motion and force", measure_performance, None),
        failures=tuple(failures.found),
    )


def evaluate_block(study: Study | None, answers: BlockAnswers, tell: Callable[[str], object] = str) -> BlockResult:
    """Run all tests on a block's answers; without a study, measures are omitted.

    ``tell`` is called with the name of each finding before it is computed.
    """
    block = answers.block
    is_unmatched = study is not None and (study.own_codes or study.has_unmatched_sites)
    result = summarize_block(study, answers)
    for finding in all_findings():
        if not finding.what:
            continue
        sealed, waits = finding.sealed, finding.waits
        if is_unmatched and finding.compares_settings:
            sealed, waits = (), (*waits, *sealed)
        if block.kind not in (finding.kinds if block.revealed else sealed):
            if not block.revealed and block.kind in waits:
                result = replace(result, absent=(*result.absent, NotTested(finding.what, SEALED)))
            continue
        tell(finding.what)
        tested = answers.failures.attempt(finding.what, partial(finding.test, answers, result), block=block.id)
        if isinstance(tested, Failure):
            tested = finding.empty, (NotTested(finding.what, tested.why),)
        value, absent = tested
        result = replace(finding.add_to(result, value), absent=(*result.absent, *absent))
    return result


def _delivery_check(study: Study) -> tuple[Delivered, ...]:
    """Return the manipulation check of each setting or, while the key is sealed, of each block.

    Errors by code could reveal the delays before the key is opened.
    """
    counted = study.trials[study.trials["counted"]]
    delivery = []
    for block in study.trial_blocks:
        rows = counted[counted["block"] == block.id]
        if not block.revealed:
            delivery.append(_measure_delivery(block, None, None, rows))
            continue
        delivery += [
            _measure_delivery(block, setting.code, setting.delay_ms, rows[rows["code"] == setting.code])
            for setting in block.settings
        ]
    return tuple(delivery)


def _measure_delivery(block: Block, code: str | None, delay_ms: float | None, rows: pd.DataFrame) -> Delivered:
    errors = rows["delay_error_mean_ms"].dropna().astype(float)
    mean_ms = float(errors.mean()) if len(errors) else None
    return Delivered(
        block=block.id,
        code=code,
        delay_ms=delay_ms,
        trials=len(rows),
        measured=len(errors),
        judged=int(rows["valid"].notna().sum()),
        valid=int(rows["valid"].fillna(value=False).sum()),
        error_mean_ms=mean_ms,
        error_worst_ms=float(errors.iloc[errors.abs().argmax()]) if len(errors) else None,
        achieved_ms=None if delay_ms is None or mean_ms is None else delay_ms + mean_ms,
    )


def _presented_trials(study: Study) -> pd.DataFrame:
    """Return the last attempt at each main trial of the included sessions, including excluded trials."""
    included = study.participants.loc[study.participants["counted"], ["participant", "session"]]
    rows = study.trials[study.trials["phase"] == "main"].merge(included, on=["participant", "session"])
    return rows.drop_duplicates(["participant", "session", "trial"], keep="last")


def _block_order_balance(study: Study) -> Evenness | None:
    """Return the balance of the block orders as run; None for a fixed order and if sessions differ in their blocks."""
    if study.protocol.get("study", {}).get("block_order", "fixed") == "fixed":
        return None
    rows = _presented_trials(study).sort_values(["participant", "session", "trial"])
    orders = [list(dict.fromkeys(map(str, of["block"]))) for _, of in rows.groupby(["participant", "session"])]
    presented = {block for order in orders for block in order}
    ids = (*(block.id for block in study.trial_blocks), *(level.id for level in study.levels))
    blocks = tuple(block for block in ids if block in presented)
    return evenness(blocks, orders) if len(blocks) > 1 and all({*blocks} == {*order} for order in orders) else None


def _order_balance(study: Study) -> dict[str, Evenness]:
    """Return the balance of the trial orders as run (block id → counts), including excluded trials.

    It is unknown in a sealed study in which each site or each participant has its own codes.
    """
    if study.own_codes or study.has_unmatched_sites:
        return {}
    rows = _presented_trials(study).sort_values(["participant", "session", "index"])
    return {
        block.id: evenness(
            block.codes_as_dealt,
            [
                list(map(str, session["code"]))
                for _, session in rows[rows["block"] == block.id].groupby(["participant", "session"])
            ],
        )
        for block in study.trial_blocks
    }
