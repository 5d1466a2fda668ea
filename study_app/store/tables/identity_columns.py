"""The columns that identify the session and the trial of a row."""

from study_app.store.tables.column import Column, optional

STUDY = Column("study", "text", "Short name of the study, from its protocol.")
PARTICIPANT = Column("participant", "text", "The participant's id: letters and digits, not a name.")
SESSION = Column("session", "integer", "Number of the participant's session.", minimum=1, maximum=99)
SIMULATED = Column("simulated", "flag", "true if participant and device were simulated (a rehearsal).")
PILOT = Column("pilot", "flag", "true if the session was a pilot.")
TRIAL = Column("trial", "integer", "Number of the trial in the session, in the order of presentation.", minimum=1)
ATTEMPT = Column("attempt", "integer", "1, or higher if the trial was repeated; the highest counts.", minimum=1)
BLOCK = Column("block", "text", "Id of the block of trials.")
PHASE = Column(
    "phase",
    "text",
    "Purpose of the trial; only main trials are analysed.",
    levels=(
        ("main", "analysed"),
        ("practice", "learning the task"),
        ("baseline", "the undisturbed task to which later statements refer"),
    ),
)
PART = optional("part", "integer", "Part of the study, as shown to the participant.", minimum=1)
INDEX = Column("index", "integer", "Position of the trial in its block, from 1.", minimum=1)
CODE = Column("code", "text", "What was presented, as a code (L1, D3 ...) that the sealed key translates.")

SESSION_COLUMNS = (STUDY, PARTICIPANT, SESSION, SIMULATED, PILOT)
"""Which session a row is about."""

TRIAL_COLUMNS = (TRIAL, ATTEMPT, BLOCK, PHASE, PART, INDEX)
"""Which trial of it."""
