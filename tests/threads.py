"""Calls in threads at the same time."""

import threading
from collections.abc import Callable


def run_in_threads(*calls: Callable[[], object]) -> list[object]:
    """Run all calls at once, each in a thread of its own; return the result of each, or its exception."""
    results: list[object] = [None] * len(calls)

    def run(k: int) -> None:
        try:
            results[k] = calls[k]()
        except BaseException as error:
            results[k] = error

    threads = [threading.Thread(target=run, args=(k,), daemon=True) for k in range(len(calls))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60)
    assert not any(thread.is_alive() for thread in threads), "a thread hangs"
    return results
