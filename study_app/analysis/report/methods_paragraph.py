"""The paragraph for a paper: what was done, so that it could be done again."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from study_app import __version__
from study_app.analysis.figures.captions import people_a_setting
from study_app.analysis.findings.block_results import BlockFound, Results
from study_app.analysis.findings.item_test import Tested
from study_app.analysis.findings.words import (
    all_of,
    counted,
    least,
    listed,
    percent,
    said_of_presentations,
    settings_noun,
    test_name,
)
from study_app.analysis.tables.measures import QUARTILES
from study_app.analysis.tables.study import Study


def methods(study: Study, results: Results) -> str:
    """Return the methods paragraph."""
    return " ".join(sentence for sentence in _sentences(study, results) if sentence)


def _sentences(study: Study, results: Results) -> Iterator[str]:
    blocks = [found for found in results.blocks if found.n]
    yield _sample(study)
    if not blocks:
        return
    yield _presented(study, results)
    quartiles = QUARTILES.replace(" (", ", ").rstrip(")")
    yield (
        f"Answers were given on scales of seven points and are taken as ordinal: medians, quartiles ({quartiles}), "
        "never means, except in the test of equivalence, which is about the mean difference."
    )
    for found in blocks:
        yield from said_of_presentations(found)
        yield from _liquids(found) if found.kind == "liquids" else _delays(found, results)
    yield from _common(results, blocks)
    yield f"Sessions and analysis: liquid-study {__version__}."


def _sample(study: Study) -> str:
    people = counted(study.n, "participant")
    kind = " (SIMULATED, no people)" if study.simulated else ""
    out = study.left_out + len(study.excluded_sessions)
    gone = f"; {counted(out, 'further session')} {'was' if out == 1 else 'were'} left out" if out else ""
    return (
        f"{people[:1].upper()}{people[1:]}{kind} took part in “{study.title}” (protocol {study.name}, "
        f"{told_versions(study)}){gone}, {_under(study)}."
    )


def told_versions(study: Study) -> str:
    """Return the versions of the protocol whose sessions are pooled."""
    versions = study.versions
    return f"version {versions[0]}" if len(versions) == 1 else f"versions {listed(versions)}, pooled"


def _under(study: Study) -> str:
    if all(set(people_a_setting(study, block).values()) == {study.n} for block in study.blocks):
        return "each under all settings"
    return "some of them under fewer than all settings, single trials being left out"


def _presented(study: Study, results: Results) -> str:
    parts = []
    for found in results.blocks:
        noun = settings_noun(found)
        order = study.protocol.get("blocks", {}).get(found.id, {}).get("order", "")
        words = {
            "fixed": "in one order for all",
            "shuffled": "in an order drawn for each participant",
            "constrained": "in a constrained order drawn for each participant",
            "williams": "in the orders of a Williams design",
            "latin": "in the orders of a Latin square",
        }.get(order, "")
        delays = f" ({listed([f'{delay:g}' for delay in found.delays_ms])} ms)" if found.delays_ms else ""
        asked = f", each followed by {counted(len(found.items), 'statement')}"
        parts.append(f"{counted(len(found.settings), noun)}{delays} {words}".strip() + asked)
    blind = (
        "known by codes alone until the key was opened" if study.revealed else "known by codes, the key being sealed"
    )
    return f"Presented were {'; '.join(parts)}; {blind}."


def _liquids(found: BlockFound) -> Iterator[str]:
    noun = settings_noun(found)
    if found.overall is not None:
        yield (
            f"The {noun}s were compared over {all_of(len(found.items), 'statement')} at once by permuting them "
            "within participants, the statistic being the sum of the statements' Friedman statistics."
        )
    if found.omnibus:
        one = next((one for one in found.omnibus if one.outcome.p is not None), found.omnibus[0])
        yield (
            f"Each statement was tested by {test_name(one.outcome)} ({one.outcome.method}), with "
            f"{one.outcome.effect_name} as the effect, {_families(found.omnibus)}."
        )
    if found.pairs:
        yield (
            "Where these showed a difference, pairs were compared by Wilcoxon's signed ranks (exact; equal pairs left "
            "out) with the matched rank-biserial correlation, Holm-adjusted over all pairs of all these statements."
        )
    if found.named is not None:
        yield (
            "A participant was taken to have named the liquid whose statement he or she rated highest; equal highest "
            "ratings are undecided and count as no hit. Hits were tested against exchanging the liquids within "
            "participants (exact, one-sided)."
        )


def _families(tests: Sequence[Tested]) -> str:
    """Return what is corrected together: primary statements, and apart from them the exploratory ones."""
    families = sorted({(not one.primary, one.members, one.correction) for one in tests})
    told = [
        f"over {counted(members, 'statement')} by {correction}"
        + ("" if len(families) == 1 else " (exploratory)" if exploratory else " (primary)")
        for exploratory, members, correction in families
    ]
    return f"p adjusted {listed(told)}"


def _delays(found: BlockFound, results: Results) -> Iterator[str]:
    if not found.delays_ms:
        yield from _liquids(found)
        return
    if found.trends:
        one = next((one for one in found.trends if one.outcome.p is not None), found.trends[0])
        yield (
            f"Trends over the delay were tested by Page's L ({one.outcome.method.split(',')[0]}), one-sided in the "
            f"direction stated {'beforehand' if results.decided.binding else 'by the protocol'}, "
            f"{_families(found.trends)}; where a trend showed, the longest delay was dropped and the test repeated "
            "until it no longer did, which gives an upper bound of the lowest delay that is noticed (every step at "
            "alpha over the number of statements, so that the error rate holds over all of them)."
        )
    if found.against:
        bound, level = found.against[0].found.bound, percent(1 - 2 * results.decided.alpha)
        points = "point" if bound == 1 else "points"
        yield (
            f"Equivalence to {found.delays_ms[0]:g} ms was tested by two one-sided t tests on paired differences with "
            f"a bound of ±{bound:g} {points}{_beforehand(results)}, and {level} intervals, and called equivalent only "
            "where changes of signs, signed ranks and the bootstrap-t agreed, and with "
            f"{least(results.decided.alpha)}; it was called different where "
            "the larger p of a t test and of exact signed ranks, Holm-adjusted over all these comparisons, was at most "
            "alpha, and otherwise inconclusive."
        )
    if found.threshold is not None:
        yield (
            "The detection threshold is the 50 % point between guesses and lapses of a logistic function fitted by "
            "maximum likelihood to agreement (5 to 7) in single answers, all participants pooled, with a profile "
            "interval that is scaled by how far participants differ. It is stated only where a permutation test "
            "against a flat line shows a rise, and where it lies among the delays that were presented."
        )


def _beforehand(results: Results) -> str:
    """Say that a decision came before the data, where all sessions kept to it."""
    return ", decided before the first session" if results.decided.binding else ""


def _common(results: Results, blocks: list[BlockFound]) -> Iterator[str]:
    decided = results.decided
    if decided.binding:
        which = "all statements were primary" if not decided.primary else f"primary: {', '.join(decided.primary)}"
        yield (
            f"Decided before the first session: alpha = {decided.alpha:g}, {which}; different questions are not "
            "corrected for each other."
        )
    elif decided.made:
        yield (
            "The decisions about the analysis changed between sessions: all results are exploratory, by the decisions "
            f"of the first session (alpha = {decided.alpha:g})."
        )
    else:
        yield f"Nothing was decided beforehand: all results are exploratory, at {decided.alpha:g}."
    if any(found.mixed for found in blocks):
        yield (
            "As a check, answers were fitted by cumulative logit models with a random intercept for each participant "
            "(adaptive quadrature, likelihood ratio)."
        )
    again = " and Skillings and Mack's test uses those who missed some" if any(f.incomplete for f in blocks) else ""
    yield (
        "Missing answers were never replaced; tests over several settings use participants who answered under all of "
        f"them, comparisons of two those who answered under both{again}."
    )
    measured = results.performance
    if measured is not None and measured.recorded:
        yield (
            "Movement times run from the lighting of a target to the entry that was held, from recordings at the rate "
            "of the servo, the first reach of each trial left out."
        )
