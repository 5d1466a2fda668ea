"""Actions and seconds per task of the study designer: python tests/benchmarks/windows/designer_tasks.py [--only N[,N]].

Prints a table. ``--only`` does the tasks of these numbers, after the first one of the table, 1, which opens the
designer; 8 needs 7.

Each task is done once by keys alone and once by the mouse alone (texts and numbers are typed), with real events in a
real window of 1366 × 768 on a virtual display of its own. A key, a typed text, a click and a notch of the wheel are an
action each. The program runs in another process, which is killed in the task that continues after a kill.
"""

import argparse
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[3]))

from PySide6.QtTest import QTest
from PySide6.QtWidgets import QLabel, QPlainTextEdit

from study_app.designer.document.study import read_study
from study_app.designer.header import DesignerHeader
from study_app.designer.problems import ProblemsCard
from study_app.gui.widgets.controls import ActionButton
from study_app.protocol.source.files import shipped_file
from study_app.store.versions.drafts import draft_of
from tests.designer.support.inputs import name_of, wait_until
from tests.designer.support.made_studies import begin, participant, save
from tests.designer.support.program import environment, use
from tests.designer.support.users import USERS, KeyUser, User
from tests.end_to_end.real_windows import virtual_display

FAULTS = (
    ("force_limit_n = 6 ", "force_limit_n = 60 "),
    ('kind = "explore"', 'kind = "explor"'),
    ('kind = "debrief"', 'kind = "debrif"'),
    ('liquid = "thick"', 'liquid = "thik"'),
    ('task = "explore"', 'task = "explor"'),
)
"""What is broken in the demo: each has a repair."""


class Tasks:
    """The tasks, each an act of a user in the workspace of ``folder``."""

    def __init__(self, user: User, folder: Path) -> None:
        self.user, self.protocols = user, folder / "protocols"

    def header(self) -> DesignerHeader:
        """Return the header of the designer."""
        (headers,) = self.user.window.findChildren(DesignerHeader)
        return headers

    def document(self, name: str) -> dict[str, object]:
        """Return the draft or the file of a study."""
        draft = draft_of(self.protocols / f"{name}.toml")
        text = self.protocols.joinpath(f"{name}.toml").read_bytes() if draft is None else draft.text.encode()
        return dict(read_study(text, self.protocols).document)

    def template(self) -> None:
        """A study from "Compare liquids" with its own title and a second language, saved."""
        user = self.user
        user.press("New study…*")
        user.write("Title", "Three drinks", accept=False)
        user.press("Language Dutch")
        user.press("Make study")
        wait_until(lambda: user.sees("Save"), "the study")
        save(user, self.protocols / "threedrinks.toml")

    def question(self) -> None:
        """One more question in both languages, seen on the page."""
        user = self.user
        user.select("Liquid", "Questionnaires")
        user.press("Add to Items")
        user.write("Text, English", "I could drink this.")
        user.write("Text, Dutch", "Ik zou dit kunnen drinken.")
        wait_until(lambda: "drinken" in str(self.document("threedrinks")["questionnaires"]), "the text")

    def delays(self) -> None:
        """Create delays of 0, 60, 120 and 240 ms in a Williams design, and read the balanced sample size."""
        user = self.user
        user.choose("Study", "New study…")
        user.press("Template Empty study")
        user.write("Title", "Four delays", accept=False)
        user.press("Make study")
        user.select("Water", "Conditions")
        user.shortcut("ctrl+shift+d", "Series of Water")
        user.type("60 120 240")
        user.key("Return")
        user.select("Liquids", "Session, in order")
        user.choose("Order", "Williams")
        QTest.qWait(1500)
        words = [label.text() for label in user.window.findChildren(QLabel) if label.isVisible()]
        assert any("12 participants complete 3 rounds of 4" in label_text for label_text in words), words

    def changes(self) -> None:
        """What differs from the version that was saved."""
        self.user.choose("Study", "Three drinks  ·  threedrinks.toml")
        self.user.choose("Study view", "Changes")
        texts = self.user.window.findChildren(QPlainTextEdit)
        wait_until(
            lambda: any(text.toPlainText() for text in texts if text.accessibleName() == "Differences"), "differences"
        )

    def rename(self) -> None:
        """Rename a liquid, delete another one with its dependents, and undo both."""
        user = self.user
        user.select("Water", "Liquids")
        user.write("ID", "sea")
        user.select("Honey", "Liquids")
        user.shortcut("Delete", "Delete")
        user.press("Delete them too")
        for _ in range(2):
            user.shortcut("ctrl+z", "Undo*")
        QTest.qWait(1500)
        assert {"water", "honey"} <= set(self.document("threedrinks")["liquids"])  # type: ignore[call-overload]

    def faults(self) -> None:
        """Repair a file with five faults."""
        user = self.user
        user.choose("Study", "A first look  ·  faulty.toml")
        wait_until(lambda: self.header().problems.chip_text == f"{len(FAULTS)} problems", "the problems")
        user.shortcut("ctrl+4", name_of(self.header().problems))
        (card,) = user.window.findChildren(ProblemsCard)
        if not card.isVisible():
            user.press(name_of(self.header().problems))
        for _ in range(12):
            if self.header().problems.chip_text.startswith("No") or "warning" in self.header().problems.chip_text:
                break
            offered = lambda: [  # noqa: E731 - looked for anew
                button
                for button in card.findChildren(ActionButton)
                if button.isVisible() and button.isEnabled() and ": " in button.accessibleName()
            ]
            wait_until(offered, "a repair", 60_000)
            user.press(name_of(offered()[0]))
        assert "problem" not in self.header().problems.chip_text.removeprefix("No problem"), (
            self.header().problems.chip_text
        )

    def played(self) -> None:
        """A study of thickness by two intervals from a template, played from its tenth trial."""
        user = self.user
        if isinstance(user, KeyUser):
            user.key("ctrl+5")
        user.choose("Study", "New study…")
        user.press("Template Viscosity JND")
        user.write("Title", "Thicker", accept=False)
        user.press("Make study")
        user.select("Viscosity", "Session, in order")
        user.choose("Study view", "Participant")
        for _ in range(9):
            user.press("Next step")
        user.shortcut("F5", "Play from here")
        wait_until(participant, "the participant's window", 300_000)
        user.hand.bring_forward(user.window)
        user.press("Stop")
        wait_until(lambda: user.sees("Delete"), "the end of the pilot")

    def measures(self) -> None:
        """Are the planned people enough, and which level is clipped."""
        user = self.user
        user.select("Viscosity", "Session, in order")
        user.choose("Study view", "Measures")
        wait_until(lambda: any("studies within ±" in label.text() for label in user.window.findChildren(QLabel)
                               if label.isVisible()), "the numbers", 120_000)  # fmt: skip


