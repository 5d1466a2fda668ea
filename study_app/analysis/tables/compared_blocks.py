"""What was asked and of what: blocks, their settings and their statements, as the receipts and the key tell it.

While the key is sealed a setting is its code and nothing else. Texts are in English where the study has it, otherwise
in its first language.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, TypeAlias, get_args

from study_app.protocol.blocks import Compared
from study_app.protocol.orders.block_orders import every_step_of
from study_app.protocol.table import text_in
from study_app.protocol.trials.presentation import link_words
from study_app.protocol.trials.stimuli import OF_LINK
from study_app.store.blinded.blinding import Key

Kind: TypeAlias = Compared

KINDS: Final[tuple[Kind, ...]] = get_args(Kind)

DELAY_PREFIX: Final = "D"
"""Codes of delay settings are D1, D2 …: what tells a block of delays in sealed receipts of earlier versions."""


@dataclass(frozen=True, slots=True)
class Item:
    """One statement: its id, its words, and a few words for figures."""

    id: str
    text: str
    short: str


@dataclass(frozen=True, slots=True)
class Setting:
    """What was presented under a code; all but the code is None until the key is opened.

    ``label`` is the item that names what was felt, where one does, ``link`` how its force was sent if not promptly,
    ``view`` what was seen, empty for the drawn tank. A track ("8/1") has neither liquid nor delay.
    """

    code: str
    condition: str | None = None
    liquid: str | None = None
    delay_ms: float | None = None
    label: str | None = None
    link: str = ""
    view: str = ""

    @property
    def standard(self) -> str | None:
        """What a track's comparisons are compared with; None of a condition, and of a track without a standard."""
        standard, is_track, _ = (self.condition or "").partition("/")
        return standard or None if is_track else None


@dataclass(frozen=True, slots=True)
class Block:
    """A main block with a questionnaire: ``settings`` in code order, once known in the order of the conditions.

    ``kind`` is what the block compares, as its receipt says. ``labels`` name the seven levels, lowest first;
    ``cannot_judge`` is the answer off the scale, or None.
    """

    id: str
    title: str
    kind: Kind
    settings: tuple[Setting, ...]
    items: tuple[Item, ...]
    labels: tuple[str, ...]
    cannot_judge: str | None

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the settings, in their order."""
        return tuple(setting.code for setting in self.settings)

    @property
    def columns(self) -> dict[str, int]:
        """The column of each code in tables of answers: conditions of one delay are replicates of it, in one column."""
        if self.kind == "delays" and self.revealed:
            return {setting.code: self.delays_ms.index(setting.delay_ms or 0.0) for setting in self.settings}
        return {code: place for place, code in enumerate(self.codes)}

    @property
    def delays_ms(self) -> tuple[float, ...]:
        """The delays of the settings, each once, shortest first; 0 while they are not known."""
        return tuple(sorted({setting.delay_ms or 0.0 for setting in self.settings}))

    @property
    def codes_as_dealt(self) -> tuple[str, ...]:
        """The codes of the settings in the order of the codes."""
        return tuple(sorted(self.codes, key=lambda code: (len(code), code)))

    @property
    def revealed(self) -> bool:
        """Whether the settings' conditions are known."""
        return all(setting.condition is not None for setting in self.settings)

    def name(self, setting: Setting) -> str:
        """Return what a figure calls a setting."""
        return setting_name(setting, self.settings)


def settings_of(key: Key) -> dict[tuple[str, str], Setting]:
    """Return what the opened key says of every code: (block id, code) → setting."""
    return {
        (block, code): _setting(key, block, code, presented)
        for block, codes in key.codes.items()
        for code, presented in codes.items()
    }


def _setting(key: Key, block: str, code: str, presented: str) -> Setting:
    """Return what a code stands for: a condition, or a track of a design such as "8/1", with its standard."""
    condition = key.tables["conditions"].get(presented)
    if condition is None:
        return Setting(code, presented)
    liquids = " + ".join(key.liquids(block, code))
    link = ", ".join(link_words(*(condition.get(name, 0.0) for name in OF_LINK)))
    view = condition.get("view", "tank") + (" alone" if condition.get("overlay") == "hidden" else "")
    view = "" if view == "tank" else view
    return Setting(code, presented, liquids, key.delay_ms(block, code), condition.get("label"), link, view)


