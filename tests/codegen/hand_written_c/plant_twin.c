/* plant_twin: see plant_twin.h.  Needs IEEE single precision without contraction
 * (-ffp-contract=off, no -ffast-math): every operation, its order and its association are those of
 * the normative operation list.  "Bits:" comments say why a shortened expression keeps all bits. */
#include "plant_twin.h"

#include <math.h> /* fabsf only */

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

#define DRIVE PLANT_TWIN_DRIVE_CONTACT
#define GAP   PLANT_TWIN_NO_CONTACT
#define COAST PLANT_TWIN_COAST_CONTACT

/* ---- fixed numbers ------------------------------------------------------------------------- */

#define MAJOR_STEP 0.000250000012F /* s */
#define MERGE      1.22070318e-07F /* s: crossings closer than this are one instant */
#define HALVINGS   24
#define PIECES     101 /* of one major step; more are a Zeno run */

#define R               8.10000038F
#define PER_R           0.123456784F
#define K_HS            4800.0F
#define C_HS            14.0F
#define K_HS_PER_C_HS   342.857147F
#define ALPHA           0.0255999994F /* half of the gap */
#define B_EM            0.00200000009F
#define B_W             0.200000003F
#define C_0             0.00999999978F
#define C_1             9.99999975e-06F
#define C_2             1.00000001e-07F
#define A_AER_R_W_CUBED 0.00921904016F
#define M_G_R_W         3556.12524F
#define PER_J_V         0.00926569384F
#define W_W_INITIAL     30.0F

/* ---- sin ----------------------------------------------------------------------------------- */

#define SIN_IS_X 0.000122070312F /* sin(x) is x below */
#define ROUNDER  12582912.0F     /* 1.5 * 2^23: adding and taking it away rounds to a whole number */

/* Reduction by quarter turns (three-part pi/2), then one of two series.  |x| >= SIN_IS_X. */
RARE static float sine(float x)
{
    const float bounded = (x > 1000.0F) ? 1000.0F : ((x < -1000.0F) ? -1000.0F : x);
    const float quarters = ((bounded * 0.636619747F) + ROUNDER) - ROUNDER;
    const float turns = (((0.25F * quarters) - 0.375F) + ROUNDER) - ROUNDER;
    const float quadrant = quarters - (4.0F * turns);
    const float coarse = bounded - (quarters * 1.57080078F);
    const float fine = quarters * -4.4554472e-06F;
    const float finer = quarters * 9.9225872e-10F;
    const float first = coarse - fine;
    const float lost = (coarse - first) - fine;
    const float head = first - finer;
    const float rest = (first - head) - finer;
    const float tail = (lost + rest) - (quarters * -1.65139956e-13F);
    const float square = head * head;
    const float half = 0.5F * square;
    const float crest = 1.0F - half;

    if ((quadrant < 0.5F) || ((quadrant >= 1.5F) && (quadrant < 2.5F))) {
        const float series = -0.166666538F + (square * (0.00833209604F + (square * -0.000195056273F)));
        const float y = head + ((tail * crest) + ((head * square) * series));

        return (quadrant < 0.5F) ? y : -y;
    } else {
        const float series = 0.0416666456F + (square * (-0.00138872885F + (square * 2.44282073e-05F)));
        const float y = crest + (((1.0F - crest) - half) + (((square * square) * series) - (head * tail)));

        return (quadrant < 1.5F) ? y : -y;
    }
}

/* ---- flow ---------------------------------------------------------------------------------- */

/* states, and derivatives of them */
typedef struct {
    float w_w, w_em, theta_d, theta_b;
} point;

/* equations.w_d, w_free and what they share with T_hs */
typedef struct {
    float w_d, stretch, w_free;
} twist;

INLINE twist twist_of(const point *x)
{
    twist t;

    t.w_d = (x->w_em * PER_R) - x->w_w;
    t.stretch = x->theta_d - x->theta_b;
    t.w_free = t.w_d + (K_HS_PER_C_HS * t.stretch);
    return t;
}

/* flow.w_w, w_em, theta_d, theta_b with T_hs and T_v at hand; w_b is 0 on a flank */
INLINE point rates(const plant_twin *self, float w_w, float w_em, float w_d, float w_b, float T_hs,
                   float T_v)
{
    point k;

    k.w_w = (((T_hs - T_v) - self->before_T_br) - (B_W * w_w)) * PER_J_V;
    k.w_em = ((self->before_T_em - (T_hs * PER_R)) - (B_EM * w_em)) * self->per_J_em;
    k.theta_d = w_d;
    k.theta_b = w_b;
    return k;
}

