"""What is in HDF5 files."""

import h5py


def datasets(group):
    """Those of a group, by their paths in it."""
    found = {}
    group.visititems(lambda name, item: found.update({name: item}) if isinstance(item, h5py.Dataset) else None)
    return found
