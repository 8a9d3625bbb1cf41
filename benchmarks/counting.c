/* The exact probability of a sequential conjunction under a prior on a graph, for comparison by counting.py.
 *
 * Dynamic programming over (automaton state) x (state of the graph), as tickwise.inference.counting does it for formulas
 * of any number of disjuncts; here there is one, so that an automaton state is a number and a table of them an array.
 */
#include <math.h>
#include <stdint.h>
#include <stdlib.h>

enum { EVENTUALLY, ALWAYS, EVENTUALLY_ALWAYS, ALWAYS_EVENTUALLY };
enum { ADVANCE = -1, FAIL = -2 };

typedef struct {
    long states, variables, horizon, primitives;
    const double *coordinates;
    const int64_t *indptr, *indices;
    const double *weights, *scale, *backward, *forward;
    const int64_t *operators;
    const uint8_t *complemented;
    const int64_t *times;
    const double *lower, *upper;
} query;

/* One letter of a fragment: the next stay count, or how it ends. */
static long fragment(long operator, const int64_t *times, long count, int holds, long tick) {
    int nested = operator >= EVENTUALLY_ALWAYS, dual = operator == ALWAYS || operator == ALWAYS_EVENTUALLY;
    if (holds != dual) {
        if (tick < times[0])
            return 0;
        if (nested && count < times[2])
            return count + 1;
        return dual ? FAIL : ADVANCE;
    }
    if (tick < times[1])
        return 0;
    return dual ? ADVANCE : FAIL;
}

static void read_letters(const query *p, uint8_t *letters) {
    for (long j = 0; j < p->primitives; j++)
        for (long s = 0; s < p->states; s++) {
            int inside = 1;
            for (long v = 0; v < p->variables; v++) {
                double x = p->coordinates[s * p->variables + v];
                inside &= p->lower[j * p->variables + v] <= x && x <= p->upper[j * p->variables + v];
            }
            letters[j * p->states + s] = inside != p->complemented[j];
        }
}

double log_probability(const query *given) {
    const query local = *given, *p = &local;
    const long n = p->primitives, states = p->states, begin = p->times[0];
    if (begin > p->horizon)
        return 0.0;
    long codes = 0, *first = malloc((n + 1) * sizeof *first);
    for (long j = 0; j < n; j++) {
        first[j] = codes;
        codes += 1 + (p->operators[j] >= EVENTUALLY_ALWAYS ? p->times[3 * j + 2] : 0);
    }
    first[n] = codes;
    long *stage = malloc(codes * sizeof *stage);
    for (long j = 0; j < n; j++)
        for (long code = first[j]; code < first[j + 1]; code++)
            stage[code] = j;
    uint8_t *letters = malloc(n * states);
    read_letters(p, letters);
    double *mass = calloc(codes * states, sizeof *mass), *moved = calloc(codes * states, sizeof *moved);
    /* where a row may have mass: from its low state to before its high one */
    long *low = calloc(codes, sizeof *low), *high = calloc(codes, sizeof *high);
    long *next_low = malloc(codes * sizeof *next_low), *next_high = malloc(codes * sizeof *next_high);
    for (long s = 0; s < states; s++)
        mass[s] = p->forward[begin * states + s];
    high[0] = states;
    double factor = 0.0, result = -INFINITY;
    for (long tick = begin; tick <= p->horizon; tick++) {
        const double *later = p->backward + tick * states;
        double accepted = 0.0, largest = 0.0;
        for (long code = 0; code < codes; code++)
            next_low[code] = states, next_high[code] = 0;
        for (long code = 0; code < codes; code++) {
            if (low[code] >= high[code])
                continue;
            long j = stage[code], target[2];
            for (int bit = 0; bit < 2; bit++) {
                long outcome = fragment(p->operators[j], p->times + 3 * j, code - first[j], bit, tick);
                target[bit] = outcome >= 0 ? first[j] + outcome
                              : outcome == ADVANCE && j + 1 < n ? first[j + 1]
                                                                : outcome;
            }
            double *row = mass + code * states;
            const uint8_t *letter = letters + j * states;
            for (long s = low[code]; s < high[code]; s++) {
                double weight = row[s];
                if (weight == 0.0)
                    continue;
                row[s] = 0.0;
                long to = target[letter[s]];
                if (to >= 0) {
                    moved[to * states + s] += weight;
                    if (s < next_low[to])
                        next_low[to] = s;
                    if (s >= next_high[to])
                        next_high[to] = s + 1;
                    if (weight > largest)
                        largest = weight;
                } else if (to == ADVANCE) {
                    accepted += weight * later[s];
                }
            }
        }
        if (tick == p->horizon) /* what is still undecided counts as satisfied */
            for (long code = 0; code < codes; code++)
                for (long s = next_low[code]; s < next_high[code]; s++)
                    accepted += moved[code * states + s];
        if (accepted > 0.0) {
            double term = factor + log(accepted), top = term > result ? term : result;
            result = top + log(exp(term - top) + exp(result - top));
        }
        if (tick == p->horizon || largest == 0.0)
            break;
        double share = 1.0 / p->scale[tick];
        if (largest < 1e-100) {
            share /= largest;
            factor += log(largest);
        }
        for (long code = 0; code < codes; code++) {
            const long from = next_low[code], to = next_high[code];
            double *source = moved + code * states, *target = mass + code * states;
            low[code] = states, high[code] = 0;
            for (long s = from; s < to; s++) {
                double weight = source[s] * share;
                if (weight == 0.0)
                    continue;
                source[s] = 0.0;
                long begin_edge = p->indptr[s], end_edge = p->indptr[s + 1];
                for (long edge = begin_edge; edge < end_edge; edge++)
                    target[p->indices[edge]] += weight * p->weights[edge];
                if (begin_edge < end_edge) {
                    if (p->indices[begin_edge] < low[code])
                        low[code] = p->indices[begin_edge];
                    if (p->indices[end_edge - 1] >= high[code])
                        high[code] = p->indices[end_edge - 1] + 1;
                }
            }
        }
    }
    free(first), free(stage), free(letters), free(mass), free(moved);
    free(low), free(high), free(next_low), free(next_high);
    return result < 0.0 ? result : 0.0;
}
