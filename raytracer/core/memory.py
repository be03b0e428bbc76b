"""The memory that a picture needs: a warning or an error before the picture is begun."""

from __future__ import annotations

import os
import warnings

from raytracer.core.validation import InputError

# Bytes, and a share of all memory: pictures that need more than both are warned of before they start. A machine's
# processes for a reference, one for each processor, take a smaller share.
_WORTH_MENTION, _SHARE = 2**30, 1 / 8


def physical_memory() -> int | None:
    """Bytes that this machine has; None where the system does not tell."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # not on this system
        return None


def check_memory(needed: int, size: tuple[int, int]) -> None:
    """Raise InputError if a picture needs more bytes than there are; warn (UserWarning) if it needs many of them."""
    gib, physical = needed / 2**30, physical_memory()
    if physical is not None and needed > physical:
        raise InputError(
            f"expected a picture that fits into this machine's {physical / 2**30:.1f} GiB of memory, "
            f"got {size[0]}x{size[1]}, which needs {gib:.1f} GiB",
            "size",
        )
    if needed > max(_WORTH_MENTION, _SHARE * (physical or 0)):
        warnings.warn(f"this picture needs {gib:.1f} GiB of memory", stacklevel=4)


def picture_bytes(size: tuple[int, int], geometry: bool, refines: bool = False, keeps_sums: bool = False) -> int:
    """Bytes of memory that rendering and saving a picture take at most, beside the program itself.

    A picture with a stopping rule keeps the sums of all its samples, on the GPU, which may share this memory.
    """
    # radiance 12; depth 4, normal 12, material 4 and its index 4, error 4; the number of samples twice 4;
    # sums 16, a copy of earlier ones 16, the sums before them 12, which the host has in float64: 24
    return size[0] * size[1] * (12 + 28 * geometry + 8 * refines + 68 * keeps_sums)
