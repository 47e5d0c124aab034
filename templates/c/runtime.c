/* Rank-revealing solve and integration loop of generated models. Allocates nothing, keeps no state of its own. */
#include "runtime.h"

#include <math.h>

#define EPSILON 2.220446049250313e-16

/* The largest |x_i|; nan if one of them is nan. */
static double largest(int n, const double *x)
{
    double result = 0.0;
    for (int i = 0; i < n && !isnan(result); ++i)
        if (!(fabs(x[i]) <= result))
            result = fabs(x[i]);
    return result;
}

static void copy(int n, const double *from, double *to)
{
    for (int i = 0; i < n; ++i)
        to[i] = from[i];
}

/* ---- minimum-norm solution of A x = r by Householder QR of A^T with column pivoting ---- */

#define TIE 1e-8 /* lengths closer than this fraction count as equal: the row declared first is taken */

typedef struct {
    int rows, columns, rank;
    double *vectors;  /* row j: R entries, then the Householder vector of a kept row */
    double *scale;    /* lengths of the rows of A */
    double *order;    /* order[k]: the row kept k-th, as a whole number */
    double *diagonal; /* R_kk */
    double *factors;  /* reflection k is E - factors[k] v v^T */
} qr;

static double dot(int n, const double *a, const double *b)
{
    double sum = 0.0;
    for (int i = 0; i < n; ++i)
        sum += a[i] * b[i];
    return sum;
}

static double *row_of(const qr *f, int k)
{
    return f->vectors + (int)f->order[k] * f->columns;
}

static int scale_rows(const qr *f, const double *matrix)
{
    for (int j = 0; j < f->rows; ++j) {
        const double *from = matrix + j * f->columns;
        double *to = f->vectors + j * f->columns;
        double size = largest(f->columns, from);
        if (!isfinite(size))
            return 0;
        if (size == 0.0)
            size = 1.0;
        for (int i = 0; i < f->columns; ++i)
            to[i] = from[i] / size;
        double length = sqrt(dot(f->columns, to, to));
        if (length == 0.0)
            length = 1.0;
        for (int i = 0; i < f->columns; ++i)
            to[i] /= length;
        f->scale[j] = size * length;
        f->order[j] = j;
    }
    return 1;
}

/* Bring the longest remaining row to place k, those between one place back; returns its length. */
static double take_pivot(const qr *f, int k, double *lengths)
{
    double longest = 0.0;
    for (int j = k; j < f->rows; ++j) {
        const double *rest = row_of(f, j) + k;
        lengths[j] = sqrt(dot(f->columns - k, rest, rest));
        if (lengths[j] > longest)
            longest = lengths[j];
    }
    int chosen = k;
    while (chosen < f->rows - 1 && !(lengths[chosen] >= (1.0 - TIE) * longest))
        ++chosen;
    double row = f->order[chosen];
    for (int j = chosen; j > k; --j)
        f->order[j] = f->order[j - 1];
    f->order[k] = row;
    return lengths[chosen];
}

static void reflect(const qr *f, int k, double length)
{
    int rest = f->columns - k;
    double *v = row_of(f, k) + k;
    double first = v[0];
    f->diagonal[k] = first > 0.0 ? -length : length;
    f->factors[k] = 1.0 / (length * (length + fabs(first)));
    v[0] = first - f->diagonal[k];
    for (int j = k + 1; j < f->rows; ++j) {
        double *other = row_of(f, j) + k;
        double amount = f->factors[k] * dot(rest, v, other);
        for (int i = 0; i < rest; ++i)
            other[i] -= amount * v[i];
    }
}

static void factorise(qr *f, double *lengths)
{
    int most = f->rows < f->columns ? f->rows : f->columns;
    double tolerance = 100.0 * EPSILON * (f->rows > f->columns ? f->rows : f->columns);
    for (f->rank = 0; f->rank < most; ++f->rank) {
        double length = take_pivot(f, f->rank, lengths);
        double first = f->rank ? fabs(f->diagonal[0]) : length;
        if (!(length > tolerance * first))
            break;
        reflect(f, f->rank, length);
    }
}

