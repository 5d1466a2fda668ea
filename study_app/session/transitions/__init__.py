"""The state machine of a session: events, state, commands, transition table.

Reading order: events; state; page_builder; steps; moves; table.
"""
