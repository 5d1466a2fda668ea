"""The program's own words on the participant's pages, one file for each language: everything that no protocol writes.

Templates in braces are filled with ``str.format``; where grammar depends on a number there is a method.
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from study_app.errors import StudyError
from study_app.protocol.source.problems import did_you_mean

RIGHT_TO_LEFT = frozenset({"ar", "dv", "fa", "he", "ks", "ps", "sd", "ug", "ur", "yi"})


@dataclass(frozen=True, slots=True)
class Words:
    """One language's words; ``small_numbers`` are the numbers from one as they begin a sentence."""

    language: str
    name: str  # of the language, in itself
    english_name: str
    choose_language: str

    # progress, at the top of every page of a part
    part: str  # {part} {parts}
    setting: str  # {label}, the trial's name with its number, and {of}
    setting_at_most: str  # the same in a block that may end early

    # pages to read
    continue_: str
    decline: str  # on the consent
    space_key: str
    enter_key: str
    escape_key: str

    # tank
    targets_reached: str
    reached: str  # {reached} {of}
    seconds_left: str  # {seconds}
    continue_in: str  # {seconds}
    continue_now: str
    click_now: str  # where the mouse is the device
    further_away: str  # of the target, where the mouse's wheel moves the hand in depth
    nearer: str
    time_is_up: str
    follow_target: str  # where a study gives no instruction of its own
    back_to_target: str  # in a rest that waits for it
    pause_hint: str

    trial: str  # the name of a trial where the study gives none

    # questionnaire
    please_answer: str
    press_keys: str
    answered: str  # {done} {of}
    answers_kept: str
    key_answer: str
    key_move: str
    optional: str
    chosen: str
    one_missing: str  # {list}
    many_missing: str  # {n} {list}
    one_question_missing: str  # {list}, of a form
    many_questions_missing: str  # {n} {list}
    no_answer_yet: str
    several_possible: str  # of a choice
    whole_number: str  # as {kind} in the lines below, as any_number
    any_number: str
    number_between: str  # {kind} {least} {most}
    number_from: str  # {kind} {least}
    number_to: str  # {kind} {most}
    number_needed: str  # {kind}
    and_: str
    small_numbers: tuple[str, ...]

    # trials of intervals
    design_short: str  # names the answer to a design's question, in figures and tables
    design_questions: Mapping[str, str]  # by the kind of design; forced choices share one
    design_answers: Mapping[str, str]  # by the answer's id
    interval_begins: str  # {ordinal}, an answer such as "First", and {of}
    interval_coming: tuple[str, ...]  # in the rest before the first, the second …
    once_more: str  # a trial is presented again
    right: str
    not_right: str
    number_wanted: str
    modulus: str  # {number}, of the first trial of a magnitude estimation
    delete_digit: str
    less: str  # of what an adjustment sets
    more: str
    done: str

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
    let_go: str  # after either, where the mouse is not the device
    close: str

    # before the first page
    window_title: str
    preparing: str

    @property
    def right_to_left(self) -> bool:
        """Whether the language is written from right to left."""
        return self.language in RIGHT_TO_LEFT

    def joined(self, entries: Sequence[str]) -> str:
        """Return "2", "2 and 5", "2, 5 and 8"."""
        if len(entries) < 2:
            return "".join(entries)
        return f"{', '.join(entries[:-1])} {self.and_} {entries[-1]}"

    def missing(self, numbers: Sequence[int]) -> str:
        """Return the sentence that names the statements (by number, at least one) still without an answer."""
        return self._missing(numbers, self.one_missing, self.many_missing)

    def questions_missing(self, numbers: Sequence[int]) -> str:
        """Return the sentence that names the questions of a form (by number) still without an answer."""
        return self._missing(numbers, self.one_question_missing, self.many_questions_missing)

    def _missing(self, numbers: Sequence[int], one: str, many: str) -> str:
        listed = self.joined([str(number) for number in numbers])
        count = len(numbers)
        if count == 1:
            return one.format(list=listed)
        named = self.small_numbers[count - 1] if count <= len(self.small_numbers) else str(count)
        return many.format(n=named, list=listed)


_FOLDER: Final = Path(__file__).parent
_LISTS: Final = ("small_numbers", "interval_coming")


def _words(code: str) -> Words:
    """Return the words of a language as its file holds them."""
    table = tomllib.loads((_FOLDER / f"{code}.toml").read_text(encoding="utf-8"))
    return Words(**table | {key: tuple(table[key]) for key in _LISTS})


LANGUAGES: Final = {code: _words(code) for code in ("en", "nl", "de", "fr", "ar")}


def language_name(code: str) -> str:
    """Return the English name of a language, its code where the program has no words in it."""
    return LANGUAGES[code].english_name if code in LANGUAGES else code


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
