"""All actions of the lab at each signal of its page, with a servo that only records calls.

People change ``lab.txt``; no option regenerates it.
"""

import random
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from study_app.app import lab_controller
from study_app.app.lab_controller import LabController
from study_app.errors import DeviceNotFound, ServoFault
from study_app.evidence.appraisal import Costs, EffectCost, Errors
from study_app.lab.ab_comparison import Workbench
from study_app.lab.presets import Choice
from study_app.workers.server import Crashed
from tests.app.lab.worlds import COSTS, ERRORS, PATIENCE, SOON_MS
from tests.golden import check_kept, what_comes
from tests.golden_values import changed, value_lines


class Recorded:
    """A device's servo and an appraiser that record each call in ``done``."""

    def __init__(self, events: list[str]) -> None:
        self.done = events
        self.device = SimpleNamespace(workspace_m=(0.05, 0.03, 0.02))
        self.servo = SimpleNamespace(fault=None)
        self.path: str | None = None
        self.due_in_s: float | None = None
        self.force_on, self.works, self.pending_answers, self.orders = True, True, list[Any](), 0

    def __getattr__(self, name: str) -> Any:
        def called(*values: Any, **named: Any) -> None:
            self.done.append(" ".join([name, *map(short, values), *(f"{key}={value}" for key, value in named.items())]))
            if name in ("stop_force", "fade_in"):
                self.force_on = name == "fade_in"
            if name == "play":
                self.path = values[0]

        return called

    def reading(self) -> Any:
        fault = "" if self.servo.fault is None else str(self.servo.fault)
        return SimpleNamespace(
            position_m=(0.01, 0.02, 0.03), force_n=(1.0, 2.0, 3.0), wake_mps=(0.1, 0.2, 0.3), force_on=self.force_on,
            fault=fault,
        )  # fmt: skip

    def trace(self) -> None: ...

    poll = trace

    def tail(self, _side: str) -> None: ...

    def limiters(self) -> tuple[Any, ...]:
        return ()

    def order(self, question: Any) -> int:
        self.orders += 1
        self.done.append(f"appraise {short(question.scene)}")
        return self.orders

    def answers(self) -> list[Any]:
        answers, self.pending_answers = self.pending_answers, []
        return answers


def short(value: Any) -> str:
    """Return a short text that identifies a workbench, a setting or a scene."""
    if hasattr(value, "in_hand"):
        first = f", blind of {value.first}" if value.blind else ""
        return f"{value.presented}: {value.a.name} {short(value.a.scene)}, {value.b.name} {short(value.b.scene)}{first}"
    return (
        f"{value.liquids[0].density_kg_m3:g} cd {value.body.drag_coefficient:g}"
        if hasattr(value, "liquids")
        else f"{value}"
    )


def ask(what: str, *details: Any) -> Any:
    return lambda lab, *_: lab.place.ask(what, *details)


def raising(error: Exception) -> Any:
    def fail() -> None:
        raise error

    return fail


def files(name: str, *names: str) -> Any:
    def choose(lab: LabController, _live: Recorded, folder: Path) -> None:
        lab.place.ask(name, folder.joinpath(*names), *([] if name == "preset" else [lab.bench.in_hand]))
        lab._saving.wait()

    return choose


def lets(**values: Any) -> Any:
    return lambda _lab, live, _folder: vars(live).update(values)


