// A module of RabbitCT's original interface: plain, sample by sample. STAND_IN_WEIGHT is what a view counts
// for at depth w.
#include <cmath>
#include <vector>

#include "rabbitct.h"

#ifndef STAND_IN_WEIGHT
#define STAND_IN_WEIGHT(w) (1 / ((w) * (w)))
#endif

namespace {

std::vector<float> volume;

double pixel(const RabbitCtGlobalData& d, long column, long row) {
  const bool inside =
      column >= 0 && row >= 0 && column < static_cast<long>(d.S_x) && row < static_cast<long>(d.S_y);
  return inside ? d.I_n[row * static_cast<long>(d.S_x) + column] : 0.0;
}

double bilinear(const RabbitCtGlobalData& d, double u, double v) {
  const long column = std::lround(std::floor(u)), row = std::lround(std::floor(v));
  const double a = u - std::floor(u), b = v - std::floor(v);
  return (1 - b) * ((1 - a) * pixel(d, column, row) + a * pixel(d, column + 1, row)) +
         b * ((1 - a) * pixel(d, column, row + 1) + a * pixel(d, column + 1, row + 1));
}

}  // namespace

// Its own volume, as modules are free to bring.
extern "C" bool RCTLoadAlgorithm(RabbitCtGlobalData* d) {
  volume.assign(static_cast<std::size_t>(d->L) * d->L * d->L, 0.0F);
  d->f_L = volume.data();
  return true;
}

extern "C" bool RCTAlgorithmBackprojection(RabbitCtGlobalData* d) {
  const auto place = [d](unsigned int i) { return d->O_L + static_cast<double>(i) * d->R_L; };
  float* out = d->f_L;
  for (unsigned int k = 0; k < d->L; ++k)
    for (unsigned int j = 0; j < d->L; ++j)
      for (unsigned int i = 0; i < d->L; ++i) {
        double n[3];
        for (int c = 0; c < 3; ++c)
          n[c] = d->A_n[c] * place(i) + d->A_n[3 + c] * place(j) + d->A_n[6 + c] * place(k) + d->A_n[9 + c];
        *out++ += static_cast<float>(STAND_IN_WEIGHT(n[2]) * bilinear(*d, n[0] / n[2], n[1] / n[2]));
      }
  return true;
}

extern "C" bool RCTFinishAlgorithm(RabbitCtGlobalData*) { return true; }

extern "C" bool RCTUnloadAlgorithm(RabbitCtGlobalData* d) {
  volume.clear();
  d->f_L = nullptr;
  return true;
}
