"""Arguments and results of each function of the stable interface; nothing is computed."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from study_app import api
from study_app.errors import AnalysisError, StudyError
from study_app.protocol.load import load_scenes

ANSWER: Any = lambda _question: None  # noqa: E731 - an observer


class Called:
    """A recorder of the arguments of replaced functions, which return given values."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.calls: list[Any] = []
        self._monkeypatch = monkeypatch

    def replace(self, name: str, value: Any = None) -> None:
        def call(*words: Any, **named: Any) -> Any:
            self.calls.append((name.rsplit(".", 1)[-1], words, named))
            return value

        self._monkeypatch.setattr(f"study_app.{name}", call)


@pytest.fixture
def called(monkeypatch: pytest.MonkeyPatch) -> Called:
    return Called(monkeypatch)


def test_a_rehearsal_has_the_given_people_seed_and_folder(called: Called) -> None:
    called.replace("session.simulated.rehearsal.rehearse", Path("made"))
    assert api.rehearse("demo", np.int64(3), seed=7, results="there", recordings=False) == Path("made")
    assert type(called.calls[0][2]["participants"]) is int, "it is stored as JSON"
    api.rehearse(Path("mine.toml"), 100_000, seed=0)
    assert called.calls == [
        ("rehearse", ("demo",), {"participants": 3, "seed": 7, "results": Path("there"), "recordings": False}),
        (
            "rehearse", (Path("mine.toml"),),
            {"participants": 100_000, "seed": 0, "results": None, "recordings": True},
        ),
    ]  # fmt: skip


def test_a_simulated_study_is_rehearsed_unblinded_and_read(called: Called, monkeypatch: pytest.MonkeyPatch) -> None:
    called.replace("session.simulated.answers_only.rehearse_answers")
    called.replace("api.unblind")
    called.replace("api.read", {"trials": 5})
    assert api.simulate_study("demo", 3, seed=7, progress=print) == {"trials": 5}
    (_, words, named), unblinded, read = called.calls
    folder = named["results"]
    assert (words, named) == (("demo",), {"participants": 3, "seed": 7, "results": folder, "progress": print})
    assert folder.name == "results"
    assert unblinded == ("unblind", (folder,), {"by": "simulate_study", "reason": "simulated"})
    assert read == ("read", (folder,), {})


def test_incomplete_unblinding_is_reported_for_each_site(called: Called) -> None:
    sites = {"A-": SimpleNamespace(left=("one", "two")), "B-": SimpleNamespace(left=("three",))}
    called.replace("store.unblinding.unblind_folder", sites)
    with pytest.raises(StudyError, match=r"^the key was opened, but not everything was written: one; two; three$"):
        api.unblind("there", by="AB", reason="closed")
    assert called.calls == [("unblind_folder", (Path("there"),), {"by": "AB", "reason": "closed"})]
    called.replace("store.unblinding.unblind_folder", {"": SimpleNamespace(left=())})
    api.unblind("there", by="AB", reason="closed")


def test_a_report_is_written_from_one_folder_to_another(called: Called) -> None:
    called.replace("analysis.report.report", (Path("report.html"), Path("table.csv")))
    assert api.report("there", "to") == Path("report.html")
    assert called.calls == [("report", (Path("there"), Path("to")), {})]


def test_tables_equal_those_of_the_export(called: Called) -> None:
    called.replace("analysis.data.load_study", "loaded")
    tables = [SimpleNamespace(name=name, frame=frame) for name, frame in (("trials", 1), ("responses", 2))]
    called.replace("analysis.export.exported_tables", tables)
    assert api.read("there") == {"trials": 1, "responses": 2}
    assert called.calls == [("load_study", (Path("there"),), {}), ("exported_tables", ("loaded",), {})]


