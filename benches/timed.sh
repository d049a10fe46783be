# Prints a line of a table: the least of three times of a command in seconds, since other work only adds to them. Adds it to
# $sum. What the command says goes to a file in $work.
sum=0
timed() {
    local name=$1 best=
    shift
    for _ in 1 2 3; do
        local start end
        start=$(date +%s.%N)
        "$@" >"$work/log.txt" 2>&1 || { cat "$work/log.txt" >&2; return 1; }
        end=$(date +%s.%N)
        best=$(awk -v a="$start" -v b="$end" -v best="$best" 'BEGIN { t = b - a; print best == "" || t < best ? t : best }')
    done
    sum=$(awk -v a="$sum" -v b="$best" 'BEGIN { print a + b }')
    printf '| %s | %.2f s |\n' "$name" "$best"
}
