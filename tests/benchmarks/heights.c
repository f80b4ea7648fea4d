/* Height map of straight moves, as the plain loop over the box of each move. gcc -O3
 * -march=native -shared -fPIC heights.c -lm */
#include <math.h>
#include <stdint.h>

void cut(float *height, int64_t columns, int64_t rows, double cell, const double *from,
         const double *to, int64_t moves, const double *cutter)
{
    const double radius = cutter[0], flat = cutter[1], corner = cutter[2], rise = cutter[3];
    for (int64_t k = 0; k < moves; k++) {
        const double *a = from + 3 * k, *b = to + 3 * k;
        const double dx = b[0] - a[0], dy = b[1] - a[1], square = dx * dx + dy * dy;
        int64_t left = fmax(0, (fmin(a[0], b[0]) - radius) / cell);
        int64_t right = fmin(columns - 1, (fmax(a[0], b[0]) + radius) / cell);
        int64_t low = fmax(0, (fmin(a[1], b[1]) - radius) / cell);
        int64_t high = fmin(rows - 1, (fmax(a[1], b[1]) + radius) / cell);
        for (int64_t j = low; j <= high; j++)
            for (int64_t i = left; i <= right; i++) {
                double x = (i + 0.5) * cell - a[0], y = (j + 0.5) * cell - a[1];
                double t = fmin(fmax((x * dx + y * dy) / square, 0.0), 1.0);
                double d = sqrt((x - t * dx) * (x - t * dx) + (y - t * dy) * (y - t * dy));
                if (d > radius)
                    continue;
                double w = fmax(d - flat, 0.0), z = w * rise;
                if (corner > 0.0)
                    z = corner - sqrt(fmax(corner * corner - w * w, 0.0));
                z += a[2] + t * (b[2] - a[2]);
                float *here = height + j * columns + i;
                if (z < *here)
                    *here = z;
            }
    }
}
