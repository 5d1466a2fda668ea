"""How precise d′, d_a of ratings and the exponents of magnitude estimation are expected to be.

Simulated participants answer the block's trials, and the estimates are those of the report. People differ by a factor
of `BETWEEN_PEOPLE`, as their thresholds do, and the group's interval is that of the mean by Student's t.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Final, TypeAlias

from study_app.protocol.blocks import Block
from study_app.protocol.model import Protocol
from study_app.protocol.trials.designs import Design, Rated
from study_app.protocol.trials.stimuli import rises
from study_app.protocol.trials.tracks import (
    design_of,
    has_correct_answer,
    method_of,
    standards_of,
    stimulus_of,
    tracks_of,
)

if TYPE_CHECKING:
    from numpy.random import Generator

    from study_app.psychophysics.families import Floats
    from study_app.psychophysics.precision import Expected

D_PRIME: Final = 1.0
"""Of simulated participants. [choice]"""
EXPONENT: Final = 0.5
"""Of simulated participants, where no exponent was published; as the answers of rehearsals. [choice]"""
OBSERVERS: Final = 1000
SEED: Final = 1
Z_95: Final = 1.959964


@dataclass(frozen=True)
class SensitivityPlan:
    """What decides how precise d′ is: of one compared condition, or of one standard.

    Attributes
    ----------
    design : Design
        How trials are built; answers to it can be correct.
    trials : int
        Of each condition or standard.
    roving : bool
        Whether standards alternate, so that intervals can only be compared with each other.
    of_each : str
        What has so many trials: "comparison" or "standard".
    """

    design: Design
    trials: int
    roving: bool
    of_each: str
    value: ClassVar[float] = D_PRIME

    @property
    def words(self) -> str:
        """What is assumed, in words."""
        return f"at d′ = {self.value:g}: "

    @property
    def per(self) -> str:
        """The words for what the number of trials counts for."""
        return f" per {self.of_each}"

    def with_trials(self, trials: int) -> SensitivityPlan:
        """Return the plan with so many trials."""
        return replace(self, trials=trials)

    def estimates(self, truth: Floats, random: Generator) -> Floats:
        """Return d′ as the report estimates it, of unbiased observers.

        Parameters
        ----------
        truth : (observers,) array
            Their d′.
        random : random.Generator
            Where answers are drawn from.
        """
        import numpy as np  # noqa: PLC0415

        design, count = self.design, len(self.design.arrangements)
        trials = [self.trials // count + (place < self.trials % count) for place in range(count)]
        correct = [str(design.correct(place)) for place in range(count)]
        wrong = [next(one for one in design.answers if one != right) for right in correct]
        found = []
        for d_prime in truth:
            rights = random.binomial(trials, design.proportion_correct(float(d_prime), roving=self.roving))
            answers = {(place, correct[place]): int(right) for place, right in enumerate(rights)}
            answers |= {(place, wrong[place]): trials[place] - int(right) for place, right in enumerate(rights)}
            sensitivity = design.sensitivity(answers, roving=self.roving)
            found.append(math.nan if sensitivity is None else sensitivity.d_prime)
        return np.array(found)


@dataclass(frozen=True)
class EstimationPlan:
    """What decides how precise the exponent of magnitude estimation is.

    Attributes
    ----------
    levels : tuple of float
        That are presented, all above zero.
    repetitions : int
        Of each level.
    value : float
        The exponent of simulated participants.
    """

    levels: tuple[float, ...]
    repetitions: int
    value: float
    per: ClassVar[str] = ""

    @property
    def trials(self) -> int:
        """Trials of a participant that are analysed."""
        return len(self.levels) * self.repetitions

    @property
    def words(self) -> str:
        """What is assumed, in words."""
        return f"exponent of {self.value:g}: "

    def with_trials(self, trials: int) -> EstimationPlan:
        """Return the plan with so many trials, rounded to repetitions of all levels."""
        return replace(self, repetitions=max(1, round(trials / len(self.levels))))

    def estimates(self, truth: Floats, random: Generator) -> Floats:
        """Return exponents as the report estimates them: least-squares slopes of mean ln answers on ln level.

        Parameters
        ----------
        truth : (observers,) array
            Their exponents.
        random : random.Generator
            Where answers are drawn from.
        """
        import numpy as np  # noqa: PLC0415

        from study_app.psychophysics.precision import ESTIMATE_NOISE  # noqa: PLC0415

        x = np.log(self.levels)
        means = truth[:, None] * x + random.normal(
            0.0, ESTIMATE_NOISE / math.sqrt(self.repetitions), (len(truth), len(x))
        )
        return np.asarray((means @ (x - x.mean())) / ((x - x.mean()) ** 2).sum(), float)


@dataclass(frozen=True)
class RatingPlan:
    """What decides how precise d_a of one level against the lowest is.

    Attributes
    ----------
    points : int
        Of the scale.
    trials : int
        Ratings of each level.
    """

    points: int
    trials: int
    per: ClassVar[str] = " per level"
    value: ClassVar[float] = D_PRIME

    @property
    def words(self) -> str:
        """What is assumed, in words."""
        return f"at d_a = {self.value:g}: "

    def with_trials(self, trials: int) -> RatingPlan:
        """Return the plan with so many trials."""
        return replace(self, trials=trials)

    def estimates(self, truth: Floats, random: Generator) -> Floats:
        """Return d_a as the report estimates it, of observers who use all points of the scale about equally often.

        A rating is the number of criteria that a normal observation exceeds. The criteria divide a normal distribution
        with the mean and the standard deviation of both levels' observations at `value` into equal shares.

        Parameters
        ----------
        truth : (observers,) array
            Their d_a.
        random : random.Generator
            Where answers are drawn from.
        """
        import numpy as np  # noqa: PLC0415

        from study_app.psychophysics.detection import NORMAL, rating  # noqa: PLC0415

        spread = math.sqrt(1.0 + (self.value / 2.0) ** 2)
        shares = [point / self.points for point in range(1, self.points)]
        criteria = [self.value / 2.0 + spread * NORMAL.inv_cdf(share) for share in shares]
        found = []
        for d_a in truth:
            lowest, level = (np.searchsorted(criteria, random.normal(mean, 1.0, self.trials)) for mean in (0.0, d_a))
            sensitivity = rating(lowest, level)
            found.append(math.nan if sensitivity is None else sensitivity.d_prime)
        return np.array(found)


MeanPlan: TypeAlias = SensitivityPlan | EstimationPlan | RatingPlan


def mean_plan(protocol: Protocol, block: Block) -> MeanPlan | None:
    """Return what decides how precise the d′, d_a or exponents of a block are; None where it has none of them."""
    if block.design is None or block.phase != "main":
        return None
    design = design_of(protocol, block).model_copy(update={"question": None})  # a dictionary has no hash
    slots = tracks_of(protocol, block)[0].slots
    if block.stimulus is None:
        choice = design.reply == "choice" and not design.has_noise
        return SensitivityPlan(design, slots, roving=False, of_each="comparison") if choice else None
    stimulus, method = stimulus_of(protocol, block), method_of(protocol, block)
    if design.reply == "number":
        levels = tuple(sorted({one for one in method.asked(stimulus) if one > 0}))
        repetitions = method.tracks * method.presentations(stimulus) // len(method.asked(stimulus))
        return EstimationPlan(levels, repetitions, _published(protocol, block)) if len(levels) > 1 else None
    if isinstance(design, Rated) and len(method.asked(stimulus)) > 1 and len(standards_of(protocol, block)) == 1:
        repetitions = method.tracks * method.presentations(stimulus) // len(method.asked(stimulus))
        return RatingPlan(protocol.scales[design.scale].points, repetitions)
    if design.reply == "choice" and has_correct_answer(design, stimulus) and not rises(stimulus, design):
        roving = len(standards_of(protocol, block)) > 1 and method.order == "interleaved"
        return SensitivityPlan(design, slots * method.tracks, roving, of_each="standard")
    return None


def _published(protocol: Protocol, block: Block) -> float:
    """Return the exponent that the protocol compares a block's with, else `EXPONENT`."""
    published = () if protocol.analysis is None else protocol.analysis.published
    return next((one.value for one in published if (one.block, one.measure) == (block.id, "exponent")), EXPONENT)


def expected_mean(plan: MeanPlan) -> Expected:
    """Return how precise the d′, d_a or exponent of one participant, and their mean, are expected to be."""
    import numpy as np  # noqa: PLC0415

    from study_app.psychophysics.precision import Expected  # noqa: PLC0415

    found = plan.estimates(np.full(OBSERVERS, plan.value), np.random.default_rng(SEED))
    spread = float(found.std())
    return Expected("linear", plan.trials, standards=1, half=Z_95 * spread, spread=spread, threshold=plan.value)