/* The same from the states alone. */
INLINE point rates_at(const plant_twin *self, const point *x, bool in_gap)
{
    const twist t = twist_of(x);
    const float w_w_squared = x->w_w * x->w_w;
    const float T_aer = A_AER_R_W_CUBED * w_w_squared;
    const float T_rr = M_G_R_W * ((C_0 + (C_1 * x->w_w)) + (C_2 * w_w_squared));
    const float T_v = (T_aer + T_rr) + self->before_m_g_r_w_sin_slope;
    const float w_b = in_gap ? t.w_free : 0.0F;
    const float T_hs = (K_HS * t.stretch) + (C_HS * (t.w_d - w_b));

    return rates(self, x->w_w, x->w_em, t.w_d, w_b, T_hs, T_v);
}

/* x + s * k.  Bits: theta_b is +-alpha on a flank and + s * 0 keeps it. */
INLINE point moved(const point *x, float s, const point *k, bool in_gap)
{
    point at;

    at.w_w = x->w_w + (s * k->w_w);
    at.w_em = x->w_em + (s * k->w_em);
    at.theta_d = x->theta_d + (s * k->theta_d);
    at.theta_b = in_gap ? (x->theta_b + (s * k->theta_b)) : x->theta_b;
    return at;
}

INLINE float mean4(float k1, float k2, float k3, float k4)
{
    return ((k1 + (2.0F * k2)) + (2.0F * k3)) + k4;
}

/* One Runge-Kutta step over h from x, where the rates are k1. */
INLINE point rk4(const plant_twin *self, const point *x, const point *k1, float h, bool in_gap)
{
    const float half_h = 0.5F * h;
    const float h_per_6 = h / 6.0F;
    point at, k2, k3, k4, slope;

    at = moved(x, half_h, k1, in_gap);
    k2 = rates_at(self, &at, in_gap);
    at = moved(x, half_h, &k2, in_gap);
    k3 = rates_at(self, &at, in_gap);
    at = moved(x, h, &k3, in_gap);
    k4 = rates_at(self, &at, in_gap);
    slope.w_w = mean4(k1->w_w, k2.w_w, k3.w_w, k4.w_w);
    slope.w_em = mean4(k1->w_em, k2.w_em, k3.w_em, k4.w_em);
    slope.theta_d = mean4(k1->theta_d, k2.theta_d, k3.theta_d, k4.theta_d);
    slope.theta_b = in_gap ? mean4(k1->theta_b, k2.theta_b, k3.theta_b, k4.theta_b) : 0.0F;
    return moved(x, h_per_6, &slope, in_gap);
}

/* ---- guards and jumps ---------------------------------------------------------------------- */

/* modes.no_contact.transitions: the flank that is met, else GAP */
INLINE int32_t flank_met(const point *x, float w_free)
{
    if ((x->theta_b >= ALPHA) && (w_free > 0.0F)) {
        return DRIVE;
    }
    if ((x->theta_b <= -ALPHA) && (w_free < 0.0F)) {
        return COAST;
    }
    return GAP;
}

/* modes.drive_contact, coast_contact.transitions.no_contact */
INLINE bool flank_left(int32_t flank, float w_free)
{
    return (flank == DRIVE) ? (w_free < 0.0F) : (w_free > 0.0F);
}

/* Any transition of the mode enabled? */
INLINE bool enabled(int32_t mode, const point *x, float w_free)
{
    return (mode == GAP) ? (flank_met(x, w_free) != GAP) : flank_left(mode, w_free);
}

/* The transitions at one instant.  One micro-step settles them: off a flank theta_b is +-alpha and
 * w_free points into the gap; on a flank the reset of theta_b can only increase |w_free|.  Hence no
 * livelock, all guards are false afterwards, armed_0 and armed_1 stay false, and `fired` ends as 0.
 * (So an input that jumps enables nothing either: guards read states alone.) */
INLINE void jump(plant_twin *self, point *x)
{
    const float w_free = twist_of(x).w_free;

    if (self->mode == GAP) {
        const int32_t met = flank_met(x, w_free);

        if (met != GAP) {
            x->theta_b = (met == DRIVE) ? ALPHA : -ALPHA;
            self->mode = met;
        }
    } else if (flank_left(self->mode, w_free)) {
        self->mode = GAP;
    }
}

/* ---- location of crossings ----------------------------------------------------------------- */

