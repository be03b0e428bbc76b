"""The roster of a farm: the workers of a scheduler that are there now, and which of them may draw."""

from __future__ import annotations

import pickle
import time
import warnings
from collections import Counter
from typing import TYPE_CHECKING, Any

from raytracer.farm.remote import Identity, identify, own_code

if TYPE_CHECKING:
    from distributed import Client

# Seconds between two looks at the list of workers: a dead worker is noticed after this time, and one look takes the
# scheduler some milliseconds even with 500 workers.
_INTERVAL = 0.5
# Seconds to wait for further answers after the first one. A worker opens its OpenGL context in 1 to 3 s; a worker that
# draws for another user answers later, and is accepted then.
_ANSWERS = 5.0
# Seconds between two looks while the farm opens.
_PAUSE = 0.05


class _Question:
    """An object whose pickle, when it is loaded, calls identify()."""

    def __reduce__(self) -> tuple[Any, ...]:
        return identify, ()


# A task with a function of this project would end a worker that lacks the project: Dask cannot read the message. A task
# with a function of Python itself, which reads the pickle of a function of this project, is an ordinary error there.
_QUESTION = pickle.dumps(_Question())


class FarmError(RuntimeError):
    """A farm that does not work: no scheduler answers, or no worker is there. The message is one line."""


class Roster:
    """The workers of a scheduler by their addresses. Each is asked for its identity once, before it gets work.

    Attributes:
        accepted: the workers that may draw.
        refused: the other workers, each with the reason.
    """

    def __init__(self, client: Client, mixed: bool) -> None:
        self._client: Any = client  # Dask's types are those of its asynchronous clients, too
        self._mixed = mixed
        self._driver: tuple[str, str] | None = None
        self._questions: dict[str, Any] = {}
        self._next_look = 0.0
        self.accepted: dict[str, Identity] = {}
        self.refused: dict[str, str] = {}

    def open(self, fewest: int, seconds: float) -> None:
        """Wait until `fewest` workers have answered, and choose the driver that most of them have.

        Raises FarmError if none has answered after `seconds`, or if all that answered are refused.
        """
        start = first = time.monotonic()
        answers: dict[str, Identity] = {}
        while True:
            self._look()
            answers |= self._collect()
            now = time.monotonic()
            first = first if answers or self.refused else now
            is_complete = not self._questions and len(answers) >= fewest
            if is_complete or now - first > _ANSWERS or now - start > seconds:
                break
            time.sleep(_PAUSE)
        matching = Counter(_driver(identity) for identity in answers.values() if self._is_current(identity))
        if matching:
            self._driver = matching.most_common(1)[0][0]
        for address, identity in answers.items():
            self._admit(address, identity)
        if not self.accepted:
            raise FarmError(self.absence(seconds))

    def refresh(self) -> None:
        """Look at the list of workers again, unless that was done just now."""
        if time.monotonic() >= self._next_look:
            self._look()
            for address, identity in self._collect().items():
                self._admit(address, identity)

    def refuse(self, address: str, reason: str) -> None:
        """Give no more work to a worker, and warn."""
        self.accepted.pop(address, None)
        self.refused[address] = reason
        warnings.warn(f"worker {address} gets no work: {reason}", stacklevel=2)

    def absence(self, seconds: float) -> str:
        """Return the message that no worker is there."""
        if self.refused:
            address, reason = next(iter(self.refused.items()))
            return f"no worker of the farm can be used; {address}: {reason}"
        return f"no worker of the farm answered within {seconds:g} s; start workers with `dask worker`"

    def _look(self) -> None:
        """Compare with the scheduler's list, and ask new workers."""
        self._next_look = time.monotonic() + _INTERVAL
        try:
            present = {*self._client.nthreads()}
        except (OSError, TimeoutError):  # the connection is lost; the client reconnects
            return
        for known in (self.accepted, self.refused, self._questions):
            for address in known.keys() - present:
                del known[address]
        for address in present - self.accepted.keys() - self.refused.keys() - self._questions.keys():
            self._questions[address] = self._client.submit(pickle.loads, _QUESTION, workers=[address], pure=False)

    def _collect(self) -> dict[str, Identity]:
        """Return the answers that came, and refuse the workers that cannot answer."""
        answers: dict[str, Identity] = {}
        for address, question in [*self._questions.items()]:
            if question.status == "pending":
                continue
            del self._questions[address]
            if question.status == "finished":
                try:
                    answers[address] = Identity(*question.result(timeout=_ANSWERS))
                except (OSError, TimeoutError):  # the worker ended, or the connection was lost: ask again
                    continue
            elif question.status == "error":
                error = question.exception()
                if type(error).__name__ != "KilledWorker":
                    self.refuse(address, _problem(error))
        return answers

    def _is_current(self, identity: Identity) -> bool:
        return self._mixed or identity.code == own_code()

    def _admit(self, address: str, identity: Identity) -> None:
        """Accept or refuse a worker that answered."""
        if not self._is_current(identity):
            self.refuse(address, other_code(identity.code))
            return
        self._driver = self._driver or _driver(identity)
        if _driver(identity) == self._driver or self._mixed:
            self.accepted[address] = identity
        else:
            own, others = ", ".join(_driver(identity)), ", ".join(self._driver)
            reason = f"it has the driver {own}, the others have {others}; accept it by --mixed"
            self.refuse(address, reason)


def _driver(identity: Identity) -> tuple[str, str]:
    return identity.driver, identity.opengl


def other_code(code: str) -> str:
    """Return the reason to refuse a worker with other code."""
    return f"it runs raytracer {code}, expected {own_code()}; install that version there, or accept it by --mixed"


def _problem(error: BaseException | None) -> str:
    """Return the reason to refuse a worker whose answer is an error."""
    if isinstance(error, ModuleNotFoundError):
        return f"it lacks the Python package {error.name}; install this project there"
    return " ".join(f"{type(error).__name__}: {error}".split())
