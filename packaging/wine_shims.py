"""Add what Wine's C runtime lacks for numpy, scipy, numba and Rust extensions, and let the libraries use it.

    python packaging/wine_shims.py SITE_PACKAGES SYSTEM32     # needs pefile, and gcc of mingw-w64 on the PATH

Wine 8 and 10 have C99's complex functions as stubs that end the program (`ucrtbase.dll.crealf`), and Wine 8 has no
`bcryptprimitives.dll`. Windows needs none of this. The libraries stay as published except for the name of one imported
DLL (api-ms-win-crt-math-l1-1-0.dll becomes lsx-ms-win-crt-math-l1-1-0.dll), which forwards all other functions.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

import pefile

OLD, NEW = (f"{start}-ms-win-crt-math-l1-1-0.dll" for start in ("api", "lsx"))
PARTS = {"creal": "z.r", "cimag": "z.i", "cabs": "hypot(z.r, z.i)", "carg": "atan2(z.i, z.r)"}
INVERSES = "acos acosh asin asinh atan atanh"
UNARY = [f"c{name}" for name in f"{INVERSES} cos cosh exp log sin sinh sqrt tan tanh".split(" ")]
HEAD = """
#include <complex.h>
#include <math.h>
typedef struct {float r, i;} F;
typedef struct {double r, i;} D;
static inline double _Complex in(D z) {double _Complex w; __real__ w = z.r; __imag__ w = z.i; return w;}
static inline D out(double _Complex w) {D z = {__real__ w, __imag__ w}; return z;}
static inline D wide(F z) {D w = {z.r, z.i}; return w;}
static inline F narrow(D z) {F w = {z.r, z.i}; return w;}
F shim__FCbuild(float r, float i) {F z = {r, i}; return z;}
D shim__Cbuild(double r, double i) {D z = {r, i}; return z;}
"""
PRNG = """
#include <windows.h>
BOOLEAN NTAPI SystemFunction036(PVOID, ULONG);
__declspec(dllexport) BOOL WINAPI ProcessPrng(PBYTE data, SIZE_T size) {
    while (size) {
        ULONG n = size > 0x10000 ? 0x10000 : (ULONG)size;
        if (!SystemFunction036(data, n)) return FALSE;
        data += n; size -= n;
    }
    return TRUE;
}
"""


def complex_functions() -> tuple[str, set[str]]:
    """Return the C source and the names that it defines; for Microsoft's compiler long double is double."""
    lines, names = [HEAD], {"_FCbuild", "_Cbuild"}
    for name, value in PARTS.items():
        for end, kind, number in (("", "D", "double"), ("l", "D", "double"), ("f", "F", "float")):
            lines.append(f"{number} shim_{name}{end}({kind} z) {{return {value};}}")
            names.add(name + end)
    for name in UNARY:
        lines += [f"D shim_{name}{end}(D z) {{return out({name}(in(z)));}}" for end in ("", "l")]
        lines.append(f"F shim_{name}f(F z) {{return narrow(out({name}(in(wide(z)))));}}")
        names |= {name, f"{name}l", f"{name}f"}
    lines += [f"D shim_cpow{end}(D a, D b) {{return out(cpow(in(a), in(b)));}}" for end in ("", "l")]
    lines.append("F shim_cpowf(F a, F b) {return narrow(out(cpow(in(wide(a)), in(wide(b)))));}")
    return "\n".join(lines), names | {"cpow", "cpowl", "cpowf"}


def compile_dll(source: str, to: Path, *options: str) -> None:
    """Compile C to a DLL."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "shim.c")
        file.write_text(source, encoding="ascii", newline="\n")
        command = ["x86_64-w64-mingw32-gcc", "-O2", "-shared", "-static-libgcc", "-o", to, file, *options]
        subprocess.run(command, check=True)


def patch_libraries(packages: Path, defined: set[str]) -> tuple[int, set[str]]:
    """Rename the import in libraries that use a function in ``defined``; return their number, and all that they use."""
    used: set[str] = set()
    patched = 0
    for path in (*packages.rglob("*.pyd"), *packages.rglob("*.dll")):
        content = path.read_bytes()
        if OLD.encode() not in content and NEW.encode() not in content:
            continue
        library = pefile.PE(data=content, fast_load=True)
        library.parse_data_directories([pefile.DIRECTORY_ENTRY["IMAGE_DIRECTORY_ENTRY_IMPORT"]])
        for entry in library.DIRECTORY_ENTRY_IMPORT:
            names = {function.name.decode() for function in entry.imports if function.name}
            if entry.dll.decode().lower() in (OLD, NEW) and names & defined:
                used |= names
                patched += 1
                path.write_bytes(content.replace(OLD.encode(), NEW.encode()))
    return patched, used


def main(packages: Path, system: Path) -> None:
    """Patch the libraries and write both DLLs."""
    source, defined = complex_functions()
    patched, used = patch_libraries(packages, defined)
    table = [f"LIBRARY {NEW}", "EXPORTS"]
    table += [f"  {name} = {f'shim_{name}' if name in defined else f'ucrtbase.{name}'}" for name in sorted(used)]
    with tempfile.TemporaryDirectory() as folder:
        exports = Path(folder, "shim.def")
        exports.write_text("\n".join(table) + "\n", encoding="ascii", newline="\n")
        compile_dll(source, system / NEW, str(exports))
    compile_dll(PRNG, system / "bcryptprimitives.dll", "-ladvapi32")
    print(f"{patched} libraries use {NEW}, which defines {len(used & defined)} of their {len(used)} functions")


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
