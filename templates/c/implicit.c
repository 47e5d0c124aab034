/* Collocation methods: simplified Newton iteration with the exact Jacobian J of the slope, in the blocks of W.

   Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, section IV.8. */
#include "stepper.h"

#define KAPPA 0.01        /* of the tolerance: how far Newton's iteration is from its limit when it ends */
#define SLOW 1e-3         /* contraction from which on a new J is worth its price in the next step */
#define ADAPTIVE_ROUNDS 10
#define FIXED_ROUNDS 50
#define GROWTHS 3         /* of the change, under fixed steps: what was at rest may be moved by what moves, a round later */
#define FAR 4.0           /* the step before is no guide to one that is so many times longer */
#define LEAST_SCALE 1e-6  /* of the largest component of x and z: no component has to be better than this part of it */
#define ROUND_OFF 1e-8    /* where an iteration that stands still stands still on account of rounding */

/* What is known from before, first in the work space of its own. */
enum { BEFORE, FACTORED, CONTRACTION, EXPECTED, FRESH, TRIALS, MEMORY };

/* The parts of the work space: stages z of the trial and of the step before, the residual and slopes of the stages, J,
   the factors of gamma - h J and of [alpha - h J, -beta; beta, alpha - h J], and their pivots. */
typedef struct {
    const mbs_collocation *m;
    int n, s;
    double *memory, *z, *before, *residual, *slopes, *jacobian, *single, *pairs, *single_rows, *pair_rows;
} parts;

static int has_single(const mbs_collocation *m)
{
    return m->gamma > 0.0 || m->error;
}

static parts parts_of(const mbs_run *r)
{
    const mbs_collocation *m = r->method->collocation;
    int n = r->n, s = m->stages;
    parts p = {.m = m, .n = n, .s = s, .memory = r->own};
    p.z = p.memory + MEMORY;
    p.before = p.z + s * n;
    p.residual = p.before + s * n;
    p.slopes = p.residual + s * n;
    p.jacobian = p.slopes + s * n;
    p.single = p.jacobian + n * n;
    p.single_rows = p.single + (has_single(m) ? n * n : 0);
    p.pairs = p.single_rows + (has_single(m) ? n : 0);
    p.pair_rows = p.pairs + (m->beta > 0.0 ? 4 * n * n : 0);
    return p;
}

static long long own_work(const mbs_problem *problem)
{
    const mbs_collocation *m = problem->method->collocation;
    long long n = problem->system->nq + problem->system->nu;
    return MEMORY + 4 * m->stages * n + n * n + (has_single(m) ? n * n + n : 0) + (m->beta > 0.0 ? 4 * n * n + 2 * n : 0);
}

static void restart(mbs_run *r)
{
    mbs_fill(MEMORY, 0.0, r->own);
}

/* ---- linear equations ---- */

/* L U = P a in the place of a; rows[k] is the row that took place k. 0 if a is singular. */
static int factorise(int n, double *a, double *rows)
{
    for (int k = 0; k < n; ++k) {
        int pivot = k;
        for (int i = k + 1; i < n; ++i)
            if (fabs(a[i * n + k]) > fabs(a[pivot * n + k]))
                pivot = i;
        rows[k] = pivot;
        for (int j = 0; j < n && pivot != k; ++j) {
            double kept = a[k * n + j];
            a[k * n + j] = a[pivot * n + j];
            a[pivot * n + j] = kept;
        }
        if (!(fabs(a[k * n + k]) > 0.0))
            return 0;
        for (int i = k + 1; i < n; ++i) {
            double factor = a[i * n + k] = a[i * n + k] / a[k * n + k];
            if (factor != 0.0)
                for (int j = k + 1; j < n; ++j)
                    a[i * n + j] -= factor * a[k * n + j];
        }
    }
    return 1;
}

static void substitute(int n, const double *a, const double *rows, double *b)
{
    for (int k = 0; k < n; ++k) {
        int pivot = (int)rows[k];
        double kept = b[k];
        b[k] = b[pivot];
        b[pivot] = kept;
    }
    for (int k = 0; k < n; ++k)
        for (int i = k + 1; i < n; ++i)
            b[i] -= a[i * n + k] * b[k];
    for (int k = n - 1; k >= 0; --k) {
        b[k] /= a[k * n + k];
        for (int i = 0; i < k; ++i)
            b[i] -= a[i * n + k] * b[k];
    }
}

