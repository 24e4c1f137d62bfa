"""Goes on through impacts and modes of contact: what touches, what lasts, and until when."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Any

import numpy as np

from mechc.errors import ValueOutOfBoundsError
from mechc.native._codes import (
    CONTACT_INCONSISTENT,
    CONTACT_UNDECIDED,
    CONTACTS_TOO_MANY,
    FINISHED,
    RUNNING,
    STOPPED_BY_EVENT,
)
from mechc.simulation.chain import Chain
from mechc.simulation.contact.finder import ModeEnd, ModeFinder, ends_of_mode, states_left
from mechc.simulation.contact.impacts import after_impact
from mechc.simulation.contact.laws import Laws, Mask, contact_laws
from mechc.simulation.contact.manifold import ContactManifold, ContactRun, Forces
from mechc.simulation.contact.modes import (
    Inconsistent,
    Mode,
    Problem,
    State,
    TooManyContactsError,
    choices_of,
    decided,
    told,
)
from mechc.simulation.contact.place import EPS, Contacts, Place
from mechc.simulation.events.compiled import CompiledFinder, CompiledResets
from mechc.simulation.events.event import EventFinder, FunctionFailedError, Side, located
from mechc.simulation.events.expressions import compiler_of, rounding_of
from mechc.simulation.events.resets import CHANGE, FLIGHT, SHORTEST, TOUCHING, Resets
from mechc.simulation.events.stops import StopReset
from mechc.simulation.initialise import begin
from mechc.simulation.settings import Policy
from mechc.system.parameters import Array
from mechc.system.system import System

SLOW = 1e-9  # of the fastest met: a gap, or a slip, whose rate is so small rests
FEW = 4.0  # times the shortest flight that is told from none
NEAR_START = 1e-6  # of the largest scale: a gap so small at the start is looked at
MOST_CHANGES = 40  # of the mode at one instant


class ContactResets(CompiledResets):
    """:class:`Resets` of a run with contacts.

    Until a contact lasts, impacts without friction are those of compiled code where events are
    compiled.  From then on contacts are followed from mode to mode here.
    """

    def __init__(
        self, system: System, values: Array, policy: Policy, t_end: float, chain: Chain,
        finder: EventFinder,
    ) -> None:  # fmt: skip
        self.compiler = compiler_of(finder.events)
        self.laws = Laws(contact_laws(finder.events), system, values, self.compiler)
        start = chain.t
        self.contacts = Contacts(self.laws, system, values, (start, t_end))
        self.numbers_of = [law.number for law in self.laws.laws]
        self.mode: Mode = (State.OPEN,) * len(self.laws)
        self.lasting = not isinstance(finder, CompiledFinder)
        self.fastest_gap, self.fastest_slip = np.zeros((2, len(self.laws)))
        self.speeds_met = np.zeros(len(system.speeds))
        self.changed_at, self.changes = np.nan, 0
        self.until = t_end  # no piece in contact crosses the kinks of inputs
        super().__init__(system, values, policy, t_end, chain, finder)

    def take_values(self, values: Array) -> None:
        super().take_values(values)
        events = self.finder.every if self.lasting else self.finder.events
        self.laws = Laws(contact_laws(events), self.system, values, self.compiler)
        contacts = self.contacts
        self.contacts = Contacts(self.laws, contacts.system, values, contacts.span)

    def begin(self) -> int:
        times, states = self.chain.last.steps.tail(1)
        t, y = float(times[-1]), states[-1]
        self._refuse_overlap(t, y)
        if not self.lasting and (not self._may_rest(t, y) or self._is_free(t, y)):
            return RUNNING
        self._watch_modes()
        self._see_until_kink(t, y)
        return self._enter(t, y, first=True)

    def _refuse_overlap(self, t: float, y: Array) -> None:
        overlap = self._overlap(t, y)
        if overlap:
            raise ValueOutOfBoundsError(
                f"{overlap} at the start, so the parts overlap: a gap is positive where they are "
                "apart"
            )

    def _overlap(self, t: float, y: Array) -> str:
        """A gap that is not one, in words; "" where there is none."""
        events = getattr(self.finder, "every", self.finder.events)
        gaps = [events[number].function for number in self.numbers_of]
        found = np.array([gap(t, y) for gap in gaps])  # 1 of what has none
        overlaps = found < 0.0
        if overlaps.any():
            overlaps &= found < -self._zero_gaps(self.contacts.place(t, y))
        words = (
            f"event {self.numbers_of[k]}: the gap {gaps[k].title} is {found[k]:.6g}"
            for k in np.flatnonzero(overlaps)
        )
        return next(words, "")

    def _is_free(self, t: float, y: Array) -> bool:
        """Whether a run may begin in compiled code: what touches opens."""
        place = self.contacts.place(t, y)
        slow, _ = self._slow(place)
        return not (self._touching(place, ()) & (place.numbers.rate <= slow)).any()

    def _see_until_kink(self, t: float, y: Array) -> None:
        """Take the inputs as they are from here to their next kink; controllers whose instant has
        come are called at the state y."""
        driven = self.system.driven
        if driven is not None:
            driven.reach(t, y)
            if driven.failed:
                raise FunctionFailedError(driven.failure_in_words())
            self.until = next(iter(driven.breaks(t, self.t_end, self.policy.rtol)), self.t_end)
            system = self.system.replaced_scene(driven.between(t, self.until))
            self.contacts = Contacts(self.laws, system, self.values, (t, self.until))

    def _may_rest(self, t: float, y: Array) -> bool:
        least = NEAR_START * float(self.system.scale(self.values).max(initial=0.0))
        gaps = [law.number for law in self.laws.laws if law.gap is not None]
        return any(abs(self._value(t, y, number)) <= least for number in gaps)

    def _watch_modes(self) -> None:
        """From here on the modes are followed."""
        self.lasting = True
        self.finder: Any = ModeFinder(self.finder)
        self.numbers = [
            number for number in self.numbers
            if not isinstance(self.finder.every[number].reset, StopReset)
        ]  # fmt: skip

    # -- events ---------------------------------------------------------------------------------

    def takes(self, number: int) -> bool:
        return (self.lasting and number >= self.finder.own) or super().takes(number)

    def after(self, t: float, number: int) -> int:
        if not self.lasting:
            return super().after(t, number)
        before = self._stop_at(t)
        self._see_until_kink(t, before)
        if number >= self.finder.own:
            return self._end_mode(t, before, self.finder.ends[number - self.finder.own])
        if number in self.numbers_of:
            k = self.numbers_of.index(number)
            return self._enter(t, before, hit={k}, causes=(number,))
        state, accumulate = Resets._reset(self, t, before, number)
        if accumulate:
            return Resets._go_on(self, t, number, state, accumulate)
        return self._go_on_anew(t, number, state)

    def _go_on_anew(self, t: float, number: int, state: Array) -> int:
        """After a reset, which may have moved what was in contact apart, or into each other."""
        overlap = self._overlap(t, state)
        if overlap:
            raise FunctionFailedError(
                f"after the reset of event {number} at t = {t:.9g} s {overlap}, so the parts "
                "overlap"
            )
        self.mode = (State.OPEN,) * len(self.laws)  # what still touches is seen by its gap
        return self._enter(t, state, causes=tuple(self.caused_by), reset=True)

    def finished(self) -> int:
        t = self.chain.t
        if t == self.t_end:
            return FINISHED
        before = self._stop_at(t)
        self._see_until_kink(t, before)
        return self._enter(t, before, still=set(self._stuck()))

    def _go_on(self, t: float, number: int, state: Array, accumulate: bool) -> int:
        """Contact instead of ever more impacts."""
        stops = [n for n in self.caused_by if n in self.numbers_of]
        if self.lasting or not (accumulate and stops):
            return super()._go_on(t, number, state, accumulate)
        self._watch_modes()
        self._see_until_kink(t, state)
        hit = {self.numbers_of.index(n) for n in stops}
        return self._enter(t, state, hit=hit, causes=tuple(self.caused_by), noted=True)

    def _end_mode(self, t: float, before: Array, end: ModeEnd) -> int:
        k = end.contact
        if end.kind == "paradox":
            return CONTACT_INCONSISTENT
        if end.kind == "negative":
            raise FunctionFailedError(
                f"the friction of event {self.numbers_of[k]} is negative from t = {t:.9g} s on, "
                "and would push: write the force that presses as one that is not negative, "
                "Abs(N), or Max(N, 0) of SymPy"
            )
        if end.kind == "clear":
            code = self._continue(t, before, self.mode, jump=False)
            number = self.numbers_of[k]
            self.finder.cleared = {number: self._value(t, before, number)}
            return code
        if k >= 0 and not self.laws.has_gap[k]:
            self.finder.add(self.numbers_of[k], t, before)
        still = {k} if end.kind == "halt" else set()
        hit = {k} if end.kind == "back" else set()
        if hit:
            self.last[self.numbers_of[k]] = t  # it has come from rest, and goes back to it
        return self._enter(t, before, hit=hit, still=still, left=states_left(end))

    # -- modes ----------------------------------------------------------------------------------

    def _enter(
        self, t: float, y: Array, *, hit: Collection[int] = (), still: Collection[int] = (),
        left: Collection[tuple[int, State]] = (), causes: tuple[int, ...] = (),
        first: bool = False, noted: bool = False, reset: bool = False,
    ) -> int:  # fmt: skip
        """Go on from a state, after the impacts there, in the mode that follows.

        ``hit``: contacts whose gaps have just closed, and rest where they did so just before;
        ``still``: whose slip has just come to 0; ``left``: states that have come to their
        limits; ``noted``: the impacts are recorded; ``reset``: the state is not the one that the
        last mode has led to.
        """
        self.changes = self.changes + 1 if self._is_soon(t) else 0
        self.changed_at = t
        if self.changes > MOST_CHANGES:
            return CONTACT_UNDECIDED
        self.speeds_met = np.maximum(self.speeds_met, np.abs(y[self.contacts.split :]))
        again = self._again(t, y, hit)
        self.last |= dict.fromkeys((self.numbers_of[k] for k in hit), t)
        try:
            struck, more = self._struck(t, y, hit, again, noted)
            still = set() if more or reset else {*still, *self._stuck()}
            mode, leaving, rests = self._decided(t, struck, hit, still, left, again)
        except Inconsistent as error:
            return CONTACT_UNDECIDED if error.several else CONTACT_INCONSISTENT
        except TooManyContactsError:
            return CONTACTS_TOO_MANY
        except np.linalg.LinAlgError:
            raise FunctionFailedError(
                f"at t = {t:.9g} s the mass matrix is not positive definite: contacts need that"
            ) from None
        code, state = ContactManifold(self.contacts, mode).settled(t, struck)
        if code != RUNNING:
            return int(code)
        given = (*causes, *(n for n in more if n not in causes))
        return self._continue(t, state, mode, given, leaving, rests, first=first)

    def _again(self, t: float, y: Array, hit: Collection[int]) -> set[int]:
        """Those of the contacts that were hit just before."""
        if not hit:
            return set()
        place = self.contacts.place(t, y)
        rates, rounding = place.numbers.rate, place.rounding
        return {
            k for k in hit
            if self._is_now(self.last, self.numbers_of[k], t, float(rates[k]), float(rounding[k]))
        }  # fmt: skip

    def _stuck(self) -> Iterator[int]:
        """Contacts that have no slip by the mode that has been, whatever its rounding."""
        return (k for k, state in enumerate(self.mode) if state is State.STICKS)

    def _is_soon(self, t: float) -> bool:
        return bool(abs(t - self.changed_at) <= SHORTEST * located(t))

    def _zero_gaps(self, place: Place) -> Array:
        """What gaps (n,) may be where they are 0 as far as the motion is known."""
        scale = self.system.scale(self.values)[: self.contacts.split]
        met = np.array([self.finder.sizes[number] for number in self.numbers_of])
        slopes, q = np.abs(place.numbers.slopes), np.abs(place.y[: len(scale)])
        rtol, atol = self.policy.rtol, self.policy.atol
        asked = rtol * scale if atol is None else atol[: len(scale)] + rtol * q
        allowed = np.maximum(rtol * met, slopes @ asked)
        return np.asarray(TOUCHING * (allowed + place.rounding))

    def _touching(self, place: Place, hit: Collection[int]) -> Mask:
        touching: Mask = np.abs(place.numbers.gap) <= self._zero_gaps(place)
        touching[list(hit)] = True
        touching |= np.array(self.mode) != State.OPEN
        found: Mask = touching & self.laws.has_gap
        return found

    def _slow(self, place: Place) -> tuple[Array, Array]:
        """Rates of gaps and of slips (n,) that are 0 as far as the motion is known: next to the
        fastest met, and where the next flight is too short to be told from none."""
        numbers, speeds = place.numbers, np.abs(place.y[self.contacts.split :])
        gaps, slips = (64 * EPS * (np.abs(rows) @ speeds)
                       for rows in (self._gap_rows(place), numbers.rows))  # fmt: skip
        fall = FEW * np.abs(place.free.normal)
        flight = np.maximum(SHORTEST * located(place.t) * fall,
                            np.sqrt(0.5 * FLIGHT * place.rounding * fall))  # fmt: skip
        gaps = np.maximum(gaps, np.maximum(SLOW * self.fastest_gap, flight))
        return gaps, np.maximum(slips, SLOW * self.fastest_slip)

    def _gap_rows(self, place: Place) -> Array:
        slopes = place.numbers.slopes
        return slopes if place.kinematic is None else slopes @ place.kinematic

    def _struck(
        self, t: float, y: Array, hit: Collection[int], again: Collection[int], noted: bool
    ) -> tuple[Array, list[int]]:
        """The state after the impacts at this instant; the events that they are."""
        place = self.contacts.place(t, y)
        numbers, touching = place.numbers, self._touching(place, hit)
        self.fastest_gap = np.maximum(self.fastest_gap, np.abs(numbers.rate) * touching)
        self.fastest_slip = np.maximum(self.fastest_slip, np.abs(numbers.slip))
        slow, _ = self._slow(place)
        closing = touching & (numbers.rate < -slow)
        if not closing.any():
            return y, []
        kept = numbers.restitution.copy()
        kept[list(again)] = 0.0
        laws = self.laws
        impact = after_impact(place, touching, kept, laws.has_friction, laws.poisson)
        after = y.copy()
        after[self.contacts.split :] += place.speeds(impact.change)
        struck = [self.numbers_of[k] for k in np.flatnonzero(impact.struck)]
        if impact.kept < 1.0:
            self.finder.lowered.append((t, impact.kept))
        for number in struck:
            self.last[number] = t
            if not noted and self.numbers_of.index(number) not in hit:
                self.finder.add(number, t, y)
        return after, struck

    def _decided(
        self, t: float, y: Array, hit: Collection[int], still: Collection[int],
        left: Collection[tuple[int, State]], again: Collection[int] = (),
    ) -> tuple[Mode, Mask, Mask]:  # fmt: skip
        """The mode at a state after its impacts, the gaps that open from rest (n,), and contacts
        without slip (n,)."""
        laws, place = self.laws, self.contacts.place(t, y)
        slow, slow_slip = self._slow(place)
        settled = np.abs(place.numbers.rate) <= slow
        settled[list(again)] = True
        closed = self._touching(place, hit) & settled
        rests = np.abs(place.numbers.slip) <= slow_slip
        rests[list(still)] = True
        rests &= laws.has_friction & (closed | ~laws.has_gap)
        choices = choices_of(closed, rests, place.numbers.slip, laws.has_gap, laws.has_friction)
        problem = Problem.of_forces(place, place.free, laws.has_gap)
        answer = decided(problem, choices, closed, rests, left)
        leaving = closed & (np.array(answer.mode) == State.OPEN)
        return answer.mode, leaving, rests

    # -- pieces ---------------------------------------------------------------------------------

    def _continue(
        self, t: float, y: Array, mode: Mode, causes: tuple[int, ...] = (),
        leaving: Mask | None = None, still: Mask | None = None, *, jump: bool = True,
        first: bool = False,
    ) -> int:  # fmt: skip
        """A new piece from a state on its mode's constraints."""
        ends = any(self._is_last(number) for number in causes)
        left = RUNNING if first else self._shorten()
        self.mode = mode
        t_end = t if ends else self.t_end
        manifold = ContactManifold(self.contacts, mode)
        lasts = any(state is not State.OPEN for state in mode)
        piece: Any
        if lasts:
            span = t, min(t_end, self.until)
            piece = ContactRun(manifold, span, y, self.policy, self.speeds_met)
        else:
            piece = begin(self.system, (t, t_end), y, self.values, self.policy)
        words = told(mode, self.numbers_of, self.finder.own)
        if first:
            self.chain.replace_last(piece, words)
        else:
            self.chain.add(piece, self.values, jumps=jump, causes=causes, contacts=words)
        self._watch(piece, manifold, t, y, leaving, still)
        return STOPPED_BY_EVENT if ends else left

    def _watch(
        self, piece: Any, manifold: ContactManifold, t: float, y: Array, leaving: Mask | None,
        still: Mask | None,
    ) -> None:  # fmt: skip
        """Look for the events of the run and the ends of its mode."""
        none = np.zeros(len(self.laws), bool)
        leaving = none if leaving is None else leaving
        forces = Forces(manifold)
        ends = ends_of_mode(forces, t, y, none if still is None else still)
        place = self.contacts.place(t, y)
        zero = self._zero_gaps(place)
        for k in np.flatnonzero(leaving):
            ends += self._clear_of(int(k), float(zero[k]))
        idle = {self.numbers_of[k] for k in np.flatnonzero(manifold.closed | leaving)}
        rates = self._user_rates(t, y, manifold, place)
        sides = [
            Side() if number in idle else self._side(t, y, number, rate)
            for number, rate in enumerate(rates)
        ]
        for number in self.numbers_of:
            if self.last.get(number) == t:
                self.rate_after[number] = rates[number]
        self.finder.enter_mode(piece, ends, idle, sides)

    def _clear_of(self, k: int, zero: float) -> list[ModeEnd]:
        """Until a gap that opens from rest is open by more than the motion is known to."""
        gap = self.finder.every[self.numbers_of[k]].function
        return [
            ModeEnd("clear", k, lambda t, y: zero - gap(t, y)),
            ModeEnd("back", k, lambda t, y: zero + gap(t, y)),
        ]

    def _user_rates(
        self, t: float, y: Array, manifold: ContactManifold, place: Place
    ) -> list[float]:
        """Rates of the run's events along the motion in a mode; 0 of those without a reset."""
        found = [0.0] * self.finder.own
        for k, number in enumerate(self.numbers_of):
            found[number] = float(place.numbers.rate[k])
        if not self.numbers:
            return found
        rates = manifold.rates(t, y)
        size = np.abs(y) + self.system.scale(self.values)
        step = CHANGE / max(float((np.abs(rates) / size).max()), 1.0)
        for number in self.numbers:
            ahead, behind = (self._value(t + s, y + s * rates, number) for s in (step, -step))
            found[number] = self.sense * (ahead - behind) / (2.0 * step)
        return found

    def _rates_of_events(self, t: float, state: Array) -> Array:
        if not self.lasting:
            return super()._rates_of_events(t, state)
        manifold = ContactManifold(self.contacts, self.mode)
        return np.array(self._user_rates(t, state, manifold, self.contacts.place(t, state)))

    def _rounding(self, t: float, state: Array, number: int) -> float:
        events = self.finder.every if self.lasting else self.finder.events
        return rounding_of(events[number].function, t, state)

    def _value(self, t: float, state: Array, number: int) -> float:
        """Of a run's event, as it is given."""
        events = self.finder.every if self.lasting else self.finder.events
        return float(events[number].function(t, state))
