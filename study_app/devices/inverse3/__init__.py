"""The Haply Inverse3 through its maker's Inverse Service 3.5 or later: WebSocket and JSON, see docs/inverse3.md."""
