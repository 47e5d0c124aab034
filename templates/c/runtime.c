/* The integration loop: steps, their control, samples. Allocates nothing, keeps no state of its own.

   The units of the runtime, each of which calls those above it alone:

       vectors.h      vectors as plain arrays
       in_order.h     elimination of rows as they come, for small constant patterns
       solve.c        rank-revealing solve: rows that may depend on each other, and those of them that act
       sweeps.c       impulses of many contacts at once
       pairing.c      displacements of coordinates along speeds
       calls.c        calls of the programs, states between the ends of a step, sizes in units of the tolerances
       constraints.c  states put back onto the constraints
       singular.c     how near rows come to dependence, and how long a step there is
       switching.c    values and sides of the switching functions
       slopes.c       the slope of a state, watched for kinks and for the rank of the rows
       explicit.c     explicit Runge-Kutta methods
       multistep.c    methods that look back
       stages.c       equations of the stages of implicit methods, and their factors
       implicit.c     collocation methods: Newton's iteration for these equations
       trials.c       one trial of a step: attempt, error, end
       looks.c        where switching functions are certain to keep their signs, and the longest step
       events.c       the step that ends where a switching function crosses zero
       runtime.c      the loop
       turns.c        a run from mode to mode, over switches that were decided before
       contact_laws.c     of exported contacts: the state that the laws allow, positions and speeds on their rows
       contact_impacts.c  their impacts, and bounces that come to rest
       contacts.c     from state to state of contacts, without Python
       simulate.c     the program that prints such a run
       fmu.c          an instance of an FMU: values, events, steps, saved states
       fmi2.c         the functions of FMI 2.0
       fmi3.c         the functions of FMI 3.0

   runtime.h is the interface of a model, stepper.h that of the units from calls.c to runtime.c. constants.h has the codes
   and tolerances that Python has too; Python writes it. Where a model has no rows, events, derivatives or methods that
   look back, no_rows.c, no_events.c, no_implicit.c and no_multistep.c stand in for the units that it does not enter. */
#include "stepper.h"


static const mbs_stepper *stepper_of(const mbs_method *method)
{
    static const mbs_stepper *const steppers[] = {&mbs_explicit, &mbs_implicit, &mbs_adams, &mbs_stoermer, &mbs_verlet};
    return steppers[method->family];
}

long long mbs_work(const mbs_problem *problem)
{
    const mbs_system *s = problem->system;
    const mbs_stepper *stepper = stepper_of(problem->method);
    if (!stepper->work)
        return -1;
    return 15LL * (s->nq + s->nu) + 3LL * s->ns + 7LL * s->ng + s->nw + 3 + 3LL * (s->switches + 1) + stepper->work(problem);
}

/* x stands first, as runtime.h promises. */
static mbs_run unpacked(const mbs_problem *problem, mbs_state *state, double *work)
{
    const mbs_system *system = problem->system;
    int n = system->nq + system->nu;
    mbs_run r = {.problem = problem, .method = problem->method, .system = system, .state = state, .n = n};
    r.known_time = r.here_time = NAN;
    double **const vectors[] = {&r.x,     &r.x_new, &r.slope_new,  &r.error,  &r.coarse,
                                &r.stage, &r.spare, &r.correction, &r.event_x, &r.settled, &r.kept,
                                &r.known_x, &r.known_slope, &r.here_x};
    r.stepper = stepper_of(problem->method);
    for (int i = 0; i < 14; ++i, work += n)
        *vectors[i] = work;
    r.values = work;
    r.sides = r.values + system->ng;
    r.looks = r.sides + system->ng;
    r.here = r.looks + 4 * system->ng;
    r.inputs = r.here + system->ng;
    r.multipliers = r.inputs + system->nw;
    r.rows = r.multipliers + system->ns;
    r.others = r.rows + system->ns;
    r.report = r.others + system->ns;
    r.past = r.report + 3;
    r.slope = r.past + 3 * (system->switches + 1);
    r.own = r.slope + n;
    for (int i = 0; i < system->ng; ++i)
        r.watching |= !system->terminal[i];
    return r;
}

