"""Instances of unpacked FMUs by FMPy."""

from contextlib import contextmanager

from fmpy.fmi2 import FMU2Slave


def instance(description, unpacked, kind=FMU2Slave, **keys):
    """Not instantiated yet."""
    keys = {"guid": description.guid, "modelIdentifier": description.coSimulation.modelIdentifier} | keys
    return kind(unzipDirectory=str(unpacked), instanceName="robot", **keys)


@contextmanager
def running(description, unpacked, kind=FMU2Slave, **keys):
    """One that is initialized, from t = 0 on; `keys` of its start, such as `callbacks`."""
    fmu = instance(description, unpacked, kind)
    fmu.instantiate(**keys)
    try:
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        yield fmu
        fmu.terminate()
    finally:
        fmu.freeInstance()
