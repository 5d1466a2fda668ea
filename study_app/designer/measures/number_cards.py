"""The cards of the tab Measures: frozen values that windows draw; "–" stands for a number that is not known."""

from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from study_app.gui.theme.theme import Tone
from study_app.protocol.source.document import Path

UNKNOWN: Final = "–"
Limit: TypeAlias = Literal["norm", "slope"]
LIMIT_NAMES: Final[dict[Limit, str]] = {"norm": "force limit", "slope": "slope limit"}
ANEW: Final = "simulating …"
EARLIER: Final = "These numbers are of the last valid state: solve the problems to update them."
NO_FORCES: Final = "Not known until the problems of device and scene are solved."
ON_AVERAGE: Final = "The warning of check is about the precision that the planned participants reach on average"
Verdict: TypeAlias = tuple[Tone, str, str]
"""Tone, icon and words."""
FAILED: Final[Verdict] = ("bad", "warning", "simulation failed")
Segment: TypeAlias = tuple[str, float, bool, Path]
"""Words, share of the time, whether it is looked at, and the element."""
Ticks: TypeAlias = tuple[tuple[float, str], ...]
Values: TypeAlias = tuple[float, ...]


def people(participants: int, planned: int | None) -> str:
    """Return a number of participants that are simulated, and whether the file plans as many."""
    return f"{participants} {'planned' if participants == planned else 'simulated'}"


@dataclass(frozen=True, slots=True)
class NumberCard:
    """One number: its title, the number, its unit, its verdict or a note, and a sentence below it.

    ``simulated`` says that it is grey while another one is simulated.
    """

    title: str
    number: str
    unit: str = ""
    note: Verdict = ("neutral", "", "")
    more: str = ""
    simulated: bool = True


@dataclass(frozen=True, slots=True)
class SessionCard:
    """A session in numbers.

    Attributes
    ----------
    title : str
        Its heading.
    figures : tuple of (str, str)
        Numbers with their words.
    aside : str
        The shortest and the longest session.
    segments : tuple of (str, float, bool, path)
        Each step with its share of the time, whether it is the one that is looked at, and its element.
    notes : tuple of (str, str)
        What is written under the bar: left and right.
    verdicts : tuple of (str, str, str)
        What is right or wrong with it.
    """

    title: str
    figures: tuple[tuple[str, str], ...]
    aside: str = ""
    segments: tuple[Segment, ...] = ()
    notes: tuple[str, ...] = ()
    verdicts: tuple[Verdict, ...] = ()


@dataclass(frozen=True, slots=True)
class BalanceCard:
    """How even the orders of a block are.

    Attributes
    ----------
    block : str
        Title of the block.
    people : str
        Over how many participants, and whether they are planned.
    codes : tuple of str
        The columns of both tables.
    positions, follows : tuple of tuple of int
        Rows of counts: of each position, and after each code.
    hidden : int
        How many rows of positions are not shown.
    verdict : (str, str, str)
        Whether it is even, or with how many participants.
    """

    block: str
    people: str
    codes: tuple[str, ...]
    positions: tuple[tuple[int, ...], ...]
    follows: tuple[tuple[int, ...], ...]
    hidden: int
    verdict: Verdict


@dataclass(frozen=True, slots=True)
class Line:
    """A line with a bar: its title, its number in words, its share (0 to 1), and its verdict where it has an icon."""

    title: str
    number: str
    share: float
    verdict: Verdict = ("neutral", "", "")


@dataclass(frozen=True, slots=True)
class LinesCard:
    """Lines with bars, with a sentence below them; those that are ``simulated`` are grey while others are simulated."""

    title: str
    aside: str
    lines: tuple[Line, ...]
    sentences: tuple[Verdict, ...] = ()
    waiting: str = ""


@dataclass(frozen=True, slots=True)
class FunctionPlot:
    """The psychometric function of planted observers; places along x are in the coordinate of the levels.

    Attributes
    ----------
    heading : str
        What is drawn over what, with units.
    span : tuple of float
        The smallest and the largest level.
    x : tuple of float
        Where the curves are given.
    planted : tuple of float
        The planted function [%].
    found : tuple of tuple of float
        The functions through the 5, 25, 50, 75 and 95 % quantiles of the thresholds found [%].
    asked : tuple of (float, float)
        Levels with their share of the trials.
    mark : tuple of float
        The planted threshold and its percentage.
    mark_words : str
        The threshold in words.
    low : float
        The least percentage that is drawn.
    clipped_from : (float, str) or None
        From which level on a limit takes part of the force away, and which.
    ticks_x, ticks_y : tuple of (float, str)
        Where the axes are written at.
    sentence : str
        The plot in a sentence.
    """

    heading: str
    span: tuple[float, float]
    x: Values
    planted: Values
    found: tuple[Values, ...]
    asked: tuple[tuple[float, float], ...]
    mark: tuple[float, float]
    mark_words: str
    low: float
    clipped_from: tuple[float, Limit] | None
    ticks_x: Ticks
    ticks_y: Ticks
    sentence: str


