"""Errors that are the user's to repair."""


class InputError(Exception):
    """Bad usage or input. The message is one line: what, where, what was expected, how to repair it. Exit status 2."""
