/* The same work as the compiled judge does on full circles, step by step in plain C: direct search,
 * play and compensation of two axes, the three errors with maxima, squares and place, two
 * histograms, extents, counts, the bins of a circle. Written to be read; the compiler may do with
 * it what it can. gcc -O3 -march=native -shared -fPIC reference.c -lm */
#include <math.h>
#include <stdlib.h>
#include <stdint.h>
#include <string.h>

enum { BINS = 6402, ANGLES = 720 };

struct sums {
    double inner, inner_squares, lag, lag_squares, total, total_squares, total_sum, at_x, at_y;
    double low_x, high_x, low_y, high_y;
    int64_t samples, steps_x, steps_y, reversals_x, reversals_y;
    int64_t histogram[2][BINS];
    double bin[ANGLES][9];
};

struct axis { double low, high, added, direction, slide; };

static int64_t place(double size, int64_t before)
{
    int64_t bits;
    memcpy(&bits, &size, 8);
    bits = (bits >> 45) - before;
    return bits < 0 ? 0 : bits >= BINS ? BINS - 1 : bits;
}

static double follow(struct axis *axis, double way, double at, double compensation,
                     int64_t *reversals)
{
    if (way != 0.0 && way != axis->direction) {
        axis->direction = way;
        axis->added += way * compensation;
        ++*reversals;
    }
    double motor = at + axis->added;
    double slide = axis->slide;
    if (motor + axis->low > slide) slide = motor + axis->low;
    if (motor + axis->high < slide) slide = motor + axis->high;
    return axis->slide = slide;
}

/* `turns` circles cw of `radius` steps from their left end. */
void run(int64_t radius, int64_t turns, double step, double play, double compensation,
         int64_t before, const double *directions, struct sums *s)
{
    struct axis ax = { 0.0, play, 0.0, 1.0, -radius * step }, ay = { 0.0, play, 0.0, 1.0, 0.0 };
    const double r = radius * step;
    int bin = ANGLES / 2;
    for (int64_t turn = 0; turn < turns; ++turn) {
        int64_t x = -radius, y = 0, error = 0, sx = 1, sy = 1;
        int64_t dx = 2 * x * sx + 1, dy = 2 * y * sy + 1;
        do {
            int64_t old_x = x, old_y = y;
            int64_t only_x = llabs(error + dx), only_y = llabs(error + dy);
            int64_t both = llabs(error + dx + dy);
            int move_x = only_x > only_y ? only_y > both : 1;
            int move_y = only_x > only_y ? 1 : only_x > both;
            if (move_x) { x += sx; error += dx; dx += 2; }
            if (move_y) { y += sy; error += dy; dy += 2; }
            if (move_y && y == 0) { sx = -sx; dx = 2 * x * sx + 1; dy = 1; }
            else if (move_x && x == 0) { sy = -sy; dx = 1; dy = 2 * y * sy + 1; }
            s->samples++;
            s->steps_x += llabs(x - old_x);
            s->steps_y += llabs(y - old_y);
            double px = x * step, py = y * step;
            double qx = follow(&ax, (double)(x - old_x), px, compensation, &s->reversals_x);
            double qy = follow(&ay, (double)(y - old_y), py, compensation, &s->reversals_y);
            double inner = fabs(r - sqrt(px * px + py * py));
            double square = qx * qx + qy * qy, total = sqrt(square) - r, size = fabs(total);
            double lag = (qx - px) * (qx - px) + (qy - py) * (qy - py);
            if (inner > s->inner) s->inner = inner;
            s->inner_squares += inner * inner;
            s->histogram[0][place(inner, before)]++;
            if (lag > s->lag) s->lag = lag;
            s->lag_squares += lag;
            if (size > s->total) { s->total = size; s->at_x = qx; s->at_y = qy; }
            s->total_squares += size * size;
            s->total_sum += total;
            s->histogram[1][place(size, before)]++;
            if (qx < s->low_x) s->low_x = qx;
            if (qx > s->high_x) s->high_x = qx;
            if (qy < s->low_y) s->low_y = qy;
            if (qy > s->high_y) s->high_y = qy;
            const double *d = directions + 2 * bin;
            if (d[0] * qy - d[1] * qx < 0.0 || d[2] * qy - d[3] * qx >= 0.0) {
                double angle = atan2(qy, qx) / (2.0 * M_PI);
                bin = (int)((angle < 0.0 ? angle + 1.0 : angle) * ANGLES);
                if (bin >= ANGLES) bin = ANGLES - 1;
            }
            double *b = s->bin[bin];
            b[0] += 1.0; b[1] += qx; b[2] += qy;
            if (square < b[3] || b[0] == 1.0) { b[3] = square; b[4] = qx; b[5] = qy; }
            if (square > b[6]) { b[6] = square; b[7] = qx; b[8] = qy; }
        } while (x != -radius || y != 0);
    }
}
