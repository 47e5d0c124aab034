/* Collocation methods: simplified Newton iteration with the exact Jacobian. Steps and iterations are judged by the
   states alone; multipliers come along, with the order of the stages.

   Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, sections IV.8 and VII.4. */
#include "stages.h"


/* What is known from before, first in the work space of its own. */
enum { BEFORE, FACTORED, CONTRACTION, EXPECTED, FRESH, TRIALS, MEMORY };

static mbs_stages parts_of(const mbs_run *r)
{
    return mbs_stages_of(r, MEMORY);
}

static long long own_work(const mbs_problem *problem)
{
    return mbs_stages_work(problem, MEMORY);
}

static void restart(mbs_run *r)
{
    mbs_fill(MEMORY, 0.0, r->own);
}

/* to_i = sum_j matrix_ij from_j for the first `count` numbers of the stages; the others become zero. */
static void transform(const mbs_stages *p, const double *matrix, int count, const double *from, double *to)
{
    mbs_fill(p->s * p->size, 0.0, to);
    for (int i = 0; i < p->s; ++i)
        for (int j = 0; j < p->s; ++j)
            for (int k = 0; k < count; ++k)
                to[i * p->size + k] += matrix[i * p->s + j] * from[j * p->size + k];
}

/* ---- Newton's iteration ---- */

static void evaluate_jacobian(mbs_run *r, const mbs_stages *p)
{
    mbs_stage_jacobian(r, p);
    p->memory[FRESH] = 1.0;
    p->memory[FACTORED] = 0.0;
    p->memory[CONTRACTION] = 0.0;
    p->memory[EXPECTED] = 1.0;
}

/* The step before is a guide to one over h. */
static int guided(const mbs_stages *p, double h)
{
    return p->memory[BEFORE] > 0.0 && h / p->memory[BEFORE] <= MBS_FAR;
}

/* The polynomial of the step before, led on; zero where there is none, and for rows that are not active. */
static void predict(const mbs_stages *p, double h)
{
    const mbs_collocation *m = p->m;
    double ratio = h / p->memory[BEFORE];
    mbs_fill(p->s * p->size, 0.0, p->z);
    for (int i = 0; i < p->s && guided(p, h); ++i)
        for (int j = 0; j < p->s; ++j) {
            double theta = 1.0 + m->c[i] * ratio, there = 0.0, here = 0.0;
            for (int power = p->s - 1; power >= 0; --power) {
                there = (there + m->dense[j * p->s + power]) * theta;
                here += m->dense[j * p->s + power];
            }
            for (int k = 0; k < (int)p->active[p->size]; ++k) {
                int at = (int)p->active[k];
                p->z[i * p->size + at] += (there - here) * p->before[j * p->size + at];
            }
        }
}

/* rest = T^-1 (h start f(t, y) + h f(t + c h, y + z) - W E z) */
static int find_residual(mbs_run *r, const mbs_stages *p, double h)
{
    const mbs_collocation *m = p->m;
    transform(p, m->w, p->n, p->z, p->residual);
    for (int i = 0; i < p->s; ++i) {
        double *z = p->z + i * p->size, *values = p->rest + i * p->size, *residual = p->residual + i * p->size;
        for (int k = 0; k < p->size; ++k)
            p->y[k] = (k < p->n ? r->x[k] : p->multipliers[k - p->n]) + z[k];
        int status = mbs_stage_values(r, p, r->state->t + m->c[i] * h, p->y, values);
        if (status != MBS_RUNNING)
            return status;
        for (int k = 0; k < p->size; ++k)
            residual[k] = h * (m->start[i] * (k < p->n ? r->slope[k] : 0.0) + values[k]) - residual[k];
    }
    transform(p, m->inverse, p->size, p->residual, p->rest);
    return MBS_RUNNING;
}

/* residual = the change of z */
static void find_change(const mbs_stages *p)
{
    mbs_stage_solve(p);
    transform(p, p->m->transform, p->size, p->rest, p->residual);
}

/* The scale of each component: of the tolerance, or for fixed steps of x and z themselves. */
static void find_scales(mbs_run *r, const mbs_stages *p, double *scales)
{
    const mbs_problem *problem = r->problem;
    for (int k = 0; k < p->n; ++k) {
        scales[k] = fabs(r->x[k]);
        for (int i = 0; i < p->s && problem->step > 0.0; ++i)
            if (fabs(p->z[i * p->size + k]) > scales[k])
                scales[k] = fabs(p->z[i * p->size + k]);
    }
    double least = MBS_LEAST_SCALE * mbs_largest(p->n, scales), noise = mbs_noise(r) * mbs_largest(p->n, r->x);
    for (int k = 0; k < p->n; ++k)
        if (!(problem->step > 0.0))
            scales[k] = problem->atol + problem->rtol * scales[k] + noise;
        else if (!(scales[k] > least))
            scales[k] = least > 0.0 ? least : 1.0;
}

