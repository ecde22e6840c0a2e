"""The layout of a store: arrays, metadata, and the comparison of two computations.

The directory is a group in format 3 of Zarr: one array per field, of the grid's shape and with
named dimensions, one per axis of the grid, with that axis as coordinate. Attributes say what the
computation was: kind, version, system and settings for the whole; description and unit, or the
meanings of codes, for each array, after the CF conventions (cfconventions.org).
"""

import dataclasses
import hashlib
import json
import warnings
from collections.abc import Iterator
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ParameterError
from ..extras import missing
from .columns import attributes, axis_attributes
from .fields import FORMAT, FORMAT_VERSION, Field, Layout, RowGroup
from .grid import Grid, Tiling

# Numbers in a chunk of rows: half a megabyte, rewritten as rows are appended to it.
_ROW_NUMBERS = 2**16


def zarr_module() -> Any:
    """Return Zarr; ImportError where it is missing or too old."""
    needed = "a store needs Zarr 3.1.3 or newer"
    try:
        import zarr
        from packaging.version import Version  # which Zarr needs itself
    except ImportError as error:
        raise missing("xarray", needed, module="zarr") from error
    if Version(zarr.__version__) < Version("3.1.3"):
        # Older ones write into existing files, so that a killed process leaves incomplete files.
        found = f"{needed}, found {zarr.__version__}"
        raise missing("xarray", found, module="zarr")
    return zarr


def every_chunk() -> AbstractContextManager[Any]:
    """Let arrays that are made or opened write chunks of fill values as files, too.

    By default Zarr leaves them out; then a lost chunk looks like a chunk of fill values.
    """
    config: AbstractContextManager[Any] = zarr_module().config.set(
        {"array.write_empty_chunks": True}
    )
    return config


def row_chunk(entry: Field) -> int:
    """Return how many rows of a field are in a chunk."""
    return max(1, _ROW_NUMBERS // int(np.prod(entry.shape)))


def mark() -> dict[str, Any]:
    """Return the attributes of a store that is being made; Zarr goes on to write into them."""
    return {"format": FORMAT, "format_version": FORMAT_VERSION}


def create(group: Any, layout: Layout, tiling: Tiling) -> None:
    """Make all arrays, empty; arrays that a killed process has left are replaced."""

    def make(name: str, **options: Any) -> Any:
        return group.create_array(
            name,
            compressors=zarr_module().codecs.ZstdCodec(checksum=True),
            overwrite=True,
            **options,
        )

    for name, values in layout.grid.axes.items():
        axis = make(
            name,
            shape=values.shape,
            chunks=(max(1, len(values)),),
            dtype="float64",
            dimension_names=(name,),
            attributes=axis_attributes(),
        )
        axis[...] = values
    for entry, rows in layout.arrays():
        if rows is None:
            shape, chunks = layout.grid.shape, tiling.tile
        else:
            shape, chunks = (0,), (row_chunk(entry),)
        make(
            entry.name,
            shape=shape + entry.shape,
            chunks=chunks + entry.shape,
            dtype=entry.dtype,
            fill_value=entry.fill,
            dimension_names=layout.dims(entry, rows),
            attributes=attributes(layout, entry),
        )
    group.update_attributes(layout.attributes() | {"fingerprint": fingerprint(layout, tiling.tile)})


def fingerprint(layout: Layout, tile: tuple[int, ...]) -> str:
    """Return a checksum of all metadata of a store."""
    axes = [values.astype("<f8").tobytes() for values in layout.grid.axes.values()]
    facts = [
        layout.attributes(),
        tile,
        [hashlib.sha256(values).hexdigest() for values in axes],
        [[dataclasses.asdict(entry), rows and rows.name] for entry, rows in layout.arrays()],
    ]
    return hashlib.sha256(json.dumps(facts).encode()).hexdigest()


def consolidate(path: Path) -> None:
    """Gather the metadata of all arrays in one file.

    xarray looks for it, and there all columns of a row group change their length at once.
    """
    with warnings.catch_warnings():
        # Zarr notes that this file is an extension of its format 3; a reader may do without it.
        warnings.simplefilter("ignore")
        zarr_module().consolidate_metadata(str(path), zarr_format=3)


def check_format(path: Path, group: Any) -> None:
    """Refuse a group that is no store, or one of another format."""
    if group.attrs.get("format") != FORMAT:
        raise ParameterError(f"store = {str(path)!r} is a Zarr group of something else")
    if group.attrs["format_version"] != FORMAT_VERSION:
        raise ParameterError(
            f"store = {str(path)!r} is in format {group.attrs['format_version']}; this version of "
            f"vibroimpact reads and writes format {FORMAT_VERSION}"
        )


def read_layout(group: Any) -> Layout:
    """Return the layout of a store."""
    about: Any = dict(group.attrs)
    axes = {name: group[name][()] for name in about["axes"]}

    def entry(name: str, outer: int) -> Field:
        array = group[name]
        return Field(
            name,
            array.dtype.name,
            array.attrs["description"],
            array.shape[outer:],
            (array.metadata.dimension_names or ())[outer:],
            array.fill_value.item(),
            tuple(array.attrs.get("flag_meanings", "").split()),
        )

    rows: dict[str, list[Field]] = {}
    for name in about["row_fields"]:
        dim = group[name].metadata.dimension_names[0]
        rows.setdefault(dim.removesuffix("_row"), []).append(entry(name, 1))
    system = json.loads(about["system"])
    return Layout(
        about["kind"],
        Grid(axes),
        tuple(entry(name, len(axes)) for name in about["fields"]),
        tuple(RowGroup(name, tuple(fields)) for name, fields in rows.items()),
        json.loads(about["settings"]) | ({} if system is None else {"system": system}),
        about["version"],
    )


def differences(stored: Layout, asked: Layout) -> list[str]:
    """Return the differences of two computations in words."""
    there, here = _facts(stored), _facts(asked)
    found = [
        f"{name} is {there.get(name, 'not known')} there, {here.get(name, 'not known')} here"
        for name in {**there, **here}
        if there.get(name) != here.get(name)
    ]
    for name, values in stored.grid.axes.items():
        others = asked.grid.axes.get(name, values)
        if values.shape == others.shape and (values != others).any():
            place = int(np.argmax(values != others))
            found.append(
                f"{name}[{place}] is {float(values[place])!r} there, {float(others[place])!r} here"
            )
    return found


def _facts(layout: Layout) -> dict[str, str]:
    """Return all that two layouts must share, but the values of the axes, as texts by name."""
    facts = {"kind": layout.kind, "version": layout.version, "axes": " x ".join(layout.grid.axes)}
    facts |= {f"len({name})": str(len(values)) for name, values in layout.grid.axes.items()}
    facts |= dict(_flat("", layout.settings))
    for entry, group in layout.arrays():
        facts[f"the field {entry.name}"] = f"{entry} of the {group.name if group else 'cell'}s"
    return facts


def _flat(prefix: str, settings: Any) -> Iterator[tuple[str, str]]:
    if isinstance(settings, dict):
        for name, value in settings.items():
            yield from _flat(f"{prefix}.{name}" if prefix else name, value)
    elif isinstance(settings, list) and any(isinstance(value, dict) for value in settings):
        for place, value in enumerate(settings):
            yield from _flat(f"{prefix}[{place}]", value)
    else:
        yield prefix, repr(settings)
