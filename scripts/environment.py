"""What measured figures depend on; every script prints it with them."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version

import heat_igl

PACKAGES = (
    "numpy scipy libigl numba pyamg potpourri3d pygeodesic tvb-gdist pymeshlab meshio matplotlib scikit-fmm "
    "distributed zarr"
).split()


def environment() -> dict[str, str]:
    """Versions, system and number of processors, by name."""
    found = {
        "python": platform.python_version(),
        "system": platform.system(),
        "machine": platform.machine(),
        "cores": str(os.cpu_count()),
        "heat-igl": heat_igl.__version__,
    }
    for package in PACKAGES:
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "-"
    return found
