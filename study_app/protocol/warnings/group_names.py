"""Names of groups that suggest an attribute of participants, in English, Dutch, German and French.

A name is split at underscores and digits, and each word is looked up. Words that also name possible treatments are
not included: trained, control, experimental, left_hand, stroke.
"""

import re
from typing import Final

_STEMS: Final = r"""
    expert|novic|beginner|amateur|professional|experienc|inexperienc|layp|laym
    |patient|healthy|diabet|parkinson|alzheimer|dementia|autis|adhd|dyslex|amput|prosthe|disab|impair|handicap|neuropath
    |arthrit|schizo|pregnan|smoker|nonsmoker|synaesthe|synesthe|obes|overweight
    |adult|child|teen|adolescen|young|elder|senior|infant|toddler|retire
    |student|pupil|undergrad|teacher|nurse|surgeon|physician|dentist|therapist|clinician|musician|nonmusician|pianist
    |violinist|dancer|athlete|gamer|nongamer|sommelier|scientist|veteran
    |bilingual|monolingual|immigrant|introvert|extravert|extrovert|ambidext|dominan|nondominan|lefthanded|righthanded

    |deskundig|ervaren|onervaren|gezond|vrouw|meisje|jonge|ouder|bejaard|kinder|volwassen|leeftijd|linkshand|rechtshand
    |leerling|muzikant|slechtziend|verpleegkundig|chirurg|geslacht

    |anfaenger|anfanger|erfahren|unerfahren|gesund|krank|maenner|frau|juenger|aelter|jugendlich|erwachsen|linkshaend
    |rechtshaend|schueler|schuler|studier|musiker|aerzt|geschlecht|sehbehindert|behindert|raucher|gehoerlos

    |debutant|inexperiment|malade|homme|femme|garcon|jeune|enfant|gaucher|droitier|etudiant|musicien|infirmier|medecin
    |aveugle|sourd|malvoyant|fumeur
    """
_WORDS: Final = r"""
    naive|skilled|unskilled|lay|males?|females?|m[ae]n|wom[ae]n|boys?|girls?|sex|gender|nonbinary|ages?|aged|older|years
    |kids?|doctors?|engineers?|singers?|drivers?|workers?|chefs?|native|nonnative|blind|sighted|deaf|hearing|lefties
    |leek|leken|mannen|jongens?|rokers?|doof|doven|blinden|arts|artsen
    |laien?|mann|alte|alter|jung|arzt|senioren
    |experimentes?|sains?|filles?|agee?s?|aine?s?|eleves?|sexe
    |.*handed|.*handers?|.*handige?n?
    """


def suggests_attribute(name: str) -> bool:
    """Return whether a group's name suggests an attribute that participants already have."""
    name_words = re.findall(r"[a-z]+", name.casefold())
    is_old = name.casefold() in ("old", "oud", "alt", "vieux")
    return is_old or any(
        re.match(_STEMS, word, re.VERBOSE) or re.fullmatch(_WORDS, word, re.VERBOSE) for word in name_words
    )
