"""Jobs of one command: done by processes of this machine, those of mpirun, or the workers of a dask scheduler."""
