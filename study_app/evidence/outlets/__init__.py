"""The evidence about outlets: what arrives in another process, and its cost to the servo."""
