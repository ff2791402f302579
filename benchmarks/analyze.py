"""How long does a whole analysis of a real log take, and how much memory?

    .venv/bin/python benchmarks/analyze.py [LOG]

Wall and CPU seconds and peak memory of ``fdi analyze`` in a process of its own, with everything
written, first with an empty cache and then again; and the time of ``import fdi``. Our modules are
compiled beforehand, as an installation leaves them. Without an argument the log is the 5.5 MB
flight of the publication, in ../shared beside the repository.
"""

from __future__ import annotations

import compileall
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
LOG = ROOT.parent / "shared" / "flights" / "paper" / "afrika.tlog"
WALL_S, CPU_S, MEMORY_MB, IMPORT_S = 15.0, 4.0, 600.0, 0.3
RUNS = 5


def measure(command: list[str], cache: Path) -> tuple[float, float, float, int]:
    """Return wall s, CPU s, peak memory in MB and the exit code of a command."""
    start = time.perf_counter()
    process = subprocess.Popen(
        command,
        cwd=ROOT,
        env={**os.environ, "FDI_CACHE_DIR": str(cache), "PYTHONDONTWRITEBYTECODE": ""},
        stdout=subprocess.DEVNULL,
    )
    _, status, usage = os.wait4(process.pid, 0)
    wall = time.perf_counter() - start
    process.returncode = os.waitstatus_to_exitcode(status)
    unit = 1e6 if sys.platform == "darwin" else 1e3  # ru_maxrss: bytes there, kilobytes elsewhere
    return wall, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / unit, process.returncode


def time_import() -> float:
    """Return the wall seconds that ``import fdi`` adds to an interpreter, median of several."""
    code = "import time; t = time.perf_counter(); import fdi; print(time.perf_counter() - t)"
    runs = [
        subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, check=True)
        for _ in range(RUNS)
    ]
    return statistics.median(float(run.stdout) for run in runs)


def main() -> int:
    """Print the figures; return 1 where a bound is missed or the analysis fails."""
    log = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else LOG
    compileall.compile_dir(ROOT / "fdi", quiet=1)
    seconds = time_import()
    print(f"import fdi: {seconds:.4f} s (bound {IMPORT_S:g} s)")
    if not log.is_file():
        print(f"skipped: {log} is not here")
        return 0
    passed = [seconds < IMPORT_S]
    with tempfile.TemporaryDirectory() as name:
        for label in ("empty cache", "again"):
            out = Path(name) / label.replace(" ", "_")
            command = [
                sys.executable,
                "-c",
                "import sys; from fdi.cli import main; sys.exit(main())",
                "analyze",
            ]
            command += [str(log), "--out", str(out), "--no-progress"]
            wall, cpu, memory, code = measure(command, Path(name) / "cache")
            written = sum(path.stat().st_size for path in out.rglob("*") if path.is_file())
            print(
                f"fdi analyze {log.name}, {label}: {wall:.1f} s wall (bound {WALL_S:g} s), "
                f"{cpu:.1f} s CPU (bound {CPU_S:g} s), "
                f"{memory:.0f} MB peak (bound {MEMORY_MB:g} MB), "
                f"{written / 1e6:.1f} MB written, exit code {code}"
            )
            passed.append(code in (0, 1) and wall < WALL_S and cpu < CPU_S and memory < MEMORY_MB)
    return 0 if all(passed) else 1


if __name__ == "__main__":
    sys.exit(main())
