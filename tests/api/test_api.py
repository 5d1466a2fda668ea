"""The stable interface: its signatures, what importing it loads, and that each function is what the program does."""

import inspect
import json
import math
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app import api
from study_app.errors import ProtocolError, SessionError, StudyError
from study_app.haptics.runtime import offline
from study_app.protocol.load import load_scene
from study_app.store.journals import journal
from study_app.store.journals.journal_events import start_of
from study_app.store.verification.whole_study import verify_study
from tests.compiled import needs_servo
from tests.documented import ROOT, blocks
from tests.golden import compare
from tests.platforms import needs_fork
from tests.protocol.forms.mixed import mixed_file
from tests.protocol.trials import level_studies, matching

HERE = Path(__file__).parent
FORM = """
format = 2
sequence = ["about", "last", "stir"]
study.name = "longform"
liquids.thin.density_kg_m3 = 1000
tasks.explore = {{ kind = "explore", min_s = 1, max_s = 2, instruction = "Explore." }}
scales.agree.labels.en = ["1", "2", "3", "4", "5", "6", "7"]
blocks.stir.conditions = ["thin"]
[questionnaires.last]
intro = "Anything else?"
items = [{{ id = "else", kind = "text", text = "Else", short = "Else", required = false }}]
[questionnaires.about]
intro = "How was it?"
scale = "agree"
items = [
{rows}]
"""


def signatures() -> list[str]:
    """Return every public name with its signature; a change is a new version of the interface."""
    lines: list[str] = []
    for name in api.__all__:
        thing = getattr(api, name)
        if inspect.isclass(thing):
            fields = [
                annotation for annotation in inspect.get_annotations(thing).items() if not annotation[0].startswith("_")
            ]
            lines += [f"{name}.{key}: {kind}" for key, kind in fields]
            methods = {key: member for key, member in vars(thing).items() if not key.startswith("_")}
            functions = {
                key: member.fget if isinstance(member, property) else member for key, member in methods.items()
            }
            lines += [
                f"{name}.{key}{inspect.signature(function)}"
                for key, function in functions.items()
                if callable(function)
            ]
        else:
            lines.append(f"{name}{inspect.signature(thing)}")
    return lines


def test_signatures_change_only_with_the_version(request: pytest.FixtureRequest) -> None:
    compare(HERE / "golden" / "signatures.txt", signatures(), request.config)


def test_importing_loads_neither_windows_nor_numbers() -> None:
    code = (
        "import sys, time; at_s = time.process_time(); import study_app.api; print(time.process_time() < at_s + 0.3, "
        "[name for name in ('PySide6', 'numpy', 'pandas', 'numba', 'pydantic') if name in sys.modules])"
    )
    ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert ran.stdout.strip() == "True []"


@needs_servo
def test_forces_equal_those_of_the_servo() -> None:
    t_s = np.arange(400) / 1000
    position_m = np.column_stack([0.05 * np.sin(6 * t_s), 0 * t_s, 0 * t_s])
    forces = api.simulate_force("rek2024", "honey", (t_s, position_m))
    own = offline.simulate(load_scene("rek2024", "honey"), offline.Motion(t_s, position_m))
    assert forces.tobytes() == own.tobytes()
    lighter = api.simulate_force("rek2024", "honey", (t_s, position_m), density_kg_m3=700.0)
    assert lighter.fx_n == pytest.approx(forces.fx_n / 2, rel=1e-9)
    assert len(api.simulate_force("rek2024", "water", "circle")) > 1000


TRIALS = pd.DataFrame({"level": [0.05, 0.1, 0.4, 0.4], "success": [False, True, True, True]})


def test_a_participant_with_only_the_lowest_level_has_a_threshold() -> None:
    fitted = api.fit(TRIALS.assign(level=0.0), levels=(0.02, 1.0), design="yesno")
    assert np.isfinite(fitted.threshold).all()


