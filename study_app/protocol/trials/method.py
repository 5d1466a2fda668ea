"""What every method has: how many slots a track has, and the level of each."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, TypeAlias

from pydantic import Field

from study_app.protocol.streams import Draw
from study_app.protocol.table import Table
from study_app.protocol.trials.designs import Design
from study_app.protocol.trials.psychometric import Assumed, assumed_for
from study_app.protocol.trials.stimuli import Stimulus

if TYPE_CHECKING:
    from numpy.random import Generator

    from study_app.psychophysics.families import Floats
    from study_app.psychophysics.simulated_tracks import Answers, Observers

TrackOrder: TypeAlias = Literal["interleaved", "blocked"]
Answer: TypeAlias = tuple[float, bool]
"""The level of a comparison, and whether the answer was a success."""


@dataclass(frozen=True, slots=True)
class TrackSetting:
    """What a method chooses levels for.

    Attributes
    ----------
    stimulus : Stimulus
        What is varied.
    design : Design
        How a trial is built.
    number : int
        Which of the tracks of its standard, from 1.
    """

    stimulus: Stimulus
    design: Design
    number: int


@dataclass(frozen=True, slots=True, repr=False)
class Heard:
    """One answered trial: its last attempt, confirmed; never printed, since it reveals a level.

    Attributes
    ----------
    trial : int
        The trial's number in the session.
    code : str
        The code of its track.
    level : float
        The level that was presented.
    success : bool or None
        Whether the answer was correct; for yes–no whether it was yes; "comparison chosen" where no answer is correct;
        None where the answer enters no psychometric function.
    correct : bool or None
        Whether the answer was correct; None where no answer is.
    catch : bool
        Whether it was a catch trial: no level follows from its answer.
    noise : bool
        Whether it presented the standard alone, so that it has no level of its own.
    """

    trial: int
    code: str
    level: float
    success: bool | None
    correct: bool | None
    catch: bool = False
    noise: bool = False


class Method(Table):
    """How the levels of a track are chosen: the keys that all kinds share, and what each kind must say.

    A kind is a module of ``methods`` with a subclass whose ``kind`` is a ``Literal`` with a default.
    """

    if TYPE_CHECKING:
        kind: str

    order: TrackOrder = Field(
        default="interleaved",
        description="interleaved: the tracks alternate in random order; blocked: one follows another.",
    )

    tracks: Annotated[int, Field(ge=1, le=4)] = Field(default=1, description="How many tracks each standard has.")

    adaptive: ClassVar[bool] = True
    """Whether answers choose the next level."""
    adjusts: ClassVar[bool] = False
    """Whether its levels are those at which settings start, so that the design must be "adjustment"."""

    @property
    def name(self) -> str:
        """Its kind."""
        return self.kind

    @property
    def paper_name(self) -> str:
        """What a paper calls it, with its source."""
        return self.kind

    @abstractmethod
    def presentations(self, stimulus: Stimulus) -> int:
        """Return how many comparisons one track presents at most."""

    @abstractmethod
    def asked(self, stimulus: Stimulus) -> tuple[float, ...]:
        """Return levels that include the smallest and the largest that it can present."""

    @abstractmethod
    def level(self, track: TrackSetting, number: int, heard: Sequence[Heard], draws: Sequence[Draw]) -> float:
        """Return the level of a track's comparison ``number`` (from 0), where the track has not ended.

        Parameters
        ----------
        track : TrackSetting
            What is varied, and how it is asked.
        number : int
            Which comparison of the track.
        heard : sequence of Heard
            The track's earlier answers, in the order of presentation.
        draws : sequence of callable
            Secret uniform numbers in [0, 1), one source per round of levels.
        """

    def assumed(self, stimulus: Stimulus, design: Design) -> Assumed:
        """Return what is assumed about the psychometric function of its answers."""
        return assumed_for(stimulus, design)

    def ended(self, track: TrackSetting, heard: Sequence[Heard]) -> bool:
        """Return whether a track has ended with these answers, before its last trial."""
        return False

    def faults(self, stimulus: Stimulus) -> Iterator[tuple[str, str, str]]:
        """Yield what is wrong with it for a stimulus: the key, a message and a hint."""
        return iter(())

    def warnings(self) -> Iterator[tuple[str, str]]:
        """Yield what is permitted and may still be a mistake: the key and a sentence."""
        return iter(())

    def target(self, guess: float | None, success: str) -> str | None:
        """Return in words which share of successes its levels aim at; None: at none.

        Parameters
        ----------
        guess : float or None
            The share of successes by guessing, 0 where no answer is correct; None: it is free.
        success : str
            What is counted, such as "correct".
        """
        return None

    @property
    def target_percent(self) -> float | None:
        """The percentage of successes at the mean of its reversals; None where it has no steps."""
        return None

    def reversals(self, track: TrackSetting, answers: Sequence[Answer]) -> tuple[int, ...]:
        """Return the places, from 0, of a track's answers at which its direction changed; none if it has no steps."""
        return ()

    def reversal_mean(self, track: TrackSetting, answers: Sequence[Answer]) -> float | None:
        """Return the classical estimate of a track, a level; None where it has none."""
        return None

    def simulated(
        self, track: TrackSetting, observers: Observers, random: Generator, noise: Floats | None
    ) -> Answers | None:
        """Return the answers of simulated observers to one track each; None: the method has no such tracks.

        Parameters
        ----------
        track : TrackSetting
            What is varied, and how it is asked.
        observers : Observers
            Who answers.
        random : random.Generator
            Where their answers are drawn from.
        noise : (tracks, noise trials) array or None
            The uniform numbers of the answers to noise trials.
        """
        return None

    def rounds(self, stimulus: Stimulus) -> int:
        """Return how many rounds of drawn levels a track has."""
        return 0
