"""An emulated Inverse Service, written from docs.haply.co alone: it shares no code with the client."""
