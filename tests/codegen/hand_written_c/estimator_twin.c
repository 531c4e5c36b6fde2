/* estimator_twin: see estimator_twin.h.  Needs IEEE single precision without contraction
 * (-ffp-contract=off, no -ffast-math): every operation, its order and its association are those of
 * the normative operation list.  "Bits:" comments say why a shortened expression keeps all bits. */
#include "estimator_twin.h"

#include <math.h>   /* fabsf only */
#include <string.h> /* memcpy only, of 4 bytes */

#if defined(__GNUC__)
#define LIKELY(c)   (__builtin_expect((c), 1))
#define UNLIKELY(c) (__builtin_expect((c), 0))
#define RARE        __attribute__((noinline)) /* kept out of the hot code; not `cold`: that means -Os */
#define INLINE      static inline __attribute__((always_inline))
#else
#define LIKELY(c)   (c)
#define UNLIKELY(c) (c)
#define RARE
#define INLINE      static inline
#endif

#define DRIVE ESTIMATOR_TWIN_DRIVE
#define GAP   ESTIMATOR_TWIN_GAP
#define COAST ESTIMATOR_TWIN_COAST

/* ---- fixed numbers ------------------------------------------------------------------------- */

#define PERIOD 0.00100000005F /* s */
#define MERGE  4.88281273e-07F /* s: crossings closer than this are one instant */
#define HALVINGS 24
#define TERMS  8 /* of the Taylor sum of a partial period */
#define PIECES 5  /* of one period: `events: 4` and the rest */

#define ALPHA           0.0255999994F   /* half of the gap */
#define K_HS            4800.0F
#define C_HS            14.0F
#define K_HS_PER_C_HS   342.857147F
#define K_HS_PER_J_V    44.4753304F
#define R               8.10000038F
#define PER_R           0.123456784F
#define PER_J_V         0.00926569384F
#define B_EM            0.00200000009F
#define B_W             0.200000003F
#define A_AER_R_W_CUBED 0.00921904016F
#define M_G_R_W         3556.12524F
#define C_0             0.00999999978F
#define C_1             9.99999975e-06F
#define C_2             1.00000001e-07F
#define STAMP_J_EM      0.0500000007F

/* ranges */
#define W_EM_LOW     (-400.0F)
#define W_EM_HIGH    2400.0F
#define W_W_LOW      (-50.0F)
#define W_W_HIGH     300.0F
#define T_EM_MOST    400.0F
#define T_BR_HIGH    3000.0F
#define THETA_D_MOST 0.5F
#define THETA_B_MOST 0.200000003F

/* Kalman filter in contact, the same for both flanks.  Rows _TD_ theta_d, _WEM_ w_em, _WW_ w_w. */
#define PHI_TD_TD      0.999247372F
#define PHI_TD_WEM     0.00012315232F
#define PHI_TD_WW      (-0.000997549389F)
#define PHI_WEM_TD     (-11.8226233F)
#define PHI_WEM_WEM    0.994972527F
#define PHI_WEM_WW     0.0403989069F
#define PHI_WW_TD      0.0443663411F
#define PHI_WW_WEM     1.8716195e-05F
#define PHI_WW_WW      0.999839425F
#define GAMMA_TD_T_EM  1.23258894e-06F
#define GAMMA_TD_T_BR  4.6254689e-09F
#define GAMMA_WEM_T_EM 0.0199521203F
#define GAMMA_WEM_T_BR (-1.78171518e-07F)
#define GAMMA_WW_T_EM  1.78171518e-07F
#define GAMMA_WW_T_BR  (-9.26498433e-06F)
#define G_TD_WEM       6.162945e-08F
#define G_TD_WW        (-4.99203736e-07F)
#define G_WEM_WEM      0.000997606083F
#define G_WEM_WW       1.92291591e-05F
#define G_WW_WEM       8.9085761e-09F
#define G_WW_WW        0.00099992333F
#define L_TD_Y_EM      (-0.000819160428F)
#define L_TD_Y_W       0.000237290442F
#define L_WEM_Y_EM     0.223643944F
#define L_WEM_Y_W      (-0.0115166651F)
#define L_WW_Y_EM      (-0.000319907354F)
#define L_WW_Y_W       0.0177458394F
#define F_WW           (-0.19926697F)

/* Driveline in the gap: A, and for a whole (E, F) and half (EH, FH) period exp(A h) and its
 * integral.  Rows _T_ are shared by theta_d and theta_b; A theta_d = w_em / R - w_w. */
