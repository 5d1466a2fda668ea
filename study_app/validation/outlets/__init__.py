"""The evidence about outlets: what arrives in another process, and what it costs the servo."""