/* ---- samples ---- */

static double sample_time(const mbs_problem *p, long long index)
{
    if (p->times)
        return p->times[index];
    if (index == p->samples - 1)
        return p->t_end;
    return p->t0 + (p->t_end - p->t0) * (double)index / (double)(p->samples - 1);
}

/* The time is the end of the step up to round-off, so that nothing has to be interpolated. */
static int at_end(const mbs_run *r, double time)
{
    double end = r->state->t_new, size = fabs(time) > fabs(end) ? fabs(time) : fabs(end);
    return fabs(time - end) <= 8.0 * MBS_EPSILON * size;
}

static int sample_due(const mbs_run *r)
{
    if (r->state->sample >= r->problem->samples)
        return 0;
    double time = sample_time(r->problem, r->state->sample);
    return time <= r->state->t_new || at_end(r, time);
}

/* The state with which the next step starts. */
static const double *end_of(const mbs_run *r)
{
    return r->state->crossing < 0 ? r->x_new : r->event_x;
}

static int write_sample(mbs_run *r, double *x)
{
    double time = sample_time(r->problem, r->state->sample);
    int status = MBS_RUNNING;
    if (at_end(r, time))
        mbs_copy(r->n, end_of(r), x);
    else if ((status = mbs_value(r, (time - r->state->t) / r->state->h, x)) == MBS_RUNNING)
        mbs_settle_sample(r, time, x);
    r->state->sample += status == MBS_RUNNING;
    return status;
}

static int stopping(const mbs_run *r)
{
    return r->state->crossing >= 0 && r->system->terminal[r->state->crossing];
}

/* A run that stops between two samples gets one more, at its end, unless another mode follows. */
static int last_sample_due(const mbs_run *r)
{
    return stopping(r) && r->state->crossing < r->system->ng - r->system->switches && !at_end(r, sample_time(r->problem, r->state->sample - 1));
}

/* ---- steps ---- */

static void keep_largest(double *kept, double value)
{
    if (!(value <= *kept))
        *kept = value;
}

/* Dependent rows that disagree are a contradiction only if a row is broken: where hardly any force acts on them, their
   residual is round-off by round-off. */
static int contradiction(mbs_run *r)
{
    const mbs_system *s = r->system;
    const double *end = end_of(r);
    double allowed = r->problem->contradiction, t = r->state->t_new;
    if (!(r->residual > allowed) || !mbs_has_rows(s, 1))
        return MBS_RUNNING;
    if (!(mbs_violation(r, 1, t, end) > allowed * (1.0 + mbs_largest(s->nu, end + s->nq))))
        return MBS_RUNNING;
    return mbs_failed(r, MBS_CONTRADICTION, t, mbs_worst_row(r));
}

/* Record a step that is good enough, after it has been shortened to an event in it; drift without projection is measured
   at the steps in which a sample falls. */
static int accept(mbs_run *r, int status)
{
    mbs_state *s = r->state;
    const mbs_system *system = r->system;
    if (system->ng > 0)
        status = mbs_find_event(r, status);
    if (status != MBS_RUNNING)
        return status;
    ++s->steps;
    if (!r->problem->project && sample_due(r)) {
        if (mbs_has_rows(system, 0))
            r->drift_position = mbs_violation(r, 0, s->t_new, end_of(r));
        if (mbs_has_rows(system, 1))
            r->drift_velocity = mbs_violation(r, 1, s->t_new, end_of(r));
    }
    keep_largest(&s->drift_position, r->drift_position);
    keep_largest(&s->drift_velocity, r->drift_velocity);
    keep_largest(&s->removed_position, r->removed_position);
    keep_largest(&s->removed_velocity, r->removed_velocity);
    keep_largest(&s->quaternion_deviation, r->deviation);
    s->phase = MBS_SAMPLING;
    mbs_find_singular(r);
    return contradiction(r);
}

