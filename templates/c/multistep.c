/* Methods that look back over steps of one length: Adams-Bashforth-Moulton, Stoermer, Stoermer-Verlet. Steps without
   enough of a past are those of an explicit Runge-Kutta method, the starter, whose stages stand first in r->own. */
#include "pairing.h"
#include "stepper.h"


/* What stands in r->own after the starter's stages. */
typedef struct {
    double *count;        /* points before the present one */
    double *spacing;      /* their distance */
    double *by_starter;   /* whether the starter takes the step */
    double *displacement; /* (nu) of the step on trial, where the method needs it */
    double *points;       /* newest first: x (n), slope (n), displacement (nu) of the step that led away from it */
    double *new;          /* (n) slope at the predicted end */
    double *predicted;    /* (n) */
    double *second;       /* (nu) each: second derivatives of displacements, one ahead, at present, at the points */
    double *rates;        /* (nu) */
    int width;            /* of a point */
} past;

static long long work(const mbs_problem *problem)
{
    const mbs_system *s = problem->system;
    long long n = s->nq + s->nu, points = problem->method->past;
    return mbs_explicit.work(problem) + 3 + 3 * s->nu + points * (2 * n + s->nu) + 2 * n + (points + 1) * s->nu;
}

static past past_of(const mbs_run *r)
{
    int nu = r->system->nu, points = r->method->past;
    past p = {.count = r->own + mbs_explicit.work(r->problem), .width = 2 * r->n + nu};
    p.spacing = p.count + 1;
    p.by_starter = p.spacing + 1;
    p.displacement = p.by_starter + 1;
    p.points = p.displacement + nu;
    p.new = p.points + points * p.width;
    p.predicted = p.new + r->n;
    p.second = p.predicted + r->n;
    p.rates = p.second + (points + 2) * nu;
    return p;
}

static int same_length(double h, double other)
{
    return fabs(h - other) <= MBS_SAME_LENGTH * h;
}

/* Whether a step over h can look back at all the points it needs. */
static int fits(const mbs_run *r, const past *p, double h)
{
    return *p->count == r->method->past && same_length(h, *p->spacing);
}

/* Let the step from x on be the newest; with those of another length nothing is left. */
static void add_point(mbs_run *r)
{
    past p = past_of(r);
    int most = r->method->past;
    if (!same_length(r->state->h, *p.spacing))
        *p.count = 0.0;
    *p.spacing = r->state->h;
    for (int i = (most - 1) * p.width - 1; i >= 0; --i)
        p.points[i + p.width] = p.points[i];
    mbs_copy(r->n, r->x, p.points);
    mbs_copy(r->n, r->slope, p.points + r->n);
    mbs_copy(r->system->nu, p.displacement, p.points + 2 * r->n);
    *p.count = *p.count < most ? *p.count + 1.0 : most;
}

static void forget(mbs_run *r)
{
    *past_of(r).count = 0.0;
}

static void nothing(mbs_run *r)
{
    (void)r;
}

/* sum += weight v, unless the weight is zero. */
static void accumulate(int n, double weight, const double *v, double *sum)
{
    if (weight != 0.0)
        for (int i = 0; i < n; ++i)
            sum[i] += weight * v[i];
}

static int ready(mbs_run *r, double t_new)
{
    return mbs_all_finite(r, t_new, r->x_new);
}

static int attempt_start(mbs_run *r, const past *p, double h, double t_new)
{
    *p->by_starter = 1.0;
    return mbs_explicit.attempt(r, h, t_new);
}

static int finish(mbs_run *r, double t_new, int changed)
{
    if (*past_of(r).by_starter != 0.0)
        return mbs_explicit.finish(r, t_new, changed);
    return mbs_derivative(r, t_new, r->x_new, r->slope_new);
}

static int extend(mbs_run *r)
{
    return *past_of(r).by_starter != 0.0 ? mbs_explicit.extend(r) : MBS_RUNNING;
}

/* The polynomial through states and slopes at 0, 1 and, where the point before is, -1. */
static void hermite(const mbs_run *r, const double *back, double theta, double *x)
{
    double here = 1.0 - theta * theta, ahead = 0.5 * theta * (theta + 1.0), before = 0.5 * theta * (theta - 1.0);
    here = here * here;
    ahead = ahead * ahead;
    before = before * before;
    double slope_here = here * theta, slope_ahead = ahead * (theta - 1.0), slope_before = before * (theta + 1.0);
    ahead = ahead * (4.0 - 3.0 * theta);
    before = before * (4.0 + 3.0 * theta);
    for (int i = 0; i < r->n; ++i) {
        double slope = slope_here * r->slope[i] + slope_ahead * r->slope_new[i] + slope_before * back[r->n + i];
        x[i] = here * r->x[i] + ahead * r->x_new[i] + before * back[i] + r->state->h * slope;
    }
}

static void value(const mbs_run *r, double theta, double *x)
{
    past p = past_of(r);
    if (*p.by_starter != 0.0)
        mbs_explicit.value(r, theta, x);
    else if (r->method->past > 0)
        hermite(r, p.points, theta, x);
    else
        mbs_hermite(r, theta, x);
}

/* ---- Adams-Bashforth-Moulton ---- */

