"""The liquid lab without its windows: what can be changed, two settings side by side, and what was felt of them."""
