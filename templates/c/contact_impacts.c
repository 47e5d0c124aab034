/* Impacts of contacts, and when bounces come to rest. */
#include "contact_laws.h"
#include "vectors.h"

#include <string.h>

/* The acceleration with which an element closes. */
double mbs_contacts_falling(const mbs_contact_run *c, int e, const double *udot)
{
    const double *free = c->outputs[MBS_CONTACTS_FREE], *row = c->laws.jacobian + mbs_contacts_normals[e] * NU;
    double total = -c->laws.right[mbs_contacts_normals[e]];
    for (int k = 0; k < NU; ++k)
        total += row[k] * (udot[k] - free[k]);
    return -total;
}

/* ---- impacts ---- */

static double response(const mbs_contact_run *c, int row, const double *x) { return dot(NU, row_of(c, row), x); }

/* What a unit impulse along a row does, with those of constraints that it calls for. */
static void pushed_by(const mbs_contact_run *c, int row, double *x)
{
    double matrix[FIXED * FIXED + 1], right[FIXED + 1], z[FIXED + 1], multipliers[FIXED + 1], report[3];
    const mbs_pattern pattern = {FIXED, FIXED, 0};
    mbs_copy(NU, push_of(c, row), x);
    if (FIXED == 0)
        return;
    for (int i = 0; i < FIXED; ++i) {
        right[i] = -response(c, i, x);
        for (int j = 0; j < FIXED; ++j)
            matrix[i * FIXED + j] = response(c, i, push_of(c, j));
    }
    mbs_factorise(&pattern, matrix, FIXED, (double *)c->room);
    mbs_substitute(&pattern, (double *)c->room, right, z, multipliers, report);
    for (int j = 0; j < FIXED; ++j)
        for (int k = 0; k < NU; ++k)
            x[k] += z[j] * push_of(c, j)[k];
}

/* Strike one element alone by its normal impulse p, over which speeds are linear while it slips one way or sticks (Routh):
   until it is compressed, and on to (1 + e) p. Adds to x, and returns p; negative where friction wedges it. */
static double strike_alone(const mbs_contact_run *c, int e, double restitution, double *v, double *x)
{
    int p = mbs_contacts_parts[e], normal = mbs_contacts_normals[e], tangent = p < 0 ? -1 : mbs_contacts_tangents[p];
    double push[2][NU + 1] = {{0.0}}, K[2][2] = {{0.0}}, at = v[normal], slip = p < 0 ? 0.0 : v[tangent];
    double total = 0.0, along = 0.0, goal = HUGE_VAL, small = 0.0, static_mu = 0.0, mu = 0.0;
    pushed_by(c, normal, push[0]);
    K[0][0] = response(c, normal, push[0]);
    if (p >= 0) {
        static_mu = c->laws.coefficients[2 * p];
        mu = c->laws.coefficients[2 * p + 1];
        pushed_by(c, tangent, push[1]);
        K[0][1] = response(c, normal, push[1]);
        K[1][0] = response(c, tangent, push[0]);
        K[1][1] = response(c, tangent, push[1]);
        small = fmax(fabs(at) / length_of(row_of(c, normal)), fabs(slip) / length_of(row_of(c, tangent)));
        small *= MBS_TIED * length_of(row_of(c, tangent));
    }
    for (int round = 0; round < 8; ++round) {
        double f = 0.0, change, turning, stop = HUGE_VAL, end, dp;
        int slides = fabs(slip) > small, sticks = 0;
        if (p >= 0 && !slides) {
            f = K[1][1] ? -K[1][0] / K[1][1] : 0.0;
            sticks = fabs(f) <= static_mu * (1.0 + MBS_TIED);
        }
        if (p >= 0 && !sticks)
            f = -mu * (slides ? (slip > 0.0 ? 1.0 : -1.0) : K[1][0] > 0.0 ? 1.0 : -1.0);
        change = K[0][0] + K[0][1] * f;
        turning = sticks || p < 0 ? 0.0 : K[1][0] + K[1][1] * f;
        if (slides && slip * turning < 0.0)
            stop = -slip / turning;
        end = goal < HUGE_VAL ? goal - total : change > 0.0 ? -at / change : HUGE_VAL;
        dp = fmin(end, stop);
        if (!isfinite(dp))
            return -1.0;
        total += dp;
        along += dp * f;
        at = end <= stop && goal == HUGE_VAL ? 0.0 : at + dp * change;
        slip = stop <= end ? 0.0 : slip + dp * turning;
        if (end <= stop) {
            if (goal < HUGE_VAL || restitution == 0.0)
                break;
            goal = (1.0 + restitution) * total;
        }
    }
    for (int k = 0; k < NU; ++k)
        x[k] += total * push[0][k] + (p < 0 ? 0.0 : along * push[1][k]);
    return total;
}

