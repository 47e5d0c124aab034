/* The laws of contacts at an instant, between the files of contacts.h. */
#ifndef MBS_CONTACT_LAWS_H
#define MBS_CONTACT_LAWS_H

#include "contacts.h"

#include <math.h>

enum {
    NQ = MBS_CONTACTS_NQ,
    NU = MBS_CONTACTS_NU,
    NX = MBS_CONTACTS_NX,
    ROWS = MBS_CONTACTS_ROWS,
    FIXED = MBS_CONTACTS_CONSTRAINTS,
    ELEMENTS = MBS_CONTACTS_ELEMENTS,
    PARTS = MBS_CONTACTS_PARTS
};

/* Laws of rows (n) for accelerations, or for speeds after an impact: A x - r complementary to z, x = C^T z. */
typedef struct {
    const int *touching;
    double right[ROWS + 1], mu[PARTS + 1], z[ROWS + 1], x[NU + 1], wanted;
    int sign[PARTS + 1]; /* the way in which a part slides already; 0: it is at rest */
} laws;

static inline double dot(int n, const double *a, const double *b)
{
    double total = 0.0;
    for (int k = 0; k < n; ++k)
        total += a[k] * b[k];
    return total;
}

static inline double length_of(const double *row)
{
    double size = sqrt(dot(NU, row, row));
    return size == 0.0 ? 1.0 : size;
}

static inline const double *row_of(const mbs_contact_run *c, int row) { return c->laws.matrix + row * NU; }
static inline const double *push_of(const mbs_contact_run *c, int row) { return c->laws.exerted + row * NU; }
static inline double gap(const mbs_contact_run *c, int e) { return c->laws.phi[mbs_contacts_normals[e]]; }
static inline double rate(const mbs_contact_run *c, int e) { return c->laws.phidot[mbs_contacts_normals[e]]; }
static inline double size_of_gap(const mbs_contact_run *c, int e) { return mbs_contacts_angles[e] ? 1.0 : c->laws.length; }
static inline double bounce(const mbs_contact_run *c, int e) { return c->outputs[MBS_CONTACTS_BOUNCES][e]; }

/* ---- contact_laws.c ---- */

/* The speed along a row up to which it counts as being at rest. */
double mbs_contacts_allowed_speed(const mbs_contact_run *c, int row);

/* 1 where a gap opens, -1 where it closes, 0 at rest; the way in which a part slides, 0 at rest. */
int mbs_contacts_sense(const mbs_contact_run *c, int e);
int mbs_contacts_slip_sign(const mbs_contact_run *c, int p);

/* The laws of accelerations of what touches. */
void mbs_contacts_pose(const mbs_contact_run *c, const int *touching, laws *l);

/* Find the mode in which all laws hold: that which is `near`, if it does, or the first one in order. */
mbs_contacts_status mbs_contacts_find(const mbs_contact_run *c, laws *l, const mbs_contacts_mode *near,
                                      mbs_contacts_mode *found);

/* The largest force of a state, and no less than what acts on all that its rows are joined to. */
double mbs_contacts_largest_force(const mbs_contact_run *c, const laws *l);

/* Put coordinates onto constraints and the gaps of what touches, and return whether they moved; bring to rest what touches
   and does not slide. */
int mbs_contacts_onto_rows(mbs_contact_run *c, const int *touching, double t, double *q, const double *u);
void mbs_contacts_at_rest(mbs_contact_run *c, const int *touching, double t, const double *q, double *u);

/* ---- contact_impacts.c ---- */

/* The acceleration with which an element closes under accelerations `udot`. */
double mbs_contacts_falling(const mbs_contact_run *c, int e, const double *udot);

/* Strike what touches, `late` elements without bouncing. Fills the impulses of elements and changes the speeds u. */
mbs_contacts_status mbs_contacts_strike(mbs_contact_run *c, const int *touching, const int *late, double *u,
                                        double *impulses);

/* Note which closing elements rest from now on, and how much longer each would have bounced; returns whether any does. */
int mbs_contacts_resting(mbs_contact_run *c, const int *touching, double t, const double *q, const double *udot, int *late,
                         double *longer);

/* The height below which a bounce is lost in rounding of the largest length, or angle, of which its gap is made. */
double mbs_contacts_lost_height(const mbs_contact_run *c, int e, const double *q);

#endif
