/* ◇[1,first] □[0,stay] G ∧ ◇[second,last] Y on trajectories of x and y, as one would write it by hand for this formula
   alone: tick by tick, and no further than the answer needs. All windows lie within the trajectories. */
#include <stdint.h>

static int inside(const double *state, double x1, double x2, double y1, double y2) {
    return state[0] >= x1 && state[0] <= x2 && state[1] >= y1 && state[1] <= y2;
}

static int stays_in_g(const double *states, long first, long stay) {
    long run = 0;
    for (long tick = 1; tick <= first + stay; tick++) {
        run = inside(states + 2 * tick, 3, 4, 3, 5) ? run + 1 : 0;
        if (run > stay) return 1;
    }
    return 0;
}

static int comes_to_y(const double *states, long second, long last) {
    for (long tick = second; tick <= last; tick++)
        if (inside(states + 2 * tick, 7, 8, 5, 8)) return 1;
    return 0;
}

/* The states are n times `ticks` pairs; an answer is 1 or 0. */
void verdicts(const double *states, long n, long ticks, long first, long stay, long second, long last, int8_t *answers) {
    for (long i = 0; i < n; i++) {
        const double *one = states + 2 * ticks * i;
        answers[i] = stays_in_g(one, first, stay) && comes_to_y(one, second, last);
    }
}
