"""A chart across the processes of an mpirun or srun: each of them runs the script, takes runs that no other one has taken,
and waits for what the others find. They share the folder of the chart. Standard library only.

In NAME.ranks/LAUNCH beside the chart, a file named like a run says that it is taken, and each rank has a table of its
runs. What a killed launch left there is used by the next one.
"""

import csv
import os
import shutil
import time

LAUNCHERS = (  # rank, number of ranks, and what distinguishes this launch from others
    ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", ("PMIX_NAMESPACE", "OMPI_MCA_ess_base_jobid")),
    ("SLURM_PROCID", "SLURM_STEP_NUM_TASKS", ("SLURM_JOB_ID", "SLURM_STEP_ID")),
    ("PMI_RANK", "PMI_SIZE", ("PMI_JOBID", "HYDI_CONTROL_FD")),
)
POLL = 0.1  # seconds between looks at the tables of the others


def ranks_of(environment, table, read):
    """The Ranks of this process for the chart with this table; None if it runs by itself. `read(path)` gives the runs of
    a table by key."""
    for rank, count, names in LAUNCHERS:
        if rank in environment and int(environment.get(count, "1")) > 1:
            launch = "-".join(environment[name] for name in names if name in environment) or "launch"
            folder = table.with_suffix(".ranks")
            name = "".join(c if c.isalnum() else "_" for c in launch)
            return Ranks(int(environment[rank]), int(environment[count]), folder, folder / name, read)
    return None


class Ranks:
    def __init__(self, rank, count, root, folder, read):
        self.rank, self.count, self.root, self.folder, self.read = rank, count, root, folder, read
        self.next_look = 0.0
        folder.mkdir(parents=True, exist_ok=True)

    @property
    def table(self):
        """Of this rank's own runs."""
        return self.folder / f"rank_{self.rank}.csv"

    def found_before(self):
        """Runs of launches that were killed."""
        return self._runs(path for path in self.root.glob("*/rank_*.csv") if path.parent != self.folder)

    def found(self):
        """Runs of the other ranks by now."""
        if time.monotonic() < self.next_look:
            return {}
        self.next_look = time.monotonic() + POLL
        return self._runs(path for path in self.folder.glob("rank_*.csv") if path != self.table)

    def _runs(self, paths):
        runs = {}
        for path in paths:
            try:
                runs |= self.read(path)
            except (OSError, ValueError, csv.Error):  # gone by now
                pass
        return runs

    def take(self, job):
        """Whether this rank is to run the job: the first one that asks is."""
        try:
            os.close(os.open(self.folder / job.key, os.O_CREAT | os.O_EXCL | os.O_WRONLY))
        except FileExistsError:
            return False
        return True

    def leave(self):
        """When all is known. Rank 0 waits for the others and removes the folder."""
        if self.rank > 0:
            (self.folder / f"left_{self.rank}").touch()
            return
        while len(list(self.folder.glob("left_*"))) < self.count - 1:
            time.sleep(POLL)
        shutil.rmtree(self.root, ignore_errors=True)
