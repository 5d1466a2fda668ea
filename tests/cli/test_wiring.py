"""Which function each command calls with which of its options; each value is another one's."""

import json
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from datetime import datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from click.testing import CliRunner

from study_app.cli import commands
from study_app.evidence.table import Evidence
from study_app.protocol.load import load
from study_app.session.simulated.answers_only import rehearse_answers
from study_app.store import workstation
from study_app.store.files.folders import StudyFolder
from study_app.workers.executors import Workers
from tests.studies import made_up

pytestmark = pytest.mark.slow

Patch = Callable[..., None]


@pytest.fixture
def calls() -> list[tuple[Any, ...]]:
    """The functions that were called, each with its arguments; a function, which shows progress, as “show”."""
    return []


@pytest.fixture
def patch(monkeypatch: pytest.MonkeyPatch, calls: list[tuple[Any, ...]]) -> Patch:
    """Return a function that replaces functions of a module by ones that note their call and return a value."""

    def replace(module: str, **values: Any) -> None:
        for name, value in values.items():

            def called(*arguments: Any, _name: str = name, _value: Any = value, **options: Any) -> Any:
                stated = ["show" if callable(argument) else argument for argument in arguments]
                plain_options = {key: option for key, option in options.items() if not callable(option)}
                calls.append((_name, *stated, *([plain_options] if plain_options else [])))
                return _value(*arguments, **options) if callable(_value) else _value

            monkeypatch.setattr(f"{module}.{name}", called)

    @contextmanager
    def executor_for(workers: Workers) -> Iterator[str]:
        yield f"{workers.count} workers"

    for module in ("evidence", "power"):
        monkeypatch.setattr(f"study_app.cli.{module}.executor_for", executor_for)
    return replace


def run(*words: object, code: int = 0) -> list[str]:
    result = CliRunner().invoke(commands, [str(word) for word in words])
    assert result.exit_code == code, (result.output, result.exception)
    return result.stdout.splitlines()


def evidence(text: str, **keys: Any) -> Evidence:
    return Evidence(f"{text}\n", {"made.md": text}, **keys)


CFD = "study_app.evidence.cfd"


@pytest.fixture
def fluid(patch: Patch) -> None:
    """Replace the fluid solver, the stored flows and the fits."""
    patch(CFD, load_tables=(1, 2), load_steady="drag", fit_all="fits", fits_evidence=evidence("fitted"))
    patch(CFD, training=lambda source: (f"training {source}",), held_out=lambda source: f"held out {source}")
    patch(CFD, refit_law="law", law_fit_evidence=evidence("refitted"), solve=(Path("solved.csv"),))
    patch(CFD, solve_materials=Path("yield.csv"), stored_materials="materials", score_all=evidence("scored"))
    patch(CFD, yield_flow_evidence=evidence("yielding"))


@pytest.mark.parametrize(
    ("words", "expected", "printed"),
    [
        ("",
         ["load_tables None", "load_steady None", "fit_all (1, 2) show", "fits_evidence (1, 2) drag fits"],
         ["fitted"]),
        ("--refit",
         ["load_tables None", "load_steady None", "training None", "held_out None",
          "refit_law (1, 2, 'training None') held out None show", "law_fit_evidence law"],
         ["refitted"]),
        ("--materials", ["stored_materials None", "yield_flow_evidence materials"], ["yielding"]),
        ("--score", ["score_all show"], ["scored"]),
        ("--solve --workers 3 --to TO",
         ["solve TO 3 workers show", "load_tables TO", "load_steady TO", "fit_all (1, 2) show",
          "fits_evidence (1, 2) drag fits"],
         ["solved.csv", "TO/made.md"]),
        ("--solve --materials --workers 3 --to TO",
         ["solve_materials TO 3 workers show", "stored_materials TO", "yield_flow_evidence materials"],
         ["yield.csv", "TO/made.md"]),
        ("--materials --to TO", ["stored_materials None", "yield_flow_evidence materials"], ["TO/made.md"]),
        ("--score --to TO", ["score_all show"], ["scored", "TO/made.md"]),
    ],
)  # fmt: skip
def test_cfd_reads_or_solves_flows_and_fits_the_requested_models(
    fluid: None, calls: list[tuple[Any, ...]], tmp_path: Path, words: str, expected: list[str], printed: list[str]
) -> None:
    lines = run("cfd", *words.replace("TO", str(tmp_path)).split())
    assert [line.replace(str(tmp_path), "TO") for line in lines] == printed
    assert [" ".join(map(str, call)).replace(str(tmp_path), "TO") for call in calls] == expected


