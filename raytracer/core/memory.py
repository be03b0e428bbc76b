"""Memory check: a warning or an error, before rendering starts, if a picture needs much or too much memory."""

from __future__ import annotations

import os
import warnings

from raytracer.core.validation import InputError

# A warning is given for a picture that needs more than _WARN_BYTES and more than _WARN_SHARE of the machine's memory.
# The worker processes of a reference picture, one per processor, need less than this share.
_WARN_BYTES, _WARN_SHARE = 2**30, 1 / 8


def physical_memory() -> int | None:
    """Return the size of this machine's memory in bytes, or None if the system does not report it."""
    try:
        return os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, ValueError, OSError):  # sysconf, or one of the names, does not exist on this system
        return None


def check_memory(needed: int, size: tuple[int, int], remedy: str = "") -> None:
    """Raise InputError if a picture needs more memory than the machine has; warn (UserWarning) if it needs much.

    Args:
        needed: bytes.
        size: (width, height) of the picture in pixels, for the error message.
        remedy: the end of the error message. Default: none.
    """
    gib, physical = needed / 2**30, physical_memory()
    if physical is not None and needed > physical:
        raise InputError(
            f"expected a picture that fits into this machine's {physical / 2**30:.1f} GiB of memory, "
            f"got {size[0]}x{size[1]}, which needs {gib:.1f} GiB{remedy}",
            "size",
        )
    if needed > max(_WARN_BYTES, _WARN_SHARE * (physical or 0)):
        warnings.warn(f"this picture needs {gib:.1f} GiB of memory", stacklevel=4)


def picture_bytes(
    size: tuple[int, int],
    geometry: bool,
    refines: bool = False,
    keeps_sums: bool = False,
    transparent: bool = False,
) -> int:
    """Return an upper bound of the memory for rendering and saving a picture, in bytes, without the program itself.

    Args:
        size: (width, height) in pixels.
        geometry: whether depth, normals, materials and the errors of pixels are kept.
        refines: whether pixels get different numbers of samples.
        keeps_sums: whether the sums of all samples are kept on the GPU, which may share the machine's memory: for
            pictures with a stopping rule (`max_error` or `time`).
        transparent: whether the picture has an alpha.
    """
    # Bytes per pixel. Radiance: 12. Geometry: depth 4, normal 12, material 4 and its index 4, error 4. Number of
    # samples: twice 4. Sums: current sums 16, a copy of earlier sums 16, the sums before those 12, and the float64 copy
    # of the latter on the CPU 24. Alpha: 4, its sum on the GPU 4, and the sum before on the CPU 4.
    return size[0] * size[1] * (12 + 28 * geometry + 8 * refines + 68 * keeps_sums + 12 * transparent)
