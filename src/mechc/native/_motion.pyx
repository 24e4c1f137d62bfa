# cython: language_level=3, boundscheck=False, wraparound=False, initializedcheck=False
"""Motions of compiled scenes: the driver in C, asked in parts, without the GIL."""

import numpy as np

from cpython.exc cimport PyErr_CheckSignals
from libc.math cimport INFINITY, isnan
from libc.string cimport memcmp, memcpy

from mechc.native._abi cimport (
    MECHC_INTERRUPTED, MECHC_PART_DRIVER, MECHC_PART_EXPLICIT, MECHC_PART_OUTPUTS, MECHC_RUNNING,
    mechc_options, mechc_part_of_method, mechc_trajectory
)
from mechc.native._codes import CHANGE_POINT_POLICIES, METHODS
from mechc.native._driver cimport Scene
from mechc.native._events cimport Events
from mechc.native._hybrid cimport (
    MECHC_NO_LAW, MECHC_NO_MASS, MECHC_NO_RESTITUTION, MECHC_PUSHES, mechc_hybrid,
    mechc_hybrid_advance, mechc_hybrid_back, mechc_hybrid_begin, mechc_hybrid_end, mechc_hybrid_free,
    mechc_hybrid_make, mechc_hybrid_stats, mechc_keep_last, mechc_piece, mechc_reach_time,
    mechc_reach_from, mechc_reach_restore, mechc_reach_save, mechc_reach_saved_size, mechc_reacher, mechc_sizes
)
from mechc.native._inputs cimport Inputs, array_of
from mechc.native._pieces cimport LOOK, next_piece, seconds_now, with_stack
from mechc.native._steps cimport Sizes, steps_of


ctypedef struct advancing:
    mechc_hybrid *hybrid
    const mechc_options *options
    long left
    ptrdiff_t piece

ctypedef struct reaching:
    mechc_reacher *reacher
    double t
    int changed, status


cdef void begin_motion(void *given) noexcept nogil:
    cdef advancing *job = <advancing *>given
    mechc_hybrid_begin(job.hybrid, job.options)


cdef void advance_a_while(void *given) noexcept nogil:
    cdef advancing *job = <advancing *>given
    cdef double started = seconds_now(), now = started, before
    cdef long some
    while (job.hybrid.status == MECHC_RUNNING and job.hybrid.run.wanted < 0 and job.left > 0
           and now - started < LOOK):
        some, before = min(job.piece, job.left), now
        mechc_hybrid_advance(job.hybrid, some)
        job.left -= some
        now = seconds_now()
        job.piece = next_piece(job.piece, now - before)


cdef void reach_time(void *given) noexcept nogil:
    cdef reaching *job = <reaching *>given
    job.status = mechc_reach_time(job.reacher, job.t, job.changed)


cdef void call_due(void *given, double t, const double *y) noexcept with gil:
    cdef Request request = <Request>given
    request.due(t, array_of(y, request.scene.width))


