"""Basins of attraction in a file: written without pickle, read back to the same bits."""

import dataclasses
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ... import _core, archive
from ...orbits.files import structure_orbit_of, structure_parts
from ...orbits.motion import PeriodicMotion
from ...orbits.verdict import motion_of
from ...structure_motion import StructureOrbit
from ..machines import machine_from_dict, machine_of
from .attractors import Attractor, Family
from .clouds import Cloud
from .region import Region
from .results import Basins, BasinSettings

Arrays = dict[str, NDArray[Any]]
_CELLS = ("attractor", "status_code", "settling")


def write_basins(path: str | os.PathLike[str], basins: Basins) -> None:
    """Write basins to ``path`` (.npz); the file appears complete or not at all."""
    arrays: Arrays = {name: getattr(basins, name) for name in _CELLS}
    arrays |= {f"axis_{name}": values for name, values in basins.axes.items()}
    described = []
    for number, attractor in enumerate(basins.attractors):
        words, own = _parts(attractor)
        described.append(words)
        arrays |= {f"attractor_{number}_{name}": array for name, array in own.items()}
    metadata = {
        "system": machine_of(basins.system).to_dict(),
        "settings": dataclasses.asdict(basins.settings),
        "axes": list(basins.axes),
        "attractors": described,
    }
    archive.write(path, "basins", metadata, arrays)


def read_basins(path: str | os.PathLike[str]) -> Basins:
    """Read what ``write_basins`` has written.

    Raises
    ------
    ValueError
        If the file is damaged, foreign, or holds something else.
    """
    return archive.read(path, {"basins": basins_from_parts})


def basins_from_parts(metadata: dict[str, Any], arrays: Arrays) -> Basins:
    """Build basins from the content of an archive."""
    system = machine_from_dict(metadata["system"]).system
    settings = metadata["settings"]
    attractors = []
    for number, words in enumerate(metadata["attractors"]):
        prefix = f"attractor_{number}_"
        own = {
            name.removeprefix(prefix): array
            for name, array in arrays.items()
            if name.startswith(prefix)
        }
        attractors.append(_attractor(system, words, own))
    return Basins(
        system=system,
        axes={name: arrays[f"axis_{name}"] for name in metadata["axes"]},
        attractors=tuple(attractors),
        settings=BasinSettings(**settings | {"initial": _tuples(settings["initial"])}),
        **{name: arrays[name] for name in _CELLS},
    )


def _parts(attractor: Attractor) -> tuple[dict[str, Any], Arrays]:
    """Return metadata (texts and few numbers), and arrays."""
    words = {
        name: getattr(attractor, name)
        for name in ("label", "kind", "start", "confirmed", "why_not", "orbit", "family", "rotor")
    }
    arrays: Arrays = {"sections": attractor.sections}
    motion, region, cloud = attractor.motion, attractor.region, attractor.cloud
    if isinstance(motion, StructureOrbit):
        of_motion, numbers = structure_parts(motion)
        words |= of_motion
        arrays |= numbers
    elif motion is not None:
        legs = [str(leg) for leg in motion.legs]
        words["motion"] = [legs, motion.m, motion.clocks, motion.wall_at_rest, motion.error]
        arrays["nodes"] = motion.nodes
    if region is not None:
        words["region"] = [region.counts, region.contraction, region.samples]
        arrays |= {"center": region.center, "factor": region.factor}
    if cloud is not None:
        words["cloud"] = [cloud.covered, cloud.rotor, cloud.counted]
        arrays |= {"low": cloud.low, "width": cloud.width, "boxes": cloud.boxes}
    return words, arrays


def _attractor(system: Any, words: dict[str, Any], arrays: Arrays) -> Attractor:
    motion: PeriodicMotion | StructureOrbit | None = None
    region: Region | None = None
    cloud: Cloud | None = None
    if "of_structure" in words:
        motion = structure_orbit_of(system, words, arrays)
        del words["of_structure"], words["stop_legs"]
    if "motion" in words:
        legs, m, clocks, wall_at_rest, error = words.pop("motion")
        known = [_core.Leg.from_text(leg) for leg in legs]
        itinerary = _core.Itinerary(known, m, clocks, wall_at_rest)
        motion = motion_of(system, itinerary, arrays["nodes"], error=error, whole=True)
    if "region" in words:
        counts, contraction, samples = words.pop("region")
        region = Region(arrays["center"], arrays["factor"], tuple(counts), contraction, samples)
    if "cloud" in words:
        covered, rotor, *counted = words.pop("cloud")
        boxes = (arrays["low"], arrays["width"], arrays["boxes"])
        cloud = Cloud(*boxes, covered, rotor, *map(_tuples, counted))
    family = None if words["family"] is None else Family(words["family"])
    words |= {"family": family, "orbit": tuple(words["orbit"])}
    words["start"] = _tuples(np.asarray(words["start"], dtype=np.float64).tolist())
    return Attractor(
        **words,
        sections=arrays["sections"],
        motion=motion,
        region=region,
        cloud=cloud,
        system=system if family is Family.FREE else None,
    )


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list | tuple) else value
