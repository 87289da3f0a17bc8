/* STP -> BP, AR, BC, BC_spread: 85 models with 4763 parameters
 * See stp_to_bp_ar_bc_bc_spread.h. Written by sysid-workbench 0.2.0; do not edit.
 */
#include "stp_to_bp_ar_bc_bc_spread.h"

#include <float.h>
#include <math.h>
#include <string.h>

typedef stp_to_bp_ar_bc_bc_spread_real real;

/* A number of the file as the number type that was chosen. */
#define R(x) ((real)(x))

/* Every sum is computed in the number's own type and in the order in which it stands. Method 16 is that of processors
 * with arithmetic in half precision, which it alone widens. */
#if !defined(__FAST_MATH__) && !defined(_M_FP_FAST) && defined(FLT_EVAL_METHOD)
#if FLT_EVAL_METHOD + 0 == 0 || FLT_EVAL_METHOD + 0 == 16
#define AS_WRITTEN
#endif
#endif

#if defined(__GNUC__)
/* Numbers side by side, in the vectors of GCC and Clang: at -O2 they do not make them of a loop by themselves. Not wider
 * than the registers there are: a wider one would go through memory. Four, and not eight, floats: layers are narrow, and
 * one that is narrower than a register goes neuron by neuron. */
#if defined(__AVX__)
#define LANE_BYTES (4 * (int)sizeof(real))
#else
#define LANE_BYTES 16
#endif
#define LANES ((int)(LANE_BYTES / sizeof(real)))
typedef real lanes __attribute__((vector_size(LANE_BYTES)));
#endif

#if !defined(STP_TO_BP_AR_BC_BC_SPREAD_LIBM_TANH) && defined(AS_WRITTEN) && DBL_MANT_DIG == 53 && FLT_MANT_DIG == 24
#include <stdint.h>

#if defined(STP_TO_BP_AR_BC_BC_SPREAD_FLOAT)
typedef uint32_t real_bits;
#define SHIFT R(12582912.0) /* 1.5 * 2^23: the sum with it has no digits after the point */
#define LN2_HIGH R(0.693359375)
#define LN2_LOW R(-2.12194440e-4)
#define BIAS 127u
#define DIGITS 23
#else
typedef uint64_t real_bits;
#define SHIFT R(6755399441055744.0) /* 1.5 * 2^52 */
#define LN2_HIGH R(6.93147180369123816490e-01)
#define LN2_LOW R(1.90821492927058770002e-10)
#define BIAS 1023u
#define DIGITS 52
#endif

/* tanh as e / (e + 2) with e = exp(2 x) - 1, without a branch, so that several run side by side: faster than libm's in
 * a network, and at most 5 units in the last place from the true value. Where the compiler may
 * reorder sums or computes in more than the number's type, rounding to a whole number by adding a large one would not
 * work, and libm's is used. |x| is at most 20 here. First the Taylor coefficients of exp from 1/2! on, as many as the
 * number type can tell where |r| is at most ln(2) / 2. */
#if defined(STP_TO_BP_AR_BC_BC_SPREAD_FLOAT)
#define EXP_TERMS(p, r) \
    p = r * R(1.0 / 40320.0) + R(1.0 / 5040.0)
#else
#define EXP_TERMS(p, r) \
    p = r * R(1.0 / 6227020800.0) + R(1.0 / 479001600.0); \
    p = p * r + R(1.0 / 39916800.0); \
    p = p * r + R(1.0 / 3628800.0); \
    p = p * r + R(1.0 / 362880.0); \
    p = p * r + R(1.0 / 40320.0); \
    p = p * r + R(1.0 / 5040.0)
#endif
/* ln 2 is in two parts, the first with zeros at its end, so that its product with n is exact; the last bits of the sum
 * are n, and 2^n is a number with these bits for an exponent. */
#define TANH_OF(x, sum, n, r, p, e, power, bits) \
    x += x; \
    sum = x * R(1.4426950408889634) + SHIFT; /* 2 x / ln 2 */ \
    n = sum - SHIFT; \
    r = (x - n * LN2_HIGH) - n * LN2_LOW; \
    EXP_TERMS(p, r); \
    p = p * r + R(1.0 / 720.0); \
    p = p * r + R(1.0 / 120.0); \
    p = p * r + R(1.0 / 24.0); \
    p = p * r + R(1.0 / 6.0); \
    p = p * r + R(0.5); \
    e = r + r * r * p; \
    memcpy(&bits, &sum, sizeof bits); \
    bits = (bits + BIAS) << DIGITS; \
    memcpy(&power, &bits, sizeof power); \
    e = power * e + (power - R(1.0)); \
    e = e / (e + R(2.0))

static real tanh_near(real x)
{
    real sum, n, r, p, e, power;
    real_bits bits;

    TANH_OF(x, sum, n, r, p, e, power, bits);
    return e;
}
#define TANH(x) tanh_near(x)
#if defined(__GNUC__)
#define TANH_LANES
typedef real_bits lanes_bits __attribute__((vector_size(LANE_BYTES)));

static void tanh_lanes(real *a, const real *sums)
{
    const lanes zero = {R(0.0)}, limit = zero + R(400.0), one = zero + R(1.0);
    const lanes_bits none = {0u}, sign = ~(~none >> 1);
    lanes x, square, sum, n, r, p, e, power;
    lanes_bits bits, beyond, ends;

    /* Beyond 20 it is 1 or -1, the tanh of a double, put in place of that of 0. As masks: a loop over the numbers, in
     * whatever width a compiler makes of it, would wait for sums that were stored in another. */
    memcpy(&x, sums, sizeof x);
    square = x * x;
    beyond = (lanes_bits)(square > limit);
    ends = beyond & (((lanes_bits)x & sign) | (lanes_bits)one);
    x = (lanes)((lanes_bits)x & ~beyond);
    TANH_OF(x, sum, n, r, p, e, power, bits);
    e = (lanes)((lanes_bits)e | ends);
    memcpy(a, &e, sizeof e);
}
#endif
#elif defined(STP_TO_BP_AR_BC_BC_SPREAD_FLOAT)
#define TANH(x) tanhf(x)
#else
#define TANH(x) tanh(x)
#endif

/* Constants and weighted sums of regressors, of each neuron one; weights by regressor, then by neuron. Neurons that do
 * not fill a register share the last one with those before them, which are computed twice. */
static void weigh(real *sums, const real *constants, const real *weights, int n, const real *x, int n_x)
{
    int i, k = 0;

#if defined(LANES)
    for (; k + 2 * LANES <= n; k += 2 * LANES) {
        const real *row = weights + k;
        lanes low, high, w;

        memcpy(&low, constants + k, sizeof low);
        memcpy(&high, constants + k + LANES, sizeof high);
        for (i = 0; i < n_x; i++, row += n) {
            memcpy(&w, row, sizeof w);
            low += w * x[i];
            memcpy(&w, row + LANES, sizeof w);
            high += w * x[i];
        }
        memcpy(sums + k, &low, sizeof low);
        memcpy(sums + k + LANES, &high, sizeof high);
    }
    for (; n >= LANES && k < n; k += LANES) {
        const int first = k + LANES <= n ? k : n - LANES;
        const real *row = weights + first;
        lanes sum, w;

        memcpy(&sum, constants + first, sizeof sum);
        for (i = 0; i < n_x; i++, row += n) {
            memcpy(&w, row, sizeof w);
            sum += w * x[i];
        }
        memcpy(sums + first, &sum, sizeof sum);
    }
#endif
    for (; k < n; k++) {
        const real *own = weights + k;
        real sum = constants[k];

        for (i = 0; i < n_x; i++, own += n) {
            sum += *own * x[i];
        }
        sums[k] = sum;
    }
}

/* Neurons of a layer. Beyond 20 the tanh of a double is 1; not a number stays as it is. */
static void activate(real *a, const real *sums, int n)
{
    int i = 0, k;

#if defined(TANH_LANES)
    for (; n >= LANES && i < n; i += LANES) {
        const int first = i + LANES <= n ? i : n - LANES;

        tanh_lanes(a + first, sums + first);
    }
#endif
    for (k = i; k < n; k++) {
        a[k] = sums[k] > R(20.0) ? R(20.0) : sums[k];
        a[k] = a[k] < R(-20.0) ? R(-20.0) : a[k];
    }
    for (; i < n; i++) {
        a[i] = TANH(a[i]);
    }
}

/* Four sums side by side do not wait for each other. */
static real dot(const real *a, const real *b, int n)
{
    real s0 = R(0.0), s1 = R(0.0), s2 = R(0.0), s3 = R(0.0);
    int i = 0;

    for (; i + 4 <= n; i += 4) {
        s0 += a[i] * b[i];
        s1 += a[i + 1] * b[i + 1];
        s2 += a[i + 2] * b[i + 2];
        s3 += a[i + 3] * b[i + 3];
    }
    for (; i < n; i++) {
        s0 += a[i] * b[i];
    }
    return (s0 + s1) + (s2 + s3);
}

/* A number of the state and its change. In float, what rounding takes from the sum is kept for the next step: most of
 * the change of a slow output is lost without. volatile, where the compiler would not round it otherwise before it is
 * taken away again. */
#if defined(STP_TO_BP_AR_BC_BC_SPREAD_FLOAT)
#if defined(AS_WRITTEN)
#define ROUNDED
#else
#define ROUNDED volatile
#endif
static real added(real last, real change, real *lost)
{
    ROUNDED real sum;

    change += *lost;
    sum = last + change;
    *lost = change - (sum - last);
    return sum;
}
#define ADDED(last, change, k) added(last, change, &state->lost[k])
#else
#define ADDED(last, change, k) ((last) + (change))
#endif