cdef class Request:
    """The request for motions of a scene: policy, parameters, inputs and events.

    policy
        A :class:`mechc.simulation.settings.Policy`.
    p : (np,)
        The parameters at the start.
    inputs, kinks, due
        Where the scene has inputs: these over the whole span, the times within it that no step may
        cross, in its direction, and a function of t and y that is called at the start and there, or
        None.
    """

    def __init__(self, Scene scene, Sizes sizes, policy, p, Inputs inputs=None, kinks=None, due=None,
                 Events events=None):
        cdef mechc_options *options = &self.options
        cdef const double[::1] tolerances, times, longest, parameters = p
        cdef int parts, method = METHODS[policy.method]
        if parameters.shape[0] != scene.parameters:
            raise ValueError("wrong number of parameters")
        self.sizes, self.inputs, self.events = sizes, inputs, events
        self.p, self.due = p.copy(), due
        parts = MECHC_PART_DRIVER | mechc_part_of_method(method)
        if events is not None:
            parts |= MECHC_PART_OUTPUTS | (MECHC_PART_EXPLICIT if events.laws.count else 0)
        self.asked, self.parts = scene, parts
        self.scene = scene = scene.at_once(parts)
        parameters = self.p
        options.p = &parameters[0] if scene.parameters else NULL
        options.rtol, options.atol = policy.rtol, NULL
        if policy.atol is not None:
            tolerances = policy.atol
            options.atol = &tolerances[0]
        options.first_step, options.max_step = policy.first_step, policy.max_step
        options.max_steps, options.method, options.dense = policy.max_steps, method, policy.dense
        options.on_change_point = CHANGE_POINT_POLICIES[policy.on_change_point]
        options.when_stiff = METHODS[policy.when_stiff] if policy.when_stiff else 0
        options.methods = scene.unit.methods
        if policy.limits is not None:
            times, longest = policy.limits
            if times.shape[0] != longest.shape[0] + 1:
                raise ValueError("limits need one time more than steps")
            self.limits.count = longest.shape[0]
            if self.limits.count:
                self.limits.times, self.limits.longest = &times[0], &longest[0]
                options.limits = &self.limits
        self.references = policy.atol, policy.limits, kinks
        if inputs is not None:
            self.take_inputs(inputs, kinks)

    @property
    def is_latest(self):
        """Whether no faster functions of the scene have been compiled since."""
        return self.asked.at_once(self.parts) is self.scene

    cdef take_inputs(self, Inputs inputs, const double[::1] kinks):
        cdef mechc_given_inputs *given = &self.given
        given.driven, given.signals, given.knots = &inputs.driven, inputs.signals, inputs.knots
        given.signal_count, given.source_count = inputs.signal_count, inputs.source_count
        given.kink_count = kinks.shape[0]
        if kinks.shape[0]:
            given.kinks = &kinks[0]
        if self.due is not None:
            given.due, given.context = call_due, <void *>self

    cdef describe(self, mechc_hybrid *hybrid):
        """The scene, its inputs and contacts, before room is made."""
        hybrid.motion.unit = self.scene.unit
        hybrid.motion.coordinates, hybrid.motion.speeds = self.scene.coordinates, self.scene.speeds
        hybrid.motion.rows, hybrid.motion.parameters = self.scene.rows, self.scene.parameters
        hybrid.motion.sizes = self.sizes.sizes
        if self.inputs is not None:
            hybrid.given = &self.given
        if self.events is not None:
            hybrid.contacts.laws = self.events.laws
        if not mechc_hybrid_make(hybrid, 0 if self.events is None else self.events.count):
            raise MemoryError()
        if self.events is not None:
            self.give_events(hybrid)

    cdef give_events(self, mechc_hybrid *hybrid):
        cdef Events events = self.events
        memcpy(hybrid.watch.functions, events.functions,
               events.count * sizeof(events.functions[0]))
        memcpy(hybrid.watch.policy, events.policy, events.count * sizeof(events.policy[0]))


cdef class Advanced:
    """A motion that the driver in C advances, and why it failed.

    Attributes
    ----------
    request
        What is asked of it.
    """

    cdef mechc_hybrid *driver
    cdef readonly Request request
    cdef long counted  # evaluations

    cdef bint load_wanted(self) except -1:
        """Count the work of a run, and load the code of a method that it has changed to."""
        cdef Scene scene = self.request.scene
        cdef long evaluations = mechc_hybrid_stats(self.driver).rhs_evaluations
        scene.worked += evaluations - self.counted
        self.counted = evaluations
        if self.driver.live and self.driver.run.wanted >= 0:
            scene.need(mechc_part_of_method(self.driver.run.wanted))
            self.driver.run.wanted = -1
            return True
        return False

    @property
    def overlap(self):
        """The contact whose parts overlap, and its gap; None: none do."""
        if not self.driver.contacts.laws.count or self.driver.contacts.overlaps < 0:
            return None
        return self.driver.contacts.overlaps, self.driver.contacts.overlap

    @property
    def contact_failure(self):
        """The failure of contacts in words, "" for none, and the number of the contact, or -1."""
        if not self.driver.contacts.laws.count or not self.driver.contacts.why:
            return "", -1
        words = {
            MECHC_NO_LAW: "no law", MECHC_NO_MASS: "no mass", MECHC_PUSHES: "negative",
            MECHC_NO_RESTITUTION: "restitution",
        }
        return words[self.driver.contacts.why], self.driver.contacts.place.failed

    @property
    def failed_event(self):
        """The event whose value was no number; None: a reset failed."""
        return self.driver.watch.stopped_by if self.driver.live else None

    @property
    def last_causes(self):
        """The events that the last change of the state was made by."""
        return [self.driver.watch.cause[k] for k in range(self.driver.watch.causes)]

    @property
    def beyond_bounds(self):
        """The parameters that the last reset gave values beyond their bounds."""
        cdef const double *values = self.driver.watch.reset + self.request.scene.width
        cdef const mechc_sizes *sizes = &self.driver.motion.sizes
        cdef int i
        return [i for i in range(self.request.scene.parameters) if sizes.lowest != NULL
                and not sizes.lowest[i] <= values[i] <= sizes.highest[i]]

    @property
    def stopped_at(self):
        """The time of the event at which the motion failed."""
        return self.driver.stop