def main_blocks(protocol: Mapping[str, Any], key: Key | None) -> tuple[Block, ...]:
    """Read the main blocks that ask something, in the order of the session.

    Parameters
    ----------
    protocol : mapping
        The protocol as a receipt holds it: without conditions, blocks with their codes.
    """
    asked = [protocol["blocks"][step] for step in every_step_of(protocol) if step in protocol["blocks"]]
    return tuple(
        _block(protocol, block, spoken(protocol), key)
        for block in asked
        if block["phase"] == "main" and block["questionnaire"] is not None and _statements(protocol, block)
    )


def _statements(protocol: Mapping[str, Any], block: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    """Return the statements of a block's questionnaire, which have no kind."""
    return [item for item in protocol["questionnaires"][block["questionnaire"]]["items"] if "kind" not in item]


def spoken(protocol: Mapping[str, Any]) -> str:
    """Return the language of figures and tables: English where the study has it, otherwise its first."""
    languages = list(protocol["study"]["languages"])
    return "en" if "en" in languages else str(languages[0])


def _block(protocol: Mapping[str, Any], block: Mapping[str, Any], language: str, key: Key | None) -> Block:
    questionnaire = protocol["questionnaires"][block["questionnaire"]]
    scale = protocol["scales"][questionnaire["scale"]]
    off_scale = scale["cannot_judge"]
    settings = settings_in(protocol, block["id"], key)
    kind: Kind = block.get("compares") or ("delays" if block["code_prefix"] == DELAY_PREFIX else "liquids")
    if key is not None:
        kind = _opened(key, block["id"], block["codes"], block.get("compares"))[1]
    return Block(
        id=block["id"],
        title=text_in(block["title"], language),
        kind=kind,
        settings=settings,
        items=tuple(
            Item(item["id"], text_in(item["text"], language), text_in(item["short"], language))
            for item in _statements(protocol, block)
        ),
        labels=tuple(scale["labels"][language]),
        cannot_judge=None if off_scale is None else text_in(off_scale, language),
    )


def settings_in(protocol: Mapping[str, Any], block: str, key: Key | None) -> tuple[Setting, ...]:
    """Return the settings of a block: in code order, once known in the order of the conditions."""
    table = protocol["blocks"][block]
    if key is None:
        return tuple(Setting(code) for code in table["codes"])
    return _opened(key, block, table["codes"], table.get("compares"))[0]


def setting_name(setting: Setting, others: Sequence[Setting]) -> str:
    """Return what a figure calls a setting: its code, or its liquid and, where they differ, its view and delay."""
    if setting.liquid is None or setting.delay_ms is None:
        return setting.code if setting.standard is None else f"Standard {setting.standard}"
    liquid = setting.liquid.replace("_", " ")
    named = liquid[:1].upper() + liquid[1:]
    named = f"{named}, {setting.view or 'tank'}" if len({other.view for other in others}) > 1 else named
    named = f"{named}, {setting.delay_ms:g} ms" if len({other.delay_ms for other in others}) > 1 else named
    return f"{named}, {setting.link}" if setting.link else named


def _opened(key: Key, block: str, codes: Sequence[str], kind: Kind | None) -> tuple[tuple[Setting, ...], Kind]:
    """Return the settings by name: delays ascending, others in the order of the protocol's conditions.

    Without ``kind``, in receipts of earlier versions, one liquid under several delays is a block of delays.
    """
    known = settings_of(key)
    settings = [known[block, code] for code in codes]
    if kind is None:
        delays = {setting.delay_ms for setting in settings}
        kind = "delays" if len(delays) > 1 and len({setting.liquid for setting in settings}) == 1 else "liquids"
    if kind == "delays":
        return tuple(sorted(settings, key=lambda setting: setting.delay_ms or 0.0)), "delays"
    order = list(key.tables["conditions"])
    if any(setting.condition not in order for setting in settings):  # tracks, by their standards
        return tuple(sorted(settings, key=lambda one: float((one.condition or "").partition("/")[0] or 0))), "liquids"
    return tuple(sorted(settings, key=lambda setting: order.index(setting.condition))), kind
