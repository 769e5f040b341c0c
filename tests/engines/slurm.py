"""Slurm on this machine alone, with all of its files in one folder: controller, one node with the machine's cores, and munge."""

from __future__ import annotations

import os
import secrets
import socket
import subprocess
import time
from pathlib import Path

CONF = """
ClusterName=one
SlurmctldHost={host}(127.0.0.1)
SlurmctldPort={port}
SlurmdPort={node_port}
SlurmUser=root
AuthType=auth/munge
# A task that is requeued waits until its credential expires, after 120 s unless this says otherwise.
AuthInfo=socket={folder}/munge.socket,cred_expire=5
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/slurmd.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
MpiDefault=none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=batch_sched_delay=0,sched_interval=1,sched_min_interval=0
ReturnToService=2
MinJobAge=3600
KillWait=1
NodeName={host} NodeAddr=127.0.0.1 CPUs={cores} RealMemory=4000 State=UNKNOWN
PartitionName=main Nodes=ALL Default=YES MaxTime=60 DefMemPerCPU=500 State=UP
"""


SYSTEM_CONF = Path("/etc/slurm/slurm.conf")


class Slurm:
    """Starts on entry, stops on exit what it started; `env` is what its commands need."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.env = {**os.environ, "SLURM_CONF": str(folder / "slurm.conf")}
        self.daemons: list[subprocess.Popen[bytes]] = []

    def __enter__(self) -> Slurm:
        folder, host = self.folder, socket.gethostname().split(".")[0]
        for name in ("state", "spool"):
            (folder / name).mkdir(parents=True)
        folder.chmod(0o755)
        key = folder / "munge.key"
        key.write_bytes(secrets.token_bytes(128))
        key.chmod(0o400)
        ports = [free_port() for _ in range(2)]
        text = CONF.format(folder=folder, host=host, port=ports[0], node_port=ports[1], cores=os.cpu_count())
        (folder / "slurm.conf").write_text(text)
        # What takes SLURM_CONF out of the environment of jobs, as Snakemake does, finds it here.
        SYSTEM_CONF.parent.mkdir(exist_ok=True)
        if SYSTEM_CONF.is_symlink():
            SYSTEM_CONF.unlink()  # of a run that was killed; an installation has a file here
        SYSTEM_CONF.symlink_to(folder / "slurm.conf")
        munge = [f"--{name}={folder}/munge.{end}" for name, end in
                 [("key-file", "key"), ("socket", "socket"), ("pid-file", "pid"), ("seed-file", "seed"), ("log-file", "log")]]
        self.start("munged", "--foreground", "--force", *munge)
        self.wait(lambda: (folder / "munge.socket").exists(), "munge")
        self.start("slurmctld", "-D", "-c")
        self.start("slurmd", "-D")
        self.wait(lambda: b"idle" in self.output("sinfo", "--noheader", "--format=%T"), "a node")
        return self

    def __exit__(self, *_: object) -> None:
        SYSTEM_CONF.unlink()
        for daemon in reversed(self.daemons):
            daemon.terminate()
        for daemon in self.daemons:
            daemon.wait(timeout=20)

    def start(self, name: str, *words: str) -> None:
        command = [f"/usr/sbin/{name}", *words]
        log = (self.folder / f"{name}.out").open("wb")
        self.daemons.append(subprocess.Popen(command, env=self.env, stdout=log, stderr=log, stdin=subprocess.DEVNULL))

    def output(self, *words: str) -> bytes:
        return subprocess.run(words, env=self.env, capture_output=True).stdout

    def wait(self, come: object, what: str, seconds: float = 30.0) -> None:
        end = time.monotonic() + seconds
        while not come():  # type: ignore[operator]
            if time.monotonic() > end:
                logs = "\n".join(p.read_text(errors="replace")[-2000:] for p in self.folder.glob("*.log"))
                raise TimeoutError(f"{what} did not come\n{logs}")
            time.sleep(0.05)

    def wait_for_jobs(self, seconds: float = 60.0) -> None:
        """Until no job is waiting or running."""
        states = "--states=PENDING,RUNNING,COMPLETING"
        self.wait(lambda: not self.output("squeue", "--noheader", states), "the end of all jobs", seconds)


def free_port() -> int:
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return int(s.getsockname()[1])
