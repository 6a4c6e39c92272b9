#!/usr/bin/env bash
# Runs the Slurm scripts of a batch and of one model in parts on a real Slurm of one machine, whose daemons this script
# starts without systemd:
#
#   job_array.sh PROGRAM_FOLDER WORK_FOLDER
#
# Needs root, and the Debian packages slurmctld, slurmd, slurm-client and munge; exit code 77 without them. A task of
# each is killed in the middle and requeued; the models must be those of one run of pbm-build. A part that fails must
# leave the old model.
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


# Names that need quoting, and a part of a plan that cannot be written.
one=("scans/s1.ply" "scans/s2.ply" --depth 11 --name "it's one")
"$programs/pbm-build" "${one[@]}" -q -o alone.pbvg
"$programs/pbm-build" "${one[@]}" -o "all in 100%.pbvg" --shards 4 --plan "the parts.slurm"
"$programs/pbm-build" scans/s1.ply --depth 6 -o failed.pbvg --shards 2 --plan failed.slurm
mkdir failed.pbvg.part-1-of-2
echo "the old model" | tee failed.pbvg >"all in 100%.pbvg"

running() { squeue -h -j "$1" -t RUNNING 2>/dev/null | grep -q .; }
ended() { ! squeue -h -j "$1" 2>/dev/null | grep -q .; }
state_of() { scontrol show job "$1" 2>/dev/null | sed -n 's/^ *JobState=\([A-Z]*\).*/\1/p'; }
job=$(sbatch --parsable --array=0-3 <(sed 's:^tasks=8:tasks=4:' batch.slurm))
wait_for 120 running "${job}_2"
scontrol requeue "${job}_2" # kills the task
merge=$(sh "the parts.slurm" --comment="what sbatch is told")
parts=$(squeue -h -j "$merge" -o %E | sed 's/^afterok:\([0-9]*\).*/\1/')
wait_for 300 running "${parts}_1"
scontrol requeue "${parts}_1"
echo "a task of each was killed and requeued; Slurm waits two minutes before it starts it again"
failed_merge=$(sh failed.slurm)
wait_for 300 ended "$job"
wait_for 300 ended "$merge"
wait_for 300 ended "$failed_merge"

[ "$(state_of "$merge")" = COMPLETED ]
cmp alone.pbvg "all in 100%.pbvg"
for log in 0 1 2 3 merge; do [ -e "all in 100%.pbvg.slurm-$log.log" ]; done
[ "$(state_of "$failed_merge")" = CANCELLED ]
[ "$(cat failed.pbvg)" = "the old model" ]
[ -e failed.pbvg.part-0-of-2 ]
[ ! -e failed.pbvg.slurm-merge.log ]
grep -q failed.pbvg.part-1-of-2 failed.pbvg.slurm-1.log

rm -f out/slurm-*.log out/shard-*.jsonl out/batch.slurm
diff -r alone out
! find . -name '*.pbm-*' | grep . || { echo "an unfinished file is left" >&2; exit 1; }

# The same plan through Ninja.
"$programs/pbm-build" --batch scans --output-dir made --depth 11 --plan batch.ninja
ninja -k 0 -f batch.ninja >/dev/null 2>&1 || true
diff -r alone made
echo "the models of Slurm and of Ninja are those of one run"
