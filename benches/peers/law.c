/* Poisson's law on the walk over the normal impulse, as law.py has it: velocities of the state
 * (x1, x1', x2, x2') after an impact, in place.
 */
#include <math.h>

void impact_law(double mbar, double r, double mu, double *x)
{
    double c = cos(x[0]), friction = mu * fabs(sin(x[0])), v1 = x[1], v2 = x[3];
    double u = v1 * c - v2;
    double after = fabs(c) <= friction ? 0.0 : c - copysign(friction, c);
    double k = v1 != 0.0 ? c + copysign(friction, v1) : after;
    double rate = mbar + k * c, until_stop = INFINITY, impulse;
    if (friction > 0.0 && v1 * k > 0.0)
        until_stop = v1 / k;
    if (rate > 0.0 && until_stop * rate >= u)
        impulse = (1.0 + r) * u / rate;
    else
        impulse = (1.0 + r) * (until_stop - (v2 + mbar * until_stop) / (mbar + after * c));
    x[1] = until_stop < impulse ? -after * (impulse - until_stop) : v1 - k * impulse;
    x[3] = v2 + mbar * impulse;
}