/* Write diagonal - h J into an n x n part of a matrix whose rows are `width` long. */
static void write_block(const parts *p, double diagonal, double h, int width, double *to)
{
    for (int i = 0; i < p->n; ++i)
        for (int j = 0; j < p->n; ++j)
            to[i * width + j] = (i == j ? diagonal : 0.0) - h * p->jacobian[i * p->n + j];
}

static int factorise_blocks(mbs_run *r, const parts *p, double h)
{
    int n = p->n, regular = 1;
    const mbs_collocation *m = p->m;
    ++r->state->factorisations;
    if (has_single(m)) {
        write_block(p, m->filter, h, n, p->single);
        regular = factorise(n, p->single, p->single_rows);
    }
    if (regular && m->beta > 0.0) {
        mbs_fill(4 * n * n, 0.0, p->pairs);
        write_block(p, m->alpha, h, 2 * n, p->pairs);
        write_block(p, m->alpha, h, 2 * n, p->pairs + 2 * n * n + n);
        for (int i = 0; i < n; ++i) {
            p->pairs[i * 2 * n + n + i] = -m->beta;
            p->pairs[(n + i) * 2 * n + i] = m->beta;
        }
        regular = factorise(2 * n, p->pairs, p->pair_rows);
    }
    p->memory[FACTORED] = regular ? h : 0.0;
    return regular;
}

/* to_i = sum_j matrix_ij from_j for the stages. */
static void transform(const parts *p, const double *matrix, const double *from, double *to)
{
    mbs_fill(p->s * p->n, 0.0, to);
    for (int i = 0; i < p->s; ++i)
        for (int j = 0; j < p->s; ++j)
            for (int k = 0; k < p->n; ++k)
                to[i * p->n + k] += matrix[i * p->s + j] * from[j * p->n + k];
}

/* ---- Newton's iteration ---- */

static void evaluate_jacobian(mbs_run *r, const parts *p)
{
    double *out[1] = {p->jacobian};
    mbs_call(r, r->system->jacobian, r->state->t, r->x, out);
    ++r->state->jacobians;
    p->memory[FRESH] = 1.0;
    p->memory[FACTORED] = 0.0;
    p->memory[CONTRACTION] = 0.0;
    p->memory[EXPECTED] = 1.0;
}

/* The polynomial of the step before, led on; zero where there is none. */
static void predict(const parts *p, double h)
{
    const mbs_collocation *m = p->m;
    double ratio = p->memory[BEFORE] > 0.0 ? h / p->memory[BEFORE] : HUGE_VAL;
    mbs_fill(p->s * p->n, 0.0, p->z);
    for (int i = 0; i < p->s && ratio <= FAR; ++i)
        for (int j = 0; j < p->s; ++j) {
            double theta = 1.0 + m->c[i] * ratio, there = 0.0, here = 0.0;
            for (int power = p->s - 1; power >= 0; --power) {
                there = (there + m->dense[j * p->s + power]) * theta;
                here += m->dense[j * p->s + power];
            }
            for (int k = 0; k < p->n; ++k)
                p->z[i * p->n + k] += (there - here) * p->before[j * p->n + k];
        }
}

/* slopes = T^-1 (h start f(t, x) + h f(t + c h, x + z) - W z) */
static int find_residual(mbs_run *r, const parts *p, double h)
{
    const mbs_collocation *m = p->m;
    transform(p, m->w, p->z, p->residual);
    for (int i = 0; i < p->s; ++i) {
        double *z = p->z + i * p->n, *slope = p->slopes + i * p->n, *residual = p->residual + i * p->n;
        for (int k = 0; k < p->n; ++k)
            r->stage[k] = r->x[k] + z[k];
        int status = mbs_derivative(r, r->state->t + m->c[i] * h, r->stage, slope);
        if (status != MBS_RUNNING)
            return status;
        for (int k = 0; k < p->n; ++k)
            residual[k] = h * (m->start[i] * r->slope[k] + slope[k]) - residual[k];
    }
    transform(p, m->inverse, p->residual, p->slopes);
    return MBS_RUNNING;
}

/* residual = the change of z */
static void find_change(const parts *p)
{
    double *rest = p->slopes;
    if (p->m->gamma > 0.0) {
        substitute(p->n, p->single, p->single_rows, rest);
        rest += p->n;
    }
    if (p->m->beta > 0.0)
        substitute(2 * p->n, p->pairs, p->pair_rows, rest);
    transform(p, p->m->transform, p->slopes, p->residual);
}