static double steps_needed(const mbs_problem *p)
{
    double ratio = (p->t_end - p->t0) / p->step, nearest = floor(ratio + 0.5);
    int whole = fabs(ratio - nearest) <= 1e-9 * (ratio > 1.0 ? ratio : 1.0);
    double count = whole ? nearest : ceil(ratio);
    return count > 1.0 ? count : 1.0;
}

static double grid_time(const mbs_problem *p, long long number, double count)
{
    return (double)number >= count ? p->t_end : p->t0 + (double)number * p->step;
}

static double least_step(const mbs_run *r)
{
    double by_time = 16.0 * MBS_EPSILON * fabs(r->state->t), by_span = 1e-16 * (r->problem->t_end - r->problem->t0);
    return by_time > by_span ? by_time : by_span;
}

/* Try the step over `whole`. Near a singular position it may be another part of a whole step: the rest of one may end too
   near to it. */
static int fixed_trial(mbs_run *r, double whole, double t_new)
{
    const mbs_problem *p = r->problem;
    mbs_state *s = r->state;
    double h = whole, longest = s->t + p->step < p->t_end ? p->step : whole;
    for (;;) {
        int status = mbs_take(r, h, t_new);
        if (status == MBS_RUNNING || mbs_stuck_at_kink(r, status))
            status = accept(r, status);
        if (s->phase == MBS_SAMPLING)
            return status;
        if (mbs_comes_unforeseen(r)) {
            mbs_foresee(r);
        } else {
            h = longest *= mbs_retreat(r, longest, 0.0);
            t_new = s->t + h;
        }
        if (h < MBS_LEAST_PART * whole)
            return s->near ? mbs_failed(r, MBS_SINGULAR, s->t, -1) : status;
        ++s->rejected;
    }
}

/* A whole step, or what an event or a singular position has left of one. */
static int fixed_step(mbs_run *r)
{
    const mbs_problem *p = r->problem;
    mbs_state *s = r->state;
    double count = steps_needed(p), next = grid_time(p, s->grid + 1, count);
    int whole = s->t == grid_time(p, s->grid, count), status;
    if (!whole && next < p->t_end && next - s->t < least_step(r))
        next = grid_time(p, ++s->grid + 1, count);
    double whole_step = whole && next < p->t_end ? p->step : next - s->t;
    status = fixed_trial(r, whole_step, next);
    if (s->phase == MBS_SAMPLING && s->t_new >= next)
        ++s->grid;
    return status;
}

static double control_power(const mbs_method *m)
{
    return 1.0 / ((m->order < m->error_order ? m->order : m->error_order) + 1.0);
}

/* What to divide the step by after a trial that was accepted with this error. */
static double change_after(const mbs_run *r, double error)
{
    double power = control_power(r->method), integral = 0.2 * power;
    double change = pow(error, power - 0.75 * integral) / pow(r->state->error, integral) / MBS_SAFETY;
    change = change < MBS_SHRINKAGE ? change : MBS_SHRINKAGE;
    return change > 1.0 / MBS_GROWTH ? change : 1.0 / MBS_GROWTH;
}

/* The length of the step after an accepted one over h: it grows only as the error without the allowance for round-off
   lets it. */
static double length_after(mbs_run *r, double h, double error, double plain, int rejected, double wished)
{
    mbs_state *s = r->state;
    double next = h / change_after(r, error), grown = plain == error ? next : h / change_after(r, plain);
    next = next > h && grown < next ? (grown > h ? grown : h) : next;
    if ((rejected || next < r->stepper->least_growth * h) && next > h)
        next = h;
    next = next > wished ? next : wished;
    if (!s->near || (plain <= 1.0 && next > s->smooth))
        s->smooth = next;
    return next;
}

/* Tell whether a step over h, rejected again, can end at the kink beyond which it looked: behind a jump its error falls
   with the step, not with the order of the method, so that no step over it may be accurate enough. */
