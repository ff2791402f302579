"""Prints what the comparison of every log found; returns 1 where a difference is unexplained."""

from __future__ import annotations

import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Final

from fdi.errors import LogError
from fdi.telemetry import read

from .comparison import REASONS, Comparison
from .dataflash import compare_dataflash
from .dataflash_text import compare_dataflash_text
from .telemetry import compare_telemetry
from .ulog import compare_ulog

SHARED: Final = Path(__file__).resolve().parents[3].parent / "shared"
FOLDERS: Final = SHARED / "flights", SHARED / "telemetry" / "samples"
LOGS: Final = {".tlog", ".bin", ".log", ".ulg", ".px4log"}
COMPARE: Final[dict[str, Callable[[Path], Comparison]]] = {
    "tlog": compare_telemetry,
    "dataflash": compare_dataflash,
    "dataflash_text": compare_dataflash_text,
    "ulog": compare_ulog,
}
NOT_ASKED: Final = "sdlog2"  # PX4's format before ULog is refused by name


def compare(path: Path) -> Comparison:
    """Return what the comparison of one file found."""
    try:
        kind = read(path).format
    except LogError as error:
        refused = Comparison(path.name, "refused")
        refused.demand(NOT_ASKED in str(error), str(error))
        return refused
    return COMPARE[kind](path)


def logs(names: list[str]) -> Iterator[Path]:
    """Yield the logs among files and folders, those of the shared folder where none is named."""
    for name in map(Path, names) if names else FOLDERS:
        if name.is_file():
            yield name
        yield from sorted(p for p in name.rglob("*") if p.suffix.lower() in LOGS)


def main() -> int:
    """Compare the files that the command line names."""
    started = time.process_time()
    found = [compare(path) for path in logs(sys.argv[1:])]
    if not found:
        print("skipped: no logs here")
        return 0
    print(f"{'format':16}{'files':>7}{'records':>10}{'fields':>9}{'values':>12}{'unexplained':>13}")
    for kind in sorted({one.kind for one in found}):
        these = [one for one in found if one.kind == kind]
        records, fields, values, bad = (
            sum(column)
            for column in zip(
                *((o.records, o.fields, o.values, len(o.unexplained)) for o in these), strict=True
            )
        )
        print(f"{kind:16}{len(these):7}{records:10}{fields:9}{values:12}{bad:13}")
    explained: Counter[str] = sum((one.explained for one in found), Counter())
    print("\ndifferences that are documented:")
    for reason, count in sorted(explained.items()):
        print(f"{count:12}  {REASONS[reason]}")
    for one in found:
        for line in one.unexplained:
            print(f"unexplained: {one.file}: {line}")
    print(f"\n{time.process_time() - started:.0f} s of CPU")
    return 1 if any(one.unexplained for one in found) else 0


if __name__ == "__main__":
    sys.exit(main())
