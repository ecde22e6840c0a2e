"""Which of several fits of the same records is the best, and what the others say of its errors.

At the border of a sequence of impacts chi2 has an edge, and beyond it another motion may explain
the records as well. Its minimum belongs to what the records leave possible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from .profile import bent
from .result import Fit

# A fit whose residuals are so improbable is one if no other start of the search gives a better one.
_DOUBTFUL = 0.05
# Another minimum counts whose chi2 is less than so much larger: three standard errors.
_ALSO_POSSIBLE = 9.0
# A row so many standard errors off is not explained at all, and neither is an impact too many.
_FAR_OFF = 5.0
# Minima that differ by less than so many of both of their errors are one.
_ONE = 2.0


def is_one(found: Fit) -> bool:
    """Whether the model fits, be all unknowns determined or not."""
    return found.verdict in ("fits", "not identifiable")


def is_better(one: Fit, other: Fit) -> bool:
    """Whether a fit is better than another one of the same records, found earlier."""
    if is_one(one) != is_one(other):
        return is_one(one)
    # What the records leave open stays where it was first, unless they tell the two apart.
    least = 1.0 if one.verdict == other.verdict == "not identifiable" else 0.0
    if not _has_errors(one):
        return _misfit(one) < _misfit(other) * (1.0 - least / max(1.0, other.dof))
    if is_one(one):
        return _excess(one) < _excess(other) - least
    return _unexplained(one) < _unexplained(other)


def is_settled(found: Fit) -> bool:
    """Whether no other minimum need be looked for.

    Where a combination is open the others are not known to be linear: there is no profile.
    """
    if found.verdict != "fits":
        return False
    if found.probability is not None and found.probability < _DOUBTFUL:
        return False
    return found.profile is None or not bent(found.names, found.profile)


def with_rivals(best: Fit, tried: Sequence[Fit]) -> Fit:
    """Return the best fit with errors that hold other minima which may be the right one, too.

    They weigh as their likelihoods do: the covariance is that of the mixture, about the best.
    """
    if not is_one(best) or best.loss != "linear" or not _has_errors(best):
        return best
    known = [best]
    for each in sorted(filter(is_one, tried), key=_excess):
        near = _excess(each) - _excess(best) < _ALSO_POSSIBLE
        if near and np.isfinite(each.covariance).all() and all(_apart(each, one) for one in known):
            known.append(each)
    rivals = known[1:]
    if not rivals:
        return best
    weights = np.exp([-0.5 * (_excess(each) - _excess(best)) for each in known])
    off = np.array([each.estimates - best.estimates for each in known])
    spread = np.array([each.covariance for each in known]) + off[:, :, None] * off[:, None, :]
    covariance = np.einsum("i,ijk->jk", weights / weights.sum(), spread)
    errors = np.sqrt(np.diag(covariance))
    said = [_told(best, each) for each in rivals]
    linear = {*(bent(best.names, best.profile) if best.profile is not None else ())}
    return replace(
        best,
        covariance=covariance,
        standard_errors=np.where(np.isinf(best.standard_errors), np.inf, errors),
        profile=None,
        reasons=(*said, *(each for each in best.reasons if each not in linear)),
    )


def _told(best: Fit, rival: Fit) -> str:
    values = ", ".join(f"{name} {value:.6g}" for name, value in rival.values.items())
    more = rival.chi2 - best.chi2
    return (
        f"another motion may be the right one, too, with chi2 {abs(more):.2g} "
        f"{'above' if more >= 0.0 else 'below'}: {values}; the errors hold both"
    )


def _apart(one: Fit, other: Fit) -> bool:
    """Whether two minima are two."""
    errors = np.hypot(one.standard_errors, other.standard_errors)
    return bool((np.abs(one.estimates - other.estimates) > _ONE * errors).any())


def _has_errors(found: Fit) -> bool:
    return all(record.sigma is not None for record in found.records)


def _excess(found: Fit) -> float:
    """Return chi2 less what is expected: rows beside impacts may count in one fit alone."""
    return found.chi2 - found.dof


def _has_none(found: Fit) -> bool:
    """Whether no motion predicts the record, or only one without derivatives."""
    return found.verdict == "not converged" and bool(np.isinf(found.standard_errors).all())


def _unexplained(found: Fit) -> float:
    """Return how much of the records is not explained: rows far off, and impacts too many."""
    if _has_none(found):
        return math.inf
    z = np.concatenate(found.residuals) / found.sigma
    return float(np.minimum(z**2, _FAR_OFF**2).sum() + _FAR_OFF**2 * len(found.extra_impacts))


def _misfit(found: Fit) -> float:
    """Return how far predictions are off, in the same units whatever sigma was taken for."""
    if _has_none(found):
        return math.inf
    sizes = [max(float(np.std(record.values)), 1e-12) for record in found.records]
    parts = [
        float(np.mean(np.minimum((residuals / size) ** 2, 1e6)))
        for residuals, size in zip(found.residuals, sizes, strict=True)
    ]
    return sum(parts)
