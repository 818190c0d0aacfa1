// Launches kernels/field/fbp/turn.cl between two passes of upsample_columns.cpp, and join_columns.cl after
// them.
#include "host/field/fbp/dense_values.hpp"

#include "host/base/opencl/work_groups.hpp"
#include "host/base/system/casts.hpp"

namespace vdvr {

bool DenseValues::suit(const opencl::State& state, const ParallelGeometry& g, std::int64_t fewest_rows) {
  return g.rows >= fewest_rows && ColumnUpsampling::is_possible(state);
}

DenseValues::DenseValues(opencl::State& state, Upsampler& upsampler, const FilteredScan& scan,
                         const UpsampledColumns& columns, const UpsampledColumns& rows)
    : state_(state),
      upsampler_(upsampler),
      scan_(scan),
      columns_(columns),
      rows_(rows),
      along_v_(state, scan.geometry.rows, rows.rate) {
  for (std::int64_t v = 0; v < scan.geometry.rows; ++v) own_rows_.push_back(static_cast<double>(v));
}

std::uint64_t DenseValues::bytes(std::int64_t views) const {
  const std::int64_t V = scan_.geometry.rows;
  return sizeof(float) * count(views * (chunks() * 16 * (rows_.count + V) + columns_.count * (V + 15)));
}

const opencl::DeviceArray<float>& DenseValues::operator()(std::int64_t first, std::int64_t views) {
  const std::int64_t V = scan_.geometry.rows;
  const UpsampledSlab slab = upsampler_(columns_, own_rows_, 0, 0, 1, first, views);
  resize(turned_, count(chunks() * views * V * 16), "columns of rows");
  resize(values_, count(chunks() * views * rows_.count * 16), "dense values");
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int> turn(state_, "field/fbp/turn", "turn");
  turn(opencl::in_groups(state_.info, {count(V), count(chunks()), count(views)}), turned_.buffer(),
       slab.values.buffer(), to_int(views), to_int(columns_.count), to_int(V));
  along_v_(values_, {0, count(rows_.count * 16), count(views * rows_.count * 16)}, turned_,
           {0, count(V * 16), count(views * V * 16)}, rows_, views, chunks());
  opencl::finish(state_, "dense values");  // before the slab goes
  return values_;
}

void DenseValues::join(const opencl::DeviceArray<float>& out, std::int64_t first, std::int64_t views,
                       const WholeColumns& wanted) {
  const opencl::DeviceArray<float>& values = (*this)(first, views);
  opencl::Kernel<cl::Buffer, cl::Buffer, cl_int, cl_int, cl_int, cl_int, cl_int, cl_int> kernel(
      state_, "field/fbp/join_columns", "join_columns", {{"VDVR_RATE", std::to_string(wanted.phases)}});
  kernel({{count(wanted.phase_stride), count(columns_.count * wanted.phases), count(views)}, {16, 1, 1}},
         out.buffer(), values.buffer(), to_int(views), to_int(columns_.count), to_int(rows_.count),
         to_int(wanted.first), to_int(wanted.rows), to_int(wanted.phase_stride));
}

void DenseValues::resize(opencl::DeviceArray<float>& array, std::uint64_t size, const char* what) {
  if (array.size() == size) return;
  array = {};  // before the next one is allocated
  array = opencl::DeviceArray<float>(state_, size, what);
}

}  // namespace vdvr
