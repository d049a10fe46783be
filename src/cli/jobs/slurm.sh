#!/usr/bin/env bash
{head}
set -euo pipefail
mkdir -p {folder}
jobs=
# An array has no more than {array} jobs unless Slurm is told otherwise.
for ((first = 0; first < {shards}; first += {array})); do
    last=$(({shards} - first < {array} ? {shards} - first : {array}))
    job=$(
        sbatch --parsable --job-name=terrane-shards --array=1-$last --requeue --open-mode=append --cpus-per-task={threads} \
            --mem={memory_mib}M --time={minutes} --output={folder}/slurm-%A_%a.txt --export=ALL,TERRANE_FIRST=$first <<'SHARD'
#!/bin/sh
number=$((TERRANE_FIRST + SLURM_ARRAY_TASK_ID))
{shard} && exit
code=$?
# The obstacle may be gone next time: a broken node, or a process that was thought to be gone and still writes here.
if [ "${SLURM_RESTART_COUNT:-0}" -lt {retries} ]; then
    scontrol requeue "$SLURM_JOB_ID"
fi
exit $code
SHARD
    )
    jobs=$jobs:${job%%;*}
done
sbatch --parsable --job-name=terrane-merge --dependency=afterok$jobs --kill-on-invalid-dep=yes --requeue --open-mode=append \
    --cpus-per-task={threads} --mem={merge_memory_mib}M --output={folder}/slurm-%j.txt <<'MERGE'
#!/bin/sh
exec {merge}
MERGE
