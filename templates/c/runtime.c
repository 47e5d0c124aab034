/* The integration loop: steps, their control, samples. Allocates nothing, keeps no state of its own. */
#include "stepper.h"

#define LEAST_PACE 131072 /* steps from which a run tells whether it takes too many */
#define SAME_PART 0.5
#define LEAST_PART 1e-3 /* of a fixed step, into which one near a singular position may be divided */

enum { STARTING, STEPPING, SAMPLING };

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
    return 14LL * (s->nq + s->nu) + 3LL * s->ns + 6LL * s->ng + s->nw + 3 + 3LL * (s->switches + 1) + stepper->work(problem);
}

/* x stands first, as runtime.h promises. */
static mbs_run unpacked(const mbs_problem *problem, mbs_state *state, double *work)
{
    const mbs_system *system = problem->system;
    int n = system->nq + system->nu;
    mbs_run r = {.problem = problem, .method = problem->method, .system = system, .state = state, .n = n};
    r.known_time = NAN;
    double **const vectors[] = {&r.x,     &r.x_new, &r.slope_new,  &r.error,  &r.coarse,
                                &r.stage, &r.spare, &r.correction, &r.event_x, &r.settled, &r.kept,
                                &r.known_x, &r.known_slope};
    r.stepper = stepper_of(problem->method);
    for (int i = 0; i < 13; ++i, work += n)
        *vectors[i] = work;
    r.values = work;
    r.sides = r.values + system->ng;
    r.looks = r.sides + system->ng;
    r.inputs = r.looks + 4 * system->ng;
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

int mbs_value(mbs_run *r, double theta, double *x)
{
    mbs_state *s = r->state;
    int status = s->extended ? MBS_RUNNING : r->stepper->extend(r);
    if (status == MBS_RUNNING) {
        s->extended = 1;
        r->stepper->value(r, theta, x);
    }
    return status;
}

void mbs_hermite(const mbs_run *r, double theta, double *x)
{
    double rest = 1.0 - theta, h = r->state->h;
    double a = theta * theta * (3.0 - 2.0 * theta), b = h * theta * rest * rest, c = -h * theta * theta * rest;
    for (int i = 0; i < r->n; ++i)
        x[i] = r->x[i] + a * (r->x_new[i] - r->x[i]) + b * r->slope[i] + c * r->slope_new[i];
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

static int close_step(mbs_run *r, double t_new)
{
    int status = MBS_RUNNING, changed = 0;
    mbs_copy(r->n, r->x_new, r->spare);
    mbs_normalize(r, t_new, r->x_new, &r->deviation);
    if (r->problem->project)
        status = mbs_project(r, t_new, r->x_new, MBS_ROUND_OFF);
    if (status == MBS_RUNNING && r->state->near && (status = mbs_closed(r, t_new, r->x_new, r->settled)) == MBS_RUNNING)
        mbs_copy(r->n, r->settled, r->x_new);
    for (int i = 0; i < r->n; ++i)
        changed |= r->x_new[i] != r->spare[i];
    if (status == MBS_RUNNING)
        status = r->stepper->finish(r, t_new, changed);
    return status == MBS_RUNNING ? mbs_verify_end(r, t_new) : status;
}

static double trial_error(mbs_run *r, int *worst);

static int attempt(mbs_run *r, double h, double t_new)
{
    r->residual = 0.0;
    r->beyond = 0;
    r->state->crossing = -1;
    r->state->extended = 0;
    r->state->h = h;
    r->state->t_new = t_new;
    mbs_begin_approach(r);
    int status = r->stepper->attempt(r, h, t_new);
    if (status != MBS_RUNNING && mbs_turns_stiff(r)) {
        mbs_begin_approach(r);
        status = r->stepper->attempt(r, h, t_new);
    }
    return status == MBS_RUNNING ? mbs_verify_approach(r, t_new) : status;
}

int mbs_take(mbs_run *r, double h, double t_new)
{
    int status = attempt(r, h, t_new), worst;
    if (status != MBS_RUNNING)
        return status;
    r->retaken = r->problem->step > 0.0 ? 0.0 : trial_error(r, &worst);
    return close_step(r, t_new);
}

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
    s->phase = SAMPLING;
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
        if (s->phase == SAMPLING)
            return status;
        if (mbs_comes_unforeseen(r)) {
            mbs_foresee(r);
        } else {
            h = longest *= mbs_retreat(r, longest, 0.0);
            t_new = s->t + h;
        }
        if (h < LEAST_PART * whole)
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
    if (s->phase == SAMPLING && s->t_new >= next)
        ++s->grid;
    return status;
}

static double scale(const mbs_run *r, double before, double after)
{
    double size = fabs(before) > fabs(after) ? fabs(before) : fabs(after);
    return r->problem->atol + r->problem->rtol * size;
}

double mbs_scaled_norm(const mbs_run *r, const double *y, const double *x, const double *x_new, double noise, int *worst)
{
    double sum = 0.0, most = -1.0;
    for (int i = 0; i < r->n; ++i) {
        double part = y[i] / (scale(r, x[i], x_new[i]) + noise);
        sum += part * part;
        if (fabs(part) > most) {
            most = fabs(part);
            *worst = i;
        }
    }
    return sqrt(sum / r->n);
}

/* The error of a trial beside so much noise. Of two estimates the finer, e5, counts as e5^2 / sqrt(e5^2 + 0.01 e3^2), with
   the coarser, e3. */
static double error_beside(mbs_run *r, double noise, int *worst)
{
    double fine = mbs_scaled_norm(r, r->error, r->x, r->x_new, noise, worst);
    int ignored;
    if (!r->method->coarse_error || fine == 0.0)
        return fine;
    double coarse = mbs_scaled_norm(r, r->coarse, r->x, r->x_new, noise, &ignored);
    return fine * fine / sqrt(fine * fine + 0.01 * (coarse * coarse));
}

/* The error of a trial whose `plain` one is known: near a singular position what round-off does there counts as allowed. */
static double error_allowing(mbs_run *r, double plain, int *worst)
{
    double noise = mbs_noise(r);
    return noise == 0.0 ? plain : error_beside(r, noise * mbs_largest(r->n, r->x_new), worst);
}

static double trial_error(mbs_run *r, int *worst)
{
    return error_allowing(r, error_beside(r, 0.0, worst), worst);
}

static double control_power(const mbs_method *m)
{
    return 1.0 / ((m->order < m->error_order ? m->order : m->error_order) + 1.0);
}

/* What to divide the step by after a trial that was accepted with this error. */
static double change_after(const mbs_run *r, double error)
{
    double power = control_power(r->method), integral = 0.2 * power;
    double change = pow(error, power - 0.75 * integral) / pow(r->state->error, integral) / 0.9;
    change = change < 5.0 ? change : 5.0;
    return change > 0.1 ? change : 0.1;
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
    r->state->error = 1e-4;
    return status == MBS_RUNNING;
}

/* Try one step; on success record it, else shorten h_next. `wished`: its length but for a singular position. */
static int adaptive_trial(mbs_run *r, int rejected, double *wished)
{
    mbs_state *s = r->state;
    double t = s->t, t_end = r->problem->t_end;
    int last = t + 1.01 * s->h_next >= t_end, worst = 0;
    double t_new = last ? t_end : t + s->h_next, h = last ? t_end - t : s->h_next;
    int status = attempt(r, h, t_new);
    if (status == MBS_RUNNING) {
        double plain = error_beside(r, 0.0, &worst), error = error_allowing(r, plain, &worst);
        if (!(error <= 1.0)) {
            if (rejected && r->beyond && end_before_kink(r, h))
                return MBS_RUNNING;
            double power = control_power(r->method), shrink = pow(error, power - 0.75 * (0.2 * power)) / 0.9;
            s->h_next = h / (shrink < 5.0 ? shrink : 5.0);
            *wished = 0.0;
            return mbs_failed(r, MBS_STEP_UNDERFLOW, t, worst);
        }
        status = close_step(r, t_new);
        if (status == MBS_RUNNING && (worst = mbs_moved_far(r, r->spare, r->x_new, 0.0)) >= 0) {
            s->h_next = h > 1e-9 * (t_end - r->problem->t0) ? h * 0.25 : 0.0; /* a jump stays one in any step */
            return mbs_failed(r, MBS_STEP_UNDERFLOW, t, worst);
        }
        if (status == MBS_RUNNING) {
            status = accept(r, status);
            if (s->phase == SAMPLING) {
                s->h_next = length_after(r, h, error, plain, rejected, *wished);
                s->error = error > 1e-4 ? error : 1e-4;
                return status;
            }
        }
    }
    if (mbs_comes_unforeseen(r)) {
        mbs_foresee(r);
        return status;
    }
    s->h_next = h * mbs_retreat(r, h, 0.25);
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
        if (s->phase == SAMPLING)
            break;
        ++s->rejected;
    }
    return s->phase != SAMPLING && s->near ? mbs_failed(r, MBS_SINGULAR, s->t, -1) : status;
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
    r->state->phase = STEPPING;
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
    return least >= SAME_PART * largest;
}

