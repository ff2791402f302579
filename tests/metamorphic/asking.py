"""Does a relation hold on a flight? A name and a key in, an outcome out, for other processes."""

import tempfile
import time
import traceback
from pathlib import Path
from typing import NamedTuple

from flights import SHARED, Case, labels

from .relations import RELATIONS, NotAskedError


class Outcome(NamedTuple):
    relation: str
    flight: str
    failure: str | None  # None: holds; "" : not asked
    seconds: float


def ask(relation: str, flight: str) -> Outcome:
    """Return whether a relation holds on a flight."""
    start = time.process_time()
    failure: str | None = None
    with tempfile.TemporaryDirectory(prefix="fdi-") as folder:
        try:
            case = Case(SHARED / flight, labels(SHARED)[flight])
            RELATIONS[relation].relation(case, Path(folder))
        except NotAskedError:
            failure = ""
        except AssertionError as error:
            place = traceback.extract_tb(error.__traceback__)[-1]
            failure = (str(error) or f"{place.name}: {place.line}").splitlines()[0]
        except Exception as error:  # noqa: BLE001 - a defect is a failure of this flight alone
            failure = f"a defect: {error!r}"
    return Outcome(relation, flight, failure, time.process_time() - start)