static int pushes(const mbs_contact_run *c, int row, int other)
{
    double size = length_of(row_of(c, row)) * length_of(push_of(c, other));
    return fabs(dot(NU, row_of(c, row), push_of(c, other))) > MBS_CONNECTED * size;
}

/* Whether elements push each other, by normals, friction or constraints. */
static int connected(const mbs_contact_run *c, int one, int other)
{
    int rows[2][2], counts[2], pair[2] = {one, other};
    for (int i = 0; i < 2; ++i) {
        rows[i][0] = mbs_contacts_normals[pair[i]];
        counts[i] = 1;
        if (mbs_contacts_parts[pair[i]] >= 0)
            rows[i][counts[i]++] = mbs_contacts_tangents[mbs_contacts_parts[pair[i]]];
    }
    if (FIXED)
        return 1;
    for (int i = 0; i < counts[0]; ++i)
        for (int j = 0; j < counts[1]; ++j)
            if (pushes(c, rows[0][i], rows[1][j]) || pushes(c, rows[1][j], rows[0][i]))
                return 1;
    return 0;
}

static int rubs(const mbs_contact_run *c, int e)
{
    int p = mbs_contacts_parts[e];
    return p >= 0 && (c->laws.coefficients[2 * p] > 0.0 || c->laws.coefficients[2 * p + 1] > 0.0);
}

/* Strike elements at once: by Newton's coefficients where nothing rubs, else without bouncing. */
static mbs_contacts_status strike_together(const mbs_contact_run *c, const int *some, const double *e, const double *v,
                                           double *x, double *impulses)
{
    mbs_contacts_mode found;
    laws l = {some, {0.0}, {0.0}, {0.0}, {0.0}, 0.0, {0}};
    double largest = 0.0;
    int rough = 0, bounces = 0;
    for (int k = 0; k < ROWS; ++k)
        l.right[k] = -v[k];
    for (int k = 0; k < ELEMENTS; ++k)
        if (some[k]) {
            double back = -e[k] * fmin(v[mbs_contacts_normals[k]], 0.0);
            rough |= rubs(c, k);
            bounces |= back > 0.0;
            l.right[mbs_contacts_normals[k]] += back;
        }
    if (rough && bounces)
        return MBS_CONTACTS_IMPACT;
    mbs_contacts_status status = mbs_contacts_find(c, &l, NULL, &found);
    if (status != MBS_CONTACTS_GOES_ON)
        return status == MBS_CONTACTS_NO_STATE ? MBS_CONTACTS_IMPACT : status;
    for (int k = 0; k < ROWS; ++k)
        largest = fmax(largest, fabs(l.z[k]) * length_of(push_of(c, k)));
    for (int k = 0; k < ELEMENTS; ++k) {
        int normal = mbs_contacts_normals[k];
        if (some[k] && fabs(l.z[normal]) * length_of(push_of(c, normal)) > MBS_VANISHES * largest)
            impulses[k] += l.z[normal];
    }
    for (int k = 0; k < NU; ++k)
        x[k] += l.x[k];
    return MBS_CONTACTS_GOES_ON;
}

/* Strike what touches: if something bounces what closes fastest first, what does not bounce being held, else all at once.
   Fills the impulses of elements and changes the speeds u. */