#define GAP_A_WW    (-0.00218263851F)
#define GAP_A_WEM   (-0.0400000028F)
#define GAP_A_TB    342.857147F /* theta_d; theta_b: its negative */
#define GAP_EH_WW   0.999998927F
#define GAP_EH_WEM  0.999979973F
#define GAP_EH_T_WW (-0.000499999733F)
#define GAP_EH_T_WEM 6.17277765e-05F
#define GAP_EH_TB_TD 0.157539561F
#define GAP_EH_TB_TB 0.842460454F
#define GAP_FH_WW   0.000499999733F
#define GAP_FH_WEM  0.000499995018F
#define GAP_FH_T_WW (-1.24999957e-07F)
#define GAP_FH_T_WEM 1.54319952e-08F
#define GAP_E_WW    0.999997795F
#define GAP_E_WEM   0.999960005F
#define GAP_E_T_WW  (-0.000999998883F)
#define GAP_E_T_WEM 0.000123454316F
#define GAP_E_TB_TD 0.290260404F
#define GAP_E_TB_TB 0.709739625F
#define GAP_F_WW    0.000999998883F
#define GAP_F_WEM   0.000999980024F
#define GAP_F_T_WW  (-4.99999658e-07F)
#define GAP_F_T_WEM 6.17275688e-08F

/* Driveline on a flank, the same for both. */
#define CON_A_WW_WW   (-0.131902352F)
#define CON_A_WW_WEM  0.016014779F
#define CON_A_WW_TD   44.4753304F
#define CON_A_WW_TB   (-44.4753304F)
#define CON_A_WEM_WW  34.5678978F
#define CON_A_WEM_WEM (-4.30764151F)
#define CON_A_WEM_TD  (-11851.8516F)
#define CON_A_WEM_TB  11851.8516F

/* ---- ranges: a value inside passes, else its fault bit is set and it gets the nearest bound,
 *      NaN the lower one ---------------------------------------------------------------------- */

INLINE uint32_t bits_of(float x)
{
    uint32_t u;

    memcpy(&u, &x, sizeof u);
    return u;
}

/* low <= x <= high, for low <= 0 <= high; false for NaN.  In whole numbers: bit patterns of the
 * same sign are ordered as their magnitudes, NaN last.  One comparison where x >= +0, the usual. */
INLINE bool is_between(float x, float low, float high)
{
    const uint32_t u = bits_of(x);

    return LIKELY(u <= bits_of(high)) || ((u - 0x80000000U) <= bits_of(fabsf(low)));
}

#define HOLD_IN(self, x, low, high, bit)                                                          \
    do {                                                                                          \
        if (UNLIKELY(!is_between((x), (low), (high)))) {                                          \
            (self)->faults |= (bit);                                                              \
            (x) = ((x) > (high)) ? (high) : (low);                                                \
        }                                                                                         \
    } while (0)

/* fabsf(x) <= most is -most <= x <= most, false for NaN */
#define HOLD_WITHIN(self, x, most, bit)                                                           \
    do {                                                                                          \
        if (UNLIKELY(!(fabsf(x) <= (most)))) {                                                    \
            (self)->faults |= (bit);                                                              \
            (x) = ((x) > (most)) ? (most) : -(most);                                              \
        }                                                                                         \
    } while (0)

/* ---- the driveline's flow ------------------------------------------------------------------ */

/* states of the driveline, and derivatives of them */
typedef struct {
    float w_w, w_em, theta_d, theta_b;
} point;

typedef struct {
    float w_w, w_em;
} accelerations;

/* What the linear part A leaves of the flow: rate - A * state.  The angles flow as A says. */
typedef accelerations pull;

/* driveline equations.T_aer, T_rr, T_v and flow.w_w, w_em.
 * Bits: T_v ends with + m*g*r_w*sin(0) = + 0, which T_aer >= +0 makes an identity. */
INLINE accelerations accelerate(const estimator_twin *self, float w_w, float w_em, float T_hs)
{
    const float w_w_squared = w_w * w_w;
    const float T_aer = A_AER_R_W_CUBED * w_w_squared;
    const float T_rr = M_G_R_W * ((C_0 + (C_1 * w_w)) + (C_2 * w_w_squared));
    const float T_v = T_aer + T_rr;
    accelerations rate;

    rate.w_w = (((T_hs - T_v) - self->before_T_br) - (B_W * w_w)) * PER_J_V;
    rate.w_em = ((self->before_T_em - (T_hs * PER_R)) - (B_EM * w_em)) * self->per_J_em;
    return rate;
}

/* driveline equations.w_d */
INLINE float twist_rate(const point *x)
{
    return (x->w_em * PER_R) - x->w_w;
}

