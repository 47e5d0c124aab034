/* Which state of contacts the laws allow: forces of what touches, and positions and speeds on its rows. */
#include "contact_laws.h"
#include "vectors.h"

#include <string.h>

enum { MOST_MODES = 100000 };

double mbs_contacts_allowed_speed(const mbs_contact_run *c, int row)
{
    return fmax(MBS_TOUCHING * mbs_speed_along(&c->course, row), MBS_ULPS * MBS_EPSILON * c->laws.speed);
}

int mbs_contacts_sense(const mbs_contact_run *c, int e)
{
    double v = rate(c, e);
    return fabs(v) <= mbs_contacts_allowed_speed(c, mbs_contacts_normals[e]) ? 0 : v > 0.0 ? 1 : -1;
}

/* ---- which mode fulfils the laws ---- */

static int takes(const mbs_contacts_mode *m, int p) { return m->closed[mbs_contacts_elements[p]] == 1; }

/* Solve for forces in a mode, and return whether all laws hold; rows that depend on each other are left to modes in which one
   of them carries nothing. What touches, or is held, without a force is marked so. */
static int fulfils(const mbs_contact_run *c, laws *l, mbs_contacts_mode *m)
{
    int active[ROWS + 1], count = 0, places[ROWS + 1];
    double matrix[ROWS * ROWS + 1], right[ROWS + 1], sizes[ROWS + 1], pushes[ROWS * NU + 1], z[ROWS + 1];
    double multipliers[ROWS + 1], report[3], largest = 0.0, moved = 0.0, missing = 0.0;
    for (int k = 0; k < ROWS; ++k)
        places[k] = -1;
    for (int k = 0; k < FIXED; ++k)
        active[count++] = k;
    for (int e = 0; e < ELEMENTS; ++e)
        if (m->closed[e] == 1)
            active[count++] = mbs_contacts_normals[e];
    for (int p = 0; p < PARTS; ++p)
        if (takes(m, p) && m->slip[p] == 0 && mbs_contacts_holds[p])
            active[count++] = mbs_contacts_tangents[p];
    for (int i = 0; i < count; ++i) {
        places[active[i]] = i;
        sizes[i] = length_of(push_of(c, active[i]));
        mbs_copy(NU, push_of(c, active[i]), pushes + i * NU);
    }
    for (int p = 0; p < PARTS; ++p)
        if (takes(m, p) && m->slip[p])
            for (int k = 0; k < NU; ++k)
                pushes[places[mbs_contacts_normals[mbs_contacts_elements[p]]] * NU + k] -=
                    m->slip[p] * l->mu[p] * push_of(c, mbs_contacts_tangents[p])[k];
    for (int i = 0; i < count; ++i) {
        double size = length_of(row_of(c, active[i]));
        for (int j = 0; j < count; ++j)
            matrix[i * count + j] = dot(NU, row_of(c, active[i]), pushes + j * NU) / (size * sizes[j]);
        right[i] = l->right[active[i]] / size;
    }
    if (count) {
        const mbs_pattern pattern = {count, count, 0};
        double *factors = (double *)c->room;
        mbs_factorise(&pattern, matrix, count, factors);
        mbs_substitute(&pattern, factors, right, z, multipliers, report);
        if (report[0] != count)
            return 0;
    }
    mbs_fill(ROWS, 0.0, l->z);
    mbs_fill(NU, 0.0, l->x);
    for (int i = 0; i < count; ++i) {
        if (!isfinite(z[i]))
            return 0;
        largest = fmax(largest, fabs(z[i]));
        l->z[active[i]] = z[i] / sizes[i];
        for (int k = 0; k < NU; ++k)
            l->x[k] += pushes[i * NU + k] * l->z[active[i]];
    }
    for (int p = 0; p < PARTS; ++p)
        if (takes(m, p) && m->slip[p])
            l->z[mbs_contacts_tangents[p]] = -m->slip[p] * l->mu[p] * l->z[mbs_contacts_normals[mbs_contacts_elements[p]]];
    moved = sqrt(dot(NU, l->x, l->x));
    missing = MBS_ACCEPTED * largest + 100.0 * MBS_EPSILON * l->wanted + 1e-300;
    for (int e = 0; e < ELEMENTS; ++e) {
        int normal = mbs_contacts_normals[e], p = mbs_contacts_parts[e];
        double size = length_of(row_of(c, normal)), terms = fabs(l->right[normal]), a;
        if (!l->touching[e])
            continue;
        if (m->closed[e] == 1 && l->z[normal] * length_of(push_of(c, normal)) < -missing)
            return 0;
        for (int k = 0; k < NU; ++k)
            terms += fabs(row_of(c, normal)[k] * l->x[k]);
        a = (dot(NU, row_of(c, normal), l->x) - l->right[normal]) / size;
        if (m->closed[e] != 1) {
            double rounding = 100.0 * MBS_EPSILON * (moved + l->wanted);
            if (a < -MBS_ACCEPTED * terms / size - rounding)
                return 0;
            m->closed[e] = fabs(a) <= MBS_TIED * terms / size + rounding ? 2 : 0;
            continue;
        }
        if (p < 0)
            continue;
        int tangent = mbs_contacts_tangents[p];
        const double *row = row_of(c, tangent);
        m->carried[p] = 0;
        if (m->slip[p] == 0) {
            double room = l->mu[p] * l->z[normal] - fabs(l->z[tangent]);
            if (room * length_of(push_of(c, tangent)) < -missing)
                return 0;
        } else if (l->sign[p] == 0) {
            double rounding = 100.0 * MBS_EPSILON * (moved + l->wanted);
            size = length_of(row);
            terms = fabs(l->right[tangent]);
            for (int k = 0; k < NU; ++k)
                terms += fabs(row[k] * l->x[k]);
            a = m->slip[p] * (dot(NU, row, l->x) - l->right[tangent]) / size;
            if (a < -MBS_ACCEPTED * terms / size - rounding)
                return 0;
            m->carried[p] = fabs(a) <= MBS_TIED * terms / size + rounding;
        }
    }
    for (int p = 0; p < PARTS; ++p)
        if (m->carried[p]) {
            m->carried[p] = m->slip[p];
            m->slip[p] = 0;
        }
    return 1;
}

