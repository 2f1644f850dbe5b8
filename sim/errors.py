"""The one exception that a user is meant to read."""


class InputError(Exception):
    """Bad input: one line that names the file or item, what is wrong and what to do."""
