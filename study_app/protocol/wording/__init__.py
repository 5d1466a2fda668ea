"""The participant's texts in five languages."""

from study_app.protocol.wording.languages import (
    LANGUAGES,
    SHIPPED,
    Words,
    language_name,
    language_template,
    languages_of,
    read_language,
    words,
    words_or_english,
)

__all__ = [
    "LANGUAGES",
    "SHIPPED",
    "Words",
    "language_name",
    "language_template",
    "languages_of",
    "read_language",
    "words",
    "words_or_english",
]