static void fill_report(const qr *f, const double *right, const double *y, double *report)
{
    double biggest = largest(f->rows, right), smallest = 0.0, residual = 0.0;
    for (int k = 0; k < f->rank; ++k)
        if (k == 0 || fabs(f->diagonal[k]) < smallest)
            smallest = fabs(f->diagonal[k]);
    for (int k = f->rank; k < f->rows; ++k) {
        double left = fabs(right[(int)f->order[k]] - dot(f->rank, row_of(f, k), y));
        if (left > residual)
            residual = left;
    }
    report[0] = f->rank;
    report[1] = f->rank ? smallest / fabs(f->diagonal[0]) : 0.0;
    report[2] = biggest > 0.0 ? residual / biggest : 0.0;
}

static void fill(int n, double value, double *x)
{
    for (int i = 0; i < n; ++i)
        x[i] = value;
}

/* y = R^-T r over the kept rows, multipliers = R^-1 y, x = Q (y, 0). */
static void substitute(const qr *f, const double *right, double *y, double *solution, double *multipliers)
{
    for (int k = 0; k < f->rank; ++k)
        y[k] = (right[(int)f->order[k]] - dot(k, row_of(f, k), y)) / f->diagonal[k];
    fill(f->columns, 0.0, solution);
    fill(f->rows, 0.0, multipliers);
    copy(f->rank, y, solution);
    for (int k = f->rank - 1; k >= 0; --k) {
        const double *row = row_of(f, k);
        double value = y[k];
        for (int j = k + 1; j < f->rank; ++j)
            value -= row_of(f, j)[k] * multipliers[(int)f->order[j]];
        multipliers[(int)f->order[k]] = value / f->diagonal[k];
        double amount = f->factors[k] * dot(f->columns - k, row + k, solution + k);
        for (int i = k; i < f->columns; ++i)
            solution[i] -= amount * row[i];
    }
    for (int j = 0; j < f->rows; ++j)
        multipliers[j] /= f->scale[j];
}

void mbs_solve(int rows, int columns, const double *matrix, const double *right, double *solution,
               double *multipliers, double *report, double *work)
{
    double *scale = work + rows * columns;
    qr f = {rows, columns, 0, work, scale, scale + rows, scale + 2 * rows, scale + 3 * rows};
    double *y = scale + 4 * rows, *scaled = scale + 5 * rows;
    if (!scale_rows(&f, matrix) || !isfinite(largest(rows, right))) {
        fill(columns, NAN, solution);
        fill(rows, NAN, multipliers);
        fill(3, NAN, report);
        return;
    }
    factorise(&f, y);
    for (int j = 0; j < rows; ++j)
        scaled[j] = right[j] / f.scale[j];
    substitute(&f, scaled, y, solution, multipliers);
    fill_report(&f, scaled, y, report);
}

/* ---- calls ---- */

void mbs_map(const mbs_program *program, long long samples, const double **in, const int *advance, double **out)
{
    for (long long sample = 0; sample < samples; ++sample) {
        program->call(in, out);
        for (int i = 0; i < program->n_in; ++i)
            in[i] += advance[i] ? program->in_sizes[i] : 0;
        for (int i = 0; i < program->n_out; ++i)
            out[i] += program->out_sizes[i];
    }
}

/* ---- integration ---- */

enum { STARTING, STEPPING, SAMPLING };

/* The problem, its state and the parts of the work space; x stands first, as runtime.h promises. */
typedef struct {
    const mbs_problem *problem;
    const mbs_method *method;
    const mbs_system *system;
    mbs_state *state;
    int n;
    double *x, *x_new, *slope_new, *stage, *spare, *correction, *k;
    double *inputs, *multipliers, *rows, *report;
    double drift_position, drift_velocity, removed_position, removed_velocity, deviation; /* of the step on trial */
    double residual; /* largest scaled residual of dependent rows in it */
} run;

