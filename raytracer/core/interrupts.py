"""Handling of Ctrl-C: at any moment it ends the program with exit status 130 and at most one line of text."""

from __future__ import annotations

import os
import signal
import sys
import time
from contextlib import contextmanager
from functools import partial

# Replaces typing.TYPE_CHECKING: no handler is set while this module is imported, so it imports as little as possible.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from types import FrameType

# Exit status by the convention of shells: 128 plus the number of the signal (SIGINT is 2).
STATUS = 130
# Seconds after a Ctrl-C in which another SIGINT counts as the same key press: keys repeat, and a signal may reach a
# process twice. So the clean-up after Ctrl-C is not interrupted either, unless it takes longer.
_SAME_PRESS = 1.0
# Seconds until an interrupt that Python could not raise is sent again.
_RETRY_DELAY = 0.02


def run_guarded(load: Callable[[], Callable[[], int]]) -> int:
    """Run a program and return its exit status, or STATUS after Ctrl-C.

    Args:
        load: a function that imports the program and returns its main function, which returns an exit status. The
            handler of Ctrl-C is set before `load` is called, because imports take time.
    """
    # The parent process may have set SIGINT to be ignored, as a shell does for `raytracer ... &`: keep ignoring it.
    is_handled = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_handled:
        signal.signal(signal.SIGINT, _exit_on_interrupt)
    main = load()
    if not is_handled:
        return main()
    interrupts = _Interrupts()
    sys.unraisablehook = interrupts.raise_again
    try:
        signal.signal(signal.SIGINT, interrupts.raise_once)
        status = main()
    except BaseException:
        # C code may turn KeyboardInterrupt into any other error.
        if not interrupts.happened:
            raise
        status = STATUS
    finally:
        # An exception during the interpreter's shutdown cannot be raised, and nothing is left to interrupt.
        signal.signal(signal.SIGINT, signal.SIG_IGN)
    return STATUS if status and interrupts.happened else status


@contextmanager
def defer_interrupts() -> Iterator[None]:
    """Delay Ctrl-C until the end of the block, for calls of C code in which a Python exception must not be raised."""
    import threading

    handler = signal.getsignal(signal.SIGINT)
    # Python runs signal handlers in the main thread only.
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


def _exit_on_interrupt(*_: object) -> None:
    """Handle SIGINT during the imports, when nothing needs cleaning up."""
    try:
        os.write(2, b"raytracer: interrupted, nothing written\n")
    finally:  # also if standard error is closed
        os._exit(STATUS)


class _Interrupts:
    """Signal handler that raises one KeyboardInterrupt per key press. `happened`: whether Ctrl-C was pressed."""

    def __init__(self) -> None:
        self.happened = False
        self._last = -_SAME_PRESS

    def raise_once(self, number: int, frame: FrameType | None) -> None:
        """Handle SIGINT: raise KeyboardInterrupt, once per key press."""
        now = time.monotonic()
        if now - self._last >= _SAME_PRESS:
            self.happened, self._last = True, now
            raise KeyboardInterrupt

    def raise_again(self, lost: sys.UnraisableHookArgs) -> None:
        """Send SIGINT again if KeyboardInterrupt was lost in code that cannot raise, such as a destructor.

        The method is a `sys.unraisablehook`.
        """
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            if not self.happened:  # after an interrupt, errors of destructors are expected and not reported
                sys.__unraisablehook__(lost)
            return
        import threading

        self._last = -_SAME_PRESS
        main = threading.main_thread().ident
        send = signal.raise_signal
        if main is not None and hasattr(signal, "pthread_kill"):  # it also ends a blocking call; not on Windows
            send = partial(signal.pthread_kill, main)
        timer = threading.Timer(_RETRY_DELAY, send, (signal.SIGINT,))
        timer.daemon = True
        timer.start()
