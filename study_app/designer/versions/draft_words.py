"""What a draft of a study holds, in words; apart from `home`, which begins without the designer's modules."""

import tomllib
from pathlib import Path
from typing import Final

from study_app.designer.document.elements import study_title, title_of
from study_app.designer.document.fields import label_of
from study_app.designer.document.study import Study
from study_app.designer.problems.problems import element_of
from study_app.protocol.differences import document_differences

NAMED_AT_MOST: Final = 3
"""So many elements with edits that were not saved are named."""


def draft_title(draft: str, folder: Path) -> str:
    """Return the title of a study, "" where it has none."""
    return study_title(Study(draft, folder).document)


def edited_words(saved: str, draft: str, folder: Path) -> str:
    """Return the elements in which a draft differs from its file, in words: ": Water, Welcome and 2 more"."""
    study = Study(draft, folder)
    try:
        found = document_differences(tomllib.loads(saved), tomllib.loads(draft))
    except ValueError:  # the text of one of them is not TOML
        return ""
    places = (one.place[:2] for one in found)
    titles = dict.fromkeys(
        label_of(path[1]) if path[0] == "study" else title_of(study.document, element_of(study, path))
        for path in places
    )
    named, more = list(titles)[:NAMED_AT_MOST], len(titles) - NAMED_AT_MOST
    return f": {', '.join(named) or 'comments, order or notation'}{f' and {more} more' if more > 0 else ''}"