static run unpack(const mbs_problem *problem, mbs_state *state, double *work)
{
    const mbs_system *system = problem->system;
    int n = system->nq + system->nu;
    run r = {.problem = problem, .method = problem->method, .system = system, .state = state, .n = n};
    r.x = work;
    r.x_new = r.x + n;
    r.slope_new = r.x_new + n;
    r.stage = r.slope_new + n;
    r.spare = r.stage + n;
    r.correction = r.spare + n;
    r.k = r.correction + n;
    r.inputs = r.k + problem->method->stages * n;
    r.multipliers = r.inputs + system->nw;
    r.rows = r.multipliers + system->ns;
    r.report = r.rows + system->ns;
    return r;
}

static int failed(run *r, int status, double time, int component)
{
    r->state->failure_time = time;
    r->state->component = component;
    return status;
}

static int all_finite(run *r, double time, const double *values)
{
    double product = 0.0;
    for (int i = 0; i < r->n; ++i)
        product += 0.0 * values[i];
    if (product == 0.0)
        return MBS_RUNNING;
    int component = 0;
    while (isfinite(values[component]))
        ++component;
    return failed(r, MBS_NOT_FINITE, time, component);
}

static void call(run *r, const mbs_program *program, double t, const double *x, double *const *out)
{
    const mbs_system *system = r->system;
    const double *in[6] = {&t, x, x + system->nq, system->parameters, r->inputs, system->modes};
    if (system->inputs)
        system->inputs->call(in, &r->inputs);
    program->call(in, out);
}

static void note_report(run *r, double t)
{
    mbs_state *state = r->state;
    if (r->report[0] < state->least_rank)
        state->least_rank = r->report[0];
    if (r->report[0] > state->greatest_rank)
        state->greatest_rank = r->report[0];
    if (r->report[1] < state->conditioning) {
        state->conditioning = r->report[1];
        state->conditioning_time = t;
    }
    if (r->report[2] > r->residual)
        r->residual = r->report[2];
}

static int derivative(run *r, double t, const double *x, double *slope)
{
    double *out[4] = {slope, slope + r->system->nq, r->multipliers, r->report};
    call(r, r->system->state_derivative, t, x, out);
    ++r->state->evaluations;
    int status = all_finite(r, t, slope);
    if (status == MBS_RUNNING && r->system->ns > 0)
        note_report(r, t);
    return status;
}

/* to = x + h sum_j weights_j k_j, added in order of j and without the zero weights. */
static void advance(const run *r, double h, int count, const double *weights, double *to)
{
    fill(r->n, 0.0, to);
    for (int j = 0; j < count; ++j) {
        const double *k = r->k + j * r->n;
        double weight = weights[j];
        if (weight != 0.0)
            for (int i = 0; i < r->n; ++i)
                to[i] += weight * k[i];
    }
    for (int i = 0; i < r->n; ++i)
        to[i] = r->x[i] + h * to[i];
}

static int end_in_error(const mbs_method *method)
{
    return method->error && method->error[method->stages - 1] != 0.0;
}

/* Fill x_new and the slopes; the last slope only if the error estimate needs it before x_new is settled. */
static int stages(run *r, double t, double h, double t_new)
{
    const mbs_method *m = r->method;
    int end = m->stages - 1, status;
    r->residual = 0.0;
    for (int i = 1; i < end; ++i) {
        advance(r, h, i, m->a + i * m->stages, r->stage);
        if ((status = derivative(r, t + m->c[i] * h, r->stage, r->k + i * r->n)) != MBS_RUNNING)
            return status;
    }
    advance(r, h, end, m->a + end * m->stages, r->x_new);
    if ((status = all_finite(r, t_new, r->x_new)) != MBS_RUNNING)
        return status;
    return end_in_error(m) ? derivative(r, t_new, r->x_new, r->k + end * r->n) : MBS_RUNNING;
}