def open_and_fail(**options: Any) -> None:
    with api.open_force("rek2024", **options):
        pytest.fail("it was opened")


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: api.simulate_force("rek2024", "oil", "circle"), 'there is no liquid "oil"'),
        (lambda: api.load("nothing"), "nothing"),
        (lambda: api.read("nowhere"), "nowhere"),
        (
            lambda: api.rehearse("demo", 0, seed=1),
            "people = 0 is not possible: specify a whole number from 1 to 100000",
        ),
        (lambda: open_and_fail(force_limit_n=-50.0), "= -50 is not possible"),
        (lambda: open_and_fail(force_limit_n=math.nan), "is not possible"),
        (lambda: open_and_fail(force_limit_n=9.0), "at most 8 N, the limit in the file"),
        (lambda: api.fit(TRIALS.drop(columns="success"), levels=(0.02, 1.0)), "trials do not contain success"),
        (lambda: api.fit(TRIALS, levels=(1.0, 0.02)), "levels"),
        (lambda: api.fit(TRIALS, levels=(0.02, 1.0), design="magnitude"), "no threshold .* specify one of abx, 2ifc"),
        (lambda: api.fit(TRIALS.assign(level=math.nan), levels=(0.02, 1.0)), "contains an invalid level"),
        (lambda: api.fit(TRIALS.assign(success=0.5), levels=(0.02, 1.0)), "must contain true or false"),
        (lambda: api.fit(TRIALS[:0], levels=(0.02, 1.0)), "at least one row is needed"),
    ],
)
def test_invalid_arguments_are_reported_in_one_line(call: Any, words: str) -> None:
    with pytest.raises(StudyError, match=words) as raised:
        call()
    assert "\n" not in str(raised.value).strip() or isinstance(raised.value, ProtocolError)


