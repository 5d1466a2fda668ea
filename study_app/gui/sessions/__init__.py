"""The table of sessions and the page of a session, which several windows show."""
