"""The tests of one block's answers: which apply, in which families, and what may be said of them."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeAlias, TypeVar

import numpy as np
import pandas as pd

from study_app.analysis.data.blocks import Block, Decided
from study_app.analysis.data.measures import Array, medians, presentations
from study_app.analysis.data.study_tables import Study
from study_app.analysis.results import BlockFound, Failure, Failures, NotTested, Tested, Verdict
from study_app.analysis.statistics.outcome import DRAWS, Outcome, draws_for, false_discovery, holm
from study_app.analysis.statistics.rank_tests import DRAWN_UP_TO

T = TypeVar("T")
U = TypeVar("U")

SEALED: Final = "after unblinding: the key is sealed, and this needs to know which setting is which"
MEASURES: Final = "measures of settings"
COUNTS: Final = "counts of answers"
NUMBERS: Final = "numbers of sessions"

MANY: Final = DRAWN_UP_TO
"""Above so many participants p of single statements is approximated, and no mixed model is fitted."""

FEWER_DRAWS: Final = 1999
"""So many rearrangements are drawn for the test over all statements above ``MANY``, which has no approximation."""


@dataclass(frozen=True)
class Asked:
    """A block's answers as arrays, settings in their order; NaN where one is missing.

    ``values`` (participants, settings) are the medians of ``single`` answers (participants, settings, presentations);
    ``sessions`` of the same shape are the sessions in which these were given. ``sites`` are those of
    the participants of a merged study. ``verdicts_only``: leave out what decides no verdict, for thousands of simulated
    studies.
    """

    block: Block
    decided: Decided
    people: tuple[str, ...]
    values: Mapping[str, Array]
    seed: int
    each: Callable[[str], object]
    failures: Failures
    single: Mapping[str, Array]
    sessions: Mapping[str, Array]
    planning: bool = True
    verdicts_only: bool = False
    sites: tuple[str, ...] = ()

    @property
    def n(self) -> int:
        """How many participants answered anything."""
        return len(self.people)

    @property
    def k(self) -> int:
        """How many settings there are; conditions of one delay are one."""
        return len(set(self.block.columns.values()))

    def attempt(self, what: str, compute: Callable[[], T], empty: U) -> tuple[T | U, tuple[NotTested, ...]]:
        """Return what ``compute`` finds; where it fails ``empty``, and that ``what`` is not there and why."""
        found = self.failures.attempt(what, compute, block=self.block.id)
        return (empty, (NotTested(what, found.why),)) if isinstance(found, Failure) else (found, ())

    @property
    def intervals(self) -> int | None:
        """The seed of bootstrap intervals; None: leave them out."""
        return None if self.verdicts_only else self.seed

    @property
    def draws(self) -> int:
        """How many rearrangements are drawn for one statement where not all can be gone through.

        So many that their number never decides whether something can be shown.
        """
        return draws_for(self.decided.alpha, DRAWS, len(self.block.items))

    @property
    def draws_over_all(self) -> int:
        """How many are drawn for the one test over all statements."""
        return draws_for(self.decided.alpha, DRAWS if self.n <= MANY else FEWER_DRAWS)


def asked(
    study: Study, block: Block, seed: int, each: Callable[[str], object], failures: Failures, *, planning: bool = True
) -> Asked:
    """Collect a block's answers; ``each`` receives every statement that is begun."""
    answers = study.answers(block)
    people = tuple(sorted(map(str, answers["participant"].unique())))
    by_item = dict(iter(answers.groupby("item", sort=False)))
    empty = answers.iloc[:0]
    given = {
        item.id: presentations(by_item.get(item.id, empty), people, block.columns, item.id) for item in block.items
    }
    single = {item: answers_ for item, (answers_, _) in given.items()}
    sessions = {item: numbers for item, (_, numbers) in given.items()}
    found = of_tables(
        block, study.decided, people, single, sessions, seed=seed, each=each, failures=failures, planning=planning
    )
    return replace(found, sites=tuple(map(study.site_of, people))) if study.sites else found


def of_tables(
    block: Block,
    decided: Decided,
    people: tuple[str, ...],
    single: Mapping[str, Array],
    sessions: Mapping[str, Array] | None = None,
    *,
    seed: int = 1,
    each: Callable[[str], object] = str,
    failures: Failures | None = None,
    planning: bool = True,
    verdicts_only: bool = False,
) -> Asked:
    """Return a block's answers from tables of single answers (participants, settings, presentations) of each item.

    Without ``sessions``, arrays of the same shape, all answers are of one session.
    """
    return Asked(
        block,
        decided,
        people,
        {item: medians(answers) for item, answers in single.items()},
        seed,
        each,
        Failures() if failures is None else failures,
        single,
        {item: np.ones_like(answers) for item, answers in single.items()} if sessions is None else sessions,
        planning,
        verdicts_only,
    )


def facts(study: Study | None, answers: Asked) -> BlockFound:
    """Return a block without findings: settings, statements, counts; without a study no measures."""
    block = answers.block
    measures, no_measures = answers.attempt(MEASURES, lambda: _measures(study, block), ())
    counts, no_counts = answers.attempt(COUNTS, lambda: presented(answers.single.values()), (0, 0))
    numbers, no_numbers = answers.attempt(NUMBERS, lambda: session_numbers(answers.sessions.values()), ())
    return replace(
        untested(block),
        n=answers.n,
        measures=measures,
        presentations=counts,
        replicated_ms=_replicated(block),
        sessions=numbers,
        absent=(*no_measures, *no_counts, *no_numbers),
    )


def untested(block: Block, *absent: NotTested) -> BlockFound:
    """Return a block of which nothing was computed."""
    return BlockFound(
        id=block.id,
        title=block.title,
        kind=block.kind,
        revealed=block.revealed,
        n=0,
        settings=block.settings,
        names=tuple(block.name(setting) for setting in block.settings),
        items=block.items,
        labels=block.labels,
        measures=(),
        absent=absent,
    )


def _measures(study: Study | None, block: Block) -> tuple[dict[str, Any], ...]:
    return tuple(
        {str(name): None if pd.isna(value) else value for name, value in row.items()}
        for row in ([] if study is None else study.aggregate(block).to_dict("records"))
    )


def presented(single: Iterable[Array]) -> tuple[int, int]:
    """Return the fewest and the most single answers that a participant gave to one statement on one setting."""
    counts = np.concatenate([(~np.isnan(values)).sum(axis=2).ravel() for values in single] or [np.zeros(0)])
    given = counts[counts > 0]
    return (int(given.min()), int(given.max())) if len(given) else (0, 0)


def session_numbers(sessions: Iterable[Array]) -> tuple[int, ...]:
    """Return the numbers of the sessions in which answers were given."""
    return tuple(sorted({int(one) for numbers in sessions for one in np.unique(numbers[~np.isnan(numbers)])}))


def _replicated(block: Block) -> tuple[float, ...]:
    """Return the delays that were presented under more than one condition."""
    if block.kind != "delays" or not block.revealed:
        return ()
    columns = list(block.columns.values())
    return tuple(delay for place, delay in enumerate(block.delays_ms) if columns.count(place) > 1)


def each_statement(answers: Asked, test: Callable[[Array], Outcome]) -> dict[str, Outcome]:
    """Return the outcomes of a test of every statement's answers (participants, settings), by statement."""
    found = {}
    for item in answers.block.items:
        answers.each(item.short)
        found[item.id] = test(answers.values[item.id])
    return found


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