def test_cfd_needs_a_folder_for_solved_flows_and_does_one_thing_at_a_time(fluid: None) -> None:
    for words in (
        ("--solve",),
        ("--refit", "--materials"),
        ("--solve", "--score", "--to", "x"),
        ("--refit", "--score"),
    ):
        run("cfd", *words, code=2)


STABILITY = "study_app.evidence.stability"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("--withheld", ["measure_withheld_force {'executor': '2 workers'}", "withheld_force_evidence withheld"]),
        ("--delivered", ["measure_delivered_force {'whole': False, 'executor': '2 workers'}",
                         "delivered_force_evidence delivered"]),
        ("--delivered --whole", ["measure_delivered_force {'whole': True, 'executor': '2 workers'}",
                                 "delivered_force_evidence delivered"]),
        ("--velocity", ["measure_velocities show", "velocity_evidence velocities"]),
        ("--delayed TO/late.csv", ["measure_force_delays", "force_delay_evidence delays late.csv"]),
        ("--table TO/limits.csv", ["slope_limits_evidence 2 workers show limits.csv"]),
    ],
)  # fmt: skip
def test_stability_measures_the_part_that_was_asked_for(
    patch: Patch, calls: list[tuple[Any, ...]], tmp_path: Path, words: str, expected: list[str]
) -> None:
    patch(STABILITY, measure_withheld_force="withheld", withheld_force_evidence=evidence("held"))
    patch(STABILITY, measure_delivered_force="delivered", delivered_force_evidence=evidence("got"))
    patch(STABILITY, measure_velocities="velocities", velocity_evidence=evidence("fast"))
    patch(STABILITY, measure_force_delays="delays", force_delay_evidence=evidence("late"))
    patch(STABILITY, slope_limits_evidence=evidence("steep"))
    lines = run("stability", "--workers", 2, *words.replace("TO", str(tmp_path)).split())
    assert [" ".join(map(str, call)) for call in calls] == expected
    assert (tmp_path / "made.md").exists() == ("TO" in words)
    assert (str(tmp_path / "made.md") in lines) == ("TO" in words)
    run("stability", "--whole", code=2)
    run("stability", "--withheld", "--velocity", code=2)


@pytest.mark.parametrize(("reasons", "code"), [((), 0), (("it oscillates",), 3)])
def test_stability_judges_one_case_without_and_with_safety(patch: Patch, reasons: tuple[str, ...], code: int) -> None:
    verdicts = [SimpleNamespace(reasons=("unstable",), text="off"), SimpleNamespace(reasons=reasons, text="on")]
    patch(STABILITY, parse_case=lambda line: f"case {line}", verdicts_on=lambda _case: verdicts)
    patch(STABILITY, verdict_text=lambda verdict: f"safety {verdict.text}")
    assert run("stability", "--case", "delay=4", code=code) == ["case delay=4", "safety off", "safety on"]


