/* Displacements of coordinates and their derivatives. A ball's displacement from orientation R_0 is the rotation vector
   phi in R = R_0 exp([phi]); with the body's angular velocity w in its own axes and s = |phi|^2

       w = phi' - b phi x phi' + d phi x (phi x phi'),    b = (1 - cos |phi|) / s,  d = (|phi| - sin |phi|) / |phi|^3
       phi' = w + phi x w / 2 + c phi x (phi x w),        c = (1 - |phi|/2 cot(|phi|/2)) / s                          */
#include "pairing.h"

#include "vectors.h"


static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void cross(const double *a, const double *b, double *c)
{
    c[0] = a[1] * b[2] - a[2] * b[1];
    c[1] = a[2] * b[0] - a[0] * b[2];
    c[2] = a[0] * b[1] - a[1] * b[0];
}

static void add(double factor, const double *v, double *sum)
{
    for (int i = 0; i < 3; ++i)
        sum[i] += factor * v[i];
}

static void turn(const double *q, const double *phi, double *new)
{
    double angle = sqrt(dot(phi, phi)), c = cos(0.5 * angle), s = angle > 0.0 ? sin(0.5 * angle) / angle : 0.5;
    double x = s * phi[0], y = s * phi[1], z = s * phi[2];
    new[0] = q[0] * c - q[1] * x - q[2] * y - q[3] * z;
    new[1] = q[0] * x + q[1] * c + q[2] * z - q[3] * y;
    new[2] = q[0] * y - q[1] * z + q[2] * c + q[3] * x;
    new[3] = q[0] * z + q[1] * y - q[2] * x + q[3] * c;
}

/* The rotation vector of at most half a turn that leads from the quaternion q to p. */
static void rotation_vector(const double *q, const double *p, double *phi)
{
    double w = q[0] * p[0] + q[1] * p[1] + q[2] * p[2] + q[3] * p[3];
    double x = q[0] * p[1] - q[1] * p[0] - q[2] * p[3] + q[3] * p[2];
    double y = q[0] * p[2] + q[1] * p[3] - q[2] * p[0] - q[3] * p[1];
    double z = q[0] * p[3] - q[1] * p[2] + q[2] * p[1] - q[3] * p[0];
    if (w < 0.0) {
        w = -w;
        x = -x;
        y = -y;
        z = -z;
    }
    double sine = sqrt(x * x + y * y + z * z), factor = sine > 0.0 ? 2.0 * atan2(sine, w) / sine : 2.0;
    phi[0] = factor * x;
    phi[1] = factor * y;
    phi[2] = factor * z;
}

/* c and its derivative by s; the series has |B_2k| / (2k)!. */
static void coefficients(double s, double *c, double *by_s)
{
    static const double series[] = MBS_C_SERIES;
    *c = *by_s = 0.0;
    if (s < MBS_SERIES) {
        for (int power = 8; power >= 0; --power)
            *c = *c * s + series[power];
        for (int power = 8; power >= 1; --power)
            *by_s = *by_s * s + power * series[power];
        return;
    }
    double half = 0.5 * sqrt(s), sine = sin(half), cotangent = cos(half) / sin(half);
    *c = (1.0 - half * cotangent) / s;
    *by_s = ((half / (sine * sine) - cotangent) / (8.0 * half) - *c) / s;
}

/* (|phi| - sin |phi|) / |phi|^3; the series has (-1)^k / (2 k + 3)!. */
static double d_of(double s)
{
    static const double series[] = MBS_D_SERIES;
    if (s >= MBS_SERIES)
        return (sqrt(s) - sin(sqrt(s))) / (s * sqrt(s));
    double d = 0.0;
    for (int power = 8; power >= 0; --power)
        d = d * s + series[power];
    return d;
}

static void second_derivative(const double *phi, const double *w, const double *wdot, double *second)
{
    double c, by_s, first[3], twice[3], rate[3] = {0.0}, twist[3] = {0.0}, part[3];
    coefficients(dot(phi, phi), &c, &by_s);
    cross(phi, w, first);
    cross(phi, first, twice);
    add(1.0, w, rate);
    add(0.5, first, rate);
    add(c, twice, rate);
    double change = 2.0 * by_s * dot(phi, rate);
    cross(rate, w, part);
    add(1.0, part, twist);
    cross(phi, wdot, part);
    add(1.0, part, twist);
    mbs_fill(3, 0.0, second);
    add(1.0, wdot, second);
    add(0.5, twist, second);
    add(change, twice, second);
    cross(rate, first, part);
    add(c, part, second);
    cross(phi, twist, part);
    add(c, part, second);
}

static void angular_velocity(const double *phi, const double *rate, double *w)
{
    double s = dot(phi, phi), angle = sqrt(s), first[3], twice[3];
    double sinc = angle > 0.0 ? sin(0.5 * angle) / (0.5 * angle) : 1.0;
    cross(phi, rate, first);
    cross(phi, first, twice);
    mbs_fill(3, 0.0, w);
    add(1.0, rate, w);
    add(-0.5 * sinc * sinc, first, w);
    add(d_of(s), twice, w);
}

void mbs_moved(const mbs_system *s, const double *q, const double *displacement, double *new)
{
    for (int k = 0; k < s->plains; ++k)
        new[s->plain[2 * k]] = q[s->plain[2 * k]] + displacement[s->plain[2 * k + 1]];
    for (int k = 0; k < s->balls; ++k)
        turn(q + s->ball[2 * k], displacement + s->ball[2 * k + 1], new + s->ball[2 * k]);
}

void mbs_displacement(const mbs_system *s, const double *q, const double *other, double *displacement)
{
    for (int k = 0; k < s->plains; ++k)
        displacement[s->plain[2 * k + 1]] = other[s->plain[2 * k]] - q[s->plain[2 * k]];
    for (int k = 0; k < s->balls; ++k)
        rotation_vector(q + s->ball[2 * k], other + s->ball[2 * k], displacement + s->ball[2 * k + 1]);
}

void mbs_accelerations(const mbs_system *s, const double *displacement, const double *u, const double *udot,
                       double *second)
{
    mbs_copy(s->nu, udot, second);
    for (int k = 0; k < s->balls; ++k) {
        int b = s->ball[2 * k + 1];
        second_derivative(displacement + b, u + b, udot + b, second + b);
    }
}

void mbs_speeds(const mbs_system *s, const double *displacement, const double *rates, double *u)
{
    mbs_copy(s->nu, rates, u);
    for (int k = 0; k < s->balls; ++k) {
        int b = s->ball[2 * k + 1];
        angular_velocity(displacement + b, rates + b, u + b);
    }
}

double mbs_farthest_turn(const mbs_system *s, const double *displacement)
{
    double farthest = 0.0;
    for (int k = 0; k < s->balls; ++k) {
        const double *phi = displacement + s->ball[2 * k + 1];
        double angle = sqrt(dot(phi, phi));
        farthest = angle > farthest ? angle : farthest;
    }
    return farthest;
}
