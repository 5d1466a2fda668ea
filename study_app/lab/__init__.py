"""The liquid lab without its windows: adjustable parameters, two settings side by side, and their forces."""
