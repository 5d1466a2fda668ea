"""The servo and what surrounds it: packing, telemetry, threads, offline runs."""
