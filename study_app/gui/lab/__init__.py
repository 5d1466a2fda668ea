"""The liquid lab's place in the operator's window."""