/* Gap: rate - A * x, with T_hs of x at hand. */
INLINE pull pull_in_gap(const estimator_twin *self, const point *x, float T_hs)
{
    const accelerations rate = accelerate(self, x->w_w, x->w_em, T_hs);
    pull p;

    p.w_w = rate.w_w - (GAP_A_WW * x->w_w);
    p.w_em = rate.w_em - (GAP_A_WEM * x->w_em);
    return p;
}

/* The same from the states alone (driveline modes.no_contact). */
INLINE pull pull_in_gap_at(const estimator_twin *self, const point *x)
{
    const float w_d = twist_rate(x);
    const float stretch = x->theta_d - x->theta_b;
    const float w_b = w_d + (K_HS_PER_C_HS * stretch);
    const float T_hs = (K_HS * stretch) + (C_HS * (w_d - w_b));

    return pull_in_gap(self, x, T_hs);
}

/* Half and whole period of the gap flow from x under a constant pull: E * x + F * pull.
 * Bits: theta_d and theta_b share the leading products and those with pull. */
INLINE point half_period_in_gap(const point *x, const pull *p)
{
    const float glide = (GAP_EH_T_WW * x->w_w) + (GAP_EH_T_WEM * x->w_em);
    const float by_w_w = GAP_FH_T_WW * p->w_w;
    const float by_w_em = GAP_FH_T_WEM * p->w_em;
    point at;

    at.w_w = (GAP_EH_WW * x->w_w) + (GAP_FH_WW * p->w_w);
    at.w_em = (GAP_EH_WEM * x->w_em) + (GAP_FH_WEM * p->w_em);
    at.theta_d = ((glide + x->theta_d) + by_w_w) + by_w_em;
    at.theta_b = (((glide + (GAP_EH_TB_TD * x->theta_d)) + (GAP_EH_TB_TB * x->theta_b)) + by_w_w) + by_w_em;
    return at;
}

INLINE point period_in_gap(const point *x, const pull *p)
{
    const float glide = (GAP_E_T_WW * x->w_w) + (GAP_E_T_WEM * x->w_em);
    const float by_w_w = GAP_F_T_WW * p->w_w;
    const float by_w_em = GAP_F_T_WEM * p->w_em;
    point at;

    at.w_w = (GAP_E_WW * x->w_w) + (GAP_F_WW * p->w_w);
    at.w_em = (GAP_E_WEM * x->w_em) + (GAP_F_WEM * p->w_em);
    at.theta_d = ((glide + x->theta_d) + by_w_w) + by_w_em;
    at.theta_b = (((glide + (GAP_E_TB_TD * x->theta_d)) + (GAP_E_TB_TB * x->theta_b)) + by_w_w) + by_w_em;
    return at;
}

/* Flank: rows of A * x, where theta_b is an angle or (in the series) the +0 of its derivatives.
 * Bits: x - 44.47 * 0 is x. */
INLINE float contact_w_w(const point *x, float by_theta_b)
{
    return (((CON_A_WW_WW * x->w_w) + (CON_A_WW_WEM * x->w_em)) + (CON_A_WW_TD * x->theta_d)) + by_theta_b;
}

INLINE float contact_w_em(const point *x, float by_theta_b)
{
    return (((CON_A_WEM_WW * x->w_w) + (CON_A_WEM_WEM * x->w_em)) + (CON_A_WEM_TD * x->theta_d)) + by_theta_b;
}

/* Flank: rate - A * x, with T_hs of x at hand. */
static pull pull_on_flank(const estimator_twin *self, const point *x, float T_hs)
{
    const accelerations rate = accelerate(self, x->w_w, x->w_em, T_hs);
    pull p;

    p.w_w = rate.w_w - contact_w_w(x, CON_A_WW_TB * x->theta_b);
    p.w_em = rate.w_em - contact_w_em(x, CON_A_WEM_TB * x->theta_b);
    return p;
}

/* The same from the states alone (driveline modes.drive_contact, coast_contact); w_b = 0. */
static pull pull_on_flank_at(const estimator_twin *self, const point *x)
{
    return pull_on_flank(self, x, (K_HS * (x->theta_d - x->theta_b)) + (C_HS * twist_rate(x)));
}

/* Half and whole period on a flank.  theta_b is +-alpha and stays there.
 * Bits: its factor in E is 1. */
