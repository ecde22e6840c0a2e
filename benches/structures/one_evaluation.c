/* What one evaluation of twenty modes and of twenty gaps with their rates costs at the least.
 *
 *     p_k = exp(-a_k t)(A_k cos w_k t + B_k sin w_k t),   g_i = sum_k phi_ik p_k,   and their rates
 *
 * There is no search here, no impact and no exact phase: sine, cosine and exponential are the vector
 * functions of the GNU C library with four units in the last place, and all may be reordered. It is
 * a bound of what any method can do that needs the motion once per impact. Run it with
 *
 *     for arch in x86-64 x86-64-v3 x86-64-v4; do
 *         gcc -O3 -ffast-math -march=$arch one_evaluation.c -o one_evaluation -lm && ./one_evaluation
 *     done
 */
#include <math.h>
#include <stdio.h>
#include <time.h>

#define N 20
#define REPEATS 2000000
#define ROUNDS 7

static double shape[N][N], frequency[N], decay[N], a[N], b[N];
static double expo[N], sine[N], cosine[N], place[N], velocity[N], gap[N], rate[N];

__attribute__((noinline)) static void modes(double t)
{
    for (int k = 0; k < N; k++)
        expo[k] = exp(-decay[k] * t);
    for (int k = 0; k < N; k++)
        sine[k] = sin(frequency[k] * t);
    for (int k = 0; k < N; k++)
        cosine[k] = cos(frequency[k] * t);
    for (int k = 0; k < N; k++) {
        double s = sine[k], c = cosine[k];
        place[k] = expo[k] * (a[k] * c + b[k] * s);
        velocity[k] = expo[k] * frequency[k] * (b[k] * c - a[k] * s) - decay[k] * place[k];
    }
}

__attribute__((noinline)) static void gaps(void)
{
    for (int i = 0; i < N; i++)
        gap[i] = rate[i] = 0.0;
    for (int k = 0; k < N; k++)
        for (int i = 0; i < N; i++) {
            gap[i] += shape[k][i] * place[k];
            rate[i] += shape[k][i] * velocity[k];
        }
}

static double now(void)
{
    struct timespec at;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &at);
    return at.tv_sec + 1e-9 * at.tv_nsec;
}

int main(void)
{
    for (int i = 0; i < N; i++) {
        frequency[i] = 0.1 * (i + 1);
        decay[i] = 0.01 * (i + 1);
        a[i] = 1.0 / (i + 1);
        b[i] = 0.5 / (i + 2);
        for (int k = 0; k < N; k++)
            shape[k][i] = sin(i * k + 1.0);
    }
    double best[2] = {1e9, 1e9}, kept = 0.0;
    for (int round = 0; round < ROUNDS; round++) {
        double start = now();
        for (int i = 0; i < REPEATS; i++) {
            modes(1e-6 * i);
            kept += place[3];
        }
        double between = now();
        for (int i = 0; i < REPEATS; i++) {
            gaps();
            kept += gap[2];
        }
        best[0] = fmin(best[0], between - start);
        best[1] = fmin(best[1], now() - between);
    }
    double modal = best[0] / REPEATS * 1e9, all = best[1] / REPEATS * 1e9;
    printf("modes %.0f ns, gaps %.0f ns, together %.0f ns (%g)\n", modal, all, modal + all, kept);
    return 0;
}
