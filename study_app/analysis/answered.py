"""The tests of one block's answers: which apply, in which families, and why others are not there."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pandas as pd

from study_app.analysis.decided import Decided
from study_app.analysis.judging import alone, judged
from study_app.analysis.measures import Array, by_participant
from study_app.analysis.questions import Block
from study_app.analysis.results import BlockFound, Tested, Waiting
from study_app.analysis.statistics.friedman import DRAWN_UP_TO, friedman
from study_app.analysis.statistics.global_permutation import global_permutation
from study_app.analysis.statistics.missing import skillings_mack
from study_app.analysis.statistics.ordinal import ordinal
from study_app.analysis.statistics.outcome import DRAWS, FEW, Outcome, told
from study_app.analysis.statistics.paired import paired
from study_app.analysis.tables import Study

SEALED: Final = "after unblinding: the key is sealed, and this needs to know which setting is which"
MANY: Final = DRAWN_UP_TO
"""Above so many participants p of single statements is approximated, and no mixed model is fitted."""

FEWER_DRAWS: Final = 1999
"""So many rearrangements are drawn for the test over all statements above ``MANY``, which has no approximation."""

MOST_DRAWS: Final = 199_999
FLOOR: Final = 0.05
"""The smallest p that draws can give, corrected for its family, is this share of alpha at most."""


@dataclass(frozen=True)
class Asked:
    """A block's answers as arrays (participants, settings), settings in their order; NaN where one is missing."""

    block: Block
    decided: Decided
    people: tuple[str, ...]
    values: Mapping[str, Array]
    seed: int
    each: Callable[[str], object]

    @property
    def n(self) -> int:
        """How many participants answered anything."""
        return len(self.people)

    @property
    def k(self) -> int:
        """How many settings there are."""
        return len(self.block.codes)

    @property
    def draws(self) -> int:
        """How many rearrangements are drawn for one statement where not all can be gone through.

        So many that their number never decides whether something can be shown.
        """
        return self._draws(DRAWS, len(self.block.items))

    @property
    def draws_over_all(self) -> int:
        """How many are drawn for the one test over all statements."""
        return self._draws(DRAWS if self.n <= MANY else FEWER_DRAWS, 1)

    def _draws(self, usual: int, members: int) -> int:
        return min(MOST_DRAWS, max(usual, math.ceil(members / (FLOOR * self.decided.alpha))))


def asked(study: Study, block: Block, seed: int, each: Callable[[str], object]) -> Asked:
    """Collect a block's answers; ``each`` is told every statement that is begun."""
    answers = study.answers(block)
    people = tuple(sorted(map(str, answers["participant"].unique())))
    by_item = dict(iter(answers.groupby("item", sort=False)))
    empty = answers.iloc[:0]
    values = {
        item.id: by_participant(by_item.get(item.id, empty), people, block.codes, item.id) for item in block.items
    }
    return Asked(block, study.decided, people, values, seed, each)


def head(study: Study, of: Asked) -> dict[str, Any]:
    """Return what every block's finding says: settings, statements, counts."""
    block = of.block
    return {
        "id": block.id,
        "title": block.title,
        "kind": block.kind,
        "revealed": block.revealed,
        "n": of.n,
        "settings": block.settings,
        "names": tuple(block.name(setting) for setting in block.settings),
        "items": block.items,
        "labels": block.labels,
        "measures": tuple(
            {str(name): None if pd.isna(value) else value for name, value in row.items()}
            for row in study.aggregate(block).to_dict("records")
        ),
    }


def sealed(study: Study, of: Asked) -> BlockFound:
    """Return what may be known before the key is opened: counts, and whether settings differ at all, by code."""
    waiting = ["comparison of two settings", "test over all statements", "test of recognition"]
    if of.block.kind == "delays":
        waiting = ["test of a trend (Page)", "lowest delay that shows", "test of equivalence", "detection threshold"]
    omnibus, absent = compared(of)
    return BlockFound(
        **head(study, of), omnibus=omnibus, absent=(*absent, *(Waiting(what, SEALED) for what in waiting))
    )


def compared(of: Asked) -> tuple[tuple[Tested, ...], tuple[Waiting, ...]]:
    """Test in every statement whether the settings are answered alike."""
    if of.k < 2:
        return (), (Waiting("test of settings", "the block has one setting: there is nothing to compare it with"),)
    return judged(_each(of, lambda values: _omnibus(values, of)), of.decided, f"{of.block.id}: settings differ"), ()


def _omnibus(values: Array, of: Asked) -> Outcome:
    if of.k == 2:
        return paired(values[:, 0], values[:, 1])
    return friedman(values, draws=of.draws, seed=of.seed)


def over_all(of: Asked) -> Outcome | None:
    """Test once over all statements whether the settings are answered alike."""
    if of.k < 2:
        return None
    of.each("all statements")
    return global_permutation(np.array(list(of.values.values())), draws=of.draws_over_all, seed=of.seed)


def asked_again(
    of: Asked, columns: Array | None, what: str
) -> tuple[tuple[Tested, ...], tuple[Tested, ...], tuple[Waiting, ...]]:
    """Return the same questions under other assumptions: the mixed model, and with missing answers; and what is not.

    ``columns`` (settings, columns) are what the mixed model tests, ``what`` names it.
    """
    absent = []
    mixed: tuple[Tested, ...] = ()
    reason = _no_model(of)
    if reason:
        absent.append(Waiting(f"mixed model of {what}", reason))
    else:
        models = _each(of, lambda values: ordinal(values, columns))
        mixed = tuple(alone(model, item, of.decided, f"{of.block.id}: mixed model") for item, model in models.items())
    gaps = {item: values for item, values in of.values.items() if np.isnan(values).any()}
    incomplete: tuple[Tested, ...] = ()
    if gaps and of.k >= 3:
        incomplete = tuple(
            alone(
                skillings_mack(values, draws=of.draws, seed=of.seed),
                item,
                of.decided,
                f"{of.block.id}: with missing answers",
            )
            for item, values in gaps.items()
        )
    elif gaps:
        absent.append(Waiting("test with incomplete participants", "it needs three settings"))
    return mixed, incomplete, tuple(absent)


def _no_model(of: Asked) -> str:
    if of.k < 2:
        return "there is one setting"
    if of.n < FEW:
        return f"with {told(of.n)}, below {FEW}, its estimates and errors would not hold"
    if of.n > MANY:
        return f"it is left out above {MANY} participants, where it takes minutes"
    return ""


def _each(of: Asked, test: Callable[[Array], Outcome]) -> dict[str, Outcome]:
    found = {}
    for item in of.block.items:
        of.each(item.short)
        found[item.id] = test(of.values[item.id])
    return found