mbs_contacts_status mbs_contacts_strike(mbs_contact_run *c, const int *touching, const int *late, double *u, double *impulses)
{
    double e[ELEMENTS + 1], x[NU + 1] = {0.0}, v[ROWS + 1], change;
    int bouncing = 0, still[ELEMENTS + 1];
    for (int k = 0; k < ELEMENTS; ++k) {
        e[k] = touching[k] && !late[k] ? bounce(c, k) : 0.0;
        bouncing |= e[k] > 0.0;
        still[k] = touching[k] && e[k] == 0.0;
        impulses[k] = 0.0;
    }
    mbs_copy(ROWS, c->laws.phidot, v);
    for (int round = 0; round < 100 + 20 * ELEMENTS; ++round) {
        int some[ELEMENTS + 1], first = -1, count = 0, grows = 1;
        for (int k = 0; k < ELEMENTS; ++k) {
            double now = v[mbs_contacts_normals[k]];
            if (touching[k] && now < -mbs_contacts_allowed_speed(c, mbs_contacts_normals[k]) &&
                (first < 0 || now < v[mbs_contacts_normals[first]]))
                first = k;
        }
        if (first < 0) {
            for (int k = 0; k < NU; ++k) {
                change = dot(NU, c->laws.inverse + k * NU, x);
                u[k] += change;
            }
            return MBS_CONTACTS_GOES_ON;
        }
        memset(some, 0, sizeof some);
        some[first] = 1;
        while (grows) { /* what strikes with it and what is held, as far as they push each other */
            grows = 0;
            for (int k = 0; k < ELEMENTS; ++k) {
                double now = v[mbs_contacts_normals[k]], allowed = mbs_contacts_allowed_speed(c, mbs_contacts_normals[k]);
                int joins = touching[k] && (bouncing ? now <= (1.0 - MBS_TOGETHER) * v[mbs_contacts_normals[first]] ||
                                                           (still[k] && fabs(now) <= allowed)
                                                     : now <= allowed);
                for (int j = 0; j < ELEMENTS && joins && !some[k]; ++j)
                    if (some[j] && j != k && connected(c, j, k))
                        grows = some[k] = 1;
            }
        }
        for (int k = 0; k < ELEMENTS; ++k)
            count += some[k];
        if (count == 1) {
            double impulse = strike_alone(c, first, e[first], v, x);
            if (impulse < 0.0)
                return MBS_CONTACTS_IMPACT;
            impulses[first] += impulse;
        } else {
            mbs_contacts_status status = strike_together(c, some, e, v, x, impulses);
            if (status != MBS_CONTACTS_GOES_ON)
                return status;
        }
        for (int k = 0; k < ROWS; ++k)
            v[k] = c->laws.phidot[k] + response(c, k, x);
    }
    return MBS_CONTACTS_STANDS_STILL;
}

/* ---- bounces that come to rest ---- */

double mbs_contacts_lost_height(const mbs_contact_run *c, int e, const double *q)
{
    double most = size_of_gap(c, e);
    for (int k = 0; k < NQ; ++k)
        if (mbs_contacts_turned[k] == mbs_contacts_angles[e])
            most = fmax(most, fabs(q[k]));
    return fmax(MBS_LOST_HEIGHT, c->steps) * most;
}

/* How long something flies on from a gap, HUGE_VAL where it does not come back. */
static double flight(double start, double speed, double fall)
{
    double room = speed * speed + 2.0 * fall * start, root;
    if (room < 0.0 || !(fall > 0.0 || speed < 0.0))
        return HUGE_VAL;
    root = sqrt(room);
    if (speed > 0.0)
        return (speed + root) / fall;
    return root > speed ? 2.0 * start / (root - speed) : 0.0;
}

/* The time for which an element would still bounce that is to rest now; negative where it goes on. */
static double remaining(mbs_contact_run *c, int e, double t, const double *q, const double *udot)
{
    double back = bounce(c, e), fall, rebound, left, unseen;
    if (!(back > 0.0 && back < 1.0) || !((fall = mbs_contacts_falling(c, e, udot)) > 0.0))
        return -1.0;
    if (c->now.bouncing[e] == HUGE_VAL)
        c->now.bouncing[e] = t;
    rebound = -back * rate(c, e);
    left = 2.0 * rebound / (fall * (1.0 - back));
    unseen = fmax(MBS_REMAINING * (t - c->now.bouncing[e]), MBS_TICKS * fabs(t));
    return left < unseen || rebound * rebound < 2.0 * fall * mbs_contacts_lost_height(c, e, q) ? left : -1.0;
}

/* Note which closing elements rest from now on, and how much longer each would have bounced. */
int mbs_contacts_resting(mbs_contact_run *c, const int *touching, double t, const double *q, const double *udot, int *late,
                   double *longer)
{
    double next = HUGE_VAL;
    int any = 0;
    for (int e = 0; e < ELEMENTS; ++e)
        if (gap(c, e) <= MBS_TOUCHING * size_of_gap(c, e) && !c->now.mode.closed[e] && !(touching[e] && mbs_contacts_sense(c, e) < 0))
            next = fmin(next, flight(fmax(gap(c, e), 0.0), gap(c, e) > 0.0 || mbs_contacts_sense(c, e) ? rate(c, e) : 0.0,
                                     mbs_contacts_falling(c, e, udot)));
    for (int e = 0; e < ELEMENTS; ++e) {
        double left = touching[e] && mbs_contacts_sense(c, e) < 0 ? remaining(c, e, t, q, udot) : -1.0;
        late[e] = left >= 0.0 && left < next;
        longer[e] = late[e] ? left : 0.0;
        any |= late[e];
    }
    return any;
}
