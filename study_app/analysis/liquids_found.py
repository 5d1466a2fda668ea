"""What was found where liquids were compared: statements, pairs of liquids, and whether liquids were recognised."""

from __future__ import annotations

from dataclasses import replace
from itertools import combinations

import numpy as np

from study_app.analysis.answered import Asked, asked_again, compared, head, over_all
from study_app.analysis.judging import HOLM, in_family, verdict
from study_app.analysis.results import BlockFound, Named, Pair, Tested, Waiting
from study_app.analysis.statistics.families import holm
from study_app.analysis.statistics.outcome import Outcome, told
from study_app.analysis.statistics.paired import paired
from study_app.analysis.statistics.recognition import MOST, named, recognition
from study_app.analysis.tables import Study


def liquids_found(study: Study, of: Asked) -> BlockFound:
    """Return the tests of a block of liquids whose settings are known."""
    omnibus, no_omnibus = compared(of)
    pairs, no_pairs = _pairs(of, omnibus)
    recognised, no_names = _recognised(of)
    mixed, incomplete, not_again = asked_again(of, None, "the settings")
    return BlockFound(
        **head(study, of),
        overall=over_all(of),
        omnibus=omnibus,
        pairs=pairs,
        named=recognised,
        mixed=mixed,
        incomplete=incomplete,
        absent=(*no_omnibus, *no_pairs, *no_names, *not_again),
    )


def _pairs(of: Asked, omnibus: tuple[Tested, ...]) -> tuple[tuple[Pair, ...], tuple[Waiting, ...]]:
    """Compare settings two by two, in the statements that differ at all."""
    count = of.k * (of.k - 1) // 2
    if of.k < 3:
        return (), ()
    smallest = 2.0 ** (1 - of.n)
    if count * smallest > of.decided.alpha:
        corrected = min(1.0, count * smallest)
        why = (
            f"{told(of.n)} cannot show it: the smallest p that {told(of.n, 'pair')} can give is {smallest:.4g}, after "
            f"Holm's correction over {count} pairs {corrected:.4g}, which is above {of.decided.alpha:g}"
        )
        return (), (Waiting("comparison of two settings", why),)
    differing = [one.item for one in omnibus if one.verdict in ("shown", "suggested")]
    if not differing:
        return (), (Waiting("comparison of two settings", "no statement tells the settings apart as a whole"),)
    return tuple(pair for item in differing for pair in _of_item(of, item)), ()


def _of_item(of: Asked, item: str) -> list[Pair]:
    places = list(combinations(range(of.k), 2))
    values = of.values[item]
    outcomes: dict[str, Outcome] = {
        f"{first},{second}": paired(values[:, first], values[:, second]) for first, second in places
    }
    judged = in_family(
        outcomes,
        of.decided.alpha,
        f"{of.block.id}: pairs within {item}",
        holm,
        HOLM,
        primary=of.decided.is_primary(item),
    )
    codes = of.block.codes
    return [
        Pair(codes[first], codes[second], replace(one, item=item))
        for (first, second), one in zip(places, judged, strict=True)
    ]


def _recognised(of: Asked) -> tuple[Named | None, tuple[Waiting, ...]]:
    """Test whether settings were named for what they were."""
    labels = of.decided.names
    right = tuple(setting.label for setting in of.block.settings)
    if not of.decided.named_in(of.block) or not any(right):
        return None, (Waiting("test of recognition", "the protocol does not say which statements name these liquids"),)
    if not 2 <= of.k <= MOST or len(labels) < 2:
        return None, (Waiting("test of recognition", f"it needs 2 to {MOST} settings and two names"),)
    ratings = np.stack([of.values[label] for label in labels], axis=2)
    truth = [None if label is None else labels.index(label) for label in right]
    found = recognition(named(ratings), truth, len(labels), seed=of.seed)
    said = verdict(found.p, found.smallest_p, of.decided.alpha, primary=of.decided.binding)
    return Named(labels, of.block.codes, right, found, said), ()
