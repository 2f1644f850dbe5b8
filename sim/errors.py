"""The exceptions that a user is meant to read."""


class InputError(Exception):
    """Bad input: one line that names the file or item, what is wrong and what to do."""


class UnfitError(InputError):
    """The machine is not one for what it is to do: says which parameter is in the way."""