/* ---- constraints ---- */

static double violation(run *r, const mbs_program *program, double t, const double *x)
{
    double *out[2] = {r->rows, r->correction};
    call(r, program, t, x, out);
    return largest(r->system->ns, r->rows);
}

static int worst_row(const run *r)
{
    int row = 0;
    for (int i = 1; i < r->system->ns; ++i)
        if (!(fabs(r->rows[i]) <= fabs(r->rows[row])))
            row = i;
    return row;
}

/* Correct `count` entries of x from `first` on until the rows hold to round-off or get no better; `before` and `after`
   receive the largest |row|. */
static int close_rows(run *r, const mbs_program *program, double t, double *x, int first, int count, double *before,
                      double *after)
{
    double *part = x + first, *kept = r->stage;
    double size = 1.0 + largest(count, part), previous = HUGE_VAL;
    *before = *after = violation(r, program, t, x);
    for (int round = 0; round < 20 && *after > 1e-14 * size && *after < 0.5 * previous; ++round) {
        previous = *after;
        copy(count, part, kept);
        for (int i = 0; i < count; ++i)
            part[i] += r->correction[i];
        *after = violation(r, program, t, x);
        if (!(*after < previous)) {
            copy(count, kept, part);
            *after = previous;
        }
    }
    if (*after <= r->problem->closure * size)
        return MBS_RUNNING;
    return failed(r, MBS_NOT_CLOSED, t, worst_row(r));
}

static void normalize(run *r, double t, double *x, double *deviation)
{
    double *out[2] = {r->correction, deviation};
    if (!r->system->normalize)
        return;
    call(r, r->system->normalize, t, x, out);
    copy(r->system->nq, r->correction, x);
}

static int project(run *r, double t, double *x)
{
    const mbs_system *s = r->system;
    int status = MBS_RUNNING;
    if (s->project_position)
        status = close_rows(r, s->project_position, t, x, 0, s->nq, &r->removed_position, &r->drift_position);
    if (status == MBS_RUNNING && s->project_velocity)
        status = close_rows(r, s->project_velocity, t, x, s->nq, s->nu, &r->removed_velocity, &r->drift_velocity);
    return status;
}

/* ---- samples ---- */

static double sample_time(const mbs_problem *p, long long index)
{
    if (index == p->samples - 1)
        return p->t_end;
    return p->t0 + (p->t_end - p->t0) * (double)index / (double)(p->samples - 1);
}

/* The time is the end of the step up to round-off, so that nothing has to be interpolated. */
static int at_end(const run *r, double time)
{
    double end = r->state->t_new, size = fabs(time) > fabs(end) ? fabs(time) : fabs(end);
    return fabs(time - end) <= 8.0 * EPSILON * size;
}

static int sample_due(const run *r)
{
    if (r->state->sample >= r->problem->samples)
        return 0;
    double time = sample_time(r->problem, r->state->sample);
    return time <= r->state->t_new || at_end(r, time);
}

static void interpolate(run *r, double time, double *x)
{
    const mbs_method *m = r->method;
    double theta = (time - r->state->t) / r->state->h;
    fill(r->n, 0.0, x);
    for (int j = 0; j < m->stages; ++j) {
        const double *coefficients = m->dense + j * m->dense_degree, *k = r->k + j * r->n;
        double weight = 0.0;
        for (int power = m->dense_degree - 1; power >= 0; --power)
            weight = (weight + coefficients[power]) * theta;
        if (weight != 0.0)
            for (int i = 0; i < r->n; ++i)
                x[i] += weight * k[i];
    }
    for (int i = 0; i < r->n; ++i)
        x[i] = r->x[i] + r->state->h * x[i];
}