static point half_period_on_flank(const point *x, const pull *p)
{
    point at;

    at.w_w = (((((0.999928594F * x->w_w) + (8.6838254e-06F * x->w_em)) + (0.0222118292F * x->theta_d))
               + (-0.0222118292F * x->theta_b)) + (0.00049998262F * p->w_w)) + (2.1146298e-09F * p->w_em);
    at.w_em = (((((0.0187440347F * x->w_w) + (0.997665942F * x->w_em)) + (-5.91898489F * x->theta_d))
                + (5.91898489F * x->theta_b)) + (4.56442831e-06F * p->w_w)) + (0.00049943151F * p->w_em);
    at.theta_d = (((((-0.000499419111F * x->w_w) + (6.16560937e-05F * x->w_em)) + (0.999811709F * x->theta_d))
                   + (0.000188313163F * x->theta_b)) + (-1.24904474e-07F * p->w_w)) + (1.54202073e-08F * p->w_em);
    at.theta_b = x->theta_b;
    return at;
}

static point period_on_flank(const point *x, const pull *p)
{
    point at;

    at.w_w = (((((0.99984622F * x->w_w) + (1.8716255e-05F * x->w_em)) + (0.0443664901F * x->theta_d))
               + (-0.0443664901F * x->theta_b)) + (0.000999926706F * p->w_w)) + (8.90859564e-09F * p->w_em);
    at.w_em = (((((0.0403990373F * x->w_w) + (0.994972527F * x->w_em)) + (-11.8226233F * x->theta_d))
                + (11.8226233F * x->theta_b)) + (1.92292027e-05F * p->w_w)) + (0.000997606083F * p->w_em);
    at.theta_d = (((((-0.000997552765F * x->w_w) + (0.00012315232F * x->w_em)) + (0.999247372F * x->theta_d))
                   + (0.000752625347F * x->theta_b)) + (-4.99204873e-07F * p->w_w)) + (6.162945e-08F * p->w_em);
    at.theta_b = x->theta_b;
    return at;
}

/* ---- partial periods: Taylor sums ---------------------------------------------------------- */

/* x(s) = x + s * (c[0] + s * (c[1] + ...)) with c[i] = A^i (A x + pull) / (i + 1)! */
typedef struct {
    float w_w[TERMS], w_em[TERMS], theta_d[TERMS], theta_b[TERMS];
} series;

/* Term i from the one before; written out, for division by 2, 4 and 8 is a multiplication then. */
INLINE void next_in_gap(series *c, int i, float order)
{
    const float w_d = (c->w_em[i - 1] * PER_R) - c->w_w[i - 1];

    c->w_w[i] = (GAP_A_WW * c->w_w[i - 1]) / order;
    c->w_em[i] = (GAP_A_WEM * c->w_em[i - 1]) / order;
    c->theta_d[i] = w_d / order;
    c->theta_b[i] = ((w_d + (GAP_A_TB * c->theta_d[i - 1])) - (GAP_A_TB * c->theta_b[i - 1])) / order;
}

/* Bits: A has rows (-1, 1/R) for theta_d and (-1, 1/R, k/c, -k/c) for theta_b, so A * x starts with
 * w_d itself. */
static void expand_in_gap(series *c, const point *x, const pull *p)
{
    const float w_d = twist_rate(x);

    c->w_w[0] = (GAP_A_WW * x->w_w) + p->w_w;
    c->w_em[0] = (GAP_A_WEM * x->w_em) + p->w_em;
    c->theta_d[0] = w_d;
    c->theta_b[0] = (w_d + (GAP_A_TB * x->theta_d)) - (GAP_A_TB * x->theta_b);
    next_in_gap(c, 1, 2.0F);
    next_in_gap(c, 2, 3.0F);
    next_in_gap(c, 3, 4.0F);
    next_in_gap(c, 4, 5.0F);
    next_in_gap(c, 5, 6.0F);
    next_in_gap(c, 6, 7.0F);
    next_in_gap(c, 7, 8.0F);
}

INLINE void next_on_flank(series *c, int i, float order)
{
    const point a = {c->w_w[i - 1], c->w_em[i - 1], c->theta_d[i - 1], 0.0F};

    c->w_w[i] = contact_w_w(&a, -0.0F) / order;
    c->w_em[i] = contact_w_em(&a, 0.0F) / order;
    c->theta_d[i] = twist_rate(&a) / order;
}

/* theta_b does not move on a flank: its terms are all +0 and not kept (x + s * 0 is x). */
static void expand_on_flank(series *c, const point *x, const pull *p)
{
    c->w_w[0] = contact_w_w(x, CON_A_WW_TB * x->theta_b) + p->w_w;
    c->w_em[0] = contact_w_em(x, CON_A_WEM_TB * x->theta_b) + p->w_em;
    c->theta_d[0] = twist_rate(x);
    next_on_flank(c, 1, 2.0F);
    next_on_flank(c, 2, 3.0F);
    next_on_flank(c, 3, 4.0F);
    next_on_flank(c, 4, 5.0F);
    next_on_flank(c, 5, 6.0F);
    next_on_flank(c, 6, 7.0F);
    next_on_flank(c, 7, 8.0F);
}