cdef class Motion(Advanced):
    """A motion under way or finished, from the state y0 (nq + nu,) at t0 to t1.

    Attributes
    ----------
    request
        What is asked of it.
    """

    cdef mechc_hybrid hybrid
    cdef int stop  # set to give up a step of a wide scene
    cdef ptrdiff_t piece  # attempted steps until the next check of the clock

    def __init__(self, Request request, double t0, double t1, const double[::1] y0,
                 double max_bytes=INFINITY):
        cdef mechc_options options = request.options
        cdef size_t stack = request.scene.stack_here()
        cdef advancing job
        self.driver = &self.hybrid
        self.request, self.piece = request, 1
        if y0.shape[0] != request.scene.width:
            raise ValueError("wrong number of state components")
        self.hybrid.keeps, self.hybrid.max_bytes = 1, max_bytes
        self.hybrid.watch.keeps_states = 1
        request.describe(&self.hybrid)
        options.t0, options.t1, options.y0, options.stop = t0, t1, &y0[0], &self.stop
        job.hybrid, job.options = &self.hybrid, &options
        if stack:
            with_stack(stack, begin_motion, &job, &self.stop)
        else:
            begin_motion(&job)  # of a small scene it takes less time than giving up the GIL
        if not self.hybrid.pieces:
            raise MemoryError("no memory for the start of a run")

    def __dealloc__(self):
        mechc_hybrid_free(&self.hybrid)

    def advance(self, long steps):
        """Attempt at most `steps` further steps, and no more than fit into a moment.

        Returns the status code.  A pending signal (Ctrl-C) is raised as its handler says; the motion
        stays usable.
        """
        cdef advancing job
        job.hybrid, job.left, job.piece = &self.hybrid, steps, self.piece
        try:
            with_stack(self.request.scene.stack_here(), advance_a_while, &job, &self.stop)
        finally:
            if self.stop and self.hybrid.status == MECHC_INTERRUPTED:
                self.hybrid.status = self.hybrid.run.status = MECHC_RUNNING  # from the last state
            self.stop = 0
        self.piece = job.piece
        self.load_wanted()
        PyErr_CheckSignals()
        return self.hybrid.status

    @property
    def status(self):
        return self.hybrid.status

    @property
    def t(self):
        """Time reached."""
        return self.end()[0]

    def end(self):
        """The last time, and the state there (width,)."""
        y = np.empty(self.request.scene.width)
        cdef double[::1] state = y
        if not self.hybrid.pieces:
            raise ValueError("the motion has not begun")
        return mechc_hybrid_end(&self.hybrid, &state[0]), y

    def stats(self):
        """Counters and the least conditioning met."""
        return mechc_hybrid_stats(&self.hybrid)  # the struct as a dict, by the names of its fields

    @property
    def pieces(self):
        """The pieces: of each its steps, its parameters (np,), the same array where they are those of the one
        before, whether the state jumps at its start,
        the events whose resets made that jump, its contacts' states, and its cut or None."""
        cdef mechc_piece *piece
        cdef int i, k, parameters = self.request.scene.parameters
        found, p = [], None
        for i in range(self.hybrid.pieces):
            piece = self.hybrid.piece[i]
            causes = tuple([piece.cause[k] for k in range(piece.causes)])
            contacts = tuple([piece.contact[k] for k in range(piece.contacts)])
            if not i or memcmp(piece.p, self.hybrid.piece[i - 1].p, parameters * sizeof(double)):
                p = array_of(piece.p, parameters)
            cut = None if isnan(piece.cut) else piece.cut
            steps = steps_of(self.request.scene, piece, p, self.request.inputs,
                             self.request.events, self.request.sizes)
            found.append((steps, p, bool(piece.jumps), causes, contacts, cut))
        return found

    def zeros(self):
        """The events found: their numbers (n,), times (n,) and states (n, nq + nu)."""
        cdef ptrdiff_t count = self.hybrid.watch.zeros, i
        cdef int width = self.request.scene.width
        numbers, times = np.empty(count, np.intp), np.empty(count)
        cdef Py_ssize_t[::1] of_events = numbers
        cdef double[::1] at = times
        for i in range(count):
            of_events[i], at[i] = self.hybrid.watch.zero[i].event, self.hybrid.watch.zero[i].t
        return numbers, times, array_of(self.hybrid.watch.zero_state, count * width).reshape(count, width)

    def notes(self):
        """Notes for warnings: of each event the first time at which it may only touch zero, and the one
        from which it changes too fast to follow, or NaN; the number of impacts at which less than the
        whole restitution counted, the first of them, and what counted there."""
        touched = [(self.hybrid.watch.event[k].grazing, self.hybrid.watch.event[k].too_fast)
                   for k in range(self.hybrid.watch.own)]
        contacts = &self.hybrid.contacts
        return touched, (contacts.lowered, contacts.lowered_at, contacts.lowered_to)

    # -- in place of its steps checkpoints ----------------------------------------------------------

    @property
    def count(self):
        """Number of accepted states of the last piece that are kept."""
        return self.hybrid.run.trajectory.count

    @property
    def bytes_a_step(self):
        """The bytes that a step takes in the record."""
        cdef const mechc_trajectory *record = &self.hybrid.run.trajectory
        return sizeof(double) * (1 + record.width * (1 + record.dense_rows))

    @property
    def steps(self):
        """The steps of the last piece that are kept."""
        return steps_of(self.request.scene, self.hybrid.piece[self.hybrid.pieces - 1],
                        self.request.p, self.request.inputs, None, self.request.sizes)

    def keep_last(self):
        """Keep only the last state of the steps, such that the run goes on as if it kept all."""
        mechc_keep_last(&self.hybrid.run.trajectory)
        self.hybrid.run.trajectory.crossing_count = 0

    def checkpoint(self):
        """A copy of the state of the motion, from which :meth:`back_to` goes on."""
        cdef mechc_trajectory *record = &self.hybrid.run.trajectory
        saved = np.empty(self.hybrid.motion.unit.saved_size(self.hybrid.run), dtype=np.uint8)
        cdef unsigned char[::1] to = saved
        self.hybrid.motion.unit.save(self.hybrid.run, &to[0])
        dropped = record.dropped[0], record.dropped[1], record.dropped_count
        return saved, dropped, self.hybrid.inputs.segment

    def back_to(self, checkpoint):
        """Go back to a checkpoint of this motion; its record then begins with the state there."""
        cdef mechc_trajectory *record = &self.hybrid.run.trajectory
        saved, dropped, segment = checkpoint
        cdef const unsigned char[::1] kept = saved
        self.hybrid.motion.unit.restore(self.hybrid.run, &kept[0])
        mechc_keep_last(record)
        record.crossing_count = 0
        record.dropped[0], record.dropped[1], record.dropped_count = dropped
        mechc_hybrid_back(&self.hybrid, segment)