TIMING = "study_app.evidence.timing"
OUTLETS = "study_app.evidence.outlets"


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        ("--devices", ["emulated_devices", "time_devices 400.0 names", "lateness_evidence lateness"]),
        ("--lsl", ["localhost_only", "measure_streams 400.0", "compare_streams 300.0",
                   "streams_evidence streams compared"]),
        ("--triggers virtual", ["measure_triggers virtual 400.0", "triggers_evidence triggers"]),
        ("--delays", ["measure_delays 400.0 none", "delays_evidence delays"]),
        ("--spin 25", ["measure_timing 400.0 none windows {'spin_us': 25.0}", "timing_evidence timed"]),
    ],
)  # fmt: skip
def test_timing_runs_the_requested_measurements(
    patch: Patch,
    calls: list[tuple[Any, ...]],
    monkeypatch: pytest.MonkeyPatch,
    tmp_path: Path,
    words: str,
    expected: list[str],
) -> None:
    patch(TIMING, emulated_devices="names", time_devices="lateness", lateness_evidence=evidence("devices"))
    patch(TIMING, measure_timing="timed", timing_evidence=evidence("loops"), delays_evidence=evidence("delays"))
    patch(OUTLETS, localhost_only=None, measure_streams="streams", compare_streams="compared")
    patch(OUTLETS, streams_evidence=evidence("lsl"), measure_triggers="triggers", triggers_evidence=evidence("ports"))
    patch("study_app.app.delay_session", measure_delays="delays")
    monkeypatch.setattr("study_app.cli.evidence._windows_thread", lambda _load: "windows")
    events = "ending"
    lines = run("timing", "--seconds", 400, *words.split(), "--to", tmp_path)
    recorded_calls = [
        (*(part for part in call if not isinstance(part, dict)), *_without(call, events)) for call in calls
    ]
    assert [" ".join(map(str, call)) for call in recorded_calls] == expected
    assert lines[-1] == str(tmp_path / "made.md")


def _without(call: tuple[Any, ...], name: str) -> list[dict[str, Any]]:
    """Return the options of a call without one of them, if there are any others."""
    options = [{key: value for key, value in part.items() if key != name} for part in call if isinstance(part, dict)]
    return [kept for kept in options if kept]


def test_timing_refuses_options_that_cannot_be_combined() -> None:
    run("timing", "--delays", "--lsl", code=2)
    for words in (("--delays", "--spin", 3), ("--lsl", "--seconds", 0.1), ("--triggers", "virtual", "--seconds", 9e9)):
        result = CliRunner().invoke(commands, ["timing", *map(str, words)])
        assert "StudyError" in repr(result.exception), words


@pytest.mark.parametrize(("missed", "undecided", "code"), [(False, False, 0), (True, False, 3), (False, True, 4)])
def test_soak_and_delay_thresholds_end_with_the_code_of_their_evidence(
    patch: Patch, calls: list[tuple[Any, ...]], tmp_path: Path, missed: bool, undecided: bool, code: int
) -> None:
    result = evidence("soaked", missed=missed, undecided=undecided, closing="and that was all")
    ended = SimpleNamespace(ticks=5, evidence=lambda: result)
    patch("study_app.evidence.soak", soak_servo=lambda scenes, hours, **options: calls.append((*scenes,)) or ended)
    patch("study_app.evidence.thresholds", compare_delays="compared", noticed_delays_evidence=result)
    printed = ["", "soaked", str(tmp_path / "made.md"), "and that was all"]
    words = ("soak", "demo", "--hours", 2.5, "--virtual", "--seed", 9, "--to", tmp_path)
    assert run(*words, code=code) == printed
    name, scenes, hours, options = calls[0]
    assert (name, hours, options["virtual"], options["seed"]) == ("soak_servo", 2.5, True, 9)
    assert list(scenes) == list(load("demo").liquids)
    assert run("delay-thresholds", "--people", 7, "--seed", 3, "--to", tmp_path, code=code) == printed[1:]
    assert calls[-2:] == [("compare_delays", 7, 3), ("noticed_delays_evidence", "compared")]


APP = {"results": None, "device": "mouse", "seed": 4, "language": "nl", "operator": "AK", "row_of": "P003",
       "group": "old", "windowed": True, "screen": 2, "pilot": True, "session": 6, "participant": "P011"}  # fmt: skip