/* one state after s */
INLINE float sum(const float *c, float x, float s)
{
    return x + (s * ((((((((((((((c[7] * s) + c[6]) * s) + c[5]) * s) + c[4]) * s) + c[3]) * s) + c[2]) * s)
                       + c[1]) * s) + c[0]));
}

/* w_w, w_em and theta_d after s */
RARE static void point_at(point *at, const series *c, const point *x, float s)
{
    at->w_w = sum(c->w_w, x->w_w, s);
    at->w_em = sum(c->w_em, x->w_em, s);
    at->theta_d = sum(c->theta_d, x->theta_d, s);
}

/* ---- crossings ----------------------------------------------------------------------------- */

/* driveline equations.w_free */
INLINE float w_free(const point *x)
{
    return twist_rate(x) + (K_HS_PER_C_HS * (x->theta_d - x->theta_b));
}

/* The flank that is met (driveline modes.no_contact.transitions), else GAP. */
INLINE int32_t flank_met(const point *x)
{
    if ((x->theta_b >= ALPHA) && (w_free(x) > 0.0F)) {
        return DRIVE;
    }
    if ((x->theta_b <= -ALPHA) && (w_free(x) < 0.0F)) {
        return COAST;
    }
    return GAP;
}

/* driveline modes.drive_contact, coast_contact.transitions.no_contact */
INLINE bool flank_left(const point *x, int32_t flank)
{
    return (flank == DRIVE) ? (w_free(x) < 0.0F) : (w_free(x) > 0.0F);
}

/* flank_met() of the gap flow after s.  Points inside the gap need theta_b alone. */
INLINE int32_t flank_met_at(point *at, const series *c, const point *x, float s)
{
    at->theta_b = sum(c->theta_b, x->theta_b, s);
    if (!(fabsf(at->theta_b) >= ALPHA)) {
        return GAP;
    }
    point_at(at, c, x, s);
    return flank_met(at);
}

/* One piece of the period: the states at its begin, its end; the pull of its second half. */
typedef struct {
    point x, end;
    pull p;
} piece;

/* Where the gap is left within h: q->end, the time until there; *met: the flank met at q->end, before
 * and after.  Bits: only points where a guard held are kept, so the list's guards there are known;
 * one evaluation more of the kept point would give the same states. */
RARE static float locate_in_gap(piece *q, const series *c, float h, int32_t *met)
{
    point at;
    float low = 0.0F;
    float high = h;
    int32_t first = GAP; /* the flank met at high, by the sums */
    int32_t later;       /* and one MERGE later */
    int i;

    for (i = 0; i < HALVINGS; i++) {
        const float s = low + (0.5F * (high - low));
        const int32_t which = flank_met_at(&at, c, &q->x, s);

        if (which != GAP) {
            high = s;
            q->end = at;
            first = which;
        } else {
            low = s;
        }
    }
    if (first != GAP) {
        *met = first;
    } else { /* never met: the end of the step is kept, but the sums are asked there */
        first = flank_met_at(&at, c, &q->x, high);
    }
    later = flank_met_at(&at, c, &q->x, high + MERGE);
    if ((later != GAP) && (later != first)) {
        high = high + MERGE;
        q->end = at;
        *met = later;
    }
    return (high < h) ? high : h;
}

/* Where the flank is left within h: q->end, the time until there.  Bits: the guard holds there. */
RARE static float locate_on_flank(piece *q, const series *c, float h, int32_t flank)
{
    point at;
    float low = 0.0F;
    float high = h;
    int i;

    at.theta_b = q->x.theta_b;
    for (i = 0; i < HALVINGS; i++) {
        const float s = low + (0.5F * (high - low));

        point_at(&at, c, &q->x, s);
        if (flank_left(&at, flank)) {
            high = s;
            q->end = at;
        } else {
            low = s;
        }
    }
    return high;
}

/* estimator modes.gap.runs: the rest of a period in which the driveline changes its mode, or is
 * not in its gap.  x is the begin of the period; in the gap end and p are those of the whole period,
 * known to cross: at end the flank `met` is met.  Returns the end of the period. */
