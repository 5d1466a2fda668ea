"""The servo and what surrounds it: packing, telemetry, threads, offline runs.

Reading order: clocks, pack, telemetry; offline, thread; servo.
"""
