"""Authors, licence and citation of a study: the same words in every file that is handed out."""

from typing import Any, Final

from study_app.analysis.tables.study_tables import Study

CREDITS: Final = {"authors": "author", "license": "license", "citation": "citation", "funder": "funder", "url": "url"}
"""Keys of ``[study.credits]``, and the properties of schema.org that say the same."""


def stated_credits(study: Study) -> dict[str, Any]:
    """Return what the study states, as properties of schema.org."""
    stated = study.protocol.get("study", {}).get("credits") or {}
    return {name: stated[key] for key, name in CREDITS.items() if stated.get(key)}


def credit_lines(study: Study) -> tuple[str, str, str]:
    """Return authors, licence and citation in a line each, which says so where the study does not state it."""
    stated = stated_credits(study)
    lines = (
        f"Authors: {', '.join(stated.get('author', [])) or 'not stated'}.",
        f"Licence: {stated.get('license', 'not stated; ask the authors before you use the data')}.",
        f"How to cite: {stated.get('citation', 'not stated; name the study, its version and its authors')}.",
    )
    authors, licence, citation = (" ".join(line.split()) for line in lines)
    return authors, licence, citation