/* The mode number `number` of what touches: closed before open, sticking before sliding. Returns 0 beyond the last one. */
static int numbered_mode(const laws *l, long number, mbs_contacts_mode *m)
{
    memset(m, 0, sizeof *m);
    for (int e = 0; e < ELEMENTS; ++e) {
        int p = mbs_contacts_parts[e], ways = p < 0 || l->sign[p] ? 1 : 3, choice;
        if (!l->touching[e])
            continue;
        choice = (int)(number % (ways + 1));
        number /= ways + 1;
        m->closed[e] = choice < ways;
        if (p >= 0 && choice < ways)
            m->slip[p] = l->sign[p] ? l->sign[p] : choice == 2 ? -1 : choice;
    }
    return number == 0;
}

/* Find the mode that is `near`, or the first one in order, in which all laws hold with these coefficients. */
static mbs_contacts_status find_at(const mbs_contact_run *c, laws *l, const mbs_contacts_mode *near, mbs_contacts_mode *found)
{
    l->wanted = 0.0;
    for (int k = 0; k < ROWS; ++k) {
        int e = 0;
        while (k >= FIXED && e < ELEMENTS && !(l->touching[e] && (mbs_contacts_normals[e] == k ||
               (mbs_contacts_parts[e] >= 0 && mbs_contacts_tangents[mbs_contacts_parts[e]] == k))))
            ++e;
        if (e < ELEMENTS || k < FIXED)
            l->wanted = fmax(l->wanted, fabs(l->right[k]) / length_of(row_of(c, k)));
    }
    if (near) {
        *found = *near;
        for (int e = 0; e < ELEMENTS; ++e)
            if (!l->touching[e])
                found->closed[e] = 0;
        for (int p = 0; p < PARTS; ++p) {
            found->slip[p] = !takes(found, p) ? 0 : l->sign[p] ? l->sign[p] : near->slip[p] + near->carried[p];
            found->carried[p] = 0;
        }
        if (fulfils(c, l, found))
            return MBS_CONTACTS_GOES_ON;
    }
    for (long number = 0; number < MOST_MODES; ++number) {
        if (!numbered_mode(l, number, found))
            return MBS_CONTACTS_NO_STATE;
        if (fulfils(c, l, found))
            return MBS_CONTACTS_GOES_ON;
    }
    return MBS_CONTACTS_TOO_MANY;
}

/* The same, what does not slip having its static coefficient, and what begins to slip then its kinetic one. */
mbs_contacts_status mbs_contacts_find(const mbs_contact_run *c, laws *l, const mbs_contacts_mode *near, mbs_contacts_mode *found)
{
    int kinetic[PARTS + 1] = {0};
    mbs_contacts_mode before;
    for (int p = 0; p < PARTS; ++p)
        kinetic[p] = l->sign[p] != 0;
    for (;;) {
        int more = 0;
        for (int p = 0; p < PARTS; ++p)
            l->mu[p] = c->laws.coefficients[2 * p + kinetic[p]];
        mbs_contacts_status status = find_at(c, l, near, found);
        if (status != MBS_CONTACTS_GOES_ON)
            return status;
        for (int p = 0; p < PARTS; ++p)
            if (takes(found, p) && found->slip[p] && !kinetic[p]) {
                kinetic[p] = 1;
                more |= c->laws.coefficients[2 * p] != c->laws.coefficients[2 * p + 1];
            }
        if (!more)
            return MBS_CONTACTS_GOES_ON;
        before = *found;
        near = &before;
    }
}

