"""Quiet Dask: no messages of its own, because a farm reports by outcomes, warnings and errors."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager

# A level above all levels of messages.
SILENT = logging.CRITICAL + 1
# The loggers of Dask and of the libraries below it.
_LOGGERS = ("distributed", "tornado", "asyncio", "bokeh")


@contextmanager
def quiet_logs() -> Iterator[None]:
    """Silence the loggers and warnings of Dask in this process for a block."""
    from distributed.versions import VersionMismatchWarning

    loggers = [logging.getLogger(name) for name in _LOGGERS]
    below = [logging.getLogger(name) for name in logging.root.manager.loggerDict if name.partition(".")[0] in _LOGGERS]
    loggers = list(dict.fromkeys([*loggers, *below]))
    before = [(logger, logger.level) for logger in loggers]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", category=VersionMismatchWarning)
        warnings.filterwarnings("ignore", "Sending large graph")
        for logger in loggers:
            logger.setLevel(SILENT)
        try:
            yield
        finally:
            for logger, level in before:
                logger.setLevel(level)
