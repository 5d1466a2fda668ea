"""The replay of a recorded trial: the participant's tank, the forces and the events."""
