"""The address of a scheduler: its form, and a quick look at the server that listens there."""

from __future__ import annotations

import re
import socket
from typing import Any

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError
from raytracer.farm.roster import FarmError

# Seconds for a scheduler to accept a connection and to send its first bytes, which takes milliseconds in a network.
_SECONDS = 5.0
# A Dask server begins with the length of its first message and its number of frames, as 64-bit integers.
_HEAD = 16
# The most bytes and frames of a server's first message. Dask sends 58 bytes in 1 frame.
_MOST_BYTES = 4096
_MOST_FRAMES = 16
_FORM = re.compile(r"(tcp|tls)://(\[[0-9A-Fa-f:.]+\]|[^\s/:@\[\]]+):([0-9]{1,5})")


def check_address(value: Any, key: str = "scheduler") -> str:
    """Return the address of a scheduler, such as "tcp://10.0.0.1:8786" or "tls://host:8786". Raises InputError."""
    match = _FORM.fullmatch(value) if isinstance(value, str) else None
    if not match or not 1 <= int(match[3]) <= 65535:
        expected = "tcp://HOST:PORT or tls://HOST:PORT"
        raise InputError(
            f"expected {expected}, the address that `dask scheduler` prints, got {format_value(value)}", key
        )
    return match[0]


def check_server(address: str) -> None:
    """Raise FarmError unless a Dask server listens at the address. With TLS, only the connection is tried."""
    scheme, host, port = _FORM.fullmatch(address).groups()  # pyright: ignore[reportOptionalMemberAccess]
    try:
        with socket.create_connection((host.strip("[]"), int(port)), _SECONDS) as connection:
            if scheme == "tls":
                return
            connection.settimeout(_SECONDS)
            head = b""
            while len(head) < _HEAD and (data := connection.recv(_HEAD - len(head))):
                head += data
    except TimeoutError:
        raise FarmError(f"no Dask scheduler answers at {address} within {_SECONDS:g} s") from None
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FarmError(f"no scheduler at {address}: {reason}; start one with `dask scheduler`") from None
    size, frames = int.from_bytes(head[:8], "little"), int.from_bytes(head[8:], "little")
    if len(head) < _HEAD or not (1 <= size <= _MOST_BYTES and 1 <= frames <= _MOST_FRAMES):
        raise FarmError(f"the server at {address} is no Dask scheduler of this scheme")