SESSION: dict[str, Any] = {"study": "demo", "participant": "P001", "results": "nowhere", "seed": 1}
WRONG: dict[str, tuple[Any, ...]] = {
    "study": (None, 3, "", "de\0mo", ["demo"]),
    "participant": (None, 7),
    "results": (None, "a\0b", b"bytes"),
    "seed": (None, "x", 1.5, math.nan, True, -1, 10**400, np.float64(3)),
    "session": (None, math.nan, 0, 100, "1"),
    "device": (None, 3),
    "answer": (3, "left"),
    "group": (3,),
    "row_of": (math.nan,),
}
CALLS: dict[str, Any] = {
    **{
        f"open_session {name}": (lambda value, name=name: api.open_session(**{**SESSION, name: value}))
        for name in WRONG
    },
    "load study": api.load,
    "read results": api.read,
    "report results": lambda value: api.report(value, "to"),
    "report to": lambda value: api.report("nowhere", value),
    "unblind by": lambda value: api.unblind("nowhere", by=value, reason="a test"),
    "rehearse people": lambda value: api.rehearse("demo", value, seed=1),
    "rehearse results": lambda value: api.rehearse("demo", 1, seed=1, results=value),
    "simulate_study people": lambda value: api.simulate_study("demo", value, seed=1),
    "simulate_force liquid": lambda value: api.simulate_force("rek2024", value, "circle"),
    "simulate_force motion": lambda value: api.simulate_force("rek2024", "honey", value),
    "open_force force_limit_n": lambda value: api.open_force("rek2024", force_limit_n=value),
    "open_force options": lambda value: api.open_force("rek2024", options=value),
    "fit trials": lambda value: api.fit(value, levels=(0.02, 1.0)),
    "fit levels": lambda value: api.fit(TRIALS, levels=value),
    "fit design": lambda value: api.fit(TRIALS, levels=(0.02, 1.0), design=value),
}
WRONG |= {
    "to": (None, 3),
    "by": (None, 3),
    "people": (None, 1.5, math.nan, "3", 0, 10**400),
    "liquid": (None, ["honey"]),
    "motion": (None, 3, ([0.0], ["a"]), (1, 2, 3)),
    "force_limit_n": ("2", np.ones(2), 10**400, True, [1.0]),
    "options": (3, "port"),
    "trials": (None, [1]),
    "levels": (None, 3, (1,), ("a", "b"), (1, 2, 3)),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_wrong_argument_is_one_sentence_that_names_it(name: str) -> None:
    argument = name.rsplit(maxsplit=1)[-1]
    for value in WRONG["study" if argument == "study" else argument if argument != "design" else "by"]:
        if (name, value) == ("rehearse results", None):
            continue
        with pytest.raises(StudyError, match=argument) as raised:
            CALLS[name](value)
        assert "\n" not in str(raised.value)
        assert len(str(raised.value)) < 200


@pytest.mark.slow
@needs_servo
@needs_fork
@pytest.mark.parametrize("ends", ["exit", "returns"])
def test_an_observer_that_forks_writes_nothing_in_the_fork(short: Path, tmp_path: Path, ends: str) -> None:
    """The fork ends soon, and the session goes on as if there had been none."""
    codes: list[int] = []

    def observer(question: Any) -> str | None:
        if not codes:
            child = os.fork()
            if child == 0:
                codes.append(0)
                if ends == "exit":
                    sys.exit(3)
                return by_resistance(question)
            codes.append(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
        return by_resistance(question)

    process = os.getpid()
    try:
        with api.open_session(
            short, "P001", results=tmp_path / "r", seed=5, answer=observer, recordings=True
        ) as session:
            session.run()
    except BaseException as error:
        if os.getpid() != process:
            os._exit(3 if isinstance(error, SystemExit) else 4 if "a fork of that process cannot" in str(error) else 5)
        raise
    assert os.getpid() == process
    assert codes == [3 if ends == "exit" else 4]
    assert verify_study(tmp_path / "r").errors == ()
    assert session.fingerprint


@pytest.mark.slow
@needs_servo
def test_examples_of_the_page_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {}
    for block in blocks(ROOT / "docs" / "api.md"):
        exec(block.text, names)  # noqa: S102 - a page of this documentation
    assert names["page"].is_file()
    assert len(names["tables"]["trials"]) > 0


@pytest.fixture(scope="module")
def short(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a study of one short block of 2IFC."""
    path = tmp_path_factory.mktemp("api") / "levels.toml"
    path.write_text(level_studies.text_of(*level_studies.SHORT), encoding="utf-8", newline="\n")
    return path


def by_resistance(question: Any) -> str | None:
    """Answer which interval resisted more, without noise; leave forms to the simulated participant."""
    if len(question.felt) < 2:
        return None
    resisted = [interval.force_mean_n / interval.speed_rms_mps for interval in question.felt]
    return "first" if resisted[0] > resisted[1] else "second"


@pytest.mark.slow
@needs_servo
def test_an_own_observer_answers_and_a_session_left_is_resumed(short: Path, tmp_path: Path) -> None:
    questions: list[Any] = []

    def observer(question: Any) -> str | None:
        questions.append(question)
        return by_resistance(question)

    whole, parted = tmp_path / "whole", tmp_path / "parted"
    with api.open_session(short, "P001", results=whole, seed=5, answer=observer, recordings=False) as session:
        trials = [page.trial for page in session if getattr(page, "trial", None) is not None]
    assert session.fingerprint
    assert trials == sorted(trials)
    assert questions
    with api.open_session(short, "P001", results=parted, seed=5, answer=observer, recordings=False) as session:
        for page in session:
            if getattr(page, "trial", None) == trials[-1] // 3:
                break
        for page in session:  # goes on
            if getattr(page, "trial", None) == trials[-1] // 2:
                break
    assert not session.fingerprint
    assert verify_study(parted).errors == ()
    assert not [warning for warning in verify_study(parted).warnings if "subject-P001" in warning.place]
    with api.open_session(short, "P001", results=parted, seed=99, answer=observer, recordings=False) as session:
        session.run()
    tables = [api.read(folder)["responses"] for folder in (whole, parted)]
    columns = ["trial", "item", "response"]
    assert tables[0][columns].equals(tables[1][columns])
    assert verify_study(parted).errors == ()
    with pytest.raises(StudyError, match="completed"), api.open_session(short, "P001", results=whole, seed=5):
        pass


@pytest.mark.slow
@needs_servo
def test_a_participant_replaces_another(tmp_path: Path) -> None:
    with api.open_session("rek2024", "P002", results=tmp_path, seed=5, recordings=False, row_of="P001") as session:
        next(iter(session))
    assert start_of(journal.read(session.folder / "journal.jsonl")).row_of == "P001"


@pytest.mark.slow
@needs_servo
def test_an_own_observer_answers_with_lists_and_numbers_of_numpy(tmp_path: Path) -> None:
    own_answers = {
        "age": np.int64(30),
        "used": ["falcon", "mouse"],
        "pleasant": np.float64(25.0),
        "thickness": np.int32(2),
    }
    others = {"hand": "both", "since": 1.5, "feels_liquid": 4, "comment": "Fine."}

    def observer(question: Any) -> dict[str, Any] | None:
        item_ids = {item.id for item in getattr(question.page, "items", ())}
        return {item: value for item, value in (own_answers | others).items() if item in item_ids} or None

    with api.open_session(mixed_file(tmp_path), "P001", results=tmp_path / "r", seed=2, answer=observer) as session:
        session.run()
    assert verify_study(tmp_path / "r").errors == ()
    rows = api.read(tmp_path / "r")["responses"]
    assert rows["onset_s"].notna().all()  # also of questions that an answer made visible
    responses = {item: set(rows.loc[rows["item"] == item, "response"].astype(str)) for item in own_answers}
    assert responses == {"age": {"30"}, "used": {"falcon mouse"}, "pleasant": {"25.0"}, "thickness": {"2"}}


def to_twice_the_standard(question: Any) -> np.int64:
    """Adjust until the resistance is twice that of the standard."""
    standard, now = (interval.force_mean_n / interval.speed_rms_mps for interval in question.felt)
    return np.int64(0 if abs(now / standard - 2) < 0.1 else 1 if now < 2 * standard else -1)  # as numpy counts


@pytest.mark.slow
@needs_servo
def test_an_own_observer_sets_levels(tmp_path: Path) -> None:
    study = tmp_path / "matching.toml"
    study.write_text(matching.TEXT, encoding="utf-8", newline="\n")
    with api.open_session(study, "P001", results=tmp_path / "r", seed=3, answer=to_twice_the_standard) as session:
        session.run()
    with (
        pytest.raises(SessionError, match="'more' is not a valid number of steps"),
        api.open_session(study, "P002", results=tmp_path / "r", seed=3, answer=lambda _: "more") as session,
    ):
        session.run()
    assert verify_study(tmp_path / "r").errors == ()
    api.unblind(tmp_path / "r", by="AK", reason="a test")
    rows = api.read(tmp_path / "r")["intervals"]
    settings = rows.loc[rows["participant"] == "P001", "setting"].dropna()
    assert len(settings) == 4
    assert settings.between(10, 13).all()  # the standard is 6


@pytest.mark.slow
@needs_servo
def test_a_session_of_a_participant_is_not_completed_by_simulated_answers(short: Path, tmp_path: Path) -> None:
    with api.open_session(short, "P001", results=tmp_path / "r", seed=5, recordings=False) as session:
        next(iter(session))
    held = json.loads((session.folder / "receipt.json").read_text(encoding="utf-8"))
    held["screens"] = {"participant": {"name": "DP-1"}}
    (session.folder / "receipt.json").write_text(json.dumps(held), encoding="utf-8", newline="\n")
    with (
        pytest.raises(SessionError, match="is a participant's session"),
        api.open_session(short, "P001", results=tmp_path / "r", seed=5),
    ):
        pass


@pytest.mark.slow
@needs_servo
@pytest.mark.parametrize(
    ("answer", "words"),
    [
        ("third", "third"),
        (True, "answer True is neither a number nor text"),
        ({"which": "first"}, "this page does not contain 'which'"),
    ],
)
def test_an_answer_that_is_not_permitted_ends_the_block_and_loses_nothing(
    short: Path, tmp_path: Path, answer: Any, words: str
) -> None:
    with (
        pytest.raises(SessionError, match=words),
        api.open_session(short, "P001", results=tmp_path / "r", seed=1, answer=lambda _: answer) as session,
    ):
        session.run()
    with api.open_session(short, "P001", results=tmp_path / "r", seed=1, answer=by_resistance) as session:
        session.run()
    assert verify_study(tmp_path / "r").errors == ()


@pytest.mark.slow
@needs_servo
@pytest.mark.parametrize("device", ["inverse3-emulated", "scripted"])
def test_every_way_out_of_a_force_loop_ends_at_zero_force(device: str) -> None:
    def used_by_a_program_that_fails(hands: list[Any]) -> None:
        with api.open_force("rek2024", device=device, force_limit_n=1.0) as loop:
            loops.append(loop)
            loop.set_liquid("water")
            assert loop._rig is not None
            hands.append(getattr(loop._rig.device, "hand", loop._rig.device))
            loop.follow([0.0, 0.4], [[0.0, 0.0, 0.0], [0.04, 0.0, 0.0]])
            felt_n = samples(loop, 700)
            assert 0.0 < np.linalg.norm(felt_n, axis=1).max() <= 1.0
            loop.set_liquid("water", density_kg_m3=1200.0)
            with pytest.raises(StudyError, match="densty"):
                loop.set_liquid("water", densty_kg_m3=1200.0)
            loop.stop()
            loop.read()  # what came before
            assert not np.any(samples(loop, 50)[-20:])
            loop.fade_in()
            loop.follow([0.0, 10.0], [[0.04, 0.0, 0.0], [0.0, 0.0, 0.0]])
            loop.read()
            assert np.any(samples(loop, 200)[-1])
            raise ZeroDivisionError

    def samples(loop: api.ForceLoop, count: int) -> Any:
        samples_read = np.zeros((0, 3))
        while len(samples_read) < count:
            samples_read = np.vstack([samples_read, loop.read().device_force_n])
        return samples_read

    hands: list[Any] = []
    loops: list[api.ForceLoop] = []
    with pytest.raises(ZeroDivisionError):
        used_by_a_program_that_fails(hands)
    assert not np.any(hands[0].force_n)
    with pytest.raises(StudyError, match="has ended"):
        loops[0].fade_in()


@pytest.mark.slow
@needs_servo
def test_a_fit_of_own_trials_equals_that_of_the_report(short: Path) -> None:
    tables = api.simulate_study(short, 2, seed=3)
    tracks, reported = tables["tracks"], tables["thresholds"]
    levels = api.load(short).stimuli["viscosity"].levels
    columns = {"level_asked": "level", "right": "success"}
    trials = tracks.rename(columns=columns)[[*columns.values(), "participant", "session", "standard", "arrangement"]]
    fitted = api.fit(trials, levels=levels)
    columns = ["standard", "threshold", "low", "high", "n", "fit_p"]
    own = fitted.loc[fitted["participant"].notna(), columns].to_numpy(dtype=float)
    assert own == pytest.approx(reported[columns].to_numpy(dtype=float), rel=1e-9)
    alone = api.fit(trials[["level", "success"]], levels=levels)
    assert list(alone["n"]) == [1, len(trials)]


def calls_an_answer(folder: Path, statements: int) -> float:
    """Return how many functions a session calls for each answer to a form of so many statements."""
    rows = "".join(
        f'{{ id = "s{number}", text = "Statement {number}", short = "S{number}" }},\n' for number in range(statements)
    )
    study = folder / f"form{statements}.toml"
    study.write_text(FORM.format(rows=rows), encoding="utf-8", newline="\n")
    calls = 0

    def count(_frame: Any, event: str, _: Any) -> None:
        nonlocal calls
        calls += event == "call"

    def answer(question: Any) -> dict[str, int]:
        sys.setprofile(count)
        return {item.id: 4 for item in question.page.items}

    with api.open_session(study, "P001", results=folder / f"r{statements}", seed=1, answer=answer) as session:
        pages = iter(session)
        next(pages)
        next(pages)
        sys.setprofile(None)
    return calls / statements


@pytest.mark.slow
@needs_servo
def test_the_work_of_an_answer_does_not_grow_with_the_form(tmp_path: Path) -> None:
    assert calls_an_answer(tmp_path, 80) < 1.5 * calls_an_answer(tmp_path, 20)
