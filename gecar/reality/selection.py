"""Choosing effects: forward, backward and swap, each step judged on recordings it was not fitted to.

An effect is taken when, added to what is already taken, it

- lowers the cost of every left-out recording together by more than the null: the 95 % quantile of the largest gain
  any effect of the catalogue reaches on residuals whose blocks have random signs, which have the noise's colour and
  its wild spans, but no cause;
- is of a size worth a name;
- explains most of the structure that is left. What merely imitates a cause explains a part, and is a stand-in.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from gecar.reality.alignment import fitted_offsets, scattered
from gecar.reality.comparison import CHANNELS, Cells, Comparison
from gecar.reality.fitting import Fit, cost, costs, fit, jacobian, weights
from gecar.reality.freedom import Freedom, free
from gecar.reality.recording import Recording
from gecar.reality.rough_search import rough_search
from gecar.reality.starts import starts
from gecar.world.robot import Robot

Array = npt.NDArray[np.float64]
Effects = Mapping[str, Mapping[str, float]]

BLOCK_S = 0.15  # structure is what survives averaging over this
SPAN_S = 0.5  # spans whose signs the null draws
NULLS = 500
BEGUN, REFITTED = 14, 6
NEIGHBOURS = 5.5  # coordinates
LEAST_GAIN = 0.02  # of cost, a block: less is not worth fitting
MOST_EFFECTS = 4
SUBTLE = 0.4  # of a size worth a name: how far off a robot's constants are expected to be without an effect
NO_SHIFT = np.zeros(1)
STEADY = (0, 1, 7)  # channels whose noise is white: encoders, reflection
CHI_SQUARE_MEDIAN = 0.455
MOST_COLOUR = 6.0  # noise that lingers for longer than a block, wholly
# Effects on whose landscape slopes mislead: slip, play, stiction, thresholds, an edge on the floor.
ROUGH = frozenset({"slippery_patch", "backlash", "static_friction", "dead_band", "tyre_friction"})
ROUGH_SHARE = 0.3  # of the best effect's gain: less is not worth the search
RESTARTS = 3
STUCK, STUCK_SPREAD = 1.5, 1.5  # structure a block that makes a fit doubtful; how far about it is then searched
_ROUGH_SPREAD = {
    "patch_radius": 1.5,
    "patch_x": 2.0,
    "patch_y": 2.0,
    "patch_friction": 0.5,
    "stribeck_speed": 0.7,
}


@dataclass(frozen=True)
class Model:
    """The robot with some effects fitted.

    Attributes
    ----------
    effects
        Identifiers, in the order they were taken.
    freedom, fit
        Their parameters.
    structure
        Energy of the residuals that averages over short blocks leave, above noise.
    shift
        What changes too small for a name explain, taken off the residuals; shape (n,) or (1,).
    """

    effects: tuple[str, ...]
    freedom: Freedom
    fit: Fit
    structure: float
    shift: Array = field(default_factory=lambda: np.zeros(1))

    @property
    def values(self) -> dict[str, dict[str, float]]:
        """Parameters' values as in a robot file."""
        return self.freedom.values(self.fit.z)

    @property
    def cost(self) -> float:
        """Robust cost of the whitened residuals."""
        return self.fit.cost


@dataclass(frozen=True)
class _Trial:
    """An effect's first fit, and the best places to search from."""

    effects: tuple[str, ...]
    freedom: Freedom
    fit: Fit
    places: tuple[Array, ...]
    promise: float
    base: Model

    @property
    def effect(self) -> str:
        return self.effects[-1]

    @property
    def values(self) -> dict[str, dict[str, float]]:
        return self.freedom.values(self.fit.z)


@dataclass(frozen=True)
class Step:
    """One effect tried on top of a model.

    Attributes
    ----------
    effect
        Its identifier.
    base, model
        The model without and with it, both rid of what changes too small for a name explain.
    gain
        What it lowers the cost by.
    left_out
        What it lowers the cost of left-out recordings by, one number a recording.
    null_95, p
        The null's 95 % quantile, and the share of nulls that gain as much.
    worthwhile
        Whether its size is worth a name.
    before, after
        Structure without and with it, by the same measure.
    """

    effect: str
    base: Model
    model: Model
    gain: float
    left_out: Array = field(default_factory=lambda: np.zeros(0))
    null_95: float = np.nan
    p: float = np.nan
    worthwhile: bool = False
    before: float = 0.0
    after: float = 0.0


