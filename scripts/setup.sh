#!/usr/bin/env bash
# Installs the Debian packages of scripts/packages.txt that are missing; says so, or does nothing.
#
#   scripts/setup.sh             what building, testing and running needs
#   scripts/setup.sh NAME...     these packages instead
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)

if ! command -v apt-get >/dev/null || ! command -v dpkg-query >/dev/null; then
    echo "setup: this is not Debian; install what scripts/packages.txt names by hand" >&2
    exit 0
fi

if (($#)); then
    wanted=("$@")
else
    mapfile -t wanted < <(sed -e 's/#.*//' -e 's/[[:space:]]//g' -e '/^$/d' "$here/packages.txt")
fi

# One question for all of them; dpkg-query leaves out those that it does not know.
mapfile -t installed < <(dpkg-query --show --showformat='${db:Status-Status} ${Package}\n' "${wanted[@]}" 2>/dev/null |
    sed -n 's/^installed //p')
missing=()
for package in "${wanted[@]}"; do
    [[ " ${installed[*]} " == *" $package "* ]] || missing+=("$package")
done
((${#missing[@]})) || exit 0

echo "setup: installing with apt-get: ${missing[*]}" >&2
root=()
if ((EUID != 0)); then
    command -v sudo >/dev/null || { echo "setup: neither root nor sudo; as root: apt-get install ${missing[*]}" >&2; exit 1; }
    root=(sudo)
fi
install=("${root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install --yes --quiet --no-install-recommends "${missing[@]}")
# Lists may be missing (a bare system) or old (the mirror has moved on): fetch them and try again.
if ! compgen -G '/var/lib/apt/lists/*_Packages*' >/dev/null || ! "${install[@]}"; then
    "${root[@]}" apt-get update --quiet
    "${install[@]}"
fi
