#!/bin/bash
# Runs on a machine with a GPU, in the root of the repository, one call for each pack if they cannot travel at once:
#   gpu.sh packs FOLDER ..     keeps the packs of FOLDER and makes crops of them in the background; further options go to training_crops
#   gpu.sh train MINUTES ..    waits for that, then trains on all packs; further options go to train.py
# FOLDER has packs of training/inversion/pack.py, and in FOLDER/code the program `training_crops`. The folder $KEPT stays from call to
# call, and $OUT is what comes back.
set -euo pipefail
export PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
here=$(dirname "$(realpath "$0")")
export kept=${KEPT:-/tmp/kept}
out=${OUT:-/tmp/out}
mkdir -p "$kept" "$out"

# Makes crops of packs, one after the other: `crops "NAME NAME" ..`.
crops() {
    local name names=$1
    shift
    for name in $names; do
        mkdir -p "$kept/$name/photos"
        tar -xf "$kept/$name.tar" -C "$kept/$name/photos"
        find "$kept/$name/photos/train" -type f | sort >"$kept/$name/train.txt"
        "$kept/training_crops" "$kept/$name/crops" "$kept/$name/train.txt" "$@" >"$kept/$name.log" 2>&1
        echo $? >"$kept/$name.done"
    done
}
export -f crops

case ${1:-} in
packs)
    folder=$2
    shift 2
    if [ ! -e "$kept/training_crops" ]; then
        cp "$folder/code/training_crops" "$kept/"
        chmod +x "$kept/training_crops"
    fi
    cp "$folder"/pack-*.tar "$kept/"
    names=$(basename -s .tar "$folder"/pack-*.tar | xargs)
    # A process session of its own outlives the call.
    setsid bash -c 'crops "$@"' - "$names" "$@" </dev/null >/dev/null 2>&1 &
    ;;
train)
    minutes=$2
    shift 2
    for pack in "$kept"/pack-*.tar; do
        until [ -s "${pack%.tar}.done" ]; do sleep 1; done
        cat "${pack%.tar}.log"
    done
    find "$kept"/pack-*/photos/val -type f | sort | head -8 >"$kept/val.txt"
    [ -e "$kept/whole" ] || "$kept/training_crops" "$kept/whole" "$kept/val.txt" --whole 1500
    python3 "$here/train.py" "$out" "$kept"/pack-*/crops --device cuda --half --validate "$kept/whole" --minutes "$minutes" "$@" 2>&1 | tee "$out/log"
    ;;
*)
    echo "expected gpu.sh packs or gpu.sh train, found '${1:-}'" >&2
    exit 2
    ;;
esac
