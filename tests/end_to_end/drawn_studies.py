"""Random studies of format 2 as files: groups, languages, forms and blocks of every kind that `check` accepts."""

import random
from collections.abc import Mapping
from itertools import count, pairwise
from typing import Any

import tomlkit

from study_app.errors import ProtocolError
from study_app.protocol.load import parse
from study_app.protocol.model import Protocol
from study_app.protocol.participants.groups import sequences_in
from study_app.protocol.source.document import frozen
from study_app.protocol.wording.languages import LANGUAGES

Table = dict[str, Any]
INSTRUMENTS = ("nasa-tlx", "nasa-tlx-weighted", "sus")
"""Those whose texts the program has, in English."""
VARIED: Mapping[str, Table] = {
    "damping_nspm": {"levels": [0.05, 0.6], "standards": [8]},
    "delay_ms": {"condition": "thick", "levels": [20, 200], "standards": [0]},
    "force_delay_ms": {"level": "difference", "levels": [1, 10], "standards": [0]},
}
"""Numbers that a stimulus varies, with levels on a standard."""
VALUES: Mapping[str, list[float]] = {"damping_nspm": [2, 18], "delay_ms": [20, 200], "force_delay_ms": [1, 10]}
"""Their levels as values."""
COMPARING = ("2ifc", "3ifc", "4ifc", "abx", "oddity", "samedifferent", "yesno")
METHODS: tuple[Table, ...] = (
    {"kind": "constant", "levels": 3, "repetitions": 2},
    {"kind": "updown", "trials": 6, "tracks": 2},
    {"kind": "questplus", "trials": 6},
    {"kind": "questplus", "learn": "all", "trials": 8},
)


def drawn(number: int) -> tuple[str, Protocol]:
    """Return the text of the random study of this number, and its protocol."""
    for attempt in count():
        text = tomlkit.dumps(_Drawing(random.Random(f"{number}/{attempt}")).study())  # noqa: S311 - of a test
        try:
            return text, parse(text.encode(), "drawn.toml")
        except ProtocolError:
            assert attempt < 20, text
    raise AssertionError