STEPS: dict[str, Any] = {
    "not entered: a knob": ask("change", "liquid.density_kg_m3", 1100.0, False),
    "not entered: stop": ask("stop"),
    "left before it was entered": ask("leave"),
    "entered": ask("enter"),
    "entered twice": ask("enter"),
    "said": lambda lab, *_: lab._opening.said.emit("switch it on"),
    "a knob is held": ask("change", "liquid.density_kg_m3", 1300.0, True),
    "a knob is let go of": ask("change", "liquid.density_kg_m3", 1200.0, False),
    "a drag coefficient": ask("change", "body.drag_coefficient", 0.6, False),
    "out of range": ask("change", "liquid.density_kg_m3", -5.0, False),
    "undo": ask("undo"),
    "redo": ask("redo"),
    "due": lets(due_in_s=5.0),
    "switch": ask("switch"),
    "none due": lets(due_in_s=None),
    "choose": ask("liquid", "B", Choice(source="rek2024", liquid="syrup", title="Syrup")),
    "choose none": ask("liquid", "B", Choice(source="rek2024", liquid="treacle", title="Treacle")),
    "copy": ask("copy"),
    "costs are asked": lambda lab, *_: lab._cost_due.timeout.emit(),
    "old costs": lets(told=[(0, COSTS)]),
    "costs": lambda lab, live, _: live.pending_answers.extend([(live.orders, COSTS), (live.orders, ERRORS)]),
    "costs again": lambda lab, *_: lab._cost_due.timeout.emit(),
    "appraiser died": lets(works=False, told=[(3, Crashed(-9))]),
    "path": ask("path", "circle"),
    "no path": ask("path", None),
    "point": ask("point", 0.01, 0.02, -0.01),
    "press": ask("press", 3),
    "stop": ask("stop"),
    "fade in": ask("fade in"),
    "blind": ask("blind", True),
    "switch while blind": ask("switch"),
    "save while blind": files("save", "told.toml"),
    "reveal": ask("blind", False),
    "save": files("save", "syrup.toml"),
    "save nowhere": files("save", "nowhere", "mine.toml"),
    "open": files("preset", "syrup.toml"),
    "open none": files("preset", "broken.toml"),
    "of a study": lambda lab, *_: lab.feel_study_liquids(lab.bench.b, lab.bench.a, "demo"),
    "fault": lambda _lab, live, _folder: setattr(live.servo, "fault", ServoFault("no samples for 50 ms")),
    "fade in after a fault": ask("fade in"),
    "known error": lambda lab, *_: lab.fail(ServoFault("the loop ended")),
    "open again": ask("fade in"),
    "bug": lambda lab, *_: lab.fail(RuntimeError("out of ideas")),
    "the same bug": lambda lab, *_: lab.fail(RuntimeError("out of ideas")),
    "bug while opening": lambda lab, *_: lab._opening.failed.emit(KeyError("x")),
    "device": ask("device", "mouse"),
    "no device": ask("device", "falcon"),
    "cancelled": ask("cancel"),
    "back": ask("device", "scripted"),
    "cannot be closed": lambda _lab, live, _folder: setattr(live, "close", raising(ServoFault("the servo is stuck"))),
    "stuck bug": lambda lab, *_: lab.fail(ValueError("second")),
    "opened anew": ask("fade in"),
    "stuck": lambda _lab, live, _folder: setattr(live, "close", raising(ServoFault("the servo is stuck"))),
    "left": ask("leave"),
    "a knob after it": ask("change", "liquid.density_kg_m3", 1000.0, False),
}
OPENING = ("entered", "fade in after a fault", "open again", "device", "no device", "back", "opened anew")


def test_every_signal(qtbot: Any, tmp_path: Path, monkeypatch: Any, caplog: Any) -> None:
    from study_app.gui.lab.view import LabPlace

    monkeypatch.setattr(lab_controller, "STARTS_AFTER_MS", 0)
    at_hand = "study_app.app.lab_controller.available_liquids"
    monkeypatch.setattr(at_hand, lambda saved: (Choice(source=saved[-1], liquid="new", title="New"),))
    (tmp_path / "broken.toml").write_text("format = 2", encoding="utf-8", newline="\n")
    events: list[str] = []
    lives = [Recorded(events)]

    def open_live(name: str, *, progress: Any, cancelled: Any) -> Recorded:
        progress(f"open {name}")
        events.append(f"open {name} {cancelled()}")
        if name == "falcon":
            raise DeviceNotFound("none is plugged in")
        lives.append(Recorded(events))
        return lives[-1]

    place = LabPlace()
    qtbot.addWidget(place)
    place.message.connect(lambda *words: events.append(f"message {words}"))
    honey, syrup = (Choice(source="rek2024", liquid=name, title=name.title()) for name in ("honey", "syrup"))
    lab = LabController(
        place, device="scripted", open_live=open_live, chance=random.Random(1), make_appraiser=lambda: lives[0],  # noqa: S311
        bench=Workbench(honey.setting(), syrup.setting()), liquids=(honey, syrup),
    )  # fmt: skip
    lab._cost_due.setInterval(10**8)
    lab.frames.setInterval(10**8)
    lines, before = [], list[str]()
    for name, step in STEPS.items():
        events.clear()
        caplog.clear()
        live = lives[0] if name in ("old costs", "costs", "appraiser died") else lives[-1]
        step(lab, live, tmp_path)
        if name in OPENING:
            qtbot.waitUntil(lambda: lab._opening.busy_with is None, timeout=SOON_MS)
        timers = [lab.frames.isActive(), lab._due.isActive(), lab._cost_due.isActive()]
        lab._draw_frame()
        view = lab.view()
        view_lines = value_lines(
            replace(view, liquids=(), paths=(), workbench=None, device=replace(view.device, choices=())), "view"
        )
        stable_text = (
            line.replace(repr(str(tmp_path))[1:-1], "FOLDER").replace(str(tmp_path), "FOLDER") for line in view_lines
        )
        after = [f"timers: {timers}", f"bench: {short(lab.bench)}", *stable_text]
        lines += [
            f"== {name}",
            *events,
            *(f"log {record.levelname} {record.getMessage()}" for record in caplog.records),
        ]
        lines += changed(before, after)
        before = after
        if name == "path":
            with monkeypatch.context() as patch:
                patch.setattr(Recorded, "tail", lambda _live, side: side)
                assert (lab.view().tail_a, lab.view().tail_b) == ("A", "B")
    lab.end(PATIENCE)
    caplog.clear()
    lines += [*map(str, sorted(path.name for path in tmp_path.iterdir()))]
    stable_text = (line.replace(repr(str(tmp_path))[1:-1], "FOLDER").replace(str(tmp_path), "FOLDER") for line in lines)
    check_kept(Path(__file__).with_name("lab.txt"), what_comes(stable_text))


