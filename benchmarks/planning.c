/* Backward induction over (task state) x (state) in C, for comparison by planning.py: what envs/planning.py does. */
#include <math.h>
#include <stddef.h>
#include <stdint.h>

typedef struct {
    long states, actions, outcomes, task_states, letters, horizon;
    const int32_t *successor;
    const double *probability;
    const int32_t *task_delta, *task_letter;
    const float *reward, *final_reward;
    const uint8_t *terminated;
    const uint8_t *reached; /* (horizon + 1, task states): which task states are possible at which tick */
} world;

/* Leaves the values at tick 0 in `values`; both arrays have the shape (task states, states). */
void backward_induction(const world *given, double *values, double *arriving) {
    const world local = *given, *p = &local;
    const long states = p->states;
    for (long t = p->horizon; t > 0; t--) {
        for (long w = 0; w < p->task_states; w++)
            if (p->reached[t * p->task_states + w])
                for (long s = 0; s < states; s++) {
                    double value = p->reward[w * states + s];
                    if (t == p->horizon)
                        value += p->final_reward[w];
                    else if (!p->terminated[w])
                        value += values[w * states + s];
                    arriving[w * states + s] = value;
                }
        for (long w = 0; w < p->task_states; w++) {
            if (!p->reached[(t - 1) * p->task_states + w])
                continue;
            const int32_t *delta = p->task_delta + w * p->letters;
            for (long s = 0; s < states; s++) {
                double best = -INFINITY;
                for (long a = 0; a < p->actions; a++) {
                    double expected = 0.0;
                    for (long k = 0; k < p->outcomes; k++) {
                        long row = (s * p->actions + a) * p->outcomes + k, after = p->successor[row];
                        expected += p->probability[row] * arriving[delta[p->task_letter[after]] * states + after];
                    }
                    if (expected > best)
                        best = expected;
                }
                values[w * states + s] = best;
            }
        }
    }
}