/* AR_1+RL_1 -> AH_1, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage0(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 0;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(100.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 0);
    {
        real value; /* AH_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[1] = value;
    }
    past[2] = y[0];
    return flags;
}

/* AR10_1+RL10_1 -> AH10_1, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage1(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 3;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(100.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 1);
    {
        real value; /* AH10_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[2] = value;
    }
    past[2] = y[0];
    return flags;
}

/* ER_1+RL_1 -> EH_1, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage2(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 6;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(100.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 2);
    {
        real value; /* EH_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[3] = value;
    }
    past[2] = y[0];
    return flags;
}

/* ER10_1+RL10_1 -> EH10_1, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage3(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 9;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(100.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 3);
    {
        real value; /* EH10_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[4] = value;
    }
    past[2] = y[0];
    return flags;
}

/* AR_1+BC_1 -> XS_1, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage4(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 12;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 4);
    {
        real value; /* XS_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[5] = value;
    }
    past[2] = y[0];
    return flags;
}

/* STP+EQ_1 -> XQ_1, NARX 0:0,1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage5(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[0]; /* STP [psi] */
    real y[1];
    real *const past = state->past + 15;
    unsigned int flags = 0u;

    y[0] = R(-0.4)
        + R(-1.0) * (u0)
        + R(1.0) * (past[0])
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 5);
    {
        real value; /* XQ_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[6] = value;
    }
    past[1] = y[0];
    return flags;
}

/* STP+XQ_1 -> EQ_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage6(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[0]; /* STP [psi] */
    const real u1 = known[6]; /* XQ_1 [psi] */
    real y[1];
    real *const past = state->past + 17;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 6);
    {
        real value; /* EQ_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[7] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP_1+EQ_1 -> BM_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage7(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[7]; /* EQ_1 [psi] */
    real y[1];
    real *const past = state->past + 18;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(-1.0) * (past[0])
        + R(1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 7);
    {
        real value; /* BM_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[8] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP10_1+BP_1+BM_1 -> BN_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage8(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u2 = known[8]; /* BM_1 [psi] */
    real y[1];
    real *const past = state->past + 20;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (past[1])
        + R(-1.0) * (u2)
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 8);
    {
        real value; /* BN_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[9] = value;
    }
    past[2] = y[0];
    return flags;
}

/* BP_1+BM_1+BN_1+RL_1+RL10_1 -> BU_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage9(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[8]; /* BM_1 [psi] */
    const real u2 = known[9]; /* BN_1 [psi] */
    real y[1];
    real *const past = state->past + 23;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(1.0) * (u1)
        + R(1.0) * (u2)
        + R(100.0) * (past[1])
        + R(100.0) * (past[2])
        + R(-1.0) * (past[3]);
    y[0] = ADDED(past[3], y[0], 9);
    {
        real value; /* BU_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[10] = value;
    }
    past[3] = y[0];
    return flags;
}

/* STP+AR_1+ER_1+BP10_1+XQ_1+QX_1+QF_1+RL_1+RL10_1 -> BP_1, NARX 0..8(5),1,1..8(4)/1..8(4)/12 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage10(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][20] = {
        {
        R(-0.06904757320996377), R(0.10073920517711582), R(-0.021902039188659454), R(-0.0020854049692289253),
        R(0.028102124028842955), R(0.004465566107014352), R(0.0005609603284553114), R(0.06706617146161686),
        R(0.2526272389630363), R(0.01930867816774349), R(0.021651270513672365), R(-0.005867126170619516),
        R(-0.04608424376635681), R(0.006689823381220729), R(0.005948188713454385), R(-0.00014828942408298706),
        R(-0.004089901958780541), R(0.0035879720784823617), R(0.0016702946711055094), R(0.0008078563382567681)
        }
    };
    /* by regressor, then by neuron */
    static const real W[20][12] = {
        {
        R(-1.137718999204264), R(16.629616210797547), R(7.823218478635906), R(-4.759032318852643),
        R(-0.7052649551573501), R(3.1839128741522127), R(59.95085887305502), R(12.2093243041352), R(2.652802648088857),
        R(-10.983468391486525), R(-3.8922122977526477), R(18.18109339903873)
        },
        {
        R(0.6209371048111672), R(8.816031522738104), R(-14.67332717037534), R(-18.13071207890199),
        R(0.6168043024748442), R(2.1171671026960017), R(-54.76166200728653), R(-15.142589747381079),
        R(-2.545321028597444), R(14.430853242445151), R(3.486976927384732), R(23.747425749509965)
        },
        {
        R(1.2904512935326808), R(14.102201416906437), R(9.361738541268506), R(-2.8812760920852365),
        R(-1.2412797308214942), R(0.9757537995031615), R(65.43533174392009), R(7.611955428304158), R(8.63962558195524),
        R(3.172636918431152), R(2.6314936365952444), R(4.10334032828211)
        },
        {
        R(0.8229527569499706), R(-0.5148627591510078), R(-0.49376958707706176), R(2.7823837963345093),
        R(-0.7076803806520386), R(2.8902158060993157), R(-0.1273834538445886), R(-9.994198233161834),
        R(2.1981950269293353), R(-2.5994233959670585), R(-0.03917825860782104), R(-2.6792591007720676)
        },
        {
        R(-0.37782760997811593), R(-2.375601988911452), R(-1.508865358546043), R(-0.18419762890670427),
        R(-0.9280730952725379), R(1.493538683579451), R(15.612343705240663), R(1.0539203166081301),
        R(0.53719091879404), R(3.9313045256211203), R(0.4770409385747337), R(-0.7843108298434435)
        },
        {
        R(-0.5712714927075829), R(-0.846341314202961), R(1.589579016960151), R(1.1188618538244284),
        R(-3.6397851472255707), R(10.802627918266415), R(-28.981073298837973), R(0.6678716622717287),
        R(5.914101127551557), R(6.2203753124831245), R(0.1256856416955005), R(-0.37510487862660097)
        },
        {
        R(0.14288854238137277), R(-0.40003456747472244), R(-2.874513139113921), R(0.3421698378177332),
        R(1.7680892545852458), R(-4.416597696266684), R(-0.22824957514786928), R(-0.21652792073422975),
        R(-2.7854946849209563), R(2.194311416659582), R(-0.06818857904127633), R(-0.030365192318697387)
        },
        {
        R(3.9791677627862203), R(-14.815816832646703), R(-5.832570149509166), R(6.009238645539263),
        R(0.5538918543061868), R(-11.638268580714232), R(-33.644070152195525), R(-13.574617185262696),
        R(-11.848271504233367), R(4.886697066802128), R(3.0312910222159886), R(-1.6711667255517)
        },
        {
        R(12.03573770313969), R(212.09942165717274), R(-79.70835818711058), R(-24.165432753932087),
        R(113.73015721070901), R(-60.1280242039113), R(390.3831427070749), R(-133.51896829898658),
        R(226.31286598144928), R(-293.620741074888), R(-62.36831949775209), R(-205.7301368433578)
        },
        {
        R(-10.721629325797801), R(-58.572075043107866), R(-45.19259258277115), R(-14.761514139394937),
        R(-40.818737272583334), R(-37.38236629920384), R(-9.05624844224662), R(169.82087422788862),
        R(-66.80781619149215), R(70.8468989764598), R(-1.0147613320779119), R(8.483792145432604)
        },
        {
        R(-1.9953947818653475), R(-1.009990128649934), R(-7.120732326534224), R(26.14620519394956),
        R(-17.097447402595595), R(20.735524531536704), R(15.485465888370094), R(-48.600787254660624),
        R(0.8932154932050724), R(51.5537247562277), R(9.4775868819806), R(22.371617162668517)
        },
        {
        R(-0.03327909385677237), R(1.3073399159280827), R(0.5292743068201169), R(-0.3838890234495101),
        R(-0.00947172269977276), R(-0.08667264262406503), R(3.6685431874543153), R(0.8906171719399786),
        R(0.14961860384028491), R(-1.0245193663818266), R(-0.3165493374020456), R(-1.1594627976167409)
        },
        {
        R(-0.42032071012397376), R(7.475995098715366), R(-8.236532215623974), R(-5.759192258438804),
        R(-2.4658649935615196), R(12.01700358918758), R(19.276912104129), R(7.946765235628935), R(7.465193027030249),
        R(-2.3146136832580355), R(-1.5052513471651874), R(2.2444186911009707)
        },
        {
        R(0.20737977034350233), R(-2.026840169457834), R(-0.5515871007512326), R(0.2465721980062498),
        R(0.13895618158415393), R(-0.34745720228413174), R(-9.439543556455511), R(-1.2726953240341006),
        R(-0.42251811313154874), R(0.11405740152214208), R(0.12545331947448246), R(-0.34542861438913347)
        },
        {
        R(-0.04952673286297854), R(0.20909612029043492), R(0.43199941582962254), R(0.2316525899620296),
        R(-1.0933997000997637), R(-0.5039431885826018), R(0.0965199691055989), R(-0.19518221430338184),
        R(1.153739014418406), R(0.12234934137690301), R(0.9432618097071723), R(0.2812063567848382)
        },
        {
        R(-0.024290898593719912), R(0.11756393493097755), R(-0.09478546871296123), R(-0.04561113113612461),
        R(-0.26396589677543625), R(-0.30977774560023924), R(-0.11426226624137792), R(0.20708587383179844),
        R(0.018765103959167237), R(-0.10680336651420186), R(0.04085506227339586), R(-0.018033502967925052)
        },
        {
        R(-2.2958661822624964), R(-0.2212650493855648), R(1.2726594979669414), R(-3.2193089810200544),
        R(1.2120050692383517), R(5.678477227485407), R(3.194170239704728), R(2.0076057384695387), R(8.022191059307568),
        R(-4.053675732820418), R(0.7836596126891988), R(-16.21239786215111)
        },
        {
        R(2.5245022829990518), R(-1.025915460400104), R(2.0978322257884088), R(3.1072231780363153),
        R(0.5072030117364987), R(-8.917730346207762), R(-1.839632092117688), R(-1.1590696265794924),
        R(-7.237295173920733), R(-4.687704400552647), R(-0.9243054218103304), R(8.952634152116445)
        },
        {
        R(-0.8377703434791792), R(-2.438962123185123), R(4.880986076555551), R(2.4763051308193575),
        R(2.2160441762489174), R(-4.544246705614445), R(-2.107152848107683), R(-0.05912017929580349),
        R(-5.7142357679254), R(-6.420694342057267), R(-0.839181055214162), R(13.27512726169751)
        },
        {
        R(-0.14712743337426998), R(-2.1680694642966722), R(6.479308304090115), R(0.770531508766487),
        R(1.806561762722097), R(-0.04820925096961537), R(-2.0022252806723984), R(0.7706177006280817),
        R(-3.7744133942883047), R(1.5982304195768378), R(-0.6442215050502337), R(1.38095727807498)
        }
    };
    static const real b[12] = {
        R(0.3125955290624859), R(-1.5938417281263835), R(-3.465408981186052), R(0.40509496352131813),
        R(3.0878277884469343), R(-2.585236169480776), R(-4.055250526342565), R(1.4597052719786454),
        R(-4.4618017555390646), R(2.467318256137757), R(-0.2551450734519166), R(-0.31028644433609087)
    };
    /* by output, then by neuron */
    static const real v[1][12] = {
        {
        R(0.010760132195735676), R(0.007478048286371326), R(-0.002689129709843063), R(0.0002761726848207935),
        R(0.004456528522985128), R(0.00027235411937199416), R(0.0004247903954136039), R(-0.002580831953226239),
        R(0.0036653733621838506), R(-0.0024109887338241614), R(-0.007812274871352181), R(0.0072164441117554805)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[20][12] = {
        {
        R(-0.01735129095309927), R(-0.054147827183580355), R(0.013925966325450434), R(0.005571939664720183),
        R(-0.02364142537330762), R(0.017684863756771044), R(-0.007635176415814552), R(-0.011497782760690424),
        R(-0.010436508820007132), R(0.009839676251876699), R(0.025475086574786074), R(-0.02132924781762069)
        },
        {
        R(0.036651040735582986), R(0.118709888621846), R(-0.0020006603242653433), R(0.014960097994897451),
        R(0.009190885075821095), R(-0.008695266042872749), R(0.006081237137076978), R(0.01980144193385655),
        R(0.008402927774676395), R(-0.000521907569431445), R(-0.02362719952466987), R(0.012998241474559302)
        },
        {
        R(0.03768963870000613), R(-0.08403467602759829), R(0.015612495292827796), R(0.004796187203561911),
        R(0.03392318456570333), R(0.013224662342665556), R(-0.0007683635937344568), R(-0.014226123179419521),
        R(-0.010946177696482881), R(0.006504197678453514), R(-0.0015866196484911124), R(0.06262592115361114)
        },
        {
        R(0.0012633404791919734), R(-0.0007948865255667115), R(-0.0035583407632115683), R(0.017475762464230812),
        R(-0.014020477292700194), R(0.0007487326802948997), R(-0.0015598220669610617), R(-0.0027563808180474337),
        R(-0.0071197943570681195), R(0.0004987705676571599), R(-0.010556479956373255), R(-0.015875745149818668)
        },
        {
        R(-0.004299654067577845), R(0.011184980050045238), R(0.00017360952210050443), R(0.014969239228874394),
        R(0.00033848656950256505), R(-0.00039202718893740736), R(-0.0009754956964629082), R(-0.0004025370464137513),
        R(-0.005764853459587794), R(0.006541647189533977), R(0.002990032450434303), R(0.007150811768029157)
        },
        {
        R(0.005066529082794968), R(0.002766069287822724), R(-0.004036943136336456), R(0.007937604083089899),
        R(0.0010071933967561765), R(-0.00010091491607386641), R(-0.002193774352197515), R(0.011007117531417254),
        R(0.0021844247499638258), R(-0.00271890403534826), R(0.0067615824637844435), R(0.00032743585931082795)
        },
        {
        R(-0.0017902450556936452), R(0.0022492545325070727), R(-0.0039339063543148535), R(0.0005710528806507351),
        R(0.004287136279372039), R(9.68003202094862e-05), R(0.0009905168364506133), R(8.348532733113135e-05),
        R(0.0032462785099902003), R(-0.0034877765653510595), R(-0.001555348656658048), R(0.0006980184816627362)
        },
        {
        R(0.029260860867822425), R(0.04409743151303136), R(-0.008180238177432297), R(-0.014965177955778786),
        R(0.021170568174514046), R(-0.014240637807248154), R(0.005186221047006445), R(0.0009926769902449673),
        R(0.001511780149859171), R(-0.002330454563759639), R(-0.027017355557698616), R(0.019606460712787224)
        },
        {
        R(-0.5460036295097117), R(-0.7600171897875432), R(0.527295466239657), R(-0.49562524524947094),
        R(0.007024182421295086), R(0.044950763075991836), R(0.060066221998380354), R(0.4408330349582664),
        R(0.1353104979233073), R(-0.040655406999454954), R(-0.10380450907685883), R(0.007288895850727388)
        },
        {
        R(-0.034787999100581064), R(0.10068047294662127), R(-0.0419480513498964), R(0.04678106517903311),
        R(-0.05706783798668452), R(0.020342403011810596), R(-0.005956348118600769), R(-0.24036815603182107),
        R(-0.06458379803572784), R(0.05321028676191468), R(-0.10997452376534102), R(-0.060177349496660724)
        },
        {
        R(-0.007491407967169138), R(0.08362300268088199), R(-0.07982973670342808), R(0.02389214307334937),
        R(-0.019603192379297377), R(-0.015279034963956549), R(0.005112442326447814), R(0.041084489414793944),
        R(-0.05811736895247006), R(-0.013003072323370795), R(0.013902412840281656), R(-0.010445090129154037)
        },
        {
        R(-0.0013218074381807434), R(-0.004401210799368167), R(0.0012016766227126265), R(0.0003310251978458293),
        R(-0.0018921132600210626), R(0.0013012754725892158), R(-0.0005573945294108365), R(-0.0010449748620723052),
        R(-0.0009105827982230492), R(0.0008019239969758346), R(0.001632445083976537), R(-0.0017818849203931285)
        },
        {
        R(0.0015489427772971418), R(-0.02333993915033802), R(0.008553960169482707), R(0.005988036510038662),
        R(-0.01584606569702153), R(0.005740529170263511), R(-0.002975008127517973), R(-0.011671837200707356),
        R(-0.010036770447661504), R(0.0019771726605798514), R(0.003400783053184742), R(-0.007808695931145235)
        },
        {
        R(0.0017420388418467787), R(0.005082019213026482), R(-0.0016028352958696215), R(-0.00034722683154633457),
        R(0.002396874070162983), R(-0.0013309113641500477), R(0.00048003682774274884), R(0.0010526896580017769),
        R(0.0011270025040756998), R(-0.002107724824136336), R(-0.0010359911564546012), R(0.0017307745780668544)
        },
        {
        R(0.008570599101733772), R(0.004044824844964477), R(0.0001459900121197075), R(0.0015878481546715512),
        R(-0.002907516955846367), R(-0.00024936618707805205), R(0.0008942117286535561), R(0.0009691496273123882),
        R(-0.00481362744319945), R(0.000152086101299428), R(-0.004378151570491607), R(-0.0014461640505571865)
        },
        {
        R(-9.637126955252314e-05), R(-0.0008615608062165229), R(-0.0006751214600112317), R(6.803985868559048e-05),
        R(0.0011521840750931228), R(0.00011626912829905932), R(-5.42456793587694e-05), R(-0.0005010538747390643),
        R(0.0011476955450996666), R(-0.00022196863797740475), R(0.00015839013835691577), R(-0.00018029419854868715)
        },
        {
        R(-0.011872654954390391), R(0.0028494496284324094), R(0.005760737888284304), R(0.0022503596349585904),
        R(-0.005970865054596222), R(-0.0034450366853652197), R(0.0029632850067132805), R(-0.0021152746091494643),
        R(0.0019217077547315372), R(0.0011729453885400783), R(-0.0052180308663684356), R(0.0010887417343374661)
        },
        {
        R(0.008279644586099828), R(-0.003626591623037222), R(-0.0024557590388714296), R(0.0006276885947304263),
        R(0.005049977339776339), R(0.0034993176817243654), R(-0.0025413426639034585), R(0.001685280051636052),
        R(-0.0011621828637895723), R(-0.0027058672266405187), R(0.008302971607251587), R(-0.0021691820053614773)
        },
        {
        R(0.0024531330339616145), R(-0.002618681981033286), R(0.0019784274018731203), R(0.0037031423801121214),
        R(0.0025957215862428933), R(0.0023313990954169964), R(-0.0010621484045244126), R(0.00019654681042432853),
        R(0.0002505635464998444), R(-0.004320758841484688), R(0.008907825893167496), R(-0.0029395581906735404)
        },
        {
        R(-0.0011531968921887374), R(-0.0017977971989145544), R(0.0025058654183927154), R(0.0032952273985374335),
        R(0.0016741336794204552), R(0.0013032996732520899), R(-0.000614325702547342), R(0.0004414286536417901),
        R(0.000586976417304048), R(-0.003791917684261836), R(0.006617247115547845), R(-0.001648905895525703)
        }
    };
    real g[12];
    real a[12], sums[12];
    const real u0 = (known[0] - R(77.1)) / R(12.899999999999999); /* STP [psi] */
    const real u4 = known[6]; /* XQ_1 [psi] */
    real y[1];
    real *const past = state->past + 27;
    unsigned int flags = 0u;

    real x[20];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = past[0] - past[1];
    x[3] = past[1] - past[3];
    x[4] = past[3] - past[7];
    x[5] = past[8];
    x[6] = past[9];
    x[7] = past[10];
    x[8] = past[10] - past[11];
    x[9] = past[11] - past[13];
    x[10] = past[13] - past[17];
    x[11] = past[18];
    x[12] = past[19];
    x[13] = past[20];
    x[14] = past[21];
    x[15] = past[22];
    x[16] = past[23];
    x[17] = past[23] - past[24];
    x[18] = past[24] - past[26];
    x[19] = past[26] - past[30];
    weigh(sums, b, W[0], 12, x, 20);
    activate(a, sums, 12);
    weigh(g, v[0], G[0], 12, x, 20);
    y[0] = R(0.005641501943117681) + dot(w[0], x, 20) + dot(g, a, 12);
    y[0] = ADDED(past[23], y[0], 10);
    {
        unsigned int held = 0u;
        real value; /* BP_1 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(12.899251611384514) + R(77.10074838861541);
        if (value > known[10]) { /* BP_1 may not be above BU_1 */
            value = known[10];
            y[0] = (value - R(77.10074838861541)) / R(12.899251611384514);
        }
        if (value >= known[10]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = (value - R(77.10074838861541)) / R(12.899251611384514);
        }
        if (value <= R(0.0)) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        known[11] = value;
        flags |= held;
    }
    past[7] = past[6];
    past[6] = past[5];
    past[5] = past[4];
    past[4] = past[3];
    past[3] = past[2];
    past[2] = past[1];
    past[1] = past[0];
    past[0] = u0;
    past[17] = past[16];
    past[16] = past[15];
    past[15] = past[14];
    past[14] = past[13];
    past[13] = past[12];
    past[12] = past[11];
    past[11] = past[10];
    past[18] = u4;
    past[30] = past[29];
    past[29] = past[28];
    past[28] = past[27];
    past[27] = past[26];
    past[26] = past[25];
    past[25] = past[24];
    past[24] = past[23];
    past[23] = y[0];
    return flags;
}

/* BP_1+AR_1 -> RL_1, NARX 0:0,1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage11(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[11]; /* BP_1 [psi] */
    real y[1];
    real *const past = state->past + 58;
    unsigned int flags = 0u;

    y[0] = R(-28.8)
        + R(20.0) * (u0)
        + R(-20.0) * (past[0])
        + R(49.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 11);
    {
        real value; /* RL_1 [1] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[12] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BC_1+RL_1 -> CL_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage12(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[12]; /* RL_1 [1] */
    real y[1];
    real *const past = state->past + 60;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-100.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 12);
    {
        real value; /* CL_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[13] = value;
    }
    past[1] = y[0];
    return flags;
}

/* AR_1+BP_1 -> XP_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage13(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[11]; /* BP_1 [psi] */
    real y[1];
    real *const past = state->past + 62;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 13);
    {
        real value; /* XP_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[14] = value;
    }
    past[1] = y[0];
    return flags;
}

/* XP_1+XS_1 -> XM_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage14(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[14]; /* XP_1 [psi] */
    const real u1 = known[5]; /* XS_1 [psi] */
    real y[1];
    real *const past = state->past + 64;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(-1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 14);
    {
        real value; /* XM_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[15] = value;
    }
    past[0] = y[0];
    return flags;
}

/* AR_1+XP_1+XM_1 -> AL_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage15(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[14]; /* XP_1 [psi] */
    const real u2 = known[15]; /* XM_1 [psi] */
    real y[1];
    real *const past = state->past + 65;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(1.0) * (u2)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 15);
    {
        real value; /* AL_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[16] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP_1+RL_1 -> AR_1, NARX 0:1,2/2/12 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage16(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][6] = {
        {
        R(-0.002715787611541734), R(0.007816499952555442), R(0.000852091269344657), R(0.004255801317417717),
        R(-0.0031686653548749916), R(0.004641787509869169)
        }
    };
    /* by regressor, then by neuron */
    static const real W[6][12] = {
        {
        R(8.324325856936841), R(-19.222166695093065), R(-5.990791730069066), R(-3.8938029424604963),
        R(21.246954105732627), R(-11.535540852836327), R(-1.356740839453451), R(-19.470978338505397),
        R(-19.10656937284554), R(16.32177204692787), R(-5.515738669481927), R(-5.010776074210078)
        },
        {
        R(24.209039323072613), R(99.30343765617236), R(-18.357792371940736), R(19.301907945082846),
        R(34.278946619267174), R(-29.936654355984842), R(-109.62577354959723), R(-24.64615825068428),
        R(-42.32212446038894), R(-51.994489749334576), R(-36.76840622737791), R(-30.0275128844426)
        },
        {
        R(-0.13174407899045737), R(-0.5785269960857864), R(0.0049708120393756605), R(0.18870077738546787),
        R(-1.3620902529917722), R(0.42362855231429375), R(1.1539036510143845), R(-3.303227833536404),
        R(1.906003157426479), R(0.20483956762361544), R(-0.6187540923459982), R(-0.786270525504716)
        },
        {
        R(1.2004844071462435), R(8.667210319147573), R(1.1656367661290192), R(2.872661281433967),
        R(-2.6680654269540454), R(-2.4246334103701273), R(1.7533784507104204), R(4.083105562347085),
        R(-0.43716820464689804), R(-2.1010857626497645), R(1.479432648771524), R(1.2347202885246331)
        },
        {
        R(-8.135233734487812), R(-7.49090357139064), R(5.601354721223138), R(2.3164826730277253),
        R(-0.08300438389940101), R(11.32474445789894), R(1.568335679429397), R(18.86043674685078),
        R(18.915022697195194), R(-0.15185023912395612), R(5.273377957494035), R(4.85112064634104)
        },
        {
        R(4.450573786607698), R(5.527192674119642), R(-1.5817390349789866), R(-2.768146638064736),
        R(5.413171079615903), R(-10.39734995452133), R(-1.1224703176628497), R(-9.789572821133971),
        R(-13.59909305933974), R(-0.2498436288766659), R(-4.614695802067309), R(-1.9260863599327134)
        }
    };
    static const real b[12] = {
        R(-0.650732610182015), R(-23.38539827078997), R(-0.5501394676786338), R(-3.580236293488379),
        R(-21.006014653228455), R(0.4477779789400891), R(-2.622596546190157), R(5.296593005027778),
        R(1.9834522648849822), R(-17.649131169741906), R(1.6304855850758735), R(0.8316038727982521)
    };
    /* by output, then by neuron */
    static const real v[1][12] = {
        {
        R(-0.005863057789748414), R(0.001994753096474602), R(-0.0017049438056917189), R(-0.0014067326503242798),
        R(-0.002297061726350373), R(-0.0021806041730043618), R(-0.0005409707173575419), R(0.001259291572551339),
        R(-0.008833044165513133), R(0.005438325820759037), R(-0.0026995248380603763), R(0.003620976198936455)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[6][12] = {
        {
        R(-0.010994541301457592), R(-0.004643098811515596), R(0.013054478697837948), R(0.0034873471252664795),
        R(0.004505474258169939), R(-0.002005416983699382), R(0.0030225798336658578), R(-0.0017406062324461374),
        R(-0.004749783039556575), R(-0.008184752169411003), R(-0.011149734049197516), R(-0.007036689131950269)
        },
        {
        R(0.08031269893567317), R(-0.037380572526441065), R(0.07701718080598233), R(0.10603509881471088),
        R(-0.3703530923249461), R(0.25231703239234254), R(-0.010913806033225358), R(-0.08070667673507759),
        R(-0.0014247399219867532), R(0.32340954495891205), R(0.042252792010957683), R(-0.2067458129298038)
        },
        {
        R(0.016037417856199603), R(0.0011278747125667758), R(-0.0015718175225200226), R(-0.003212701117262449),
        R(-0.00263979701172868), R(0.0022654622471295887), R(-0.0004214261304642617), R(0.00045883796246312105),
        R(0.01004078608709751), R(0.0045374207369321285), R(0.005373124743778301), R(0.0025784592766906755)
        },
        {
        R(-0.004884274805792669), R(-0.0007731682654341947), R(-0.004744920405364587), R(-0.0006505447283349356),
        R(0.0027772163912224957), R(0.008009765299243016), R(0.007991382297299225), R(0.0037287440332638444),
        R(-0.011719236347220947), R(-0.004914893504474045), R(-0.0015209540606584797), R(0.0036683757054232647)
        },
        {
        R(0.0028314726780540845), R(0.004711890013622188), R(-0.013049081568639476), R(-0.003548659006692584),
        R(0.0033811126140800406), R(-0.002545719379302966), R(-0.002105410934023495), R(0.0013268008675086278),
        R(0.0039869139891676), R(-0.0054943137585863255), R(0.010290592285363777), R(0.004258595972110382)
        },
        {
        R(-0.0036089355131557464), R(-0.005800099806558615), R(0.0045549251376853905), R(-0.001326902045127017),
        R(-0.004831372795261149), R(0.002934417161498214), R(-0.0026090925749384583), R(0.002553756407969349),
        R(-0.0001567796183496414), R(-0.0005115491526201933), R(-0.0015116348126437244), R(0.0013174756113985965)
        }
    };
    real g[12];
    real a[12], sums[12];
    const real u0 = (known[11] - R(77.10074838861541)) / R(12.899251611384514); /* BP_1 [psi] */
    const real u1 = (known[12] - R(0.5)) / R(0.5); /* RL_1 [1] */
    real y[1];
    real *const past = state->past + 67;
    unsigned int flags = 0u;

    real x[6];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = past[1];
    x[3] = past[1] - past[2];
    x[4] = past[3];
    x[5] = past[3] - past[4];
    weigh(sums, b, W[0], 12, x, 6);
    activate(a, sums, 12);
    weigh(g, v[0], G[0], 12, x, 6);
    y[0] = R(0.0017093824638171552) + dot(w[0], x, 6) + dot(g, a, 12);
    y[0] = ADDED(past[3], y[0], 16);
    {
        unsigned int held = 0u;
        real value; /* AR_1 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(12.899216372399025) + R(77.10078363184411);
        if (value > known[1]) { /* AR_1 may not be above AH_1 */
            value = known[1];
            y[0] = (value - R(77.10078363184411)) / R(12.899216372399025);
        }
        if (value >= known[1]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        if (value < known[16]) { /* AR_1 may not be below AL_1 */
            value = known[16];
            y[0] = (value - R(77.10078363184411)) / R(12.899216372399025);
        }
        if (value <= known[16]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        known[17] = value;
        flags |= held;
    }
    past[0] = u0;
    past[2] = past[1];
    past[1] = u1;
    past[4] = past[3];
    past[3] = y[0];
    return flags;
}

/* AR_1+BC_1+RL_1 -> CH_1, NARX 0:1,1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage17(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[17]; /* AR_1 [psi] */
    const real u2 = known[12]; /* RL_1 [1] */
    real y[1];
    real *const past = state->past + 72;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.0) * (u0)
        + R(-4.0) * (u0 - past[0])
        + R(1.0) * (past[1])
        + R(100.0) * (u2)
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 17);
    {
        real value; /* CH_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[18] = value;
    }
    past[0] = u0;
    past[2] = y[0];
    return flags;
}

/* BP_1+AR_1+RL_1 -> BC_1, NARX 0:1/2/16 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage18(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][8] = {
        {
        R(9.473611364958084e-05), R(0.05896324643742224), R(6.707414473644535e-05), R(-0.3660477268752373),
        R(-2.385878511353655e-05), R(-0.00843372214674492), R(-0.003916576076804471), R(0.002766022335546418)
        }
    };
    /* by regressor, then by neuron */
    static const real W[8][16] = {
        {
        R(-0.8724025993309095), R(-0.34495361209289044), R(-2.480962242146145), R(-0.35572817301740933),
        R(-1.4030457563175176), R(0.3472999183180203), R(1.0675976672736898), R(1.040738491103962),
        R(-0.7828493580564722), R(-1.5416717289715045), R(-0.8296879185559072), R(0.7929429944450348),
        R(3.732904105697253), R(1.352845447454074), R(0.4003768632966288), R(-1.1101130133925377)
        },
        {
        R(-14.635846107107996), R(-20.755607474348203), R(24.161719055326714), R(-11.459683171152857),
        R(15.965917496577985), R(-9.644198256053029), R(10.243148013226294), R(20.428620899231554),
        R(-7.616912031917266), R(-7.445665244152666), R(-3.533895012930571), R(-10.430146898265692),
        R(8.690451082907792), R(-10.820644048666082), R(-0.5935536444587338), R(-1.6069191261149298)
        },
        {
        R(0.7074354202023869), R(0.7578335943666659), R(2.235170352989144), R(0.6353866838554154),
        R(1.9717221240168996), R(-0.30878505306990434), R(-1.4064932664541487), R(-0.9832115880711854),
        R(0.854437453226808), R(1.6544586004412025), R(0.7788992724363482), R(-0.7789432045978515),
        R(-3.8606130929704534), R(-1.6012113771219383), R(-0.3651800500845468), R(1.2129888006594989)
        },
        {
        R(457.1239639527277), R(-61.9480717026467), R(289.1651069451699), R(-205.4396576623531), R(57.54263904225816),
        R(-34.14492141961967), R(-113.4197063906345), R(-764.9110814494558), R(21.230397594660715),
        R(-97.06775577606565), R(65.15758689073996), R(-188.68220991755388), R(-132.49234815690124),
        R(-21.98050217074746), R(-211.9108478208913), R(-19.672037160493648)
        },
        {
        R(3.4015421781283983), R(0.6946476664285793), R(-1.6415071654274902), R(2.7040798414105414),
        R(2.6591416323751007), R(-0.22215196516474012), R(-0.29402070981388384), R(-5.6891838763226446),
        R(-0.47425755949593684), R(0.19552025305827148), R(0.7984553660290277), R(-0.4658960497497978),
        R(1.8543290660303589), R(-1.2281668486553636), R(-0.11341251287255516), R(0.2580590728671295)
        },
        {
        R(-0.3789887409647077), R(-0.3090415789392508), R(0.6387106422891349), R(-1.2200376000633055),
        R(3.706223857312886), R(0.355339910751082), R(-2.1379291854881735), R(-0.4079777790712726),
        R(-3.592678563969153), R(-0.3136981647975299), R(1.5663884431097332), R(0.6812088660940668),
        R(-0.9671165085358039), R(1.5777224830839436), R(-0.8429416004960352), R(5.728700440877321)
        },
        {
        R(-0.5101277202733719), R(0.5380122109315623), R(1.0287331392003467), R(3.1642843979993813),
        R(0.9482386347833143), R(63.20109553195978), R(-0.6089926777485201), R(1.5221211643145656),
        R(4.526215871677878), R(0.49571228353203145), R(0.5260853528293352), R(-0.9806176780021307),
        R(1.3525131545001368), R(-1.3914677435059692), R(-0.99875988004795), R(-5.556481559379918)
        },
        {
        R(0.8771367831649898), R(-1.1068303582562529), R(-0.5210055105561807), R(-1.0261903770136993),
        R(-1.4226850266558593), R(-20.259099895564358), R(0.02297310650906882), R(-1.0565466279821798),
        R(-1.1477257856030703), R(-0.6338809281795296), R(-0.24446023136399805), R(0.9684260604327677),
        R(-0.596882192356765), R(1.165291903920617), R(0.42873970716309345), R(1.577974902425125)
        }
    };
    static const real b[16] = {
        R(-2.611587080539711), R(-0.11627874963074547), R(-1.631167529018118), R(-0.20425498881898263),
        R(-2.2580713006826776), R(42.32014171788111), R(0.6958837359444672), R(3.677370899738839),
        R(3.5051033940613108), R(0.2359646380851129), R(-0.3257881119272721), R(-0.8792746670785979),
        R(-0.8167981118841054), R(0.06241956059024756), R(-0.8554475266867219), R(-5.633381642422675)
    };
    /* by output, then by neuron */
    static const real v[1][16] = {
        {
        R(-0.0022725281443307637), R(-0.002462779362597407), R(-0.00038782438314686216), R(-6.354969737890777e-05),
        R(-0.001162579700551148), R(-0.0002904546640737455), R(-0.001343217539013538), R(-0.001596241624188378),
        R(-0.0012253629054907167), R(-0.001638634687929431), R(-0.0008223237113439341), R(0.001766552378534755),
        R(0.0032587379553646713), R(0.0009555194945797241), R(-0.0003969537993650879), R(-0.005270973188475367)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[8][16] = {
        {
        R(0.004870862216022787), R(0.0006152844516055219), R(0.0033010634695600227), R(0.001309616489881156),
        R(-0.00016096563794224553), R(0.0015565623327189202), R(0.0011146349060358607), R(0.003183001935857674),
        R(-0.0026615153262284467), R(-0.000631884416394815), R(-0.0040068591324443625), R(0.0035919955490152367),
        R(-0.000987609895415617), R(-0.00010560349641153266), R(0.00035147412316472587), R(0.004093661506580976)
        },
        {
        R(-0.058358521230449045), R(0.004636087798370433), R(0.0456871844995187), R(0.017717428442346316),
        R(-0.00040641803185903735), R(0.002091736292576854), R(-0.11628289678929607), R(-0.08433281332103883),
        R(-0.023019581648305813), R(-0.0023467657255591173), R(-0.14388330062539345), R(-0.0484200696526718),
        R(-0.0424819506528423), R(0.019939205408819348), R(-0.05325049576181411), R(0.004958295699571046)
        },
        {
        R(-0.0037574885531909824), R(-0.00011925053623804138), R(-0.003412777538131906), R(-0.0010468176878839358),
        R(-0.000250097171962671), R(-0.0015636417565175753), R(0.00014203172775528738), R(-0.0024421968432406793),
        R(0.0027356553850470533), R(0.0014688144463418304), R(0.004480953505299978), R(-0.0028891506949657586),
        R(0.0010208874863510409), R(0.0001484681694429446), R(-0.0009416531974860698), R(-0.003948747103925121)
        },
        {
        R(0.05080425590330107), R(0.16238028435367965), R(-0.2672280361103749), R(-0.10169708477590875),
        R(0.3480477295372353), R(-0.5105215830062558), R(-0.1790082645619719), R(-0.18527194273482572),
        R(0.2891795934039518), R(-0.0589314347690448), R(0.04241016476385669), R(-1.0935760341799639),
        R(0.27285146354782), R(0.09579659052905734), R(0.7270037397151453), R(-0.17673065662738247)
        },
        {
        R(-0.0007319187322072426), R(-0.0004403732308695925), R(0.0003521164714470502), R(0.0007378745780832776),
        R(-0.00039774096471078104), R(-0.00036267887596773873), R(-6.352065218411494e-05), R(-0.00020443554764893943),
        R(0.00032605606479074734), R(-0.0005893276270759196), R(0.00017896333448639548), R(0.0010494051568344584),
        R(-0.0006842719788341702), R(0.0009715925342958284), R(0.0019356947200615243), R(-0.001051382485298526)
        },
        {
        R(0.002297547899702393), R(-0.0073757366717299875), R(0.006919721416237531), R(0.0003086510629170028),
        R(0.0036603292188480976), R(0.000399448278611763), R(-0.002184867167864553), R(-0.001801264963121464),
        R(-0.004441926868022574), R(0.03682855500082595), R(-0.0038441757153882816), R(-0.007675672466271473),
        R(-0.014590389178373587), R(0.004554220436251944), R(-0.011016149713266874), R(0.002035874468421264)
        },
        {
        R(-0.0017750557143099749), R(-0.0002641409529121944), R(-0.00032587718696829097), R(-5.676536922491769e-05),
        R(-0.0023035156127409174), R(9.769043986915455e-05), R(-0.0005523808104800302), R(0.00010335204230867045),
        R(-0.0018779883472810092), R(-0.0013233061186601503), R(-0.0011663969882417466), R(-0.00035372857036650076),
        R(0.003917907107608222), R(-0.0011265918358794418), R(-0.0014831319985733377), R(-0.005409811915069721)
        },
        {
        R(0.0009834359301026615), R(-0.0010520556044157118), R(-0.00046080251068459846), R(-0.00019050433543461095),
        R(0.0007484144435656194), R(0.0005054728133024604), R(0.0008286928327294931), R(0.00014313528753422212),
        R(0.0005537541625501749), R(0.0011568682798210684), R(0.0006148094413150331), R(0.0001568872907727865),
        R(-0.0028379753958479724), R(0.0005895518730536215), R(0.0011566645547600855), R(0.0026018896514225535)
        }
    };
    real g[16];
    real a[16], sums[16];
    const real u0 = (known[11] - R(77.10074838861541)) / R(12.899251611384514); /* BP_1 [psi] */
    const real u1 = (known[17] - R(77.10078363184411)) / R(12.899216372399025); /* AR_1 [psi] */
    const real u2 = (known[12] - R(0.5)) / R(0.5); /* RL_1 [1] */
    real y[1];
    real *const past = state->past + 75;
    unsigned int flags = 0u;

    real x[8];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = u1;
    x[3] = u1 - past[1];
    x[4] = u2;
    x[5] = u2 - past[2];
    x[6] = past[3];
    x[7] = past[3] - past[4];
    weigh(sums, b, W[0], 16, x, 8);
    activate(a, sums, 16);
    weigh(g, v[0], G[0], 16, x, 8);
    y[0] = R(-0.002886929014044075) + dot(w[0], x, 8) + dot(g, a, 16);
    y[0] = ADDED(past[3], y[0], 18);
    {
        unsigned int held = 0u;
        real value; /* BC_1 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(31.131394488296472) + R(31.131394488296472);
        if (value > known[18]) { /* BC_1 may not be above CH_1 */
            value = known[18];
            y[0] = (value - R(31.131394488296472)) / R(31.131394488296472);
        }
        if (value >= known[18]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        if (value < known[13]) { /* BC_1 may not be below CL_1 */
            value = known[13];
            y[0] = (value - R(31.131394488296472)) / R(31.131394488296472);
        }
        if (value <= known[13]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        known[19] = value;
        flags |= held;
    }
    past[0] = u0;
    past[1] = u1;
    past[2] = u2;
    past[4] = past[3];
    past[3] = y[0];
    return flags;
}

/* BP_1+AR_1 -> RX_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage19(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[11]; /* BP_1 [psi] */
    const real u1 = known[17]; /* AR_1 [psi] */
    real y[1];
    real *const past = state->past + 80;
    unsigned int flags = 0u;

    y[0] = R(-28.3)
        + R(20.0) * (u0)
        + R(-20.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 19);
    {
        real value; /* RX_1 [1] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[20] = value;
    }
    past[0] = y[0];
    return flags;
}

/* ER_1+BP_1+RX_1 -> FR_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage20(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[11]; /* BP_1 [psi] */
    const real u2 = known[20]; /* RX_1 [1] */
    real y[1];
    real *const past = state->past + 81;
    unsigned int flags = 0u;

    y[0] = R(-100.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(100.0) * (u2)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 20);
    {
        real value; /* FR_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[21] = value;
    }
    past[1] = y[0];
    return flags;
}

/* ER_1+FR_1 -> EL_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage21(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[21]; /* FR_1 [psi] */
    real y[1];
    real *const past = state->past + 83;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 21);
    {
        real value; /* EL_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[22] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP_1+AR_1+RL_1 -> ER_1, NARX 0:1/1/10 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage22(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][7] = {
        {
        R(0.00544165042300114), R(-0.06408228429754888), R(0.00020047854268084864), R(-0.11386425863616233),
        R(-0.0015456410176026584), R(0.003640183714751805), R(-0.0032663032881674603)
        }
    };
    /* by regressor, then by neuron */
    static const real W[7][10] = {
        {
        R(2.761268651439347), R(13.736056406619799), R(-12.408522711759833), R(12.001205231172364),
        R(-18.501952123162674), R(-37.05557951149794), R(-17.2308124171152), R(-5.502801940972369),
        R(-9.161525310717519), R(-2.713390332245174)
        },
        {
        R(5.46955313607027), R(12.8419006458941), R(-25.293881260862076), R(7.168770745159211), R(71.66739060719932),
        R(3.555567346618097), R(2.313864145414539), R(10.837904556933722), R(-4.013724450278033),
        R(14.377659410778454)
        },
        {
        R(1.2532285196139128), R(-2.610121944485286), R(12.21104985036618), R(-0.43138742665087193),
        R(18.817038214281183), R(-0.24368061153234066), R(18.42786428725242), R(0.9903429315245376),
        R(0.5804194761169583), R(1.1747254818421293)
        },
        {
        R(-768.0883983579238), R(-964.5469610644012), R(583.1736846731964), R(-1127.375512648836),
        R(1165.108474789203), R(170.94019511573836), R(945.3374429796222), R(356.86077889544003), R(973.5512069461885),
        R(6.687183316629633)
        },
        {
        R(-1.1017925522218603), R(-0.09911239022665042), R(-1.3615187104403348), R(-9.118112483754619),
        R(1.1023164605033904), R(9.553463200282572), R(-1.4965959253248338), R(2.242438425097042),
        R(3.7713277953998308), R(-1.1458177470968818)
        },
        {
        R(-1.9182119755522504), R(2.4912808504585087), R(1.4177287951195503), R(9.306460790263728),
        R(-1.2403522002021887), R(-8.040111222459778), R(-0.24200827441729944), R(-3.9257336995392955),
        R(-13.423666318720912), R(0.26612554851752496)
        },
        {
        R(-2.006501838242328), R(-6.270686269736622), R(0.5855981576451454), R(-6.048473080478841),
        R(-0.40018189893037903), R(20.223941645823945), R(-0.012082063053853167), R(2.5536342465037056),
        R(4.440608190283636), R(1.0098855439932362)
        }
    };
    static const real b[10] = {
        R(-0.21821087596217448), R(-4.564566902278943), R(0.8891037634437238), R(5.584122649473702),
        R(-0.469972103153101), R(5.612816117047225), R(-0.587833305074025), R(-2.2225091238390773),
        R(-1.2620698668943504), R(0.5888132774381337)
    };
    /* by output, then by neuron */
    static const real v[1][10] = {
        {
        R(0.0006700731734873315), R(0.0007500258046795335), R(0.0019778074380219723), R(-0.002355468942727175),
        R(-0.00027707966372837164), R(-0.0013504203660872642), R(-0.0006974026656806779), R(0.0006868276431359912),
        R(-0.0006882663018255488), R(0.0008052380886992404)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[7][10] = {
        {
        R(-0.003655328282276587), R(0.002275725910689995), R(-0.0036846443110280817), R(-0.005933654948838518),
        R(0.0004137442266756979), R(0.00043892650565965224), R(-0.007234321627515642), R(-0.0017437598062258891),
        R(0.010066361582747346), R(0.0008562960609061511)
        },
        {
        R(0.014753499268503781), R(-0.03634623243644937), R(-0.005961973206802658), R(0.0698934481273516),
        R(-0.00474128078601487), R(-0.03817356665434631), R(-0.0033413404863062556), R(-0.03896670407021142),
        R(0.0636242057825995), R(-0.007482573811425124)
        },
        {
        R(-0.001971261388650225), R(2.6805767904813926e-05), R(0.004621398108751729), R(-0.0015360377857677743),
        R(0.0005157913027448724), R(-0.00022838484839184797), R(0.0006440887189976402), R(2.2166446152493968e-05),
        R(-0.008641822445038819), R(-0.006655279793757962)
        },
        {
        R(1.5570403580953707), R(-0.9349382361599671), R(-0.36528801120173265), R(0.40382977429575656),
        R(-0.280359990372616), R(0.016509206427605026), R(0.11952204779011671), R(0.3678397279551743),
        R(-0.07822364004250676), R(0.46876596835363765)
        },
        {
        R(0.00041185663022754587), R(0.00032378033860807763), R(-0.0010094573594419654), R(0.0027697359501615846),
        R(-8.952326671028124e-08), R(-0.0014185990484378705), R(0.0017465871185636972), R(0.001110498622495946),
        R(-0.0004320835869863923), R(0.0028142958287467965)
        },
        {
        R(-0.004061146864255798), R(0.0011488422909300981), R(0.002053658249629623), R(-0.0042719910443477),
        R(-0.00012627440577122305), R(0.0023709807974598924), R(-0.001149534819179854), R(0.0030911470734719783),
        R(-0.0005937119271010443), R(0.0023163311382456203)
        },
        {
        R(0.0032472590654043267), R(-0.0011530703115565334), R(-0.0006409617165646493), R(0.005126151181386001),
        R(-0.0004916869306159848), R(-0.00047334560965306356), R(0.0044372537663260716), R(9.687963202283669e-05),
        R(0.0006592761290464404), R(0.003084319217076876)
        }
    };
    real g[10];
    real a[10], sums[10];
    const real u0 = (known[11] - R(77.10074838861541)) / R(12.899251611384514); /* BP_1 [psi] */
    const real u1 = (known[17] - R(77.10078363184411)) / R(12.899216372399025); /* AR_1 [psi] */
    const real u2 = (known[12] - R(0.5)) / R(0.5); /* RL_1 [1] */
    real y[1];
    real *const past = state->past + 85;
    unsigned int flags = 0u;

    real x[7];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = u1;
    x[3] = u1 - past[1];
    x[4] = u2;
    x[5] = u2 - past[2];
    x[6] = past[3];
    weigh(sums, b, W[0], 10, x, 7);
    activate(a, sums, 10);
    weigh(g, v[0], G[0], 10, x, 7);
    y[0] = R(-0.0005578867692506151) + dot(w[0], x, 7) + dot(g, a, 10);
    y[0] = ADDED(past[3], y[0], 22);
    {
        unsigned int held = 0u;
        real value; /* ER_1 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(7.087527821111905) + R(82.91247217899802);
        if (value > known[3]) { /* ER_1 may not be above EH_1 */
            value = known[3];
            y[0] = (value - R(82.91247217899802)) / R(7.087527821111905);
        }
        if (value >= known[3]) {
            held = 0u;
        }
        if (value < known[22]) { /* ER_1 may not be below EL_1 */
            value = known[22];
            y[0] = (value - R(82.91247217899802)) / R(7.087527821111905);
        }
        if (value <= known[22]) {
            held = 0u;
        }
        known[23] = value;
        flags |= held;
    }
    past[0] = u0;
    past[1] = u1;
    past[2] = u2;
    past[3] = y[0];
    return flags;
}

/* BP_1+EQ_1 -> QX_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage23(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[11]; /* BP_1 [psi] */
    const real u1 = known[7]; /* EQ_1 [psi] */
    real y[1];
    real *const past = state->past + 89;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(-1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 23);
    {
        real value; /* QX_1 [psi] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[24] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP_1+EQ_1 -> QF_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage24(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[11]; /* BP_1 [psi] */
    const real u1 = known[7]; /* EQ_1 [psi] */
    real y[1];
    real *const past = state->past + 90;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(-1.0) * (u0)
        + R(1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 24);
    {
        real value; /* QF_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[25] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP10_1+BP_1 -> BV_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage25(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[11]; /* BP_1 [psi] */
    real y[1];
    real *const past = state->past + 91;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(-1.0) * (past[0])
        + R(1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 25);
    {
        real value; /* BV_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[26] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP10_1+BV_1+RL_1+RL10_1 -> BW_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage26(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[26]; /* BV_1 [psi] */
    const real u2 = known[12]; /* RL_1 [1] */
    real y[1];
    real *const past = state->past + 93;
    unsigned int flags = 0u;

    y[0] = R(0.05)
        + R(1.0) * (past[0])
        + R(1.0) * (u1)
        + R(100.0) * (past[1])
        + R(100.0) * (past[2])
        + R(-1.0) * (past[3]);
    y[0] = ADDED(past[3], y[0], 26);
    {
        real value; /* BW_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[27] = value;
    }
    past[1] = u2;
    past[3] = y[0];
    return flags;
}

/* BP_1+AR10_1+ER10_1+LA_1+LB_1+LC_1+RL_1+RL10_1 -> BP10_1, NARX 0..512(11),1/1..32(6)/14 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage27(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][24] = {
        {
        R(0.0004321808805128357), R(0.0021178371672798124), R(0.06800538966300251), R(0.04387927524065072),
        R(0.03595406793824243), R(0.012205242530839301), R(0.007244819853572557), R(0.0010309960909200189),
        R(-0.00025358728313386276), R(0.0001509125736258255), R(-8.836673597024262e-05), R(0.0009023206745887614),
        R(5.484421951533475e-05), R(5.69962554724372e-05), R(0.00010678993304721727), R(-4.9623410031355924e-05),
        R(4.722571560471562e-05), R(-5.305664478146298e-06), R(-0.002653176927095277), R(0.007442856227789349),
        R(0.008090191218716966), R(0.004595968323964214), R(0.0014984879222837161), R(0.00024575470880828495)
        }
    };
    /* by regressor, then by neuron */
    static const real W[24][14] = {
        {
        R(-0.23712418893104825), R(-2.4226382806651507), R(-0.621925194571233), R(2.988356832974462),
        R(-0.4721136070097529), R(1.1245761739245501), R(-1.6690603860246398), R(1.5741548856076903),
        R(-0.6727076785023449), R(-0.2181487120167569), R(0.35634942108271384), R(-0.26047111053433625),
        R(2.268156507990632), R(1.8209275733086265)
        },
        {
        R(-33.04314297914755), R(25.232354054170866), R(-30.13474672070981), R(-1.4117095379804425),
        R(-29.976200206404528), R(-1.9426770049094646), R(-3.722918093818296), R(-43.97732091287898),
        R(-22.903158635624685), R(5.104214824712059), R(-1.9806383300831996), R(-15.387120818897237),
        R(-33.81967775712549), R(24.06119577708717)
        },
        {
        R(-11.199273741996826), R(-8.64660993077543), R(19.196172162715047), R(-11.713826143113401),
        R(23.065571250839383), R(5.828332568146209), R(-0.7018401728128953), R(36.576241416122855),
        R(20.13636914337281), R(-4.749484522345963), R(-3.9060213468901335), R(0.3543978470187108),
        R(-7.24028682530392), R(8.065151343070237)
        },
        {
        R(25.581689753635636), R(5.143383692086797), R(-4.628550569766151), R(10.457015038475632),
        R(-20.012051782701235), R(-0.5823763809736637), R(6.348147860797162), R(-24.094807506297894),
        R(16.86334207625622), R(10.752716475276731), R(7.2187593778268795), R(6.523799595467895), R(-8.03239270085764),
        R(-22.592967898324826)
        },
        {
        R(-0.39099856256278187), R(-10.189221548765797), R(3.332599570292884), R(0.19378298873642308),
        R(-2.4052551076744724), R(0.4800733520202536), R(11.445213169428179), R(1.1867747938820457),
        R(0.2792370718175725), R(4.882862851647203), R(5.812329642395133), R(5.15324801549412), R(-7.986806532681175),
        R(13.59298348642945)
        },
        {
        R(1.2592426361688531), R(4.461544708601498), R(-5.125556121275342), R(-8.114698904270826),
        R(-8.295574542267072), R(0.19517310373636695), R(-1.5856851528075202), R(-2.835033304205482),
        R(5.46883620124348), R(0.891049823306117), R(0.9495270675110064), R(-1.1980864098282689),
        R(0.20129364261457994), R(-2.1650290559886995)
        },
        {
        R(-2.218024965554757), R(2.208427848838529), R(-2.3199874278956263), R(-0.4782563371333597),
        R(-0.26325503192939004), R(-0.005866779588488025), R(-0.22378961657804253), R(-5.403418329535998),
        R(1.2682908545547422), R(0.21232714406993825), R(-1.9213846296048596), R(-1.8538757428746702),
        R(8.342994422806782), R(1.4186385725067285)
        },
        {
        R(-0.23037094961808813), R(0.4328677767836289), R(-1.0546805212559183), R(0.24862828183468386),
        R(-0.7720444128133566), R(0.2732561310550902), R(0.42682039313881903), R(-1.0620429792721247),
        R(0.6650372368309055), R(0.5845343143997118), R(-0.5746305623868656), R(-0.6244934378797459),
        R(1.593044851906735), R(0.6640308041311928)
        },
        {
        R(0.09789522742791713), R(0.2587048199833066), R(-0.4885105853066072), R(0.019926184006914295),
        R(-0.40975574606264686), R(0.043442539772277924), R(0.006277724618271391), R(-1.0659738237505456),
        R(0.46594919118052447), R(0.1325995347025249), R(0.10891446887301467), R(0.06374224497772187),
        R(-0.2430467167972374), R(0.1461288094347103)
        },
        {
        R(0.19575727576732566), R(0.23468742770531603), R(-0.04108141581008047), R(0.02097475553585365),
        R(-0.14187971069919783), R(0.048410441559926486), R(-0.13758912838938886), R(-0.18739930943168903),
        R(0.148751105539764), R(0.02027108917633201), R(0.15245737774064058), R(0.11737513297811744),
        R(-0.03963564953119317), R(0.06080161388652615)
        },
        {
        R(0.11427917631228184), R(0.09577829070861578), R(-0.02122281518124952), R(-0.032427857696104734),
        R(-0.018553035087077327), R(0.0601971338748285), R(-0.0826432892849011), R(-0.0956357723546026),
        R(0.05803300263213323), R(0.0095668702944116), R(0.07271028212012146), R(0.04617290730181973),
        R(0.012097015722381903), R(-0.01850704653661532)
        },
        {
        R(-1.3805089248316567), R(-1.8281656625959801), R(-1.1018751530608004), R(3.348600152835294),
        R(0.2684584027360368), R(-0.9175985771835928), R(1.865457554681723), R(0.9803438338658881),
        R(1.0289705598989056), R(-0.5854364643372457), R(1.1679377513300557), R(0.8886932201285718),
        R(3.387052401875782), R(-0.14775372868633357)
        },
        {
        R(0.875160273286112), R(1.4044889412526984), R(0.513946989222196), R(-2.1597066943041), R(1.1366338950973147),
        R(0.03308960524050853), R(-0.23516031207192947), R(0.8807251850557368), R(0.06401626213618805),
        R(-0.014806749210018153), R(1.289538736175627), R(1.0225474695386945), R(0.05747363464560596),
        R(-1.521885588931413)
        },
        {
        R(0.03899310886269435), R(0.07241067623057648), R(0.053927295227255145), R(-0.09811009537477598),
        R(-0.03162759050611344), R(0.015915854108016724), R(-0.0838553630175803), R(-0.012688361461235862),
        R(-0.008285720587933327), R(-0.009907954170659743), R(0.032252427185743456), R(0.021173662527218598),
        R(-0.012324223681126237), R(-0.009912527303853048)
        },
        {
        R(0.005523855476644432), R(-0.04942538729142146), R(-0.02885772475884299), R(0.05329711901552948),
        R(0.004681113379989988), R(0.006302153584195238), R(0.0036759199094822705), R(-0.008273179388110083),
        R(-0.013969317361585352), R(0.0015174845567612247), R(-0.06701675938690502), R(-0.06692625532849758),
        R(0.003445023803720902), R(0.022873012354519447)
        },
        {
        R(-0.006639438189089166), R(0.02250109297307576), R(0.0036287576018443476), R(-0.019224360919272137),
        R(0.008165701410250078), R(-0.009322747197163674), R(-0.01673679515322912), R(-0.020035155259902168),
        R(0.011066109645078872), R(-0.013583740949347747), R(0.021579366582597806), R(0.01952246509177006),
        R(0.003440670081980882), R(-0.015083805460795246)
        },
        {
        R(-0.06171171932103847), R(0.03353584983419999), R(-0.1497713946132544), R(-0.05051354424671284),
        R(-0.14632129709930491), R(-0.01145167233437197), R(0.16455285393226757), R(-0.22058735397670637),
        R(0.15066512312748692), R(0.06196530831849313), R(-0.018231854965310157), R(-0.031590480676154054),
        R(-0.09145960854539914), R(0.01732579436669357)
        },
        {
        R(-0.005934039221841492), R(-0.0472444908364017), R(0.04354419921308739), R(0.08218920812078467),
        R(0.025505266674028082), R(0.05367869816487847), R(-0.0003979197729620937), R(0.0006244363713851647),
        R(0.005578972483514098), R(0.04397078802333745), R(-0.03401192819103621), R(-0.022699249862396798),
        R(-0.019041036140621914), R(0.07165547229192537)
        },
        {
        R(-0.14847652435483738), R(1.3306947599320376), R(0.3976182814050968), R(-1.7458941457618984),
        R(-1.5910478994010415), R(-0.36731836153027153), R(1.5424925136289593), R(-3.281829446320392),
        R(-0.17743563306629095), R(1.2752463957235032), R(-3.573098312172098), R(-2.03355096118758),
        R(-5.808308816396464), R(0.9948159627199972)
        },
        {
        R(-1.5221970536262568), R(-3.3766210650714807), R(-1.3125336988274299), R(4.182893255564895),
        R(1.910536001126525), R(2.5863345363476524), R(-0.5355849013616174), R(-0.17903298542291868),
        R(1.267810522148469), R(1.159331455416934), R(-1.7469388400485573), R(6.743882280479288),
        R(-6.278611175006489), R(-0.9824919748948037)
        },
        {
        R(-1.9163402509891974), R(-3.068715266012134), R(-2.107941409168474), R(12.251016334232233),
        R(1.8201854019845052), R(3.154888087303565), R(0.9514338542390313), R(-2.572034866060331),
        R(1.5041700278162375), R(2.0828131623269046), R(-2.370671059005115), R(7.753586840294941),
        R(-15.296326533371307), R(-0.6381197630634928)
        },
        {
        R(-1.017406427752785), R(-2.4864603394563503), R(-2.0453536926018474), R(11.50848857794801),
        R(0.017212545781417732), R(1.394471311237322), R(2.5423159380195592), R(-2.9781546409192536),
        R(1.1019228188897636), R(0.9076429391237351), R(0.3587084859348266), R(4.363652082976219),
        R(-19.862360719400566), R(-1.6038707659239613)
        },
        {
        R(1.0446936484175753), R(-3.3513605847880568), R(-1.302866543193051), R(-2.1809301408904376),
        R(-0.8020309196040837), R(0.11813112632341649), R(2.429169488840083), R(-1.433881643997616),
        R(1.6614411778828992), R(0.6398843257163369), R(2.3810933058402117), R(1.0547206832082934),
        R(-18.824360010179124), R(-1.9019514826473192)
        },
        {
        R(1.2956067548992918), R(-1.5520398529702877), R(0.1615000671345752), R(-1.0635167557814489),
        R(-1.0023703885552417), R(-0.2583550416758354), R(1.477613652203568), R(-0.14453819101724294),
        R(1.519645949842809), R(0.52420582590994), R(0.930935646494553), R(0.43448564492175523),
        R(-10.918091504250667), R(-1.3356767091355373)
        }
    };
    static const real b[14] = {
        R(-1.8281294018585905), R(-2.084394153394175), R(-0.9697461544722537), R(2.2826642234684487),
        R(3.1102927098690243), R(-1.5159454453440244), R(8.08475627850499), R(4.460687148085727),
        R(0.03192193828409873), R(1.5413246620328935), R(2.3465517573951984), R(3.284284489336527),
        R(1.816208837734853), R(-1.6140786149417243)
    };
    /* by output, then by neuron */
    static const real v[1][14] = {
        {
        R(0.020170900238573666), R(0.042405895988010686), R(-0.01256639380830527), R(0.03282719312702491),
        R(0.016585138164278264), R(0.03602561637954573), R(0.005193763848771765), R(0.0023658174090155346),
        R(-0.00651421360443388), R(0.006966649377985046), R(0.0013936417366540938), R(0.018681776948894523),
        R(-0.009632311338831284), R(0.014132567450919502)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[24][14] = {
        {
        R(0.002684123616394002), R(-0.0006517000665043453), R(0.0024438402841739336), R(-0.0023368014451200167),
        R(-0.002273051187329525), R(-0.003194779311491938), R(-0.002629172918313317), R(-0.0008054545765065688),
        R(0.002288436138475897), R(-0.004610411721538047), R(-0.0030988344610139093), R(-3.0813731134012035e-05),
        R(-0.0008870618511454612), R(-0.0005848706277919204)
        },
        {
        R(-0.04767416540839218), R(-0.009278396101576096), R(0.00746947308132526), R(-0.045530403224942353),
        R(0.021243530201201212), R(-0.01659101871345714), R(-0.021086360153206418), R(-0.007008068634945613),
        R(0.010520012276267213), R(0.006205095142226508), R(0.0368029609001506), R(-0.030346847253989603),
        R(0.042484153551117516), R(0.023562756646254793)
        },
        {
        R(0.006955195179683141), R(-0.01575887442156475), R(-0.023233859850001162), R(-0.06628077083174877),
        R(0.02126254504637899), R(0.026170026979633533), R(0.007208331429677389), R(-0.031133244742625094),
        R(-0.033279237059656186), R(0.005671404421652367), R(0.012932707501749546), R(0.010924291055953751),
        R(0.024288530925101436), R(0.014693411942776145)
        },
        {
        R(0.07823678097326188), R(-0.0017031287860360097), R(0.0027309328544641766), R(0.03165757626701942),
        R(-0.059817408921184465), R(0.01600428675939057), R(-0.031577885134845926), R(-0.01470822306396825),
        R(-0.05721926722722459), R(-0.00989773761609996), R(-0.06088350126585651), R(0.06311937066491759),
        R(-0.026946966860210565), R(0.052614763607578184)
        },
        {
        R(0.0006835031375132397), R(0.005855523746785222), R(-0.011755518231685561), R(-0.001795598501114797),
        R(0.006109255676220543), R(0.004696936786656859), R(-0.0075694849290250475), R(0.003979701813203503),
        R(0.019289235290926115), R(0.007005057737236037), R(-0.011875107923084684), R(0.0019014180207544843),
        R(-0.003569476803069689), R(-0.0006465678832392463)
        },
        {
        R(-0.005766894764172142), R(-0.0005078553508694136), R(0.008832477358977619), R(-0.00035679348485640914),
        R(-0.00317481559783665), R(0.00958468357192522), R(-0.004657784081153241), R(0.001714099704187987),
        R(-0.004108242470576465), R(0.0060503094110918604), R(0.005316887012929009), R(-0.0009429985648522972),
        R(-0.002393504189148813), R(0.0035668766558167465)
        },
        {
        R(-0.0031818677238383795), R(-0.0007237523811043024), R(-4.843980152972665e-05), R(-0.0024825244464601105),
        R(-0.0011830529475472026), R(0.0023125294137411045), R(-0.0012168918784372829), R(0.0011323788503386373),
        R(0.0005443215299107946), R(-0.002285745874373991), R(0.0010648671035614896), R(-0.0015722361621083095),
        R(-0.000686092290828688), R(-0.000723079886289656)
        },
        {
        R(-0.0009419224450806275), R(-0.0001272031888145289), R(-0.0006169479724280305), R(-0.0023727365323628),
        R(0.0022414829442972614), R(0.0019048879594967582), R(-0.001294789811110543), R(0.0004331603235634603),
        R(8.96348542979012e-05), R(0.00013534256293240912), R(-0.001481228852135829), R(0.0013478381328706627),
        R(-0.0014201220277457608), R(0.0018651083031411874)
        },
        {
        R(0.0008066915368731846), R(-0.0015833542169411737), R(-0.001963825991880438), R(-0.001765354786424739),
        R(4.5006293156153306e-05), R(-0.0005762919856397009), R(1.4298717683637526e-05), R(5.326281798853009e-05),
        R(-0.0012552787777956429), R(-0.0006615702841436754), R(-0.00047762918945654396), R(4.753270371150192e-05),
        R(-0.0004874713877885408), R(3.5480041776483754e-05)
        },
        {
        R(-0.0006848671643280085), R(-0.00014738780881286934), R(-0.00034483377137393), R(-0.0007674218436379683),
        R(2.3380919929017223e-05), R(-0.00017550206886499648), R(-0.00020104266739665746), R(-0.00027078825423740657),
        R(-0.0004534876101172162), R(-0.0003988080405484611), R(-0.0006678994107358589), R(0.0007147423217495186),
        R(-6.437551960479203e-05), R(0.00046758711843345623)
        },
        {
        R(-0.000260128605454677), R(0.00014905154997923021), R(0.00021305601507941145), R(-0.0002065648017398037),
        R(-0.00018208711104885064), R(-0.00041416720640606987), R(-3.5785485940035055e-05), R(-5.57535653171478e-05),
        R(0.0001315090371500131), R(-0.00046979646366185546), R(-0.0002635259451055552), R(0.00014116172872555895),
        R(-7.312011931455465e-05), R(0.00040597302393732474)
        },
        {
        R(0.001336217233415035), R(0.008575954175470472), R(-0.004665399641160771), R(0.0047835473157305025),
        R(0.004569049422019487), R(0.003594642609032706), R(0.004669219435065519), R(0.0024426748600494476),
        R(-0.00527321106912281), R(0.009970860471314359), R(0.004796697324705421), R(0.002278626341602622),
        R(-0.002920436455834807), R(0.002901907212079666)
        },
        {
        R(0.004740417539755324), R(-0.0001180430556277981), R(0.00303408007678974), R(0.0015308610504113614),
        R(-0.001669349436092246), R(0.0029447456790770506), R(0.00045697067833773994), R(-0.0019011373556475932),
        R(0.001787809660153844), R(-0.004436270819512791), R(-0.00019847029916769562), R(-0.0006913090982636047),
        R(-0.00271414647903102), R(-0.0015856128273280552)
        },
        {
        R(-0.0003561826898402773), R(-0.0003131147276708928), R(0.00011846765798957663), R(-0.00032771822292900946),
        R(-4.2031773949013145e-05), R(-0.00018316214284159923), R(-0.00018373363175819448), R(-0.00012095920537580683),
        R(3.2059664644807005e-05), R(5.148013535109795e-06), R(3.9439918710032453e-05), R(-3.804710929304303e-05),
        R(0.00012194362778139235), R(-3.490824218498908e-05)
        },
        {
        R(8.501127996783544e-05), R(-0.00023258209783810416), R(0.00012592394089727994), R(-7.160310321363385e-05),
        R(-0.0001808344716549711), R(-4.345569431058466e-05), R(5.8917386125175e-05), R(0.00012036031649784924),
        R(9.020988072245187e-05), R(-0.00010898152810498014), R(-0.00015242645122552116), R(-0.00012386703644742028),
        R(-1.4857211332491658e-05), R(-0.00017476966951192585)
        },
        {
        R(3.689477257588486e-05), R(-2.414717533774309e-06), R(-9.157216816618985e-05), R(2.594747680607188e-06),
        R(1.7872713372169592e-05), R(-0.00015699027600797022), R(4.6857671112058926e-05), R(-4.410339462096384e-05),
        R(-7.276924581784623e-05), R(5.059363150449089e-05), R(5.389681833222543e-05), R(2.955733096457537e-06),
        R(-1.2463554460581364e-05), R(-1.125915169803579e-05)
        },
        {
        R(0.00016996243060769475), R(-2.851490469212188e-05), R(-7.99150741908315e-06), R(-9.627945076224882e-05),
        R(-0.00019164761539658246), R(0.00021887817609644042), R(7.98704812265675e-05), R(0.00010399185743989838),
        R(-5.942573186869119e-05), R(0.0002520258925925201), R(2.160147807559468e-05), R(0.00015524331335766664),
        R(7.091076077318022e-05), R(0.00016668737689038294)
        },
        {
        R(-4.3787845074691424e-05), R(-1.9945213440314088e-05), R(-3.163640867195742e-05), R(0.0001781961469084415),
        R(6.225841210984905e-05), R(0.0004463144074754624), R(-0.0001841635124954753), R(-0.00029214541212149785),
        R(0.00017173232007113), R(-0.00031912638817236196), R(-4.628372591571089e-05), R(-5.161499217213629e-06),
        R(0.00027963727375854557), R(-0.0003120292227367271)
        },
        {
        R(-0.009020827810337494), R(-0.00029468600343870413), R(-0.002733036234935885), R(0.000278464464070342),
        R(0.002659753419492144), R(0.0006561431060368751), R(-0.0024936606545461707), R(0.0017357718228944198),
        R(0.0008075536421618046), R(0.0025814053436885604), R(-0.0020993177630390836), R(0.002293117790461405),
        R(0.00741990969635377), R(0.0034063879055857855)
        },
        {
        R(0.010361497767248571), R(-0.0011297751511931881), R(0.0031092059633817393), R(-0.004184399748445481),
        R(0.0026884424543141966), R(-0.005605322474935822), R(0.010325138793156679), R(0.01173700385207408),
        R(-0.007926360072181102), R(0.008628969834143858), R(0.004992141933962425), R(-0.0013272311743620137),
        R(0.0007299932650806484), R(-0.008261692923753129)
        },
        {
        R(0.009113416095213775), R(-0.0026155987758867258), R(0.002980319600965933), R(-0.004746202422267397),
        R(0.005361582143241457), R(-0.00923624388890078), R(0.009420356269145162), R(0.014133013337915314),
        R(-0.009254394394237565), R(0.010897787265450935), R(0.005242872166436259), R(-0.0008800799023222218),
        R(0.00660519705375848), R(-0.009137564114250117)
        },
        {
        R(0.005566250767795296), R(-0.004084626555557543), R(0.0008958376925942593), R(-0.0023579596077853613),
        R(0.003279308611590601), R(-0.008586677642718345), R(0.00287505040479282), R(0.002752536109809951),
        R(-0.003213676400111955), R(0.007416546113048689), R(0.0031623199933917927), R(-0.0014399416168039488),
        R(0.0071658267333091896), R(-0.004207305226064903)
        },
        {
        R(0.0025623653020037346), R(-0.00260781822202467), R(-0.0011736218277774392), R(-0.000680573317358468),
        R(0.0009304106482675358), R(-0.004174841730770918), R(0.0023850656208093657), R(-0.0032150884099053463),
        R(0.0014185181951896207), R(0.004471083823706735), R(0.0007511923120707119), R(-0.002149005429572855),
        R(0.004294654956616275), R(0.00026059865265039327)
        },
        {
        R(0.0018528640725418738), R(0.00021990602949673334), R(-0.001893280904835494), R(5.414227577389802e-05),
        R(0.00011145113986031197), R(-0.0003409060025026689), R(0.002482618161965891), R(-0.000898612847200813),
        R(0.0010114231126587677), R(-0.00013471940506216864), R(7.132956747616268e-05), R(-0.0006350154235033126),
        R(-0.0005205498425952375), R(0.0014323033211528188)
        }
    };
    real g[14];
    real a[14], sums[14];
    const real u0 = (known[11] - R(77.10074838861541)) / R(12.899251611384514); /* BP_1 [psi] */
    const real u6 = known[12]; /* RL_1 [1] */
    real y[1];
    real *const past = state->past + 97;
    unsigned int flags = 0u;

    real x[24];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = past[0] - past[1];
    x[3] = past[1] - past[3];
    x[4] = past[3] - past[7];
    x[5] = past[7] - past[15];
    x[6] = past[15] - past[31];
    x[7] = past[31] - past[63];
    x[8] = past[63] - past[127];
    x[9] = past[127] - past[255];
    x[10] = past[255] - past[511];
    x[11] = past[512];
    x[12] = past[513];
    x[13] = past[514];
    x[14] = past[515];
    x[15] = past[516];
    x[16] = past[517];
    x[17] = past[518];
    x[18] = past[519];
    x[19] = past[519] - past[520];
    x[20] = past[520] - past[522];
    x[21] = past[522] - past[526];
    x[22] = past[526] - past[534];
    x[23] = past[534] - past[550];
    weigh(sums, b, W[0], 14, x, 24);
    activate(a, sums, 14);
    weigh(g, v[0], G[0], 14, x, 24);
    y[0] = R(-0.008785847766557756) + dot(w[0], x, 24) + dot(g, a, 14);
    y[0] = ADDED(past[519], y[0], 27);
    {
        unsigned int held = 0u;
        real value; /* BP10_1 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(12.89566044959112) + R(77.10433955040881);
        if (value > known[27]) { /* BP10_1 may not be above BW_1 */
            value = known[27];
            y[0] = (value - R(77.10433955040881)) / R(12.89566044959112);
        }
        if (value >= known[27]) {
            held = 0u;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = (value - R(77.10433955040881)) / R(12.89566044959112);
        }
        if (value <= R(0.0)) {
            held = 0u;
        }
        known[28] = value;
        flags |= held;
    }
    memmove(past + 1, past + 0, 511 * sizeof *past);
    past[0] = u0;
    past[517] = u6;
    memmove(past + 520, past + 519, 31 * sizeof *past);
    past[519] = y[0];
    return flags;
}

/* BP10_1+AR10_1 -> RL10_1, NARX 0:0,1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage28(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[28]; /* BP10_1 [psi] */
    real y[1];
    real *const past = state->past + 648;
    unsigned int flags = 0u;

    y[0] = R(-28.8)
        + R(20.0) * (u0)
        + R(-20.0) * (past[0])
        + R(49.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 28);
    {
        real value; /* RL10_1 [1] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[29] = value;
    }
    past[1] = y[0];
    return flags;
}

/* AR10_1+BP10_1 -> XP10_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage29(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[28]; /* BP10_1 [psi] */
    real y[1];
    real *const past = state->past + 650;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 29);
    {
        real value; /* XP10_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[30] = value;
    }
    past[1] = y[0];
    return flags;
}

/* AR10_1+XP10_1 -> AL10_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage30(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[30]; /* XP10_1 [psi] */
    real y[1];
    real *const past = state->past + 652;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 30);
    {
        real value; /* AL10_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[31] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP10_1+RL10_1 -> AR10_1, NARX 0:1,2/2/12 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage31(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][6] = {
        {
        R(-0.002273475077571474), R(0.08750307130576576), R(0.0008223617395632246), R(0.002297361792417292),
        R(-0.0033325303913965343), R(0.004722628604116493)
        }
    };
    /* by regressor, then by neuron */
    static const real W[6][12] = {
        {
        R(8.380881075126169), R(3.2056665073501946), R(-6.451919684042217), R(-25.67364085117002),
        R(20.911879986626943), R(-11.761123520608976), R(-8.305745051080123), R(-19.735860321936997),
        R(-18.95258441787567), R(16.923740302031412), R(-6.304305606897486), R(-5.180003054071243)
        },
        {
        R(55.76401761298415), R(10.070474382516167), R(-37.52343848455643), R(13.675904195991372),
        R(-15.775435877409262), R(-62.532741008566816), R(-282.58899682070233), R(-81.23939531641614),
        R(-70.79582876369777), R(-43.94795005598855), R(-116.02050707163214), R(-56.67727104574728)
        },
        {
        R(-0.19174772505976456), R(-3.6502988597945993), R(-0.038975124620008295), R(12.985864370127366),
        R(-1.8154371860891758), R(0.3736669094644687), R(5.521217937587708), R(-3.307961858335841),
        R(2.1404879153785457), R(-1.1521601970446795), R(-0.6653620298340073), R(-0.7252535314578821)
        },
        {
        R(0.36349064834670664), R(2.541734229340509), R(2.3121533776578893), R(0.9317938557652253),
        R(-2.841381139596105), R(-0.49552497557691033), R(-2.1717737014990823), R(4.052806764732998),
        R(-0.20108674286823633), R(-2.9079682023278046), R(5.374868667959442), R(-0.11227713453065713)
        },
        {
        R(-7.939662002125878), R(-5.9646217716201075), R(5.959150770637201), R(24.39117283535751),
        R(-2.2046101058583805), R(11.561812827578935), R(8.166369132195527), R(18.425112671143445),
        R(18.570772556242485), R(-0.8201366997739921), R(5.22276634685992), R(4.4413499570628945)
        },
        {
        R(4.359354030403462), R(4.7226846900634945), R(-1.7611585060564754), R(-12.782212534999648),
        R(6.556820279097287), R(-10.489669848331697), R(-4.3722197765389845), R(-9.538988243992272),
        R(-13.23622868929179), R(0.09397999236814253), R(-4.593055942912062), R(-1.7203124188312788)
        }
    };
    static const real b[12] = {
        R(-0.7854104795669525), R(-4.975265965523954), R(-0.3968151523878636), R(-14.478917457246858),
        R(-19.231504729281685), R(0.4343106467353922), R(-7.674573550684702), R(5.710666993752596),
        R(2.355386702146546), R(-17.536272282326006), R(1.4075003860684345), R(0.8639076592781232)
    };
    /* by output, then by neuron */
    static const real v[1][12] = {
        {
        R(-0.006048589623668131), R(0.0019383375079660464), R(-0.0018480481324613786), R(-0.0014244928898889896),
        R(-0.002360388327434738), R(-0.0019335460911195034), R(-0.0005514943566220436), R(0.0013304332304271405),
        R(-0.008549016345403957), R(0.005378847652012222), R(-0.002528270109105415), R(0.0035493099631930558)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[6][12] = {
        {
        R(-0.011875890766540644), R(-0.004636583565192315), R(0.012818135684171415), R(0.003037955671837844),
        R(0.004026800565011146), R(-0.0020907270773585784), R(0.0032963667220801325), R(-0.0018006305818126997),
        R(-0.005997058511635711), R(-0.008637590789457777), R(-0.009567807031476382), R(-0.006487146916385411)
        },
        {
        R(0.03287585003485494), R(-0.006083579489397014), R(-0.04999824770406448), R(0.317936950186396),
        R(-0.4500389732572237), R(0.4133893630439153), R(-0.002572552183751487), R(-0.053245730591870606),
        R(-0.008851177318012665), R(0.23917176751985408), R(0.03523085460002604), R(-0.3124453587447955)
        },
        {
        R(0.016188693882183875), R(0.0011595173340870366), R(-0.0017689026617827169), R(-0.003165829158325086),
        R(-0.002590754079024946), R(0.0025453032548433015), R(-0.0005207271793016982), R(0.00047829920479557217),
        R(0.010542220944427569), R(0.004564815811309724), R(0.004870718877954528), R(0.0022544310136574214)
        },
        {
        R(-0.003672285477340245), R(-0.0024681119136188085), R(-0.0025867177599465485), R(-0.0015313813565111514),
        R(0.0002166176407093801), R(-0.0006543184526035383), R(0.0005088766655507397), R(0.002173426880219381),
        R(0.00010542738008908682), R(-0.003663844245138162), R(-0.0005674445114336388), R(0.002786063865219197)
        },
        {
        R(0.0018650291249777357), R(0.004313038739391531), R(-0.014692784916512314), R(-0.0033366559474284838),
        R(0.0035247441921430886), R(-0.002219452670163179), R(-0.0002742833331693989), R(0.001167202416301996),
        R(0.004549766561392472), R(-0.005329978033854883), R(0.009721684833962395), R(0.0028680069378658633)
        },
        {
        R(-0.0031052465806576963), R(-0.005595886544859029), R(0.005363383407451806), R(-0.001431211290487328),
        R(-0.004902082750234781), R(0.002754358169542052), R(-0.0035203145333673916), R(0.0026187493985740952),
        R(-0.0004477550965395059), R(-0.0005927079225154175), R(-0.0012575365143253708), R(0.0019845940156633084)
        }
    };
    real g[12];
    real a[12], sums[12];
    const real u0 = (known[28] - R(77.10074838861541)) / R(12.899251611384514); /* BP10_1 [psi] */
    const real u1 = (known[29] - R(0.5)) / R(0.5); /* RL10_1 [1] */
    real y[1];
    real *const past = state->past + 654;
    unsigned int flags = 0u;

    real x[6];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = past[1];
    x[3] = past[1] - past[2];
    x[4] = past[3];
    x[5] = past[3] - past[4];
    weigh(sums, b, W[0], 12, x, 6);
    activate(a, sums, 12);
    weigh(g, v[0], G[0], 12, x, 6);
    y[0] = R(0.00176889420538532) + dot(w[0], x, 6) + dot(g, a, 12);
    y[0] = ADDED(past[3], y[0], 31);
    {
        unsigned int held = 0u;
        real value; /* AR10_1 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(12.899216372399025) + R(77.10078363184411);
        if (value > known[2]) { /* AR10_1 may not be above AH10_1 */
            value = known[2];
            y[0] = (value - R(77.10078363184411)) / R(12.899216372399025);
        }
        if (value >= known[2]) {
            held = 0u;
        }
        if (value < known[31]) { /* AR10_1 may not be below AL10_1 */
            value = known[31];
            y[0] = (value - R(77.10078363184411)) / R(12.899216372399025);
        }
        if (value <= known[31]) {
            held = 0u;
        }
        known[32] = value;
        flags |= held;
    }
    past[0] = u0;
    past[2] = past[1];
    past[1] = u1;
    past[4] = past[3];
    past[3] = y[0];
    return flags;
}

/* BP10_1+AR10_1 -> RX10_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage32(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[28]; /* BP10_1 [psi] */
    const real u1 = known[32]; /* AR10_1 [psi] */
    real y[1];
    real *const past = state->past + 659;
    unsigned int flags = 0u;

    y[0] = R(-28.3)
        + R(20.0) * (u0)
        + R(-20.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 32);
    {
        real value; /* RX10_1 [1] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[33] = value;
    }
    past[0] = y[0];
    return flags;
}

/* ER10_1+BP10_1+RX10_1 -> FR10_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage33(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[28]; /* BP10_1 [psi] */
    const real u2 = known[33]; /* RX10_1 [1] */
    real y[1];
    real *const past = state->past + 660;
    unsigned int flags = 0u;

    y[0] = R(-100.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(100.0) * (u2)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 33);
    {
        real value; /* FR10_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[34] = value;
    }
    past[1] = y[0];
    return flags;
}

/* ER10_1+FR10_1 -> EL10_1, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage34(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[34]; /* FR10_1 [psi] */
    real y[1];
    real *const past = state->past + 662;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 34);
    {
        real value; /* EL10_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[35] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP10_1+AR10_1+RL10_1 -> ER10_1, NARX 0:1/1/10 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage35(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][7] = {
        {
        R(0.002530721199094213), R(-0.07698537584460251), R(0.002787294000788698), R(-0.3099051623734298),
        R(-0.0010066777885356696), R(7.315163436917159e-05), R(-0.0034318768712034986)
        }
    };
    /* by regressor, then by neuron */
    static const real W[7][10] = {
        {
        R(3.370078555540175), R(18.718312883861515), R(-15.354402406851907), R(6.419851945553837),
        R(-35.54561780765847), R(-55.57584528127217), R(-13.804382503288593), R(-1.5528345002070179),
        R(-4.327865252517437), R(-0.31577638195222146)
        },
        {
        R(116.38779005010325), R(79.36600484816451), R(-23.084454012714477), R(-10.406862490642753),
        R(-51.365522522091226), R(80.7665107989974), R(142.30428158221585), R(16.81077486651973),
        R(1.8064543710408298), R(-6.398340491971017)
        },
        {
        R(-1.2522405350322288), R(-6.918830359188405), R(10.369596649632115), R(0.613858874799253),
        R(29.850160814657556), R(6.641078721180293), R(17.849144674508807), R(-1.837674747474523),
        R(0.7879406489876146), R(-0.4112732206058354)
        },
        {
        R(-871.5154934317777), R(-159.61182603110703), R(234.2293312022701), R(-7.819940264642257),
        R(2359.9475711819346), R(3672.106374313107), R(412.0551070687321), R(413.52248039712833), R(615.0921806788295),
        R(-238.5798187404542)
        },
        {
        R(-0.5514271012286063), R(-0.9331271332989637), R(0.027347499412644805), R(-7.3775659939564076),
        R(1.525275251876892), R(8.933033742916718), R(-2.584255800443104), R(0.8714825405335489), R(3.24323329375774),
        R(-1.108492670949101)
        },
        {
        R(10.54114184822428), R(-3.456741605050116), R(0.4207927927371487), R(6.4988606710135315),
        R(0.9058185648710716), R(5.588213427742172), R(0.3712401377907636), R(-19.008956557715592),
        R(-16.488082637286524), R(-0.5888346000547011)
        },
        {
        R(0.5828939678717759), R(-6.46281540404346), R(3.430854976452883), R(-3.455135314523608), R(2.00482444437436),
        R(26.035943920845806), R(-2.566003287730635), R(1.7256631385680214), R(1.2303866473547715),
        R(0.8521450372678239)
        }
    };
    static const real b[10] = {
        R(0.6727551226888011), R(-4.857110747869935), R(1.6827397880307917), R(5.178414151687395),
        R(1.6396300937770585), R(6.592216688141694), R(-1.3929800358859135), R(-3.5051005968626154),
        R(-2.3047618625362185), R(0.5730147517228352)
    };
    /* by output, then by neuron */
    static const real v[1][10] = {
        {
        R(-0.0004609274782181086), R(0.0006105755645835957), R(0.0019677631424373163), R(-0.003161559071379984),
        R(0.00034606929273852484), R(-0.0015777924500028765), R(-0.0006786386343766567), R(0.00034685352497809414),
        R(0.00010195824621979095), R(0.0006012409485900007)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[7][10] = {
        {
        R(0.000567942249945233), R(0.003378880995978572), R(-0.0046219577003872095), R(0.0021860221525196524),
        R(-0.0014185197991059273), R(0.0015761960163727107), R(-0.006041294309958763), R(-0.001455856461933483),
        R(0.007994949106929043), R(0.0053631995404078495)
        },
        {
        R(0.049725490256154116), R(-0.003602251730177821), R(0.060684366884518864), R(-0.015905322953034907),
        R(-0.07151213476324648), R(-0.061016346863823095), R(-0.03230161894332475), R(-0.026526059077395393),
        R(-0.05263836065226449), R(-0.046069428176581044)
        },
        {
        R(-0.0010544429400208), R(-0.0018603962795610274), R(0.0038217638620614003), R(-0.007080096806030681),
        R(0.0016084156903337365), R(-0.0014049230460885936), R(-0.00010890042119648946), R(-0.00027258931880946857),
        R(-0.007204204142432058), R(-0.009733955171345343)
        },
        {
        R(0.17378412443871555), R(-0.6239098079478462), R(-0.2716227286852515), R(0.12743640210092422),
        R(-0.12914634844225076), R(-0.09687494658521086), R(0.26600128411316665), R(0.317869215939218),
        R(0.10194588821960701), R(0.6096247171644636)
        },
        {
        R(-9.448463239270996e-05), R(0.0005147200789871204), R(-0.0004211054682306584), R(0.0012353353023704834),
        R(0.0003821602774675163), R(-0.0017261831670451733), R(0.0014674869320406407), R(0.0008699593704083091),
        R(0.0003098017219942393), R(0.0021450115436432013)
        },
        {
        R(-0.005804148721594537), R(-0.00946813646177345), R(0.002198836373156907), R(-0.0005857571223963887),
        R(0.004314768589526072), R(-0.003239490646716353), R(-0.002226391877984382), R(-0.007002961141796707),
        R(2.4336954818627103e-05), R(0.007016304504316179)
        },
        {
        R(0.0003676677298003232), R(-0.0016501627779741377), R(-0.00116257275806835), R(0.005677241054428218),
        R(-4.65136196805018e-05), R(-0.00032495871462848326), R(0.004773737538394752), R(-0.00031424959086261925),
        R(0.001185747280256814), R(0.003432934931245035)
        }
    };
    real g[10];
    real a[10], sums[10];
    const real u0 = (known[28] - R(77.10074838861541)) / R(12.899251611384514); /* BP10_1 [psi] */
    const real u1 = (known[32] - R(77.10078363184411)) / R(12.899216372399025); /* AR10_1 [psi] */
    const real u2 = (known[29] - R(0.5)) / R(0.5); /* RL10_1 [1] */
    real y[1];
    real *const past = state->past + 664;
    unsigned int flags = 0u;

    real x[7];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = u1;
    x[3] = u1 - past[1];
    x[4] = u2;
    x[5] = u2 - past[2];
    x[6] = past[3];
    weigh(sums, b, W[0], 10, x, 7);
    activate(a, sums, 10);
    weigh(g, v[0], G[0], 10, x, 7);
    y[0] = R(-0.0003585282757339048) + dot(w[0], x, 7) + dot(g, a, 10);
    y[0] = ADDED(past[3], y[0], 35);
    {
        unsigned int held = 0u;
        real value; /* ER10_1 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(7.087527821111905) + R(82.91247217899802);
        if (value > known[4]) { /* ER10_1 may not be above EH10_1 */
            value = known[4];
            y[0] = (value - R(82.91247217899802)) / R(7.087527821111905);
        }
        if (value >= known[4]) {
            held = 0u;
        }
        if (value < known[35]) { /* ER10_1 may not be below EL10_1 */
            value = known[35];
            y[0] = (value - R(82.91247217899802)) / R(7.087527821111905);
        }
        if (value <= known[35]) {
            held = 0u;
        }
        known[36] = value;
        flags |= held;
    }
    past[0] = u0;
    past[1] = u1;
    past[2] = u2;
    past[3] = y[0];
    return flags;
}

/* BP10_1 -> LA_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage36(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[28]; /* BP10_1 [psi] */
    real y[1];
    real *const past = state->past + 668;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.005) * (u0)
        + R(-0.0050000000000000044) * (past[0]);
    y[0] = ADDED(past[0], y[0], 36);
    {
        real value; /* LA_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[37] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP10_1 -> LB_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage37(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[28]; /* BP10_1 [psi] */
    real y[1];
    real *const past = state->past + 669;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.0016667) * (u0)
        + R(-0.001666700000000021) * (past[0]);
    y[0] = ADDED(past[0], y[0], 37);
    {
        real value; /* LB_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[38] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP10_1 -> LC_1, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage38(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[28]; /* BP10_1 [psi] */
    real y[1];
    real *const past = state->past + 670;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.00055556) * (u0)
        + R(-0.0005555600000000105) * (past[0]);
    y[0] = ADDED(past[0], y[0], 38);
    {
        real value; /* LC_1 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[39] = value;
    }
    past[0] = y[0];
    return flags;
}

/* AR_2+RL_2 -> AH_2, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage39(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 671;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(100.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 39);
    {
        real value; /* AH_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[40] = value;
    }
    past[2] = y[0];
    return flags;
}

/* AR10_2+RL10_2 -> AH10_2, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage40(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 674;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(100.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 40);
    {
        real value; /* AH10_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[41] = value;
    }
    past[2] = y[0];
    return flags;
}

/* ER_2+RL_2 -> EH_2, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage41(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 677;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(100.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 41);
    {
        real value; /* EH_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[42] = value;
    }
    past[2] = y[0];
    return flags;
}

/* ER10_2+RL10_2 -> EH10_2, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage42(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 680;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(100.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 42);
    {
        real value; /* EH10_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[43] = value;
    }
    past[2] = y[0];
    return flags;
}

/* AR_2+BC_2 -> XS_2, NARX 1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage43(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    real y[1];
    real *const past = state->past + 683;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (past[1])
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 43);
    {
        real value; /* XS_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[44] = value;
    }
    past[2] = y[0];
    return flags;
}

/* STP+EQ_2 -> XQ_2, NARX 0:0,1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage44(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[0]; /* STP [psi] */
    real y[1];
    real *const past = state->past + 686;
    unsigned int flags = 0u;

    y[0] = R(-0.4)
        + R(-1.0) * (u0)
        + R(1.0) * (past[0])
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 44);
    {
        real value; /* XQ_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[45] = value;
    }
    past[1] = y[0];
    return flags;
}

/* STP+XQ_2 -> EQ_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage45(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[0]; /* STP [psi] */
    const real u1 = known[45]; /* XQ_2 [psi] */
    real y[1];
    real *const past = state->past + 688;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 45);
    {
        real value; /* EQ_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[46] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP_2+EQ_2 -> BM_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage46(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[46]; /* EQ_2 [psi] */
    real y[1];
    real *const past = state->past + 689;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(-1.0) * (past[0])
        + R(1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 46);
    {
        real value; /* BM_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[47] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP10_2+BP_2+BM_2 -> BN_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage47(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u2 = known[47]; /* BM_2 [psi] */
    real y[1];
    real *const past = state->past + 691;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (past[1])
        + R(-1.0) * (u2)
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 47);
    {
        real value; /* BN_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[48] = value;
    }
    past[2] = y[0];
    return flags;
}

/* BP_2+BM_2+BN_2+RL_2+RL10_2 -> BU_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage48(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[47]; /* BM_2 [psi] */
    const real u2 = known[48]; /* BN_2 [psi] */
    real y[1];
    real *const past = state->past + 694;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(1.0) * (u1)
        + R(1.0) * (u2)
        + R(100.0) * (past[1])
        + R(100.0) * (past[2])
        + R(-1.0) * (past[3]);
    y[0] = ADDED(past[3], y[0], 48);
    {
        real value; /* BU_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[49] = value;
    }
    past[3] = y[0];
    return flags;
}

/* STP+AR_2+ER_2+BP10_2+XQ_2+QX_2+QF_2+RL_2+RL10_2 -> BP_2, NARX 0..8(5),1,1..8(4)/1..8(4)/12 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage49(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][20] = {
        {
        R(-0.038461685881957246), R(0.0365120890901451), R(0.014587040830404904), R(-0.007955126376297163),
        R(0.007891848611632623), R(0.0024366695303043727), R(0.0005797031798545076), R(0.03771247930225047),
        R(0.21645909932762453), R(-0.05290244726175668), R(-0.010018465488239267), R(-0.0033519895129829557),
        R(-0.029906435157800643), R(0.0038627050050678534), R(0.0017521183237973492), R(-0.0006647306859498834),
        R(-0.002852178262381922), R(0.002467160894496046), R(0.0006831676082885716), R(-0.00016686253683097203)
        }
    };
    /* by regressor, then by neuron */
    static const real W[20][12] = {
        {
        R(-1.8738056507225287), R(13.83221344312221), R(1.3949129679591472), R(-5.320253387907133),
        R(-0.028941295049625282), R(1.6363796837853184), R(30.652148196755267), R(9.913472549517001),
        R(3.264657017065282), R(-11.124435918503499), R(-2.1962566201244726), R(18.012557761934033)
        },
        {
        R(1.0644702572786944), R(9.492897109775761), R(-8.468641534609183), R(-22.64041665092705),
        R(-2.1392992303800846), R(1.0197788921982234), R(-26.91721899788116), R(-9.918459427073717),
        R(-3.250221163705733), R(14.272426905118023), R(0.3949981393095654), R(12.843298417601)
        },
        {
        R(-0.537649113008453), R(11.148491371315739), R(0.8464955842536619), R(1.082647228591835),
        R(-0.8546587301019988), R(-0.4435682115920798), R(28.687795619602372), R(6.543357000195793),
        R(3.783271778765952), R(11.80405855805492), R(3.036413260022563), R(9.353799980162101)
        },
        {
        R(0.9003661299616362), R(4.011432440003496), R(-2.6467171697688356), R(4.440838554219749),
        R(-1.8140491762688264), R(2.3040781298131696), R(-13.914683511306766), R(0.43656165682302345),
        R(2.203297397916853), R(-2.6213885609052525), R(-0.27038845640135145), R(-0.7451371697026068)
        },
        {
        R(0.09571652869232103), R(-2.4595089747665666), R(-3.3802626274399996), R(-1.3615850256389168),
        R(-0.6649697637404309), R(2.6212146659685405), R(-1.0051457347117203), R(-0.48650103672328676),
        R(0.26477904708999106), R(8.024133938030264), R(-0.08578751277025357), R(-1.1502955251348972)
        },
        {
        R(-0.9504482528354782), R(-0.1218981855865201), R(1.095098630031197), R(1.6712648366761753),
        R(-3.3805301294266545), R(11.798877731183023), R(-22.883305363677156), R(-1.2688390867437158),
        R(4.20443803479519), R(6.199502622195957), R(-0.6158266586924425), R(-0.27199827534325194)
        },
        {
        R(0.07998458477404408), R(-0.22530829818767756), R(-2.9094209639597146), R(0.42077848704226956),
        R(2.1943614138057796), R(-4.857857873488202), R(-0.14010639619602036), R(-0.3864825834608221),
        R(-1.5391921451157535), R(3.842060679850889), R(-0.08881985883769802), R(0.001552929540354575)
        },
        {
        R(5.157621855287848), R(-13.26166059824061), R(-0.9201266220625541), R(5.349875638307481),
        R(-1.6146458979592353), R(-9.691062600609257), R(-12.893927152658875), R(-9.85920804622738),
        R(-11.548309554822282), R(7.242111084181261), R(2.259533878496356), R(-1.5844913839221704)
        },
        {
        R(-0.47638439131814536), R(175.98014832484566), R(73.58598452313879), R(42.44639775380147),
        R(74.37847551398212), R(-67.0571215560925), R(995.8419485468307), R(49.856559804016), R(144.60415435427493),
        R(-679.7195002368487), R(-42.195989924299404), R(-115.90577352600282)
        },
        {
        R(-11.352285311207968), R(-58.05027825885917), R(-60.716217418363954), R(5.149560596314237),
        R(-32.808074150607226), R(-138.01147627829113), R(-51.9952317826194), R(54.53926883740844),
        R(-21.655584140371186), R(199.54612674481677), R(4.3178360417143296), R(3.8564991955996026)
        },
        {
        R(3.8402980787896177), R(-1.4629947262307488), R(-4.385323909267083), R(6.439401593338799),
        R(-9.25080703421276), R(58.72769006724274), R(-114.70849120967533), R(-34.89526810514545),
        R(-14.751526135823093), R(35.7499245268785), R(4.470768319776575), R(10.300307174175186)
        },
        {
        R(-0.1430240914342491), R(1.131104512290628), R(-0.07349501125623506), R(-0.7176122418549927),
        R(0.05734386546448747), R(-0.3037216291530608), R(1.440898614046283), R(0.8135683778607985),
        R(0.18039285329669072), R(-0.7560964885586697), R(-0.1881562969160031), R(-1.2675302578782768)
        },
        {
        R(-0.3167557068223617), R(5.634282557227606), R(-11.149199284677863), R(-6.105158080528402),
        R(-1.7158994264085259), R(13.569553835103696), R(11.464158820501586), R(7.5189886312587175),
        R(5.937848734535911), R(-2.604256438263264), R(-0.9565115102614521), R(2.2703066416984763)
        },
        {
        R(0.2675064173799722), R(-1.7016347157958553), R(0.05174118493018601), R(0.14573448463212482),
        R(0.02464819740471525), R(-0.17060811327069011), R(-5.338963312478779), R(-1.1000722299567955),
        R(-0.3989315157550204), R(-0.9224772883100869), R(-0.02117576695146692), R(-0.3868257691329129)
        },
        {
        R(0.06150734667757968), R(0.23252548803728756), R(0.3770676327665239), R(0.12415078902694682),
        R(0.018022981480420475), R(-1.1226860701752361), R(0.5917024618879985), R(0.07813844367724507),
        R(1.091953362385854), R(-0.7814752186486063), R(0.28032665413365815), R(0.2987519991392018)
        },
        {
        R(-0.023851882840461802), R(-0.04788867003323327), R(-0.6962424049471538), R(-0.2166169422732436),
        R(0.06146443168664195), R(-0.4490680986378124), R(0.1940258913309829), R(-0.061582226707359716),
        R(-0.25257133828661954), R(0.2716175590265859), R(0.018962545755737692), R(0.017450674482279993)
        },
        {
        R(-2.4176242530990373), R(-0.043776779937942045), R(3.425006228609014), R(-2.7404717688148943),
        R(1.4804944381550884), R(5.213590003473922), R(5.3115514937412875), R(2.2863079327284437),
        R(6.708764387384465), R(-8.834798231012776), R(0.7427842467279769), R(-16.20762605044282)
        },
        {
        R(2.626945844241156), R(-1.2943203664224556), R(-1.4230542832622108), R(2.7619624537723193),
        R(0.3568069395393296), R(-5.611058715811728), R(-5.9707408361199725), R(-1.4427573554774007),
        R(-6.4069854393275785), R(4.233946116954002), R(-0.854193369067271), R(8.859166766153912)
        },
        {
        R(-0.7561444749655406), R(-2.740732167264178), R(0.3807479146530788), R(2.4607101063951733),
        R(2.145667638457373), R(-1.9161394862693182), R(-6.984394677820248), R(-0.40302677485442817),
        R(-5.255941649900047), R(1.7788082423766225), R(-0.7478297995869116), R(13.12448172879895)
        },
        {
        R(-0.12346931801952385), R(-2.5219961382404428), R(1.3850334584377317), R(0.9207923359682151),
        R(1.9059461223254492), R(0.3970912414431862), R(-5.928204824498867), R(0.18782354799679982),
        R(-3.066665793199152), R(2.4692497260463715), R(-0.5363723416092883), R(1.177397205591154)
        }
    };
    static const real b[12] = {
        R(0.2068059547363924), R(-1.0360925475931417), R(-2.477053575772964), R(0.5345978463987067),
        R(2.5869140359115486), R(-1.7363438514382705), R(-4.2475102228940145), R(0.831835923736564),
        R(-2.933457576697924), R(4.164485351961852), R(-0.07337796642535352), R(0.0067843269449461285)
    };
    /* by output, then by neuron */
    static const real v[1][12] = {
        {
        R(0.007534841322744561), R(0.006862520434892003), R(-0.004065962085357344), R(0.0004840370724328366),
        R(0.0016119852414510259), R(0.00037119672002730055), R(0.0012342611275942266), R(-0.0041071653024411185),
        R(0.0014334433110919764), R(-0.001921236612470273), R(-0.007844230728220098), R(0.00839645056420171)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[20][12] = {
        {
        R(0.0004398334997508732), R(-0.03183575107832946), R(0.022071195098573616), R(-0.0014024169069230862),
        R(-0.02637288578452277), R(0.0015290266527025502), R(-0.006373950786579005), R(-0.013306529667720883),
        R(-0.003236867082768785), R(0.0058420054801944015), R(-0.002116029273220788), R(-0.029182034191789125)
        },
        {
        R(0.05261732455763471), R(0.10924770478666879), R(-0.013202894651957264), R(0.002877633980256664),
        R(0.023232194201306348), R(0.004736222325086291), R(0.006715625150453906), R(0.034891548035815824),
        R(0.007646965892129806), R(-0.0021934954928123328), R(-0.008130642293054494), R(0.006406530536724769)
        },
        {
        R(0.0036344040360221145), R(-0.06105893125954817), R(0.007007152597396109), R(-0.0009730688032993148),
        R(0.02508157166681272), R(0.014735305077956578), R(-0.005419710637943675), R(-0.019228302591139612),
        R(-0.0068949146061671705), R(0.008687032456518966), R(0.011242208041722965), R(0.0647762857738856)
        },
        {
        R(-0.002474861084630554), R(-0.005131211107590949), R(0.0009898339083352864), R(0.012762482527771169),
        R(-0.0009999569856710814), R(-1.3367900313209424e-05), R(0.002553884938537752), R(0.0011967495248922234),
        R(-0.002888916851193195), R(0.0003641100036029921), R(-0.014261744825540126), R(-0.0010702377401489908)
        },
        {
        R(-0.0009172767673185389), R(0.000403291124826805), R(-0.0004194475249180407), R(0.010012441365322403),
        R(-0.0007336422791393416), R(-0.0015783497588880205), R(-0.0036414908792325087), R(-0.0007410624184128999),
        R(-0.0018811464358010482), R(-0.00043315833889161204), R(-0.001991248466324278), R(0.0016310888409650406)
        },
        {
        R(-0.004052866798652615), R(-0.0017138563390378062), R(-0.00012311713257870358), R(0.0043938025813656635),
        R(-0.006957506853176978), R(-0.00013978065743241173), R(-0.0019226696850558067), R(0.005622610462103018),
        R(-0.0061501581771790815), R(-0.004374710498855998), R(-0.0014226416984232972), R(0.0005580706528163291)
        },
        {
        R(-0.0012657872732970794), R(0.0015698683026815834), R(-0.004359847641634995), R(-0.0005566274929224736),
        R(0.003404793703183512), R(0.00012705052691848147), R(0.0007371066367927682), R(0.0007778722471568668),
        R(0.005240057990158612), R(-0.002714360114671797), R(-0.001562974894316193), R(0.000587634171492903)
        },
        {
        R(0.008939298615122555), R(0.028757787697099413), R(-0.018625827011924945), R(-0.001493433166448399),
        R(0.03241543265441661), R(-0.0011347376773309485), R(0.00604274276205638), R(0.007538276700950419),
        R(0.0020472903975361917), R(0.0032450814979614407), R(0.004749733993708344), R(0.03100264581966117)
        },
        {
        R(0.05892034510225624), R(-0.21254429921970308), R(0.4066051209045814), R(-0.31662229657954716),
        R(0.02528537949933343), R(-0.01990489471099311), R(0.20153479560279175), R(0.5225111097648111),
        R(-0.016684913099257445), R(0.003216651592643366), R(-0.17920533031161004), R(-0.017455009599600946)
        },
        {
        R(-0.04109423479857067), R(0.05202091020774634), R(-0.04167583742709733), R(0.038429073595956646),
        R(-0.017695920858367933), R(0.015569787821853594), R(-0.04091360168123144), R(-0.09275392290479227),
        R(0.03647925967455384), R(0.06749529453954943), R(0.03961134862595156), R(0.08315514466540169)
        },
        {
        R(-0.03401737812893062), R(0.0006714700410147273), R(-0.07467724350765226), R(0.01812392714550991),
        R(-0.0037986805877658248), R(0.005974936347509685), R(-0.005694975301040452), R(-0.04151724740325884),
        R(-0.04899246739692047), R(-0.04065056857548713), R(-0.023502706758509292), R(-0.047569413434929125)
        },
        {
        R(7.386168289313492e-05), R(-0.0025207292946727495), R(0.0017688827618127308), R(-0.000241714576002269),
        R(-0.002107101809967873), R(9.26386206935215e-05), R(-0.00042110700098027293), R(-0.0014405745120498927),
        R(-9.887696604930387e-05), R(0.00023691916082465292), R(-0.00037887784995859283), R(-0.0031762206063311997)
        },
        {
        R(0.005176002925089124), R(-0.016191750944936682), R(0.014909204692561523), R(0.0011705226636383576),
        R(-0.013189688459613613), R(-0.0003432066718237971), R(-0.0018295217679932317), R(-0.01007294039984389),
        R(-0.003937289479702528), R(0.0025806384027845415), R(-0.0010103467080514064), R(-0.00974199358368184)
        },
        {
        R(-0.00013578242029677317), R(0.002591220388662996), R(-0.0022794431220652623), R(0.0003044351570230795),
        R(0.0025308438046598414), R(0.00011263086264028346), R(0.0004175227944462877), R(0.0014355360897799242),
        R(0.00018112044287629364), R(-0.0017474936968407129), R(0.0019350889993022444), R(0.00264666468705822)
        },
        {
        R(0.0014208773890364245), R(7.901774315908919e-05), R(0.0001172390367792384), R(0.0009944341869387889),
        R(-0.0003819979173540918), R(0.0003142107273364513), R(0.0004707462053653911), R(0.0003912006744913729),
        R(0.0007252402396094489), R(-0.0006308357870598597), R(-0.00566438777259461), R(-0.0011163200738550658)
        },
        {
        R(-0.0002206564974906568), R(0.0009154392418269249), R(-0.0004380292833718986), R(-0.0001743036139521284),
        R(0.0010500625147396637), R(4.9549579110248656e-05), R(-0.0004045231750373962), R(7.933648677464891e-05),
        R(0.000361943730356602), R(2.6390401344355126e-05), R(0.0007142785246129402), R(0.0004227421581172357)
        },
        {
        R(-0.004297389576219897), R(0.0017596905596618116), R(0.004693506865690694), R(0.0006096776686582033),
        R(-0.004166984119053728), R(-0.00045797472368167176), R(0.001182107121097618), R(-3.2704288332605164e-05),
        R(-0.001035546294410565), R(0.0006367331218350624), R(0.0009414418351813571), R(-0.0030035265136305928)
        },
        {
        R(-0.0006970293614983929), R(-0.0020767607181030427), R(-0.0017231112933309063), R(0.001324367664258036),
        R(0.0035158484749024765), R(0.00032929803421852277), R(-0.0014255096230864292), R(1.4075890315353888e-05),
        R(0.0016321198593412982), R(-0.0018821545856291537), R(-0.00025421534901165456), R(0.0013059461526943304)
        },
        {
        R(-0.006958807758412622), R(-0.000796604946221209), R(0.002489564453199753), R(0.0035680707261183655),
        R(0.0013390680353440104), R(-0.000532984536348328), R(-0.0006920268923149366), R(-0.000982027888643265),
        R(0.0027561826801330925), R(-0.0032933900069042153), R(-9.518107434528601e-05), R(-0.0003522418074511376)
        },
        {
        R(-0.0074026550758306995), R(-0.00026941000747207795), R(0.002977235858128608), R(0.003222004091946272),
        R(0.0005638050026131834), R(-0.0006275402762433642), R(-0.0006842505955661481), R(-0.001173570294756252),
        R(0.0025188714856942186), R(-0.0029901479536904845), R(-0.0004963705282485812), R(-0.0002582586069530454)
        }
    };
    real g[12];
    real a[12], sums[12];
    const real u0 = (known[0] - R(77.1)) / R(12.899999999999999); /* STP [psi] */
    const real u4 = known[45]; /* XQ_2 [psi] */
    real y[1];
    real *const past = state->past + 698;
    unsigned int flags = 0u;

    real x[20];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = past[0] - past[1];
    x[3] = past[1] - past[3];
    x[4] = past[3] - past[7];
    x[5] = past[8];
    x[6] = past[9];
    x[7] = past[10];
    x[8] = past[10] - past[11];
    x[9] = past[11] - past[13];
    x[10] = past[13] - past[17];
    x[11] = past[18];
    x[12] = past[19];
    x[13] = past[20];
    x[14] = past[21];
    x[15] = past[22];
    x[16] = past[23];
    x[17] = past[23] - past[24];
    x[18] = past[24] - past[26];
    x[19] = past[26] - past[30];
    weigh(sums, b, W[0], 12, x, 20);
    activate(a, sums, 12);
    weigh(g, v[0], G[0], 12, x, 20);
    y[0] = R(0.005063269688891773) + dot(w[0], x, 20) + dot(g, a, 12);
    y[0] = ADDED(past[23], y[0], 49);
    {
        unsigned int held = 0u;
        real value; /* BP_2 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(12.899251611384514) + R(77.10074838861541);
        if (value > known[49]) { /* BP_2 may not be above BU_2 */
            value = known[49];
            y[0] = (value - R(77.10074838861541)) / R(12.899251611384514);
        }
        if (value >= known[49]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = (value - R(77.10074838861541)) / R(12.899251611384514);
        }
        if (value <= R(0.0)) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        known[50] = value;
        flags |= held;
    }
    past[7] = past[6];
    past[6] = past[5];
    past[5] = past[4];
    past[4] = past[3];
    past[3] = past[2];
    past[2] = past[1];
    past[1] = past[0];
    past[0] = u0;
    past[17] = past[16];
    past[16] = past[15];
    past[15] = past[14];
    past[14] = past[13];
    past[13] = past[12];
    past[12] = past[11];
    past[11] = past[10];
    past[18] = u4;
    past[30] = past[29];
    past[29] = past[28];
    past[28] = past[27];
    past[27] = past[26];
    past[26] = past[25];
    past[25] = past[24];
    past[24] = past[23];
    past[23] = y[0];
    return flags;
}

/* BP_2+AR_2 -> RL_2, NARX 0:0,1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage50(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[50]; /* BP_2 [psi] */
    real y[1];
    real *const past = state->past + 729;
    unsigned int flags = 0u;

    y[0] = R(-28.8)
        + R(20.0) * (u0)
        + R(-20.0) * (past[0])
        + R(49.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 50);
    {
        real value; /* RL_2 [1] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[51] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BC_2+RL_2 -> CL_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage51(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[51]; /* RL_2 [1] */
    real y[1];
    real *const past = state->past + 731;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-100.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 51);
    {
        real value; /* CL_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[52] = value;
    }
    past[1] = y[0];
    return flags;
}

/* AR_2+BP_2 -> XP_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage52(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[50]; /* BP_2 [psi] */
    real y[1];
    real *const past = state->past + 733;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 52);
    {
        real value; /* XP_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[53] = value;
    }
    past[1] = y[0];
    return flags;
}

/* XP_2+XS_2 -> XM_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage53(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[53]; /* XP_2 [psi] */
    const real u1 = known[44]; /* XS_2 [psi] */
    real y[1];
    real *const past = state->past + 735;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(-1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 53);
    {
        real value; /* XM_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[54] = value;
    }
    past[0] = y[0];
    return flags;
}

/* AR_2+XP_2+XM_2 -> AL_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage54(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[53]; /* XP_2 [psi] */
    const real u2 = known[54]; /* XM_2 [psi] */
    real y[1];
    real *const past = state->past + 736;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(1.0) * (u2)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 54);
    {
        real value; /* AL_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[55] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP_2+RL_2 -> AR_2, NARX 0:1,2/2/12 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage55(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][6] = {
        {
        R(-0.00271773290912981), R(0.01506785938426677), R(0.0008532878029172287), R(0.0023120585222073924),
        R(-0.0031405099239590435), R(0.004626934483106758)
        }
    };
    /* by regressor, then by neuron */
    static const real W[6][12] = {
        {
        R(8.34640545057512), R(-15.954129548152054), R(-6.114081076852868), R(-5.14558675248737),
        R(21.152930895111478), R(-11.593771630401609), R(-2.0003873334456728), R(-19.57346800979389),
        R(-18.956392023768174), R(16.458046992811035), R(-5.574205362598633), R(-5.038950197905585)
        },
        {
        R(25.221677417643008), R(165.93519365426062), R(-13.516542152817243), R(20.98448538590308),
        R(5.8754232891339475), R(-30.710792198458176), R(-144.7328969474088), R(-28.601763860383382),
        R(-41.45541610715072), R(-60.84704756624357), R(-41.805375507890844), R(-31.77381848981686)
        },
        {
        R(-0.14027886361876662), R(-1.1955690641485317), R(0.017405542681030894), R(0.5256872130357118),
        R(-1.15510017808072), R(0.49234144733221274), R(1.6396068550415674), R(-3.2369678119139893),
        R(1.977776172751987), R(0.09867461846193404), R(-0.6193509083873059), R(-0.7824315559433457)
        },
        {
        R(1.0076639320347358), R(3.7145473804805764), R(1.9473356301218525), R(2.7049060821285593),
        R(-2.7155671112558504), R(-2.5049388279242666), R(2.13908224502968), R(3.07843764367697),
        R(-0.6857933407891634), R(-1.9722429103163708), R(1.6497672721889118), R(1.2637345857438187)
        },
        {
        R(-8.085117633603833), R(-7.407001710639169), R(5.551616993393823), R(3.533081181524729),
        R(-0.3447121014273957), R(11.29004978820336), R(2.2627316886075146), R(18.780287409887205),
        R(18.71705864894468), R(-0.15262948170791812), R(5.176892471005334), R(4.799557798662531)
        },
        {
        R(4.42629760586596), R(5.643961364305442), R(-1.5568256778581278), R(-2.922841425904206), R(5.539743997676477),
        R(-10.37779271625816), R(-1.4521535303526938), R(-9.746599066507398), R(-13.437326842521514),
        R(-0.2476480783916284), R(-4.566699351236169), R(-1.9003683243959906)
        }
    };
    static const real b[12] = {
        R(-0.656079678552046), R(-20.678740028723464), R(-0.5318613305046187), R(-4.2221524943337885),
        R(-20.74445369592612), R(0.4037643719423626), R(-3.606008363844771), R(5.306801747965366),
        R(2.0777621581948194), R(-17.59130109380382), R(1.6073139431393324), R(0.8250319424088418)
    };
    /* by output, then by neuron */
    static const real v[1][12] = {
        {
        R(-0.005865159094034745), R(0.0019770653283170715), R(-0.0016955614437525024), R(-0.0013964115971909067),
        R(-0.0023009513230823047), R(-0.002169548339955693), R(-0.0005445171279457461), R(0.0012492147505941212),
        R(-0.008841817394764135), R(0.005439614804185521), R(-0.00264487326480541), R(0.003553341150852321)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[6][12] = {
        {
        R(-0.010968955371340745), R(-0.004560878860263563), R(0.01314797915689174), R(0.0035168790451206716),
        R(0.004488789085192957), R(-0.0020634349171543276), R(0.0030697601487011308), R(-0.001807875425848704),
        R(-0.004774400754868644), R(-0.008180776288439717), R(-0.011014176475349878), R(-0.007250396259965236)
        },
        {
        R(0.07320452917908193), R(-0.030040494989371145), R(0.06035371681920998), R(0.11866943755739881),
        R(-0.37763525127836023), R(0.26533754043452884), R(-0.011849023694818219), R(-0.0681699117642686),
        R(-0.003740644754540401), R(0.31563464237937655), R(0.05175871080796341), R(-0.22559485249128886)
        },
        {
        R(0.016014651472624868), R(0.00113518096088277), R(-0.001618338796365742), R(-0.003221401703938436),
        R(-0.00263403636013098), R(0.002311366097413387), R(-0.00043731759669300707), R(0.0004684116291760838),
        R(0.01003806313342162), R(0.00453560554643997), R(0.005368438408595105), R(0.0026174978127988732)
        },
        {
        R(-0.0069461804216582575), R(-0.0013321619786679905), R(-0.0004441891810030777), R(-0.0013428819557232078),
        R(0.003465242788694332), R(0.006530559026751809), R(0.005118382824723042), R(0.002770638913225994),
        R(-0.009476781233532615), R(-0.0059594120940452), R(0.0006956460879673731), R(0.0008765822086392324)
        },
        {
        R(0.002770248411787749), R(0.0047320595270559495), R(-0.012939769548768246), R(-0.003524042916317132),
        R(0.0033353912222587358), R(-0.002462460688010159), R(-0.002004064957241225), R(0.0013187584774961483),
        R(0.004028237308851293), R(-0.005519885609478747), R(0.010420137020601997), R(0.0038624650731288223)
        },
        {
        R(-0.0035768333754723127), R(-0.005808431498628299), R(0.004500295808319149), R(-0.0013384157970984783),
        R(-0.004807721815552732), R(0.002891923395023389), R(-0.0026587001812079986), R(0.0025562897365891666),
        R(-0.00017818018591648962), R(-0.0004979765841200056), R(-0.0015781794878403262), R(0.0015120407473996169)
        }
    };
    real g[12];
    real a[12], sums[12];
    const real u0 = (known[50] - R(77.10074838861541)) / R(12.899251611384514); /* BP_2 [psi] */
    const real u1 = (known[51] - R(0.5)) / R(0.5); /* RL_2 [1] */
    real y[1];
    real *const past = state->past + 738;
    unsigned int flags = 0u;

    real x[6];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = past[1];
    x[3] = past[1] - past[2];
    x[4] = past[3];
    x[5] = past[3] - past[4];
    weigh(sums, b, W[0], 12, x, 6);
    activate(a, sums, 12);
    weigh(g, v[0], G[0], 12, x, 6);
    y[0] = R(0.001709171778741522) + dot(w[0], x, 6) + dot(g, a, 12);
    y[0] = ADDED(past[3], y[0], 55);
    {
        unsigned int held = 0u;
        real value; /* AR_2 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(12.899216372399025) + R(77.10078363184411);
        if (value > known[40]) { /* AR_2 may not be above AH_2 */
            value = known[40];
            y[0] = (value - R(77.10078363184411)) / R(12.899216372399025);
        }
        if (value >= known[40]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        if (value < known[55]) { /* AR_2 may not be below AL_2 */
            value = known[55];
            y[0] = (value - R(77.10078363184411)) / R(12.899216372399025);
        }
        if (value <= known[55]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        known[56] = value;
        flags |= held;
    }
    past[0] = u0;
    past[2] = past[1];
    past[1] = u1;
    past[4] = past[3];
    past[3] = y[0];
    return flags;
}

/* AR_2+BC_2+RL_2 -> CH_2, NARX 0:1,1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage56(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[56]; /* AR_2 [psi] */
    const real u2 = known[51]; /* RL_2 [1] */
    real y[1];
    real *const past = state->past + 743;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.0) * (u0)
        + R(-4.0) * (u0 - past[0])
        + R(1.0) * (past[1])
        + R(100.0) * (u2)
        + R(-1.0) * (past[2]);
    y[0] = ADDED(past[2], y[0], 56);
    {
        real value; /* CH_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[57] = value;
    }
    past[0] = u0;
    past[2] = y[0];
    return flags;
}

/* BP_2+AR_2+RL_2 -> BC_2, NARX 0:1/2/16 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage57(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][8] = {
        {
        R(0.00011284386923643419), R(0.0580244645979745), R(4.509944516806197e-05), R(-0.36541149992829836),
        R(-2.7828073800062123e-05), R(-0.013033452951956525), R(-0.0038994922849513785), R(0.0027575664277702866)
        }
    };
    /* by regressor, then by neuron */
    static const real W[8][16] = {
        {
        R(-0.9300785163041727), R(-0.3271620510184938), R(-1.3046198031244707), R(-0.4298887534933069),
        R(-1.404645994658539), R(0.2770802187938024), R(1.048707363357516), R(2.6595426944109235),
        R(-1.1437737460772048), R(-1.432798214314495), R(-0.8329098774124009), R(0.7457343566797814),
        R(3.818630272670619), R(1.3644851531567879), R(0.4684151229717006), R(-1.1926534725747553)
        },
        {
        R(-14.519442203028776), R(-18.911667680398605), R(32.67368170669587), R(-15.07025014145316),
        R(8.837946225515159), R(-8.473453303832367), R(6.998130773404667), R(16.25080240176106),
        R(-6.0192090341111095), R(-6.633448485388932), R(-2.9530208959732134), R(-11.91961809877748),
        R(9.942773601128607), R(-8.867206464726024), R(1.2108048925066943), R(-7.583832199334567)
        },
        {
        R(0.8893844385868306), R(0.7585417108820423), R(1.1213639118120113), R(0.6994526987453469),
        R(2.08900904269111), R(-0.16907502703239885), R(-1.4802399315923935), R(-2.5326114198599043),
        R(1.2435182864449352), R(1.549095137780256), R(0.7840291320712254), R(-0.7274112517558251),
        R(-3.9098815558620856), R(-1.623781114807965), R(-0.42449175033442543), R(1.2547411078389779)
        },
        {
        R(494.54539323952974), R(-65.11880806791211), R(331.9174054150965), R(-224.53487741663096),
        R(52.61747755567467), R(-36.86227869563963), R(-128.85185169502495), R(-837.0445832420352),
        R(18.317936979222157), R(-102.21573423804475), R(66.82295079028663), R(-189.87881904308375),
        R(-134.17641529852696), R(-17.035114653316086), R(-211.6893786697682), R(-15.81806685404718)
        },
        {
        R(3.391388006152828), R(0.6862312882538165), R(-1.8160580640205564), R(2.7365104462420686),
        R(2.675063820078349), R(-0.14774891222477304), R(-0.2841590426255207), R(-6.907764821877613),
        R(-0.3973490501885668), R(0.19359650901337483), R(0.8008302262239411), R(-0.45662499259262745),
        R(1.7972084649856814), R(-1.2258113944873736), R(-0.12539331693472366), R(0.29854227701428204)
        },
        {
        R(-0.3770686887843346), R(-0.2505289863461094), R(0.5787472152256139), R(-1.1926594468844387),
        R(3.937367501799171), R(-3.998913985966573), R(-2.403995493452305), R(-0.21971010587079515),
        R(-3.4675854779736883), R(-0.23829113863516616), R(1.7935036621702987), R(0.6569502249845693),
        R(-0.8877961362697969), R(1.2083773416662975), R(-0.7782448895231275), R(5.406237611116755)
        },
        {
        R(-0.3251660050944075), R(0.5826995083518729), R(1.1354908945194033), R(3.189492764239075),
        R(0.9016055391372315), R(63.67570150227314), R(-0.6061615562699263), R(1.0244306968310013),
        R(4.471559413764789), R(0.4485844849510062), R(0.5720308291280922), R(-1.0192667843311616),
        R(1.4081476434504223), R(-1.3354584505719667), R(-1.0107240771179482), R(-5.474091719757713)
        },
        {
        R(0.7830993533100403), R(-1.1293036670749246), R(-0.5740574551930394), R(-1.0342706134978927),
        R(-1.3988232710771518), R(-21.120999342627304), R(0.021112457069761528), R(-0.8626483312333458),
        R(-1.1246666410033148), R(-0.6100928847615044), R(-0.2677683449675954), R(0.9874244264038347),
        R(-0.6251293762370854), R(1.1381176988727784), R(0.43502509555553415), R(1.5311168417442411)
        }
    };
    static const real b[16] = {
        R(-2.5240221489373313), R(-0.08838481061405079), R(-1.699902291761241), R(-0.16185750384825748),
        R(-2.249945724409356), R(42.65850095712125), R(0.6745193629100965), R(4.492643816247892), R(3.536527853303048),
        R(0.19981701446576972), R(-0.29747317539496254), R(-0.8972631549650759), R(-0.6963798678028965),
        R(0.08899366181069679), R(-0.8700495649622811), R(-5.567095488982099)
    };
    /* by output, then by neuron */
    static const real v[1][16] = {
        {
        R(-0.0022532160260406897), R(-0.002513891443589676), R(-0.00042292476398599364), R(-0.00011182889109715051),
        R(-0.0011112002056070755), R(-0.0002504606672079915), R(-0.0013579686159580792), R(-0.0016094363395667527),
        R(-0.0012322487536093438), R(-0.0016341851060708977), R(-0.0007944833758684735), R(0.001785373720263098),
        R(0.003265269327371927), R(0.0010115986053362575), R(-0.00038233894509360036), R(-0.005272007949617203)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[8][16] = {
        {
        R(0.004800719921600104), R(0.001181923150664844), R(0.0033134106499154645), R(0.0012790400596390389),
        R(-0.0005053146288326212), R(0.0013238903925843742), R(0.001249164755017615), R(0.00325750540583139),
        R(-0.0023964667578125175), R(-0.00045341150636233653), R(-0.003939116489840272), R(0.0035366053641771172),
        R(-0.0010079363193424354), R(-0.0002460354390115306), R(0.00019733380314687632), R(0.004233376959763795)
        },
        {
        R(-0.05891618149874232), R(0.0028573446854166335), R(0.048253479608668624), R(0.022801922553853025),
        R(0.00183798170445276), R(0.0040368359467900594), R(-0.11238316028090245), R(-0.08848015956538008),
        R(-0.021191306598199445), R(-0.013597468497378282), R(-0.14979182144994807), R(-0.04067294437801188),
        R(-0.04362083838981965), R(0.024732116836781746), R(-0.043048889173539974), R(0.0011540073232729397)
        },
        {
        R(-0.003700934893540335), R(-0.0006290146505656125), R(-0.0034341303580005533), R(-0.0010154532399266891),
        R(8.036863918797765e-05), R(-0.0013428331335214594), R(3.583516840580114e-05), R(-0.0025054903244726145),
        R(0.0025153782348458775), R(0.001303002616191852), R(0.004408146506738132), R(-0.0028246323320766376),
        R(0.0010110057641128378), R(0.0002741860034483762), R(-0.0008560851632708477), R(-0.004054766032258433)
        },
        {
        R(0.05244891011429006), R(0.14739100966928895), R(-0.2621567655873918), R(-0.113743792523428),
        R(0.34921552911748216), R(-0.506157248613991), R(-0.1826209428474554), R(-0.1867097265452748),
        R(0.28771361008067436), R(-0.062491030259131546), R(0.04635463326742985), R(-1.0984299921518446),
        R(0.275016294818991), R(0.0917190957683801), R(0.720049464211865), R(-0.18322750834670914)
        },
        {
        R(-0.0007217628291907225), R(-0.0005304495471503395), R(0.00036006691754638005), R(0.0007399993255441046),
        R(-0.00034343688601700794), R(-0.00033681303799439234), R(-9.163509345399331e-05), R(-0.0002152239324374667),
        R(0.0002788423589220601), R(-0.0006267381058405325), R(0.0001697019924236402), R(0.0010610051121750577),
        R(-0.000681665267662895), R(0.0009904149379648649), R(0.0019644721980949017), R(-0.0010757386138829125)
        },
        {
        R(0.0010844533266444417), R(-0.007178062299921855), R(0.003414266466906016), R(0.0018853726376708477),
        R(0.0024110649263108814), R(0.0003973473681710184), R(-0.0023940752924619846), R(-0.0016644616849869585),
        R(-0.005163129397893497), R(0.03548446537974949), R(-0.004203565223980827), R(-0.010062481255119736),
        R(-0.015194617038250533), R(0.007250633520537535), R(-0.012109348992323589), R(0.00046247702137034173)
        },
        {
        R(-0.0017478640294404848), R(-0.0002403355338613227), R(-0.00039033410926457275), R(-0.00014266542696045618),
        R(-0.002281515024988084), R(0.00011071764656566405), R(-0.0005596874449279371), R(9.051353636934588e-05),
        R(-0.0018332209393974196), R(-0.0013385378917088956), R(-0.0010972599266390313), R(-0.0003610313012702048),
        R(0.003936890398724227), R(-0.0010541690696079609), R(-0.0015308192007060907), R(-0.0053863687492209725)
        },
        {
        R(0.0009702745420111833), R(-0.0010637958119754422), R(-0.000429463940151333), R(-0.00014700363755787616),
        R(0.0007375240648763931), R(0.0004986770404743903), R(0.0008324609057882738), R(0.00014905027127736306),
        R(0.0005312206023040855), R(0.0011604851490241333), R(0.0005804186225870714), R(0.00015992292069824508),
        R(-0.002846614048156361), R(0.0005530687866202997), R(0.0011800641786080756), R(0.0025899729639048234)
        }
    };
    real g[16];
    real a[16], sums[16];
    const real u0 = (known[50] - R(77.10074838861541)) / R(12.899251611384514); /* BP_2 [psi] */
    const real u1 = (known[56] - R(77.10078363184411)) / R(12.899216372399025); /* AR_2 [psi] */
    const real u2 = (known[51] - R(0.5)) / R(0.5); /* RL_2 [1] */
    real y[1];
    real *const past = state->past + 746;
    unsigned int flags = 0u;

    real x[8];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = u1;
    x[3] = u1 - past[1];
    x[4] = u2;
    x[5] = u2 - past[2];
    x[6] = past[3];
    x[7] = past[3] - past[4];
    weigh(sums, b, W[0], 16, x, 8);
    activate(a, sums, 16);
    weigh(g, v[0], G[0], 16, x, 8);
    y[0] = R(-0.0028801933028151216) + dot(w[0], x, 8) + dot(g, a, 16);
    y[0] = ADDED(past[3], y[0], 57);
    {
        unsigned int held = 0u;
        real value; /* BC_2 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(31.131394488296472) + R(31.131394488296472);
        if (value > known[57]) { /* BC_2 may not be above CH_2 */
            value = known[57];
            y[0] = (value - R(31.131394488296472)) / R(31.131394488296472);
        }
        if (value >= known[57]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        if (value < known[52]) { /* BC_2 may not be below CL_2 */
            value = known[52];
            y[0] = (value - R(31.131394488296472)) / R(31.131394488296472);
        }
        if (value <= known[52]) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_LIMIT;
        }
        known[58] = value;
        flags |= held;
    }
    past[0] = u0;
    past[1] = u1;
    past[2] = u2;
    past[4] = past[3];
    past[3] = y[0];
    return flags;
}

/* BP_2+AR_2 -> RX_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage58(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[50]; /* BP_2 [psi] */
    const real u1 = known[56]; /* AR_2 [psi] */
    real y[1];
    real *const past = state->past + 751;
    unsigned int flags = 0u;

    y[0] = R(-28.3)
        + R(20.0) * (u0)
        + R(-20.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 58);
    {
        real value; /* RX_2 [1] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[59] = value;
    }
    past[0] = y[0];
    return flags;
}

/* ER_2+BP_2+RX_2 -> FR_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage59(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[50]; /* BP_2 [psi] */
    const real u2 = known[59]; /* RX_2 [1] */
    real y[1];
    real *const past = state->past + 752;
    unsigned int flags = 0u;

    y[0] = R(-100.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(100.0) * (u2)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 59);
    {
        real value; /* FR_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[60] = value;
    }
    past[1] = y[0];
    return flags;
}

/* ER_2+FR_2 -> EL_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage60(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[60]; /* FR_2 [psi] */
    real y[1];
    real *const past = state->past + 754;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 60);
    {
        real value; /* EL_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[61] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP_2+AR_2+RL_2 -> ER_2, NARX 0:1/1/10 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage61(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][7] = {
        {
        R(0.005428030149952967), R(-0.06525512449555168), R(0.0003584470637766346), R(-0.10571784523663931),
        R(-0.00152885209070355), R(0.005005722904014654), R(-0.003246406203501251)
        }
    };
    /* by regressor, then by neuron */
    static const real W[7][10] = {
        {
        R(2.721262418618859), R(14.699846579738349), R(-12.17505398221494), R(11.300733673067285),
        R(-15.916054307085119), R(-37.55038917374578), R(-17.443152487230957), R(-5.372052870794214),
        R(-7.10297993386652), R(-2.4889440951812687)
        },
        {
        R(4.856069029315252), R(18.22771146069222), R(-18.482356262758305), R(8.311995728511015), R(56.2202441380108),
        R(-3.717472860474077), R(6.3517713893244885), R(4.335664626475214), R(-0.300941880895796),
        R(3.399045941585749)
        },
        {
        R(0.5600290343933239), R(-3.8325847082180644), R(12.156178664540448), R(0.28954699164455633),
        R(16.415729414884936), R(0.25428218962088067), R(18.466696062843084), R(0.8684263373428394),
        R(0.021511768379923524), R(0.8243501348191842)
        },
        {
        R(-711.9025207572523), R(-920.0393502109465), R(692.3787299996427), R(-1130.9148187145165),
        R(841.1576172281237), R(306.9826923287297), R(1203.1855336142805), R(426.6818874974253), R(908.203649092152),
        R(-68.1602427523182)
        },
        {
        R(-0.9603480956338576), R(-0.09937442167554433), R(-1.2970269799724163), R(-7.941079628188532),
        R(0.74000934430308), R(9.381399907233142), R(-1.4768809959283056), R(2.2725154172303794),
        R(3.1505102429164715), R(-1.117328276333085)
        },
        {
        R(-0.19958832417709205), R(-4.515451790315892), R(-1.369355661929617), R(9.200509892379245),
        R(1.1380067183698674), R(-8.177951018200691), R(-4.4302150353381515), R(-6.673518491143079),
        R(-9.57189927835406), R(0.7369977082767195)
        },
        {
        R(-1.6220179440241327), R(-6.14530056925237), R(0.4115864070022231), R(-5.89084436838351),
        R(-0.8434387881854353), R(20.00507324728271), R(-0.049053218330186), R(2.3195197747521528),
        R(3.4890927673675867), R(1.0922171418269881)
        }
    };
    static const real b[10] = {
        R(-0.12310437287921905), R(-4.463403898032774), R(0.7204604272788939), R(4.826132883205586),
        R(-0.45504329460443893), R(5.47167300826509), R(-0.5770244432639675), R(-2.469451269167502),
        R(-1.6820578419826602), R(0.584049291537668)
    };
    /* by output, then by neuron */
    static const real v[1][10] = {
        {
        R(0.0006913837915658868), R(0.0007421878410352077), R(0.001991114301409353), R(-0.0023980689932952643),
        R(-0.00022202994079281415), R(-0.0014748614944460477), R(-0.0007098474441563417), R(0.0006568150001878486),
        R(-0.0006235525241294671), R(0.000784287825407809)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[7][10] = {
        {
        R(-0.0029669169759566558), R(0.002462939369535483), R(-0.003895097171098436), R(-0.006130630875268349),
        R(0.0005499472021449694), R(0.0010524332738321672), R(-0.007468163256486162), R(-0.0022378813532025494),
        R(0.010246217746711209), R(0.0010467263386443049)
        },
        {
        R(0.020647533151863847), R(-0.027678033952019704), R(-0.013421319857907196), R(0.057100652583410995),
        R(-0.008219259609310034), R(-0.027492088324269547), R(-0.02538162425528716), R(-0.013113642406929122),
        R(0.05770584524592268), R(-0.012534649090450415)
        },
        {
        R(-0.0024235733142661253), R(-0.00040720207300593003), R(0.004909355382817837), R(-0.001539569964408627),
        R(0.00039776153459381014), R(-0.0008456157525906297), R(0.000664895514406294), R(0.00030337037766092756),
        R(-0.008451228485879717), R(-0.00661614873392441)
        },
        {
        R(1.5573971186147542), R(-0.8989300882320362), R(-0.37703368042158936), R(0.4346820771403905),
        R(-0.26587779794854877), R(0.03294807379072043), R(0.10282292096491456), R(0.3424574121272217),
        R(-0.0694481821750216), R(0.45622658988367376)
        },
        {
        R(0.00014136390099063392), R(0.00028868480309390473), R(-0.0009678762729768611), R(0.002870167839893404),
        R(-6.583861945768862e-05), R(-0.0014588933063028036), R(0.0017762306218620848), R(0.0011921162608056974),
        R(-0.000472412652148316), R(0.0027818250039727994)
        },
        {
        R(-0.0008750284287896813), R(0.004867130740136629), R(-0.012327884249678503), R(-0.003751926752328157),
        R(-0.0015611494664844832), R(0.0017467883723143755), R(-0.0026283283766624847), R(0.0058480920560328884),
        R(0.0030913872564428684), R(9.539210583115464e-05)
        },
        {
        R(0.003281147842787221), R(-0.001110368290604814), R(-0.0006830351030038857), R(0.005047797419761176),
        R(-0.0005004136418149202), R(-0.0005827212914738854), R(0.004405145617176502), R(-1.8767293989647112e-05),
        R(0.0006798249168906839), R(0.0030539289962741288)
        }
    };
    real g[10];
    real a[10], sums[10];
    const real u0 = (known[50] - R(77.10074838861541)) / R(12.899251611384514); /* BP_2 [psi] */
    const real u1 = (known[56] - R(77.10078363184411)) / R(12.899216372399025); /* AR_2 [psi] */
    const real u2 = (known[51] - R(0.5)) / R(0.5); /* RL_2 [1] */
    real y[1];
    real *const past = state->past + 756;
    unsigned int flags = 0u;

    real x[7];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = u1;
    x[3] = u1 - past[1];
    x[4] = u2;
    x[5] = u2 - past[2];
    x[6] = past[3];
    weigh(sums, b, W[0], 10, x, 7);
    activate(a, sums, 10);
    weigh(g, v[0], G[0], 10, x, 7);
    y[0] = R(-0.0005350564684823977) + dot(w[0], x, 7) + dot(g, a, 10);
    y[0] = ADDED(past[3], y[0], 61);
    {
        unsigned int held = 0u;
        real value; /* ER_2 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(7.087527821111905) + R(82.91247217899802);
        if (value > known[42]) { /* ER_2 may not be above EH_2 */
            value = known[42];
            y[0] = (value - R(82.91247217899802)) / R(7.087527821111905);
        }
        if (value >= known[42]) {
            held = 0u;
        }
        if (value < known[61]) { /* ER_2 may not be below EL_2 */
            value = known[61];
            y[0] = (value - R(82.91247217899802)) / R(7.087527821111905);
        }
        if (value <= known[61]) {
            held = 0u;
        }
        known[62] = value;
        flags |= held;
    }
    past[0] = u0;
    past[1] = u1;
    past[2] = u2;
    past[3] = y[0];
    return flags;
}

/* BP_2+EQ_2 -> QX_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage62(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[50]; /* BP_2 [psi] */
    const real u1 = known[46]; /* EQ_2 [psi] */
    real y[1];
    real *const past = state->past + 760;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(-1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 62);
    {
        real value; /* QX_2 [psi] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[63] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP_2+EQ_2 -> QF_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage63(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[50]; /* BP_2 [psi] */
    const real u1 = known[46]; /* EQ_2 [psi] */
    real y[1];
    real *const past = state->past + 761;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(-1.0) * (u0)
        + R(1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 63);
    {
        real value; /* QF_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[64] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP10_2+BP_2 -> BV_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage64(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[50]; /* BP_2 [psi] */
    real y[1];
    real *const past = state->past + 762;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(-1.0) * (past[0])
        + R(1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 64);
    {
        real value; /* BV_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[65] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP10_2+BV_2+RL_2+RL10_2 -> BW_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage65(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[65]; /* BV_2 [psi] */
    const real u2 = known[51]; /* RL_2 [1] */
    real y[1];
    real *const past = state->past + 764;
    unsigned int flags = 0u;

    y[0] = R(0.05)
        + R(1.0) * (past[0])
        + R(1.0) * (u1)
        + R(100.0) * (past[1])
        + R(100.0) * (past[2])
        + R(-1.0) * (past[3]);
    y[0] = ADDED(past[3], y[0], 65);
    {
        real value; /* BW_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[66] = value;
    }
    past[1] = u2;
    past[3] = y[0];
    return flags;
}

/* BP_2+AR10_2+ER10_2+LA_2+LB_2+LC_2+RL_2+RL10_2 -> BP10_2, NARX 0..512(11),1/1..32(6)/14 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage66(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][24] = {
        {
        R(0.0005921124797486979), R(0.01937367214654276), R(0.07730456015782013), R(0.04101452941224489),
        R(0.032644094059679316), R(0.010587741605166436), R(0.0087037466760058), R(0.0008373993588117075),
        R(-0.0002953735060344344), R(5.614614439274638e-05), R(-9.555053504527731e-05), R(0.0006616110322238154),
        R(0.00012113012774973955), R(4.937648924541283e-05), R(0.00010665551912563499), R(-3.915461005844787e-05),
        R(3.4315384026960445e-07), R(-5.452066593800354e-06), R(-0.0024490441192227437), R(0.00728749341047218),
        R(0.007982926811494807), R(0.004534855900845643), R(0.0014777805042793459), R(0.00025082642900607947)
        }
    };
    /* by regressor, then by neuron */
    static const real W[24][14] = {
        {
        R(-0.5452110079409067), R(-2.347105896469004), R(-0.6360073816961922), R(3.3191488063100802),
        R(-0.6291725413742881), R(1.1510773838207495), R(-1.185837469114352), R(0.4063633704394629),
        R(-0.5118457681698336), R(-0.12385712956154227), R(0.261646352739503), R(-0.3394029792114548),
        R(2.7427531504777463), R(1.901289964168928)
        },
        {
        R(-27.43708811944196), R(7.954996044394598), R(-28.475867341080725), R(-1.253761850760931),
        R(-31.787485079317058), R(0.7904138550318751), R(0.9737487609133502), R(-14.564001153123002),
        R(0.5054037822662973), R(0.840895310806935), R(1.5727290778195684), R(-12.288761487295554),
        R(-39.23654829647006), R(18.946089165365862)
        },
        {
        R(-4.533932283190552), R(7.033649320203975), R(6.772011564113871), R(-7.6124759102517245),
        R(11.215241050873454), R(2.514347810915738), R(-0.6982081377689111), R(6.518537275642739),
        R(12.261204917678521), R(-0.5230587344438264), R(-3.7998721899234003), R(-0.7655182593372274),
        R(4.096907577015918), R(-0.031048131138724955)
        },
        {
        R(16.212616462246483), R(12.25488334568768), R(-8.053874297916968), R(6.952750269074656),
        R(-15.227758549633235), R(0.08797942210818155), R(4.240948702856321), R(-14.294722398257694),
        R(9.081507084321277), R(7.5533810682307), R(8.684067448376693), R(4.529429295183878), R(-9.518576698700972),
        R(-17.769572652050826)
        },
        {
        R(1.8408554403745987), R(-11.737360857735432), R(3.3574346624532474), R(2.810491910219918),
        R(-2.587695956290334), R(-0.8008072309018521), R(10.48480867542933), R(-4.915637555753244),
        R(3.635445556969402), R(3.9661558121190668), R(4.025924768533001), R(4.653017262089146), R(-9.635114671253623),
        R(10.192705802274045)
        },
        {
        R(1.6019152034136097), R(2.6700566632371485), R(-4.420240668697167), R(-9.338765569137488),
        R(-7.800440401890565), R(-0.05666120749405451), R(-0.7112700152906638), R(0.08827985796379068),
        R(3.951708452328755), R(1.4963592385048976), R(0.8893984440088334), R(-1.1854178297993407),
        R(-2.317448034156529), R(0.48118663424694896)
        },
        {
        R(-1.6706038829373744), R(1.749173200656667), R(-2.1117984981296374), R(0.8080255807694847),
        R(-0.41903300505511043), R(0.3023956563079078), R(-0.20045183153092727), R(-4.356986904107131),
        R(0.591367868975256), R(0.14503268824650767), R(-1.7009183963633105), R(-1.9938896793460914),
        R(9.8826175076588), R(1.1486934124362411)
        },
        {
        R(0.096764923925412), R(0.6119930020305255), R(-0.906850272919915), R(-0.38102376883293787),
        R(-1.119950836831995), R(0.3027081559395909), R(0.6077407676353703), R(-1.1698501997421926),
        R(0.6461308297659512), R(0.6356265044623441), R(-0.41947502002102127), R(-0.4571826207816115),
        R(0.257279036847466), R(0.39046071426246615)
        },
        {
        R(0.19743708590929376), R(0.29160499106336063), R(-0.6090359008391243), R(-0.10983503763912891),
        R(-0.5580863675316847), R(-0.026036458081989233), R(-0.038782013281733335), R(-0.9734441298692673),
        R(0.3872993130903528), R(0.025482330863743255), R(0.0854281786146693), R(0.024714423684498818),
        R(-0.34624227320944856), R(0.08900652745119718)
        },
        {
        R(0.16700297549352944), R(0.20757355419208295), R(-0.0444156847271229), R(-0.01670517821074776),
        R(-0.04939137008523192), R(0.03652501765816994), R(-0.045555820775555075), R(-0.014565961496617305),
        R(0.06894868003708715), R(0.011124995811783167), R(0.10132720802804045), R(0.06147811812384203),
        R(-0.17492344997999248), R(0.04432332558915246)
        },
        {
        R(0.06475167753250718), R(0.07477885624953523), R(-0.018309394242821395), R(-0.0331612699561757),
        R(0.044321704567393), R(0.03621033323271317), R(-0.0675391487865288), R(-0.08494675594643016),
        R(0.020437081683426214), R(-0.007065045443025519), R(0.08028883937472205), R(0.034091508717451764),
        R(-0.010837873083887622), R(-0.07206055764454992)
        },
        {
        R(-0.8107361472266084), R(-1.5217807992858328), R(-1.0253693913125095), R(2.9512327528595192),
        R(0.021769854483999693), R(-0.8726902881199781), R(1.3699813289628682), R(1.060288216567106),
        R(1.1741677621961957), R(-0.4743352163801429), R(1.1627811779279176), R(0.9760934512448174),
        R(3.1289536622546534), R(-0.20857212438927072)
        },
        {
        R(0.8059620460714825), R(1.2354308497940278), R(0.47329367218879254), R(-2.02045675976575),
        R(1.1369480788125956), R(0.013931523035019776), R(-0.22575073216344554), R(0.834064963973187),
        R(0.045168966821068496), R(-0.04896654645681689), R(1.3122270529858058), R(1.0181925971694339),
        R(0.2130903387943232), R(-1.4626387872114184)
        },
        {
        R(0.048525757345751236), R(0.07997828268047279), R(0.04509804852984883), R(-0.09737182352798597),
        R(0.0034305198718581876), R(-0.00274371137270978), R(-0.06924357690601467), R(0.0345432682614062),
        R(-0.060431943337062366), R(-0.03494883953495778), R(0.0345299532282996), R(0.013834004612405583),
        R(0.008164759470756837), R(-0.04137029001477552)
        },
        {
        R(-0.014817346544957581), R(-0.0627175363263643), R(-0.017238867403389282), R(0.05716735341929477),
        R(-0.0105948531454631), R(0.022018877987598655), R(0.007978463654313256), R(-0.06691747580333884),
        R(0.02861292152089419), R(0.020126976839724024), R(-0.059278144622803584), R(-0.052737545230361824),
        R(-0.008263552445887438), R(0.05855436679640495)
        },
        {
        R(0.010573772594500095), R(0.03417064883366932), R(0.005633242968210269), R(-0.03728489784535613),
        R(0.01211878937864783), R(-0.011076393101830506), R(-0.02381964274183842), R(0.005391449613069501),
        R(-0.009108675068752065), R(-0.019417310860529), R(0.015193041386317982), R(0.014538999991991215),
        R(-0.0022463044391928875), R(-0.026794966589202496)
        },
        {
        R(0.0217623510408394), R(-0.021449978324966645), R(-0.033383671340925236), R(0.02867571798046109),
        R(-0.015648006867620023), R(-0.004065731858322624), R(-0.0202646072673451), R(0.04395650044642557),
        R(0.02365167441332819), R(0.014762834182761406), R(0.004446553131892905), R(0.0022898621490616833),
        R(-0.09271723974764257), R(0.02203778443088633)
        },
        {
        R(0.00871962967493034), R(0.027247388953258733), R(-0.0025519616010422075), R(-0.006369816025229014),
        R(-0.02117799117943875), R(0.0004679655784342318), R(-0.005928576678173353), R(-0.006714076201743746),
        R(0.010756221339339858), R(-0.006036961829302037), R(-0.015622979565123596), R(0.0007986895321832055),
        R(0.003267275624409538), R(0.01785613917308171)
        },
        {
        R(-0.3042654874303887), R(1.2373429299441794), R(0.37962319212141316), R(-1.8058063451546769),
        R(-1.3288821734034262), R(-0.3962185362384303), R(1.230342350282826), R(-2.2012432173192322),
        R(-0.10965725796576131), R(1.2332987623618776), R(-3.422245176311444), R(-1.9233604215850546),
        R(-6.191551429992774), R(0.9486025367781282)
        },
        {
        R(-1.4591297752398507), R(-3.3124333199202636), R(-1.3188699031568318), R(4.213056712091152),
        R(1.702461435942853), R(2.609737606273615), R(-0.2958185814430445), R(-0.8513197060801256),
        R(1.201435200249303), R(1.1963797323994299), R(-1.8787818767463405), R(6.655033920240656),
        R(-5.938061993467089), R(-0.9517670682020738)
        },
        {
        R(-1.9382540226228337), R(-3.031612569552265), R(-2.1342034094812004), R(12.253541307663756),
        R(1.6635131983435087), R(3.173227491398688), R(1.1193530068475903), R(-2.87410602484504),
        R(1.4401004146485437), R(2.114681218564848), R(-2.482583008318983), R(7.68569108042274),
        R(-15.007387301908722), R(-0.6213349916216391)
        },
        {
        R(-1.1093980707581066), R(-2.4721404841076997), R(-2.0829649671570474), R(11.48717766255927),
        R(-0.09338216071013938), R(1.4084108589442135), R(2.6411453820918704), R(-2.9767721967200567),
        R(1.0426993759948235), R(0.9337922747542547), R(0.2686385117929331), R(4.315904704487727),
        R(-19.63978228226319), R(-1.5984473609215344)
        },
        {
        R(0.910779429436111), R(-3.350780689272627), R(-1.3360797753645834), R(-2.215778440565181),
        R(-0.8733878528498775), R(0.12836501606374318), R(2.4675215965946884), R(-1.2250375153193258),
        R(1.6127245059862914), R(0.6592297937386828), R(2.316545529832177), R(1.025537285541163),
        R(-18.686659998138325), R(-1.9026410534314062)
        },
        {
        R(1.177718021830727), R(-1.5528163903792656), R(0.15807035595426838), R(-1.090962201415168),
        R(-1.0363617237015148), R(-0.25171578998777416), R(1.4772498805648524), R(0.12865069590836428),
        R(1.4970917388449512), R(0.5342212011494222), R(0.8980148824030398), R(0.4209389987805502),
        R(-10.881331781991788), R(-1.3324197713792325)
        }
    };
    static const real b[14] = {
        R(-2.380421421275865), R(-2.6319769805626683), R(-1.4348103896234787), R(3.2988289513548983),
        R(1.2720107075589429), R(-1.138027674159469), R(7.269480512345987), R(3.277747339846389),
        R(2.4344694728047767), R(2.5417730439872086), R(2.083488955966211), R(3.1246806522211665),
        R(1.6296264888340457), R(-0.9998609805932833)
    };
    /* by output, then by neuron */
    static const real v[1][14] = {
        {
        R(0.01818446163642887), R(0.03960091041502077), R(-0.011285227133263829), R(0.0343823579361323),
        R(0.015223094006871093), R(0.030539162793344832), R(0.003769661202783706), R(-0.00042983366034568993),
        R(-0.0021558892721767636), R(0.0009469066905173131), R(0.0023081971576350345), R(0.019666374444026146),
        R(-0.007748371998795397), R(0.012565428141903378)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[24][14] = {
        {
        R(0.00322758108308617), R(-0.0007539807551649928), R(0.002320746062512539), R(-0.002054001015839576),
        R(-0.0023693023282046663), R(-0.0029030318223066467), R(-0.0024346865524878317), R(-0.001250047892677032),
        R(0.0021755801868150832), R(-0.0038905743781519377), R(-0.003168579938658763), R(8.625301136505614e-05),
        R(-0.0007700712920584996), R(-0.0006654241017952593)
        },
        {
        R(-0.03444520210140528), R(-9.378802094176311e-05), R(0.02136648658226374), R(-0.028902913841150193),
        R(-0.0011783316717964044), R(-0.009317809667652718), R(-0.01998097482952114), R(-0.008784795771826033),
        R(-0.007391955811110448), R(0.03376137306291377), R(0.021701546329092793), R(0.017027933274281124),
        R(0.03360617554167941), R(0.012358891772235262)
        },
        {
        R(0.005037369069125053), R(0.013406098483619393), R(0.0016872624516192595), R(-0.045410338744595595),
        R(-0.02151289790513189), R(0.004329463114395346), R(0.007123213820045285), R(-0.02304690534717875),
        R(-0.02787473153568902), R(0.01805429225484711), R(0.014183144548185422), R(0.01886211550451227),
        R(0.006144657044953589), R(0.040843872484830776)
        },
        {
        R(0.0767416388364052), R(0.008629651578539406), R(0.012982353620439657), R(0.03045336837413646),
        R(-0.04837759594486744), R(0.01980341344736829), R(-0.02538673480570374), R(-0.008166542407113588),
        R(-0.04650994076565131), R(-0.010045937403692355), R(-0.05916780911439819), R(0.06033298715328538),
        R(-0.012327481666682362), R(0.06822057932183499)
        },
        {
        R(-0.0011025961163670436), R(-0.0016270059914186995), R(-0.011280191303439005), R(-0.0026760851694494154),
        R(0.0019950497792849253), R(0.002235205955856014), R(-0.0032454029709918317), R(-0.0018318504185778485),
        R(0.011532237205666833), R(-0.001495338677798652), R(-0.011139156272529465), R(-0.001209390542900696),
        R(0.000750919558910098), R(-0.0014866739362976262)
        },
        {
        R(-0.006727745400928175), R(-0.0015122597123003224), R(0.006561855729286103), R(-0.0058723375243894165),
        R(-0.0008207078612641167), R(0.008593104149783872), R(-0.0012994259074153372), R(0.0022458492678247926),
        R(3.6027973390534516e-05), R(0.006307873115548947), R(0.0008405568407729397), R(-0.0032581169147290383),
        R(-0.001624635180126077), R(3.2801550109996455e-05)
        },
        {
        R(-0.003028968351389767), R(-0.0006606001637225496), R(-0.0006001438477410724), R(0.00010839523847765153),
        R(0.0006384649704629085), R(0.00330310854559139), R(-0.0040046791210821935), R(0.002201666731267939),
        R(0.0015784140800028782), R(0.00014905462305471278), R(0.0022151743963176535), R(-0.0017635903565186857),
        R(2.0461614187615635e-05), R(-0.0006595645302808302)
        },
        {
        R(-0.0004035995746338955), R(-0.0013458567684987907), R(-0.0010572312639561083), R(-0.002630154975611827),
        R(0.0009598773699065744), R(0.0014428776284900846), R(-0.0011772479970944161), R(-0.00013599547787216358),
        R(-0.0006109881890773052), R(-0.0009264398188527212), R(-0.0020387244979144237), R(0.0006134801550258218),
        R(-0.0006379306902150962), R(0.0013256164094040995)
        },
        {
        R(0.00116961099944269), R(-0.0015958732921333718), R(-0.0014511524964904176), R(-0.0018253952579269763),
        R(-0.00015901741717694212), R(-0.0008781922258190548), R(0.000545603621761916), R(0.0007203557539253724),
        R(-0.000607264955785037), R(-0.0004994458217649786), R(-0.0004224431671230376), R(-0.0007473901592270659),
        R(-0.00014264195083662308), R(0.00016409359177608043)
        },
        {
        R(-0.000652471864610442), R(0.00010816269033613637), R(-0.00012236599012491658), R(-0.0007801114437659894),
        R(-9.820871049806471e-05), R(-6.14525714067865e-05), R(-9.757546714597867e-05), R(-0.00023707946361348488),
        R(-0.0005217402223547945), R(-2.3939320848382668e-05), R(-0.0004754299073127587), R(0.000452581946899419),
        R(-6.680509429901172e-05), R(0.0004935977274815031)
        },
        {
        R(-0.00024308487116470387), R(0.00040685020654721027), R(2.5311004338858893e-06), R(-0.00011341495981705069),
        R(-0.00020509310989340636), R(-0.000334582015224773), R(4.752716315687836e-05), R(1.2643204618402616e-05),
        R(3.6098911700791805e-05), R(-0.00024224379617629452), R(-0.00012729645012019323), R(0.00014443403957808132),
        R(-3.969114000350849e-05), R(0.00039455957077838)
        },
        {
        R(9.306578091944558e-05), R(0.007933569046056034), R(-0.004052716680791763), R(0.0043157242878622305),
        R(0.004440760371730863), R(0.0030420940221568753), R(0.003869581583689579), R(0.0019934650223053896),
        R(-0.003994972996077429), R(0.0071728238232111755), R(0.004625411042687539), R(0.002175622843268528),
        R(-0.0023609678751374094), R(0.0026365969882516634)
        },
        {
        R(0.004915869580180746), R(2.0583800661155122e-05), R(0.0030361969503827327), R(0.0017580881103203812),
        R(-0.0017001596005965195), R(0.002583908977365515), R(0.0006563027739846913), R(-0.0016440486687126883),
        R(0.0016610432991744702), R(-0.0037999771053160427), R(-5.900649459696429e-05), R(-0.0007056808331089376),
        R(-0.0030393210021406212), R(-0.0015262867938701952)
        },
        {
        R(-0.00021683048682884508), R(-0.00023228278664341756), R(7.47046313474977e-05), R(-0.00029165592317735844),
        R(-1.971962334124397e-05), R(-0.00010427210836817608), R(-0.0001021183320319727), R(-3.863242983168449e-05),
        R(-8.061996296938173e-05), R(0.00017178400838647583), R(3.184063241336228e-05), R(-7.552131863423679e-05),
        R(7.66764750874298e-05), R(-1.03416517365191e-05)
        },
        {
        R(-4.974203827919538e-05), R(-0.00027012046387394424), R(8.404417252437163e-05), R(-0.00013595762013026802),
        R(-0.00014532353838245), R(-8.289917471366607e-05), R(-1.577762401456524e-05), R(2.6726731281869733e-05),
        R(0.0001440854991858093), R(-0.0001543389756024039), R(-0.00012588777805026488), R(-4.9496915214221495e-05),
        R(3.2559594416947695e-05), R(-0.00016594426063240876)
        },
        {
        R(5.931614555451901e-05), R(-9.032945333103793e-06), R(-2.4299354394117723e-05), R(1.2081044510419454e-05),
        R(-2.2214900280418216e-05), R(-0.00012470029016101153), R(5.896323135484778e-05), R(1.6147922180755677e-06),
        R(-6.802415416759602e-05), R(1.1135810683591049e-05), R(2.4969323625349217e-05), R(-4.413348431835427e-05),
        R(-3.826944826907608e-05), R(-2.560319067896465e-05)
        },
        {
        R(3.993790792336353e-05), R(-7.461229946924654e-05), R(-9.93670422323907e-06), R(-5.26181397736217e-05),
        R(-4.0495783985631064e-05), R(-9.456931766749352e-05), R(-3.460336327004948e-05), R(7.508593803520747e-05),
        R(3.152433667435908e-05), R(-5.33034752094962e-05), R(-2.4161674061954394e-05), R(5.097143972442031e-05),
        R(-5.8162981166221895e-05), R(8.110686485879055e-05)
        },
        {
        R(-3.733069371912069e-05), R(6.053001333658416e-05), R(1.3073212842263076e-05), R(4.867770172116675e-05),
        R(2.7218487412038216e-05), R(0.00013700887946590373), R(2.6449237482122946e-05), R(-2.040634594504783e-05),
        R(-6.087094269375756e-05), R(3.588425600521358e-05), R(1.893154395017334e-05), R(-4.6499315705936847e-05),
        R(4.3164275793278455e-05), R(-4.128290175725623e-05)
        },
        {
        R(-0.008721718825504408), R(-0.000170449904558933), R(-0.0024357371299557487), R(0.0001480864937768939),
        R(0.00256070673113357), R(0.0007060301405129059), R(-0.0022647570961917534), R(0.0019063401930690341),
        R(0.0016303437605626721), R(0.0018550647490445746), R(-0.0018418064830780195), R(0.00231080051092812),
        R(0.007236970032882314), R(0.003611022971738138)
        },
        {
        R(0.010122367849038628), R(-0.0012561647137286967), R(0.0028784785022336534), R(-0.004066721461325732),
        R(0.002775176437353155), R(-0.005668400589279179), R(0.010096484570543985), R(0.011600902593361977),
        R(-0.008658824808220998), R(0.008988760592152804), R(0.004752237815969125), R(-0.0013573076190096947),
        R(0.0009201752616653791), R(-0.008415199267623198)
        },
        {
        R(0.008935416193440404), R(-0.002739729486394266), R(0.0028159905751625742), R(-0.004643343453361308),
        R(0.005437242219560519), R(-0.009309765781094373), R(0.00919787505647237), R(0.014031403413203754),
        R(-0.009890871869342708), R(0.010928926435711283), R(0.005026018976794498), R(-0.000918307727606822),
        R(0.006797792336615724), R(-0.009244399172250277)
        },
        {
        R(0.005449663699742466), R(-0.004199096075966597), R(0.0007968564638255833), R(-0.0022734525047934865),
        R(0.0033458892955773845), R(-0.00866492027433113), R(0.002669145486651033), R(0.0026859175770177607),
        R(-0.0037434378602596956), R(0.007184573543394042), R(0.0029778063777007287), R(-0.0014793863035448503),
        R(0.007351337619607427), R(-0.0042745186757485835)
        },
        {
        R(0.0025042920094198646), R(-0.002700111683922626), R(-0.0012138150309311587), R(-0.0006186688725159458),
        R(0.0009875067612888032), R(-0.004245219755385833), R(0.0022125102668478567), R(-0.0032472061040674555),
        R(0.0010168967655882182), R(0.0040895646770647345), R(0.0006128997651288612), R(-0.002180262152423604),
        R(0.004454480533154588), R(0.00022211006501939154)
        },
        {
        R(0.0018436403859491699), R(0.00016916549624626157), R(-0.0018971423936048227), R(8.825679284805167e-05),
        R(0.00014886044147542206), R(-0.0003742912801942042), R(0.002370711555211179), R(-0.0009015230578792377),
        R(0.0007820148131119348), R(-0.0004641878711230854), R(-1.3138117684343288e-06), R(-0.0006480434023105224),
        R(-0.0004220246279404873), R(0.001407730005078229)
        }
    };
    real g[14];
    real a[14], sums[14];
    const real u0 = (known[50] - R(77.10074838861541)) / R(12.899251611384514); /* BP_2 [psi] */
    const real u6 = known[51]; /* RL_2 [1] */
    real y[1];
    real *const past = state->past + 768;
    unsigned int flags = 0u;

    real x[24];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = past[0] - past[1];
    x[3] = past[1] - past[3];
    x[4] = past[3] - past[7];
    x[5] = past[7] - past[15];
    x[6] = past[15] - past[31];
    x[7] = past[31] - past[63];
    x[8] = past[63] - past[127];
    x[9] = past[127] - past[255];
    x[10] = past[255] - past[511];
    x[11] = past[512];
    x[12] = past[513];
    x[13] = past[514];
    x[14] = past[515];
    x[15] = past[516];
    x[16] = past[517];
    x[17] = past[518];
    x[18] = past[519];
    x[19] = past[519] - past[520];
    x[20] = past[520] - past[522];
    x[21] = past[522] - past[526];
    x[22] = past[526] - past[534];
    x[23] = past[534] - past[550];
    weigh(sums, b, W[0], 14, x, 24);
    activate(a, sums, 14);
    weigh(g, v[0], G[0], 14, x, 24);
    y[0] = R(-0.008997262924852712) + dot(w[0], x, 24) + dot(g, a, 14);
    y[0] = ADDED(past[519], y[0], 66);
    {
        unsigned int held = 0u;
        real value; /* BP10_2 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(12.89566044959112) + R(77.10433955040881);
        if (value > known[66]) { /* BP10_2 may not be above BW_2 */
            value = known[66];
            y[0] = (value - R(77.10433955040881)) / R(12.89566044959112);
        }
        if (value >= known[66]) {
            held = 0u;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = (value - R(77.10433955040881)) / R(12.89566044959112);
        }
        if (value <= R(0.0)) {
            held = 0u;
        }
        known[67] = value;
        flags |= held;
    }
    memmove(past + 1, past + 0, 511 * sizeof *past);
    past[0] = u0;
    past[517] = u6;
    memmove(past + 520, past + 519, 31 * sizeof *past);
    past[519] = y[0];
    return flags;
}

/* BP10_2+AR10_2 -> RL10_2, NARX 0:0,1/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage67(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[67]; /* BP10_2 [psi] */
    real y[1];
    real *const past = state->past + 1319;
    unsigned int flags = 0u;

    y[0] = R(-28.8)
        + R(20.0) * (u0)
        + R(-20.0) * (past[0])
        + R(49.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 67);
    {
        real value; /* RL10_2 [1] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[68] = value;
    }
    past[1] = y[0];
    return flags;
}

/* AR10_2+BP10_2 -> XP10_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage68(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[67]; /* BP10_2 [psi] */
    real y[1];
    real *const past = state->past + 1321;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 68);
    {
        real value; /* XP10_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[69] = value;
    }
    past[1] = y[0];
    return flags;
}

/* AR10_2+XP10_2 -> AL10_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage69(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[69]; /* XP10_2 [psi] */
    real y[1];
    real *const past = state->past + 1323;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 69);
    {
        real value; /* AL10_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[70] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP10_2+RL10_2 -> AR10_2, NARX 0:1,2/2/12 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage70(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][6] = {
        {
        R(-0.002273475077571474), R(0.08750307130576576), R(0.0008223617395632246), R(0.002297361792417292),
        R(-0.0033325303913965343), R(0.004722628604116493)
        }
    };
    /* by regressor, then by neuron */
    static const real W[6][12] = {
        {
        R(8.380881075126169), R(3.2056665073501946), R(-6.451919684042217), R(-25.67364085117002),
        R(20.911879986626943), R(-11.761123520608976), R(-8.305745051080123), R(-19.735860321936997),
        R(-18.95258441787567), R(16.923740302031412), R(-6.304305606897486), R(-5.180003054071243)
        },
        {
        R(55.76401761298415), R(10.070474382516167), R(-37.52343848455643), R(13.675904195991372),
        R(-15.775435877409262), R(-62.532741008566816), R(-282.58899682070233), R(-81.23939531641614),
        R(-70.79582876369777), R(-43.94795005598855), R(-116.02050707163214), R(-56.67727104574728)
        },
        {
        R(-0.19174772505976456), R(-3.6502988597945993), R(-0.038975124620008295), R(12.985864370127366),
        R(-1.8154371860891758), R(0.3736669094644687), R(5.521217937587708), R(-3.307961858335841),
        R(2.1404879153785457), R(-1.1521601970446795), R(-0.6653620298340073), R(-0.7252535314578821)
        },
        {
        R(0.36349064834670664), R(2.541734229340509), R(2.3121533776578893), R(0.9317938557652253),
        R(-2.841381139596105), R(-0.49552497557691033), R(-2.1717737014990823), R(4.052806764732998),
        R(-0.20108674286823633), R(-2.9079682023278046), R(5.374868667959442), R(-0.11227713453065713)
        },
        {
        R(-7.939662002125878), R(-5.9646217716201075), R(5.959150770637201), R(24.39117283535751),
        R(-2.2046101058583805), R(11.561812827578935), R(8.166369132195527), R(18.425112671143445),
        R(18.570772556242485), R(-0.8201366997739921), R(5.22276634685992), R(4.4413499570628945)
        },
        {
        R(4.359354030403462), R(4.7226846900634945), R(-1.7611585060564754), R(-12.782212534999648),
        R(6.556820279097287), R(-10.489669848331697), R(-4.3722197765389845), R(-9.538988243992272),
        R(-13.23622868929179), R(0.09397999236814253), R(-4.593055942912062), R(-1.7203124188312788)
        }
    };
    static const real b[12] = {
        R(-0.7854104795669525), R(-4.975265965523954), R(-0.3968151523878636), R(-14.478917457246858),
        R(-19.231504729281685), R(0.4343106467353922), R(-7.674573550684702), R(5.710666993752596),
        R(2.355386702146546), R(-17.536272282326006), R(1.4075003860684345), R(0.8639076592781232)
    };
    /* by output, then by neuron */
    static const real v[1][12] = {
        {
        R(-0.006048589623668131), R(0.0019383375079660464), R(-0.0018480481324613786), R(-0.0014244928898889896),
        R(-0.002360388327434738), R(-0.0019335460911195034), R(-0.0005514943566220436), R(0.0013304332304271405),
        R(-0.008549016345403957), R(0.005378847652012222), R(-0.002528270109105415), R(0.0035493099631930558)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[6][12] = {
        {
        R(-0.011875890766540644), R(-0.004636583565192315), R(0.012818135684171415), R(0.003037955671837844),
        R(0.004026800565011146), R(-0.0020907270773585784), R(0.0032963667220801325), R(-0.0018006305818126997),
        R(-0.005997058511635711), R(-0.008637590789457777), R(-0.009567807031476382), R(-0.006487146916385411)
        },
        {
        R(0.03287585003485494), R(-0.006083579489397014), R(-0.04999824770406448), R(0.317936950186396),
        R(-0.4500389732572237), R(0.4133893630439153), R(-0.002572552183751487), R(-0.053245730591870606),
        R(-0.008851177318012665), R(0.23917176751985408), R(0.03523085460002604), R(-0.3124453587447955)
        },
        {
        R(0.016188693882183875), R(0.0011595173340870366), R(-0.0017689026617827169), R(-0.003165829158325086),
        R(-0.002590754079024946), R(0.0025453032548433015), R(-0.0005207271793016982), R(0.00047829920479557217),
        R(0.010542220944427569), R(0.004564815811309724), R(0.004870718877954528), R(0.0022544310136574214)
        },
        {
        R(-0.003672285477340245), R(-0.0024681119136188085), R(-0.0025867177599465485), R(-0.0015313813565111514),
        R(0.0002166176407093801), R(-0.0006543184526035383), R(0.0005088766655507397), R(0.002173426880219381),
        R(0.00010542738008908682), R(-0.003663844245138162), R(-0.0005674445114336388), R(0.002786063865219197)
        },
        {
        R(0.0018650291249777357), R(0.004313038739391531), R(-0.014692784916512314), R(-0.0033366559474284838),
        R(0.0035247441921430886), R(-0.002219452670163179), R(-0.0002742833331693989), R(0.001167202416301996),
        R(0.004549766561392472), R(-0.005329978033854883), R(0.009721684833962395), R(0.0028680069378658633)
        },
        {
        R(-0.0031052465806576963), R(-0.005595886544859029), R(0.005363383407451806), R(-0.001431211290487328),
        R(-0.004902082750234781), R(0.002754358169542052), R(-0.0035203145333673916), R(0.0026187493985740952),
        R(-0.0004477550965395059), R(-0.0005927079225154175), R(-0.0012575365143253708), R(0.0019845940156633084)
        }
    };
    real g[12];
    real a[12], sums[12];
    const real u0 = (known[67] - R(77.10074838861541)) / R(12.899251611384514); /* BP10_2 [psi] */
    const real u1 = (known[68] - R(0.5)) / R(0.5); /* RL10_2 [1] */
    real y[1];
    real *const past = state->past + 1325;
    unsigned int flags = 0u;

    real x[6];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = past[1];
    x[3] = past[1] - past[2];
    x[4] = past[3];
    x[5] = past[3] - past[4];
    weigh(sums, b, W[0], 12, x, 6);
    activate(a, sums, 12);
    weigh(g, v[0], G[0], 12, x, 6);
    y[0] = R(0.00176889420538532) + dot(w[0], x, 6) + dot(g, a, 12);
    y[0] = ADDED(past[3], y[0], 70);
    {
        unsigned int held = 0u;
        real value; /* AR10_2 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(12.899216372399025) + R(77.10078363184411);
        if (value > known[41]) { /* AR10_2 may not be above AH10_2 */
            value = known[41];
            y[0] = (value - R(77.10078363184411)) / R(12.899216372399025);
        }
        if (value >= known[41]) {
            held = 0u;
        }
        if (value < known[70]) { /* AR10_2 may not be below AL10_2 */
            value = known[70];
            y[0] = (value - R(77.10078363184411)) / R(12.899216372399025);
        }
        if (value <= known[70]) {
            held = 0u;
        }
        known[71] = value;
        flags |= held;
    }
    past[0] = u0;
    past[2] = past[1];
    past[1] = u1;
    past[4] = past[3];
    past[3] = y[0];
    return flags;
}

/* BP10_2+AR10_2 -> RX10_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage71(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[67]; /* BP10_2 [psi] */
    const real u1 = known[71]; /* AR10_2 [psi] */
    real y[1];
    real *const past = state->past + 1330;
    unsigned int flags = 0u;

    y[0] = R(-28.3)
        + R(20.0) * (u0)
        + R(-20.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 71);
    {
        real value; /* RX10_2 [1] */

        value = y[0];
        if (value > R(1.0)) { /* declared limit */
            value = R(1.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[72] = value;
    }
    past[0] = y[0];
    return flags;
}

/* ER10_2+BP10_2+RX10_2 -> FR10_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage72(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[67]; /* BP10_2 [psi] */
    const real u2 = known[72]; /* RX10_2 [1] */
    real y[1];
    real *const past = state->past + 1331;
    unsigned int flags = 0u;

    y[0] = R(-100.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(100.0) * (u2)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 72);
    {
        real value; /* FR10_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[73] = value;
    }
    past[1] = y[0];
    return flags;
}

/* ER10_2+FR10_2 -> EL10_2, NARX 1,0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage73(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u1 = known[73]; /* FR10_2 [psi] */
    real y[1];
    real *const past = state->past + 1333;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (past[0])
        + R(-1.0) * (u1)
        + R(-1.0) * (past[1]);
    y[0] = ADDED(past[1], y[0], 73);
    {
        real value; /* EL10_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[74] = value;
    }
    past[1] = y[0];
    return flags;
}

/* BP10_2+AR10_2+RL10_2 -> ER10_2, NARX 0:1/1/10 gated.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage74(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    static const real w[1][7] = {
        {
        R(0.002530721199094213), R(-0.07698537584460251), R(0.002787294000788698), R(-0.3099051623734298),
        R(-0.0010066777885356696), R(7.315163436917159e-05), R(-0.0034318768712034986)
        }
    };
    /* by regressor, then by neuron */
    static const real W[7][10] = {
        {
        R(3.370078555540175), R(18.718312883861515), R(-15.354402406851907), R(6.419851945553837),
        R(-35.54561780765847), R(-55.57584528127217), R(-13.804382503288593), R(-1.5528345002070179),
        R(-4.327865252517437), R(-0.31577638195222146)
        },
        {
        R(116.38779005010325), R(79.36600484816451), R(-23.084454012714477), R(-10.406862490642753),
        R(-51.365522522091226), R(80.7665107989974), R(142.30428158221585), R(16.81077486651973),
        R(1.8064543710408298), R(-6.398340491971017)
        },
        {
        R(-1.2522405350322288), R(-6.918830359188405), R(10.369596649632115), R(0.613858874799253),
        R(29.850160814657556), R(6.641078721180293), R(17.849144674508807), R(-1.837674747474523),
        R(0.7879406489876146), R(-0.4112732206058354)
        },
        {
        R(-871.5154934317777), R(-159.61182603110703), R(234.2293312022701), R(-7.819940264642257),
        R(2359.9475711819346), R(3672.106374313107), R(412.0551070687321), R(413.52248039712833), R(615.0921806788295),
        R(-238.5798187404542)
        },
        {
        R(-0.5514271012286063), R(-0.9331271332989637), R(0.027347499412644805), R(-7.3775659939564076),
        R(1.525275251876892), R(8.933033742916718), R(-2.584255800443104), R(0.8714825405335489), R(3.24323329375774),
        R(-1.108492670949101)
        },
        {
        R(10.54114184822428), R(-3.456741605050116), R(0.4207927927371487), R(6.4988606710135315),
        R(0.9058185648710716), R(5.588213427742172), R(0.3712401377907636), R(-19.008956557715592),
        R(-16.488082637286524), R(-0.5888346000547011)
        },
        {
        R(0.5828939678717759), R(-6.46281540404346), R(3.430854976452883), R(-3.455135314523608), R(2.00482444437436),
        R(26.035943920845806), R(-2.566003287730635), R(1.7256631385680214), R(1.2303866473547715),
        R(0.8521450372678239)
        }
    };
    static const real b[10] = {
        R(0.6727551226888011), R(-4.857110747869935), R(1.6827397880307917), R(5.178414151687395),
        R(1.6396300937770585), R(6.592216688141694), R(-1.3929800358859135), R(-3.5051005968626154),
        R(-2.3047618625362185), R(0.5730147517228352)
    };
    /* by output, then by neuron */
    static const real v[1][10] = {
        {
        R(-0.0004609274782181086), R(0.0006105755645835957), R(0.0019677631424373163), R(-0.003161559071379984),
        R(0.00034606929273852484), R(-0.0015777924500028765), R(-0.0006786386343766567), R(0.00034685352497809414),
        R(0.00010195824621979095), R(0.0006012409485900007)
        }
    };
    /* by regressor, then by neuron: what a neuron is multiplied with grows with the regressors */
    static const real G[7][10] = {
        {
        R(0.000567942249945233), R(0.003378880995978572), R(-0.0046219577003872095), R(0.0021860221525196524),
        R(-0.0014185197991059273), R(0.0015761960163727107), R(-0.006041294309958763), R(-0.001455856461933483),
        R(0.007994949106929043), R(0.0053631995404078495)
        },
        {
        R(0.049725490256154116), R(-0.003602251730177821), R(0.060684366884518864), R(-0.015905322953034907),
        R(-0.07151213476324648), R(-0.061016346863823095), R(-0.03230161894332475), R(-0.026526059077395393),
        R(-0.05263836065226449), R(-0.046069428176581044)
        },
        {
        R(-0.0010544429400208), R(-0.0018603962795610274), R(0.0038217638620614003), R(-0.007080096806030681),
        R(0.0016084156903337365), R(-0.0014049230460885936), R(-0.00010890042119648946), R(-0.00027258931880946857),
        R(-0.007204204142432058), R(-0.009733955171345343)
        },
        {
        R(0.17378412443871555), R(-0.6239098079478462), R(-0.2716227286852515), R(0.12743640210092422),
        R(-0.12914634844225076), R(-0.09687494658521086), R(0.26600128411316665), R(0.317869215939218),
        R(0.10194588821960701), R(0.6096247171644636)
        },
        {
        R(-9.448463239270996e-05), R(0.0005147200789871204), R(-0.0004211054682306584), R(0.0012353353023704834),
        R(0.0003821602774675163), R(-0.0017261831670451733), R(0.0014674869320406407), R(0.0008699593704083091),
        R(0.0003098017219942393), R(0.0021450115436432013)
        },
        {
        R(-0.005804148721594537), R(-0.00946813646177345), R(0.002198836373156907), R(-0.0005857571223963887),
        R(0.004314768589526072), R(-0.003239490646716353), R(-0.002226391877984382), R(-0.007002961141796707),
        R(2.4336954818627103e-05), R(0.007016304504316179)
        },
        {
        R(0.0003676677298003232), R(-0.0016501627779741377), R(-0.00116257275806835), R(0.005677241054428218),
        R(-4.65136196805018e-05), R(-0.00032495871462848326), R(0.004773737538394752), R(-0.00031424959086261925),
        R(0.001185747280256814), R(0.003432934931245035)
        }
    };
    real g[10];
    real a[10], sums[10];
    const real u0 = (known[67] - R(77.10074838861541)) / R(12.899251611384514); /* BP10_2 [psi] */
    const real u1 = (known[71] - R(77.10078363184411)) / R(12.899216372399025); /* AR10_2 [psi] */
    const real u2 = (known[68] - R(0.5)) / R(0.5); /* RL10_2 [1] */
    real y[1];
    real *const past = state->past + 1335;
    unsigned int flags = 0u;

    real x[7];

    x[0] = u0;
    x[1] = u0 - past[0];
    x[2] = u1;
    x[3] = u1 - past[1];
    x[4] = u2;
    x[5] = u2 - past[2];
    x[6] = past[3];
    weigh(sums, b, W[0], 10, x, 7);
    activate(a, sums, 10);
    weigh(g, v[0], G[0], 10, x, 7);
    y[0] = R(-0.0003585282757339048) + dot(w[0], x, 7) + dot(g, a, 10);
    y[0] = ADDED(past[3], y[0], 74);
    {
        unsigned int held = 0u;
        real value; /* ER10_2 [psi] */

        if (y[0] <= R(-3.0)) {
            y[0] = R(-3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        if (y[0] >= R(3.0)) {
            y[0] = R(3.0);
            held = STP_TO_BP_AR_BC_BC_SPREAD_AT_BOUND;
        }
        value = y[0] * R(7.087527821111905) + R(82.91247217899802);
        if (value > known[43]) { /* ER10_2 may not be above EH10_2 */
            value = known[43];
            y[0] = (value - R(82.91247217899802)) / R(7.087527821111905);
        }
        if (value >= known[43]) {
            held = 0u;
        }
        if (value < known[74]) { /* ER10_2 may not be below EL10_2 */
            value = known[74];
            y[0] = (value - R(82.91247217899802)) / R(7.087527821111905);
        }
        if (value <= known[74]) {
            held = 0u;
        }
        known[75] = value;
        flags |= held;
    }
    past[0] = u0;
    past[1] = u1;
    past[2] = u2;
    past[3] = y[0];
    return flags;
}

/* BP10_2 -> LA_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage75(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[67]; /* BP10_2 [psi] */
    real y[1];
    real *const past = state->past + 1339;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.005) * (u0)
        + R(-0.0050000000000000044) * (past[0]);
    y[0] = ADDED(past[0], y[0], 75);
    {
        real value; /* LA_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[76] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP10_2 -> LB_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage76(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[67]; /* BP10_2 [psi] */
    real y[1];
    real *const past = state->past + 1340;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.0016667) * (u0)
        + R(-0.001666700000000021) * (past[0]);
    y[0] = ADDED(past[0], y[0], 76);
    {
        real value; /* LB_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[77] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP10_2 -> LC_2, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage77(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[67]; /* BP10_2 [psi] */
    real y[1];
    real *const past = state->past + 1341;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.00055556) * (u0)
        + R(-0.0005555600000000105) * (past[0]);
    y[0] = ADDED(past[0], y[0], 77);
    {
        real value; /* LC_2 [psi] */

        value = y[0];
        if (value > R(91.0)) { /* declared limit */
            value = R(91.0);
            y[0] = value;
        }
        if (value < R(0.0)) { /* declared limit */
            value = R(0.0);
            y[0] = value;
        }
        known[78] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BP_1+BP_2 -> BP, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage78(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[11]; /* BP_1 [psi] */
    const real u1 = known[50]; /* BP_2 [psi] */
    real y[1];
    real *const past = state->past + 1342;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.5) * (u0)
        + R(0.5) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 78);
    {
        real value; /* BP [psi] */

        value = y[0];
        known[79] = value;
    }
    past[0] = y[0];
    return flags;
}

/* AR_1+AR_2 -> AR, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage79(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[17]; /* AR_1 [psi] */
    const real u1 = known[56]; /* AR_2 [psi] */
    real y[1];
    real *const past = state->past + 1343;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.5) * (u0)
        + R(0.5) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 79);
    {
        real value; /* AR [psi] */

        value = y[0];
        known[80] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BC_1+BC_2 -> BC, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage80(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[19]; /* BC_1 [psi] */
    const real u1 = known[58]; /* BC_2 [psi] */
    real y[1];
    real *const past = state->past + 1344;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(0.5) * (u0)
        + R(0.5) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 80);
    {
        real value; /* BC [psi] */

        value = y[0];
        known[81] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BC_1 -> BC_lower, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage81(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[19]; /* BC_1 [psi] */
    real y[1];
    real *const past = state->past + 1345;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 81);
    {
        real value; /* BC_lower [psi] */

        value = y[0];
        if (value > known[58]) { /* BC_lower may not be above BC_2 */
            value = known[58];
            y[0] = value;
        }
        known[82] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BC_1 -> BC_upper, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage82(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[19]; /* BC_1 [psi] */
    real y[1];
    real *const past = state->past + 1346;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 82);
    {
        real value; /* BC_upper [psi] */

        value = y[0];
        if (value < known[58]) { /* BC_upper may not be below BC_2 */
            value = known[58];
            y[0] = value;
        }
        known[83] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BC_upper+BC_lower -> BC_spread, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage83(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[83]; /* BC_upper [psi] */
    const real u1 = known[82]; /* BC_lower [psi] */
    real y[1];
    real *const past = state->past + 1347;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(-1.0) * (u1)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 83);
    {
        real value; /* BC_spread [psi] */

        value = y[0];
        known[84] = value;
    }
    past[0] = y[0];
    return flags;
}

/* BC_spread -> BC_apart, NARX 0:0/1/0.
 * known: inputs of the whole, then what is computed, in that order. */
static unsigned int stage84(stp_to_bp_ar_bc_bc_spread_state *state, real *known)
{
    /* Regressors are in incremental (delta) form, x(t - 1) and x(t - 1) - x(t - 2), because short numbers can hold their weights;
     * what is summed up is the change of the last output. By output, then by regressor. */
    const real u0 = known[84]; /* BC_spread [psi] */
    real y[1];
    real *const past = state->past + 1348;
    unsigned int flags = 0u;

    y[0] = R(0.0)
        + R(1.0) * (u0)
        + R(-1.0) * (past[0]);
    y[0] = ADDED(past[0], y[0], 84);
    {
        unsigned int held = 0u;
        real value; /* BC_apart [psi] */

        value = y[0];
        if (value > R(0.32533287568310953)) { /* declared limit */
            value = R(0.32533287568310953);
            y[0] = value;
        }
        if (value >= R(0.32533287568310953)) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_IN_DOUBT;
        }
        if (value < R(-0.32533287568310953)) { /* declared limit */
            value = R(-0.32533287568310953);
            y[0] = value;
        }
        if (value <= R(-0.32533287568310953)) {
            held = STP_TO_BP_AR_BC_BC_SPREAD_IN_DOUBT;
        }
        known[85] = value;
        flags |= held;
    }
    past[0] = y[0];
    return flags;
}

void stp_to_bp_ar_bc_bc_spread_init(stp_to_bp_ar_bc_bc_spread_state *state, const real *inputs, const real *outputs)
{
    real known[86]; /* inputs, then what is computed */
    int i;

    known[0] = inputs[0]; /* STP */
    known[1] = R(91.0); /* AH_1 */
    known[2] = R(91.0); /* AH10_1 */
    known[3] = R(91.0); /* EH_1 */
    known[4] = R(91.0); /* EH10_1 */
    known[5] = R(0.0); /* XS_1 */
    known[6] = R(0.0); /* XQ_1 */
    known[7] = R(90.0); /* EQ_1 */
    known[8] = R(0.0); /* BM_1 */
    known[9] = R(0.0); /* BN_1 */
    known[10] = R(91.0); /* BU_1 */
    known[11] = outputs ? outputs[0] : R(90.0); /* BP_1 */
    known[12] = R(0.0); /* RL_1 */
    known[13] = R(0.0); /* CL_1 */
    known[14] = R(0.0); /* XP_1 */
    known[15] = R(0.0); /* XM_1 */
    known[16] = R(0.0); /* AL_1 */
    known[17] = outputs ? outputs[1] : R(90.0); /* AR_1 */
    known[18] = R(91.0); /* CH_1 */
    known[19] = outputs ? outputs[2] : R(0.0); /* BC_1 */
    known[20] = R(0.0); /* RX_1 */
    known[21] = R(0.0); /* FR_1 */
    known[22] = R(0.0); /* EL_1 */
    known[23] = R(90.0); /* ER_1 */
    known[24] = R(0.0); /* QX_1 */
    known[25] = R(0.0); /* QF_1 */
    known[26] = R(0.0); /* BV_1 */
    known[27] = R(91.0); /* BW_1 */
    known[28] = R(90.0); /* BP10_1 */
    known[29] = R(0.0); /* RL10_1 */
    known[30] = R(0.0); /* XP10_1 */
    known[31] = R(0.0); /* AL10_1 */
    known[32] = R(90.0); /* AR10_1 */
    known[33] = R(0.0); /* RX10_1 */
    known[34] = R(0.0); /* FR10_1 */
    known[35] = R(0.0); /* EL10_1 */
    known[36] = R(90.0); /* ER10_1 */
    known[37] = R(90.0); /* LA_1 */
    known[38] = R(90.0); /* LB_1 */
    known[39] = R(90.0); /* LC_1 */
    known[40] = R(91.0); /* AH_2 */
    known[41] = R(91.0); /* AH10_2 */
    known[42] = R(91.0); /* EH_2 */
    known[43] = R(91.0); /* EH10_2 */
    known[44] = R(0.0); /* XS_2 */
    known[45] = R(0.0); /* XQ_2 */
    known[46] = R(90.0); /* EQ_2 */
    known[47] = R(0.0); /* BM_2 */
    known[48] = R(0.0); /* BN_2 */
    known[49] = R(91.0); /* BU_2 */
    known[50] = outputs ? outputs[0] : R(90.0); /* BP_2 */
    known[51] = R(0.0); /* RL_2 */
    known[52] = R(0.0); /* CL_2 */
    known[53] = R(0.0); /* XP_2 */
    known[54] = R(0.0); /* XM_2 */
    known[55] = R(0.0); /* AL_2 */
    known[56] = outputs ? outputs[1] : R(90.0); /* AR_2 */
    known[57] = R(91.0); /* CH_2 */
    known[58] = outputs ? outputs[2] : R(0.0); /* BC_2 */
    known[59] = R(0.0); /* RX_2 */
    known[60] = R(0.0); /* FR_2 */
    known[61] = R(0.0); /* EL_2 */
    known[62] = R(90.0); /* ER_2 */
    known[63] = R(0.0); /* QX_2 */
    known[64] = R(0.0); /* QF_2 */
    known[65] = R(0.0); /* BV_2 */
    known[66] = R(91.0); /* BW_2 */
    known[67] = R(90.0); /* BP10_2 */
    known[68] = R(0.0); /* RL10_2 */
    known[69] = R(0.0); /* XP10_2 */
    known[70] = R(0.0); /* AL10_2 */
    known[71] = R(90.0); /* AR10_2 */
    known[72] = R(0.0); /* RX10_2 */
    known[73] = R(0.0); /* FR10_2 */
    known[74] = R(0.0); /* EL10_2 */
    known[75] = R(90.0); /* ER10_2 */
    known[76] = R(90.0); /* LA_2 */
    known[77] = R(90.0); /* LB_2 */
    known[78] = R(90.0); /* LC_2 */
    known[79] = outputs ? outputs[0] : R(90.0); /* BP */
    known[80] = outputs ? outputs[1] : R(90.0); /* AR */
    known[81] = outputs ? outputs[2] : R(0.0); /* BC */
    known[82] = R(0.0); /* BC_lower */
    known[83] = R(0.0); /* BC_upper */
    known[84] = outputs ? outputs[3] : R(0.0); /* BC_spread */
    known[85] = R(0.0); /* BC_apart */
    for (i = 0; i < 86; i++) {
        known[i] += R(0.0) * known[i]; /* what is infinite is read as not a number */
    }
    for (i = 0; i < 1; i++) { /* AR_1 [psi] */
        state->past[i] = known[17];
    }
    for (i = 1; i < 2; i++) { /* RL_1 [1] */
        state->past[i] = known[12];
    }
    for (i = 2; i < 3; i++) { /* AH_1 [psi] */
        state->past[i] = known[1];
    }
    for (i = 3; i < 4; i++) { /* AR10_1 [psi] */
        state->past[i] = known[32];
    }
    for (i = 4; i < 5; i++) { /* RL10_1 [1] */
        state->past[i] = known[29];
    }
    for (i = 5; i < 6; i++) { /* AH10_1 [psi] */
        state->past[i] = known[2];
    }
    for (i = 6; i < 7; i++) { /* ER_1 [psi] */
        state->past[i] = known[23];
    }
    for (i = 7; i < 8; i++) { /* RL_1 [1] */
        state->past[i] = known[12];
    }
    for (i = 8; i < 9; i++) { /* EH_1 [psi] */
        state->past[i] = known[3];
    }
    for (i = 9; i < 10; i++) { /* ER10_1 [psi] */
        state->past[i] = known[36];
    }
    for (i = 10; i < 11; i++) { /* RL10_1 [1] */
        state->past[i] = known[29];
    }
    for (i = 11; i < 12; i++) { /* EH10_1 [psi] */
        state->past[i] = known[4];
    }
    for (i = 12; i < 13; i++) { /* AR_1 [psi] */
        state->past[i] = known[17];
    }
    for (i = 13; i < 14; i++) { /* BC_1 [psi] */
        state->past[i] = known[19];
    }
    for (i = 14; i < 15; i++) { /* XS_1 [psi] */
        state->past[i] = known[5];
    }
    for (i = 15; i < 16; i++) { /* EQ_1 [psi] */
        state->past[i] = known[7];
    }
    for (i = 16; i < 17; i++) { /* XQ_1 [psi] */
        state->past[i] = known[6];
    }
    for (i = 17; i < 18; i++) { /* EQ_1 [psi] */
        state->past[i] = known[7];
    }
    for (i = 18; i < 19; i++) { /* BP_1 [psi] */
        state->past[i] = known[11];
    }
    for (i = 19; i < 20; i++) { /* BM_1 [psi] */
        state->past[i] = known[8];
    }
    for (i = 20; i < 21; i++) { /* BP10_1 [psi] */
        state->past[i] = known[28];
    }
    for (i = 21; i < 22; i++) { /* BP_1 [psi] */
        state->past[i] = known[11];
    }
    for (i = 22; i < 23; i++) { /* BN_1 [psi] */
        state->past[i] = known[9];
    }
    for (i = 23; i < 24; i++) { /* BP_1 [psi] */
        state->past[i] = known[11];
    }
    for (i = 24; i < 25; i++) { /* RL_1 [1] */
        state->past[i] = known[12];
    }
    for (i = 25; i < 26; i++) { /* RL10_1 [1] */
        state->past[i] = known[29];
    }
    for (i = 26; i < 27; i++) { /* BU_1 [psi] */
        state->past[i] = known[10];
    }
    for (i = 27; i < 35; i++) { /* STP [psi] */
        state->past[i] = (known[0] - R(77.1)) / R(12.899999999999999);
    }
    for (i = 35; i < 36; i++) { /* AR_1 [psi] */
        state->past[i] = (known[17] - R(77.10078362972251)) / R(12.899216370277422);
    }
    for (i = 36; i < 37; i++) { /* ER_1 [psi] */
        state->past[i] = (known[23] - R(82.91247217894302)) / R(7.087527821056909);
    }
    for (i = 37; i < 45; i++) { /* BP10_1 [psi] */
        state->past[i] = (known[28] - R(77.10433955040881)) / R(12.89566044959112);
    }
    for (i = 45; i < 46; i++) { /* XQ_1 [psi] */
        state->past[i] = known[6];
    }
    for (i = 46; i < 47; i++) { /* QX_1 [psi] */
        state->past[i] = known[24];
    }
    for (i = 47; i < 48; i++) { /* QF_1 [psi] */
        state->past[i] = known[25];
    }
    for (i = 48; i < 49; i++) { /* RL_1 [1] */
        state->past[i] = known[12];
    }
    for (i = 49; i < 50; i++) { /* RL10_1 [1] */
        state->past[i] = known[29];
    }
    for (i = 50; i < 58; i++) { /* BP_1 [psi] */
        state->past[i] = (known[11] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 58; i < 59; i++) { /* AR_1 [psi] */
        state->past[i] = known[17];
    }
    for (i = 59; i < 60; i++) { /* RL_1 [1] */
        state->past[i] = known[12];
    }
    for (i = 60; i < 61; i++) { /* BC_1 [psi] */
        state->past[i] = known[19];
    }
    for (i = 61; i < 62; i++) { /* CL_1 [psi] */
        state->past[i] = known[13];
    }
    for (i = 62; i < 63; i++) { /* AR_1 [psi] */
        state->past[i] = known[17];
    }
    for (i = 63; i < 64; i++) { /* XP_1 [psi] */
        state->past[i] = known[14];
    }
    for (i = 64; i < 65; i++) { /* XM_1 [psi] */
        state->past[i] = known[15];
    }
    for (i = 65; i < 66; i++) { /* AR_1 [psi] */
        state->past[i] = known[17];
    }
    for (i = 66; i < 67; i++) { /* AL_1 [psi] */
        state->past[i] = known[16];
    }
    for (i = 67; i < 68; i++) { /* BP_1 [psi] */
        state->past[i] = (known[11] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 68; i < 70; i++) { /* RL_1 [1] */
        state->past[i] = (known[12] - R(0.5)) / R(0.5);
    }
    for (i = 70; i < 72; i++) { /* AR_1 [psi] */
        state->past[i] = (known[17] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 72; i < 73; i++) { /* AR_1 [psi] */
        state->past[i] = known[17];
    }
    for (i = 73; i < 74; i++) { /* BC_1 [psi] */
        state->past[i] = known[19];
    }
    for (i = 74; i < 75; i++) { /* CH_1 [psi] */
        state->past[i] = known[18];
    }
    for (i = 75; i < 76; i++) { /* BP_1 [psi] */
        state->past[i] = (known[11] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 76; i < 77; i++) { /* AR_1 [psi] */
        state->past[i] = (known[17] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 77; i < 78; i++) { /* RL_1 [1] */
        state->past[i] = (known[12] - R(0.5)) / R(0.5);
    }
    for (i = 78; i < 80; i++) { /* BC_1 [psi] */
        state->past[i] = (known[19] - R(31.131394488296472)) / R(31.131394488296472);
    }
    for (i = 80; i < 81; i++) { /* RX_1 [1] */
        state->past[i] = known[20];
    }
    for (i = 81; i < 82; i++) { /* ER_1 [psi] */
        state->past[i] = known[23];
    }
    for (i = 82; i < 83; i++) { /* FR_1 [psi] */
        state->past[i] = known[21];
    }
    for (i = 83; i < 84; i++) { /* ER_1 [psi] */
        state->past[i] = known[23];
    }
    for (i = 84; i < 85; i++) { /* EL_1 [psi] */
        state->past[i] = known[22];
    }
    for (i = 85; i < 86; i++) { /* BP_1 [psi] */
        state->past[i] = (known[11] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 86; i < 87; i++) { /* AR_1 [psi] */
        state->past[i] = (known[17] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 87; i < 88; i++) { /* RL_1 [1] */
        state->past[i] = (known[12] - R(0.5)) / R(0.5);
    }
    for (i = 88; i < 89; i++) { /* ER_1 [psi] */
        state->past[i] = (known[23] - R(82.91247217899802)) / R(7.087527821111905);
    }
    for (i = 89; i < 90; i++) { /* QX_1 [psi] */
        state->past[i] = known[24];
    }
    for (i = 90; i < 91; i++) { /* QF_1 [psi] */
        state->past[i] = known[25];
    }
    for (i = 91; i < 92; i++) { /* BP10_1 [psi] */
        state->past[i] = known[28];
    }
    for (i = 92; i < 93; i++) { /* BV_1 [psi] */
        state->past[i] = known[26];
    }
    for (i = 93; i < 94; i++) { /* BP10_1 [psi] */
        state->past[i] = known[28];
    }
    for (i = 94; i < 95; i++) { /* RL_1 [1] */
        state->past[i] = known[12];
    }
    for (i = 95; i < 96; i++) { /* RL10_1 [1] */
        state->past[i] = known[29];
    }
    for (i = 96; i < 97; i++) { /* BW_1 [psi] */
        state->past[i] = known[27];
    }
    for (i = 97; i < 609; i++) { /* BP_1 [psi] */
        state->past[i] = (known[11] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 609; i < 610; i++) { /* AR10_1 [psi] */
        state->past[i] = (known[32] - R(77.10450592914981)) / R(12.895494075093318);
    }
    for (i = 610; i < 611; i++) { /* ER10_1 [psi] */
        state->past[i] = (known[36] - R(82.27646622166749)) / R(7.72353377844243);
    }
    for (i = 611; i < 612; i++) { /* LA_1 [psi] */
        state->past[i] = known[37];
    }
    for (i = 612; i < 613; i++) { /* LB_1 [psi] */
        state->past[i] = known[38];
    }
    for (i = 613; i < 614; i++) { /* LC_1 [psi] */
        state->past[i] = known[39];
    }
    for (i = 614; i < 615; i++) { /* RL_1 [1] */
        state->past[i] = known[12];
    }
    for (i = 615; i < 616; i++) { /* RL10_1 [1] */
        state->past[i] = known[29];
    }
    for (i = 616; i < 648; i++) { /* BP10_1 [psi] */
        state->past[i] = (known[28] - R(77.10433955040881)) / R(12.89566044959112);
    }
    for (i = 648; i < 649; i++) { /* AR10_1 [psi] */
        state->past[i] = known[32];
    }
    for (i = 649; i < 650; i++) { /* RL10_1 [1] */
        state->past[i] = known[29];
    }
    for (i = 650; i < 651; i++) { /* AR10_1 [psi] */
        state->past[i] = known[32];
    }
    for (i = 651; i < 652; i++) { /* XP10_1 [psi] */
        state->past[i] = known[30];
    }
    for (i = 652; i < 653; i++) { /* AR10_1 [psi] */
        state->past[i] = known[32];
    }
    for (i = 653; i < 654; i++) { /* AL10_1 [psi] */
        state->past[i] = known[31];
    }
    for (i = 654; i < 655; i++) { /* BP10_1 [psi] */
        state->past[i] = (known[28] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 655; i < 657; i++) { /* RL10_1 [1] */
        state->past[i] = (known[29] - R(0.5)) / R(0.5);
    }
    for (i = 657; i < 659; i++) { /* AR10_1 [psi] */
        state->past[i] = (known[32] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 659; i < 660; i++) { /* RX10_1 [1] */
        state->past[i] = known[33];
    }
    for (i = 660; i < 661; i++) { /* ER10_1 [psi] */
        state->past[i] = known[36];
    }
    for (i = 661; i < 662; i++) { /* FR10_1 [psi] */
        state->past[i] = known[34];
    }
    for (i = 662; i < 663; i++) { /* ER10_1 [psi] */
        state->past[i] = known[36];
    }
    for (i = 663; i < 664; i++) { /* EL10_1 [psi] */
        state->past[i] = known[35];
    }
    for (i = 664; i < 665; i++) { /* BP10_1 [psi] */
        state->past[i] = (known[28] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 665; i < 666; i++) { /* AR10_1 [psi] */
        state->past[i] = (known[32] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 666; i < 667; i++) { /* RL10_1 [1] */
        state->past[i] = (known[29] - R(0.5)) / R(0.5);
    }
    for (i = 667; i < 668; i++) { /* ER10_1 [psi] */
        state->past[i] = (known[36] - R(82.91247217899802)) / R(7.087527821111905);
    }
    for (i = 668; i < 669; i++) { /* LA_1 [psi] */
        state->past[i] = known[37];
    }
    for (i = 669; i < 670; i++) { /* LB_1 [psi] */
        state->past[i] = known[38];
    }
    for (i = 670; i < 671; i++) { /* LC_1 [psi] */
        state->past[i] = known[39];
    }
    for (i = 671; i < 672; i++) { /* AR_2 [psi] */
        state->past[i] = known[56];
    }
    for (i = 672; i < 673; i++) { /* RL_2 [1] */
        state->past[i] = known[51];
    }
    for (i = 673; i < 674; i++) { /* AH_2 [psi] */
        state->past[i] = known[40];
    }
    for (i = 674; i < 675; i++) { /* AR10_2 [psi] */
        state->past[i] = known[71];
    }
    for (i = 675; i < 676; i++) { /* RL10_2 [1] */
        state->past[i] = known[68];
    }
    for (i = 676; i < 677; i++) { /* AH10_2 [psi] */
        state->past[i] = known[41];
    }
    for (i = 677; i < 678; i++) { /* ER_2 [psi] */
        state->past[i] = known[62];
    }
    for (i = 678; i < 679; i++) { /* RL_2 [1] */
        state->past[i] = known[51];
    }
    for (i = 679; i < 680; i++) { /* EH_2 [psi] */
        state->past[i] = known[42];
    }
    for (i = 680; i < 681; i++) { /* ER10_2 [psi] */
        state->past[i] = known[75];
    }
    for (i = 681; i < 682; i++) { /* RL10_2 [1] */
        state->past[i] = known[68];
    }
    for (i = 682; i < 683; i++) { /* EH10_2 [psi] */
        state->past[i] = known[43];
    }
    for (i = 683; i < 684; i++) { /* AR_2 [psi] */
        state->past[i] = known[56];
    }
    for (i = 684; i < 685; i++) { /* BC_2 [psi] */
        state->past[i] = known[58];
    }
    for (i = 685; i < 686; i++) { /* XS_2 [psi] */
        state->past[i] = known[44];
    }
    for (i = 686; i < 687; i++) { /* EQ_2 [psi] */
        state->past[i] = known[46];
    }
    for (i = 687; i < 688; i++) { /* XQ_2 [psi] */
        state->past[i] = known[45];
    }
    for (i = 688; i < 689; i++) { /* EQ_2 [psi] */
        state->past[i] = known[46];
    }
    for (i = 689; i < 690; i++) { /* BP_2 [psi] */
        state->past[i] = known[50];
    }
    for (i = 690; i < 691; i++) { /* BM_2 [psi] */
        state->past[i] = known[47];
    }
    for (i = 691; i < 692; i++) { /* BP10_2 [psi] */
        state->past[i] = known[67];
    }
    for (i = 692; i < 693; i++) { /* BP_2 [psi] */
        state->past[i] = known[50];
    }
    for (i = 693; i < 694; i++) { /* BN_2 [psi] */
        state->past[i] = known[48];
    }
    for (i = 694; i < 695; i++) { /* BP_2 [psi] */
        state->past[i] = known[50];
    }
    for (i = 695; i < 696; i++) { /* RL_2 [1] */
        state->past[i] = known[51];
    }
    for (i = 696; i < 697; i++) { /* RL10_2 [1] */
        state->past[i] = known[68];
    }
    for (i = 697; i < 698; i++) { /* BU_2 [psi] */
        state->past[i] = known[49];
    }
    for (i = 698; i < 706; i++) { /* STP [psi] */
        state->past[i] = (known[0] - R(77.1)) / R(12.899999999999999);
    }
    for (i = 706; i < 707; i++) { /* AR_2 [psi] */
        state->past[i] = (known[56] - R(77.10078362972251)) / R(12.899216370277422);
    }
    for (i = 707; i < 708; i++) { /* ER_2 [psi] */
        state->past[i] = (known[62] - R(82.91247217894302)) / R(7.087527821056909);
    }
    for (i = 708; i < 716; i++) { /* BP10_2 [psi] */
        state->past[i] = (known[67] - R(77.10433955040881)) / R(12.89566044959112);
    }
    for (i = 716; i < 717; i++) { /* XQ_2 [psi] */
        state->past[i] = known[45];
    }
    for (i = 717; i < 718; i++) { /* QX_2 [psi] */
        state->past[i] = known[63];
    }
    for (i = 718; i < 719; i++) { /* QF_2 [psi] */
        state->past[i] = known[64];
    }
    for (i = 719; i < 720; i++) { /* RL_2 [1] */
        state->past[i] = known[51];
    }
    for (i = 720; i < 721; i++) { /* RL10_2 [1] */
        state->past[i] = known[68];
    }
    for (i = 721; i < 729; i++) { /* BP_2 [psi] */
        state->past[i] = (known[50] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 729; i < 730; i++) { /* AR_2 [psi] */
        state->past[i] = known[56];
    }
    for (i = 730; i < 731; i++) { /* RL_2 [1] */
        state->past[i] = known[51];
    }
    for (i = 731; i < 732; i++) { /* BC_2 [psi] */
        state->past[i] = known[58];
    }
    for (i = 732; i < 733; i++) { /* CL_2 [psi] */
        state->past[i] = known[52];
    }
    for (i = 733; i < 734; i++) { /* AR_2 [psi] */
        state->past[i] = known[56];
    }
    for (i = 734; i < 735; i++) { /* XP_2 [psi] */
        state->past[i] = known[53];
    }
    for (i = 735; i < 736; i++) { /* XM_2 [psi] */
        state->past[i] = known[54];
    }
    for (i = 736; i < 737; i++) { /* AR_2 [psi] */
        state->past[i] = known[56];
    }
    for (i = 737; i < 738; i++) { /* AL_2 [psi] */
        state->past[i] = known[55];
    }
    for (i = 738; i < 739; i++) { /* BP_2 [psi] */
        state->past[i] = (known[50] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 739; i < 741; i++) { /* RL_2 [1] */
        state->past[i] = (known[51] - R(0.5)) / R(0.5);
    }
    for (i = 741; i < 743; i++) { /* AR_2 [psi] */
        state->past[i] = (known[56] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 743; i < 744; i++) { /* AR_2 [psi] */
        state->past[i] = known[56];
    }
    for (i = 744; i < 745; i++) { /* BC_2 [psi] */
        state->past[i] = known[58];
    }
    for (i = 745; i < 746; i++) { /* CH_2 [psi] */
        state->past[i] = known[57];
    }
    for (i = 746; i < 747; i++) { /* BP_2 [psi] */
        state->past[i] = (known[50] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 747; i < 748; i++) { /* AR_2 [psi] */
        state->past[i] = (known[56] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 748; i < 749; i++) { /* RL_2 [1] */
        state->past[i] = (known[51] - R(0.5)) / R(0.5);
    }
    for (i = 749; i < 751; i++) { /* BC_2 [psi] */
        state->past[i] = (known[58] - R(31.131394488296472)) / R(31.131394488296472);
    }
    for (i = 751; i < 752; i++) { /* RX_2 [1] */
        state->past[i] = known[59];
    }
    for (i = 752; i < 753; i++) { /* ER_2 [psi] */
        state->past[i] = known[62];
    }
    for (i = 753; i < 754; i++) { /* FR_2 [psi] */
        state->past[i] = known[60];
    }
    for (i = 754; i < 755; i++) { /* ER_2 [psi] */
        state->past[i] = known[62];
    }
    for (i = 755; i < 756; i++) { /* EL_2 [psi] */
        state->past[i] = known[61];
    }
    for (i = 756; i < 757; i++) { /* BP_2 [psi] */
        state->past[i] = (known[50] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 757; i < 758; i++) { /* AR_2 [psi] */
        state->past[i] = (known[56] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 758; i < 759; i++) { /* RL_2 [1] */
        state->past[i] = (known[51] - R(0.5)) / R(0.5);
    }
    for (i = 759; i < 760; i++) { /* ER_2 [psi] */
        state->past[i] = (known[62] - R(82.91247217899802)) / R(7.087527821111905);
    }
    for (i = 760; i < 761; i++) { /* QX_2 [psi] */
        state->past[i] = known[63];
    }
    for (i = 761; i < 762; i++) { /* QF_2 [psi] */
        state->past[i] = known[64];
    }
    for (i = 762; i < 763; i++) { /* BP10_2 [psi] */
        state->past[i] = known[67];
    }
    for (i = 763; i < 764; i++) { /* BV_2 [psi] */
        state->past[i] = known[65];
    }
    for (i = 764; i < 765; i++) { /* BP10_2 [psi] */
        state->past[i] = known[67];
    }
    for (i = 765; i < 766; i++) { /* RL_2 [1] */
        state->past[i] = known[51];
    }
    for (i = 766; i < 767; i++) { /* RL10_2 [1] */
        state->past[i] = known[68];
    }
    for (i = 767; i < 768; i++) { /* BW_2 [psi] */
        state->past[i] = known[66];
    }
    for (i = 768; i < 1280; i++) { /* BP_2 [psi] */
        state->past[i] = (known[50] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 1280; i < 1281; i++) { /* AR10_2 [psi] */
        state->past[i] = (known[71] - R(77.10450592914981)) / R(12.895494075093318);
    }
    for (i = 1281; i < 1282; i++) { /* ER10_2 [psi] */
        state->past[i] = (known[75] - R(82.27646622166749)) / R(7.72353377844243);
    }
    for (i = 1282; i < 1283; i++) { /* LA_2 [psi] */
        state->past[i] = known[76];
    }
    for (i = 1283; i < 1284; i++) { /* LB_2 [psi] */
        state->past[i] = known[77];
    }
    for (i = 1284; i < 1285; i++) { /* LC_2 [psi] */
        state->past[i] = known[78];
    }
    for (i = 1285; i < 1286; i++) { /* RL_2 [1] */
        state->past[i] = known[51];
    }
    for (i = 1286; i < 1287; i++) { /* RL10_2 [1] */
        state->past[i] = known[68];
    }
    for (i = 1287; i < 1319; i++) { /* BP10_2 [psi] */
        state->past[i] = (known[67] - R(77.10433955040881)) / R(12.89566044959112);
    }
    for (i = 1319; i < 1320; i++) { /* AR10_2 [psi] */
        state->past[i] = known[71];
    }
    for (i = 1320; i < 1321; i++) { /* RL10_2 [1] */
        state->past[i] = known[68];
    }
    for (i = 1321; i < 1322; i++) { /* AR10_2 [psi] */
        state->past[i] = known[71];
    }
    for (i = 1322; i < 1323; i++) { /* XP10_2 [psi] */
        state->past[i] = known[69];
    }
    for (i = 1323; i < 1324; i++) { /* AR10_2 [psi] */
        state->past[i] = known[71];
    }
    for (i = 1324; i < 1325; i++) { /* AL10_2 [psi] */
        state->past[i] = known[70];
    }
    for (i = 1325; i < 1326; i++) { /* BP10_2 [psi] */
        state->past[i] = (known[67] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 1326; i < 1328; i++) { /* RL10_2 [1] */
        state->past[i] = (known[68] - R(0.5)) / R(0.5);
    }
    for (i = 1328; i < 1330; i++) { /* AR10_2 [psi] */
        state->past[i] = (known[71] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 1330; i < 1331; i++) { /* RX10_2 [1] */
        state->past[i] = known[72];
    }
    for (i = 1331; i < 1332; i++) { /* ER10_2 [psi] */
        state->past[i] = known[75];
    }
    for (i = 1332; i < 1333; i++) { /* FR10_2 [psi] */
        state->past[i] = known[73];
    }
    for (i = 1333; i < 1334; i++) { /* ER10_2 [psi] */
        state->past[i] = known[75];
    }
    for (i = 1334; i < 1335; i++) { /* EL10_2 [psi] */
        state->past[i] = known[74];
    }
    for (i = 1335; i < 1336; i++) { /* BP10_2 [psi] */
        state->past[i] = (known[67] - R(77.10074838861541)) / R(12.899251611384514);
    }
    for (i = 1336; i < 1337; i++) { /* AR10_2 [psi] */
        state->past[i] = (known[71] - R(77.10078363184411)) / R(12.899216372399025);
    }
    for (i = 1337; i < 1338; i++) { /* RL10_2 [1] */
        state->past[i] = (known[68] - R(0.5)) / R(0.5);
    }
    for (i = 1338; i < 1339; i++) { /* ER10_2 [psi] */
        state->past[i] = (known[75] - R(82.91247217899802)) / R(7.087527821111905);
    }
    for (i = 1339; i < 1340; i++) { /* LA_2 [psi] */
        state->past[i] = known[76];
    }
    for (i = 1340; i < 1341; i++) { /* LB_2 [psi] */
        state->past[i] = known[77];
    }
    for (i = 1341; i < 1342; i++) { /* LC_2 [psi] */
        state->past[i] = known[78];
    }
    for (i = 1342; i < 1343; i++) { /* BP [psi] */
        state->past[i] = known[79];
    }
    for (i = 1343; i < 1344; i++) { /* AR [psi] */
        state->past[i] = known[80];
    }
    for (i = 1344; i < 1345; i++) { /* BC [psi] */
        state->past[i] = known[81];
    }
    for (i = 1345; i < 1346; i++) { /* BC_lower [psi] */
        state->past[i] = known[82];
    }
    for (i = 1346; i < 1347; i++) { /* BC_upper [psi] */
        state->past[i] = known[83];
    }
    for (i = 1347; i < 1348; i++) { /* BC_spread [psi] */
        state->past[i] = known[84];
    }
    for (i = 1348; i < 1349; i++) { /* BC_apart [psi] */
        state->past[i] = known[85];
    }
#ifdef STP_TO_BP_AR_BC_BC_SPREAD_FLOAT
    for (i = 0; i < STP_TO_BP_AR_BC_BC_SPREAD_N_LOST; i++) {
        state->lost[i] = R(0.0);
    }
#endif
}

unsigned int stp_to_bp_ar_bc_bc_spread_step(stp_to_bp_ar_bc_bc_spread_state *state, const real *inputs, real *outputs)
{
    real known[86]; /* inputs, then what is computed */
    unsigned int flags = 0u;
    int i;

    for (i = 0; i < STP_TO_BP_AR_BC_BC_SPREAD_N_INPUTS; i++) {
        known[i] = inputs[i];
    }
    if (known[STP_TO_BP_AR_BC_BC_SPREAD_INPUT_STP] < R(64.2) || known[STP_TO_BP_AR_BC_BC_SPREAD_INPUT_STP] > R(90.0)) {
        flags |= STP_TO_BP_AR_BC_BC_SPREAD_OUTSIDE_RANGE;
    }
    for (i = 0; i < STP_TO_BP_AR_BC_BC_SPREAD_N_INPUTS; i++) {
        known[i] += R(0.0) * known[i]; /* what is infinite is read as not a number */
    }
    flags |= stage0(state, known);
    flags |= stage1(state, known);
    flags |= stage2(state, known);
    flags |= stage3(state, known);
    flags |= stage4(state, known);
    flags |= stage5(state, known);
    flags |= stage6(state, known);
    flags |= stage7(state, known);
    flags |= stage8(state, known);
    flags |= stage9(state, known);
    flags |= stage10(state, known);
    flags |= stage11(state, known);
    flags |= stage12(state, known);
    flags |= stage13(state, known);
    flags |= stage14(state, known);
    flags |= stage15(state, known);
    flags |= stage16(state, known);
    flags |= stage17(state, known);
    flags |= stage18(state, known);
    flags |= stage19(state, known);
    flags |= stage20(state, known);
    flags |= stage21(state, known);
    flags |= stage22(state, known);
    flags |= stage23(state, known);
    flags |= stage24(state, known);
    flags |= stage25(state, known);
    flags |= stage26(state, known);
    flags |= stage27(state, known);
    flags |= stage28(state, known);
    flags |= stage29(state, known);
    flags |= stage30(state, known);
    flags |= stage31(state, known);
    flags |= stage32(state, known);
    flags |= stage33(state, known);
    flags |= stage34(state, known);
    flags |= stage35(state, known);
    flags |= stage36(state, known);
    flags |= stage37(state, known);
    flags |= stage38(state, known);
    flags |= stage39(state, known);
    flags |= stage40(state, known);
    flags |= stage41(state, known);
    flags |= stage42(state, known);
    flags |= stage43(state, known);
    flags |= stage44(state, known);
    flags |= stage45(state, known);
    flags |= stage46(state, known);
    flags |= stage47(state, known);
    flags |= stage48(state, known);
    flags |= stage49(state, known);
    flags |= stage50(state, known);
    flags |= stage51(state, known);
    flags |= stage52(state, known);
    flags |= stage53(state, known);
    flags |= stage54(state, known);
    flags |= stage55(state, known);
    flags |= stage56(state, known);
    flags |= stage57(state, known);
    flags |= stage58(state, known);
    flags |= stage59(state, known);
    flags |= stage60(state, known);
    flags |= stage61(state, known);
    flags |= stage62(state, known);
    flags |= stage63(state, known);
    flags |= stage64(state, known);
    flags |= stage65(state, known);
    flags |= stage66(state, known);
    flags |= stage67(state, known);
    flags |= stage68(state, known);
    flags |= stage69(state, known);
    flags |= stage70(state, known);
    flags |= stage71(state, known);
    flags |= stage72(state, known);
    flags |= stage73(state, known);
    flags |= stage74(state, known);
    flags |= stage75(state, known);
    flags |= stage76(state, known);
    flags |= stage77(state, known);
    flags |= stage78(state, known);
    flags |= stage79(state, known);
    flags |= stage80(state, known);
    flags |= stage81(state, known);
    flags |= stage82(state, known);
    flags |= stage83(state, known);
    flags |= stage84(state, known);
    /* past samples of what is computed after it is read */
    state->past[0] = known[17]; /* AR_1 */
    state->past[1] = known[12]; /* RL_1 */
    state->past[3] = known[32]; /* AR10_1 */
    state->past[4] = known[29]; /* RL10_1 */
    state->past[6] = known[23]; /* ER_1 */
    state->past[7] = known[12]; /* RL_1 */
    state->past[9] = known[36]; /* ER10_1 */
    state->past[10] = known[29]; /* RL10_1 */
    state->past[12] = known[17]; /* AR_1 */
    state->past[13] = known[19]; /* BC_1 */
    state->past[15] = known[7]; /* EQ_1 */
    state->past[18] = known[11]; /* BP_1 */
    state->past[20] = known[28]; /* BP10_1 */
    state->past[21] = known[11]; /* BP_1 */
    state->past[23] = known[11]; /* BP_1 */
    state->past[24] = known[12]; /* RL_1 */
    state->past[25] = known[29]; /* RL10_1 */
    state->past[35] = (known[17] - R(77.10078362972251)) / R(12.899216370277422); /* AR_1 */
    state->past[36] = (known[23] - R(82.91247217894302)) / R(7.087527821056909); /* ER_1 */
    state->past[37] = (known[28] - R(77.10433955040881)) / R(12.89566044959112); /* BP10_1 */
    state->past[46] = known[24]; /* QX_1 */
    state->past[47] = known[25]; /* QF_1 */
    state->past[48] = known[12]; /* RL_1 */
    state->past[49] = known[29]; /* RL10_1 */
    state->past[58] = known[17]; /* AR_1 */
    state->past[60] = known[19]; /* BC_1 */
    state->past[62] = known[17]; /* AR_1 */
    state->past[65] = known[17]; /* AR_1 */
    state->past[73] = known[19]; /* BC_1 */
    state->past[81] = known[23]; /* ER_1 */
    state->past[83] = known[23]; /* ER_1 */
    state->past[91] = known[28]; /* BP10_1 */
    state->past[93] = known[28]; /* BP10_1 */
    state->past[95] = known[29]; /* RL10_1 */
    state->past[609] = (known[32] - R(77.10450592914981)) / R(12.895494075093318); /* AR10_1 */
    state->past[610] = (known[36] - R(82.27646622166749)) / R(7.72353377844243); /* ER10_1 */
    state->past[611] = known[37]; /* LA_1 */
    state->past[612] = known[38]; /* LB_1 */
    state->past[613] = known[39]; /* LC_1 */
    state->past[615] = known[29]; /* RL10_1 */
    state->past[648] = known[32]; /* AR10_1 */
    state->past[650] = known[32]; /* AR10_1 */
    state->past[652] = known[32]; /* AR10_1 */
    state->past[660] = known[36]; /* ER10_1 */
    state->past[662] = known[36]; /* ER10_1 */
    state->past[671] = known[56]; /* AR_2 */
    state->past[672] = known[51]; /* RL_2 */
    state->past[674] = known[71]; /* AR10_2 */
    state->past[675] = known[68]; /* RL10_2 */
    state->past[677] = known[62]; /* ER_2 */
    state->past[678] = known[51]; /* RL_2 */
    state->past[680] = known[75]; /* ER10_2 */
    state->past[681] = known[68]; /* RL10_2 */
    state->past[683] = known[56]; /* AR_2 */
    state->past[684] = known[58]; /* BC_2 */
    state->past[686] = known[46]; /* EQ_2 */
    state->past[689] = known[50]; /* BP_2 */
    state->past[691] = known[67]; /* BP10_2 */
    state->past[692] = known[50]; /* BP_2 */
    state->past[694] = known[50]; /* BP_2 */
    state->past[695] = known[51]; /* RL_2 */
    state->past[696] = known[68]; /* RL10_2 */
    state->past[706] = (known[56] - R(77.10078362972251)) / R(12.899216370277422); /* AR_2 */
    state->past[707] = (known[62] - R(82.91247217894302)) / R(7.087527821056909); /* ER_2 */
    state->past[708] = (known[67] - R(77.10433955040881)) / R(12.89566044959112); /* BP10_2 */
    state->past[717] = known[63]; /* QX_2 */
    state->past[718] = known[64]; /* QF_2 */
    state->past[719] = known[51]; /* RL_2 */
    state->past[720] = known[68]; /* RL10_2 */
    state->past[729] = known[56]; /* AR_2 */
    state->past[731] = known[58]; /* BC_2 */
    state->past[733] = known[56]; /* AR_2 */
    state->past[736] = known[56]; /* AR_2 */
    state->past[744] = known[58]; /* BC_2 */
    state->past[752] = known[62]; /* ER_2 */
    state->past[754] = known[62]; /* ER_2 */
    state->past[762] = known[67]; /* BP10_2 */
    state->past[764] = known[67]; /* BP10_2 */
    state->past[766] = known[68]; /* RL10_2 */
    state->past[1280] = (known[71] - R(77.10450592914981)) / R(12.895494075093318); /* AR10_2 */
    state->past[1281] = (known[75] - R(82.27646622166749)) / R(7.72353377844243); /* ER10_2 */
    state->past[1282] = known[76]; /* LA_2 */
    state->past[1283] = known[77]; /* LB_2 */
    state->past[1284] = known[78]; /* LC_2 */
    state->past[1286] = known[68]; /* RL10_2 */
    state->past[1319] = known[71]; /* AR10_2 */
    state->past[1321] = known[71]; /* AR10_2 */
    state->past[1323] = known[71]; /* AR10_2 */
    state->past[1331] = known[75]; /* ER10_2 */
    state->past[1333] = known[75]; /* ER10_2 */
    outputs[0] = known[79]; /* BP */
    outputs[1] = known[80]; /* AR */
    outputs[2] = known[81]; /* BC */
    outputs[3] = known[84]; /* BC_spread */
    for (i = 0; i < 86; i++) {
        if (known[i] != known[i]) { /* only what is not a number differs from itself */
            flags |= STP_TO_BP_AR_BC_BC_SPREAD_NOT_A_NUMBER;
        }
    }
    return flags;
}

unsigned int stp_to_bp_ar_bc_bc_spread_run(stp_to_bp_ar_bc_bc_spread_state *state, size_t n, const real *inputs, real *outputs, unsigned int *flags)
{
    unsigned int raised = 0u;
    size_t i;

    for (i = 0; i < n; i++) {
        const unsigned int now = stp_to_bp_ar_bc_bc_spread_step(state, inputs + i * STP_TO_BP_AR_BC_BC_SPREAD_N_INPUTS, outputs + i * STP_TO_BP_AR_BC_BC_SPREAD_N_OUTPUTS);
        raised |= now;
        if (flags) {
            flags[i] = now;
        }
    }
    return raised;
}
