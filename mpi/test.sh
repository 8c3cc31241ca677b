#!/usr/bin/env bash
# Builds twinray-mpi, and checks that ranks give the same bits as one process. With words, runs `check` with them:
#
#     mpi/test.sh                            # 2, 3 and 4 ranks
#     RANKS="4 8" mpi/test.sh 4000000 hall:78000
#
# Installs what is missing where it may (Debian, root), and says what is missing where it may not.
set -euo pipefail
# A relative target folder is meant from where this was called.
[ -z "${CARGO_TARGET_DIR:-}" ] || export CARGO_TARGET_DIR="$(realpath -m "$CARGO_TARGET_DIR")"
cd "$(dirname "${BASH_SOURCE[0]}")"

missing=()
command -v mpicc >/dev/null || missing+=(libopenmpi-dev)
command -v mpirun >/dev/null || missing+=(openmpi-bin)
# What bindgen looks for, in the places where Debian and others put it.
libclang=$(find "${LIBCLANG_PATH:-/usr/lib}" /usr/lib64 /usr/local/lib -name 'libclang.so*' -o -name 'libclang-[0-9]*.so*' 2>/dev/null || true)
[ -n "$libclang" ] || missing+=(libclang-dev)
if [ ${#missing[@]} -gt 0 ]; then
    if [ "$(id -u)" != 0 ] || ! command -v apt-get >/dev/null; then
        echo "mpi/test.sh: an MPI and libclang are needed; as root: apt-get install ${missing[*]}" >&2
        exit 2
    fi
    apt-get update -qq
    DEBIAN_FRONTEND=noninteractive apt-get install -qq --no-install-recommends "${missing[@]}" >/dev/null
fi

cargo build --quiet --release
# Ranks share this machine: none may be bound to a core, and whoever waits must let the others work.
export OMPI_MCA_rmaps_base_oversubscribe=1 OMPI_MCA_mpi_yield_when_idle=1 OMPI_MCA_hwloc_base_binding_policy=none
# Shared memory without the calls that containers forbid.
export OMPI_MCA_btl_vader_single_copy_mechanism=none
export RAYON_NUM_THREADS="${RAYON_NUM_THREADS:-1}"
as_root=()
[ "$(id -u)" != 0 ] || as_root=(--allow-run-as-root)
bin=$(realpath "${CARGO_TARGET_DIR:-target}")/release
for ranks in ${RANKS:-2 3 4}; do
    mpirun "${as_root[@]}" -n "$ranks" --oversubscribe "$bin/check" "$@"
done

# The command: whole, stopped and gone on with by another number of ranks, the same bytes as those of one process.
[ $# -eq 0 ] || exit 0
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
shared() { mpirun "${as_root[@]}" -n "$1" --oversubscribe "$bin/twinray" solve "${@:2}" --quiet; }
for scene in cornell hall; do
    "$bin/twinray" solve $scene --patches 9000 --rays 2M -o one.twin --quiet
    shared 4 $scene --patches 9000 --rays 2M -o four.twin
    shared 2 $scene --patches 9000 --rays 1M -o broken.twin
    shared 3 broken.twin --rays 2M --checkpoint 0.01s
    cmp one.twin four.twin
    cmp one.twin broken.twin
    echo "twinray solve $scene: 1, 4 and 2, then 3 ranks wrote the same $(stat -c %s one.twin) bytes"
done
# What one rank refuses ends all of them, with its code.
status=0
shared 2 $folder/nowhere.glb 2>refused.txt || status=$?
grep -q "nowhere.glb: no such file" refused.txt
[ "$status" = 2 ] || { echo "exit code $status; expected 2" >&2; exit 1; }