class Selection:
    """Selects effects for one comparison.

    Parameters
    ----------
    comparison
        What is fitted.
    robot
        As far as it is known.
    catalogue
        Identifiers of the effects that may be found.
    recordings
        What is fitted on.
    seed
        Of the null's signs.
    tell
        Called with a line of progress.
    """

    def __init__(
        self,
        comparison: Comparison,
        robot: Robot,
        catalogue: Sequence[str],
        recordings: Sequence[Recording],
        seed: int = 0,
        tell: Callable[[str], None] = lambda line: None,  # noqa: ARG005
    ) -> None:
        self.comparison, self.robot, self.catalogue = comparison, robot, tuple(catalogue)
        self.recordings, self.tell = tuple(recordings), tell
        self._rng = np.random.default_rng(seed)
        comparison.errors(robot.physics)
        self.cells = comparison.cells
        self.clocked = False
        self.folds = _folds(self.cells)
        self.spans = _group(self.cells, SPAN_S)
        self._blocks = _group(self.cells, BLOCK_S)
        self.blocks = int(self._blocks.max()) + 1 if len(self._blocks) else 0
        self._block_count = np.bincount(self._blocks)
        self._block_channel = np.zeros(self.blocks, np.int64)
        self._block_channel[self._blocks] = self.cells.channel
        self.least_gain = LEAST_GAIN * self.blocks
        self._kept_slopes: tuple[Model | None, Array] = (None, np.zeros((0, 0)))
        self.bare = self._bare()

    def structure(self, errors: Array, colour: Array | None = None) -> float:
        """Return the energy short averages keep, above what noise of a colour would leave.

        Parameters
        ----------
        errors
            Whitened residuals.
        colour
            As `colour` returns it; default: that of these residuals.
        """
        if not len(errors):
            return 0.0
        energy = self._block_energy(errors)
        expected = (self.colour(errors) if colour is None else colour)[self._block_channel]
        return float(np.sum(energy / expected - 1.0))

    def colour(self, errors: Array) -> Array:
        """Return by how much slow noise exceeds white noise in each channel, shape (channels,); 1 for white.

        Sensors' noise lingers everywhere, also where the robot does nothing; what physics is missing shows here and
        there. So the typical block tells the noise. Encoders round, they do not linger; the colour sensor mostly sees
        an even floor, whose noise is clipped.
        """
        energy = self._block_energy(errors)
        out = np.ones(len(CHANNELS))
        for channel in np.unique(self._block_channel):
            if channel not in STEADY:
                typical = np.median(energy[self._block_channel == channel]) / CHI_SQUARE_MEDIAN
                out[channel] = np.clip(typical, 1.0, MOST_COLOUR)
        return out

    def _block_energy(self, errors: Array) -> Array:
        return np.bincount(self._blocks, np.clip(errors, -30.0, 30.0)) ** 2 / self._block_count

    def align(self, model: Model, gain: float) -> bool:
        """Set each camera's clock, if that explains more than the best effect's ``gain``; return whether it did.

        After that, a delay of the camera common to all recordings is no effect any more.
        """
        if self.clocked or self.comparison.sight:
            return False
        physics = model.freedom.physics(model.fit.z)
        offsets, least = fitted_offsets(self.comparison, lambda: self.comparison.errors(physics))
        standing = cost(self.comparison.errors(physics))
        if standing - least < max(0.8 * gain, self.least_gain) or not scattered(offsets):
            return False
        self.clocked = True
        self.comparison.set_offsets(offsets)
        self.catalogue = tuple(e for e in self.catalogue if e != "pose_delay")
        self.bare = self._bare()
        return True

    def _bare(self) -> Model:
        errors = self.comparison.errors(self.robot.physics)
        found = Fit(np.zeros(0), errors, np.zeros((len(errors), 0)), cost(errors))
        return Model((), free(self.robot, ()), found, self.structure(errors))

    def residual(self, freedom: Freedom, shift: Array = NO_SHIFT) -> Callable[[Array], Array]:
        """Return the function that fits minimise."""
        return lambda z: self.comparison.errors(freedom.physics(z)) - shift

    def refit(self, effects: Sequence[str], values: Effects, rounds: int = 10, shift: Array = NO_SHIFT) -> Model:
        """Fit all parameters of some effects together, from given values."""
        freedom = free(self.robot, effects)
        residual = self.residual(freedom, shift)
        found = fit(residual, freedom.vector(values), freedom.bounds, freedom.probes, rounds)
        return Model(tuple(effects), freedom, found, self.structure(found.errors), shift)

    def _shifts(self, model: Model) -> dict[str, Array]:
        """Return, for each effect, what all others explain by changes too small for a name, each of shape (n,).

        No simulation fits reality to the last digit. What an effect must explain is what such changes leave.
        """
        if self.comparison.sight:  # clipped readings do not add up
            return dict.fromkeys((*self.catalogue, ""), NO_SHIFT)
        raw = model.fit.errors + model.shift
        columns = dict(zip(self.catalogue, self.subtle_slopes(model), strict=True))
        w = weights(raw)
        owner = np.concatenate([[e] * g.shape[1] for e, g in columns.items()])
        g = np.concatenate(list(columns.values()), axis=1)
        normal, pull = g.T @ (w[:, None] * g), g.T @ (w * raw)
        out = {}
        for effect in (*self.catalogue, ""):
            rest = np.flatnonzero((owner != effect) & ~np.isin(owner, model.effects))
            ridge = np.eye(len(rest)) / SUBTLE**2
            sizes = np.linalg.solve(normal[np.ix_(rest, rest)] + ridge, pull[rest])
            out[effect] = g[:, rest] @ np.clip(sizes, -1.0, 1.0)
        return out

    def rid_of_subtle(self, model: Model) -> Model:
        """Return a model whose residuals are rid of what changes too small for a name explain."""
        shift = self._shifts(model)[""]
        return self._shifted(model, shift)

    def _shifted(self, model: Model, shift: Array) -> Model:
        errors = model.fit.errors + model.shift - shift
        found = Fit(model.fit.z, errors, model.fit.jacobian, cost(errors))
        return Model(model.effects, model.freedom, found, self.structure(errors), shift)

    def steps(self, model: Model) -> list[Step]:
        """Try every other effect on top of a model; the most promising are refitted in full. Best first."""
        shifts = self._shifts(model)
        others = [e for e in self.catalogue if e not in model.effects]
        bases = {e: self._shifted(model, shifts[e]) for e in others}
        rough = [t for t in (self._screen(bases[e], e) for e in others) if t]
        rough.sort(key=lambda t: -t.promise)
        if not rough or rough[0].promise < self.least_gain:
            return []
        begun = [self._begin(t) for t in rough[:BEGUN] if t.promise > 0.05 * rough[0].promise]
        begun.sort(key=lambda t: t.fit.cost)
        gains = [t.base.cost - t.fit.cost for t in begun]
        best = max(gains)
        done = []
        for trial, gain in list(zip(begun, gains, strict=True))[:REFITTED]:
            if gain < 0.02 * best:
                continue
            search = trial.effect in ROUGH and gain > ROUGH_SHARE * best and best > 0.05 * model.cost
            found = self._search(trial) if search else self.refit(trial.effects, trial.values, shift=trial.base.shift)
            if gain > ROUGH_SHARE * best and found.structure > STUCK * self.blocks:
                again = self.polished(found, STUCK_SPREAD)
                found = self.refit(again.effects, again.values, shift=again.shift) if again is not found else found
                found = found if found.cost < again.cost else again
            step = Step(trial.effect, trial.base, found, trial.base.cost - found.cost)
            colour = self.colour(found.fit.errors)
            before = self.structure(trial.base.fit.errors, colour)
            after = self.structure(found.fit.errors, colour)
            done.append(replace(step, worthwhile=worthwhile(found, trial.effect), before=before, after=after))
        return sorted(done, key=lambda s: -s.gain)

    def _screen(self, model: Model, effect: str) -> _Trial | None:
        """Score an effect without fitting it: by its slopes at the model, and by trying its starts."""
        freedom = free(self.robot, (*model.effects, effect))
        residual = self.residual(freedom, model.shift)
        places = [
            freedom.vector({**model.values, effect: v}) for v in starts(effect, self.robot, self.recordings)
        ]
        if not places:
            return None
        found = np.array([cost(residual(z)) for z in places])
        order = np.argsort(found)
        kept = _apart([places[k] for k in order], RESTARTS)
        here = freedom.vector(model.values)
        slopes = self._extra_slopes(model, freedom, here, residual)
        linear = self._linear_gain(model, slopes)
        promise = max(linear, model.cost - float(found[order[0]]))
        return _Trial((*model.effects, effect), freedom, Fit(kept[0], model.fit.errors, slopes, float(found[order[0]])),
                      kept, promise, model)  # fmt: skip

    def _extra_slopes(
        self, model: Model, freedom: Freedom, z: Array, residual: Callable[[Array], Array]
    ) -> Array:
        """Return how residuals feel the parameters a freedom has beyond a model's, shape (n, parameters)."""
        columns = []
        for k in range(len(model.fit.z), len(z)):
            moved = z.copy()
            step = (
                freedom.probes[k] if z[k] + freedom.probes[k] <= freedom.bounds[1][k] else -freedom.probes[k]
            )
            moved[k] += step
            columns.append((residual(moved) - model.fit.errors) / step)
        return np.stack(columns, axis=1)

    def _linear_gain(self, model: Model, slopes: Array) -> float:
        """Return the gain the slopes alone promise, beside the model's own parameters."""
        w = np.sqrt(weights(model.fit.errors))
        g = self._beside(model, slopes * w[:, None])
        if not g.shape[1]:
            return 0.0
        q = np.linalg.qr(g)[0]
        return 0.5 * float(np.sum((q.T @ (w * model.fit.errors)) ** 2))

    def _beside(self, model: Model, g: Array) -> Array:
        """Project a model's own parameters out of weighted slopes; what vanishes is dropped."""
        own = self.slopes(model) * np.sqrt(weights(model.fit.errors))[:, None]
        if own.shape[1]:
            basis = np.linalg.qr(own)[0]
            g = g - basis @ (basis.T @ g)
        kept: Array = g[:, np.sqrt(np.sum(g * g, axis=0)) > 1e-6]
        return kept

    def _begin(self, trial: _Trial) -> _Trial:
        """Improve an effect's best start by two rounds."""
        first = fit(
            self.residual(trial.freedom, trial.base.shift),
            trial.places[0],
            trial.freedom.bounds,
            trial.freedom.probes,
            rounds=2,
        )
        return replace(trial, fit=first)

    def _search(self, trial: _Trial) -> Model:
        """Fit an effect whose landscape is rough: from several starts without slopes, then with them."""
        model, freedom, residual = trial.base, trial.freedom, self.residual(trial.freedom, trial.base.shift)
        own = slice(len(model.fit.z), None)
        spread = np.array([_ROUGH_SPREAD.get(c.parameter.field, 1.0) for c in freedom.coordinates[own]])
        low, high = freedom.bounds

        def cost_of(tail: Array) -> float:
            return cost(residual(np.r_[model.fit.z, tail]))

        best, least = trial.fit.z, trial.fit.cost
        for place in (*trial.places, trial.fit.z):
            tail, found = rough_search(cost_of, place[own], spread, (low[own], high[own]), self._rng)
            if found < least:
                best, least = np.r_[model.fit.z, tail], found
        return self.polished(self.refit(trial.effects, freedom.values(best), shift=model.shift))

    def polished(self, model: Model, spread: float = 0.25) -> Model:
        """Search about a fit without slopes."""
        freedom, residual = model.freedom, self.residual(model.freedom, model.shift)
        wide = np.array([spread * _ROUGH_SPREAD.get(c.parameter.field, 1.0) for c in freedom.coordinates])
        z, least = rough_search(lambda at: cost(residual(at)), model.fit.z, wide, freedom.bounds, self._rng)
        if least >= model.cost:
            return model
        errors = residual(z)
        found = Fit(z, errors, model.fit.jacobian, cost(errors))
        return Model(model.effects, freedom, found, self.structure(errors), model.shift)

    def judged(self, step: Step) -> Step:
        """Judge a step by leaving out recordings, and against the null."""
        new = step.model
        left_out = self._left_out(new) if len(np.unique(self.folds)) > 1 else None
        before = np.bincount(self.folds, costs(step.base.fit.errors))
        gains = before - left_out if left_out is not None else np.array([step.gain])
        nulls = self.null(new)
        p = float((1 + np.sum(nulls >= gains.sum())) / (1 + len(nulls)))
        return replace(step, left_out=gains, null_95=float(np.quantile(nulls, 0.95)), p=p)

    def _left_out(self, model: Model) -> Array:
        """Return each fold's cost under parameters fitted without it (one Newton step back), shape (folds,)."""
        slopes, errors, z = self.slopes(model), model.fit.errors, model.fit.z
        w = weights(errors)
        out = np.zeros(int(self.folds.max()) + 1)
        normal = slopes.T @ (w[:, None] * slopes)
        ridge = 1e-6 * np.diag(np.maximum(np.diag(normal), 1e-9))
        for k in np.unique(self.folds):
            rows = self.folds == k
            part = slopes[rows].T @ (w[rows, None] * slopes[rows])
            pull = slopes[rows].T @ (w[rows] * errors[rows])
            without = np.clip(z + np.linalg.solve(normal - part + ridge, pull), *model.freedom.bounds)
            out[k] = float(np.sum(costs(self.residual(model.freedom, model.shift)(without)[rows])))
        return out

    def slopes(self, model: Model) -> Array:
        """Return a model's own slopes; the last model's are kept."""
        if self._kept_slopes[0] is not model:
            freedom, found = model.freedom, model.fit
            slopes = jacobian(
                self.residual(freedom, model.shift), found.z, found.errors, freedom.probes, freedom.bounds[1]
            )
            self._kept_slopes = (model, slopes)
        return self._kept_slopes[1]

    def null(self, model: Model) -> Array:
        """Return the largest gain any effect reaches where there is no cause, for many draws, shape (NULLS,)."""
        errors = model.fit.errors
        w = np.sqrt(weights(errors))
        spans = int(self.spans.max()) + 1
        signs = self._rng.choice((-1.0, 1.0), (NULLS, spans))
        best = np.zeros(NULLS)
        for effect in self.catalogue:
            if effect in model.effects:
                continue
            freedom = free(self.robot, (*model.effects, effect))
            slopes = self._extra_slopes(model, freedom, freedom.vector(model.values), self.residual(freedom, model.shift))
            g = self._beside(model, slopes * w[:, None])
            if g.shape[1]:
                q = np.linalg.qr(g)[0] * (w * errors)[:, None]
                score = np.stack([np.bincount(self.spans, column, spans) for column in q.T], axis=1)
                best = np.maximum(best, 0.5 * np.sum((signs @ score) ** 2, axis=1))
        return best

    def subtle_slopes(self, model: Model) -> list[Array]:
        """Return how residuals feel every size worth a name, a column each; what vanishes is left out."""
        out = []
        raw = model.fit.errors + model.shift
        for effect in self.catalogue:
            freedom = free(self.robot, (*(e for e in model.effects if e != effect), effect))
            z = freedom.vector(model.values)
            columns = []
            for k, c in enumerate(freedom.coordinates):
                if c.effect.id == effect and c.parameter.worthwhile > 0.0:
                    moved = z.copy()
                    step = 0.5 if moved[k] + 0.5 <= freedom.bounds[1][k] else -0.5
                    moved[k] += step
                    columns.append((self.residual(freedom)(moved) - raw) / step)
            out.append(np.stack(columns, axis=1) if columns else np.zeros((len(raw), 0)))
        return out


