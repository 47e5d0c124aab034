/* The equations of the stages of an implicit method, and their matrices in the blocks of W.

   Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, sections IV.8 and VII.4. */
#include "stages.h"


static int has_single(const mbs_collocation *m)
{
    return m->gamma > 0.0 || m->error;
}

static int row_count(const mbs_system *system)
{
    return system->index_2 ? 2 * system->ns : 0;
}

static long long choice_work(const mbs_system *s)
{
    int columns = s->nq > s->nu ? s->nq : s->nu;
    return s->index_2 ? s->ns * columns + MBS_FACTORS(s->ns, columns) + s->ns : 0;
}

long long mbs_stages_work(const mbs_problem *problem, int memory)
{
    const mbs_collocation *m = problem->method->collocation;
    long long n = problem->system->nq + problem->system->nu, rows = row_count(problem->system), size = n + rows;
    long long matrices = (has_single(m) ? size * size + size : 0) + (m->beta > 0.0 ? 4 * size * size + 2 * size : 0);
    return memory + 4 * m->stages * size + rows + 4 * size + 1 + size * n + n * rows + choice_work(problem->system) +
           matrices;
}

mbs_stages mbs_stages_of(const mbs_run *r, int memory)
{
    const mbs_collocation *m = r->method->collocation;
    int n = r->n, rows = row_count(r->system), size = n + rows, s = m->stages;
    mbs_stages p = {.m = m, .n = n, .rows = rows, .size = size, .s = s, .memory = r->own};
    p.z = p.memory + memory;
    p.before = p.z + s * size;
    p.residual = p.before + s * size;
    p.rest = p.residual + s * size;
    p.multipliers = p.rest + s * size;
    p.y = p.multipliers + rows;
    p.packed = p.y + size;
    p.active = p.packed + 2 * size;
    p.by_state = p.active + size + 1;
    p.by_multipliers = p.by_state + size * n;
    p.choice = p.by_multipliers + n * rows;
    p.single = p.choice + choice_work(r->system);
    p.single_rows = p.single + (has_single(m) ? size * size : 0);
    p.pairs = p.single_rows + (has_single(m) ? size : 0);
    p.pair_rows = p.pairs + (m->beta > 0.0 ? 4 * size * size : 0);
    return p;
}

/* ---- equations ---- */

void mbs_first_multipliers(mbs_run *r, const mbs_stages *p)
{
    int ns = p->rows / 2;
    double *out[4] = {p->y, p->y + r->system->nq, p->multipliers + ns, r->report};
    if (!p->rows)
        return;
    mbs_fill(ns, 0.0, p->multipliers);
    r->known_time = NAN; /* this report is of no known slope */
    mbs_call(r, r->system->state_derivative, r->state->t, r->x, out);
    ++r->state->evaluations;
}

int mbs_stage_values(mbs_run *r, const mbs_stages *p, double t, const double *y, double *values)
{
    double *out[4] = {values, values + r->system->nq, values + p->n, values + p->n + p->rows / 2};
    if (!p->rows || r->state->near) {
        mbs_fill(p->rows, 0.0, values + p->n);
        return mbs_derivative(r, t, y, values);
    }
    t = mbs_time_of_slope(r, t, y);
    r->further = y + p->n;
    mbs_call(r, r->system->index_2, t, y, out);
    ++r->state->evaluations;
    return mbs_all_finite(r, t, values);
}

/* Append the independent ones of the rows from `first` on, whose derivatives by part of the state begin at `column`. */
static void choose(const mbs_run *r, const mbs_stages *p, int first, int column, int columns)
{
    int ns = p->rows / 2;
    const mbs_pattern pattern = {ns, columns, 0};
    double *matrix = p->choice, *independent = matrix + ns * columns, *factors = independent + ns;
    for (int i = 0; i < ns; ++i)
        mbs_copy(columns, p->by_state + (first + i) * p->n + column, matrix + i * columns);
    mbs_factorise(&pattern, matrix, r->problem->independent, factors);
    mbs_independent(&pattern, factors, independent);
    for (int i = 0; i < ns; ++i) {
        if (independent[i] > 0.0)
            p->active[(int)p->active[p->size]++] = first + i;
        else
            p->multipliers[first - p->n + i] = 0.0;
    }
}

/* The derivative of slopes at states put onto the constraints, by differences: it tells what forces do, but nothing of what
   is off the constraints. */