static int attempt_adams(mbs_run *r, double h, double t_new)
{
    const mbs_method *m = r->method;
    past p = past_of(r);
    int status;
    if (!fits(r, &p, h))
        return attempt_start(r, &p, h, t_new);
    *p.by_starter = 0.0;
    mbs_fill(r->n, 0.0, p.predicted);
    for (int j = 0; j <= m->past; ++j)
        accumulate(r->n, m->predictor[j], j ? p.points + (j - 1) * p.width + r->n : r->slope, p.predicted);
    for (int i = 0; i < r->n; ++i)
        p.predicted[i] = r->x[i] + h * p.predicted[i];
    if ((status = mbs_derivative(r, t_new, p.predicted, p.new)) != MBS_RUNNING)
        return status;
    mbs_fill(r->n, 0.0, r->x_new);
    accumulate(r->n, m->corrector[0], p.new, r->x_new);
    for (int j = 0; j < m->past; ++j)
        accumulate(r->n, m->corrector[j + 1], j ? p.points + (j - 1) * p.width + r->n : r->slope, r->x_new);
    for (int i = 0; i < r->n; ++i)
        r->x_new[i] = r->x[i] + h * r->x_new[i];
    return ready(r, t_new);
}

const mbs_stepper mbs_adams = {work, forget, attempt_adams, finish, add_point, extend, value, 1.0};

/* ---- Stoermer-Verlet ---- */

static int attempt_verlet(mbs_run *r, double h, double t_new)
{
    const mbs_system *s = r->system;
    past p = past_of(r);
    const double *u = r->x + s->nq, *udot = r->slope + s->nq;
    int status;
    *p.by_starter = 0.0;
    for (int i = 0; i < s->nu; ++i) {
        p.rates[i] = h * (u[i] + (0.5 * h) * udot[i]);
        p.predicted[s->nq + i] = u[i] + h * udot[i];
    }
    mbs_moved(s, r->x, p.rates, p.predicted);
    if ((status = mbs_derivative(r, t_new, p.predicted, p.new)) != MBS_RUNNING)
        return status;
    mbs_copy(s->nq, p.predicted, r->x_new);
    for (int i = 0; i < s->nu; ++i)
        r->x_new[s->nq + i] = u[i] + (0.5 * h) * (udot[i] + p.new[s->nq + i]);
    return ready(r, t_new);
}

const mbs_stepper mbs_verlet = {work, nothing, attempt_verlet, finish, nothing, extend, value, 1.0};

/* ---- Stoermer ---- */

/* An upper bound of the angle by which a ball has turned since the oldest point. */
static double turned(const mbs_run *r, const past *p)
{
    double sum = 0.0;
    for (int j = 0; j < r->method->past; ++j)
        sum += mbs_farthest_turn(r->system, p->points + j * p->width + 2 * r->n);
    return sum;
}

/* Second derivatives at present and at the points, from second + nu on; a ball's displacement is counted from here. */
static void look_back(const mbs_run *r, const past *p)
{
    const mbs_system *s = r->system;
    mbs_copy(s->nu, r->slope + s->nq, p->second + s->nu);
    for (int j = 0; j < r->method->past; ++j) {
        const double *point = p->points + j * p->width;
        mbs_displacement(s, r->x, point, p->rates);
        mbs_accelerations(s, p->rates, point + s->nq, point + r->n + s->nq, p->second + (j + 2) * s->nu);
    }
}

/* u = the speeds at the end for displacements that change at displacement / h + h sum_j weights_j second_j. */
static void end_speeds(const mbs_run *r, const past *p, double h, const double *weights, const double *second, double *u)
{
    const mbs_system *s = r->system;
    mbs_fill(s->nu, 0.0, p->rates);
    for (int j = 0; j <= r->method->past; ++j)
        accumulate(s->nu, weights[j], second + j * s->nu, p->rates);
    for (int i = 0; i < s->nu; ++i)
        p->rates[i] = p->displacement[i] / h + h * p->rates[i];
    mbs_speeds(s, p->displacement, p->rates, u);
}

static int attempt_stoermer(mbs_run *r, double h, double t_new)
{
    const mbs_method *m = r->method;
    const mbs_system *s = r->system;
    past p = past_of(r);
    const double *before = p.points + 2 * r->n;
    int status;
    if (!fits(r, &p, h) || h < MBS_SHORTEST_STEP * r->problem->step || turned(r, &p) > MBS_FARTHEST_TURN)
        return attempt_start(r, &p, h, t_new);
    *p.by_starter = 0.0;
    look_back(r, &p);
    mbs_fill(s->nu, 0.0, p.displacement);
    for (int j = 0; j <= m->past; ++j)
        accumulate(s->nu, m->position[j], p.second + (j + 1) * s->nu, p.displacement);
    for (int i = 0; i < s->nu; ++i)
        p.displacement[i] = before[i] + (h * h) * p.displacement[i];
    mbs_moved(s, r->x, p.displacement, p.predicted);
    end_speeds(r, &p, h, m->predictor, p.second + s->nu, p.predicted + s->nq);
    if ((status = mbs_derivative(r, t_new, p.predicted, p.new)) != MBS_RUNNING)
        return status;
    mbs_accelerations(s, p.displacement, p.predicted + s->nq, p.new + s->nq, p.second);
    mbs_copy(s->nq, p.predicted, r->x_new);
    end_speeds(r, &p, h, m->corrector, p.second, r->x_new + s->nq);
    return ready(r, t_new);
}

/* What settling has moved belongs to the step's displacement; `predicted` still holds the coordinates before. */
static int finish_stoermer(mbs_run *r, double t_new, int changed)
{
    const mbs_system *s = r->system;
    past p = past_of(r);
    if (*p.by_starter != 0.0) {
        mbs_displacement(s, r->x, r->x_new, p.displacement);
    } else {
        mbs_displacement(s, p.predicted, r->x_new, p.rates);
        for (int i = 0; i < s->nu; ++i)
            p.displacement[i] += p.rates[i];
    }
    return finish(r, t_new, changed);
}

const mbs_stepper mbs_stoermer = {work, forget, attempt_stoermer, finish_stoermer, add_point, extend, value, 1.0};
