"""Compile what sessions, the lab, rehearsals and replay need: for a bundle, and for tests."""

import sys
import tempfile
from pathlib import Path

from study_app.devices.registry import all_devices
from study_app.haptics.kernels.compiled import following_compilation
from study_app.session.compile_worker import carry_out
from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.files.folders import StudyFolder

with tempfile.TemporaryDirectory() as folder, following_compilation(lambda _share: None) as counter:
    names = (device.name for device in all_devices() if device.kind == "simulated" or device.name == "mouse")
    carry_out(tuple(names), lambda _share: None, lambda: False)
    study = StudyFolder(rehearse("demo", participants=1, seed=1, results=Path(folder) / "demo"))
    replay(study.sessions()[0].path)
    rehearse("physical2", participants=1, seed=1, results=Path(folder) / "physical2", recordings=False)
sys.stdout.write(f"{counter.compiled} functions compiled\n")