/* Apply the change; its size in the mean square, or for fixed steps its largest entry, in units of the scales. */
static double change_size(mbs_run *r, const mbs_stages *p, int *worst)
{
    double sum = 0.0, most = -1.0;
    find_scales(r, p, r->stage);
    for (int i = 0; i < p->s * p->size; ++i) {
        int k = i % p->size;
        p->z[i] += p->residual[i];
        if (k >= p->n)
            continue;
        double part = p->residual[i] / r->stage[k];
        sum += part * part;
        if (fabs(part) > most) {
            most = fabs(part);
            *worst = k;
        }
    }
    return r->problem->step > 0.0 && sum < HUGE_VAL ? most : sqrt(sum / (p->s * p->n));
}

/* Tell whether the iteration has come near enough to its limit: within a part of the tolerance, or to round-off. */
static int converged(const mbs_run *r, double size, double before, double contraction)
{
    double rest = contraction / (1.0 - contraction) * size, rtol = r->problem->rtol;
    if (r->problem->step > 0.0)
        return size <= MBS_EPSILON || (contraction < 1.0 && rest <= 0.25 * MBS_EPSILON) ||
               (size >= before && size <= MBS_STANDSTILL);
    double wanted = rtol > 0.0 && 10.0 * MBS_EPSILON / rtol > MBS_KAPPA ? 10.0 * MBS_EPSILON / rtol : MBS_KAPPA;
    return 10.0 * size <= wanted || (contraction < 1.0 && rest <= wanted);
}

/* Tell whether what keeps moving is rounding: of the largest components under fixed steps, where stiff forces show it; else
   no more than what round-off may falsify near a singular position. */
static int rounded(mbs_run *r, const mbs_stages *p)
{
    double most = 0.0;
    for (int i = 0; i < p->s; ++i) {
        double size = mbs_largest(p->n, p->residual + i * p->size);
        most = size <= most ? most : size;
    }
    if (!(r->problem->step > 0.0))
        return most <= mbs_noise(r) * mbs_largest(p->n, r->x);
    find_scales(r, p, r->stage);
    return most <= MBS_STANDSTILL * mbs_largest(p->n, r->stage);
}

/* Tell whether the contraction is one: from far off, without a prediction, the first change is much larger than what it
   leaves, and the next ones are not. */
static int known(const mbs_run *r, const mbs_stages *p, double h, int round)
{
    return r->problem->step > 0.0 ? round > 0 : round > 1 || guided(p, h);
}

static int iterate(mbs_run *r, const mbs_stages *p, double h)
{
    int rounds = r->problem->step > 0.0 ? MBS_FIXED_ROUNDS : MBS_ADAPTIVE_ROUNDS, growths = 0, worst = 0, status;
    double before = HUGE_VAL, contraction = p->memory[EXPECTED] = pow(p->memory[EXPECTED], 0.8);
    for (int round = 0; round < rounds; ++round) {
        if ((status = find_residual(r, p, h)) != MBS_RUNNING)
            return status;
        find_change(p);
        double size = change_size(r, p, &worst);
        if (round > 0) {
            contraction = size / before;
            p->memory[EXPECTED] = contraction > MBS_EPSILON ? contraction : MBS_EPSILON;
        }
        if (round == 1)
            p->memory[CONTRACTION] = contraction;
        if (converged(r, size, before, known(r, p, h, round) ? contraction : 1.0))
            return MBS_RUNNING;
        growths += round > 0 && contraction >= 1.0;
        if (!(size < HUGE_VAL) || growths > (r->problem->step > 0.0 ? MBS_GROWTHS : 0)) {
            if (rounded(r, p))
                return MBS_RUNNING;
            break;
        }
        before = size;
    }
    return mbs_failed(r, MBS_NOT_CONVERGED, r->state->t, worst);
}

static int factorise(mbs_run *r, const mbs_stages *p, double h)
{
    int regular = mbs_stage_factorise(p, h);
    ++r->state->factorisations;
    p->memory[FACTORED] = regular ? h : 0.0;
    return regular;
}