def test_run_and_resume_pass_every_option_on(
    patch: Patch, calls: list[tuple[Any, ...]], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    patch("study_app.app", run=5, resume=6)
    words = ("--device", "mouse", "--seed", 4, "--language", "nl", "--operator", "AK", "--row-of", "P003", "--group",
             "old", "--windowed", "--screen", 2, "--pilot", "--session", 6, "--participant", "P011")  # fmt: skip
    run("run", "demo", *words, "--results", tmp_path / "kept", code=5)
    name, protocol, options = calls.pop()
    assert (name, protocol, options.pop("device_options")) == ("run", "demo", {})
    assert options == APP | {"results": tmp_path / "kept", "recordings": True}
    run("run", "demo", "--participant", "P012", "--no-recordings", "--results", tmp_path, code=5)
    assert (calls[-1][2]["recordings"], calls[-1][2]["session"], calls[-1][2]["pilot"]) == (False, 1, False)
    session = tmp_path / "ses-01"
    session.mkdir()
    words = ("--protocol", "own.toml", "--device", "scripted", "--operator", "BM", "--screen", 3)
    run("resume", session, *words, code=6)
    name, folder, options = calls.pop()
    assert (name, folder, options.pop("device_options")) == ("resume", session, {})
    assert options == {
        "protocol": "own.toml", "device": "scripted", "operator": "BM", "windowed": False, "screen": 3,
    }  # fmt: skip


def test_rehearse_simulates_sessions_or_answers_only(
    patch: Patch, calls: list[tuple[Any, ...]], tmp_path: Path
) -> None:
    patch("study_app.session.simulated.rehearsal", rehearse=tmp_path / "sessions")
    patch("study_app.session.simulated.answers_only", rehearse_answers=tmp_path / "answers")
    words = ("demo", "--participants", 3, "--seed", 8, "--results", tmp_path)
    assert run("rehearse", *words, "--no-recordings", "--device", "falcon-emulated") == [
        f"{tmp_path / 'sessions'}: 3 simulated participants"
    ]
    common = {"participants": 3, "seed": 8, "group": None, "results": tmp_path}
    assert calls.pop() == ("rehearse", "demo", {"device": "falcon-emulated", "recordings": False, **common})
    assert run("rehearse", *words, "--answers-only") == [f"{tmp_path / 'answers'}: 3 simulated participants"]
    assert calls.pop() == ("rehearse_answers", "demo", common)
    run("rehearse", *words, "--answers-only", "--device", "scripted", code=2)


def test_power_estimates_with_its_options_and_prints_the_last_estimate(
    patch: Patch, calls: list[tuple[Any, ...]], monkeypatch: pytest.MonkeyPatch
) -> None:
    def estimated(study: Any, executor: str, **options: Any) -> Iterator[Any]:
        yield SimpleNamespace(studies=10, asked=40, text="first")
        yield SimpleNamespace(studies=40, asked=40, text="last")
        if options["seed"] == 6:
            raise KeyboardInterrupt

    patch("study_app.analysis.planning.power_estimates", estimate_power=estimated, planned_sizes=(5, 9))
    monkeypatch.setattr("study_app.cli.power._write_estimate", lambda estimate, to: calls.append((estimate.text, to)))
    words = ("power", "viscosityjnd", "--trials", "30,20", "--studies", 40, "--workers", 2)
    run(*words, "--sizes", "9,6,9", "--seed", 5)
    (name, study, executor, options), destination = calls
    assert (name, study.study.name, executor, destination) == (
        "estimate_power",
        "viscosityjnd",
        "2 workers",
        ("last", None),
    )
    assert options == {"sizes": (6, 9), "trials": (20, 30), "studies": 40, "seed": 5}
    run(*words, "--seed", 6, code=130)
    assert calls[-2][-1]["sizes"] == (5, 9)
    assert calls[-1] == ("last", None)
    for wrong in (("--sizes", "1,5"), ("--sizes", "5,x"), ("--trials", "0"), ("--engine", "dask")):
        run("power", "viscosityjnd", *wrong, code=2)
    run("power", "rek2024", "--trials", "30", code=2)


@pytest.fixture
def workspace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A workspace with a study of its own, a liquid file, a broken file, and results of two people."""
    monkeypatch.setenv("LIQUID_STUDY_WORKSPACE", str(tmp_path))
    folder = tmp_path / "protocols"
    folder.mkdir()
    text = (Path(__file__).parents[2] / "protocols" / "demo.toml").read_text(encoding="utf-8")
    files = {
        "mine": text.replace('title = "A first look"', 'title = "My own"', 1),
        "oil": "format = 2\n[liquids.oil]\ndensity_kg_m3 = 900\n",
        "wrong": "format = 2\n[study\n",
    }
    for name, content in files.items():
        (folder / f"{name}.toml").write_text(content, encoding="utf-8", newline="\n")
    rehearse_answers("demo", participants=2, seed=7, results=tmp_path / "results" / "demo", features=made_up("demo"))
    return tmp_path


def test_studies_and_sessions_are_listed_with_their_next_steps(workspace: Path, tmp_path: Path) -> None:
    results = workspace / "results"
    lines = run("studies")
    assert lines[0].startswith(f"Protocols in {workspace / 'protocols'}")
    assert "  mine  My own" in lines
    assert "  oil  (liquid file)" in lines
    (wrong,) = (line for line in lines if line.startswith("  wrong"))
    assert wrong.startswith("  wrong  cannot be used: line 2: file: invalid TOML")
    assert lines[-2:] == [f"Studies in {results}", "  demo  2 sessions"]
    run("exclude", "demo", "--participant", "P002", "--by", "AK", "--reason", "asleep")
    run("exclude", "demo", "--participant", "P001", "--trial", 2, "--by", "AK", "--reason", "coughed")
    start_of = {}
    for person in ("P001", "P002"):
        journal = StudyFolder(results / "demo").session(person, 1).journal.read_text(encoding="utf-8")
        start_of[person] = datetime.fromisoformat(re.search(r'"at":\s*"([^"]+)"', journal)[1])
    start_times = {person: time.astimezone().isoformat(" ", "minutes") for person, time in start_of.items()}
    expected = [
        f"demo/P001/1  {start_times['P001']}  completed",
        f"demo/P002/1  {start_times['P002']}  completed  excluded",
    ]
    assert run("sessions") == run("sessions", "demo") == expected
    elsewhere = tmp_path / "elsewhere"
    (results / "demo").rename(elsewhere)
    session = StudyFolder(elsewhere).session("P001", 1).path
    assert run("sessions", "--results", elsewhere)[0] == f"{session}  {start_times['P001']}  completed"
    assert run("rebuild", "P001/1", "--results", elsewhere) == run("rebuild", session)
    assert run("sessions") == []


def test_languages_are_created_and_then_checked(workspace: Path) -> None:
    file = workspace / "languages" / "es.toml"
    assert run("language", "es") == [f"{file}: translate its texts, then run liquid-study language es"]
    assert 'language = "es"' in file.read_text(encoding="utf-8")
    assert run("language", "de") == ["German ships with the program"]
    text = re.sub(r'(?:""|\[\])  # ("[^"]*"|\[.*?\])', r"\1", file.read_text(encoding="utf-8"))
    file.write_text(
        text.replace('english_name = "English"', 'english_name = "Spanish"'), encoding="utf-8", newline="\n"
    )
    assert run("language", "es") == [f"{file}: complete, Spanish"]
    for code in ("ES", "esp", "é1"):
        assert "is not a language code" in str(CliRunner().invoke(commands, ["language", code]).exception)


def test_studies_are_made_designed_and_counted(workspace: Path) -> None:
    file = workspace / "protocols" / "fresh.toml"
    assert run("new", "fresh", "--template", "rate-realism", "--no-window") == [
        f"{file}: edit it, then run liquid-study check fresh"
    ]
    assert load("fresh").study.name == "fresh"
    lines = run("design", "demo", "--participants", 5, "--from", "A098", "--seed", 6)
    assert lines[0] == "demo: orders for 5 participants, each with seed 6"


def test_check_prints_the_schema_that_was_asked_for() -> None:
    protocol, other, journal = ("\n".join(run("check", *words)) for words in (
        ("--schema",), ("--schema", "protocol"), ("--schema", "journal")
    ))  # fmt: skip
    assert json.loads(protocol) == json.loads(other) != json.loads(journal)
    assert "questionnaires" in json.loads(protocol)["properties"]
    run("check", code=2)


def test_docs_print_a_page_or_the_section_that_fits_best(monkeypatch: pytest.MonkeyPatch) -> None:
    sections = [
        SimpleNamespace(page=f"page{number}", heading=f"Heading {number}", source=f" text {number}\n")
        for number in range(1, 9)
    ]
    opened_pages = list[str]()
    monkeypatch.setattr("study_app.documentation.names", lambda: ("first", "second"))
    monkeypatch.setattr("study_app.documentation.page", lambda name: f"the page {name}")
    monkeypatch.setattr(
        "study_app.documentation.search",
        lambda query: opened_pages.append(query) or (sections if "thick" in query else ()),
    )
    assert run("docs") == ["first", "second"]
    assert run("docs", "second") == ["the page second"]
    assert run("docs", "thick", "oil") == [
        "page1: Heading 1", "", "text 1", "", *(f"see also  page{number}: Heading {number}" for number in range(2, 6)),
    ]  # fmt: skip
    run("docs", "thin", code=2)
    assert opened_pages == ["thick oil", "thin"]


def test_the_model_is_simulated_and_described_with_the_stated_changes(
    patch: Patch, calls: list[tuple[Any, ...]], tmp_path: Path
) -> None:
    patch("study_app.api", simulate_force=["row"] * 6)
    patch("study_app.store.files", write_columns=None)
    words = ("--path", "circle", "--set", " scale = 3", "--set", "density_kg_m3=1200", "--to", tmp_path / "f.csv")
    assert run("simulate", "rek2024", "--liquid", "honey", *words) == [f"{tmp_path / 'f.csv'}: 6 rows"]
    assert calls == [
        ("simulate_force", "rek2024", "honey", "circle", {"scale": "3", "density_kg_m3": "1200"}),
        ("write_columns", tmp_path / "f.csv", ["row"] * 6),
    ]
    run("simulate", "rek2024", "--liquid", "honey", "--path", "circle", "--set", "x", "--to", "f.csv", code=2)
    patch("study_app.evidence.cost", report=lambda scene: f"cost of {scene.liquids[0].id} ")
    patch("study_app.evidence.expected_error", error_report=lambda scene, delay: f"error at {delay}")
    patch("study_app.evidence.expected_error", acting_report=lambda scene: f"effects of {scene.liquids[0].id}\n\n")
    honey = ["cost of honey ", "error at 3", "effects of honey"]
    assert run("scene", "rek2024", "--liquid", "honey", "--delay", 3) == honey
    every = run("scene", "rek2024")
    assert [line for line in every if line.startswith("cost")] == [
        f"cost of {name} " for name in load("rek2024").liquids
    ]
    assert every[:5] == ["cost of water ", "error at 1", "effects of water", "", "cost of honey "]


def test_outputs_are_written_to_the_requested_folder_and_failures_reported(
    patch: Patch, calls: list[tuple[Any, ...]], tmp_path: Path
) -> None:
    to, results = tmp_path / "out", tmp_path / "kept"
    results.mkdir()

    def reported(folder: Path, to: Path, *, failed: Callable[[str], None], **_: Any) -> list[Path]:
        failed("figures failed")
        return [to / "report.html", to / "a.csv", to / "b.csv"]

    patch("study_app.analysis.report", plot=[to / "a.png"], report=reported)
    assert run("plot", results, "--to", to) == [str(to / "a.png")]
    result = CliRunner().invoke(commands, ["report", "--results", str(results), "--to", str(to)])
    assert result.stdout == f"{to / 'report.html'}  and 2 more files in the same folder\n"
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (3, "figures failed")
    assert [call[:3] for call in calls] == [("plot", results, to), ("report", results, to)]
    run("export", results, "--to", to, "--validator", __file__, code=2)
    run("report", "demo", "--results", results, "--to", to, code=2)


def test_rebuild_prints_each_rewritten_removed_kept_and_lost_file(patch: Patch, tmp_path: Path) -> None:
    session = tmp_path / "ses-01"
    session.mkdir()
    rebuilt = SimpleNamespace(
        rewritten=(Path("a.csv"),), swept=(Path("b.part"),), torn_bytes=1, lost=(Path("session.json"),)
    )
    patch("study_app.store.sessions", rebuild_session=rebuilt)
    torn = "the journal ends with an incomplete line of 1 byte, which has been kept"
    result = CliRunner().invoke(commands, ["rebuild", str(session)])
    assert result.exit_code == 0, (result.output, result.exception)
    assert result.stdout.splitlines() == ["rewritten  a.csv", "removed    b.part, an incomplete file", torn]
    lost = "warning: session.json is missing and cannot be rebuilt; restore it from a backup"
    assert result.stderr.splitlines() == [lost]
    patch("study_app.store.sessions", rebuild_session=SimpleNamespace(rewritten=(), swept=(), torn_bytes=0, lost=()))
    assert run("rebuild", session) == ["nothing to do: every table agrees with the journal"]


def test_verify_prints_errors_warnings_plug_ins_and_the_verdict(
    patch: Patch, calls: list[tuple[Any, ...]], tmp_path: Path
) -> None:
    class Finding(SimpleNamespace):
        def __str__(self) -> str:
            return str(self.text)

    findings = SimpleNamespace(
        errors=(Finding(text="broken"),),
        warnings=(Finding(text="tell the others", shares=True), Finding(text="unusual", shares=False)),
        plug_ins={"extra": ("a", "b")},
        running=1,
        sessions=4,
        is_sound=False,
    )
    patch("study_app.store.verification", verify_study=findings, check_recording=["2 markers were lost"])
    words = ("--fingerprints", "kept.txt", "--xdf", "own.xdf")
    lines = ["error: broken", "warning: unusual", "before sharing: tell the others", "plug-in extra: a, b"]
    assert run("verify", tmp_path, *words, code=3) == [
        *lines, "2 markers were lost", "4 sessions, 1 running: not sound",
    ]  # fmt: skip
    assert calls == [
        ("verify_study", tmp_path, Path("kept.txt")), ("check_recording", Path("own.xdf"), tmp_path, findings),
    ]  # fmt: skip
    findings.errors, findings.running, findings.is_sound = (), 0, True
    assert run("verify", tmp_path)[-1] == "4 sessions: sound"


def test_a_proof_is_printed_or_written_and_its_settings_are_remembered(
    patch: Patch, calls: list[tuple[Any, ...]], tmp_path: Path
) -> None:
    patch("study_app.store.verification", proof_text="line of proof\n")
    study, proof_file, root = (tmp_path / name for name in ("study", "kept", "root.pem"))
    for folder in (study, proof_file):
        folder.mkdir()
    root.write_text("PEM", encoding="utf-8", newline="\n")
    before = workstation.load_settings()
    assert run("proof", study, "--server", "https://one.example") == ["line of proof"]
    assert calls.pop()[2] == {"server": "https://one.example", "sign": None}
    assert workstation.load_settings() == before
    to = tmp_path / "proof.txt"
    words = ("--sign", "--server", "https://two.example", "--root", root, "--always", proof_file, "--to", to)
    assert run("proof", study, *words) == [str(to)]
    assert to.read_text(encoding="utf-8") == "line of proof\n"
    assert calls.pop()[2] == {"server": "https://two.example", "sign": True}
    settings = workstation.load_settings()
    assert (settings.proofs, settings.stamps, settings.stamp_root) == (
        str(proof_file),
        "https://two.example",
        str(root),
    )


@pytest.mark.parametrize(
    ("words", "workers"),
    [
        ((), Workers(None)),
        (("--workers", "3"), Workers(3)),
        (("--jobs", "-1"), Workers(None)),
        (("--cluster", "tcp://host:1"), Workers(cluster="tcp://host:1")),
    ],
)
def test_workers_are_counted_or_those_of_a_cluster(
    monkeypatch: pytest.MonkeyPatch, patch: Patch, words: tuple[str, ...], workers: Workers
) -> None:
    requested_workers = list[Workers]()

    @contextmanager
    def executor_for(chosen: Workers) -> Iterator[None]:
        requested_workers.append(chosen)
        yield

    patch(STABILITY, measure_withheld_force="withheld", withheld_force_evidence=evidence("held"))
    monkeypatch.setattr("study_app.cli.evidence.executor_for", executor_for)
    run("stability", "--withheld", *words)
    assert requested_workers == [workers]
    run("stability", "--withheld", "--workers", 2, "--cluster", "tcp://host:1", code=2)
    run("stability", "--withheld", "--workers", 0, code=2)
    monkeypatch.setenv("DASK_SCHEDULER_ADDRESS", "tcp://other:2")
    run("stability", "--withheld", *words)
    assert requested_workers[1] == (workers if words else Workers(cluster="tcp://other:2"))
