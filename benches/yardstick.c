/* G: one scalar evaluation of the gap and of its rate, with the C library's functions.
 *
 *     g  = sin x1 - x2 - delta,   g' = x1' cos x1 - x2',   each body a decaying oscillation and the
 *     response to cos(omega t):   x = exp(-d t)(A cos w t + B sin w t) + C cos(omega t) + D sin(omega t)
 *
 * Four pairs of sine and cosine (the two free motions, the drive, x1) and two exponentials. The
 * velocities use the same values. Times vary, and each evaluation waits for the one before, as in
 * a search for a root; nothing can be taken out of the loop. Compiled with -O2, as a wheel would be.
 */
#include <math.h>

typedef struct {
    double decay, frequency, a, b, c, d;
} Body;

typedef struct {
    double x, v;
} Motion;

static inline Motion motion(const Body *body, double omega, double t, double drive_cos, double drive_sin)
{
    double phase = body->frequency * t;
    double c = cos(phase), s = sin(phase), e = exp(-body->decay * t);
    double position = e * (body->a * c + body->b * s);
    double rate = e * body->frequency * (body->b * c - body->a * s) - body->decay * position;
    Motion result = {
        position + body->c * drive_cos + body->d * drive_sin,
        rate + omega * (body->d * drive_cos - body->c * drive_sin),
    };
    return result;
}

/* Sum of gaps and rates over n evaluations; the caller times the call. */
double yardstick(long n, double step)
{
    const double omega = 1.25, delta = 0.5;
    const Body first = {0.02, 1.99, 0.31, -0.17, 0.41, 0.05};
    const Body second = {0.01, 0.99, -0.23, 0.11, 0.07, 0.02};
    double t = 0.1, sum = 0.0;
    for (long i = 0; i < n; i++) {
        double drive_cos = cos(omega * t), drive_sin = sin(omega * t);
        Motion one = motion(&first, omega, t, drive_cos, drive_sin);
        Motion two = motion(&second, omega, t, drive_cos, drive_sin);
        double gap = sin(one.x) - two.x - delta;
        double rate = one.v * cos(one.x) - two.v;
        sum += gap + rate;
        /* Within a few drive periods, and dependent on the value just found. */
        t = t > 20.0 ? 0.1 : t + step * (1.0 + 1e-3 * gap);
    }
    return sum;
}

#ifdef PROGRAM
#include <stdlib.h>

/* So many evaluations, for counts of instructions. */
int main(int argc, char **argv)
{
    return argc != 2 || yardstick(atol(argv[1]), 0.0731) == 0.0;
}
#endif