/* A sample between steps is normalised and projected like a step; where that fails it stays as interpolated. */
static void write_sample(run *r, double *x)
{
    double time = sample_time(r->problem, r->state->sample++), deviation;
    if (at_end(r, time)) {
        copy(r->n, r->x_new, x);
        return;
    }
    interpolate(r, time, x);
    normalize(r, time, x, &deviation);
    copy(r->n, x, r->spare);
    if (r->problem->project && project(r, time, x) != MBS_RUNNING)
        copy(r->n, r->spare, x);
}

/* ---- steps ---- */

/* Settle the end of a trial step and find its slope; a changed end needs a slope of its own. The end as it was before
   stays in `spare`. */
static int close_step(run *r, double t_new)
{
    int end = r->method->stages - 1, status = MBS_RUNNING, changed = 0;
    double *last = r->k + end * r->n;
    copy(r->n, r->x_new, r->spare);
    normalize(r, t_new, r->x_new, &r->deviation);
    if (r->problem->project)
        status = project(r, t_new, r->x_new);
    for (int i = 0; i < r->n; ++i)
        changed |= r->x_new[i] != r->spare[i];
    if (status == MBS_RUNNING && !end_in_error(r->method))
        status = derivative(r, t_new, r->x_new, last);
    if (status == MBS_RUNNING && changed && end_in_error(r->method))
        return derivative(r, t_new, r->x_new, r->slope_new);
    copy(r->n, last, r->slope_new);
    return status;
}

static void keep_largest(double *kept, double value)
{
    if (!(value <= *kept))
        *kept = value;
}

/* Dependent rows that disagree are a contradiction only if a row is broken: where hardly any force acts on them, their
   residual is round-off by round-off. */
static int contradiction(run *r)
{
    const mbs_system *s = r->system;
    double allowed = r->problem->contradiction, t = r->state->t_new;
    if (!(r->residual > allowed) || !s->project_velocity)
        return MBS_RUNNING;
    if (!(violation(r, s->project_velocity, t, r->x_new) > allowed * (1.0 + largest(s->nu, r->x_new + s->nq))))
        return MBS_RUNNING;
    return failed(r, MBS_CONTRADICTION, t, worst_row(r));
}

/* Record an accepted step; drift without projection is measured at the steps in which a sample falls. */
static int accept(run *r, double t_new, double h)
{
    mbs_state *s = r->state;
    const mbs_system *system = r->system;
    s->t_new = t_new;
    s->h = h;
    ++s->steps;
    if (!r->problem->project && sample_due(r)) {
        if (system->project_position)
            r->drift_position = violation(r, system->project_position, t_new, r->x_new);
        if (system->project_velocity)
            r->drift_velocity = violation(r, system->project_velocity, t_new, r->x_new);
    }
    keep_largest(&s->drift_position, r->drift_position);
    keep_largest(&s->drift_velocity, r->drift_velocity);
    keep_largest(&s->removed_position, r->removed_position);
    keep_largest(&s->removed_velocity, r->removed_velocity);
    keep_largest(&s->quaternion_deviation, r->deviation);
    s->phase = SAMPLING;
    return contradiction(r);
}

static double steps_needed(const mbs_problem *p)
{
    double ratio = (p->t_end - p->t0) / p->step, nearest = floor(ratio + 0.5);
    int whole = fabs(ratio - nearest) <= 1e-9 * (ratio > 1.0 ? ratio : 1.0);
    double count = whole ? nearest : ceil(ratio);
    return count > 1.0 ? count : 1.0;
}

static int fixed_step(run *r)
{
    const mbs_problem *p = r->problem;
    double number = (double)(r->state->steps + 1), t = r->state->t;
    int last = number >= steps_needed(p), status;
    double t_new = last ? p->t_end : p->t0 + number * p->step, h = last ? p->t_end - t : p->step;
    if ((status = stages(r, t, h, t_new)) == MBS_RUNNING && (status = close_step(r, t_new)) == MBS_RUNNING)
        status = accept(r, t_new, h);
    return status;
}

