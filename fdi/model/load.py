"""Which airframe does a model file, with what it includes, describe?

In: a name of a shipped model or a path. Out: an :class:`~fdi.model.airframe.Airframe`, or one
``ModelError`` that reports all problems together, each with file, line and reason. An included file
is looked for beside the file that names it, then beside the first file, then among the shipped
models, and never comes from outside the first file's folder and these: a copied folder of models
includes its own files. It may take the columns of its ``for`` from the file that names it. A second
definition of anything is an error unless the file extends the one that made the first, from which
it may also remove some. A statement that takes the place of one that was not removed is warned of.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from copy import deepcopy
from difflib import get_close_matches
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from fdi.errors import ModelError
from fdi.model.airframe import Airframe
from fdi.model.cache import recall, remember
from fdi.model.columns import Row, rows_of, taken
from fdi.model.definitions import SECTIONS, STATEMENTS, Definition, Definitions
from fdi.model.expression import FUNCTIONS
from fdi.model.given import Function, named
from fdi.model.parts import ModelFile
from fdi.model.repeat import repeated
from fdi.model.yaml import Document, Place, documents_in, read_document

if TYPE_CHECKING:
    from fdi.model.schema import AirframeFile

MAX_FILES: Final = 50


def models_folder() -> Path:
    """Return the folder of the shipped models, in a wheel or in a checkout."""
    package = Path(__file__).resolve().parents[1]
    inside = package / "models"
    return inside if inside.is_dir() else package.parent / "models"


def shipped_models() -> tuple[str, ...]:
    """Return the names of the shipped models, sorted."""
    return tuple(path.stem for path in documents_in(models_folder()))


def find_model(name: str | Path) -> Path:
    """Return the file of a shipped model's name or of a path.

    Raises
    ------
    ModelError
        There is neither.
    """
    shipped = models_folder() / f"{name}.yaml"
    if str(name) in shipped_models():
        return shipped
    path = Path(name)
    if not path.exists():
        known = ", ".join(shipped_models())
        raise ModelError("is neither a file nor a shipped model", where=str(name), hint=known)
    return path


def load_airframe(name: str | Path, functions: Mapping[str, Function] | None = None) -> Airframe:
    """Return the airframe in a model file.

    Parameters
    ----------
    name : str or Path
        A shipped model's name, or the path of a file.
    functions : mapping of str to Function, optional
        Tables and Python functions that its equations may use by these names, and no file can
        define (``given.py``).

    Raises
    ------
    ModelError
        The file or an included one is wrong; all problems are reported together.
    """
    path = find_model(name)
    kept = None if functions else recall(path, models_folder())
    if kept is not None:
        return kept
    found = Definitions(path.parent, functions=named(functions or {}, FUNCTIONS))
    main = _read(path, path.name, found)
    if main is None or len(found.problems) > found.strangers:
        raise ModelError.of(found.problems)
    from fdi.model.assemble import assemble

    airframe = assemble(main, found)  # which tells unknown keys with whatever else is wrong
    if not functions:  # code is not kept in a file
        remember(path, models_folder(), found.looked, airframe)
    return airframe


def _read(
    path: Path, label: str, found: Definitions, given: Sequence[Row] = ()
) -> AirframeFile | None:
    """Read a file and what it names, deepest first; None where problems were noted.

    ``given`` are the rows of the file that names it.
    """
    resolved = path.resolve()
    if resolved in found.checksums:  # a file that two others include counts once
        if given and found.taken.get(resolved, given) != given:
            found.problems.append(f"{label}: is included twice, for other rows")
        found.looked[path] = (resolved, found.checksums[resolved])
        return None
    if len(found.checksums) + len(found.open_files) >= MAX_FILES:
        raise ModelError(f"includes more than {MAX_FILES} files", where=label)
    try:
        written = read_document(path, label)
        rows, document = rows_of(written, given), repeated(written, given)
    except ModelError as error:
        found.problems.extend(error.problems)
        return None
    found.looked[path] = (resolved, document.sha256)
    found.digest.update(bytes.fromhex(document.sha256))
    found.rows[resolved] = rows
    if taken(written):
        found.taken[resolved] = given
    spec = _check_shape(document, found)
    if spec is not None:
        found.open_files.append(resolved)
        _collect(spec, document, found, _read_named(spec, path, document, found))
        found.open_files.pop()
    found.checksums[resolved] = document.sha256
    found.files.append(_model_file(resolved, document.sha256, found.folder))
    return spec


def _model_file(resolved: Path, sha256: str, folder: Path) -> ModelFile:
    """Return a file by its path in the folder that it came from."""
    for own, shipped in ((models_folder(), True), (folder, False)):
        if own.resolve() in resolved.parents:
            return ModelFile(resolved.relative_to(own.resolve()).as_posix(), sha256, shipped)
    return ModelFile(resolved.name, sha256, False)  # the first file may be a link


def _read_named(
    spec: AirframeFile, path: Path, document: Document, found: Definitions
) -> set[tuple[str, str]]:
    """Read what a file extends and includes; return what it may define anew."""
    before = _names(found)
    extended: set[tuple[str, str]] = set()
    if spec.extends:
        base = spec.extends if spec.extends.endswith(".yaml") else f"{spec.extends}.yaml"
        _follow(base, path, document, ("extends",), found)
        extended = _names(found) - before
    _remove(spec, document, found, extended)
    for index, target in enumerate(spec.include):
        _follow(target, path, document, ("include", index), found)
    return extended


def _names(found: Definitions) -> set[tuple[str, str]]:
    return {(section, name) for section in SECTIONS for name in found.sections[section]}


def _check_shape(document: Document, found: Definitions) -> AirframeFile | None:
    """Return what a file says; with unknown keys, what it says beside them."""
    from pydantic import ValidationError

    from fdi.model.schema import AirframeFile

    try:
        return AirframeFile.model_validate(document.tree)
    except ValidationError as error:
        items = error.errors(include_url=False)
    strangers = []
    for item in items:
        place = tuple(part for part in item["loc"] if part != "[key]")
        is_strange = item["type"] == "extra_forbidden"
        text = f"unknown key{_known_keys(place)}" if is_strange else item["msg"]
        spelled = ".".join(str(part) for part in place)
        found.problems.append(f"{document.name}:{document.line(place)}: {spelled}: {text}")
        strangers += [place] * is_strange
    if len(strangers) < len(items):
        return None
    found.strangers += len(strangers)
    return AirframeFile.model_validate(_without(document.tree, strangers))


def _known_keys(place: Place) -> str:
    """Return the keys that are known beside an unknown one, and which of them may be meant."""
    from fdi.model.schema import AirframeFile

    schema: Mapping[str, Any] = AirframeFile.model_json_schema()

    def inside(node: Mapping[str, Any], part: str | int) -> Mapping[str, Any]:
        inner: Mapping[str, Any] = node.get("properties", {}).get(part) or next(
            (node[way] for way in ("additionalProperties", "items") if way in node),
            next(iter(node.get("patternProperties", {}).values()), {}),
        )
        for one in (inner, *inner.get("anyOf", ())):
            if "$ref" in one:
                inner = schema["$defs"][one["$ref"].rpartition("/")[2]]
        return inner

    keys = sorted(reduce(inside, place[:-1], schema).get("properties", ()))
    near = get_close_matches(str(place[-1]), keys, 1)
    meant = f", did you mean {near[0]!r}?" if near else ""
    return f"{meant}{'; known are ' * bool(keys)}{', '.join(keys)}"


def _without(tree: Mapping[str, Any], places: Iterable[Place]) -> Any:
    """Return a tree without the keys at some places."""
    copy: Any = deepcopy(tree)
    for *above, key in places:
        del reduce(getitem, above, copy)[key]
    return copy


def _follow(
    target: str,
    path: Path,
    document: Document,
    place: Place,
    found: Definitions,
) -> None:
    where = f"{document.name}:{document.line(place)}"
    roots = [folder.resolve() for folder in (found.folder, models_folder())]
    for folder in dict.fromkeys((path.parent, found.folder, models_folder())):
        candidate = folder / target
        if not candidate.is_file():
            found.looked[candidate] = None
            continue
        resolved = candidate.resolve()
        if not any(root in resolved.parents for root in roots):
            found.problems.append(f"{where}: {target!r} lies outside the model's folder")
        elif resolved in found.open_files:
            found.problems.append(f"{where}: {target!r} includes itself")
        else:
            _read(candidate, target, found, found.rows[path.resolve()])
        return
    found.problems.append(f"{where}: {target!r} is not found beside the file or among the models")


def _remove(
    spec: AirframeFile, document: Document, found: Definitions, extended: set[tuple[str, str]]
) -> None:
    """Take out what a file does not want of the one that it extends."""
    for section, names in spec.remove.items():
        for index, name in enumerate(names):
            if not found.remove(section, name, extended):
                where = f"{document.name}:{document.line(('remove', section, index))}"
                of = f"{spec.extends!r} has none" if spec.extends else "nothing is extended"
                found.problems.append(f"{where}: remove: no {name!r} in {section}: {of}")


def _collect(
    spec: AirframeFile, document: Document, found: Definitions, extended: set[tuple[str, str]]
) -> None:
    for section in SECTIONS:
        entries: Mapping[str, Any] = getattr(spec, section)
        known = found.sections[section]
        for name, entry in entries.items():
            definition = Definition(entry, document, (section, name))
            earlier = known.get(name)
            if earlier is None or (section, name) in extended:
                known[name] = definition
                if earlier and section in STATEMENTS and entry != earlier.entry:
                    found.warnings.append(
                        f"{definition.at()}: {name!r} takes the place of the one at "
                        f"{earlier.at()}; if that is meant, say so: remove: {{{section}: [{name}]}}"
                    )
            elif section in ("measurements", "inputs"):
                # One message may be described in several files, each with fields of its own.
                known[f"{name}#{document.name}"] = definition
            elif section == "components" and entry == earlier.entry:
                continue
            else:
                found.problems.append(
                    f"{definition.at()}: {name!r} is defined twice, first at {earlier.at()}"
                )
