"""Haptic devices: interface, drivers, emulators and measurement.

``descriptor`` says what a device is, ``driver`` opens, guards and closes one, and ``rig`` opens device and servo
together; read these first. ``descriptors`` lists the devices of the program.

Reading order: base, doctor, faulty, guard, hand; bench, descriptor, simulated; descriptors, spacemouse; registry;
doctor_worker, driver, rig; falcon, force_dimension, inverse3; emulators.

Public modules: base, bench.procedure, descriptor, descriptors, doctor, doctor_worker, driver, emulators.falcon,
emulators.falcon_emulator, falcon.calibration, falcon.device, falcon.mechanics, faulty, hand, registry, rig, simulated.
"""

from typing import Final

NAME_PATTERN: Final = "[a-z][a-z0-9-]*"
DEFAULT_DEVICE: Final = "mouse"
WITHOUT_FORCE: Final = {"mouse": "Mouse", "spacemouse": "SpaceMouse"}
"""The titles of devices that give no force, by name."""
