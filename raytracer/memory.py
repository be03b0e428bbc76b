"""What a picture needs of this machine's memory: said or refused before it is begun."""

from __future__ import annotations

import os

from raytracer.checks import InputError
from raytracer.terminal import complain

# Pictures that need more host memory than this say so before they start.
_WORTH_MENTION = 2**30


def physical_memory() -> int | None:
    """Bytes that this machine has; None where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not on this system
        return None


def check_memory(needed: int, size: tuple[int, int]) -> None:
    """Raise InputError if a picture needs more bytes than there are; say so if it needs many."""
    gib, physical = needed / 2**30, physical_memory()
    if physical is not None and needed > physical:
        raise InputError(
            f"expected a picture that fits into this machine's {physical / 2**30:.1f} GiB of memory, "
            f"got {size[0]}x{size[1]}, which needs {gib:.1f} GiB",
            "size",
        )
    if needed > _WORTH_MENTION:
        complain(f"this picture needs {gib:.1f} GiB of memory")
