"""Errors in readers of files: what a file may cause names the file, faults of the program stay visible."""

import json

import h5py
import numpy as np
import pytest

from ffrobot.common.errors import InputError, blaming_file, quoted
from ffrobot.common.hdf5 import blaming
from ffrobot.mesh.med import read_med

FAULTS = {
    "unknown name": lambda: unknown,  # noqa: F821
    "attribute of a module": lambda: json.unknown,
    "attribute of a class": lambda: InputError.unknown,
    "attribute of an object": lambda: InputError("").unknown,
    "wrong call": lambda: quoted(1, 2, 3),
}
DATA = {
    "no number": lambda: float("x"),
    "no key": lambda: {}["x"],
    "nothing in place of an array": lambda: None.shape,
    "type of a value": lambda: float([]),
}


@pytest.mark.parametrize("reader", ["file", "hdf5"])
@pytest.mark.parametrize("what", [*FAULTS, *DATA])
def test_readers_blame_files_for_data_alone(tmp_path, reader, what):
    path = tmp_path / "file.h5"
    h5py.File(path, "w").close()  # none of ffrobot, whose checksum it lacks
    error = InputError if what in DATA else (NameError, AttributeError, TypeError)
    with pytest.raises(error), blaming(path) if reader == "hdf5" else blaming_file(str):
        (FAULTS | DATA)[what]()


def test_groups_in_place_of_datasets_are_damage(tmp_path):
    path = tmp_path / "part.med"
    with h5py.File(path, "w") as file:
        mesh = file.create_group("ENS_MAA/part")
        mesh.attrs["ESP"] = np.int32(3)
        mesh.create_group("NOE/COO")
    with pytest.raises(InputError, match=r"^expected a MED file, found one that cannot be read: "):
        read_med(path)
