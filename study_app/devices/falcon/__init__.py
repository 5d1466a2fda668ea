"""The Novint Falcon: a driver in layers, and an emulator.

``wire`` (constants, packets and replies of the protocol), ``transport`` (the USB bridge), ``firmware`` and ``boot``
(loading the firmware after power-up), ``mechanics`` (geometry, kinematics, calibration), ``exchange`` (the compiled
tick), ``device`` and ``homing`` (opening, lights, no force before homing). ``emulator`` answers as a Falcon would.
"""
