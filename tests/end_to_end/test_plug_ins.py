"""Plug-ins: the template of all kinds is installed, used and uninstalled; one that fails ends nothing but itself."""

import json
import os
import socket
import subprocess
import sys
import venv
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from PySide6.QtCore import QPoint, Qt
from PySide6.QtTest import QTest
from PySide6.QtWidgets import QApplication

from study_app import cli
from study_app.analysis.findings import all_findings
from study_app.devices.registry import open_device
from study_app.errors import PlugInError
from study_app.gui.participant.window import ParticipantWindow
from study_app.outlets.session_outlets import Outlets
from study_app.protocol.load import load
from study_app.protocol.wording.languages import words
from study_app.session.pages import QuestionnairePage
from study_app.session.transitions.events import Chosen
from study_app.store.receipt import plug_ins_of
from tests.compiled import needs_servo
from tests.designer.support.designer import Designer
from tests.gui.small import ManualClock
from tests.plug_in_packages import EXAMPLES, forget_plug_ins, install
from tests.studies import rehearsed

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("quick_pdf")]

TEMPLATE = EXAMPLES / "liquid_study_plug_ins"
STUDY = TEMPLATE / "example.toml"
PACKAGE = "liquid-study-template"
PIP = ("--disable-pip-version-check", "-q")


def pip(*arguments: str) -> None:
    subprocess.run([sys.executable, "-m", "pip", *arguments], check=True, capture_output=True)


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the wheel of the template."""
    folder = tmp_path_factory.mktemp("wheel")
    pip("wheel", *PIP, "--no-deps", "--no-build-isolation", "--no-index", "-w", str(folder), str(TEMPLATE))
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(built: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    pip("install", *PIP, "--no-deps", "--no-index", "--target", str(folder), str(built))
    return folder


@pytest.fixture
def template(installed: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Have the template installed."""
    monkeypatch.syspath_prepend(installed)
    forget_plug_ins()
    yield
    forget_plug_ins("liquid_study_template")


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Any:
    """Return a function that runs a command: its exit code, output and errors."""

    def command(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["liquid-study", *map(str, arguments)])
        capsys.readouterr()
        with pytest.raises(SystemExit) as ended:
            cli.main()
        return (int(ended.value.code or 0), *capsys.readouterr())

    return command


def test_a_plug_in_is_installed_and_uninstalled(built: Path, tmp_path: Path) -> None:
    venv.create(tmp_path / "venv", with_pip=False, symlinks=os.name == "posix")
    python = str(next((tmp_path / "venv").glob("[bS]*/python*")))
    around = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path))}

    def program(*arguments: str) -> tuple[int, list[str]]:
        command = [python, "-m", "study_app", *arguments]
        process = subprocess.run(command, env=around, capture_output=True, text=True, check=False)
        return process.returncode, (process.stdout + process.stderr).splitlines()

    none = program("plugins")
    assert none == (0, ["No plug-ins are installed; docs/plug-ins.md explains how to write one."])
    pip("--python", python, "install", *PIP, "--no-deps", "--no-index", str(built))
    code, (where, *lines) = program("plugins")
    assert (code, where.partition("  (")[0]) == (0, f"{PACKAGE} 1.0")
    assert [line.split() for line in lines] == [
        ["device", "light-hand"],
        ["question", f"{PACKAGE}:grid"],
        ["task", f"{PACKAGE}:circle"],
        ["method", f"{PACKAGE}:limits"],
        ["finding", f"{PACKAGE}:ends_of_scale"],
        ["outlet", "udp"],
    ]
    assert program("check", str(STUDY))[0] == 0
    pip("--python", python, "uninstall", *PIP, "-y", PACKAGE)
    assert program("plugins") == none
    code, (first, *problems) = program("check", str(STUDY))
    assert code == 2
    assert program("run", str(STUDY), "--participant", "P001", "--windowed") == (2, [first, *problems])
    assert [line.partition(": ")[2] for line in problems] == [
        f'{place}.kind: "{PACKAGE}:{name}" is a {kind} from the plug-in {PACKAGE}, which is not installed '
        f"(pip install {PACKAGE})"
        for place, kind, name in (
            ("methods.limits", "method", "limits"),
            ("tasks.circle", "task", "circle"),
            ("questionnaires.mood.items.1", "question", "grid"),
        )
    ]


