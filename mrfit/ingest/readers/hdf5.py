"""HDF5, NetCDF-4: numeric datasets, unpacked and with units as their attributes say, and a rate or a time vector."""

from mrfit.core.specs import ReaderSpec
from mrfit.ingest.containers.arrays import Arrays, tables_of
from mrfit.ingest.containers.hdf import hdf_arrays
from mrfit.ingest.table import Source, Table
from mrfit.ingest.text.head import Head

SPEC = ReaderSpec("hdf5", "HDF5 (needs h5py)", fragile=True, libraries=("h5py",))


def sniff(head: Head) -> bool:
    """Whether the file begins with HDF5's signature."""
    return head.raw.startswith(b"\x89HDF\r\n\x1a\n")


def read(source: Source) -> list[Table]:
    """Return the datasets as tables.

    Raises
    ------
    Refusal
        If h5py is missing, the file is damaged, or it holds no vectors.
    """
    return tables_of(hdf_arrays(source, Arrays(room=source.room(), shelf=source.shelf)), source)
