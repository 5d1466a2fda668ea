"""Compile what sessions, the lab, rehearsals and replay need: for a bundle, and for tests."""

import sys
import tempfile
from pathlib import Path
from random import Random

from study_app.devices.registry import all_devices
from study_app.devices.rig import open_rig, study_settings
from study_app.errors import StudyError
from study_app.haptics.kernels.compiled import following_compilation
from study_app.protocol.load import load
from study_app.session.replay import replay
from study_app.session.simulated.rehearsal import rehearse
from study_app.store.folders import StudyFolder

with tempfile.TemporaryDirectory() as folder, following_compilation(lambda _share: None) as counter:
    for device in all_devices():
        if device.kind != "simulated" and device.name != "mouse":
            continue
        try:
            open_rig(device.name, study_settings(load("demo"), Random(1))).stop()  # noqa: S311 - a simulated tremor
        except StudyError as error:
            sys.stdout.write(f"{device.name}: not compiled: {error}\n")
    study = StudyFolder(rehearse("demo", participants=1, seed=1, results=Path(folder) / "demo"))
    replay(study.sessions()[0].path)
    rehearse("physical2", participants=1, seed=1, results=Path(folder) / "physical2", recordings=False)
sys.stdout.write(f"{counter.compiled} functions compiled\n")
