"""From p to what may be said: families, corrections, and what so few participants could not have shown at all."""

from collections.abc import Callable, Mapping, Sequence
from typing import Final, TypeAlias

from study_app.analysis.results.item_test import Tested, Verdict
from study_app.analysis.statistics.multiple_comparisons import false_discovery, holm
from study_app.analysis.statistics.outcome import Outcome
from study_app.analysis.tables.planned_analysis import Decided

Correct: TypeAlias = Callable[[Sequence[float | None]], tuple[float | None, ...]]

HOLM: Final = "Holm"
FDR: Final = "Benjamini-Hochberg"
ALONE: Final = "none"


def judged(outcomes: Mapping[str, Outcome], decided: Decided, family: str) -> tuple[Tested, ...]:
    """Return the tests of statements (item → outcome): primary ones as a Holm family, the others exploratory by FDR."""
    primary = {item: outcome for item, outcome in outcomes.items() if decided.is_primary(item)}
    others = {item: outcome for item, outcome in outcomes.items() if item not in primary}
    found = {
        **{one.item: one for one in in_family(primary, decided.alpha, family, holm, HOLM, primary=True)},
        **{
            one.item: one
            for one in in_family(others, decided.alpha, f"{family}, exploratory", false_discovery, FDR, primary=False)
        },
    }
    return tuple(found[item] for item in outcomes)


def in_family(
    outcomes: Mapping[str, Outcome],
    alpha: float,
    family: str,
    correct: Correct,
    correction: str,
    *,
    primary: bool | Sequence[bool],
) -> tuple[Tested, ...]:
    """Return tests that are corrected together; ``primary``: all of them, or for each whether it is."""
    of_primary = [primary] * len(outcomes) if isinstance(primary, bool) else primary
    ps = [outcome.p for outcome in outcomes.values()]
    found = []
    for place, ((item, outcome), p) in enumerate(zip(outcomes.items(), correct(ps), strict=True)):
        least = correct([*ps[:place], outcome.smallest_p, *ps[place + 1 :]])[place]
        said = verdict(p, least, alpha, primary=of_primary[place])
        found.append(Tested(item, outcome, family, len(ps), correction, p, of_primary[place], said))
    return tuple(found)


def alone(outcome: Outcome, item: str, decided: Decided, family: str) -> Tested:
    """Return a test that asks again what another one asked: it is not corrected, and never more than exploratory."""
    said = verdict(outcome.p, outcome.smallest_p, decided.alpha, primary=False)
    return Tested(item, outcome, family, 1, ALONE, outcome.p, False, said)


def verdict(p: float | None, least: float | None, alpha: float, *, primary: bool) -> Verdict:
    """Return what may be said of a test.

    Parameters
    ----------
    p, least : float, optional
        The adjusted p, and the one that these participants could have given at least (None: no bound), the other tests
        of the family being as they are.
    """
    if p is None:
        return "not tested"
    if p <= alpha:
        return "shown" if primary else "suggested"
    return "out of reach" if least is not None and least > alpha else "not shown"
