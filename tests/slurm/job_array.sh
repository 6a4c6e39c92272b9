#!/usr/bin/env bash
# Runs the Slurm script of a batch on a real Slurm of one machine, whose daemons this script starts without systemd:
#
#   job_array.sh PROGRAM_FOLDER WORK_FOLDER
#
# Needs root, and the Debian packages slurmctld, slurmd, slurm-client and munge; exit code 77 without them. A task is
# killed in the middle and requeued; the models must be those of one run of pbm-build --batch.
set -euo pipefail
programs=$1 work=$2
if [ "$(id -u)" -ne 0 ] || ! command -v slurmctld slurmd munged sbatch >/dev/null; then
    echo "skipped: needs root, slurmctld, slurmd, slurm-client and munge" >&2
    exit 77
fi
rm -rf "$work"
mkdir -p "$work"/{state,spool,munge,scans}
cd "$work"
pids=()
stop() {
    scancel --state=PENDING,RUNNING --user=root >/dev/null 2>&1 || true
    for pid in "${pids[@]}"; do kill "$pid" 2>/dev/null || true; done
    wait 2>/dev/null || true
}
trap stop EXIT

# A key and a socket of our own: the machine's are left alone.
head -c 128 /dev/urandom >munge/key
chmod 700 munge && chmod 600 munge/key
munged --foreground --force --key-file="$work/munge/key" --socket="$work/munge/socket" --pid-file="$work/munge/pid" \
    --log-file="$work/munge/log" --seed-file="$work/munge/seed" >/dev/null 2>&1 &
pids+=($!)
host=$(hostname -s) cores=$(nproc) memory=$(($(sed -n 's/^MemTotal: *\([0-9]*\).*/\1/p' /proc/meminfo) / 1024 - 256))
cat >slurm.conf <<END
ClusterName=pbm
SlurmctldHost=$host(127.0.0.1)
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$work/munge/socket
CredType=cred/munge
SelectType=select/cons_tres
SelectTypeParameters=CR_Core_Memory
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
AccountingStorageType=accounting_storage/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
ReturnToService=2
SlurmctldPort=17817
SlurmdPort=17818
StateSaveLocation=$work/state
SlurmdSpoolDir=$work/spool
SlurmctldPidFile=$work/slurmctld.pid
SlurmdPidFile=$work/slurmd.pid
SlurmctldLogFile=$work/slurmctld.log
SlurmdLogFile=$work/slurmd.log
NodeName=$host NodeAddr=127.0.0.1 CPUs=$cores RealMemory=$memory State=UNKNOWN
PartitionName=all Nodes=$host Default=YES MaxTime=INFINITE State=UP OverSubscribe=YES
END
export SLURM_CONF=$work/slurm.conf
slurmctld -D >/dev/null 2>&1 &
pids+=($!)
slurmd -D -N "$host" >/dev/null 2>&1 &
pids+=($!)
# wait_for SECONDS COMMAND...
wait_for() {
    local left=$1
    shift
    until "$@"; do
        [ $((left--)) -gt 0 ] || { echo "waited too long for: $*" >&2; tail -5 slurmctld.log slurmd.log >&2; return 1; }
        sleep 1
    done
}
idle() { sinfo -h -o %T 2>/dev/null | grep -qE 'idle|mix|alloc'; }
wait_for 60 idle

for i in 1 2 3 4 5 6 7; do
    "$programs/pbm-sample" --quiet --vertices 500000 --seed $i -o "scans/s$i.ply"
done
echo ply >scans/bad.ply
code=0
"$programs/pbm-build" --batch scans --output-dir alone --keep-going --depth 11 --if-changed -q 2>/dev/null || code=$?
[ $code -eq 3 ]
"$programs/pbm-build" --batch scans --output-dir out --depth 11 --plan batch.slurm
grep -q '#SBATCH --array=0-7' batch.slurm

job=$(sbatch --parsable --array=0-3 <(sed 's:/8":/4":' batch.slurm))
running() { squeue -h -j "${job}_2" -t RUNNING 2>/dev/null | grep -q .; }
wait_for 120 running
scontrol requeue "${job}_2" # kills the task
echo "task 2 was killed and requeued; Slurm waits two minutes before it starts it again"
ended() { ! squeue -h -j "$job" 2>/dev/null | grep -q .; }
wait_for 300 ended

rm -f out/slurm-*.log out/shard-*.jsonl out/batch.slurm
diff -r alone out
! find out -name '*.pbm-*' | grep . || { echo "a part is left" >&2; exit 1; }

# The same plan through Ninja.
"$programs/pbm-build" --batch scans --output-dir made --depth 11 --plan batch.ninja
ninja -k 0 -f batch.ninja >/dev/null 2>&1 || true
diff -r alone made
echo "the models of Slurm and of Ninja are those of one batch"
