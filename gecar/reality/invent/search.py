"""The search for a law: every single law of the language by its sensitivity, then Grammatical Evolution from there.

A law's worth is what it gains, in log-likelihood beside what the simulation is off by anyway, less its length. Linear
constants are fitted by weighted least squares on the residuals' sensitivities, with the model's own parameters free
beside them; nothing measured is ever differentiated. The best laws are then fitted in full.

Sources: Grammatical Evolution, O'Neill and Ryan, IEEE T-EC 5 (2001) 349; description length, Rissanen, Automatica 14
(1978) 465; score test, Rao, Proc. Cambridge Phil. Soc. 44 (1948) 50.
"""

from __future__ import annotations

import itertools
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from gecar.evolution.ask_tell import Evolution
from gecar.evolution.problem import Problem as EvolvedProblem
from gecar.evolution.settings import EvolutionSettings
from gecar.language.grammar import Grammar
from gecar.language.mapping import Derivation, Mapper
from gecar.reality.fitting.model import Model
from gecar.reality.invent.free_terms import FreeTerms, usual_size
from gecar.reality.invent.sentences import (
    Laws,
    at_ports,
    complexity,
    joined,
    key,
    linear,
    parts_of,
    pieces,
    read_sentence,
    single_laws,
    variables_of,
)
from gecar.reality.optimisation.least_squares import Minimum, least_squares, weights
from gecar.reality.selection.problem import Problem
from gecar.world.ports import BY_PORT, CONSTANTS, N_TERMS
from gecar.world.terms import POINT, Term

Array = npt.NDArray[np.float64]
Column = npt.NDArray[np.float32]

TOGETHER = 64  # laws whose residuals are held at a time
SMALL_RESPONSE, LARGE_RESPONSE = 0.02, 1.0  # standard deviations: a derivative is taken between
UNEVEN = 2.0  # times as much or as little a size as before: then a derivative at none says nothing
FINITE = (-160.0, -80.0, -40.0, -20.0, 20.0, 40.0, 80.0, 160.0)  # sizes that are tried then, in `usual_size`s
KEPT_COLUMNS = 1200
KEPT_LAWS = 40  # of those tried one by one, and of those evolved
PORTS_KEPT = 0.3  # of the best law's gain: what a port's best law must gain for evolution to look there
A_TOKEN = 1.5  # log-likelihood that a token or a constant of a law must bring: a choice among a handful
MOST_PARTS = 3  # of a sum
EVOLUTION = EvolutionSettings(
    population=80, generations=12, codons=40, elites=4, initialisation="ptc2", initial_expansions=12,
    crossover="subtree", crossover_rate=0.7, mutation="one_used_codon", duplicates="run", tournament=4,
)  # fmt: skip
FINALISTS = 12
FORMS = 3  # of a law, fitted in full at the point of the best law
AT_BEST = 5  # laws of one part that are fitted in full at the best law's port
ROUNDS = 8
OWN_SHARE = 1e-4  # of a column's square that the model's own parameters do not hold; less is none of its own


@dataclass(frozen=True)
class Law:
    """Laws that belong together, fitted on top of a model.

    Attributes
    ----------
    terms
        With their constants fitted.
    parameters, minimum
        The model's parameters and the laws' constants, and where the fit ended.
    gain
        In log-likelihood.
    """

    terms: Laws
    parameters: FreeTerms
    minimum: Minimum
    gain: float

    @property
    def worth(self) -> float:
        """The gain less the law's length."""
        return self.gain - A_TOKEN * complexity(self.terms)


