/* A module of RabbitCT's later interface, which gets all views in one call. */
#include <math.h>

#include "rabbitCt.h"

static double pixel(const RabbitCtGlobalData* d, const float* image, long column, long row) {
  if (column < 0 || row < 0 || column >= (long)d->imageWidth || row >= (long)d->imageHeight) return 0;
  return image[row * (long)d->imageWidth + column];
}

static double bilinear(const RabbitCtGlobalData* d, const float* image, double u, double v) {
  const long column = (long)floor(u), row = (long)floor(v);
  const double a = u - floor(u), b = v - floor(v);
  return (1 - b) * ((1 - a) * pixel(d, image, column, row) + a * pixel(d, image, column + 1, row)) +
         b * ((1 - a) * pixel(d, image, column, row + 1) + a * pixel(d, image, column + 1, row + 1));
}

int bilinearPrepare(RabbitCtGlobalData* d) { return d->volumeData != 0; }
int bilinearFinish(RabbitCtGlobalData* d) { return d->volumeData != 0; }

int bilinearBackprojection(RabbitCtGlobalData* d) {
  for (uint32_t p = 0; p < d->numberOfProjections; ++p) {
    const double* m = d->projectionBuffer[p].matrix;
    float* out = d->volumeData;
    for (uint32_t k = 0; k < d->problemSize; ++k)
      for (uint32_t j = 0; j < d->problemSize; ++j)
        for (uint32_t i = 0; i < d->problemSize; ++i) {
          const double x = d->O_Index + (double)i * d->voxelSize, y = d->O_Index + (double)j * d->voxelSize,
                       z = d->O_Index + (double)k * d->voxelSize;
          const double u = m[0] * x + m[3] * y + m[6] * z + m[9], v = m[1] * x + m[4] * y + m[7] * z + m[10],
                       w = m[2] * x + m[5] * y + m[8] * z + m[11];
          *out++ += (float)(bilinear(d, d->projectionBuffer[p].image, u / w, v / w) / (w * w));
        }
  }
  return 1;
}