def test_the_designer_names_a_plug_in_that_is_not_installed(
    qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    designer = Designer(tmp_path)
    designer.file.write_text(
        STUDY.read_text("utf-8").replace('name = "plugins"', 'name = "kitchen"'), encoding="utf-8", newline="\n"
    )
    designer.open("kitchen", "tasks", "circle")
    missing = f'"{PACKAGE}:circle" is a task from the plug-in {PACKAGE}, which is not installed (pip install {PACKAGE})'
    assert designer.form_row("tasks", "circle", "kind").row.faults == (missing,)
    designer.close()


@pytest.mark.usefixtures("template")
class TestTemplate:
    def test_its_keys_are_rows_of_the_designer_and_of_the_schema(
        self, run: Any, qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        schema = json.loads(run("check", "--schema", "protocol")[1])["$defs"]
        assert {f"{PACKAGE}:{name}" for name in ("grid", "circle", "limits")} <= {
            property_schema["title"] for property_schema in schema.values()
        }
        monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
        designer = Designer(tmp_path)
        designer.file.write_text(
            STUDY.read_text("utf-8").replace('name = "plugins"', 'name = "kitchen"'), encoding="utf-8", newline="\n"
        )
        designer.open()
        labels = {}
        for path in (("questionnaires", "mood", "items", 0), ("tasks", "circle"), ("methods", "limits")):
            designer.go_to(*path)
            labels[path[0]] = {row.row.label for row in designer.place.form.rows}
        assert {"Left", "Right", "Lower", "Upper", "Cells"} <= labels["questionnaires"]
        assert {"Circle", "Turns", "Turn", "Instruction"} <= labels["tasks"]
        assert {"Levels", "Series"} <= labels["methods"]
        designer.form_row("methods", "limits", "levels").field.line.setFocus()
        QTest.keyClick(designer.keyboard, Qt.Key.Key_A, Qt.KeyboardModifier.ControlModifier)
        QTest.keyClicks(designer.keyboard, "7")
        QTest.keyClick(designer.keyboard, Qt.Key.Key_Tab)
        assert designer.value("methods", "limits", "levels") == 7
        assert designer.study.problems == ()
        designer.close()

    def test_its_question_is_answered_by_mouse_and_keys(self, qtbot: Any) -> None:
        study = load(str(STUDY))
        form = study.forms["mood"]
        items = tuple(item.view(number, form.context(study.scales, "en")) for number, item in enumerate(form.items, 1))
        window = ParticipantWindow(words("en"), clock=ManualClock(), windowed=True)
        qtbot.addWidget(window)
        actions: list[Any] = []
        window.event.connect(actions.append)
        window.resize(1366, 768)
        window.show()
        window.show_page(
            QuestionnairePage(
                trial=None,
                title="Mood",
                intro="Choose.",
                items=items,
                labels=(),
                cannot_judge=None,
                progress=None,
                form="mood",
            )
        )
        QApplication.processEvents()
        cells = window.widget.fields[0].cells  # type: ignore[union-attr]
        square = cells.place()
        QTest.mouseClick(cells, Qt.MouseButton.LeftButton, pos=QPoint(int(square.left()) + 3, int(square.bottom()) - 3))
        for key in (Qt.Key.Key_Right, Qt.Key.Key_Up, Qt.Key.Key_Down, Qt.Key.Key_Down):
            QTest.keyClick(cells, key)
        assert [action.value for action in actions if isinstance(action, Chosen)] == ["1 1", "2 1", "2 2", "2 1"]
        window.may_close = True
        window.close()

    @needs_servo
    def test_a_session_has_all_of_it_and_outlives_it(
        self, run: Any, tmp_path: Path, installed: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        folder = tmp_path / "results"
        code, _, output = run("rehearse", STUDY, "--participants", 2, "--device", "light-hand", "--results", folder)
        assert (code, output) == (0, "")
        names = f"device light-hand, method {PACKAGE}:limits, question {PACKAGE}:grid, task {PACKAGE}:circle"
        line = f"plug-in {PACKAGE} 1.0: {names}\n"
        assert run("verify", folder)[:2] == (0, f"{line}2 sessions: sound\n")
        assert run("unblind", folder, "--by", "AK", "--reason", "test")[0] == 0
        page, document = tmp_path / "report" / "report.html", tmp_path / "report" / "report.json"
        assert run("report", folder, "--to", page.parent)[::2] == (0, "")
        html = page.read_text("utf-8")
        for text in ("mean column", "Answers at the ends of the scale", f"Plug-in {PACKAGE} 1.0", "Thresholds"):
            assert text in html
        (used,) = json.loads(document.read_bytes())["plug_ins"].values()
        assert used == [*names.split(", "), f"finding {PACKAGE}:ends_of_scale"]
        exported = {path.name: path.read_bytes() for path in page.parent.glob("*trials*.csv")}
        monkeypatch.setattr(sys, "path", [path for path in sys.path if path != str(installed)])
        forget_plug_ins("liquid_study_template")
        code, output, _ = run("verify", folder)
        assert (code, output.count("warning")) == (0, 1)
        assert f"of {PACKAGE} 1.0, which is not installed" in output
        assert run("report", folder, "--to", tmp_path / "later")[::2] == (0, "")
        assert {path.name: path.read_bytes() for path in (tmp_path / "later").glob("*trials*.csv")} == exported
        assert run("export", folder, "--to", tmp_path / "tables")[0] == 0
        code, _, output = run("reproduce", folder / "data" / "sub-P001" / "ses-01")
        assert (code, output.count("\n")) == (2, 1)
        assert f"the plug-in {PACKAGE}, which is not installed: pip install {PACKAGE}" in output

    def test_its_outlet_is_fed(self) -> None:
        class Servo:
            rate_hz, telemetry = 1000.0, None

            def now_ns(self) -> int:
                return 0

        from study_app.outlets.markers import marker_of

        receiver = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        receiver.bind(("127.0.0.1", 0))
        receiver.settimeout(10)
        outlets = Outlets((f"udp:127.0.0.1:{receiver.getsockname()[1]}", "udp:nowhere"), "off", Servo(), "double")
        marker = marker_of("trial_started", 1.5, 0, {"trial": 3})
        assert marker is not None
        outlets.mark(marker)
        assert receiver.recv(1000).decode() == marker.text
        outlets.close()
        receiver.close()
        assert outlets.lost == {"UDP markers": "udp:nowhere is no address: write udp:HOST:PORT"}
        (used,) = plug_ins_of(load("demo"), "mouse", ["UDP markers", "LSL markers"])
        assert used == {"kind": "outlet", "name": "udp", "package": PACKAGE, "version": "1.0"}


QUESTION = """
    from typing import ClassVar, Literal
    from study_app.protocol.questions import Text

    class Toy(Text):
        measure: ClassVar[str] = "toy_plug:MEASURE"
        kind: Literal["toy-plug:toy"] = "toy-plug:toy"

        def problem(self, answer, context):
            {problem}

    class MEASURE:
        id = "toy"

        @staticmethod
        def of(asked, answers):
            {measure}

        @staticmethod
        def cells(asked, numbers):
            return {{"n": "1"}}
"""
TOY_STUDY = (
    STUDY.read_text("utf-8")
    .replace(f'kind = "{PACKAGE}:limits"\nlevels = 5\nseries = 2', 'kind = "constant"\nlevels = 2\nrepetitions = 1')
    .replace(f'kind = "{PACKAGE}:circle"\nturns = 1', 'kind = "explore"\nmin_s = 0.2\nmax_s = 1')
    .replace(f'kind = "{PACKAGE}:grid"', 'kind = "toy-plug:toy"')
    .replace('left = "unpleasant"\nright = "pleasant"\nlower = "sleepy"\nupper = "awake"\n', "")
)


@needs_servo
def test_a_fault_of_a_plug_in_is_one_line_and_loses_no_data(
    run: Any, site: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    study, folder = tmp_path / "toy.toml", tmp_path / "results"
    study.write_text(TOY_STUDY, encoding="utf-8", newline="\n")
    points = {"toy": "toy_plug:Toy"}
    install(site, "toy_typo", "outlet", {"toy": "toy-typo:Toy"})
    install(site, "toy-plug", "question", points, toy_plug=QUESTION.format(problem="1 / 0", measure="1 / 0"))
    code, _, output = run("rehearse", study, "--participants", 1, "--results", folder)
    line = "the plug-in toy-plug 1.0 failed (ZeroDivisionError: division by zero): update or uninstall the plug-in"
    assert (code, output.splitlines()[-1], "Traceback" in output) == (2, f"liquid-study: {line}", False)
    (logged,) = caplog.records  # with its trace, which no terminal shows
    assert (logged.getMessage(), bool(logged.exc_info)) == (line, True)
    caplog.clear()
    code, output, _ = run("verify", folder)
    assert (code, output.splitlines()[-1]) == (0, "1 session: sound")
    assert len((folder / "data/sub-P001/ses-01").glob("*responses*").__next__().read_text("utf-8").splitlines()) == 3
    (site / "toy_plug.py").write_text(
        (site / "toy_plug.py").read_text("utf-8").replace("1 / 0", "return None", 1), encoding="utf-8", newline="\n"
    )
    forget_plug_ins("toy_")
    other = tmp_path / "others"
    assert run("rehearse", study, "--participants", 1, "--results", other)[0] == 0
    assert run("unblind", other, "--by", "AK", "--reason", "test")[0] == 0
    code, _, output = run("report", other, "--to", tmp_path / "report")
    assert (
        output.count("the plug-in toy-plug 1.0 failed (ZeroDivisionError: division by zero)") == output.count("\n") == 1
    )
    assert "Smooth" in (tmp_path / "report" / "report.html").read_text("utf-8")


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        ("raise RuntimeError('no such\\nlibrary')", "RuntimeError: no such library"),
        ("raise SystemExit('no licence')", "SystemExit: no licence"),
        (
            QUESTION.replace(' = "toy-plug:toy"', ""),
            "its kind does not have a default: set the default to the value of the Literal",
        ),
        ("Toy = 3", "toy_plug:Toy is not a subclass of Question"),
        (QUESTION.replace("toy-plug:toy", "mood"), "its kind is 'mood': use 'toy-plug:' followed"),
        (QUESTION.replace('"toy_plug:MEASURE"', "LATER"), "NameError: name 'LATER' is not defined"),
        (QUESTION.replace("def problem", "x: slice\n\n        def problem"), "PydanticSchemaGenerationError"),
    ],
)
def test_an_unusable_plug_in_is_one_line_and_does_not_hide_others(
    run: Any, site: Path, tmp_path: Path, source: str, reason: str
) -> None:
    whole = source.format(problem="return None", measure="return {}") if "MEASURE" in source else source
    install(site, "toy-plug", "question", {"toy": "toy_plug:Toy"}, toy_plug=whole)
    code, output, _ = run("plugins")
    (_, line) = output.splitlines()
    assert code == 3
    assert line.startswith(f"    question  toy: {reason}")
    assert line.endswith("; update or uninstall the plug-in")
    study = tmp_path / "toy.toml"
    study.write_text(TOY_STUDY, encoding="utf-8", newline="\n")
    code, _, output = run("check", study)
    assert code == 2
    assert f'"toy-plug:toy" is a question that the plug-in toy-plug 1.0 does not provide: {reason}' in output
    assert run("check", "demo")[0] == 0


@pytest.mark.parametrize(("name", "value"), [("place", "'first'"), ("row_place", "None")])
def test_a_finding_whose_place_is_not_a_number_is_reported_and_left_out(
    run: Any, site: Path, name: str, value: str
) -> None:
    source = f"""
        from study_app.analysis.findings.finding import Finding

        class Toy(Finding):
            key = "toy"
            {name} = {value}
    """
    install(site, "toy-plug", "finding", {"toy": "toy_plug:Toy"}, toy_plug=source)
    code, output, _ = run("plugins")
    assert (code, f"toy: Toy has the {name} {value}: specify a number; update" in output) == (3, True)
    assert "toy" not in {finding.key for finding in all_findings()}


@pytest.mark.parametrize(
    ("kind", "base", "lacks"),
    [("method", "trials.methods:Method", "level, levels_of, presentations"), ("task", "trials.tasks:Task", "limit_s")],
)
def test_a_plug_in_class_without_a_required_member_is_named(
    run: Any, site: Path, kind: str, base: str, lacks: str
) -> None:
    module, _, name = base.partition(":")
    source = f"""
        from typing import Literal
        from study_app.protocol.{module} import {name}

        class Toy({name}):
            kind: Literal["toy-plug:toy"] = "toy-plug:toy"
    """
    install(site, "toy-plug", kind, {"toy": "toy_plug:Toy"}, toy_plug=source)
    code, output, _ = run("plugins")
    assert (code, f"toy: toy_plug:Toy lacks {lacks}: define them; update" in output) == (3, True)


IN_STUDY = {
    "Circle": ('kind = "explore"\nmin_s = 0.2\nmax_s = 1', 'kind = "toy-plug:circle"\nturns = 1'),
    "Limits": ('kind = "constant"\nlevels = 2\nrepetitions = 1', 'kind = "toy-plug:limits"\nlevels = 5\nseries = 2'),
    "Grid": ('kind = "text"', 'kind = "toy-plug:grid"\nleft = "-"\nright = "+"\nlower = "sleepy"\nupper = "awake"'),
}


@pytest.fixture
def study_with(site: Path, tmp_path: Path) -> Callable[[str, str, str, str], Path]:
    """Return a function that installs an edited class of the template as toy-plug, and returns a study with it."""

    def edited(kind: str, name: str, old: str, new: str) -> Path:
        source = (TEMPLATE / f"src/liquid_study_template/{kind}.py").read_text("utf-8")
        assert source.count(old) == 1
        changed = source.replace(old, new).replace(PACKAGE, "toy-plug")
        install(site, "toy-plug", kind, {"toy": f"toy_plug:{name}"}, toy_plug=changed)
        text = TOY_STUDY.replace('kind = "toy-plug:toy"', 'kind = "text"')
        assert IN_STUDY[name][0] in text
        (tmp_path / "toy.toml").write_text(text.replace(*IN_STUDY[name]), encoding="utf-8", newline="\n")
        return tmp_path / "toy.toml"

    return edited


LIMIT = "self.turns * self.turn_s"
ANGLE = "angle = 2 * math.pi * t_s / self.turn_s\n"
PRESENTED = "return self.levels * self.series"
LEVELS = "return stimulus.spaced(self.levels)"
VIEW = "return self._make_view(GridView"


@needs_servo
@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("question Grid", VIEW, f"{VIEW[:6]} None and {VIEW[7:]}", "returned None, not an instance of ItemView"),
        ("task Circle", LIMIT, "math.nan", "limit_s of task toy-plug:circle returned nan, not a number from 0.1"),
        ("task Circle", ANGLE, "angle = math.nan\n", "returned (nan, nan, 0.0), not three coordinates [m] or None"),
        ("task Circle", ANGLE, "raise SystemExit(5)\n", "SystemExit: 5"),
        ("method Limits", PRESENTED, "return 10**9", "returned 1000000000, not a whole number from 1 to 10,000"),
        (
            "method Limits",
            LEVELS,
            "return ()",
            "levels_of of method toy-plug:limits returned (), not at least one number",
        ),
    ],
)
def test_a_wrong_value_is_one_line_that_names_the_plug_in(
    run: Any, study_with: Any, tmp_path: Path, name: str, old: str, new: str, said: str
) -> None:
    study, folder = study_with(*name.split(), old, new), tmp_path / "results"
    code, _, lines = run("rehearse", study, "--participants", 1, "--results", folder)
    assert (code, "Traceback" in lines) == (2, False)
    line = lines.splitlines()[-1]
    assert "the plug-in toy-plug 1.0 failed (" in line
    assert said in line
    assert line.endswith("): update or uninstall the plug-in")
    assert not (folder / "data").exists() or run("verify", folder)[0] == 0