int mbs_contacts_slip_sign(const mbs_contact_run *c, int p)
{
    double v = c->laws.phidot[mbs_contacts_tangents[p]];
    return fabs(v) <= mbs_contacts_allowed_speed(c, mbs_contacts_tangents[p]) ? 0 : v > 0.0 ? 1 : -1;
}

/* The laws of accelerations of what touches. */
void mbs_contacts_pose(const mbs_contact_run *c, const int *touching, laws *l)
{
    l->touching = touching;
    mbs_copy(ROWS, c->laws.right, l->right);
    for (int p = 0; p < PARTS; ++p)
        l->sign[p] = mbs_contacts_slip_sign(c, p);
}

/* ---- positions and speeds on their rows ---- */

/* The least change that changes rows as wanted. */
static void least_change(const mbs_contact_run *c, int count, const int *rows, const double *wanted, double *change)
{
    double some[ROWS * NU + 1], x[NU + 1], multipliers[ROWS + 1], report[3];
    const mbs_pattern pattern = {count, NU, 0};
    double *factors = (double *)c->room;
    for (int i = 0; i < count; ++i)
        mbs_copy(NU, row_of(c, rows[i]), some + i * NU);
    mbs_factorise(&pattern, some, count, factors);
    mbs_substitute(&pattern, factors, wanted, x, multipliers, report);
    for (int k = 0; k < NU; ++k)
        change[k] = dot(NU, c->laws.inverse + k * NU, x);
}

/* Put coordinates onto constraints and the gaps of what touches; returns whether they moved. */
int mbs_contacts_onto_rows(mbs_contact_run *c, const int *touching, double t, double *q, const double *u)
{
    int rows[ROWS + 1], count = 0;
    double wanted[ROWS + 1], largest = 0.0, change[NU + 1];
    for (int k = 0; k < FIXED + ELEMENTS; ++k) {
        int row = k < FIXED ? k : mbs_contacts_normals[k - FIXED];
        if (k >= FIXED && !touching[k - FIXED])
            continue;
        largest = fmax(largest, fabs(c->laws.phi[row]));
        if (c->laws.phi[row] != 0.0) {
            wanted[count] = -c->laws.phi[row];
            rows[count++] = row;
        }
    }
    if (!(largest > MBS_NOT_PUT_BACK * c->laws.length))
        return 0;
    least_change(c, count, rows, wanted, change);
    for (int k = 0; k < c->system.plains; ++k)
        q[mbs_contacts_plain[2 * k]] += change[mbs_contacts_plain[2 * k + 1]];
    mbs_ask(&c->course, t, q, u);
    return 1;
}

/* Bring to rest what touches and does not slide. */
void mbs_contacts_at_rest(mbs_contact_run *c, const int *touching, double t, const double *q, double *u)
{
    int rows[ROWS + 1], count = 0;
    double wanted[ROWS + 1], largest = 0.0, change[NU + 1];
    for (int k = 0; k < FIXED; ++k)
        rows[count++] = k;
    for (int e = 0; e < ELEMENTS; ++e)
        if (touching[e])
            rows[count++] = mbs_contacts_normals[e];
    for (int p = 0; p < PARTS; ++p)
        if (touching[mbs_contacts_elements[p]] && !mbs_contacts_slip_sign(c, p))
            rows[count++] = mbs_contacts_tangents[p];
    for (int i = 0; i < count; ++i) {
        wanted[i] = -c->laws.phidot[rows[i]];
        largest = fmax(largest, fabs(wanted[i]));
    }
    if (!(largest > MBS_NOT_PUT_BACK * c->laws.speed))
        return;
    least_change(c, count, rows, wanted, change);
    for (int k = 0; k < NU; ++k) {
        double size = mbs_contacts_slides[k] * c->laws.speed + (1.0 - mbs_contacts_slides[k]) * c->laws.speed / c->laws.length;
        if (!(fabs(change[k]) <= MBS_SLIGHT * size))
            return;
    }
    for (int k = 0; k < NU; ++k)
        u[k] += change[k];
    mbs_ask(&c->course, t, q, u);
}

/* The largest force of a state, and no less than what acts on all that its rows are joined to. */
double mbs_contacts_largest_force(const mbs_contact_run *c, const laws *l)
{
    double largest = 0.0;
    for (int k = 0; k < FIXED + ELEMENTS + PARTS; ++k) {
        int p = k - FIXED - ELEMENTS, row = k < FIXED ? k : p < 0 ? mbs_contacts_normals[k - FIXED] : mbs_contacts_tangents[p];
        if (k >= FIXED && !l->touching[p < 0 ? k - FIXED : mbs_contacts_elements[p]])
            continue;
        largest = fmax(largest, fmax(fabs(l->z[row]), 1e-3 * fabs(c->laws.right[row])));
        largest = fmax(largest, c->laws.driven[row] / length_of(push_of(c, row)));
    }
    return mbs_rounded_up(largest > 0.0 ? largest : 1e-3 * c->laws.speed * c->laws.speed / c->laws.length);
}
