"""What the participant does with the ball in one trial: a module per kind of task."""
