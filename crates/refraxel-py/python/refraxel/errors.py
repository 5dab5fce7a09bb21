"""Exceptions. Their texts name the file or argument, what was found, what was expected and what to do."""


class RefraxelError(Exception):
    """What all exceptions of this package have in common."""


class InputError(RefraxelError, ValueError):
    """A dataset, run, option or argument cannot be used as it is."""


class FileError(RefraxelError, OSError):
    """A file could not be read or written."""


class DivergedError(RefraxelError, ArithmeticError):
    """The computation left the finite numbers, also after going back to its last good state."""


class CancelledError(RefraxelError):
    """Somebody wished that the work stops; it has changed nothing."""
