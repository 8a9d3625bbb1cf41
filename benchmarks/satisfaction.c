/* The formula of Case Study 1 on trajectories of x and y, as one would write it by hand for this formula alone:

     F[1,15] G[0,4] (3 <= x <= 4 & 3 <= y <= 5) & F[21,39] (7 <= x <= 8 & 5 <= y <= 8)

   The states are n times `ticks` pairs of doubles. The answers are 1 and -1: no trajectory is shorter than 40 ticks. */
#include <stdint.h>

static int inside(const double *state, double x1, double x2, double y1, double y2) {
    return state[0] >= x1 && state[0] <= x2 && state[1] >= y1 && state[1] <= y2;
}

static int first_stage(const double *states) {
    int run = 0;
    for (int tick = 1; tick <= 19; tick++) {
        run = inside(states + 2 * tick, 3, 4, 3, 5) ? run + 1 : 0;
        if (run == 5) return 1;
    }
    return 0;
}

static int second_stage(const double *states) {
    for (int tick = 21; tick <= 39; tick++)
        if (inside(states + 2 * tick, 7, 8, 5, 8)) return 1;
    return 0;
}

/* Tick by tick, no further than the answer needs. NaN is not looked for. */
void loop(const double *states, int64_t n, int64_t ticks, int8_t *answers) {
    for (int64_t i = 0; i < n; i++) {
        const double *one = states + 2 * ticks * i;
        answers[i] = first_stage(one) && second_stage(one) ? 1 : -1;
    }
}

/* The same steps as the kernel's: look for NaN in all values, compare every value that the formula reads with its side
   of the box, a bit each, and take windows by shifts. Returns a trajectory with NaN, or -1. */
int64_t bits(const double *states, int64_t n, int64_t ticks, int8_t *answers) {
    const double low[2][2] = {{3, 3}, {7, 5}}, high[2][2] = {{4, 5}, {8, 8}};
    const int64_t first[2] = {1, 21};
    for (int64_t i = 0; i < n; i++) {
        const double *one = states + 2 * ticks * i;
        int nan = 0;
        for (int64_t k = 0; k < 2 * ticks; k++) nan |= one[k] != one[k];
        if (nan) return i;
        uint64_t code[2];
        for (int box = 0; box < 2; box++) {
            const double *from = one + 2 * first[box];
            uint64_t word = 0;
            for (int k = 0; k < 38; k++)
                word |= (uint64_t)(from[k] >= low[box][k & 1] && from[k] <= high[box][k & 1]) << k;
            code[box] = word & word >> 1 & 0x5555555555555555;
        }
        uint64_t stay = code[0] & code[0] >> 2;
        stay &= stay >> 4;
        stay &= code[0] >> 8;
        answers[i] = stay && code[1] ? 1 : -1;
    }
    return -1;
}
