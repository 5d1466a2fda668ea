"""The servo and what surrounds it: packing, telemetry, threads, offline runs.

Reading order: grants, pack, telemetry; clocks; closed_loop, offline, thread; servo.
"""
