"""Give Wine the complex functions of C99, which its C runtime has only as stubs that end the program (seen in Wine 10).

    python packaging/wine_shims.py WINE_LIBRARIES DLL     # needs pefile, and gcc of mingw-w64 on the PATH

Windows needs none of this. Programs import these functions from api-ms-win-crt-math-l1-1-0.dll, which Wine's own table
(apisetschema.dll) resolves to ucrtbase.dll. Afterwards it resolves it to DLL, which must be copied to the folder
system32 of each Wine prefix. DLL defines the complex functions and forwards all others to ucrtbase.dll.
"""

import struct
import subprocess
import sys
import tempfile
from pathlib import Path

import pefile

API_SET = "api-ms-win-crt-math-l1-1"
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


def compile_dll(runtime: Path, dll: Path) -> None:
    """Compile the complex functions to a DLL that forwards the other functions to the C runtime."""
    source, defined = complex_functions()
    exported = {symbol.name.decode() for symbol in pefile.PE(runtime).DIRECTORY_ENTRY_EXPORT.symbols if symbol.name}
    names = sorted(name for name in exported if name.isidentifier())  # the others are of C++
    lines = [f"{name} = {f'shim_{name}' if name in defined else f'{runtime.stem}.{name}'}" for name in names]
    with tempfile.TemporaryDirectory() as folder:
        file, exports = Path(folder, "shim.c"), Path(folder, "shim.def")
        file.write_text(source, encoding="ascii", newline="\n")
        exports.write_text("\n".join((f"LIBRARY {dll.name}", "EXPORTS", *lines)), encoding="ascii", newline="\n")
        command = ["x86_64-w64-mingw32-gcc", "-O2", "-shared", "-static-libgcc", "-o", dll, file, exports]
        subprocess.run(command, check=True)
    print(f"{dll.name} defines {len(exported & defined)} functions and forwards {len(set(names) - defined)}")


def redirect(schema: Path, target: str) -> None:
    """Let the table resolve `API_SET` to ``target``, which is written behind its last text."""
    content = bytearray(schema.read_bytes())
    (section,) = (section for section in pefile.PE(schema).sections if section.Name.startswith(b".apiset"))
    start, text = section.PointerToRawData, target.encode("utf-16-le")
    _version, size, _flags, count, first = struct.unpack_from("<5I", content, start)
    for entry in range(start + first, start + first + 24 * count, 24):
        _flags, name, _length, hashed, values, _count = struct.unpack_from("<6I", content, entry)
        if content[start + name : start + name + hashed].decode("utf-16-le") == API_SET:
            struct.pack_into("<2I", content, start + values + 12, size, len(text))
    content[start + size : start + size + len(text)] = text
    for place in (start + 4, section.get_file_offset() + 8):  # the table's size, and the section's
        struct.pack_into("<I", content, place, size + len(text))
    schema.write_bytes(content)


def main(libraries: Path, dll: Path) -> None:
    """Compile the DLL, and change Wine's table once."""
    compile_dll(libraries / "ucrtbase.dll", dll)
    schema = libraries / "apisetschema.dll"
    if dll.name.encode("utf-16-le") not in schema.read_bytes():
        redirect(schema, dll.name)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
