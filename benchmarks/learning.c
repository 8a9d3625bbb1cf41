/* The table-driven loops of tickwise.rl.kernels in C, for comparison by learning.py.
 *
 * They draw from PCG64 (XSL RR 128/64) as NumPy does, so they take the same steps and must find the same Q-table.
 */
#include <stddef.h>
#include <stdint.h>

typedef unsigned __int128 u128;
typedef struct {
    u128 state, increment;
} pcg64;

static inline double uniform(pcg64 *rng) {
    rng->state = rng->state * (((u128)2549297995355413924ULL << 64) | 4865540595714422341ULL) + rng->increment;
    uint64_t folded = (uint64_t)(rng->state >> 64) ^ (uint64_t)rng->state;
    unsigned rotation = (unsigned)(rng->state >> 122);
    uint64_t bits = (folded >> rotation) | (folded << (-rotation & 63));
    return (double)(bits >> 11) * (1.0 / 9007199254740992.0);
}

static pcg64 from_words(const uint64_t *words) {
    return (pcg64){((u128)words[0] << 64) | words[1], ((u128)words[2] << 64) | words[3]};
}

static void to_words(const pcg64 *rng, uint64_t *words) {
    words[0] = (uint64_t)(rng->state >> 64);
    words[1] = (uint64_t)rng->state;
}

typedef struct {
    long states, actions, outcomes, task_letters, letters, horizon;
    const double *start_thresholds;
    const int32_t *successor;
    const double *thresholds;
    const int32_t *task_start, *task_delta, *task_letter;
    const float *reward, *final_reward;
    const uint8_t *terminated;
    const int32_t *memory_start, *memory_delta, *memory_letter;
} problem;

static int draw_state(const problem *p, double number) {
    int low = 0, high = p->states - 1;
    while (low < high) {
        int middle = (low + high) / 2;
        if (p->start_thresholds[middle] > number)
            high = middle;
        else
            low = middle + 1;
    }
    return low;
}

static inline int draw_outcome(const problem *p, size_t row, double number) {
    const double *thresholds = p->thresholds + row * p->outcomes;
    int outcome = 0;
    while (outcome < p->outcomes - 1 && number >= thresholds[outcome])
        outcome++;
    return outcome;
}

static inline float greatest(const float *row, int actions) {
    float best = row[0];
    for (int a = 1; a < actions; a++)
        if (row[a] > best)
            best = row[a];
    return best;
}

void q_learning(const problem *given, double alpha, double gamma, double epsilon, uint64_t *words, float *q,
                float *returns, long episodes) {
    const problem local = *given, *p = &local;
    const int actions = p->actions;
    pcg64 stream = from_words(words), *rng = &stream;
    for (long episode = 0; episode < episodes; episode++) {
        int s = draw_state(p, uniform(rng));
        int w = p->task_start[s], u = p->memory_start[s];
        double total = 0;
        float *row = q + ((size_t)u * p->states + s) * actions;
        float best = greatest(row, actions);
        for (int t = 1; t <= p->horizon; t++) {
            double number = uniform(rng);
            int action = 0;
            if (number < epsilon) {
                action = (int)(number / epsilon * actions);
            } else {
                int ties = 0;
                for (int a = 0; a < actions; a++)
                    if (row[a] == best) {
                        action = a;
                        ties++;
                    }
                if (ties > 1) {
                    int pick = (int)((number - epsilon) / (1.0 - epsilon) * ties);
                    for (int a = 0; a < actions; a++)
                        if (row[a] == best && pick-- == 0) {
                            action = a;
                            break;
                        }
                }
            }
            size_t taken = (size_t)s * actions + action;
            size_t transition = taken * p->outcomes + draw_outcome(p, taken, uniform(rng));
            int next_s = p->successor[transition];
            int next_u = p->memory_delta[(size_t)u * p->letters + p->memory_letter[transition]];
            w = p->task_delta[(size_t)w * p->task_letters + p->task_letter[next_s]];
            double gained = p->reward[(size_t)w * p->states + next_s];
            int over = p->terminated[w] || t == p->horizon;
            if (t == p->horizon)
                gained += p->final_reward[w];
            total += gained;
            float *next_row = q + ((size_t)next_u * p->states + next_s) * actions;
            best = greatest(next_row, actions);
            double target = over ? gained : gained + gamma * best;
            row[action] = (float)(row[action] + alpha * (target - row[action]));
            if (next_row == row)
                best = greatest(row, actions);
            row = next_row;
            s = next_s;
            u = next_u;
            if (over)
                break;
        }
        returns[episode] = (float)total;
    }
    to_words(rng, words);
}

void greedy_returns(const problem *given, uint64_t *words, const float *q, float *returns, long episodes) {
    const problem local = *given, *p = &local;
    const int actions = p->actions;
    pcg64 stream = from_words(words), *rng = &stream;
    for (long episode = 0; episode < episodes; episode++) {
        int s = draw_state(p, uniform(rng));
        int w = p->task_start[s], u = p->memory_start[s];
        double total = 0;
        for (int t = 1; t <= p->horizon; t++) {
            const float *row = q + ((size_t)u * p->states + s) * actions;
            int action = 0;
            for (int a = 1; a < actions; a++)
                if (row[a] > row[action])
                    action = a;
            size_t taken = (size_t)s * actions + action;
            size_t transition = taken * p->outcomes + draw_outcome(p, taken, uniform(rng));
            s = p->successor[transition];
            u = p->memory_delta[(size_t)u * p->letters + p->memory_letter[transition]];
            w = p->task_delta[(size_t)w * p->task_letters + p->task_letter[s]];
            double gained = p->reward[(size_t)w * p->states + s];
            if (t == p->horizon)
                gained += p->final_reward[w];
            total += gained;
            if (p->terminated[w])
                break;
        }
        returns[episode] = (float)total;
    }
    to_words(rng, words);
}