@pytest.mark.parametrize("begun", [False, True])
def test_a_session_is_opened_with_every_value_or_resumed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, begun: bool
) -> None:
    """A resumed session keeps its start values; only group and replaced participant are checked."""
    calls: list[Any] = []
    rehearsed = SimpleNamespace(pages=lambda: iter(["first", "second"]))

    def opening(name: str) -> Any:
        @contextmanager
        def opened(*words: Any, **named: Any) -> Iterator[Any]:
            calls.append((name, words, named))
            yield rehearsed, SimpleNamespace(fingerprint="k3vq-7m2p-xw4d")

        return opened

    for name in ("open_session", "reopen_session"):
        monkeypatch.setattr(f"study_app.session.simulated.rehearsal.{name}", opening(name))
    checked: list[Any] = []
    monkeypatch.setattr("study_app.store.blinded.check_choice", lambda *words, **named: checked.append((words, named)))
    folder = tmp_path / "data" / "sub-P7" / "ses-02"
    if begun:
        folder.mkdir(parents=True)
        (folder / "journal.jsonl").write_bytes(b"")
    whom = {"group": "experts", "row_of": "P3"}
    with api.open_session(
        "demo", "P7", results=str(tmp_path), seed=11, session=2, device="falcon-emulated", answer=ANSWER,
        recordings=False, **whom,
    ) as session:  # fmt: skip
        assert (session.folder, session.fingerprint) == (folder, "k3vq-7m2p-xw4d")
        assert next(iter(session)) == "first"
        session.run()
        assert list(session) == []
    ((name, words, named),) = calls
    if begun:
        assert (name, words, named) == ("reopen_session", (folder,), {"protocol": "demo", "answer": ANSWER})
        (((protocol, claims, participant), chosen),) = checked
        assert (protocol.study.name, [*claims], participant, chosen) == ("demo", [], "P7", whom)
    else:
        assert (name, words[0].study.name, words[2], checked) == ("open_session", "demo", "P7", [])
        assert b"demo" in words[1]
        assert named == {
            "results": tmp_path, "seed": 11, "session": 2, "device": "falcon-emulated", "recordings": False,
            "answer": ANSWER, **whom,
        }  # fmt: skip


