/* The table-driven loops of tickwise.rl.kernels as a C program, for comparison by learning.py.
 *
 * usage: learning TABLES EPISODES Q
 *
 * Reads the tables, learns for EPISODES episodes from the initial Q-table, plays as many greedily, writes the
 * Q-table to the file Q, and prints: processor seconds of learning, those of playing, and the mean return of the greedy play.
 * It draws from PCG64 (XSL RR 128/64) as NumPy does, so it takes the same steps and must find the same Q-table.
 */
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

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

typedef struct {
    int states, actions, outcomes, task_letters, letters, memory_states, task_states, horizon;
    double alpha, gamma, epsilon;
    double *start_thresholds, *thresholds;
    int32_t *successor, *task_start, *task_delta, *task_letter, *memory_start, *memory_delta, *memory_letter;
    float *reward, *final_reward;
    uint8_t *terminated;
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

static void q_learning(const problem *p, pcg64 *rng, float *q, float *returns, int episodes) {
    const int actions = p->actions;
    for (int episode = 0; episode < episodes; episode++) {
        int s = draw_state(p, uniform(rng));
        int w = p->task_start[s], u = p->memory_start[s];
        double total = 0;
        float *row = q + ((size_t)u * p->states + s) * actions;
        float best = greatest(row, actions);
        for (int t = 1; t <= p->horizon; t++) {
            double number = uniform(rng);
            int action = 0;
            if (number < p->epsilon) {
                action = (int)(number / p->epsilon * actions);
            } else {
                int ties = 0;
                for (int a = 0; a < actions; a++)
                    ties += row[a] == best;
                int pick = (int)((number - p->epsilon) / (1.0 - p->epsilon) * ties);
                for (int a = 0; a < actions; a++)
                    if (row[a] == best && pick-- == 0) {
                        action = a;
                        break;
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
            double target = over ? gained : gained + p->gamma * best;
            row[action] = (float)(row[action] + p->alpha * (target - row[action]));
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
}

static void greedy_returns(const problem *p, pcg64 *rng, const float *q, float *returns, int episodes) {
    const int actions = p->actions;
    for (int episode = 0; episode < episodes; episode++) {
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
}

static void *array(FILE *file, size_t count, size_t size) {
    void *memory = malloc(count * size);
    if (!memory || fread(memory, size, count, file) != count) {
        fprintf(stderr, "the tables are too short\n");
        exit(1);
    }
    return memory;
}

static u128 wide(const uint64_t *words) { return ((u128)words[0] << 64) | words[1]; }

static double now(void) {
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return time.tv_sec + 1e-9 * time.tv_nsec;
}

int main(int count, char **arguments) {
    FILE *file = count == 4 ? fopen(arguments[1], "rb") : NULL;
    if (!file) {
        fprintf(stderr, "usage: learning TABLES EPISODES Q\n");
        return 2;
    }
    int32_t *sizes = array(file, 8, sizeof *sizes);
    double *settings = array(file, 4, sizeof *settings);
    uint64_t *words = array(file, 8, sizeof *words);
    problem p = {sizes[0], sizes[1], sizes[2], sizes[3], sizes[4], sizes[5], sizes[6], sizes[7],
                 settings[0], settings[1], settings[2]};
    size_t rows = (size_t)p.states * p.actions * p.outcomes;
    p.start_thresholds = array(file, p.states, sizeof(double));
    p.successor = array(file, rows, sizeof(int32_t));
    p.thresholds = array(file, rows, sizeof(double));
    p.task_start = array(file, p.states, sizeof(int32_t));
    p.task_delta = array(file, (size_t)p.task_states * p.task_letters, sizeof(int32_t));
    p.task_letter = array(file, p.states, sizeof(int32_t));
    p.reward = array(file, (size_t)p.task_states * p.states, sizeof(float));
    p.final_reward = array(file, p.task_states, sizeof(float));
    p.terminated = array(file, p.task_states, sizeof(uint8_t));
    p.memory_start = array(file, p.states, sizeof(int32_t));
    p.memory_delta = array(file, (size_t)p.memory_states * p.letters, sizeof(int32_t));
    p.memory_letter = array(file, rows, sizeof(int32_t));
    fclose(file);

    int episodes = atoi(arguments[2]);
    size_t size = (size_t)p.memory_states * p.states * p.actions;
    float *q = malloc(size * sizeof *q), *returns = calloc(episodes, sizeof *returns);
    for (size_t i = 0; i < size; i++)
        q[i] = (float)settings[3];
    pcg64 learner = {wide(words), wide(words + 2)}, player = {wide(words + 4), wide(words + 6)};

    double begin = now();
    q_learning(&p, &learner, q, returns, episodes);
    double learned = now();
    greedy_returns(&p, &player, q, returns, episodes);
    double played = now();

    double mean = 0;
    for (int i = 0; i < episodes; i++)
        mean += returns[i];
    FILE *out = fopen(arguments[3], "wb");
    if (!out || fwrite(q, sizeof *q, size, out) != size)
        return 1;
    fclose(out);
    printf("%.9f %.9f %.9f\n", learned - begin, played - learned, mean / episodes);
    return 0;
}
