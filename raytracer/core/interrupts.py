"""Ctrl-C: the status 130 and at most one line, whenever it comes."""

from __future__ import annotations

import os
import signal
import sys
import time
from contextlib import contextmanager
from functools import partial

# As typing.TYPE_CHECKING: while this module is imported there is no handler yet, so it imports as little as it can.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

# As shells have it: 128 and the signal's number.
STATUS = 130
# Seconds. Keys repeat, and a signal may reach a process twice: one that comes so soon is of the same press. So nothing
# interrupts the cleaning up after an interrupt, unless that takes long.
_SAME_PRESS = 1.0
# Seconds until an interrupt that got lost is tried again.
_AGAIN = 0.02


def run_guarded(load: Callable[[], Callable[[], int]]) -> int:
    """Run the program that `load` imports; the exit status, which is STATUS after Ctrl-C.

    The handler of Ctrl-C is there before `load` is called, as imports take time.
    """
    # A parent may ignore the signal, as a shell does for `raytracer ... &`: then it stays ignored.
    guards = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if guards:
        signal.signal(signal.SIGINT, _end)
    main = load()
    if not guards:
        return main()
    interrupts = _Interrupts()
    sys.unraisablehook = interrupts.raise_again
    try:
        signal.signal(signal.SIGINT, interrupts.raise_once)
        status = main()
    except BaseException:
        # Code in C may turn an interrupt into any other error.
        if not interrupts.happened:
            raise
        status = STATUS
    finally:
        # The interpreter's end cannot raise, and there is nothing left to interrupt.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return STATUS if status and interrupts.happened else status


@contextmanager
def deferred() -> Iterator[None]:
    """Interrupts wait for the end of the block: it calls code in C that does not survive an exception of Python's."""
    import threading

    handler = signal.getsignal(signal.SIGINT)
    # Only the main thread gets signals.
    if not callable(handler) or threading.current_thread() is not threading.main_thread():
        yield
        return
    waiting: list[tuple[int, FrameType | None]] = []
    signal.signal(signal.SIGINT, lambda number, frame: waiting.append((number, frame)))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, handler)
        if waiting:
            handler(*waiting[0])


def _end(*_: object) -> None:
    """Handle a signal while there is nothing to clean up."""
    try:
        os.write(2, b"raytracer: interrupted, nothing written\n")
    finally:  # also where there is no standard error
        os._exit(STATUS)


class _Interrupts:
    """Makes an exception of a press. `happened`: whether there was one."""

    def __init__(self) -> None:
        self.happened = False
        self._last = -_SAME_PRESS

    def raise_once(self, number: int, frame: FrameType | None) -> None:
        """Handle a signal: raise KeyboardInterrupt, once for each press."""
        now = time.monotonic()
        if now - self._last >= _SAME_PRESS:
            self.happened, self._last = True, now
            raise KeyboardInterrupt

    def raise_again(self, lost: sys.UnraisableHookArgs) -> None:
        """Send an interrupt again that came in code that cannot raise, such as a destructor: a sys.unraisablehook."""
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            if not self.happened:  # afterwards a destructor may well miss something
                sys.__unraisablehook__(lost)
            return
        import threading

        self._last = -_SAME_PRESS
        main = threading.main_thread().ident
        again = signal.raise_signal
        if main is not None and hasattr(signal, "pthread_kill"):  # which ends a call that waits, too; not on Windows
            again = partial(signal.pthread_kill, main)
        timer = threading.Timer(_AGAIN, again, (signal.SIGINT,))
        timer.daemon = True
        timer.start()
