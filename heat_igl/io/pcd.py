"""PCD, the format of the Point Cloud Library: text and binary."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from heat_igl.errors import MeshError
from heat_igl.io.text import Text
from heat_igl.typing import AnyArray, FloatArray

__all__ = ["read"]

_NORMALS = ("normal_x", "normal_y", "normal_z")
_KINDS = {"F": "f", "I": "i", "U": "u"}


def read(path: Path, data: bytes) -> tuple[FloatArray, FloatArray | None]:
    """The points (n, 3) of a PCD file, and their normals if it has any."""
    end = re.search(rb"^DATA[ \t]+(\w+)[ \t]*\r?\n", data, re.MULTILINE)
    if end is None:
        raise MeshError(f"{path}: the header has no line 'DATA ascii' or 'DATA binary': the file is no PCD file")
    header = {
        words[0]: words[1:]
        for line in data[: end.start()].decode("latin-1").splitlines()
        if (words := line.split("#")[0].split())
    }
    dtype, n = _layout(path, header)
    kind = end[1].decode("latin-1").lower()
    if kind == "binary":
        if len(data) - end.end() < n * dtype.itemsize:
            raise MeshError(f"{path}: the header announces {n} points, but the file ends before them: it is cut short")
        table = np.frombuffer(data, dtype, n, end.end())
    elif kind == "ascii":
        table = _from_text(path, data, end.end(), dtype, n)
    else:
        raise MeshError(f"{path}: DATA {kind} is not read: convert the file to DATA binary or DATA ascii")

    def columns(names: tuple[str, ...]) -> FloatArray:
        return np.stack([table[name].astype(np.float64).reshape(n, -1)[:, 0] for name in names], axis=1)

    names = dtype.names or ()
    return columns(("x", "y", "z")), columns(_NORMALS) if set(_NORMALS) <= set(names) else None


def _layout(path: Path, header: dict[str, list[str]]) -> tuple[np.dtype[np.void], int]:
    """The fields of a point, and the number of points."""
    fields = header.get("FIELDS", [])
    counts = header.get("COUNT", ["1"] * len(fields))
    try:
        n = int(header["POINTS"][0]) if "POINTS" in header else int(header["WIDTH"][0]) * int(header["HEIGHT"][0])
        formats = [f"<{_KINDS[kind]}{int(size)}" for kind, size in zip(header["TYPE"], header["SIZE"], strict=True)]
        # Padding is a field called "_", any number of times.
        names = [f"_{i}" if name == "_" else name for i, name in enumerate(fields)]
        dtype = np.dtype(
            [(name, form, (int(count),)) for name, form, count in zip(names, formats, counts, strict=True)]
        )
    except (KeyError, IndexError, ValueError, TypeError):
        raise MeshError(
            f"{path}: the header needs FIELDS, SIZE, TYPE, WIDTH and HEIGHT that agree: the file is damaged"
        ) from None
    if not {"x", "y", "z"} <= set(names):
        raise MeshError(f"{path}: the file has the fields {' '.join(fields)}, but points need x, y and z")
    if n < 1:
        raise MeshError(f"{path}: the header announces no points")
    return dtype, n


def _from_text(path: Path, data: bytes, begin: int, dtype: np.dtype[np.void], n: int) -> AnyArray:
    # Blank lines replace the header, so that errors give the right line numbers.
    text = Text(path, b"\n" * data.count(b"\n", 0, begin) + data[begin:])
    width = sum(dtype[i].shape[0] for i in range(len(dtype.names or ())))
    if len(text) != n:
        raise MeshError(f"{path}: the header announces {n} points, but {len(text)} lines follow: the file is damaged")
    wrong = text.count != width
    if wrong.any():
        raise text.error(int(np.argmax(wrong)), f"a point has {width} numbers ({int(wrong.sum())} lines differ)")
    values = text.all_numbers().reshape(n, width)
    table = np.empty(n, [(name, "f8", dtype[name].shape) for name in dtype.names or ()])
    column = 0
    for name in dtype.names or ():
        size = dtype[name].shape[0]
        table[name] = values[:, column : column + size]
        column += size
    return table
