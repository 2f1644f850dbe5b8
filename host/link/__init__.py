"""The serial link, from the host's end: frames, lost and repeated ones, sessions, ports."""