cdef class Stepping(Advanced):
    """A motion that advances to one requested time after another and keeps no record.

    ahead
        Whether runs go beyond the times that are asked for.
    """

    cdef mechc_reacher reacher
    cdef object y
    cdef int stop

    def __init__(self, Request request, double t, const double[::1] y0, bint ahead):
        cdef double[::1] state = np.array(y0)
        self.driver = &self.reacher.hybrid
        self.request, self.y = request, np.asarray(state)
        self.reacher.hybrid.max_bytes = INFINITY
        request.describe(&self.reacher.hybrid)
        self.reacher.options, self.reacher.ahead = request.options, ahead
        self.reacher.options.dense = ahead
        self.reacher.options.stop = &self.stop
        self.reacher.y = &state[0]
        mechc_reach_from(&self.reacher, t, &y0[0])

    def __dealloc__(self):
        mechc_hybrid_free(&self.reacher.hybrid)

    def reach(self, double t, bint changed):
        """Go on to t and return the status; ``changed``: inputs have other values than before."""
        cdef reaching job
        job.reacher, job.t, job.changed = &self.reacher, t, changed
        while True:
            try:
                with_stack(self.request.scene.stack_here(), reach_time, &job, &self.stop)
            finally:
                self.stop = 0
            PyErr_CheckSignals()
            if not self.load_wanted():
                return job.status
            job.changed = False

    @property
    def t(self):
        """Time reached."""
        return self.reacher.t

    def state(self):
        """The state there (nq + nu,), a copy."""
        return self.y.copy()

    def stats(self):
        """Counters of the last step, and the least conditioning met."""
        return mechc_hybrid_stats(&self.reacher.hybrid) if self.reacher.hybrid.pieces else {}

    def steps(self):
        """The steps since the last time requested, or None."""
        cdef mechc_hybrid *hybrid = &self.reacher.hybrid
        if not hybrid.live:
            return None
        return steps_of(self.request.scene, hybrid.piece[hybrid.pieces - 1], self.params(),
                        self.request.inputs, self.request.events, self.request.sizes)

    def params(self):
        """The parameters there (np,), as resets have left them, a copy."""
        return array_of(self.reacher.hybrid.motion.p, self.request.scene.parameters)

    def save(self, bint with_run=True):
        """The moment as bytes, which contain addresses where they have a run; with events they have
        none, and the motion begins anew, here as where they are restored."""
        cdef size_t size = mechc_reach_saved_size(&self.reacher, with_run)
        saved = np.empty(size, dtype=np.uint8)
        cdef unsigned char[::1] to = saved
        mechc_reach_save(&self.reacher, &to[0], with_run)
        return saved

    def restore(self, double t, const double[::1] y, const unsigned char[::1] saved):
        """Go back to what :meth:`save` returned at this time and state, without its run in another
        motion of the scene."""
        if not mechc_reach_restore(&self.reacher, t, &y[0], &saved[0]):
            raise MemoryError()