/* x(s) = x + s * (k1 + s * (c1 + s * c2)): the cubic through both ends and their rates */
typedef struct {
    point c1, c2;
} cubic;

typedef struct {
    point x, k1, end; /* a step over h from x, with the rates k1 there, to end */
} piece;

INLINE void fit(float *c1, float *c2, float x, float k1, float end, float rate, float h, float h_squared)
{
    const float slope = (end - x) / h;

    *c1 = (((3.0F * slope) - (2.0F * k1)) - rate) / h;
    *c2 = ((k1 + rate) - (2.0F * slope)) / h_squared;
}

INLINE float value(float x, float k1, float c1, float c2, float s)
{
    return x + (s * ((((c2 * s) + c1) * s) + k1));
}

/* w_w, w_em and theta_d after s */
INLINE void point_at(point *at, const piece *q, const cubic *c, float s)
{
    at->w_w = value(q->x.w_w, q->k1.w_w, c->c1.w_w, c->c2.w_w, s);
    at->w_em = value(q->x.w_em, q->k1.w_em, c->c1.w_em, c->c2.w_em, s);
    at->theta_d = value(q->x.theta_d, q->k1.theta_d, c->c1.theta_d, c->c2.theta_d, s);
}

/* flank_met() after s.  Points inside the gap need theta_b alone; else *at is complete. */
INLINE int32_t flank_met_at(point *at, const piece *q, const cubic *c, float s)
{
    at->theta_b = value(q->x.theta_b, q->k1.theta_b, c->c1.theta_b, c->c2.theta_b, s);
    if (fabsf(at->theta_b) < ALPHA) {
        return GAP;
    }
    point_at(at, q, c, s);
    return flank_met(at, twist_of(at).w_free);
}

/* Where the piece leaves its mode: moves q->end there and returns the time until then. */
static float locate(const plant_twin *self, piece *q, float h)
{
    const bool in_gap = (self->mode == GAP);
    const point rate = rates_at(self, &q->end, in_gap);
    const float h_squared = h * h;
    point at;
    cubic c;
    float low = 0.0F;
    float high = h;
    int i;

    fit(&c.c1.w_w, &c.c2.w_w, q->x.w_w, q->k1.w_w, q->end.w_w, rate.w_w, h, h_squared);
    fit(&c.c1.w_em, &c.c2.w_em, q->x.w_em, q->k1.w_em, q->end.w_em, rate.w_em, h, h_squared);
    fit(&c.c1.theta_d, &c.c2.theta_d, q->x.theta_d, q->k1.theta_d, q->end.theta_d, rate.theta_d, h, h_squared);

    if (in_gap) {
        int32_t first = GAP;
        int32_t later;

        fit(&c.c1.theta_b, &c.c2.theta_b, q->x.theta_b, q->k1.theta_b, q->end.theta_b, rate.theta_b, h, h_squared);
        for (i = 0; i < HALVINGS; i++) {
            const float s = low + (0.5F * (high - low));
            const int32_t met = flank_met_at(&at, q, &c, s);

            if (met != GAP) {
                high = s;
                q->end = at;
                first = met;
            } else {
                low = s;
            }
        }
        if (high == h) { /* met nowhere: the guards at the end of the cubic, not of the step */
            first = flank_met_at(&at, q, &c, high);
        }
        later = flank_met_at(&at, q, &c, high + MERGE);
        if ((later != GAP) && (later != first)) { /* another guard at the same instant */
            high = high + MERGE;
            q->end = at;
        }
        return (high < h) ? high : h;
    }

    at.theta_b = q->x.theta_b;
    for (i = 0; i < HALVINGS; i++) {
        const float s = low + (0.5F * (high - low));

        point_at(&at, q, &c, s);
        if (flank_left(self->mode, twist_of(&at).w_free)) {
            high = s;
            q->end = at;
        } else {
            low = s;
        }
    }
    return high;
}

/* A major step whose first, whole piece (from x, with rates k1, to end) ends behind a crossing:
 * through all events of the step.  Returns its end. */
