#!/usr/bin/env python3
"""Compare two results files, or all of two folders, dataset by dataset and attribute by attribute.

    scripts/compare_results.py BEFORE AFTER                  bit for bit
    scripts/compare_results.py BEFORE AFTER --relative 1e-9  to that part of the largest value of each dataset

Prints what differs, and by how much; the exit code is 1 where anything does. What tells of the run, not of the numbers
(its seconds, the version of the program), is left out. Needs NumPy and h5py.
"""

import argparse
import sys
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

OF_THE_RUN = {"wall_seconds", "seconds", "ffrobot_version"}


def main() -> int:
    """Compare what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before", type=Path, help="results file, or a folder of such")
    parser.add_argument("after", type=Path, help="likewise")
    parser.add_argument("--relative", type=float, default=0.0, help="allowed difference, of the largest value")
    options = parser.parse_args()
    if options.before.is_dir() != options.after.is_dir() or not (options.before.exists() and options.after.exists()):
        parser.error("expected two files, or two folders")
    compared, found = 0, 0
    for before, after in pairs(options.before, options.after):
        if not (before.exists() and after.exists()):
            print(f"{(after if before.exists() else before)}: missing")
            found += 1
            continue
        with h5py.File(before) as one, h5py.File(after) as other:
            compared += count(one)
            for line in differences(one, other, options.relative):
                print(f"{after.name}: {line}")
                found += 1
    print(f"{compared} datasets compared, {found} differences")
    if not compared:
        print("nothing to compare: expected *.h5 files", file=sys.stderr)
    return 1 if found or not compared else 0


def pairs(before: Path, after: Path) -> list[tuple[Path, Path]]:
    """The files to compare: themselves, or those of the same name in two folders."""
    if not before.is_dir():
        return [(before, after)]
    names = sorted({path.name for folder in (before, after) for path in folder.glob("*.h5")})
    return [(before / name, after / name) for name in names]


def items(file: h5py.File) -> dict[str, h5py.HLObject]:
    """Everything in a file by its name; the file itself is "/"."""
    found: dict[str, h5py.HLObject] = {"/": file}
    file.visititems(found.__setitem__)
    return found


def count(file: h5py.File) -> int:
    """Number of datasets in a file."""
    return sum(isinstance(item, h5py.Dataset) for item in items(file).values())


def differences(one: h5py.File, other: h5py.File, relative: float) -> Iterator[str]:
    """A line for everything that is in one of the files only, or differs."""
    before, after = items(one), items(other)
    for name in sorted(before.keys() ^ after.keys()):
        yield f"{name}: only {'before' if name in before else 'after'}"
    for name in sorted(before.keys() & after.keys()):
        a, b = before[name], after[name]
        if isinstance(a, h5py.Dataset) != isinstance(b, h5py.Dataset):
            yield f"{name}: a dataset in one, a group in the other"
        elif isinstance(a, h5py.Dataset) and (line := difference(a[()], b[()], relative)):
            yield f"{name}: {line}"
        for key in sorted((a.attrs.keys() | b.attrs.keys()) - OF_THE_RUN):
            if key not in a.attrs or key not in b.attrs:
                yield f"{name}: attribute {key}: only {'before' if key in a.attrs else 'after'}"
            elif line := difference(a.attrs[key], b.attrs[key], relative):
                yield f"{name}: attribute {key}: {line}"


def difference(before: object, after: object, relative: float) -> str:
    """How two values differ; empty where they do not."""
    a, b = np.asarray(before), np.asarray(after)
    if a.shape != b.shape or a.dtype.kind != b.dtype.kind:
        return f"{a.dtype} {a.shape} became {b.dtype} {b.shape}"
    if a.dtype.kind != "f":
        return "" if np.array_equal(a, b) else (f"{before} became {after}" if a.ndim == 0 else "differs")
    if np.array_equal(a, b, equal_nan=True):
        return ""
    if not np.array_equal(np.isnan(a), np.isnan(b)):
        return "not a number in other places"
    apart, size = np.nanmax(np.abs(a - b)), np.nanmax(np.abs(a))
    if apart <= relative * size:
        return ""
    return f"differs by {apart:.3g}, {apart / size if size else np.inf:.3g} of the peak"


if __name__ == "__main__":
    sys.exit(main())