static double scale(const run *r, double before, double after)
{
    double size = fabs(before) > fabs(after) ? fabs(before) : fabs(after);
    return r->problem->atol + r->problem->rtol * size;
}

/* Mean-square size of y in units of the tolerance at x and x_new; `worst`: the component with most of it. */
static double scaled_norm(const run *r, const double *y, const double *x, const double *x_new, int *worst)
{
    double sum = 0.0, most = -1.0;
    for (int i = 0; i < r->n; ++i) {
        double part = y[i] / scale(r, x[i], x_new[i]);
        sum += part * part;
        if (fabs(part) > most) {
            most = fabs(part);
            *worst = i;
        }
    }
    return sqrt(sum / r->n);
}

static double trial_error(run *r, double h, int *worst)
{
    fill(r->n, 0.0, r->spare);
    for (int j = 0; j < r->method->stages; ++j) {
        double weight = r->method->error[j];
        if (weight != 0.0)
            for (int i = 0; i < r->n; ++i)
                r->spare[i] += weight * r->k[j * r->n + i];
    }
    for (int i = 0; i < r->n; ++i)
        r->spare[i] *= h;
    return scaled_norm(r, r->spare, r->x, r->x_new, worst);
}

static double control_power(const mbs_method *m)
{
    return 1.0 / ((m->order < m->error_order ? m->order : m->error_order) + 1.0);
}

/* The component that settling the end of a step moved most, if by more than a tenth of the whole step and round-off;
   else -1. Such a step has gone over a kink in the constraints, of which the error estimate knows nothing. */
static int moved_far(const run *r, const double *before)
{
    double moved = 0.0, step = 0.0;
    int component = 0;
    for (int i = 0; i < r->n; ++i) {
        double change = fabs(r->x_new[i] - before[i]), whole = fabs(before[i] - r->x[i]);
        if (change > moved) {
            moved = change;
            component = i;
        }
        if (whole > step)
            step = whole;
    }
    return moved > 0.1 * step && moved > 1e-10 * (1.0 + largest(r->n, r->x_new)) ? component : -1;
}

/* Try one step; on success record it, else shorten h_next. */
static int adaptive_trial(run *r, int rejected)
{
    mbs_state *s = r->state;
    double t = s->t, t_end = r->problem->t_end;
    int last = t + 1.01 * s->h_next >= t_end, worst = 0;
    double t_new = last ? t_end : t + s->h_next, h = last ? t_end - t : s->h_next;
    int status = stages(r, t, h, t_new);
    if (status == MBS_RUNNING) {
        double power = control_power(r->method), integral = 0.2 * power;
        double error = trial_error(r, h, &worst), proportional = pow(error, power - 0.75 * integral);
        double change = proportional / pow(s->error, integral) / 0.9, shrink = proportional / 0.9;
        if (!(error <= 1.0)) {
            s->h_next = h / (shrink < 5.0 ? shrink : 5.0);
            return failed(r, MBS_STEP_UNDERFLOW, t, worst);
        }
        status = close_step(r, t_new);
        if (status == MBS_RUNNING && (worst = moved_far(r, r->spare)) >= 0) {
            s->h_next = h > 1e-9 * (t_end - r->problem->t0) ? h * 0.25 : 0.0; /* a jump stays one in any step */
            return failed(r, MBS_STEP_UNDERFLOW, t, worst);
        }
        if (status == MBS_RUNNING) {
            change = change < 5.0 ? change : 5.0;
            change = change > 0.1 ? change : 0.1;
            s->h_next = h / change;
            if (rejected && s->h_next > h)
                s->h_next = h;
            s->error = error > 1e-4 ? error : 1e-4;
            return accept(r, t_new, h);
        }
    }
    s->h_next = h * 0.25;
    return status;
}

static double least_step(const run *r)
{
    double by_time = 16.0 * EPSILON * fabs(r->state->t), by_span = 1e-16 * (r->problem->t_end - r->problem->t0);
    return by_time > by_span ? by_time : by_span;
}

