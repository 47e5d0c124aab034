/* How coordinates follow speeds: displacements along speeds, which are rotation vectors where a ball turns. */
#ifndef MBS_PAIRING_H
#define MBS_PAIRING_H

#include "runtime.h"

/* new = the coordinates q after a displacement (nu). */
void mbs_moved(const mbs_system *s, const double *q, const double *displacement, double *new);

/* The displacement (nu) that leads from the coordinates q to `other`. */
void mbs_displacement(const mbs_system *s, const double *q, const double *other, double *displacement);

/* Second derivatives (nu) of displacements that have got this far, for speeds u with rates udot. */
void mbs_accelerations(const mbs_system *s, const double *displacement, const double *u, const double *udot,
                       double *second);

/* Speeds (nu) of displacements that have got this far and change at these rates. */
void mbs_speeds(const mbs_system *s, const double *displacement, const double *rates, double *u);

/* The largest angle by which a ball is displaced. */
double mbs_farthest_turn(const mbs_system *s, const double *displacement);

#endif