def _apart(places: Sequence[Array], count: int) -> tuple[Array, ...]:
    """Return the first few places that are no neighbours of each other."""
    kept: list[Array] = []
    for place in places:
        if len(kept) < count and all(np.max(np.abs(place - other)) > NEIGHBOURS for other in kept):
            kept.append(place)
    return tuple(kept)


def worthwhile(model: Model, effect: str) -> bool:
    """Whether an effect's size in a model is worth a name."""
    sizes = []
    for c, z in zip(model.freedom.coordinates, model.fit.z, strict=True):
        if c.effect.id == effect and (c.parameter.worthwhile > 0.0 or c.inverse):
            sizes.append(abs(z) >= (0.02 if c.inverse else 1.0))
    return any(sizes)


def _folds(cells: Cells) -> npt.NDArray[np.int32]:
    """Return what is left out together: recordings, or thirds of the time where there are too few."""
    if len(cells.recording) and cells.recording.max() >= 2:
        return cells.recording
    if not len(cells.t_s):
        return np.zeros(0, np.int32)
    third = np.minimum((3.0 * cells.t_s / max(cells.t_s.max(), 1e-9)).astype(np.int32), 2)
    return (3 * cells.recording + third).astype(np.int32)


def _group(cells: Cells, length_s: float) -> npt.NDArray[np.int64]:
    """Number the blocks of a length, by recording and channel."""
    if not len(cells.t_s):
        return np.zeros(0, np.int64)
    key = (cells.recording.astype(np.int64) * 16 + cells.channel) * 10_000_000 + (
        cells.t_s / length_s
    ).astype(np.int64)
    return np.unique(key, return_inverse=True)[1]