TASKS: tuple[Callable[[Tasks], None], ...] = (
    Tasks.template, Tasks.question, Tasks.rename, Tasks.delays, Tasks.changes, Tasks.faults, Tasks.played,
    Tasks.measures,
)  # fmt: skip
AFTER_A_KILL = "The program is killed in the middle; continue"
NUMBERS = range(1, len(TASKS) + 2)
"""The numbers of the tasks, with the one after a kill."""


def act_tasks(kind: str, folder: Path, *numbers: str) -> None:
    """Do tasks in one window; print the actions of each."""

    def act(user: User) -> None:
        tasks = Tasks(user, folder)
        for task in (TASKS[int(number) - 1] for number in numbers):
            before, since = user.actions, time.perf_counter()
            try:
                task(tasks)
            except AssertionError as error:
                print(f"not done ({error})\t{task.__doc__}", flush=True)
            else:
                print(f"{user.actions - before} in {time.perf_counter() - since:.0f} s\t{task.__doc__}", flush=True)

    use(kind, act)


def act_killed(kind: str, folder: Path) -> None:
    """Type into a study and report it; the process is then killed."""

    def act(user: User) -> None:
        begin(user, "Empty study", "Killed")
        user.select("Welcome", "Session, in order")
        user.write("Title", "Typed before the kill")
        wait_until(lambda: "before the kill" in str(draft_of(folder / "protocols" / "killed.toml")), "the draft")
        print("typed", flush=True)
        QTest.qWait(600_000)

    use(kind, act)


def act_continued(kind: str, folder: Path) -> None:
    """Continue a study after a kill."""

    def act(user: User) -> None:
        since = time.perf_counter()
        user.press("Continue Killed, killed")
        wait_until(lambda: user.sees("Save"), "the study")
        save(user, folder / "protocols" / "killed.toml")
        assert "before the kill" in (folder / "protocols" / "killed.toml").read_text("utf-8")
        print(f"{user.actions} in {time.perf_counter() - since:.0f} s\t{AFTER_A_KILL}", flush=True)

    use(kind, act)


ACTS: dict[str, Callable[..., None]] = {"tasks": act_tasks, "killed": act_killed, "continued": act_continued}


def main(numbers: Sequence[int]) -> None:
    """Print the table."""
    in_one_window = [str(number) for number in numbers if number <= len(TASKS)]
    acts = [["tasks", *in_one_window], *([["killed"], ["continued"]] if NUMBERS[-1] in numbers else [])]
    counts: dict[str, dict[str, str]] = {}
    for kind in USERS:
        with tempfile.TemporaryDirectory() as name, virtual_display(size=(1366, 768)) as display:
            folder = Path(name)
            (folder / "protocols").mkdir()
            (folder / "results").mkdir()
            text = shipped_file("demo").read_text(encoding="utf-8").replace('name = "demo"', 'name = "faulty"')
            for right, wrong in FAULTS:
                assert right in text, right
                text = text.replace(right, wrong, 1)
            (folder / "protocols" / "faulty.toml").write_text(text, encoding="utf-8", newline="\n")
            here = environment(folder) | {"DISPLAY": display, "QT_QPA_PLATFORM": "xcb", "PYTHONFAULTHANDLER": "1"}
            for act, *more in acts:
                command = [sys.executable, __file__, act, kind, name, *more]
                with subprocess.Popen(command, env=here, stdout=subprocess.PIPE, text=True) as process:
                    assert process.stdout is not None
                    for line in process.stdout:
                        if act == "killed":
                            process.kill()
                            break
                        count, _, task = line.strip().partition("\t")
                        counts.setdefault(task, {})[kind] = count
                if act != "killed" and process.returncode:
                    print(f"{act} by {kind}: the program ended with exit code {process.returncode}", file=sys.stderr)
    print("| task | keys | mouse |")
    print("| --- | --- | --- |")
    for task, task_counts in counts.items():
        print(f"| {task.rstrip('.')} | {task_counts.get('keys', '–')} | {task_counts.get('mouse', '–')} |")


if __name__ == "__main__":
    if sys.argv[1:2] and sys.argv[1] in ACTS:
        ACTS[sys.argv[1]](sys.argv[2], Path(sys.argv[3]), *sys.argv[4:])
    else:
        parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
        parser.add_argument("--only", default=",".join(map(str, NUMBERS)), metavar="N[,N]", help="numbers of tasks")
        asked = {1, *map(int, parser.parse_args().only.split(","))}
        if asked - {*NUMBERS}:
            parser.error(f"the tasks are {NUMBERS[0]} to {NUMBERS[-1]}")
        main(sorted(asked))
