#!/bin/sh
# Prints a Python that is new enough: tools/find_python.sh [PYTHON]
#
# The one that is asked for; else the first version on PATH, and of its builds the first that is not
# slower than another by a quarter: one that was built without optimisation takes 1.6 times as long.

question='
import sys, time
if sys.version_info < (3, 11):
    sys.exit(1)
times = []
for _ in range(5):
    begun, kept = time.perf_counter(), {}
    for number in range(100_000):
        kept[number % 100] = (number, str(number))
    times.append(time.perf_counter() - begun)
print("%d.%d" % sys.version_info[:2], min(times), sys.executable)'

builds() {
    IFS=:
    for name in python3 python3.14 python3.13 python3.12 python3.11; do
        for folder in $PATH; do
            if [ -x "$folder/$name" ]; then "$folder/$name" -c "$question" 2>/dev/null; fi
        done
    done
}

quick_enough='
NF < 3 { next }
!count { version = $1 }
$1 == version { took[++count] = $2; best = (count == 1 || $2 < best) ? $2 : best; sub(/^[^ ]* [^ ]* /, ""); path[count] = $0 }
END { for (k = 1; k <= count; k++) if (took[k] <= 1.25 * best) { print path[k]; exit } }'

python=""
[ -n "${1:-}" ] && python=$("$1" -c "$question" 2>/dev/null | cut -d " " -f 3-)
[ -n "$python" ] || python=$(builds | awk "$quick_enough")
if [ -z "$python" ]; then
    echo "no Python 3.11 or newer on PATH: try make PYTHON=/path/to/python3" >&2
    exit 3
fi
echo "$python"