static void differentiate_slope(mbs_run *r, const mbs_stages *p)
{
    double *slope = p->packed, *other = slope + p->n, part = MBS_DIFFERENCE * r->state->start;
    if (mbs_slope_on_rows(r, r->x, slope) != MBS_RUNNING)
        return;
    for (int j = 0; j < p->n; ++j) {
        double change = part * (1.0 + fabs(r->x[j]));
        mbs_copy(p->n, r->x, p->y);
        p->y[j] += change;
        int status = mbs_slope_on_rows(r, p->y, other);
        for (int i = 0; i < p->n && status == MBS_RUNNING; ++i)
            p->by_state[i * p->n + j] = (other[i] - slope[i]) / change;
    }
}

void mbs_stage_jacobian(mbs_run *r, const mbs_stages *p)
{
    const mbs_system *s = r->system;
    double *out[1] = {p->by_state};
    ++r->state->jacobians;
    for (int k = 0; k < p->n; ++k)
        p->active[k] = k;
    p->active[p->size] = p->n;
    if (r->state->near) {
        mbs_fill(p->n * p->n, 0.0, p->by_state);
        mbs_fill(p->rows, 0.0, p->multipliers);
        if (r->state->stiff)
            differentiate_slope(r, p);
        return;
    }
    r->further = p->multipliers;
    mbs_call(r, p->rows ? s->index_2_by_state : s->jacobian, r->state->t, r->x, out);
    if (!p->rows)
        return;
    out[0] = p->by_multipliers;
    mbs_call(r, s->index_2_by_multipliers, r->state->t, r->x, out);
    choose(r, p, p->n, 0, s->nq);
    choose(r, p, p->n + s->ns, s->nq, s->nu);
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

static int active_count(const mbs_stages *p)
{
    return (int)p->active[p->size];
}

static double derivative(const mbs_stages *p, int row, int column)
{
    if (column < p->n)
        return p->by_state[row * p->n + column];
    return row < p->n ? p->by_multipliers[row * p->rows + column - p->n] : 0.0;
}

/* Write diagonal E - h J, for what is active, into a part of a matrix whose rows are `width` long. */
static void write_block(const mbs_stages *p, double diagonal, double h, int width, double *to)
{
    for (int i = 0; i < active_count(p); ++i)
        for (int j = 0; j < active_count(p); ++j)
            to[i * width + j] = (i == j && i < p->n ? diagonal : 0.0) -
                                h * derivative(p, (int)p->active[i], (int)p->active[j]);
}

int mbs_stage_factorise(const mbs_stages *p, double h)
{
    int a = active_count(p), regular = 1;
    const mbs_collocation *m = p->m;
    if (has_single(m)) {
        write_block(p, m->filter, h, a, p->single);
        regular = factorise(a, p->single, p->single_rows);
    }
    if (regular && m->beta > 0.0) {
        mbs_fill(4 * a * a, 0.0, p->pairs);
        write_block(p, m->alpha, h, 2 * a, p->pairs);
        write_block(p, m->alpha, h, 2 * a, p->pairs + 2 * a * a + a);
        for (int i = 0; i < p->n; ++i) {
            p->pairs[i * 2 * a + a + i] = -m->beta;
            p->pairs[(a + i) * 2 * a + i] = m->beta;
        }
        regular = factorise(2 * a, p->pairs, p->pair_rows);
    }
    return regular;
}

/* Solve for the active parts of `count` vectors (size) one after the other; the rest of them becomes zero. */
static void solve_active(const mbs_stages *p, const double *factors, const double *rows, int count, double *vectors)
{
    int a = active_count(p);
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < a; ++k)
            p->packed[i * a + k] = vectors[i * p->size + (int)p->active[k]];
    substitute(count * a, factors, rows, p->packed);
    mbs_fill(count * p->size, 0.0, vectors);
    for (int i = 0; i < count; ++i)
        for (int k = 0; k < a; ++k)
            vectors[i * p->size + (int)p->active[k]] = p->packed[i * a + k];
}

void mbs_stage_solve(const mbs_stages *p)
{
    double *rest = p->rest;
    if (p->m->gamma > 0.0) {
        solve_active(p, p->single, p->single_rows, 1, rest);
        rest += p->size;
    }
    if (p->m->beta > 0.0)
        solve_active(p, p->pairs, p->pair_rows, 2, rest);
}

void mbs_stage_filter(const mbs_stages *p, double *error)
{
    mbs_fill(p->size, 0.0, p->y);
    mbs_copy(p->n, error, p->y);
    solve_active(p, p->single, p->single_rows, 1, p->y);
    mbs_copy(p->n, p->y, error);
}
