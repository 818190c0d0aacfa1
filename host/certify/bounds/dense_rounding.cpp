#include "host/certify/bounds/dense_rounding.hpp"

namespace vdvr {

double dense_rounding(Upsampler& upsampler, const FilteredScan& scan, const UpsampledColumns& columns,
                      const UpsampledColumns& rows, double samples, double sup, Fp64 fp64) {
  const ParallelGeometry& g = scan.geometry;
  const double gain_v = lebesgue_constant(g.rows);
  const double of_columns = column_error(upsampler, g.columns, columns, samples, sup, fp64),
               largest = sup + of_columns;
  return gain_v * of_columns + transform_error(g.rows, rows.rate, largest, gain_v * largest) +
         static_cast<double>(g.views()) * gain_v * product_underflow(g, upsampler.gain_u());
}

}  // namespace vdvr