static int end_before_kink(mbs_run *r, double h)
{
    int status = accept(r, MBS_NOT_CONVERGED);
    r->state->h_next = h;
    r->state->error = MBS_LEAST_ERROR;
    return status == MBS_RUNNING;
}

/* Try one step; on success record it, else shorten h_next. `wished`: its length but for a singular position. */
static int adaptive_trial(mbs_run *r, int rejected, double *wished)
{
    mbs_state *s = r->state;
    double t = s->t, t_end = r->problem->t_end;
    int last = t + 1.01 * s->h_next >= t_end, worst = 0;
    double t_new = last ? t_end : t + s->h_next, h = last ? t_end - t : s->h_next;
    int status = mbs_attempt(r, h, t_new);
    if (status == MBS_RUNNING) {
        double plain = mbs_error_beside(r, 0.0, &worst), error = mbs_error_allowing(r, plain, &worst);
        if (!(error <= 1.0)) {
            if (rejected && r->beyond && end_before_kink(r, h))
                return MBS_RUNNING;
            double power = control_power(r->method), shrink = pow(error, power - 0.75 * (0.2 * power)) / MBS_SAFETY;
            s->h_next = h / (shrink < MBS_SHRINKAGE ? shrink : MBS_SHRINKAGE);
            *wished = 0.0;
            return mbs_failed(r, MBS_STEP_UNDERFLOW, t, worst);
        }
        status = mbs_close_step(r, t_new);
        if (status == MBS_RUNNING && (worst = mbs_moved_far(r, r->spare, r->x_new, 0.0)) >= 0) {
            int jump = !(h > MBS_LEAST_AT_KINK * (t_end - r->problem->t0)); /* stays one in any step */
            s->h_next = jump ? 0.0 : h * MBS_RETREAT;
            return mbs_failed(r, MBS_STEP_UNDERFLOW, t, worst);
        }
        if (status == MBS_RUNNING) {
            status = accept(r, status);
            if (s->phase == MBS_SAMPLING) {
                s->h_next = length_after(r, h, error, plain, rejected, *wished);
                s->error = error > MBS_LEAST_ERROR ? error : MBS_LEAST_ERROR;
                return status;
            }
        }
    }
    if (mbs_comes_unforeseen(r)) {
        mbs_foresee(r);
        return status;
    }
    s->h_next = h * mbs_retreat(r, h, MBS_RETREAT);
    *wished = !s->near ? 0.0 : h > *wished ? h : *wished;
    return status;
}

static int adaptive_step(mbs_run *r)
{
    mbs_state *s = r->state;
    int status = mbs_failed(r, MBS_STEP_UNDERFLOW, s->t, 0);
    double longest = mbs_longest(r), whole = s->h_next < longest ? s->h_next : longest, wished;
    s->h_next = mbs_laid(r, whole);
    wished = s->h_next < whole ? whole : 0.0;
    for (int rejected = 0; s->h_next >= least_step(r); rejected = 1) {
        status = adaptive_trial(r, rejected, &wished);
        if (s->phase == MBS_SAMPLING)
            break;
        ++s->rejected;
    }
    return s->phase != MBS_SAMPLING && s->near ? mbs_failed(r, MBS_SINGULAR, s->t, -1) : status;
}