@dataclass(frozen=True, slots=True)
class TrackPlot:
    """The expected track; places along y are in the coordinate of the levels.

    Attributes
    ----------
    heading : str
        What is drawn over what, with units.
    span : tuple of float
        The smallest and the largest level.
    trials : tuple of float
        After how many trials the estimates are given.
    found : tuple of tuple of float
        Their 5, 25, 50, 75 and 95 % quantiles.
    one : tuple of (int, float, int, bool)
        Of one observer: trial, level, track (from 1), success.
    last : int
        The last trial.
    planted : float
        The planted threshold.
    clipped_from : (float, str) or None
        From which level on a limit takes part of the force away, and which.
    ticks_x, ticks_y : tuple of (float, str)
        Where the axes are written at.
    observers : int
        How many there were.
    sentence : str
        The plot in a sentence.
    """

    heading: str
    span: tuple[float, float]
    trials: Values
    found: tuple[Values, ...]
    one: tuple[tuple[int, float, int, bool], ...]
    last: int
    planted: float
    clipped_from: tuple[float, Limit] | None
    ticks_x: Ticks
    ticks_y: Ticks
    observers: int
    sentence: str


@dataclass(frozen=True, slots=True)
class ForceBar:
    """The force of a level: as asked, as sent, which limit clips it, and whether it is the standard's [N]."""

    asked_n: float
    sent_n: float
    clipped_by: Limit | None = None
    standard: bool = False


@dataclass(frozen=True, slots=True)
class RepairOffer:
    """A button that repairs a problem: its words, and what `DesignerPlace.repair_asked` carries."""

    words: str
    row: object


@dataclass(frozen=True, slots=True)
class ForcesPlot:
    """The force of each level of one standard.

    Attributes
    ----------
    heading : str
        Unit and speed.
    bars : tuple of ForceBar
        The standard, where there is one, and its levels.
    ticks_x, ticks_y : tuple of (float, str)
        Where the axes are written at; along x bars are counted from 0.
    limit_n : float
        The force limit.
    slope_n : float or None
        What the slope limit of the loop leaves of the force; None where it clips nothing.
    verdicts : tuple of (str, str, str)
        How many levels are as asked, and how many are clipped, of all standards.
    warning : str
        What clips them, "" where nothing does.
    repair : RepairOffer or None
        What repairs it.
    sentence : str
        The plot in a sentence.
    """

    heading: str
    bars: tuple[ForceBar, ...]
    ticks_x: Ticks
    ticks_y: Ticks
    limit_n: float
    slope_n: float | None
    verdicts: tuple[Verdict, ...]
    warning: str
    repair: RepairOffer | None
    sentence: str


@dataclass(frozen=True, slots=True)
class TextsCard:
    """Texts of the study by language, and those that reveal a condition, each with the element that it is in."""

    languages: tuple[Line, ...]
    revealing: tuple[tuple[str, Path], ...]


@dataclass(frozen=True, slots=True)
class BlocksCard:
    """The blocks that use an element: what their measures are, and the block that opens them."""

    title: str
    blocks: tuple[tuple[str, Path], ...]


Card: TypeAlias = SessionCard | BalanceCard | LinesCard | TextsCard | BlocksCard


@dataclass(frozen=True, slots=True)
class ControlValues:
    """The controls at the right of the tabs; the threshold and the lapses are None where none is simulated.

    Attributes
    ----------
    participants : int
        Of each study.
    participants_unit : str
        How many are planned, "" where it is the same number.
    threshold : str or None
        The simulated threshold, as it is written.
    threshold_words, threshold_unit : str
        What it is called, and its unit.
    lapses : str or None
        The simulated lapse rate, in percent.
    """

    participants: int
    participants_unit: str = ""
    threshold: str | None = None
    threshold_words: str = "simulated JND"
    threshold_unit: str = "%"
    lapses: str | None = None


@dataclass(frozen=True, slots=True)
class MeasuresView:
    """What the tab shows: numbers and plots of a block with a method, else cards; and the cards below other tabs.

    Above them it says which ``blocks`` use the element, where it is not a block itself. ``waiting`` is said of numbers
    and plots while others are simulated, ``failed`` where they cannot be; ``earlier`` ones are of the last study
    without faults.
    """

    controls: ControlValues
    numbers: tuple[NumberCard, ...] = ()
    function: FunctionPlot | None = None
    track: TrackPlot | None = None
    forces: ForcesPlot | None = None
    cards: tuple[Card, ...] = ()
    below: tuple[Card, ...] = ()
    waiting: str = ""
    failed: bool = False
    earlier: bool = False
    blocks: BlocksCard | None = None
