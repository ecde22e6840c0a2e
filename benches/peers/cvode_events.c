/* A run by SUNDIALS CVODE with rootfinding, in C as its manual writes it: Adams, functional
 * iteration, the gap as root function of direction +1, a stop at each drive period, and a new start
 * after each impact. The prototypes are those of SUNDIALS 6 and 7 (double precision, no MPI); the
 * library is the one in the wheel of scikit-sundae, which itself calls Python at every evaluation.
 */
#include <math.h>

#include "law.c"

typedef struct _Vector *N_Vector;
typedef struct _Context *SUNContext;
typedef int (*RightHandSide)(double, N_Vector, N_Vector, void *);
typedef int (*Root)(double, N_Vector, double *, void *);

extern int SUNContext_Create(int, SUNContext *);
extern int SUNContext_Free(SUNContext *);
extern int SUNContext_ClearErrHandlers(SUNContext);
extern N_Vector N_VNew_Serial(long long, SUNContext);
extern double *N_VGetArrayPointer(N_Vector);
extern void N_VDestroy(N_Vector);
extern void *SUNNonlinSol_FixedPoint(N_Vector, int, SUNContext);
extern int SUNNonlinSolFree(void *);
extern void *CVodeCreate(int, SUNContext);
extern int CVodeInit(void *, RightHandSide, double, N_Vector);
extern int CVodeReInit(void *, double, N_Vector);
extern int CVodeSStolerances(void *, double, double);
extern int CVodeSetUserData(void *, void *);
extern int CVodeSetNonlinearSolver(void *, void *);
extern int CVodeSetMaxNumSteps(void *, long);
extern int CVodeSetStopTime(void *, double);
extern int CVodeRootInit(void *, int, Root);
extern int CVodeSetRootDirection(void *, int *);
extern int CVodeSetNoInactiveRootWarn(void *);
extern int CVode(void *, double, N_Vector, double *, int);
extern void CVodeFree(void **);

enum { ADAMS = 1, NORMAL = 1, ROOT_FOUND = 2 };

typedef struct {
    double mbar, r, mu, delta, stiffness, d1, d2, f1, f2, omega, phase;
    long evaluations;
} Parameters;

static int motion(double t, N_Vector y, N_Vector rate, void *data)
{
    Parameters *p = data;
    const double *x = N_VGetArrayPointer(y);
    double *out = N_VGetArrayPointer(rate);
    double drive = cos(p->omega * t + p->phase);
    out[0] = x[1];
    out[1] = p->f1 * drive - p->d1 * x[1] - p->stiffness * x[0];
    out[2] = x[3];
    out[3] = p->f2 * drive - p->d2 * x[3] - x[2];
    p->evaluations++;
    return 0;
}

static int gap(double t, N_Vector y, double *g, void *data)
{
    const double *x = N_VGetArrayPointer(y);
    (void)t;
    g[0] = sin(x[0]) - x[2] - ((Parameters *)data)->delta;
    return 0;
}

/* Follows a run, with so many sections kept in each of the last periods; returns 0, 1 after too many impacts, or CVODE's own negative number.
 * counts: impacts, false events, impact rows kept. The rows are (x1, x1', x2', t). */
int cvode_run(Parameters *p, const double *initial, double tolerance, int periods, int keep,
              int samples, long most_impacts, double *stroboscopic, double *impact_rows, long *counts)
{
    SUNContext context;
    int direction = 1, status = 0;
    double t = 0.0;
    const double period = 2.0 * M_PI / p->omega;
    const long before = (long)(periods - keep) * samples, sections = (long)periods * samples;
    SUNContext_Create(0, &context);
    SUNContext_ClearErrHandlers(context);
    N_Vector y = N_VNew_Serial(4, context);
    double *x = N_VGetArrayPointer(y);
    for (int i = 0; i < 4; i++)
        x[i] = initial[i];
    void *memory = CVodeCreate(ADAMS, context);
    CVodeInit(memory, motion, 0.0, y);
    CVodeSetUserData(memory, p);
    CVodeSStolerances(memory, tolerance, tolerance);
    void *iteration = SUNNonlinSol_FixedPoint(y, 0, context);
    CVodeSetNonlinearSolver(memory, iteration);
    CVodeSetMaxNumSteps(memory, 100000);
    CVodeRootInit(memory, 1, gap);
    CVodeSetRootDirection(memory, &direction);
    CVodeSetNoInactiveRootWarn(memory);
    counts[0] = counts[1] = counts[2] = 0;
    for (long k = before ? before : 1; k <= sections && status == 0;) {
        double end = k * period / samples;
        /* Section states are interpolated; the last one is stepped to. */
        if (k == sections)
            CVodeSetStopTime(memory, end);
        int found = CVode(memory, end, y, &t, NORMAL);
        if (found < 0) {
            status = found;
        } else if (found == ROOT_FOUND) {
            if (x[1] * cos(x[0]) - x[3] > 0.0) {
                if (t > (periods - keep) * period) {
                    double *row = impact_rows + 4 * counts[2]++;
                    row[0] = x[0], row[1] = x[1], row[2] = x[3], row[3] = t;
                }
                impact_law(p->mbar, p->r, p->mu, x);
                if (++counts[0] >= most_impacts)
                    status = 1;
            } else {
                counts[1]++;
            }
            CVodeReInit(memory, t, y);
        } else {
            if (k > before)
                for (int i = 0; i < 4; i++)
                    stroboscopic[4 * (k - before - 1) + i] = x[i];
            k++;
        }
    }
    CVodeFree(&memory);
    SUNNonlinSolFree(iteration);
    N_VDestroy(y);
    SUNContext_Free(&context);
    return status;
}