/* A first step for which an explicit Euler step and the second derivative stay small. */
static double first_step(mbs_run *r)
{
    const mbs_problem *p = r->problem;
    const double *x = r->x, *slope = r->slope;
    double t = r->state->t, span = p->t_end - t;
    int worst, status;
    double size = mbs_scaled_norm(r, x, x, x, 0.0, &worst), speed = mbs_scaled_norm(r, slope, x, x, 0.0, &worst);
    double h = size < 1e-5 || speed < 1e-5 ? 1e-6 : 0.01 * size / speed;
    h = h < span ? h : span;
    h = h > least_step(r) ? h : least_step(r); /* rates may be past all floats */
    do {
        for (int i = 0; i < r->n; ++i)
            r->stage[i] = x[i] + h * slope[i];
        status = mbs_derivative(r, t + h, r->stage, r->spare);
        if (status != MBS_RUNNING && !((h *= 0.1) > least_step(r)))
            return least_step(r);
    } while (status != MBS_RUNNING);
    for (int i = 0; i < r->n; ++i)
        r->spare[i] -= slope[i];
    double steepest = mbs_scaled_norm(r, r->spare, x, x, 0.0, &worst) / h;
    if (!(steepest > speed))
        steepest = speed;
    double tried = steepest > 1e-15 ? pow(0.01 / steepest, control_power(r->method)) : (h * 1e-3 > 1e-6 ? h * 1e-3 : 1e-6);
    tried = tried < 100.0 * h ? tried : 100.0 * h;
    return tried < span ? tried : span;
}

static int start(mbs_run *r, double *samples)
{
    int status;
    if (r->state->sample == 0)
        mbs_copy(r->n, r->x, samples);
    r->state->sample += r->state->sample == 0;
    r->state->phase = MBS_STEPPING;
    r->past[0] = 0.0;
    r->stepper->restart(r);
    if (r->system->ng > 0)
        mbs_start_events(r);
    if ((status = mbs_derivative(r, r->state->t, r->x, r->slope)) == MBS_RUNNING)
        status = mbs_restart_approach(r);
    if (status == MBS_RUNNING && !(r->problem->step > 0.0))
        r->state->h_next = first_step(r);
    return status;
}

static int step(mbs_run *r)
{
    if (r->state->steps >= r->problem->max_steps)
        return mbs_failed(r, MBS_STEP_LIMIT, r->state->t, -1);
    if (r->system->ng > 0)
        mbs_begin_watch(r);
    return r->problem->step > 0.0 ? fixed_step(r) : adaptive_step(r);
}

/* As steps grow shorter the run would take more of them than it may, as where a speed grows or dry friction rests: it ends
   now. Each eight times as many took so much longer, or shorter, than those before; it is taken to go on so. Where they
   took ever less time, the motion comes to an end of its own, which the steps reach, at once or, where each took the same
   part of the time before, when that is rounding. */
static int approaches_steadily(const double *doubled)
{
    double least = HUGE_VAL, largest = 0.0;
    for (int i = 0; i < MBS_DOUBLED / 2; ++i) {
        double before = doubled[i + 1] - doubled[i], way = doubled[i + 1 + MBS_DOUBLED / 2] - doubled[i + MBS_DOUBLED / 2];
        if (!(before > 0.0 && way > 0.0))
            return 0;
        least = fmin(least, way / before);
        largest = fmax(largest, way / before);
    }
    return least >= MBS_SAME_PART * largest;
}

static int pace(mbs_run *r)
{
    mbs_state *s = r->state;
    if (s->steps & (s->steps - 1))
        return MBS_RUNNING;
    for (int i = 0; i + 1 < MBS_DOUBLED; ++i)
        s->doubled[i] = s->doubled[i + 1];
    s->doubled[MBS_DOUBLED - 1] = s->t;
    if (s->steps < MBS_LEAST_PACE)
        return MBS_RUNNING;
    double middle = s->doubled[MBS_DOUBLED / 2], before = middle - s->doubled[0], way = s->t - middle;
    double ratio = before > 0.0 ? way / before : 8.0, t = s->t, steps = (double)s->steps, most = (double)r->problem->max_steps;
    if (ratio < 0.9 && !approaches_steadily(s->doubled))
        return MBS_RUNNING;
    while (steps <= most && (t += way *= ratio) < r->problem->t_end && way > 4.0 * MBS_EPSILON * fabs(t))
        steps *= 8.0;
    return steps > most ? mbs_failed(r, MBS_STEP_LIMIT, s->t, -1) : MBS_RUNNING;
}