@dataclass
class Library:
    """Sensitivities of residuals to laws of one part.

    Attributes
    ----------
    problem, model
        On top of what model of which problem.
    scores
        Of every law tried: the sums over half-second spans of its weighted, projected sensitivity times the residuals,
        for the null distribution.
    """

    problem: Problem
    model: Model
    scores: dict[str, Column] = field(default_factory=dict)
    _columns: dict[str, Column] = field(default_factory=dict)
    _gains: dict[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        estimator = self.problem.estimator
        self._root = np.sqrt(weights(self.model.errors))
        self._basis = np.linalg.qr(estimator.own_sensitivities(self.model) * self._root[:, None])[0]
        self._target = self._projected(self._root * self.model.errors)

    def gain(self, laws: Laws) -> float:
        """Return what laws gain with their linear constants fitted, by their sensitivities."""
        name = key(laws)
        if name not in self._gains:
            parts = parts_of(laws)
            self.look_up(parts)
            if name not in self._gains:
                self._gains[name] = 0.5 * float(self._target @ self._fit(parts)[0])
        return self._gains[name]

    def started(self, laws: Laws) -> Laws:
        """Return laws with their linear constants as the sensitivities have them."""
        parts = parts_of(laws)
        self.look_up(parts)
        values = -self._fit(parts)[1]
        sized = [
            part.with_constants({linear(part)[0]: float(value) * usual_size(part)})
            for part, value in zip(parts, values, strict=True)
        ]
        ends = np.cumsum([0, *(len(pieces(term)) for term in laws)]).tolist()
        return tuple(joined(sized[first:last]) for first, last in itertools.pairwise(ends))

    def look_up(self, parts: Sequence[Term]) -> None:
        """Take the sensitivities of laws of one part that are not at hand."""
        wanted = {key((part,)): part for part in parts}
        self._columns |= {
            name: self._columns.pop(name) for name in wanted if name in self._columns
        }  # now the last
        new = {name: part for name, part in wanted.items() if name not in self._columns}
        names = list(new)
        for first in range(0, len(names), TOGETHER):
            some = names[first : first + TOGETHER]
            for name, column in zip(some, self._sensitivities([new[name] for name in some]), strict=True):
                self._keep(name, column)

    def _keep(self, name: str, column: Array) -> None:
        projected = self._scored(name, column)[0]
        while len(self._columns) >= KEPT_COLUMNS:
            self._columns.pop(next(iter(self._columns)))
        self._columns[name] = projected.astype(np.float32)

    def _scored(self, name: str, column: Array) -> tuple[Array, float]:
        """Return what is a sensitivity's own, weighted, and the size the residuals ask for; its score is kept."""
        weighted = column * self._root
        projected = self._projected(weighted)
        left = float(projected @ projected)
        if left <= OWN_SHARE * float(weighted @ weighted):
            projected, left = np.zeros(len(column)), 1.0
        pull = float(self._target @ projected)
        self._gains[name] = 0.5 * pull**2 / left
        spans = np.bincount(self.problem.estimator.blocks.spans, projected * self._target / np.sqrt(left))
        self.scores[name] = spans.astype(np.float32)
        return projected, -pull / left

    def _projected(self, weighted: Array) -> Array:
        """Return what the model's own parameters leave of a weighted column."""
        out: Array = weighted - self._basis @ (self._basis.T @ weighted)
        return out

    def _sensitivities(self, parts: Sequence[Term]) -> list[Array]:
        """Return the whitened residuals' derivatives by laws' constants, in units of `usual_size`, each shape (n,).

        Where the derivative at none says nothing (tyres that do not slip), the change by the finite size that the
        residuals ask for most, over that size.
        """
        sizes = np.ones(len(parts))
        changes = self._changes(parts, sizes)
        rms = np.sqrt(np.mean(np.square(changes), axis=1))
        again = np.flatnonzero((rms > LARGE_RESPONSE) | (rms < SMALL_RESPONSE))
        if len(again):
            sizes[again] = np.clip(0.3 / np.maximum(rms[again], 1e-9), 1e-4, 100.0)
            changes[again] = self._changes([parts[k] for k in again.tolist()], sizes[again])
        slopes = changes / sizes[:, None]
        steeper = np.sqrt(np.mean(np.square(slopes), axis=1)) / np.maximum(rms, 1e-9)
        uneven = (rms < SMALL_RESPONSE) & ((steeper > UNEVEN) | (steeper < 1.0 / UNEVEN))
        for k in np.flatnonzero(uneven).tolist():
            slopes[k] = self._secant(parts[k], slopes[k])
        return list(slopes)

    def _secant(self, part: Term, slope: Array) -> Array:
        """Return a law's change by a finite size over that size: of those that are asked for, the one that gains most.

        Every one of them is a try, and counts for the null distribution.
        """
        name, sizes = key((part,)), np.array(FINITE)
        secants = self._changes([part] * len(sizes), sizes) / sizes[:, None]
        best, most = slope, 0.0
        for size, secant in zip(sizes.tolist(), secants, strict=True):
            tried = f"{name} about {size:g}"
            asked = self._scored(tried, secant)[1]
            if asked * size > 0.0 and self._gains[tried] > most:
                best, most = secant, self._gains[tried]
        return best

    def _changes(self, parts: Sequence[Term], sizes: Array) -> Array:
        """Return how residuals change with laws of one part whose constants are so many `usual_size`s."""
        records = np.repeat(self.model.physics, len(parts))
        own = int(records["n_terms"][0])
        records["n_terms"] = own + 1
        for k, (part, size) in enumerate(zip(parts, sizes.tolist(), strict=True)):
            records["terms"][k, own] = part.row
            slot = CONSTANTS + part.free.index(linear(part)[0])
            records["terms"][k, own, slot] = size * usual_size(part)
        errors = self.problem.residuals.errors_of_each(records)
        out: Array = self.problem.estimator.whitened(errors) - self.model.errors
        return out

    def _fit(self, parts: Sequence[Term]) -> tuple[Array, Array]:
        """Return the part of the residuals that laws of one part explain together, and their coefficients."""
        matrix = np.stack([self._columns[key((part,))] for part in parts], axis=1).astype(float)
        scale = np.maximum(np.sqrt(np.sum(matrix**2, axis=0)), 1e-12)
        found = np.linalg.lstsq(matrix / scale, self._target, rcond=1e-6)[0]
        return matrix @ (found / scale), found / scale


def search(
    library: Library,
    grammar: Grammar,
    ports: Sequence[str],
    seed: int = 0,
    tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
    unknown: frozenset[str] = frozenset(),
) -> list[Law]:
    """Return the laws worth most, fitted in full, best first.

    Parameters
    ----------
    library
        Of the model they are to be added to.
    grammar
        The language of laws.
    ports
        Where laws can show.
    seed
        Random seed.
    tell
        Called with a line of progress.
    unknown
        Variables that laws may not look at.
    """
    room = N_TERMS - len(library.problem.estimator.robot.term)
    there = at_ports(grammar, ports, room)
    if there is None:
        tell(f"{grammar.source} has no law of what is left here: none at {', '.join(ports)}")
        return []
    singles = [laws for laws in single_laws(there) if not variables_of(laws) & unknown]
    if not singles:
        return []
    tell(f"{len(singles)} laws one by one")
    for first in range(0, len(singles), TOGETHER):
        some = singles[first : first + TOGETHER]
        library.look_up([part for laws in some for part in parts_of(laws)])
        for laws in some:
            library.gain(laws)
    promising = _promising(library, singles)
    ordered = sorted(singles, key=lambda laws: _loss(library, laws))
    of_wheels = {laws[0].port: laws for laws in reversed(ordered) if _is_of_each_wheel(laws)}
    kept = [*ordered[:KEPT_LAWS], *of_wheels.values()]
    tell(f"laws evolved at {', '.join(port for port in ports if port in promising)}")
    evolved = _evolved(library, at_ports(there, sorted(promising)) or there, seed, unknown)
    candidates = {key(laws): laws for laws in (*_greedy_sums(library, kept), *evolved, *kept)}
    ranked = sorted(candidates.values(), key=lambda laws: _loss(library, laws))
    fitted = [fit(library, library.started(laws)) for laws in _spread_over_ports(ranked)]
    best = max(fitted, key=lambda law: law.worth)
    fitted += [fit(library, library.started(laws)) for laws in _other_forms(library, best, singles)]
    return sorted(fitted, key=lambda law: -law.worth)


def _promising(library: Library, singles: Sequence[Laws]) -> set[str]:
    """Return the ports whose best law gains nearly as much as the best at any port of the same sensor, or of none.

    Each sensor's ports are apart: a wrong gyro, say, must not hide what is wrong with the motion.
    """
    best_at, best_of = defaultdict[str, float](float), defaultdict[str, float](float)
    for laws in singles:
        gain = library.gain(laws)
        for port in (term.port for term in laws):
            best_at[port] = max(best_at[port], gain)
            best_of[BY_PORT[port].sensor] = max(best_of[BY_PORT[port].sensor], gain)
    return {port for port, gain in best_at.items() if gain >= PORTS_KEPT * best_of[BY_PORT[port].sensor]}


def _other_forms(library: Library, law: Law, singles: Sequence[Laws]) -> list[Laws]:
    """Return laws of other forms about the point that was fitted for a law; none for a law without a point.

    They were tried on a coarse grid of points, where another form may seem to be the best.
    """
    at = {name: value for name, value in law.terms[0].constants.items() if name in POINT}
    if not at:
        return []
    here = [laws[0].with_constants(at) for laws in singles if laws[0].port == law.terms[0].port]
    moved: dict[str, Laws] = {key((term,)): (term,) for term in here}
    moved.pop(key(law.terms), None)
    return sorted(moved.values(), key=lambda laws: _loss(library, laws))[:FORMS]


def fit(library: Library, laws: Laws) -> Law:
    """Fit laws' constants together with the model's own parameters."""
    model = library.model
    free = FreeTerms(model.parameters, model.z, laws)
    residual = library.problem.estimator.residual(free)
    found = least_squares(residual, free.z, free.bounds, free.probes, ROUNDS)
    return Law(free.fitted(found.z), free, found, model.cost - found.cost)


def _loss(library: Library, laws: Laws) -> float:
    """Return a law's length less what it gains, by its sensitivities."""
    return A_TOKEN * complexity(laws) - library.gain(laws)


def _spread_over_ports(ranked: Sequence[Laws]) -> list[Laws]:
    """Return the laws to fit in full, best first.

    At each port these are the best law, the best of one part (several at the best port), the best of the shortest, and
    the best that each wheel has for itself: sensitivities overrate long and steep laws, whose effect is not in
    proportion to their size, and underrate what holds a wheel back at one angle only from some size on.
    """
    at_port: dict[str, list[Laws]] = {}
    for laws in ranked:
        at_port.setdefault(laws[0].port, []).append(laws)
    kept = list[Laws]()
    for number, here in enumerate(at_port.values()):
        plain = [laws for laws in here if len(parts_of(laws)) == len(laws)]
        of_each_wheel = list(filter(_is_of_each_wheel, here))
        chosen = [
            here[0],
            *plain[: AT_BEST if number == 0 else 1],
            min(here, key=complexity),
            *of_each_wheel[:1],
        ]
        kept += [laws for laws in here if laws in chosen]
    return sorted(kept, key=ranked.index)[:FINALISTS]


def _is_of_each_wheel(laws: Laws) -> bool:
    """Whether either wheel has a law of its own."""
    return len({term.side for term in laws}) > 1


def _greedy_sums(library: Library, singles: Sequence[Laws]) -> list[Laws]:
    """Return sums at one port that begin with the best single law there and take the next best beside it."""
    out: list[Laws] = []
    plain = [
        laws[0]
        for laws in singles
        if len(laws) == 1 and not laws[0].store and "at_x" not in laws[0].constants
    ]
    for port in dict.fromkeys(term.port for term in plain):
        here = [term for term in plain if term.port == port]
        chosen = here[:1]
        while len(chosen) < MOST_PARTS:
            sums = [total for term in here if term not in chosen and (total := _sum([*chosen, term]))]
            if not sums:
                break
            best = max(sums, key=lambda term: library.gain((term,)))
            chosen = list(pieces(best))
            out.append((best,))
    return out


def _sum(parts: Sequence[Term]) -> Term | None:
    """Return laws of one part as one sum; None where that would be too long."""
    try:
        return joined(parts)
    except ValueError:
        return None


class _Evolved(EvolvedProblem[Laws]):
    """Laws as what an evolution evolves: the sentences of a grammar, less those of unknown variables."""

    def __init__(self, unknown: frozenset[str]) -> None:
        self._unknown = unknown

    def read(self, derivation: Derivation) -> Laws | None:
        """Return the laws of a sentence; None if it is not a law, or repeats a part."""
        try:
            laws = read_sentence(derivation.text)
        except ValueError:
            return None
        parts = [key((part,)) for part in parts_of(laws)]
        return None if variables_of(laws) & self._unknown or len(set(parts)) < len(parts) else laws

    def meaning(self, program: Laws, derivation: Derivation) -> bytes:  # noqa: ARG002
        """Return the laws as bytes."""
        return key(program).encode()


def _evolved(library: Library, grammar: Grammar, seed: int, unknown: frozenset[str]) -> list[Laws]:
    """Return the best laws of an evolution."""
    evolution = Evolution(Mapper(grammar), _Evolved(unknown), EVOLUTION, seed)
    found: dict[str, tuple[float, Laws]] = {}
    while not evolution.finished:
        asked = [candidate.program for candidate in evolution.ask()]
        library.look_up([part for laws in asked for part in parts_of(laws)])
        losses = [_loss(library, laws) for laws in asked]
        found |= {key(laws): (loss, laws) for loss, laws in zip(losses, asked, strict=True)}
        evolution.tell(losses)
    return [laws for _, laws in sorted(found.values(), key=lambda pair: pair[0])[:KEPT_LAWS]]
