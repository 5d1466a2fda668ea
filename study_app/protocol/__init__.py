"""Protocols: a TOML file becomes a frozen value; the value, participant and seed give a schedule.

``load`` reads and checks a file, ``model`` is the value, and ``orders.schedule`` makes its trials; read these first.
``checks`` refuses what no type can express, ``warnings`` reports what is valid but unwise, ``trials`` has designs,
stimuli and methods.

Reading order: randomization, source; participants, quantities, wording; questions; blocks, questionnaires; trials;
model; file_format, without_force; orders; presented; checks, simulated; load; upgrade, warnings; descriptions.

Public modules: blocks, checks, descriptions, file_format, load, model, orders, participants, presented, quantities,
questionnaires, questions, randomization, simulated, source, trials, upgrade, warnings, without_force, wording.
"""