RARE static point run_through_events(estimator_twin *self, point x, point end, pull p, int32_t met)
{
    piece whole;
    piece *const q = &whole;
    series c;
    float h = PERIOD; /* left of the period */
    bool crossed = true;
    int event;

    q->x = x;
    q->end = end;
    q->p = p;
    if (self->run_mode == GAP) {
        expand_in_gap(&c, &q->x, &q->p);
    } else {
        q->p = pull_on_flank(self, &q->x, self->T_hs);
        q->end = half_period_on_flank(&q->x, &q->p);
        q->p = pull_on_flank_at(self, &q->end);
        q->end = period_on_flank(&q->x, &q->p);
        crossed = flank_left(&q->end, self->run_mode);
        if (crossed) {
            expand_on_flank(&c, &q->x, &q->p);
        }
    }

    for (event = 0; crossed; event++) {
        if (self->run_mode == GAP) {
            h = h - locate_in_gap(q, &c, h, &met);
        } else {
            met = GAP;
            h = h - locate_on_flank(q, &c, h, self->run_mode);
        }
        if (event == PIECES - 1) {
            self->faults |= ESTIMATOR_TWIN_FAULT_EVENT_LIMIT;
            break;
        }
        self->run_mode = met;
        if (met != GAP) { /* driveline modes.no_contact.transitions.*.reset.theta_b */
            q->end.theta_b = (met == DRIVE) ? ALPHA : -ALPHA;
        }
        if (!(h > 0.0F)) {
            break;
        }

        /* the rest h of the period as one more piece: midpoint with Taylor sums */
        q->x = q->end;
        if (self->run_mode == GAP) {
            q->p = pull_in_gap_at(self, &q->x);
            expand_in_gap(&c, &q->x, &q->p);
            q->end.theta_b = sum(c.theta_b, q->x.theta_b, 0.5F * h);
            point_at(&q->end, &c, &q->x, 0.5F * h);
            q->p = pull_in_gap_at(self, &q->end);
            expand_in_gap(&c, &q->x, &q->p);
            q->end.theta_b = sum(c.theta_b, q->x.theta_b, h);
            point_at(&q->end, &c, &q->x, h);
            met = flank_met(&q->end);
            crossed = (met != GAP);
        } else {
            q->p = pull_on_flank_at(self, &q->x);
            expand_on_flank(&c, &q->x, &q->p);
            point_at(&q->end, &c, &q->x, 0.5F * h);
            q->p = pull_on_flank_at(self, &q->end);
            expand_on_flank(&c, &q->x, &q->p);
            point_at(&q->end, &c, &q->x, h);
            crossed = flank_left(&q->end, self->run_mode);
        }
    }
    return q->end;
}

/* ---- torques: they act from now to the next tick, so the tick itself ends with them ---------- */

INLINE void latch_torques(estimator_twin *self, const estimator_twin_in *in)
{
    float T_em = in->T_em;
    float T_br = in->T_br;

    HOLD_WITHIN(self, T_em, T_EM_MOST, ESTIMATOR_TWIN_FAULT_RANGE_T_EM);
    HOLD_IN(self, T_br, 0.0F, T_BR_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_T_BR);
    self->latched_T_em = T_em;
    self->latched_T_br = T_br;
    self->before_T_em = T_em;
    self->before_T_br = T_br;
}

/* ---- a tick in the gap --------------------------------------------------------------------- */

/* timer.gap_* and the transitions gap -> drive, coast.  Returns the mode after the jump.
 * Bits: the equations of drive and coast give what those of gap give on a flank (w_b = 0). */
RARE static int32_t jump_from_gap(estimator_twin *self)
{
    int32_t *const timer = (self->run_mode == DRIVE) ? &self->gap_drive : &self->gap_coast;

    if (self->run_mode == DRIVE) {
        self->gap_coast = 0;
    } else {
        self->gap_drive = 0;
    }
    *timer += 1;
    if (*timer <= 1) { /* wait: 1 further tick */
        return GAP;
    }
    *timer = 0;
    self->mode = self->run_mode;
    self->fired = (self->run_mode == DRIVE) ? 2 : 3;
    return self->run_mode;
}

/* Advance by the driveline's gap flow, then jump.  T_hs of the tick before is that of the states
 * that the flow starts from. */
