"""The shipped studies' sentences about force and feeling, as they read with a device that gives no force.

A study's file stays as it is, and so do its hash, its receipt and its key: only pages differ, and only in sentences
that are word for word one of these. The statements that are rated are never changed: they are the instrument.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any, Final

from study_app.protocol.model import Protocol

SENTENCES: Final[Mapping[str, str]] = {
    "In this study you move a small ball through simulated liquids and feel them push against your hand.": (
        "In this study you move a small ball through simulated liquids and see how they slow it down."
    ),
    "In this study you move a ball through simulated liquids and feel them push against your hand.": (
        "In this study you move a ball through simulated liquids and see how they slow it down."
    ),
    "The device pushes with at most 8 newtons, a little less than the weight of a full carton of milk.": (
        "The device that you hold gives no force."
    ),
    "Hold Esc, or ask the operator, to switch the force off at once.": (
        "Press Esc, or ask the operator, to pause at once."
    ),
    "Move as you would in a real liquid: slowly and quickly, straight and in circles, and stop now and then to feel "
    "what the liquid does.": (
        "Move as you would in a real liquid: slowly and quickly, straight and in circles, and stop now and then to see "
        "what the liquid does."
    ),
    "Move as you would in a real liquid: slowly and quickly, to and fro and in circles, and stop now and then to feel "
    "what the liquid does.": (
        "Move as you would in a real liquid: slowly and quickly, to and fro and in circles, and stop now and then to "
        "see what the liquid does."
    ),
    "You will now feel three liquids, one after the other.": "You will now see three liquids, one after the other.",
    "You will now feel six settings, one after the other.": "You will now see six settings, one after the other.",
    "There are no right or wrong answers: we want to know what you feel.": (
        "There are no right or wrong answers: we want to know what you notice."
    ),
    "In part 1 we studied how well liquids can be recognised by touch alone.": (
        "In part 1 we studied how well liquids can be recognised by their motion alone."
    ),
    "You felt three liquids, each of them twice: water, glycerin and honey.": (
        "You saw three liquids, each of them twice: water, glycerin and honey."
    ),
    "How much do you agree with each statement about what you just felt?": (
        "How much do you agree with each statement about what you just saw?"
    ),
    "Press the space bar when it feels familiar.": "Press the space bar when it is familiar.",
    "In dit onderzoek beweegt u een balletje door gesimuleerde vloeistoffen en voelt u hoe ze tegen uw hand duwen.": (
        "In dit onderzoek beweegt u een balletje door gesimuleerde vloeistoffen en ziet u hoe ze het afremmen."
    ),
    "In dit onderzoek beweegt u een bal door gesimuleerde vloeistoffen en voelt u hoe ze tegen uw hand duwen.": (
        "In dit onderzoek beweegt u een bal door gesimuleerde vloeistoffen en ziet u hoe ze hem afremmen."
    ),
    "Het apparaat duwt met hooguit 8 newton, iets minder dan het gewicht van een vol pak melk.": (
        "Het apparaat in uw hand geeft geen kracht."
    ),
    "Houd Esc ingedrukt, of vraag het de onderzoeker, om de kracht meteen uit te schakelen.": (
        "Druk op Esc, of vraag het de onderzoeker, om meteen te pauzeren."
    ),
    "Beweeg zoals u in een echte vloeistof zou doen: langzaam en snel, recht en in cirkels, en stop af en toe om te "
    "voelen wat de vloeistof doet.": (
        "Beweeg zoals u in een echte vloeistof zou doen: langzaam en snel, recht en in cirkels, en stop af en toe om "
        "te zien wat de vloeistof doet."
    ),
    "Beweeg zoals u in een echte vloeistof zou doen: langzaam en snel, heen en weer en in cirkels, en stop af en toe "
    "om te voelen wat de vloeistof doet.": (
        "Beweeg zoals u in een echte vloeistof zou doen: langzaam en snel, heen en weer en in cirkels, en stop af en "
        "toe om te zien wat de vloeistof doet."
    ),
    "U voelt nu drie vloeistoffen, de een na de ander.": "U ziet nu drie vloeistoffen, de een na de ander.",
    "U voelt nu zes instellingen, de een na de ander.": "U ziet nu zes instellingen, de een na de ander.",
    "Er zijn geen goede of foute antwoorden: we willen weten wat u voelt.": (
        "Er zijn geen goede of foute antwoorden: we willen weten wat u opmerkt."
    ),
    "In deel 1 onderzochten we hoe goed vloeistoffen op het gevoel alleen te herkennen zijn.": (
        "In deel 1 onderzochten we hoe goed vloeistoffen aan hun beweging alleen te herkennen zijn."
    ),
    "U voelde drie vloeistoffen, elk twee keer: water, glycerine en honing.": (
        "U zag drie vloeistoffen, elk twee keer: water, glycerine en honing."
    ),
    "In hoeverre bent u het eens met elke uitspraak over wat u zojuist hebt gevoeld?": (
        "In hoeverre bent u het eens met elke uitspraak over wat u zojuist hebt gezien?"
    ),
    "Druk op de spatiebalk als het vertrouwd aanvoelt.": "Druk op de spatiebalk als u eraan gewend bent.",
}
_PATTERNS: Final = tuple(
    (re.compile(r"\s+".join(map(re.escape, felt.split()))), seen) for felt, seen in SENTENCES.items()
)


def without_force(protocol: Protocol) -> Protocol:
    """Return a study whose pages, introductions and instructions do not speak of force.

    Parameters
    ----------
    protocol : Protocol
        The study as its file is.

    Returns
    -------
    Protocol
        The study to be shown, never the one to be kept or hashed.
    """
    reworded = {"pages": "body", "questionnaires": "intro", "tasks": "instruction"}
    tables = {
        table: {name: one.model_copy(update={key: _seen(getattr(one, key))}) for name, one in given.items()}
        for table, key in reworded.items()
        for given in (getattr(protocol, table),)
    }
    return protocol.model_copy(update=tables)


def _seen(text: Any) -> Any:
    """Return a localised text without its sentences about force."""
    if isinstance(text, Mapping):
        return {language: _seen(one) for language, one in text.items()}
    for felt, seen in _PATTERNS if isinstance(text, str) else ():
        text = felt.sub(seen, text)
    return text
