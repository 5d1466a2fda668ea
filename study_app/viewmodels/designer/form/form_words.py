"""Words of a form: what its choices are called, and which of its languages are read from right to left."""

from study_app.authoring.changes.initial_values import singular
from study_app.authoring.fields import Choice, label_of
from study_app.protocol.wording.languages import LANGUAGES


def is_right_to_left(code: str) -> bool:
    """Return whether a language is written from right to left."""
    return code in LANGUAGES and LANGUAGES[code].right_to_left


def new_words(section: str) -> str:
    """Return what the choice is called that adds an element to a section and names it."""
    return f"New {label_of(singular(section)).lower()} …"


def choice_words(choice: Choice, default: object) -> str:
    """Return what a choice is called: its value in words, marked where it counts without being written."""
    if choice.value is None:
        return "Not set"
    words = label_of(str(choice.value)) if not str(choice.value).isdigit() else str(choice.value)
    return f"{words} (default)" if choice.value == default else words