@needs_servo
def test_an_answer_of_a_plug_in_that_is_too_long_is_refused(run: Any, study_with: Any, tmp_path: Path) -> None:
    study = study_with(
        "question", "Grid", 'return f"{column} {1 + int(self.cells * draw())}"', "return 'x' * 5_000_000"
    )
    code, _, lines = run("rehearse", study, "--participants", 1, "--results", tmp_path / "results")
    assert code == 2
    assert "has 5,000,000 characters: at most 5,000 are permitted" in lines
    assert "toy-plug:grid" in lines
    assert run("verify", tmp_path / "results")[0] == 0


DEVICE = (TEMPLATE / "src/liquid_study_template/device.py").read_text("utf-8")


def test_a_plug_in_device_that_exits_or_fails_to_open_is_named(run: Any, site: Path) -> None:
    probes = DEVICE.replace("probe=lambda: [", "probe=lambda: exit(3) or [")
    install(site, "toy-plug", "device", {"toy": "toy_plug:LIGHT_HAND"}, toy_plug=probes)
    code, output, _ = run("devices")
    assert code == 0
    assert "the plug-in toy-plug 1.0 failed (SystemExit: 3)" in output
    assert "falcon" in output
    forget_plug_ins("toy_")
    (site / "toy_plug.py").write_text(
        DEVICE.replace("return opened(LightHand())", "return None"), encoding="utf-8", newline="\n"
    )
    with pytest.raises(PlugInError, match=r"toy-plug 1\.0 failed \(open of device light-hand returned None"):
        open_device("light-hand")