RARE static point flow_through_events(plant_twin *self, point x, point k1, point end)
{
    piece whole;
    piece *const q = &whole;
    float h = MAJOR_STEP; /* left of the step */
    int count;

    q->x = x;
    q->k1 = k1;
    q->end = end;
    for (count = 1; ; count++) {
        float elapsed = locate(self, q, h);
        bool in_gap;

        if ((h - elapsed) <= MERGE) {
            elapsed = h;
        }
        self->time = self->time + elapsed;
        h = h - elapsed;
        jump(self, &q->end);
        if (!(h > 0.0F)) {
            break;
        }
        if (count == PIECES) {
            self->faults |= PLANT_TWIN_FAULT_ZENO;
            break;
        }
        in_gap = (self->mode == GAP);
        q->x = q->end;
        q->k1 = rates_at(self, &q->x, in_gap);
        q->end = rk4(self, &q->x, &q->k1, h, in_gap);
        if (!enabled(self->mode, &q->end, twist_of(&q->end).w_free)) {
            self->time = self->time + h;
            break;
        }
    }
    return q->end;
}

/* ---- the automaton ------------------------------------------------------------------------- */

/* The first, whole piece of a major step, from *x; *k1 gets its first rates.  Bits: T_hs, T_v, w_d
 * and w_b of the call before are those of *x, under the inputs that the step flows under. */
INLINE point whole_step(const plant_twin *self, const point *x, point *k1, bool in_gap)
{
    *k1 = rates(self, x->w_w, x->w_em, self->w_d, in_gap ? self->w_b : 0.0F, self->T_hs, self->T_v);
    return rk4(self, x, k1, MAJOR_STEP, in_gap);
}

void plant_twin_init(plant_twin *self, const plant_twin_cal *cal)
{
    *self = (plant_twin){0};
    self->mode = DRIVE;
    self->per_J_em = 1.0F / cal->J_em;
}

void plant_twin_step(plant_twin *self, const plant_twin_cal *cal, const plant_twin_in *in,
                     plant_twin_out *out)
{
    point x; /* states, at the end the new ones */
    twist t; /* of x */
    float slope;
    int32_t mode = self->mode;

    (void)cal; /* all that the step needs of it is in *self */

    /* flow over one major step under the inputs of the call before */
    if (LIKELY(self->started)) {
        point begin, k1;

        begin.w_w = self->w_w;
        begin.w_em = self->w_em;
        begin.theta_d = self->theta_d;
        begin.theta_b = self->theta_b;
        if (mode == GAP) {
            x = whole_step(self, &begin, &k1, true);
        } else {
            x = whole_step(self, &begin, &k1, false);
        }
        t = twist_of(&x);
        if (UNLIKELY(enabled(mode, &x, t.w_free))) {
            x = flow_through_events(self, begin, k1, x);
            t = twist_of(&x);
            mode = self->mode;
        } else {
            self->time = self->time + MAJOR_STEP;
        }
    } else { /* first call: initial values.  No guard is true there: w_free is 0. */
        x.w_w = W_W_INITIAL;
        x.w_em = W_W_INITIAL * R;
        x.theta_d = ALPHA;
        x.theta_b = ALPHA;
        t = twist_of(&x);
        self->started = true;
    }
    self->w_w = x.w_w;
    self->w_em = x.w_em;
    self->theta_d = x.theta_d;
    self->theta_b = x.theta_b;

    /* latch.  Bits: an equal slope has an equal sine; only of 0 the sign may differ, see SIN_IS_X. */
    slope = in->slope;
    if (LIKELY(fabsf(slope) < SIN_IS_X)) {
        self->before_m_g_r_w_sin_slope = M_G_R_W * slope;
    } else if (slope != self->before_slope) {
        self->before_m_g_r_w_sin_slope = M_G_R_W * sine(slope);
    }
    self->before_slope = slope;
    self->before_T_em = in->T_em;
    self->before_T_br = in->T_br;

    /* equations */
    {
        const float w_w_squared = x.w_w * x.w_w;
        const float T_aer = A_AER_R_W_CUBED * w_w_squared;
        const float T_rr = M_G_R_W * ((C_0 + (C_1 * x.w_w)) + (C_2 * w_w_squared));
        const float T_v = (T_aer + T_rr) + self->before_m_g_r_w_sin_slope;
        const float w_b = (mode == GAP) ? t.w_free : 0.0F;
        const float T_hs = (K_HS * t.stretch) + (C_HS * (t.w_d - w_b));

        self->w_d = t.w_d;
        self->w_free = t.w_free;
        self->T_hs = T_hs;
        self->T_aer = T_aer;
        self->T_rr = T_rr;
        self->T_v = T_v;
        self->w_b = w_b;
        out->w_em = x.w_em;
        out->w_w = x.w_w;
        out->w_d = t.w_d;
        out->w_b = w_b;
        out->T_hs = T_hs;
        out->theta_d = x.theta_d;
        out->theta_b = x.theta_b;
        out->mode = mode;
    }
}