static int adaptive_step(run *r)
{
    mbs_state *s = r->state;
    int status = failed(r, MBS_STEP_UNDERFLOW, s->t, 0);
    for (int rejected = 0; s->h_next >= least_step(r); rejected = 1) {
        status = adaptive_trial(r, rejected);
        if (s->phase == SAMPLING)
            break;
        ++s->rejected;
    }
    return status;
}

/* A first step for which an explicit Euler step and the second derivative stay small. */
static double first_step(run *r)
{
    const mbs_problem *p = r->problem;
    const double *x = r->x, *slope = r->k;
    double span = p->t_end - p->t0;
    int worst, status;
    double size = scaled_norm(r, x, x, x, &worst), speed = scaled_norm(r, slope, x, x, &worst);
    double h = size < 1e-5 || speed < 1e-5 ? 1e-6 : 0.01 * size / speed;
    h = h < span ? h : span;
    do {
        for (int i = 0; i < r->n; ++i)
            r->stage[i] = x[i] + h * slope[i];
        status = derivative(r, p->t0 + h, r->stage, r->spare);
        if (status != MBS_RUNNING && !((h *= 0.1) > least_step(r)))
            return least_step(r);
    } while (status != MBS_RUNNING);
    for (int i = 0; i < r->n; ++i)
        r->spare[i] -= slope[i];
    double steepest = scaled_norm(r, r->spare, x, x, &worst) / h;
    if (!(steepest > speed))
        steepest = speed;
    double tried = steepest > 1e-15 ? pow(0.01 / steepest, control_power(r->method)) : (h * 1e-3 > 1e-6 ? h * 1e-3 : 1e-6);
    tried = tried < 100.0 * h ? tried : 100.0 * h;
    return tried < span ? tried : span;
}

static int start(run *r, double *samples)
{
    int status;
    copy(r->n, r->x, samples);
    ++r->state->sample;
    r->state->phase = STEPPING;
    if ((status = derivative(r, r->state->t, r->x, r->k)) == MBS_RUNNING && !(r->problem->step > 0.0))
        r->state->h_next = first_step(r);
    return status;
}

static int step(run *r)
{
    if (r->state->steps >= r->problem->max_steps)
        return failed(r, MBS_STEP_LIMIT, r->state->t, -1);
    return r->problem->step > 0.0 ? fixed_step(r) : adaptive_step(r);
}

/* Make the end of the step the start of the next. */
static int move_on(run *r)
{
    copy(r->n, r->x_new, r->x);
    copy(r->n, r->slope_new, r->k);
    r->state->t = r->state->t_new;
    r->state->phase = STEPPING;
    return r->state->t < r->problem->t_end ? MBS_RUNNING : MBS_DONE;
}

void mbs_start(const mbs_problem *problem, const double *x0, mbs_state *state, double *work)
{
    const mbs_state fresh = {.t = problem->t0,
                             .t_new = problem->t0,
                             .error = 1e-4,
                             .least_rank = HUGE_VAL,
                             .greatest_rank = 0.0,
                             .conditioning = HUGE_VAL,
                             .phase = STARTING,
                             .status = MBS_RUNNING};
    *state = fresh;
    copy(problem->system->nq + problem->system->nu, x0, work);
}

long long mbs_integrate(const mbs_problem *problem, mbs_state *state, double *work, long long steps, long long rows,
                        double *samples)
{
    run r = unpack(problem, state, work);
    long long written = 0;
    while (state->status == MBS_RUNNING && steps > 0) {
        if (state->phase == STARTING) {
            if (rows == 0)
                break;
            state->status = start(&r, samples);
            ++written;
        } else if (state->phase == STEPPING) {
            state->status = step(&r);
        } else {
            for (; written < rows && sample_due(&r); ++written)
                write_sample(&r, samples + written * r.n);
            if (sample_due(&r))
                break;
            state->status = move_on(&r);
            --steps;
        }
    }
    return written;
}