static int pace(mbs_run *r)
{
    mbs_state *s = r->state;
    if (s->steps & (s->steps - 1))
        return MBS_RUNNING;
    for (int i = 0; i + 1 < MBS_DOUBLED; ++i)
        s->doubled[i] = s->doubled[i + 1];
    s->doubled[MBS_DOUBLED - 1] = s->t;
    if (s->steps < LEAST_PACE)
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
    s->phase = STEPPING;
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
                             .error = 1e-4,
                             .least_rank = HUGE_VAL,
                             .greatest_rank = 0.0,
                             .conditioning = HUGE_VAL,
                             .start = HUGE_VAL,
                             .latest = HUGE_VAL,
                             .peak = 0.01,
                             .event = -1,
                             .phase = STARTING,
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
        if (state->phase == STARTING) {
            if (rows == 0 && state->sample == 0)
                break;
            written += state->sample == 0;
            state->status = start(&r, samples);
        } else if (state->phase == STEPPING) {
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

void mbs_integrate_each(const mbs_problem *problem, mbs_system *system, long long runs, const double *parameters,
                        long long count, const double *x0, mbs_state *states, double *work, long long steps,
                        double *samples, double *ends)
{
    const double *own = system->parameters;
    const int n = system->nq + system->nu;
    const long long room = mbs_work(problem);
    for (long long k = 0; k < runs; ++k) {
        for (long long i = 0; i < room; ++i)
            work[i] = 0.0;
        system->parameters = parameters + k * count;
        mbs_start(problem, x0 + k * n, states + k, work);
        mbs_integrate(problem, states + k, work, steps, problem->samples, samples + k * problem->samples * n);
        mbs_copy(n, work, ends + k * n);
    }
    system->parameters = own;
}