class _Drawing:
    """The state of one random study while it is drawn."""

    def __init__(self, rng: random.Random) -> None:
        self.rng = rng
        self.languages = rng.sample(sorted(LANGUAGES), rng.choice([1, 1, 2, 3]))
        self.found: Table = {"format": 2, "study": self._head()}
        self.found["liquids"] = {
            name: {"drag": {"law": "linear", "damping_nspm": damping}}
            for name, damping in (("thin", 3), ("thick", 8), ("tar", 14))
        }
        self.delayed = rng.random() < 0.5
        self.found["conditions"] = {name: {"liquid": name} for name in ("thin", "thick", "tar")}
        self.found["conditions"] |= {f"late_{ms}": {"liquid": "thick", "delay_ms": ms} for ms in (50, 100, 200)}
        self.found["conditions"] |= {"blind": {"liquid": "thick", "ball": "hidden"}}
        self.found["scales"] = {"agreement": {"labels": self._points(7)}, "five": {"labels": self._points(5)}}
        if rng.random() < 0.5:
            self.found["scales"]["agreement"]["cannot_judge"] = self._text("Cannot judge")

    def study(self) -> Table:
        """Return the whole file."""
        drawn_study, rng = self.found, self.rng
        drawn_study["tasks"] = {"move": self._task()}
        drawn_study["questionnaires"] = {
            name: self._questionnaire(name) for name in ("after", "other", "before", "last")[: rng.randint(1, 4)]
        }
        if self.languages == ["en"]:
            drawn_study["questionnaires"]["standard"] = {"instrument": rng.choice(INSTRUMENTS)}
        drawn_study["pages"] = {
            "hello": self._page("consent"),
            "bye": self._page("debrief"),
            "rest": self._page("break"),
        }
        drawn_study["blocks"] = {f"b{number}": self._block(number) for number in range(1, rng.randint(1, 4) + 1)}
        self._break()
        self._order()
        self._decide()
        return {name: table for name, table in drawn_study.items() if table}

    def _text(self, words: str) -> str | Table:
        return words if len(self.languages) == 1 else {name: f"{words} ({name})" for name in self.languages}

    def _points(self, points: int) -> Table:
        return {name: [f"point {at} {name}" for at in range(points)] for name in self.languages}

    def _head(self) -> Table:
        head = {"name": "drawn", "languages": self.languages, "title": self._text("Drawn")}
        head |= {"resume": self.rng.choice(["trial", "block"]), "blinding": self.rng.choice(["double", "single"])}
        return head

    def _task(self) -> Table:
        words = self._text("Move.")
        return self.rng.choice(
            [
                {"kind": "explore", "min_s": 1, "max_s": 3, "instruction": words},
                {"kind": "follow", "cycles": 1},
                {"kind": "reach", "targets_mm": [[-20, 0, 0], [20, 0, 0]], "radius_mm": 6, "dwell_s": 0.1, "count": 2}
                | {"instruction": words},
            ]
        )

    def _page(self, kind: str) -> Table:
        page = {"kind": kind, "title": self._text(kind.capitalize()), "body": self._text("Read this.")}
        return page | ({"min_s": 1} if kind == "break" and self.rng.random() < 0.5 else {})

    def _questionnaire(self, name: str) -> Table:
        items = [self._item(f"{name}_{number}") for number in range(1, self.rng.randint(1, 5) + 1)]
        table: Table = {"intro": self._text("How was it?"), "items": items, "scale": "agreement"}
        for earlier, later in pairwise(items):
            if self.rng.random() < 0.3:
                later["show_if"] = {"item": earlier["id"], **self._condition(earlier)}
        numbers = [item["id"] for item in items if item.get("kind", "rating") in ("rating", "slider", "number")]
        if numbers and self.rng.random() < 0.3:
            table["scores"] = {f"{name}_score": {"items": numbers, "reverse": numbers[:1], "combine": "mean"}}
        if not any("show_if" in item for item in items):
            table["item_order"] = self.rng.choice(["fixed", "shuffled"])
        return table

    def _item(self, name: str) -> Table:
        item = self.rng.choice(
            [
                {},
                {},
                {"kind": "rating", "scale": "five"},
                {"kind": "slider", "low": self._text("Low"), "high": self._text("High"), "step": 5},
                {"kind": "number", "from": 1, "to": 9, "whole": True, "unit": self._text("years")},
                {"kind": "number"},
                {"kind": "choice", "options": [{"id": end, "text": self._text(end)} for end in ("left", "right")]},
                {
                    "kind": "choice",
                    "options": [{"id": colour, "text": self._text(colour)} for colour in ("red", "blue")],
                }
                | {"several": True},
                {"kind": "text"},
            ]
        )
        item |= {"id": name, "text": self._text(f"What of {name}?"), "short": self._text(name)}
        return item | ({"required": False} if self.rng.random() < 0.2 else {})

    def _condition(self, earlier: Table) -> Table:
        kind = earlier.get("kind", "statement")
        if kind == "choice":
            return {"is": earlier["options"][0]["id"]}
        return {"is": "nothing"} if kind == "text" else {"at_least": 4}

    def _block(self, number: int) -> Table:
        kinds = [
            self._presentation_block,
            self._presentation_block,
            self._comparison_block,
            self._level_block,
            self._level_block,
            self._judging,
        ]
        block: Table = self.rng.choice(kinds if number == 1 else [*kinds, self._practice_block])(f"b{number}")
        return block | ({"title": self._text(f"Block {number}")} if self.rng.random() < 0.5 else {})

    def _conditions(self, least: int) -> list[str]:
        groups = (["thin", "thick", "tar"], ["thick", "late_50", "late_100", "late_200"])
        names = self.rng.choice(groups)
        return self.rng.sample(names, self.rng.randint(least, len(names)))

    def _presentation_block(self, _name: str) -> Table:
        conditions = self._conditions(1) if self.rng.random() < 0.9 else ["thick", "blind"]
        order = self.rng.choice(["fixed", "shuffled", "constrained", "williams", "latin"])
        block = {"conditions": conditions, "order": order, "repetitions": self.rng.randint(1, 2)}
        if order == "constrained":
            block |= {"conditions": self._conditions(2), "repetitions": 2, "max_repeats": 1}
        if self.rng.random() < 0.8:
            block["questionnaire"] = self.rng.choice(sorted(self.found["questionnaires"]))
        return block

    def _practice_block(self, _name: str) -> Table:
        phase = self.rng.choice(["practice", "baseline"])
        block = {"phase": phase, "conditions": [self.rng.choice(sorted(self.found["conditions"]))]}
        return block | ({"questionnaire": "after"} if self.rng.random() < 0.5 else {})

    def _comparison_block(self, name: str) -> Table:
        """Return a block that compares conditions with one of them."""
        conditions = self._conditions(2)
        block: Table = {"conditions": conditions, "standard": conditions[0], "repetitions": 2}
        return block | {"design": self._design(name, {"kind": self.rng.choice(COMPARING)})} | self._practice()

    def _level_block(self, name: str) -> Table:
        """Compare levels of a number with standards, by any method."""
        vary = self.rng.choice(sorted(VARIED))
        self._stimulus(name, {"vary": vary, "condition": "thick", **VARIED[vary]})
        block: Table = {"stimulus": name, "method": name}
        self.found.setdefault("methods", {})[name] = dict(self.rng.choice(METHODS))
        block["design"] = self._design(name, {"kind": self.rng.choice(COMPARING)})
        if self.rng.random() < 0.3:
            block["catch"] = {"share": 0.5}
        if self.rng.random() < 0.3:
            block["until"] = {"right": 3, "of": 4, "missed": self.rng.choice(["go_on", "end"])}
        return block | self._practice()

    def _judging(self, name: str) -> Table:
        """Rate, estimate or set a value."""
        vary = self.rng.choice(sorted(VALUES))
        self._stimulus(name, {"vary": vary, "condition": "thick", "level": "value", "levels": VALUES[vary]})
        design: Table = self.rng.choice(
            [
                {"kind": "rating", "scale": "five"},
                {"kind": "estimation"},
                {"kind": "estimation", "modulus": {"level": VALUES[vary][1], "number": 10}},
                {"kind": "adjustment"},
                {"kind": "adjustment", "standard": False},
            ]
        )
        method: Table = {"kind": "constant", "levels": 3, "repetitions": 2}
        if design["kind"] == "adjustment":
            method = {"kind": "adjustment", "repetitions": 2}
        self.found.setdefault("methods", {})[name] = method
        return {"stimulus": name, "method": name, "design": self._design(name, design)}

    def _stimulus(self, name: str, table: Table) -> None:
        spacing = {"spacing": self.rng.choice(["log", "linear"]), "steps": 7}
        self.found.setdefault("stimuli", {})[name] = {**table, **spacing}

    def _design(self, name: str, table: Table) -> str:
        if self.rng.random() < 0.3:
            table["question"] = self._text("Which?")
        if self.rng.random() < 0.3 and table["kind"] in COMPARING:
            table["feedback"] = self.rng.choice(["never", "always"])
        self.found.setdefault("designs", {})[name] = table
        return name

    def _practice(self) -> Table:
        return {"phase": "practice"} if self.rng.random() < 0.15 else {}

    def _break(self) -> None:
        for block in self.found["blocks"].values():
            if self.rng.random() < 0.3 and len(block.get("conditions", "   ")) * block.get("repetitions", 1) > 2:
                block |= {"break_every": 2, "break_page": "rest"}

    def _order(self) -> None:
        """List the steps: for all, for each session, for each group, or for each session of a group."""
        drawn_study, rng = self.found, self.rng
        forms = [name for name in drawn_study["questionnaires"] if name in ("before", "last", "standard")]
        steps = ["hello", *forms[:1], *drawn_study["blocks"], *forms[1:], "bye"]
        if rng.random() < 0.5:
            steps.insert(rng.randint(1, len(steps)), "rest")
        blocks = list(drawn_study["blocks"])
        orders = [steps, [*blocks[::-1], "bye"], blocks[1:] or blocks, ["hello", *blocks[:1], "rest"]]
        way = rng.choice(["omitted", "all", "sessions", "groups", "groups", "sessions of groups", "mixed"])
        if way == "omitted":
            drawn_study["pages"] = {"rest": drawn_study["pages"]["rest"]}
        elif way == "all":
            drawn_study["sequence"] = steps
        elif way == "sessions":
            drawn_study["sequences"] = [steps, rng.choice(orders)]
        else:
            drawn_study["groups"] = self._groups(way, steps, orders)
            if way == "mixed":
                drawn_study["sequence"] = steps
        if not any("rest" in listed for _, listed in sequences_in(frozen(drawn_study))) and not self._breaks():
            del drawn_study["pages"]["rest"]

    def _breaks(self) -> bool:
        return any("break_page" in block for block in self.found["blocks"].values())

    def _groups(self, way: str, steps: list[str], orders: list[list[str]]) -> Table:
        groups: Table = {"one": {"sequence": steps}, "two": {"sequence": self.rng.choice(orders)}}
        if way == "sessions of groups":
            groups["one"] = {"sequences": [steps, self.rng.choice(orders)]}
        if way == "mixed":
            groups["one"] = {}
        if self.rng.random() < 0.3:
            groups["three"] = {"share": 2, "sequences": [self.rng.choice(orders), steps]}
        return groups

    def _decide(self) -> None:
        """Decide some of the analysis."""
        tables = self.found["questionnaires"].values()
        items = [item["id"] for table in tables for item in table.get("items", ()) if "kind" not in item]
        if self.rng.random() < 0.5:
            self.found["analysis"] = (
                {"alpha": 0.05, "equivalence_bound": 1, "primary": items[:2], "noticed": items[0]}
                if items
                else {"alpha": 0.01}
            )
            self.found["analysis"]["participants"] = 12
            if items and self.rng.random() < 0.5:
                self.found["analysis"] |= {"rising": items[:1], "falling": items[1:2]}
            if len(items) > 1 and self.rng.random() < 0.5:
                self.found["analysis"]["names"] = items[:2]
                self.found["conditions"]["thin"]["label"] = items[0]
            levels = list(self.found.get("stimuli", {}))
            if levels and self.rng.random() < 0.5:
                of = {"block": levels[0], "measure": "threshold", "value": 1.5}
                self.found["analysis"]["published"] = [of]
