"""What was found where liquids were compared: statements, pairs of liquids, and whether liquids were recognised."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import combinations
from typing import Final

import numpy as np

from study_app.analysis.designs.block_tests import (
    AGAIN,
    OMNIBUS,
    OVER_ALL,
    Asked,
    asked_again,
    compared,
    head,
    over_all,
)
from study_app.analysis.designs.verdicts import HOLM, in_family, verdict
from study_app.analysis.findings.block_results import BlockFound
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.liquid_recognition import RecognitionResult
from study_app.analysis.findings.not_tested import NotTested
from study_app.analysis.findings.pair_comparison import Pair
from study_app.analysis.statistics.multiple_comparisons import holm
from study_app.analysis.statistics.outcome import Outcome, told
from study_app.analysis.statistics.paired import paired
from study_app.analysis.statistics.recognition import MOST, named, recognition
from study_app.analysis.tables.study import Study

PAIRS: Final = "comparison of two settings"
RECOGNITION: Final = "test of recognition"


def liquids_found(study: Study | None, answers: Asked) -> BlockFound:
    """Return the tests of a block of liquids whose settings are known."""
    overall, failed = answers.attempt(OVER_ALL, lambda: over_all(answers), None)
    (omnibus, no_omnibus), failed_omnibus = answers.attempt(OMNIBUS, lambda: compared(answers), ((), ()))
    (pairs, no_pairs), failed_pairs = answers.attempt(PAIRS, lambda: pairs_of(answers, omnibus), ((), ()))
    (recognised, no_names), failed_names = answers.attempt(RECOGNITION, lambda: _recognised(answers), (None, ()))
    (mixed, incomplete, not_again), failed_again = answers.attempt(
        AGAIN, lambda: asked_again(answers, None, "the settings"), ((), (), ())
    )
    told = head(study, answers)
    return BlockFound(
        **{name: value for name, value in told.items() if name != "absent"},
        overall=overall,
        omnibus=omnibus,
        pairs=pairs,
        named=recognised,
        mixed=mixed,
        incomplete=incomplete,
        absent=(
            *told["absent"],
            *(*failed, *failed_omnibus, *failed_pairs, *failed_names, *failed_again),
            *(*no_omnibus, *no_pairs, *no_names, *not_again),
        ),
    )


def pairs_of(answers: Asked, omnibus: tuple[Tested, ...]) -> tuple[tuple[Pair, ...], tuple[NotTested, ...]]:
    """Return the comparisons of settings two by two, in the statements that differ at all, and why there are none."""
    count = math.comb(answers.k, 2)
    if answers.k < 3:
        return (), ()
    corrected = smallest_of_pairs(answers.k, answers.n)
    if corrected > answers.decided.alpha:
        why = (
            f"{told(answers.n)} cannot show it: the smallest p that {told(answers.n, 'pair')} can give is "
            f"{smallest_of_pairs(2, answers.n):.4g}, after Holm's correction over {count} pairs {corrected:.4g}, which "
            f"is above {answers.decided.alpha:g}"
        )
        return (), (NotTested(PAIRS, why),)
    differing = [one.item for one in omnibus if one.verdict in ("shown", "suggested")]
    if not differing:
        return (), (NotTested(PAIRS, "no statement shows a difference between the settings"),)
    return _over_all_pairs(answers, differing), ()


def smallest_of_pairs(settings: int, participants: int) -> float:
    """Return the smallest p that a comparison of two of the settings can have, corrected over all pairs by Holm."""
    return min(1.0, math.comb(settings, 2) * 2.0 ** (1 - participants))


def _over_all_pairs(answers: Asked, items: list[str]) -> tuple[Pair, ...]:
    """Compare the settings two by two in the statements ``items``, all pairs of all of them in one Holm family.

    Where one liquid differs from all others, every statement is opened, and each holds pairs that do not differ.
    """
    codes = answers.block.codes
    compared = {
        f"{item} {first} {second}": (item, first, second)
        for item in items
        for first, second in combinations(range(answers.k), 2)
    }
    outcomes: dict[str, Outcome] = {
        name: paired(answers.values[item][:, first], answers.values[item][:, second], alpha=answers.decided.alpha)
        for name, (item, first, second) in compared.items()
    }
    family = f"{answers.block.id}: all pairs of settings"
    primary = [answers.decided.is_primary(item) for item, _, _ in compared.values()]
    judged = in_family(outcomes, answers.decided.alpha, family, holm, HOLM, primary=primary)
    return tuple(
        Pair(codes[first], codes[second], replace(one, item=item))
        for (item, first, second), one in zip(compared.values(), judged, strict=True)
    )


def _recognised(answers: Asked) -> tuple[RecognitionResult | None, tuple[NotTested, ...]]:
    """Test whether settings were named for what they were."""
    labels = answers.decided.names
    right = tuple(setting.label for setting in answers.block.settings)
    if not answers.decided.named_in(answers.block) or not any(right):
        return None, (NotTested(RECOGNITION, "the protocol does not say which statements name these liquids"),)
    if not 2 <= answers.k <= MOST or len(labels) < 2:
        return None, (NotTested(RECOGNITION, f"it needs 2 to {MOST} settings and two names"),)
    ratings = np.stack([answers.values[label] for label in labels], axis=2)
    truth = [None if label is None else labels.index(label) for label in right]
    found = recognition(named(ratings), truth, len(labels), seed=answers.intervals)
    said = verdict(found.p, found.smallest_p, answers.decided.alpha, primary=answers.decided.binding)
    return RecognitionResult(labels, answers.block.codes, right, found, said), ()