/* Make the end of the step the start of the next. */
static int move_on(mbs_run *r)
{
    mbs_state *s = r->state;
    s->event = s->origin = s->crossing;
    if (s->event < 0) {
        r->stepper->advance(r);
        mbs_advance_approach(r);
    }
    mbs_copy(r->n, end_of(r), r->x);
    mbs_copy(r->n, r->slope_new, r->slope);
    s->t = s->t_new;
    s->phase = MBS_STEPPING;
    if (stopping(r))
        return MBS_STOPPED;
    if (!(s->t < r->problem->t_end))
        return MBS_DONE;
    int status = pace(r);
    if (s->event < 0 || status != MBS_RUNNING)
        return status;
    r->stepper->restart(r);
    r->past[0] = 0.0;
    s->near = s->stiff = 0;
    status = mbs_derivative(r, s->t, r->x, r->slope);
    if (status == MBS_RUNNING)
        status = mbs_restart_approach(r);
    /* a long step of an implicit method would damp a motion it does not see */
    if (status == MBS_RUNNING && !(r->problem->step > 0.0) && r->stepper == &mbs_implicit) {
        double first = first_step(r);
        s->h_next = first < s->h_next ? first : s->h_next;
    }
    return status;
}

void mbs_start(const mbs_problem *problem, const double *x0, mbs_state *state, double *work)
{
    const mbs_state fresh = {.t = problem->t0,
                             .t_new = problem->t0,
                             .error = MBS_LEAST_ERROR,
                             .least_rank = HUGE_VAL,
                             .greatest_rank = 0.0,
                             .conditioning = HUGE_VAL,
                             .start = HUGE_VAL,
                             .latest = HUGE_VAL,
                             .peak = MBS_USUAL,
                             .event = -1,
                             .phase = MBS_STARTING,
                             .crossing = -1,
                             .origin = -1,
                             .status = MBS_RUNNING};
    *state = fresh;
    mbs_copy(problem->system->nq + problem->system->nu, x0, work);
}

long long mbs_integrate(const mbs_problem *problem, mbs_state *state, double *work, long long steps, long long rows,
                        double *samples)
{
    mbs_run r = unpacked(problem, state, work);
    long long written = 0;
    state->event = -1;
    state->passed = 0;
    while (state->status == MBS_RUNNING && steps > 0) {
        if (state->phase == MBS_STARTING) {
            if (rows == 0 && state->sample == 0)
                break;
            written += state->sample == 0;
            state->status = start(&r, samples);
        } else if (state->phase == MBS_STEPPING) {
            state->status = step(&r);
        } else {
            while (state->status == MBS_RUNNING && written < rows && sample_due(&r)) {
                state->status = write_sample(&r, samples + written * r.n);
                written += state->status == MBS_RUNNING;
            }
            if (state->status != MBS_RUNNING || sample_due(&r))
                break;
            if (last_sample_due(&r)) {
                if (written == rows)
                    break;
                mbs_copy(r.n, r.event_x, samples + written++ * r.n);
                ++state->sample;
            }
            state->status = move_on(&r);
            steps = state->event < 0 && !state->passed ? steps - 1 : 0;
        }
    }
    return written;
}

void mbs_integrate_each(const mbs_problem *problem, long long runs, const double *spans, const double *parameters,
                        long long count, const double *x0, mbs_state *states, double *work, long long steps,
                        double *samples, double *ends)
{
    mbs_system system = *problem->system;
    mbs_problem own = *problem;
    const int n = system.nq + system.nu;
    const long long room = mbs_work(problem);
    own.system = &system;
    for (long long k = 0; k < runs; ++k) {
        for (long long i = 0; i < room; ++i)
            work[i] = 0.0;
        system.parameters = parameters + k * count;
        if (spans) {
            own.t0 = spans[2 * k];
            own.t_end = spans[2 * k + 1];
        }
        mbs_start(&own, x0 + k * n, states + k, work);
        mbs_integrate(&own, states + k, work, steps, own.samples, samples + k * own.samples * n);
        mbs_copy(n, work, ends + k * n);
    }
}