RARE static void tick_in_gap(estimator_twin *self, const estimator_twin_in *in, estimator_twin_out *out)
{
    point x, end;
    int32_t mode = GAP;
    float w_d, w_b, stretch, T_hs;

    x.w_w = self->w_w;
    x.w_em = self->w_em;
    x.theta_d = self->theta_d;
    x.theta_b = self->theta_b;
    self->innovation_y_em = 0.0F;
    self->innovation_y_w = 0.0F;
    self->fired = 0;

    if (self->run_mode == GAP) {
        const pull first = pull_in_gap(self, &x, self->T_hs);
        const point middle = half_period_in_gap(&x, &first);
        const pull second = pull_in_gap_at(self, &middle);

        end = period_in_gap(&x, &second);
        if (UNLIKELY(!(fabsf(end.theta_b) < ALPHA))) {
            const int32_t met = flank_met(&end);

            if (met != GAP) {
                end = run_through_events(self, x, end, second, met);
            }
        }
    } else {
        end = run_through_events(self, x, x, (pull){0}, GAP);
    }

    HOLD_IN(self, end.w_w, W_W_LOW, W_W_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_W_W);
    HOLD_IN(self, end.w_em, W_EM_LOW, W_EM_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_W_EM);
    HOLD_WITHIN(self, end.theta_d, THETA_D_MOST, ESTIMATOR_TWIN_FAULT_RANGE_THETA_D);
    HOLD_WITHIN(self, end.theta_b, THETA_B_MOST, ESTIMATOR_TWIN_FAULT_RANGE_THETA_B);
    self->w_w = end.w_w;
    self->w_em = end.w_em;
    self->theta_d = end.theta_d;
    self->theta_b = end.theta_b;

    /* equations of mode gap */
    w_d = twist_rate(&end);
    stretch = end.theta_d - end.theta_b;
    w_b = 0.0F;
    if (self->run_mode == GAP) {
        w_b = w_d + (K_HS_PER_C_HS * stretch);
        self->gap_drive = 0;
        self->gap_coast = 0;
    } else {
        mode = jump_from_gap(self);
    }
    T_hs = (K_HS * stretch) + (C_HS * (w_d - w_b));
    self->w_d = w_d;
    self->w_b = w_b;
    self->T_hs = T_hs;

    out->mode = mode;
    out->theta_b = end.theta_b;
    out->w_b = w_b;
    out->theta_d = end.theta_d;
    out->w_d = w_d;
    out->T_hs = T_hs;

    latch_torques(self, in);
}

/* ---- a tick on a flank --------------------------------------------------------------------- */

/* Predict (but at the first tick), correct, jump.  theta_b is +-alpha in these modes and stays:
 * what the offset f adds is known since init. */
INLINE void tick_on_flank(estimator_twin *self, int32_t mode, float y_em, float y_w,
                          const estimator_twin_in *in, estimator_twin_out *out)
{
    float theta_d = self->theta_d;
    float w_em = self->w_em;
    float w_w = self->w_w;
    float w_d, T_hs;
    float w_b = 0.0F;
    bool slack;
    int32_t *timer;

    if (LIKELY(self->started)) {
        /* estimator modes.{drive,coast}.observer: Phi x + Gamma u + G f */
        const estimator_twin_offset *const f = (mode == DRIVE) ? &self->offset_drive : &self->offset_coast;
        const float T_em = self->before_T_em;
        const float T_br = self->before_T_br;
        float next_theta_d = ((((((PHI_TD_TD * theta_d) + (PHI_TD_WEM * w_em)) + (PHI_TD_WW * w_w))
                                + (GAMMA_TD_T_EM * T_em)) + (GAMMA_TD_T_BR * T_br))
                              + f->theta_d_by_w_em) + f->theta_d_by_w_w;
        float next_w_em = ((((((PHI_WEM_TD * theta_d) + (PHI_WEM_WEM * w_em)) + (PHI_WEM_WW * w_w))
                             + (GAMMA_WEM_T_EM * T_em)) + (GAMMA_WEM_T_BR * T_br))
                           + f->w_em_by_w_em) + f->w_em_by_w_w;
        float next_w_w = ((((((PHI_WW_TD * theta_d) + (PHI_WW_WEM * w_em)) + (PHI_WW_WW * w_w))
                            + (GAMMA_WW_T_EM * T_em)) + (GAMMA_WW_T_BR * T_br))
                          + f->w_w_by_w_em) + f->w_w_by_w_w;

        HOLD_WITHIN(self, next_theta_d, THETA_D_MOST, ESTIMATOR_TWIN_FAULT_RANGE_THETA_D);
        HOLD_IN(self, next_w_em, W_EM_LOW, W_EM_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_W_EM);
        HOLD_IN(self, next_w_w, W_W_LOW, W_W_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_W_W);
        theta_d = next_theta_d;
        w_em = next_w_em;
        w_w = next_w_w;
    } else { /* first tick: initial values; the latched speeds are in the range already */
        theta_d = ALPHA;
        w_em = y_em;
        w_w = y_w;
        self->theta_b = ALPHA;
        self->started = true;
    }

    { /* correction: x + L (y - C x) */
        const float i_em = in->is_new_y_em ? (y_em - w_em) : 0.0F;
        const float i_w = in->is_new_y_w ? (y_w - w_w) : 0.0F;

        self->innovation_y_em = i_em;
        self->innovation_y_w = i_w;
        theta_d = theta_d + ((L_TD_Y_EM * i_em) + (L_TD_Y_W * i_w));
        w_em = w_em + ((L_WEM_Y_EM * i_em) + (L_WEM_Y_W * i_w));
        w_w = w_w + ((L_WW_Y_EM * i_em) + (L_WW_Y_W * i_w));
        HOLD_WITHIN(self, theta_d, THETA_D_MOST, ESTIMATOR_TWIN_FAULT_RANGE_THETA_D);
        HOLD_IN(self, w_em, W_EM_LOW, W_EM_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_W_EM);
        HOLD_IN(self, w_w, W_W_LOW, W_W_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_W_W);
        self->theta_d = theta_d;
        self->w_em = w_em;
        self->w_w = w_w;
    }

    /* equations w_d, T_hs with w_b = 0; the flank is slack once T_hs has the other sign or is 0 */
    w_d = (w_em * PER_R) - w_w;
    {
        const float stretch = theta_d - self->theta_b;

        T_hs = (K_HS * stretch) + (C_HS * w_d);
        if (mode == DRIVE) {
            timer = &self->drive_gap;
            slack = (T_hs <= 0.0F);
        } else {
            timer = &self->coast_gap;
            slack = (T_hs >= 0.0F);
        }
        self->fired = 0;
        if (UNLIKELY(slack)) {
            const int32_t ticks = *timer + 1;

            *timer = ticks;
            if (ticks > 1) { /* wait: 1 further tick, then the transition to gap */
                *timer = 0;
                self->fired = (mode == DRIVE) ? 1 : 4;
                mode = GAP;
                self->mode = GAP;
                self->run_mode = GAP;
                w_b = w_d + (K_HS_PER_C_HS * stretch);
                T_hs = (K_HS * stretch) + (C_HS * (w_d - w_b));
            }
        } else {
            *timer = 0;
        }
    }
    self->w_d = w_d;
    self->w_b = w_b;
    self->T_hs = T_hs;

    out->mode = mode;
    out->theta_b = self->theta_b;
    out->w_b = w_b;
    out->theta_d = theta_d;
    out->w_d = w_d;
    out->T_hs = T_hs;

    latch_torques(self, in);
}