/* The scale of each component: of the tolerance, or for fixed steps of x and z themselves. */
static void find_scales(mbs_run *r, const parts *p, double *scales)
{
    const mbs_problem *problem = r->problem;
    for (int k = 0; k < p->n; ++k) {
        scales[k] = fabs(r->x[k]);
        for (int i = 0; i < p->s && problem->step > 0.0; ++i)
            if (fabs(p->z[i * p->n + k]) > scales[k])
                scales[k] = fabs(p->z[i * p->n + k]);
    }
    double least = LEAST_SCALE * mbs_largest(p->n, scales);
    for (int k = 0; k < p->n; ++k)
        if (!(problem->step > 0.0))
            scales[k] = problem->atol + problem->rtol * scales[k];
        else if (!(scales[k] > least))
            scales[k] = least > 0.0 ? least : 1.0;
}

/* Apply the change; its size in the mean square, or for fixed steps its largest entry, in units of the scales. */
static double change_size(mbs_run *r, const parts *p, int *worst)
{
    double sum = 0.0, most = -1.0;
    find_scales(r, p, r->stage);
    for (int i = 0; i < p->s * p->n; ++i) {
        double part = p->residual[i] / r->stage[i % p->n];
        p->z[i] += p->residual[i];
        sum += part * part;
        if (fabs(part) > most) {
            most = fabs(part);
            *worst = i % p->n;
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
               (size >= before && size <= ROUND_OFF);
    double wanted = rtol > 0.0 && 10.0 * MBS_EPSILON / rtol > KAPPA ? 10.0 * MBS_EPSILON / rtol : KAPPA;
    return 10.0 * size <= wanted || (contraction < 1.0 && rest <= wanted);
}

static int iterate(mbs_run *r, const parts *p, double h)
{
    int rounds = r->problem->step > 0.0 ? FIXED_ROUNDS : ADAPTIVE_ROUNDS, growths = 0, worst = 0, status;
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
        if (converged(r, size, before, round == 0 && r->problem->step > 0.0 ? 1.0 : contraction))
            return MBS_RUNNING;
        growths += round > 0 && contraction >= 1.0;
        if (!(size < HUGE_VAL) || growths > (r->problem->step > 0.0 ? GROWTHS : 0))
            break;
        before = size;
    }
    return mbs_failed(r, MBS_NOT_CONVERGED, r->state->t, worst);
}

/* Solve for z; where the old J does not do, with a new one. */
static int find_stages(mbs_run *r, const parts *p, double h)
{
    int status = MBS_NOT_CONVERGED;
    if (!(p->memory[FRESH] > 0.0) && !(p->memory[BEFORE] > 0.0 && p->memory[CONTRACTION] <= SLOW))
        evaluate_jacobian(r, p);
    for (;;) {
        int regular = p->memory[FACTORED] == h || factorise_blocks(r, p, h);
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
static int estimate(mbs_run *r, const parts *p, double h)
{
    int worst, status;
    const double *slope = r->slope;
    for (int round = 0;; ++round) {
        for (int k = 0; k < p->n; ++k)
            r->error[k] = h * slope[k];
        for (int i = 0; i < p->s; ++i)
            for (int k = 0; k < p->n; ++k)
                r->error[k] += p->m->error[i] * p->z[i * p->n + k];
        substitute(p->n, p->single, p->single_rows, r->error);
        int rough = p->memory[BEFORE] == 0.0 || p->memory[TRIALS] > 1.0;
        if (round > 0 || !rough || mbs_scaled_norm(r, r->error, r->x, r->x_new, &worst) <= 1.0)
            return MBS_RUNNING;
        for (int k = 0; k < p->n; ++k)
            r->stage[k] = r->x[k] + r->error[k];
        if ((status = mbs_derivative(r, r->state->t, r->stage, p->slopes)) != MBS_RUNNING)
            return status;
        slope = p->slopes;
    }
}

static int attempt(mbs_run *r, double h, double t_new)
{
    parts p = parts_of(r);
    p.memory[TRIALS] += 1.0;
    int status = find_stages(r, &p, h);
    if (status != MBS_RUNNING)
        return status;
    mbs_fill(p.n, 0.0, r->x_new);
    for (int i = 0; i < p.s; ++i)
        if (p.m->end[i] != 0.0)
            for (int k = 0; k < p.n; ++k)
                r->x_new[k] += p.m->end[i] * p.z[i * p.n + k];
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
    parts p = parts_of(r);
    mbs_copy(p.s * p.n, p.z, p.before);
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
    parts p = parts_of(r);
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
            x[k] += weight * p.z[i * p.n + k];
    }
    for (int k = 0; k < p.n; ++k)
        x[k] += r->x[k];
}

const mbs_stepper mbs_implicit = {own_work, restart, attempt, finish, advance, extend, value, 1.2};
