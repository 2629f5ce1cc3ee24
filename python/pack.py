"""Packs what cargo has built as a wheel: `python pack.py lib_polymech.so FOLDER`.

`maturin build --release` compiles and packs by itself. The tests of this repository build all of it at once, so that nothing is compiled
twice, and pack the module with the metadata that maturin makes of pyproject.toml.
"""

import base64
import hashlib
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main(library: str, output: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "maturin", "pep517", "write-dist-info", "--metadata-directory", folder]
        subprocess.run([*command, "--interpreter", sys.executable], cwd=HERE, check=True, stdout=subprocess.DEVNULL)
        (info,) = Path(folder).iterdir()
        package = HERE / "package"
        files = {f"{path.relative_to(package)}": path for path in sorted(package.rglob("*")) if path.suffix in (".py", ".pyi", ".typed") or path.name == "py.typed"}
        files |= {f"{path.relative_to(folder)}": path for path in sorted(info.rglob("*")) if path.is_file()}
        files["polymech/_polymech.abi3.so"] = Path(library)
        tag = next(line.split(": ")[1] for line in (info / "WHEEL").read_text().splitlines() if line.startswith("Tag: "))
        target = Path(output) / f"{info.name.removesuffix('.dist-info')}-{tag}.whl"
        record = f"{info.name}/RECORD"
        lines = []
        # stored: it is installed at once
        with zipfile.ZipFile(target, "w", zipfile.ZIP_STORED) as wheel:
            for name, path in files.items():
                data = path.read_bytes()
                digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
                lines.append(f"{name},sha256={digest},{len(data)}")
                wheel.writestr(name, data)
            wheel.writestr(record, "\n".join([*lines, f"{record},,"]) + "\n")
        print(target)


if __name__ == "__main__":
    main(*sys.argv[1:])
