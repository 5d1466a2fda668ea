"""Protocols: a TOML file becomes a frozen value; the value, participant and seed give a schedule.

``load`` reads and checks a file, ``model`` is the value, and ``orders.schedule`` makes its trials; read these first.
``checks`` refuses what no type can express, ``warnings`` reports what is valid but unwise, ``trials`` has designs,
stimuli and methods.

Reading order: source, streams, table; groups, raters, sequences, wording; questions; blocks, questionnaires; trials;
model; formats, quantities, tracks, without_force; json_schema, orders, scene_file; differences, presented; checks,
simulated; load; upgrade, warnings; describe.
"""
