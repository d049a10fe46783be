#!/usr/bin/env bash
# A bake in shards by Slurm on this machine: the job that `terrane shard-plan` prints, on four nodes that are daemons here. A task is
# killed in the middle, a node is drained, another one fails, and in the end every byte is that of a bake by one process.
#
#     tests/slurm.sh TERRANE FOLDER [SHARDS [BAKE...]]
#
# As root, with Debian's slurm-wlm and munge. Needs a folder that may be removed; leaves times and files in it.
set -euo pipefail

terrane=$(realpath "$1")
folder=$2
shards=${3:-8}
bake=("${@:4}")
[ ${#bake[@]} -gt 0 ] || bake=(thesis --tile-cells 64 --size 48x48 --export height,height-tiles,blend,vector,hashes)
export PATH=$(dirname "$terrane"):$PATH

rm -rf "$folder"
mkdir -p "$folder"
cd "$folder"
export SLURM_CONF=$PWD/slurm.conf
host=$(hostname -s)
cores=$(nproc)
memory=$(awk '/MemTotal/ { print int($2 / 1024) }' /proc/meminfo)
# The nodes' daemons, and those that all ask.
daemons=()
stop() {
    status=$?
    kill "${daemons[@]}" 2>/dev/null || true
    # What a daemon has begun goes with it; the others say what was in the way.
    wait || true
    [ $status -eq 0 ] || tail -n 30 ./*.log whole.shards/slurm-* merged.shards/slurm-* 2>/dev/null || true
}
trap stop EXIT

cat >slurm.conf <<CONF
ClusterName=terrane
SlurmctldHost=$host(127.0.0.1)
SlurmctldPort=16817
SlurmUser=root
AuthType=auth/munge
AuthInfo=socket=$PWD/munge.socket,cred_expire=5
CryptoType=crypto/munge
StateSaveLocation=$PWD/state
SlurmdSpoolDir=$PWD/spool-%n
SlurmctldPidFile=$PWD/slurmctld.pid
SlurmdPidFile=$PWD/slurmd-%n.pid
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU
SchedulerParameters=sched_interval=2,batch_sched_delay=1
ReturnToService=2
SlurmdTimeout=10
JobRequeue=1
MpiDefault=none
CONF
for node in 1 2 3 4; do
    # Each node has all cores of the machine, of which they are told to be as many as a task asks for.
    echo "NodeName=n$node NodeHostname=$host NodeAddr=127.0.0.1 Port=1700$node CPUs=$cores RealMemory=$memory"
done >>slurm.conf
echo "PartitionName=all Nodes=n[1-4] Default=YES State=UP MaxTime=INFINITE" >>slurm.conf

mkdir state
dd if=/dev/urandom of=munge.key bs=1 count=1024 status=none
chmod 400 munge.key
chmod 755 .
munged --key-file="$PWD/munge.key" --socket="$PWD/munge.socket" --pid-file="$PWD/munge.pid" --seed-file="$PWD/munge.seed" \
    --force --foreground >munge.log 2>&1 &
daemons+=($!)
slurmctld -D -c >slurmctld.log 2>&1 &
daemons+=($!)
nodes=()
for node in 1 2 3 4; do
    slurmd -D -N "n$node" >"slurmd-$node.log" 2>&1 &
    daemons+=($!)
    nodes+=($!)
done
for ((try = 0; try < 60; try++)); do
    [ "$(sinfo --noheader --Node --states=idle --format=%N 2>/dev/null | wc -l)" -eq 4 ] && break
    sleep 1
done
sinfo

terrane --version
start=$(date +%s.%N)
terrane bake "${bake[@]}" --quiet --out whole
end=$(date +%s.%N)
echo "one process: $(awk -v a="$start" -v b="$end" 'BEGIN { printf "%.1f", b - a }') s"

terrane shard-plan "${bake[@]}" --engine slurm --shards "$shards" --threads 1 --out merged >job.sh
start=$(date +%s.%N)
bash job.sh >jobs.txt
merge=$(tail -n 1 jobs.txt)

# What may happen, as soon as shards are being made.
killed= drained= failed=
state() {
    # Of a job that is long done Slurm knows nothing any more.
    scontrol show job "$1" 2>/dev/null | sed -n 's/.*JobState=\([A-Z]*\).*/\1/p' | head -n 1
}
# The process that bakes with some options in this folder, and those that a node has begun here.
baking() {
    for process in $(pgrep -x terrane || true); do
        # One that has ended meanwhile is nowhere.
        [ "$(readlink "/proc/$process/cwd")" = "$PWD" ] || continue
        ! tr '\0' ' ' <"/proc/$process/cmdline" | grep -q -- "$1" || echo "$process"
    done
}
begun_by() {
    for process in /proc/[0-9]*; do
        [ "$(readlink "$process/cwd")" = "$PWD" ] && grep -qzx "SLURMD_NODENAME=$1" "$process/environ" || continue
        parent=$(awk '/^PPid:/ { print $2 }' "$process/status")
        # Those that would tell how it ended come first: of a node that fails nobody does.
        [ "$(cat "/proc/$parent/comm")" != slurmstepd ] || echo "0 $parent"
        echo "1 ${process#/proc/}"
    done 2>/dev/null | sort -u | cut -d ' ' -f 2
}
while :; do
    case $(state "$merge") in
        COMPLETED) break ;;
        FAILED | CANCELLED | TIMEOUT | OUT_OF_MEMORY | '') squeue; echo "the merge has not come to its end" >&2; exit 1 ;;
    esac
    if [ -z "$killed" ]; then
        # One that has made tiles, and not all of them.
        victim=$(baking "--shard 2/$shards ")
        if [ -n "$victim" ] && [ -e "merged.shards/2of$shards/.terrane-bake/registry.sqlite" ]; then
            kill -KILL "$victim" && killed=$victim && echo "killed the process of shard 2"
            scontrol update nodename=n3 state=drain reason=test && drained=n3 && echo "drained n3"
        fi
    elif [ -z "$failed" ]; then
        # A node whose daemon is gone, with all that it ran: Slurm puts that elsewhere.
        running=$(squeue --noheader --nodelist=n4 --states=running --format=%i | head -n 1)
        if [ -n "$running" ]; then
            kill -KILL "${nodes[3]}"
            # In that order; some may have ended.
            for process in $(begun_by n4); do kill -KILL "$process" 2>/dev/null || true; done
            scontrol update nodename=n4 state=down reason=test && failed=n4 && echo "n4 failed, with $running"
        fi
    fi
    sleep 0.2
done
end=$(date +%s.%N)
echo "Slurm, $shards shards: $(awk -v a="$start" -v b="$end" 'BEGIN { printf "%.1f", b - a }') s"
[ -n "$killed" ] || { echo "no task was killed" >&2; exit 1; }
[ "$(grep -c '"begun"' "merged.shards/2of$shards/runs.jsonl")" -gt 1 ] || { echo "shard 2 has not gone on" >&2; exit 1; }
[ -n "$drained" ] || { echo "no node was drained" >&2; exit 1; }
diff --recursive --brief --exclude runs.jsonl whole merged
terrane verify merged --files
echo "the same bytes"
