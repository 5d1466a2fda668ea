"""What a study is in numbers: how long a session takes, and the force of its liquids."""

from __future__ import annotations

from dataclasses import dataclass

from study_app.authoring.facts import Facts
from study_app.authoring.names import Document
from study_app.authoring.outline import title_of
from study_app.protocol.source.document import entries
from study_app.viewmodels.number_words import minutes
from study_app.viewmodels.tones import Tone

UNKNOWN = "–"


@dataclass(frozen=True, slots=True)
class ForceLine:
    """A liquid, its force in words, its share of the force limit (0 to 1), and whether the limit clips it."""

    title: str
    force: str
    share: float
    clipped: bool


@dataclass(frozen=True, slots=True)
class FactCards:
    """The cards of facts.

    Attributes
    ----------
    figures : tuple of (str, str)
        Numbers of the session, each with its word; "–" where they are not known.
    texts : tuple of (str, str, str)
        Tone, icon and words: whether every text is there in every language.
    limit : str
        The force limit in words.
    forces : tuple of ForceLine
        The liquids.
    """

    figures: tuple[tuple[str, str], ...] = ()
    texts: tuple[Tone, str, str] = ("neutral", "ring", "")
    limit: str = ""
    forces: tuple[ForceLine, ...] = ()


def fact_cards(facts: Facts, document: Document) -> FactCards:
    """Return the cards of a study's facts; numbers of a study with faults are not known."""
    known = facts.expected_s is not None
    duration = minutes(facts.expected_s) if facts.expected_s is not None else UNKNOWN
    counts = ((facts.trials, "trials"), (facts.answers, "answers"), (facts.breaks, "breaks"))
    figures = ((duration, "expected"), *((str(count) if known else UNKNOWN, word) for count, word in counts))
    missing = ", ".join(f"{count} in {language}" for language, count in facts.missing.items())
    texts: tuple[Tone, str, str] = ("bad", "warning", f"Missing texts: {missing}")
    if not missing:
        texts = ("ok", "check", "Every text in every language")
    limit = next((value for _, value in entries(document, "device.force_limit_n")), None)
    if not known or not isinstance(limit, int | float) or limit <= 0:
        return FactCards(figures, texts)
    forces = tuple(
        ForceLine(title_of(document, ("liquids", name)), f"{force:.2f} N", min(1.0, force / limit), force >= limit)
        for name, force in facts.forces_n.items()
    )
    return FactCards(figures, texts, f"at 0.1 m/s, limit {limit:g} N", forces)
