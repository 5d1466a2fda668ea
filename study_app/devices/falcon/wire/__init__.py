"""Constants, packets and replies of the Falcon's protocol."""
