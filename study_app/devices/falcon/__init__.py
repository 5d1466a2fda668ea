"""The Novint Falcon: a driver in layers, and an emulator to put in front of it.

From the wire to the hand: ``wire`` (numbers of the protocol), ``packets`` (bytes and what they mean), ``transport``
(the USB bridge), ``firmware`` and ``boot`` (the program it needs after power-up), ``kinematics`` (angles, positions,
torques), ``exchange`` (the compiled tick), ``device`` (homing, lights, the gate before any force), ``guard`` (zero
torque when the program dies), ``calibration`` (motor units a newton). ``emulator`` answers as a Falcon would.
"""