/* Solve for z; where the old J does not do, with a new one. */
static int find_stages(mbs_run *r, const mbs_stages *p, double h)
{
    int status = MBS_NOT_CONVERGED;
    if (!(p->memory[FRESH] > 0.0) && !(p->memory[BEFORE] > 0.0 && p->memory[CONTRACTION] <= MBS_SLOW))
        evaluate_jacobian(r, p);
    for (;;) {
        int regular = p->memory[FACTORED] == h || factorise(r, p, h);
        predict(p, h);
        if (regular)
            status = iterate(r, p, h);
        else
            mbs_failed(r, status, r->state->t, 0);
        if (status == MBS_RUNNING || p->memory[FRESH] > 0.0)
            return status;
        evaluate_jacobian(r, p);
    }
}

/* ---- steps ---- */

/* Fill r->error; where a start that is not smooth yet would make the step fail, with the slope it leads to. */
static int estimate(mbs_run *r, const mbs_stages *p, double h)
{
    int worst, status;
    const double *slope = r->slope;
    for (int round = 0;; ++round) {
        for (int k = 0; k < p->n; ++k)
            r->error[k] = h * slope[k];
        for (int i = 0; i < p->s; ++i)
            for (int k = 0; k < p->n; ++k)
                r->error[k] += p->m->error[i] * p->z[i * p->size + k];
        mbs_stage_filter(p, r->error);
        int rough = p->memory[BEFORE] == 0.0 || p->memory[TRIALS] > 1.0;
        if (round > 0 || !rough || mbs_scaled_norm(r, r->error, r->x, r->x_new, 0.0, &worst) <= 1.0)
            return MBS_RUNNING;
        for (int k = 0; k < p->n; ++k)
            r->stage[k] = r->x[k] + r->error[k];
        if ((status = mbs_derivative(r, r->state->t, r->stage, p->rest)) != MBS_RUNNING)
            return status;
        slope = p->rest;
    }
}

/* Where rows are part of the equations no slope tells how near stages come to a singular position. */
static void look_at_stages(mbs_run *r, const mbs_stages *p, double h)
{
    for (int i = 0; i < p->s && p->rows && !r->state->near; ++i) {
        for (int k = 0; k < p->n; ++k)
            p->y[k] = r->x[k] + p->z[i * p->size + k];
        mbs_look_at_rows(r, r->state->t + p->m->c[i] * h, p->y);
    }
}

static int attempt(mbs_run *r, double h, double t_new)
{
    mbs_stages p = parts_of(r);
    if (p.memory[TRIALS] == 0.0 && p.memory[BEFORE] == 0.0)
        mbs_first_multipliers(r, &p);
    p.memory[TRIALS] += 1.0;
    int status = find_stages(r, &p, h);
    if (status != MBS_RUNNING)
        return status;

    look_at_stages(r, &p, h);
    mbs_fill(p.n, 0.0, r->x_new);
    for (int i = 0; i < p.s; ++i)
        if (p.m->end[i] != 0.0)
            for (int k = 0; k < p.n; ++k)
                r->x_new[k] += p.m->end[i] * p.z[i * p.size + k];
    for (int k = 0; k < p.n; ++k)
        r->x_new[k] += r->x[k];
    if ((status = mbs_all_finite(r, t_new, r->x_new)) != MBS_RUNNING || r->problem->step > 0.0)
        return status;
    return estimate(r, &p, h);
}

static int finish(mbs_run *r, double t_new, int changed)
{
    (void)changed;
    return mbs_derivative(r, t_new, r->x_new, r->slope_new);
}

static void advance(mbs_run *r)
{
    mbs_stages p = parts_of(r);
    mbs_copy(p.s * p.size, p.z, p.before);
    for (int k = 0; k < p.rows; ++k) {
        double change = 0.0;
        for (int i = 0; i < p.s; ++i)
            change += p.m->end[i] * p.z[i * p.size + p.n + k];
        p.multipliers[k] += change;
    }
    p.memory[BEFORE] = r->state->h;
    p.memory[FRESH] = p.memory[TRIALS] = 0.0;
}

static int extend(mbs_run *r)
{
    (void)r;
    return MBS_RUNNING;
}

static void value(const mbs_run *r, double theta, double *x)
{
    mbs_stages p = parts_of(r);
    if (p.m->hermite) {
        mbs_hermite(r, theta, x);
        return;
    }
    mbs_fill(p.n, 0.0, x);
    for (int i = 0; i < p.s; ++i) {
        double weight = 0.0;
        for (int power = p.s - 1; power >= 0; --power)
            weight = (weight + p.m->dense[i * p.s + power]) * theta;
        for (int k = 0; k < p.n; ++k)
            x[k] += weight * p.z[i * p.size + k];
    }
    for (int k = 0; k < p.n; ++k)
        x[k] += r->x[k];
}

const mbs_stepper mbs_implicit = {own_work, restart, attempt, finish, advance, extend, value, MBS_LEAST_GROWTH};