def test_the_parts_of_a_tick_are_listed_by_their_price_and_absent_ones_last() -> None:
    effects = (
        EffectCost("history", None, "not used"), EffectCost("drag", 10.0), EffectCost("wake", 80.0),
        EffectCost("buoyancy", None, "no measurement"),
    )  # fmt: skip
    rows = lab_controller._cost_rows(Costs(tick_ns=160.0, rest_ns=60.0, effects=effects))
    assert [(row.effect, row.ns, row.why) for row in rows] == [
        ("Wake", 80.0, ""), ("Servo alone", 60.0, ""), ("Drag", 10.0, ""), ("History", None, "not used"),
        ("Buoyancy", None, "no measurement"),
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("errors", "values", "note"),
    [
        (
            Errors(wake=2e-15, force_n=0.00099, lag_s=0.0095, left_out=()),
            ["2e−15", "< 0.001 N", "9.5 ms"],
            "along programmed paths",
        ),
        (
            Errors(wake=3.4e-7, force_n=0.001, lag_s=-1e-6, left_out=("history", "buoyancy")),
            ["3e−7", "0.001 N", "0.0 ms"],
            "for drag and wake only; no reference exists for history, buoyancy",
        ),
        (
            Errors(wake=None, force_n=None, lag_s=0.0, left_out=()),
            ["no wake", "no drag", "0.0 ms"],
            "along programmed paths",
        ),
        (
            Errors(wake=0.0, force_n=0.1236, lag_s=0.02, left_out=()),
            ["0", "0.124 N", "20.0 ms"],
            "along programmed paths",
        ),
    ],
)
def test_the_errors_of_a_setting_are_stated_with_their_scope(errors: Errors, values: list[str], note: str) -> None:
    rows = lab_controller._error_rows(errors)
    assert [row.value for row in rows] == values
    assert [(row.measure, row.note) for row in rows] == [
        ("Largest relative wake error", note),
        ("Largest force error", note),
        ("Velocity filter lag", "at constant acceleration"),
    ]


def test_liquids_of_a_file_are_listed_once_however_often_it_is_opened(tmp_path: Path) -> None:
    file, honey = tmp_path / "oils.toml", Choice(source="rek2024", liquid="honey", title="Honey")
    table = "[liquids.{}]\ndensity_kg_m3 = 900\n"
    file.write_text(f"format = 2\n{table.format('thin_oil')}{table.format('thick')}", encoding="utf-8", newline="\n")
    saving = lab_controller._LabSaving((honey,))
    for _ in range(2):
        assert saving.open_liquids(file).liquid == "thin_oil"
    assert [choice.liquid for choice in saving.liquids] == ["honey", "thin_oil", "thick"]
    assert saving.said == "Opened oils.toml: Thin oil, Thick"