def test_a_plug_in_that_is_interrupted_at_its_import_is_a_line(run: Any, site: Path) -> None:
    install(site, "toy-plug", "device", {"toy": "toy_plug:X"}, toy_plug="raise KeyboardInterrupt")
    code, output, _ = run("plugins")
    assert (code, "device    toy: KeyboardInterrupt; update or uninstall the plug-in" in output) == (3, True)


def test_a_finding_that_returns_none_does_not_affect_other_tests(run: Any, site: Path, tmp_path: Path) -> None:
    source = """
        from study_app.analysis.findings.finding import Finding

        class Toy(Finding):
            key, what, place = "toy", "toys", 0

            @classmethod
            def test(cls, answers, found):
                return None
    """
    install(site, "toy-plug", "finding", {"toy": "toy_plug:Toy"}, toy_plug=source)
    study = rehearsed(tmp_path)
    assert run("unblind", study, "--by", "AK", "--reason", "test")[0] == 0
    code, _, output = run("report", study, "--to", tmp_path / "report")
    lines = output.splitlines()
    assert code == 3
    assert all(
        "the plug-in toy-plug 1.0 failed (test of finding toy returned None, not a value and" in line for line in lines
    )
    assert "all tests of block" not in (tmp_path / "report/report.html").read_text("utf-8")
