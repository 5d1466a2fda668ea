"""The interface's own words on the participant's pages, per language: everything that no protocol writes.

Templates in braces are filled with ``str.format``; where grammar depends on a number there is a method.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from study_app.errors import StudyError
from study_app.protocol.problems import did_you_mean


@dataclass(frozen=True, slots=True)
class Words:
    """One language's words; ``small_numbers`` are the numbers from one as they begin a sentence."""

    language: str

    # progress, at the top of every page of a part
    part: str  # {part} {parts}
    setting: str  # {label}, the trial's name with its number, and {of}

    # pages to read
    continue_: str
    space_key: str
    enter_key: str
    escape_key: str

    # tank
    targets_reached: str
    reached: str  # {reached} {of}
    seconds_left: str  # {seconds}
    continue_in: str  # {seconds}
    continue_now: str
    pause_hint: str

    # questionnaire
    please_answer: str
    press_keys: str
    answered: str  # {done} {of}
    answers_kept: str
    key_answer: str
    key_move: str
    optional: str
    chosen: str
    not_answered: str
    one_missing: str  # {list}
    many_missing: str  # {n} {list}
    and_: str
    small_numbers: tuple[str, ...]

    # pause and force stop
    pause_title: str
    pause_body: str
    pause_held_body: str
    resume: str
    force_off_title: str
    force_off_body: str
    force_held_title: str
    force_held_body: str
    force_on: str

    # trouble
    trouble_title: str
    trouble_body: str

    # ends
    end_title: str
    end_body: str
    ended_early_title: str
    ended_early_body: str

    # before the first page
    window_title: str
    preparing: str

    def joined(self, entries: Sequence[str]) -> str:
        """Return "2", "2 and 5", "2, 5 and 8"."""
        if len(entries) < 2:
            return "".join(entries)
        return f"{', '.join(entries[:-1])} {self.and_} {entries[-1]}"

    def missing(self, numbers: Sequence[int]) -> str:
        """Return the sentence that names the statements (by number, at least one) still without an answer."""
        listed = self.joined([str(number) for number in numbers])
        count = len(numbers)
        if count == 1:
            return self.one_missing.format(list=listed)
        named = self.small_numbers[count - 1] if count <= len(self.small_numbers) else str(count)
        return self.many_missing.format(n=named, list=listed)


_ENGLISH = Words(
    language="en",
    part="Part {part} of {parts}",
    setting="{label} of {of}",
    continue_="Continue",
    space_key="Space",
    enter_key="Enter",
    escape_key="Esc",
    targets_reached="targets reached",
    reached="{reached} of {of}",
    seconds_left="{seconds} s left",
    continue_in="You can go on in {seconds} s",
    continue_now="Press the space bar to go on",
    pause_hint="Pause · hold to switch the force off",
    please_answer="Please answer",
    press_keys="press 1 to 7",
    answered="{done} of {of} answered",
    answers_kept="Everything you have answered is kept.",
    key_answer="answer",
    key_move="move",
    optional="optional",
    chosen="chosen",
    not_answered="not answered",
    one_missing="One statement still needs an answer: {list}.",
    many_missing="{n} statements still need an answer: {list}.",
    and_="and",
    small_numbers=("One", "Two", "Three", "Four", "Five", "Six", "Seven", "Eight", "Nine", "Ten"),
    pause_title="Pause",
    pause_body="Take your time. Everything you have answered is kept. A trial that was under way starts again.",
    pause_held_body="Please wait; the operator will go on. Everything you have answered is kept.",
    resume="Continue",
    force_off_title="The force is off",
    force_off_body="The device no longer pushes. When you are ready, the force comes back gently.",
    force_held_title="The operator has switched the force off.",
    force_held_body="Please wait; the operator will bring it back.",
    force_on="Bring the force back and continue",
    trouble_title="One moment, please",
    trouble_body="The force is off and your answers are kept. The operator will help; there is nothing you have to do.",
    end_title="Thank you",
    end_body="The session is complete. You can let go of the device.",
    ended_early_title="The session has ended",
    ended_early_body="You can let go of the device. Thank you for your time.",
    window_title="Study",
    preparing="One moment, the session is being prepared …",
)

_DUTCH = Words(
    language="nl",
    part="Deel {part} van {parts}",
    setting="{label} van {of}",
    continue_="Verder",
    space_key="Spatie",
    enter_key="Enter",
    escape_key="Esc",
    targets_reached="doelen bereikt",
    reached="{reached} van {of}",
    seconds_left="nog {seconds} s",
    continue_in="U kunt verder over {seconds} s",
    continue_now="Druk op de spatiebalk om verder te gaan",
    pause_hint="Pauze · ingedrukt houden om de kracht uit te schakelen",
    please_answer="Nog te beantwoorden",
    press_keys="druk op 1 tot en met 7",
    answered="{done} van {of} beantwoord",
    answers_kept="Alles wat u hebt geantwoord blijft bewaard.",
    key_answer="antwoorden",
    key_move="verplaatsen",
    optional="niet verplicht",
    chosen="gekozen",
    not_answered="niet beantwoord",
    one_missing="Eén uitspraak heeft nog een antwoord nodig: {list}.",
    many_missing="{n} uitspraken hebben nog een antwoord nodig: {list}.",
    and_="en",
    small_numbers=("Eén", "Twee", "Drie", "Vier", "Vijf", "Zes", "Zeven", "Acht", "Negen", "Tien"),
    pause_title="Pauze",
    pause_body="Neem de tijd. Alles wat u hebt geantwoord blijft bewaard. Een onderbroken onderdeel begint opnieuw.",
    pause_held_body="Wacht even; de onderzoeker gaat zo verder. Alles wat u hebt geantwoord blijft bewaard.",
    resume="Verder",
    force_off_title="De kracht is uit",
    force_off_body="Het apparaat duwt niet meer. Als u klaar bent, komt de kracht geleidelijk terug.",
    force_held_title="De onderzoeker heeft de kracht uitgeschakeld.",
    force_held_body="Wacht even; de onderzoeker schakelt de kracht weer in.",
    force_on="Kracht weer inschakelen en verdergaan",
    trouble_title="Een ogenblik geduld",
    trouble_body="De kracht is uit en uw antwoorden zijn bewaard. De onderzoeker helpt; u hoeft niets te doen.",
    end_title="Dank u wel",
    end_body="De sessie is klaar. U kunt het apparaat loslaten.",
    ended_early_title="De sessie is beëindigd",
    ended_early_body="U kunt het apparaat loslaten. Dank u voor uw tijd.",
    window_title="Onderzoek",
    preparing="Een ogenblik, de sessie wordt voorbereid …",
)

LANGUAGES = {words.language: words for words in (_ENGLISH, _DUTCH)}


def words(language: str) -> Words:
    """Return the words of a language.

    Raises
    ------
    StudyError
        There are none in this language.
    """
    if language not in LANGUAGES:
        raise StudyError(f'no words for the participant\'s pages in "{language}" ({did_you_mean(language, LANGUAGES)})')
    return LANGUAGES[language]
