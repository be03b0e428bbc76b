"""The address of a scheduler: its form, and a quick look at the server that listens there."""

from __future__ import annotations

import re
import socket
import ssl
import time
from typing import Any

from raytracer.core.shown import format_value
from raytracer.core.validation import InputError
from raytracer.farm.roster import FarmError

# Seconds for a scheduler to accept a connection and to send its first bytes, which takes milliseconds in a network.
_SECONDS = 5.0
# Seconds between two attempts to connect.
_PAUSE = 0.2
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
        expected = "tcp://HOST:PORT or tls://HOST:PORT, the address that `dask scheduler` prints"
        raise InputError(f"expected {expected}, got {format_value(value)}", key)
    return match[0]


def check_server(address: str) -> None:
    """Raise FarmError unless a Dask server listens at the address, and InputError if TLS lacks certificates.

    Dask itself would wait for the first bytes of another server without a limit.
    """
    scheme, host, port = _FORM.fullmatch(address).groups()  # pyright: ignore[reportOptionalMemberAccess]
    context = _client_tls() if scheme == "tls" else None
    try:
        with _connect((host.strip("[]"), int(port))) as plain:
            plain.settimeout(_SECONDS)
            connection = plain if context is None else context.wrap_socket(plain)
            head = b""
            while len(head) < _HEAD and (data := connection.recv(_HEAD - len(head))):
                head += data
    except TimeoutError:
        raise FarmError(f"no Dask scheduler answers at {address} within {_SECONDS:g} s") from None
    except ssl.SSLError as error:
        raise FarmError(f"the server at {address} refuses this TLS connection: {error.reason or error}") from None
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise FarmError(f"no scheduler at {address}: {reason}; start one with `dask scheduler`") from None
    size, frames = int.from_bytes(head[:8], "little"), int.from_bytes(head[8:], "little")
    if len(head) < _HEAD or not (1 <= size <= _MOST_BYTES and 1 <= frames <= _MOST_FRAMES):
        raise FarmError(f"the server at {address} is no Dask scheduler of this scheme")


def _connect(place: tuple[str, int]) -> socket.socket:
    """Connect to a server, which may be starting: a refused connection is tried again. Raises OSError."""
    end = time.monotonic() + _SECONDS
    while True:
        try:
            return socket.create_connection(place, _SECONDS)
        except ConnectionRefusedError:
            if time.monotonic() > end:
                raise
        time.sleep(_PAUSE)


def _client_tls() -> ssl.SSLContext:
    """Return the TLS context of Dask's configuration for clients. Raises InputError."""
    from distributed.security import Security

    try:
        context = Security().get_connection_args("client").get("ssl_context")
    except (OSError, ValueError) as error:
        raise InputError(f"expected TLS certificates in Dask's configuration, got the error {error}") from None
    if context is None:
        names = "CA_FILE, CLIENT__CERT and CLIENT__KEY after DASK_DISTRIBUTED__COMM__TLS__"
        raise InputError(f"tls:// needs the certificates of the farm in environment variables: {names}")
    return context
