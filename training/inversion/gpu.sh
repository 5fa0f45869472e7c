#!/bin/bash
# Runs on a machine with a GPU, from the root of the repository, in as many calls as it takes to carry the packs:
#   gpu.sh packs FOLDER        keep the packs in FOLDER, and extract their keypoints in the background
#   gpu.sh train MINUTES ..    wait for the keypoints, then train; further options go to train.py
# FOLDER/code has the program `sift` and lpips_squeeze_v0.1.safetensors. KEPT outlives a call, OUT is what comes back.
set -eu
export PYTHONUNBUFFERED=1 PYTHONDONTWRITEBYTECODE=1
here=$(dirname "$(realpath "$0")") kept=${KEPT:-/tmp/kept} out=${OUT:-/tmp/out}
mkdir -p "$kept" "$out"

case $1 in
packs)
    cp -n "$2"/code/* "$kept/"
    chmod +x "$kept/sift"
    for pack in "$2"/pack-*.tar; do
        name=$(basename "$pack" .tar)
        cp "$pack" "$kept/"
        echo "$name" >>"$kept/names"
    done
    # A process session of its own outlives the call.
    setsid bash -c "for name in $(cd "$2" && echo pack-*.tar | sed 's/\.tar//g'); do
        python3 '$here/prepare.py' '$kept/'\$name '$kept/'\$name.tar --sift '$kept/sift' ${SIZES:+--sizes $SIZES} >'$kept/'\$name.log 2>&1; touch '$kept/'\$name.done; done" </dev/null >/dev/null 2>&1 &
    ;;
train)
    folders=()
    for name in $(sort -u "$kept/names"); do
        while [ ! -e "$kept/$name.done" ]; do sleep 1; done
        cat "$kept/$name.log"
        folders+=("$kept/$name")
    done
    minutes=$2
    shift 2
    python3 "$here/train.py" "$out" "${folders[@]}" --lpips "$kept/lpips_squeeze_v0.1.safetensors" --state "$kept/state.pt" --minutes "$minutes" "$@" 2>&1 | tee "$out/log"
    ;;
esac
