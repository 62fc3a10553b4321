"""Runs of igaform-mpi by several processes on one machine, however few cores it has."""
import os
import sys

from common import begin, igaform

MPI_PROGRAM, MPIRUN = sys.argv[3:5]

# More processes than cores, which sleep while they wait; in a container, as the user root too.
# Names of Open MPI 4 and 5; other implementations ignore them.
ANYWHERE = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
            "OMPI_MCA_rmaps_base_oversubscribe": "1",
            "PRTE_MCA_rmaps_default_mapping_policy": ":oversubscribe",
            "OMPI_MCA_hwloc_base_binding_policy": "none",
            "PRTE_MCA_hwloc_default_binding_policy": "none",
            "OMPI_MCA_btl_vader_single_copy_mechanism": "none",
            "OMPI_MCA_mpi_yield_when_idle": "1", "OMP_WAIT_POLICY": "passive"}


def settings(processes, within=()):
    return {"program": [MPIRUN, "-n", str(processes), *within, MPI_PROGRAM],
            "env": os.environ | ANYWHERE}


def igaform_mpi(processes, folder, *words, within=(), **options):
    """What a run by so many processes says, and mpirun; `within` another command; see `igaform`."""
    return igaform(folder, *words, **settings(processes, within), **options)


def begin_mpi(processes, folder, *words, **options):
    """A run by so many processes that goes on while we look; see `begin`."""
    return begin(folder, *words, **settings(processes), **options)
