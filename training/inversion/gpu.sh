#!/bin/bash
# Runs on a machine with a GPU, in the root of the repository, one call for each pack if they cannot travel at once:
#   gpu.sh packs FOLDER ..     keeps the packs of FOLDER and prepares them in the background; further options go to prepare.py
#   gpu.sh train MINUTES ..    waits for that, then trains on all packs; further options go to train.py
# FOLDER/code holds the program `features` and lpips_squeeze_v0.1.safetensors. The folder $KEPT stays from call to call, and $OUT is
# what comes back.
set -euo pipefail
export PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
export here=$(dirname "$(realpath "$0")") kept=${KEPT:-/tmp/kept}
out=${OUT:-/tmp/out}
mkdir -p "$kept" "$out"

# Prepares packs, one after the other: `prepare "NAME NAME" ..`.
prepare() {
    local name names=$1
    shift
    for name in $names; do
        python3 "$here/prepare.py" "$kept/$name" "$kept/$name.tar" --features "$kept/features" "$@" >"$kept/$name.log" 2>&1
        echo $? >"$kept/$name.done"
    done
}
export -f prepare

case ${1:-} in
packs)
    folder=$2
    shift 2
    if [ ! -e "$kept/features" ]; then
        cp "$folder"/code/* "$kept/"
        chmod +x "$kept/features"
    fi
    cp "$folder"/pack-*.tar "$kept/"
    names=$(basename -s .tar "$folder"/pack-*.tar | xargs)
    # A process session of its own outlives the call.
    setsid bash -c 'prepare "$@"' - "$names" "$@" </dev/null >/dev/null 2>&1 &
    ;;
train)
    minutes=$2
    shift 2
    folders=()
    for pack in "$kept"/pack-*.tar; do
        name=$(basename "$pack" .tar)
        until [ -s "$kept/$name.done" ]; do sleep 1; done
        cat "$kept/$name.log"
        if [ "$(cat "$kept/$name.done")" = 0 ]; then
            folders+=("$kept/$name")
        else
            echo "$name could not be prepared and is left out"
        fi
    done
    python3 "$here/train.py" "$out" "${folders[@]}" --lpips "$kept/lpips_squeeze_v0.1.safetensors" --state "$kept/state.pt" \
        --minutes "$minutes" "$@" 2>&1 | tee "$out/log"
    ;;
*)
    echo "expected gpu.sh packs or gpu.sh train, found '${1:-}'" >&2
    exit 2
    ;;
esac
