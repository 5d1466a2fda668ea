"""The state machine of a session: events, state, commands, transition table."""