@pytest.mark.parametrize("limit_n", [None, 2.5])
def test_a_force_loop_has_the_limits_and_the_tank_of_the_file(
    monkeypatch: pytest.MonkeyPatch, limit_n: float | None
) -> None:
    calls: list[Any] = []
    servo = SimpleNamespace(
        telemetry=SimpleNamespace(reader=lambda: SimpleNamespace(dropped=3, read=lambda: "samples")),
        check=lambda: calls.append("check"), stop_force=lambda: calls.append("stop"),
        fade_in=lambda: calls.append("fade in"), may_adjust=lambda scene: scene.liquids[0].density_kg_m3 == 700.0,
        adjust=lambda scene: calls.append(("adjust", scene)), load=lambda scene: calls.append(("load", scene)),
    )  # fmt: skip
    rig = SimpleNamespace(servo=servo, device="mouse")

    @contextmanager
    def opened(device: str, settings: Any) -> Iterator[Any]:
        calls.append((device, settings))
        yield rig

    monkeypatch.setattr("study_app.devices.rig.open_rig", opened)
    monkeypatch.setattr("study_app.haptics.runtime.pack.elements_needed", lambda scene: 10 + len(scene.liquids[0].id))
    scenes = load_scenes("rek2024")
    with api.open_force("rek2024", device="falcon", force_limit_n=limit_n, options={"port": "7"}) as loop:
        ((device, settings),) = calls
        calls.clear()
        scene = next(iter(scenes.values()))
        assert (device, settings.options, settings.rate_hz) == ("falcon", {"port": "7"}, scene.rate_hz)
        assert settings.force_limit_n == (scene.force_limit_n if limit_n is None else limit_n)
        assert settings.elements == 10 + max(len(name) for name in scenes)
        assert settings.workspace_m == (0.1, 0.06, 0.06)
        assert (loop.dropped, loop.read()) == (3, "samples")
        loop.stop()
        loop.fade_in()
        loop.set_liquid("honey")
        loop.set_liquid("honey", density_kg_m3=700.0)
        assert calls[:3] == ["check", "stop", "fade in"]
        (loaded, honey), (adjusted, lighter) = calls[3:]
        assert (loaded, honey) == ("load", scenes["honey"])
        assert (adjusted, lighter.liquids[0].id, lighter.liquids[0].density_kg_m3) == ("adjust", "honey", 700.0)
        hand: Any = None
        monkeypatch.setattr("study_app.devices.hand.hand_of", lambda device: hand if device == "mouse" else 1)
        with pytest.raises(StudyError, match=r"^follow works only with simulated devices, such as 'scripted'"):
            loop.follow([0.0], [[0.0, 0.0, 0.0]])
        hand = SimpleNamespace(follow=lambda *path: calls.append(path))
        loop.follow([0.0, 1.0], [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
        assert calls[-1] == ([0.0, 1.0], [[0.0, 0.0, 0.0], [0.01, 0.0, 0.0]])
        with pytest.raises(StudyError, match=f"^'oil' is not in the file, which contains {', '.join(scenes)}$"):
            loop.set_liquid("oil")
    with pytest.raises(StudyError, match=r"^the force loop has ended: open it again$"):
        loop.read()


def test_a_motion_is_a_programmed_path_a_file_or_times_and_places(called: Called, tmp_path: Path) -> None:
    called.replace("haptics.runtime.offline.simulate", "forces")
    called.replace("haptics.model.motion.programmed_motion", "path")
    called.replace("haptics.model.motion.read_motion", "file")
    scene = load_scenes("rek2024")["honey"]
    file = tmp_path / "motion"
    file.write_text("t_s", encoding="utf-8", newline="\n")
    for motion, expected in (
        ("circle", ("programmed_motion", ("circle",), {"rate_hz": scene.rate_hz})),
        ("spiral", ("programmed_motion", ("spiral",), {"rate_hz": scene.rate_hz})),
        ("own.csv", ("read_motion", (Path("own.csv"),), {})),
        (file, ("read_motion", (file,), {})),
    ):
        assert api.simulate_force("rek2024", "honey", motion) == "forces"
        name = "file" if expected[0] == "read_motion" else "path"
        assert called.calls == [expected, ("simulate", (scene, name), {})]
        called.calls.clear()
    api.simulate_force("rek2024", "honey", ([0.0, 0.5], [[1, 2, 3], [4, 5, 6]]), density_kg_m3=700.0)
    ((_, (changed, motion), _),) = called.calls
    assert changed.liquids[0].density_kg_m3 == 700.0
    assert (motion.t_s.tolist(), motion.position_m.tolist()) == ([0.0, 0.5], [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])


TRIALS = pd.DataFrame({"level": [0.1, 0.4], "success": [False, True]})


@pytest.mark.parametrize(
    ("options", "level", "spacing", "kind"),
    [
        ({}, "difference", "log", "2ifc"),
        ({"distances": False, "spacing": "linear", "design": "yesno"}, "value", "linear", "yesno"),
    ],
)
def test_a_fit_has_the_given_levels_spacing_and_design(
    called: Called, options: dict[str, Any], level: str, spacing: str, kind: str
) -> None:
    called.replace("analysis.levels.thresholds.thresholds_of", [])
    assert api.fit(TRIALS, levels=(0.02, np.float64(1.0)), **options).empty
    ((_, (trials, stimulus, design), _),) = called.calls
    assert trials.equals(TRIALS)
    assert (stimulus.vary, stimulus.level, stimulus.levels, stimulus.spacing) == ("level", level, (0.02, 1.0), spacing)
    assert design.kind == kind


@pytest.mark.parametrize("level", [-0.1, math.inf, math.nan])
def test_a_level_is_finite_and_at_least_0(called: Called, level: float) -> None:
    called.replace("analysis.levels.thresholds.thresholds_of", [])
    with pytest.raises(AnalysisError, match=r"^column level contains an invalid level"):
        api.fit(TRIALS.assign(level=level), levels=(0.02, 1.0))
    assert called.calls == []
    api.fit(TRIALS.assign(level=0.0), levels=(0.02, 1.0))
    assert len(called.calls) == 1