/* ---- the automaton ------------------------------------------------------------------------- */

/* estimator modes.{drive,coast}.observer.f, with theta_b at its flank */
static estimator_twin_offset offset_at(float theta_b, float k_hs_per_R_per_J_em)
{
    const float f_w_em = k_hs_per_R_per_J_em * theta_b;
    const float f_w_w = (-(K_HS_PER_J_V * theta_b)) + F_WW;
    estimator_twin_offset f;

    f.theta_d_by_w_em = G_TD_WEM * f_w_em;
    f.theta_d_by_w_w = G_TD_WW * f_w_w;
    f.w_em_by_w_em = G_WEM_WEM * f_w_em;
    f.w_em_by_w_w = G_WEM_WW * f_w_w;
    f.w_w_by_w_em = G_WW_WEM * f_w_em;
    f.w_w_by_w_w = G_WW_WW * f_w_w;
    return f;
}

void estimator_twin_init(estimator_twin *self, const estimator_twin_cal *cal)
{
    const float k_hs_per_R_per_J_em = (K_HS / R) / cal->J_em;

    *self = (estimator_twin){0};
    self->mode = DRIVE;
    self->per_J_em = 1.0F / cal->J_em;
    self->offset_drive = offset_at(ALPHA, k_hs_per_R_per_J_em);
    self->offset_coast = offset_at(-ALPHA, k_hs_per_R_per_J_em);
    if (cal->J_em != STAMP_J_EM) { /* Phi, Gamma, G, L, E, F were solved for another J_em */
        self->faults = ESTIMATOR_TWIN_FAULT_STALE_CALIBRATION;
    }
}

void estimator_twin_step(estimator_twin *self, const estimator_twin_cal *cal,
                         const estimator_twin_in *in, estimator_twin_out *out)
{
    float y_em = in->y_em;
    float y_w = in->y_w;
    const int32_t mode = self->mode;

    (void)cal; /* all that the step needs of it is in *self */

    HOLD_IN(self, y_em, W_EM_LOW, W_EM_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_Y_EM);
    HOLD_IN(self, y_w, W_W_LOW, W_W_HIGH, ESTIMATOR_TWIN_FAULT_RANGE_Y_W);
    self->latched_y_em = y_em;
    self->latched_y_w = y_w;

    if (mode == GAP) {
        tick_in_gap(self, in, out);
    } else {
        tick_on_flank(self, mode, y_em, y_w, in, out);
    }
}
