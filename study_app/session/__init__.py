"""Running a study without Qt: events in, pages and commands out.

``start`` claims or reopens a session, ``transitions.table`` decides what follows an event, and ``runner`` carries it
out; read these first. ``tasks`` says when a trial ends, ``trial`` records and measures it, and ``simulated`` runs whole
sessions with simulated participants.

Reading order: compile_worker, pages, preflight, replay, resume, tasks; ports, transitions; device_buttons,
preflight_measurements, trial, watch; runner, start; simulated.

Public modules: compile_worker, pages, ports, preflight, preflight_measurements, replay, resume, runner,
simulated.answers_only, simulated.observers, simulated.paced_levels, simulated.predicted_delivery, simulated.rehearsal,
simulated.rehearsal_worker, start, tasks, transitions.events, transitions.page_builder, transitions.state, watch.
"""
