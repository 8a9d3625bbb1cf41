"""The errors that Tickwise raises: one root, each also the builtin that one would catch."""


class TickwiseError(Exception):
    """The root of every error that Tickwise raises on purpose.

    Its message is one line (a parse error adds the line with the caret) that names the culprit and the remedy.
    """


class FormulaError(TickwiseError, ValueError):
    """A formula is malformed, or is not in the form that an operation needs."""


class ParseError(FormulaError):
    """A formula's text cannot be read; the message shows the place with a caret."""


class AutomatonError(TickwiseError, ValueError):
    """A timed automaton is malformed, not deterministic, or not isomorphic where it must be."""


class DataError(TickwiseError, ValueError):
    """Trajectories, labels or arrays have a wrong shape or a wrong value."""


class UnknownVariableError(DataError):
    """A formula names a variable that the data does not have."""


class ConfigurationError(TickwiseError, ValueError):
    """A setting is out of range, or settings contradict each other."""


class MissingFileError(TickwiseError, FileNotFoundError):
    """A file or a folder that was named does not exist."""


class FileAccessError(TickwiseError, OSError):
    """A file or a folder that was named is there, but cannot be read or written."""


class StoreError(TickwiseError, OSError):
    """A run folder cannot be read or written, or belongs to another configuration."""


class NotTransferableError(TickwiseError, RuntimeError):
    """The target is not logically transferable from the source (Definition 8)."""


class MissingExtraError(TickwiseError, ImportError):
    """An optional dependency is needed; the message names the extra that installs it."""


class ClusterError(TickwiseError, ConnectionError):
    """A cluster cannot be reached, has no workers, or lost a job or itself."""
